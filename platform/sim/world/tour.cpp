#include "alces_platform/sim/world/tour.h"

#include <algorithm>
#include <cmath>

#include "alces_platform/sim/random.h"

namespace alces::sim {

using Eigen::Vector2d;

namespace {

constexpr double spacing_m = 0.25;  // of the points along the driven line

// Moving average over `window` points on either side, three times: rounds the corners.
std::vector<Vector2d> smooth(std::vector<Vector2d> line, int window, bool closed) {
  const int size = static_cast<int>(line.size());
  for (int pass = 0; pass < 3; ++pass) {
    std::vector<Vector2d> smoothed(line.size());
    for (int i = 0; i < size; ++i) {
      // at open ends the window narrows
      const int half = closed ? window : std::min({window, i, size - 1 - i});
      Vector2d sum = Vector2d::Zero();
      for (int j = i - half; j <= i + half; ++j) sum += line[static_cast<std::size_t>((j + size) % size)];
      smoothed[static_cast<std::size_t>(i)] = sum / (2 * half + 1);
    }
    line = std::move(smoothed);
  }
  return line;
}

}  // namespace

Tour make_tour(std::size_t scans, std::uint64_t seed) {
  return make_tour_of_way(static_cast<double>(scans) * way_per_scan_m, seed);
}

Tour make_tour_of_way(double way_m, std::uint64_t seed) {
  Tour tour;
  tour.layout.seed = seed;
  Random random(mix(seed, 20));
  const auto lines = [&](double middle_m) {
    std::vector<double> at{0};
    for (int block = 0; block < 5; ++block) {
      const double jitter = random.uniform(-5, 5);
      at.push_back(at.back() + (block == 2 && middle_m > 0 ? middle_m : 47.0 + jitter));
    }
    return at;
  };
  if (way_m < 308) {
    // Around the middle block: a fifth of the way is driven twice.
    const double side_m = std::max(16.0, 0.21 * way_m);
    tour.layout.column_lines_m = lines(side_m);
    tour.layout.row_lines_m = lines(side_m);
    tour.crossings = {{2, 2}, {3, 2}, {3, 3}, {2, 3}};
    tour.start_fraction = 0.4;
    return tour;
  }
  tour.layout.column_lines_m = lines(0);
  tour.layout.row_lines_m = lines(0);
  tour.crossings = {{0, 0}, {1, 0}, {2, 0}, {2, 1}, {1, 1},  // around a block,
                    {1, 0}, {2, 0}, {3, 0}, {3, 1}, {3, 2}, {2, 2},
                    {2, 1}, {1, 1}, {0, 1}, {0, 2}, {1, 2},  // a second, larger loop about it,
                    {1, 1}, {2, 1}, {2, 2}, {3, 2}, {3, 3}, {2, 3},
                    {1, 3}, {1, 2}, {0, 2}, {0, 1}};  // and home, partly against the way it came
  for (auto& crossing : tour.crossings) crossing += Eigen::Vector2i(1, 1);
  tour.start_fraction = 0.3;
  return tour;
}

TourLine::TourLine(const Tour& tour, const Town& town) : is_closed_(tour.closed) {
  const auto& layout = tour.layout;
  const auto crossing = [&](std::size_t index) {
    const Eigen::Vector2i& lines = tour.crossings[index % tour.crossings.size()];
    return Vector2d(layout.column_lines_m[static_cast<std::size_t>(lines.x())],
                    layout.row_lines_m[static_cast<std::size_t>(lines.y())]);
  };
  std::vector<Vector2d> axis;
  double shortest_m = 1e9;
  const std::size_t streets = tour.crossings.size() - (tour.closed ? 0 : 1);
  for (std::size_t street = 0; street < streets; ++street) {
    const Vector2d from = crossing(street);
    const Vector2d to = crossing(street + 1);
    shortest_m = std::min(shortest_m, (to - from).norm());
    const int steps = static_cast<int>((to - from).norm() / spacing_m);
    for (int step = 0; step < steps; ++step) {
      const Vector2d plan = from + (to - from) * step / steps;
      const Vector2d right = Vector2d((to - from).y(), -(to - from).x()).normalized();
      axis.push_back(town.place(plan + 0.5 * right));  // keeps a little to the right
    }
  }
  const int window = static_cast<int>(std::min(3.2, 0.14 * shortest_m) / spacing_m);
  line_ = smooth(std::move(axis), window, tour.closed);

  way_m_.push_back(0);
  for (std::size_t i = 1; i <= line_.size(); ++i)
    way_m_.push_back(way_m_.back() + (line_[i % line_.size()] - line_[i - 1]).norm());
  length_m_ = tour.closed ? way_m_.back() : way_m_[line_.size() - 1];
  start_m_ =
      tour.start_fraction * way_m_[static_cast<std::size_t>((crossing(1) - crossing(0)).norm() / spacing_m)];
}

TourLine::Place TourLine::at(double way_m) const {
  double rest = is_closed_ ? std::fmod(way_m, length_m_) : std::clamp(way_m, 0.0, length_m_ - 0.01);
  if (rest < 0) rest += length_m_;
  const auto next = std::upper_bound(way_m_.begin(), way_m_.end(), rest);
  const auto index = static_cast<std::size_t>(next - way_m_.begin() - 1) % line_.size();
  const Vector2d& a = line_[index];
  const Vector2d& b = line_[(index + 1) % line_.size()];
  return {a + (b - a) * (rest - way_m_[index]) / (way_m_[index + 1] - way_m_[index]), (b - a).normalized()};
}

Vector2d TourLine::forward(double way_m) const {
  const Vector2d forward = (at(way_m + 0.5).xy_m - at(way_m - 0.5).xy_m).normalized();
  return forward.squaredNorm() < 0.5 ? at(way_m).forward : forward;
}

Stand stand_on(const Town& town, const Vector2d& xy_m, double yaw_rad) {
  const Vector2d x_axis(std::cos(yaw_rad), std::sin(yaw_rad));
  const Vector2d y_axis(-x_axis.y(), x_axis.x());
  constexpr double half_length = 0.4, half_width = 0.3;
  double mean = 0, pitch = 0, roll = 0;
  for (const double along : {-1.0, 1.0}) {
    for (const double across : {-1.0, 1.0}) {
      const double height = town.height_m(xy_m + along * half_length * x_axis + across * half_width * y_axis);
      mean += 0.25 * height;
      pitch -= 0.25 * along * height / half_length;
      roll += 0.25 * across * height / half_width;
    }
  }
  return {mean, std::atan(pitch), std::atan(roll)};
}

}  // namespace alces::sim
