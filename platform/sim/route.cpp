#include "alces_platform/sim/route.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "alces_platform/sim/random.h"

namespace alces::sim {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double spacing_m = 0.25;  // of the points along the driven line

// A smooth random function of the way: standard deviation about 1, changing over `length_m`.
class Wander {
 public:
  Wander(std::uint64_t seed, double length_m) {
    Random random(seed);
    for (Tone& tone : tones_)
      tone = {2 * std::numbers::pi / (length_m * random.uniform(0.7, 1.6)),
              random.uniform(0, 2 * std::numbers::pi)};
  }
  [[nodiscard]] double operator()(double way_m) const {
    double sum = 0;
    for (const Tone& tone : tones_) sum += std::sin(tone.frequency * way_m + tone.phase);
    return sum * 0.7071;
  }

 private:
  struct Tone {
    double frequency = 0;
    double phase = 0;
  };
  Tone tones_[4];
};

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
  const double way_m = static_cast<double>(scans) * Route::step_m;
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

Route::Route(const Tour& tour, const Town& town, std::size_t scans, std::uint64_t seed) {
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
  const std::vector<Vector2d> line = smooth(std::move(axis), window, tour.closed);

  std::vector<double> way_m{0};  // along the line, up to each point
  for (std::size_t i = 1; i <= line.size(); ++i)
    way_m.push_back(way_m.back() + (line[i % line.size()] - line[i - 1]).norm());
  length_m_ = tour.closed ? way_m.back() : way_m[line.size() - 1];

  struct Place {
    Vector2d xy;
    Vector2d forward;
  };
  const auto place_at = [&](double way) -> Place {
    double rest = tour.closed ? std::fmod(way, length_m_) : std::clamp(way, 0.0, length_m_ - 0.01);
    if (rest < 0) rest += length_m_;
    const auto next = std::upper_bound(way_m.begin(), way_m.end(), rest);
    const auto index = static_cast<std::size_t>(next - way_m.begin() - 1) % line.size();
    const Vector2d& a = line[index];
    const Vector2d& b = line[(index + 1) % line.size()];
    return {a + (b - a) * (rest - way_m[index]) / (way_m[index + 1] - way_m[index]), (b - a).normalized()};
  };

  const Wander sideways(mix(seed, 30), 60), heading(mix(seed, 31), 25), pace(mix(seed, 32), 45);
  Random bump(mix(seed, 33));
  const double start_m =
      tour.start_fraction * way_m[static_cast<std::size_t>((crossing(1) - crossing(0)).norm() / spacing_m)];
  double driven_m = 0;
  for (std::size_t scan = 0; scan < scans; ++scan) {
    const double way = start_m + driven_m;
    // The heading as an average over a vehicle's length.
    const Place here = place_at(way);
    Vector2d forward = (place_at(way + 0.5).xy - place_at(way - 0.5).xy).normalized();
    if (forward.squaredNorm() < 0.5) forward = here.forward;
    const double off_m = 0.25 * sideways(driven_m);
    const Vector2d xy = here.xy + off_m * Vector2d(-forward.y(), forward.x());
    const double yaw = std::atan2(forward.y(), forward.x()) + 0.02 * heading(driven_m);

    // Four wheels on the ground, and what the suspension and the paving add.
    const Vector2d x_axis(std::cos(yaw), std::sin(yaw));
    const Vector2d y_axis(-x_axis.y(), x_axis.x());
    constexpr double half_length = 0.4, half_width = 0.3;
    double mean = 0, pitch = 0, roll = 0;
    for (const double along : {-1.0, 1.0}) {
      for (const double across : {-1.0, 1.0}) {
        const double height = town.height_m(xy + along * half_length * x_axis + across * half_width * y_axis);
        mean += 0.25 * height;
        pitch -= 0.25 * along * height / half_length;
        roll += 0.25 * across * height / half_width;
      }
    }
    const double rough = bump.chance(0.08) ? 0.02 : 0.005;  // rad
    const double bump_roll = std::clamp(rough * bump.normal(), -0.035, 0.035);
    const double bump_pitch = std::clamp(rough * bump.normal(), -0.035, 0.035);
    const double bump_z = std::abs(0.3 * rough * bump.normal());

    Pose pose;
    pose.rotation = Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) *
                    Eigen::AngleAxisd(std::atan(pitch) + bump_pitch, Vector3d::UnitY()) *
                    Eigen::AngleAxisd(std::atan(roll) + bump_roll, Vector3d::UnitX());
    pose.translation_m = {xy.x(), xy.y(), mean + bump_z};
    town_from_body_.push_back(pose);
    driven_m += step_m * (1.0 + 0.08 * pace(driven_m));
  }
}

}  // namespace alces::sim
