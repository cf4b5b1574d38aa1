#include "alces/free_space.h"

#include <algorithm>
#include <cmath>

#include "geometry/float_transform.h"

namespace alces {
namespace {

struct Cell {
  std::int32_t face;
  std::int32_t u;
  std::int32_t v;
};

// The cell of a direction, which is not zero.
Cell cell_of(const Point& p, std::int32_t face_size) {
  const float x = std::abs(p.x);
  const float y = std::abs(p.y);
  const float z = std::abs(p.z);
  const float half = 0.5F * static_cast<float>(face_size);
  const auto index = [&](float along, float longest) {
    const auto cell = static_cast<std::int32_t>((along / longest + 1) * half);
    return std::clamp(cell, std::int32_t{0}, face_size - 1);
  };
  if (x >= y && x >= z) return {p.x > 0 ? 0 : 1, index(p.y, x), index(p.z, x)};
  if (y >= z) return {p.y > 0 ? 2 : 3, index(p.x, y), index(p.z, y)};
  return {p.z > 0 ? 4 : 5, index(p.x, z), index(p.y, z)};
}

}  // namespace

bool is_clearly_more(const FreeSpaceCount& more, const FreeSpaceCount& less, double sigmas) {
  constexpr double together = 10;
  const auto variance = [](const FreeSpaceCount& count) {
    // Of a share that is known from few: one more of each sort (Laplace), so that none of none is no proof.
    const double all = count.known() / together + 2;
    const double share = (count.standing / together + 1) / all;
    return share * (1 - share) / all;
  };
  return more.share() - less.share() > sigmas * std::sqrt(variance(more) + variance(less));
}

bool lies_apart(const FreeSpaceCount& count, const FreeSpaceCount& usual, double sigmas) {
  const auto told = [](const FreeSpaceCount& of) { return of.known() + of.hidden; };
  const auto in_sight = [&told](const FreeSpaceCount& of) {
    return static_cast<double>(of.known()) / std::max(std::uint32_t{1}, told(of));
  };
  const bool tells_enough = told(count) > 0 && 2 * told(count) >= told(usual);
  return tells_enough && 2 * in_sight(count) < in_sight(usual) && !is_clearly_more(count, usual, sigmas);
}

void FreeSpace::look(const KdTree& scan) {
  constexpr float least_range_m = 1e-3F;
  std::ranges::fill(ranges_m_, unseen);
  for (std::uint32_t i = 0; i < scan.size(); ++i) {
    const Point p = scan.point(i);
    const float range_m = std::sqrt(dot(p, p));
    if (!(range_m > least_range_m)) continue;
    const Cell cell = cell_of(p, face_size);
    float& shortest_m =
        ranges_m_[static_cast<std::size_t>((cell.face * face_size + cell.v) * face_size + cell.u)];
    if (shortest_m < 0 || range_m < shortest_m) shortest_m = range_m;
  }
  // Beyond the edge of a face lie others; what is not asked there counts as unknown.
  constexpr int enough = 5;  // of nine
  for (std::int32_t face = 0; face < 6; ++face) {
    for (std::int32_t v = 0; v < face_size; ++v) {
      for (std::int32_t u = 0; u < face_size; ++u) {
        int known = 0;
        float shortest_m = unseen;
        for (std::int32_t dv = -1; dv <= 1; ++dv) {
          for (std::int32_t du = -1; du <= 1; ++du) {
            const bool is_on_face = u + du >= 0 && u + du < face_size && v + dv >= 0 && v + dv < face_size;
            if (!is_on_face) continue;
            const float range_m =
                ranges_m_[static_cast<std::size_t>((face * face_size + v + dv) * face_size + u + du)];
            if (range_m < 0) continue;
            ++known;
            if (shortest_m < 0 || range_m < shortest_m) shortest_m = range_m;
          }
        }
        const auto cell = static_cast<std::size_t>((face * face_size + v) * face_size + u);
        nearest_m_[cell] = known >= enough && ranges_m_[cell] >= 0 ? shortest_m : unseen;
      }
    }
  }
}

FreeSpaceCount FreeSpace::count(const KdTree& scan, std::span<const SurfaceSample> samples,
                                const Pose& viewer_from_body, float tolerance_m) const {
  const FloatTransform transform(viewer_from_body);
  FreeSpaceCount count;
  for (const SurfaceSample& sample : samples) {
    const Point p = transform * scan.point(sample.index);
    const float range_m = std::sqrt(dot(p, p));
    if (!(range_m > tolerance_m)) continue;  // the viewer's own place
    const Cell cell = cell_of(p, face_size);
    const auto index = static_cast<std::size_t>((cell.face * face_size + cell.v) * face_size + cell.u);
    const float nearest_m = nearest_m_[index];
    if (nearest_m < 0) continue;
    if (range_m < nearest_m - tolerance_m) {
      ++count.standing;
    } else if (range_m <= ranges_m_[index] + tolerance_m) {
      ++count.agreeing;
    } else {
      ++count.hidden;
    }
  }
  return count;
}

}  // namespace alces
