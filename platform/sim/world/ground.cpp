#include "alces_platform/sim/world/ground.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace alces::sim {

Ground::Ground(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
               const std::function<double(double, double)>& height_m)
    : low_(low.cast<float>()) {
  const double tile_m = static_cast<double>(cell_m) * cells_per_tile;
  tile_columns_ = static_cast<int>(std::ceil((high.x() - low.x()) / tile_m));
  tile_rows_ = static_cast<int>(std::ceil((high.y() - low.y()) / tile_m));
  columns_ = tile_columns_ * cells_per_tile + 1;
  rows_ = tile_rows_ * cells_per_tile + 1;
  heights_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column)
      heights_[at(column, row)] = static_cast<float>(height_m(low.x() + column * static_cast<double>(cell_m),
                                                              low.y() + row * static_cast<double>(cell_m)));
  top_m_ = *std::max_element(heights_.begin(), heights_.end());
  for (int tile_row = 0; tile_row < tile_rows_; ++tile_row) {
    for (int tile_column = 0; tile_column < tile_columns_; ++tile_column) {
      float top = -std::numeric_limits<float>::max();
      for (int row = tile_row * cells_per_tile; row <= (tile_row + 1) * cells_per_tile; ++row)
        for (int column = tile_column * cells_per_tile; column <= (tile_column + 1) * cells_per_tile;
             ++column)
          top = std::max(top, heights_[at(column, row)]);
      tile_tops_.push_back(top);
    }
  }
}

float Ground::height_m(float x, float y) const {
  const float u = std::clamp((x - low_.x()) / cell_m, 0.0F, static_cast<float>(columns_) - 1.001F);
  const float v = std::clamp((y - low_.y()) / cell_m, 0.0F, static_cast<float>(rows_) - 1.001F);
  const int column = static_cast<int>(u);
  const int row = static_cast<int>(v);
  const float fu = u - static_cast<float>(column);
  const float fv = v - static_cast<float>(row);
  const std::size_t here = at(column, row);
  const std::size_t above = here + static_cast<std::size_t>(columns_);
  const float lower = heights_[here] + fu * (heights_[here + 1] - heights_[here]);
  const float upper = heights_[above] + fu * (heights_[above + 1] - heights_[above]);
  return lower + fv * (upper - lower);
}

float Ground::cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float limit_m) const {
  const float tile_m = cell_m * static_cast<float>(cells_per_tile);
  const float horizontal = std::hypot(direction.x(), direction.y());
  const float step = std::min(limit_m, 0.2F / std::max(horizontal, 1e-6F));
  const auto clearance = [&](float t) {
    return origin.z() + t * direction.z() -
           height_m(origin.x() + t * direction.x(), origin.y() + t * direction.y());
  };

  // Tiles in the order in which the ray crosses them.
  int tile[2];
  int stride[2];
  float next[2];
  float width[2];
  for (int axis = 0; axis < 2; ++axis) {
    const float position = (origin[axis] - low_[axis]) / tile_m;
    tile[axis] = static_cast<int>(std::floor(position));
    stride[axis] = direction[axis] > 0 ? 1 : -1;
    const float rest = direction[axis] > 0 ? static_cast<float>(tile[axis] + 1) - position
                                           : position - static_cast<float>(tile[axis]);
    const float speed = std::abs(direction[axis]) / tile_m;
    width[axis] = speed > 1e-9F ? 1.0F / speed : std::numeric_limits<float>::max();
    next[axis] = speed > 1e-9F ? rest / speed : std::numeric_limits<float>::max();
  }

  for (float t = 0; t < limit_m;) {
    if (tile[0] < 0 || tile[1] < 0 || tile[0] >= tile_columns_ || tile[1] >= tile_rows_) return limit_m;
    const float start_z = origin.z() + t * direction.z();
    if (direction.z() >= 0 && start_z > top_m_) return limit_m;
    const float end = std::min(limit_m, std::min(next[0], next[1]));
    const float lowest = std::min(start_z, origin.z() + end * direction.z());
    if (lowest <= tile_tops_[static_cast<std::size_t>(tile[1]) * static_cast<std::size_t>(tile_columns_) +
                             static_cast<std::size_t>(tile[0])]) {
      float before = clearance(t);
      for (float s = t; s < end;) {
        const float s_next = std::min(end, s + step);
        const float after = clearance(s_next);
        if (after < 0) {
          float low = s, high = s_next, low_clearance = std::max(before, 0.0F), high_clearance = after;
          for (int round = 0; round < 3; ++round) {  // false position
            const float middle = low + (high - low) * low_clearance / (low_clearance - high_clearance);
            const float there = clearance(middle);
            (there < 0 ? high : low) = middle;
            (there < 0 ? high_clearance : low_clearance) = there;
            if (std::abs(there) < 1e-4F) break;
          }
          return low + (high - low) * low_clearance / std::max(low_clearance - high_clearance, 1e-9F);
        }
        before = after;
        s = s_next;
      }
    }
    t = end;
    const int axis = next[0] < next[1] ? 0 : 1;
    tile[axis] += stride[axis];
    next[axis] += width[axis];
  }
  return limit_m;
}

}  // namespace alces::sim
