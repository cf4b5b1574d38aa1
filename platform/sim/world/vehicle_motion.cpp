#include "alces_platform/sim/world/vehicle_motion.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "alces_platform/sim/random.h"
#include "alces_platform/sim/world/wander.h"

namespace alces::sim {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// Weighted mean of neighbours by a Gaussian; the ends are repeated.
std::vector<Vector3d> low_pass(const std::vector<Vector3d>& values, double sigma_cells) {
  const int reach = static_cast<int>(std::ceil(3 * sigma_cells));
  if (reach == 0) return values;
  std::vector<double> weights;
  double sum = 0;
  for (int offset = -reach; offset <= reach; ++offset) {
    weights.push_back(std::exp(-0.5 * offset * offset / (sigma_cells * sigma_cells)));
    sum += weights.back();
  }
  const int last = static_cast<int>(values.size()) - 1;
  std::vector<Vector3d> smoothed;
  smoothed.reserve(values.size());
  for (int i = 0; i <= last; ++i) {
    Vector3d mean = Vector3d::Zero();
    for (int offset = -reach; offset <= reach; ++offset) {
      const int weight = offset + reach;
      const int neighbour = std::clamp(i + offset, 0, last);
      mean += weights[static_cast<std::size_t>(weight)] * values[static_cast<std::size_t>(neighbour)];
    }
    smoothed.emplace_back(mean / sum);
  }
  return smoothed;
}

/// Speeds at the ends of cells of equal length: below `limits`, from standstill to standstill, and no change
/// faster than `acceleration`.
std::vector<double> speeds(std::vector<double> limits, double cell_m, double acceleration_m_per_s2) {
  const double gain = 2 * acceleration_m_per_s2 * cell_m;
  limits.front() = 0;
  limits.back() = 0;
  for (std::size_t i = 1; i < limits.size(); ++i)
    limits[i] = std::min(limits[i], std::sqrt(limits[i - 1] * limits[i - 1] + gain));
  for (std::size_t i = limits.size() - 1; i-- > 0;)
    limits[i] = std::min(limits[i], std::sqrt(limits[i + 1] * limits[i + 1] + gain));
  return limits;
}

double duration_s(const std::vector<double>& speed, double cell_m) {
  double sum_s = 0;
  for (std::size_t i = 1; i < speed.size(); ++i) sum_s += 2 * cell_m / (speed[i - 1] + speed[i]);
  return sum_s;
}

}  // namespace

Tour make_tour(const MotionSettings& settings) {
  return make_tour_of_way(
      settings.mean_speed_m_per_s * settings.scan_period_s * static_cast<double>(settings.scans),
      settings.seed);
}

VehicleMotion::VehicleMotion(const MotionSettings& settings, const Tour& tour, const Town& town)
    : settings_(settings) {
  const TourLine line(tour, town);
  tour_length_m_ = line.length_m();
  double wanted_m =
      settings.mean_speed_m_per_s * settings.scan_period_s * static_cast<double>(settings.scans);
  if (!tour.closed) wanted_m = std::min(wanted_m, line.length_m() - line.start_m() - 5);
  const auto cells = static_cast<std::size_t>(std::max(2.0, std::round(wanted_m / cell_m)));
  lay_out(line, town, cells);
  set_timetable(cells);
}

void VehicleMotion::lay_out(const TourLine& line, const Town& town, std::size_t cells) {
  const Wander sideways(mix(settings_.seed, 60), 60);
  const Wander pitch(mix(settings_.seed, 61), settings_.vibration_length_m);
  const Wander roll(mix(settings_.seed, 62), settings_.vibration_length_m);
  const int last = static_cast<int>(cells) + margin_cells;
  std::vector<UniformSpline<2>::Vector> places;
  std::vector<Vector3d> grounds;
  for (int cell = -margin_cells; cell <= last; ++cell) {
    const double driven_m = cell * cell_m;
    const double way_m = line.start_m() + driven_m;
    const Vector2d forward = line.forward(way_m);
    const Vector2d left(-forward.y(), forward.x());
    places.emplace_back(line.at(way_m).xy_m + 0.25 * sideways(driven_m) * left);
    const Stand stand = stand_on(town, places.back(), std::atan2(forward.y(), forward.x()));
    grounds.emplace_back(stand.height_m, stand.pitch_rad, stand.roll_rad);
  }
  std::vector<Vector3d> standing = low_pass(grounds, settings_.suspension_m / cell_m);
  for (std::size_t i = 0; i < standing.size(); ++i) {
    const double driven_m = (static_cast<double>(i) - margin_cells) * cell_m;
    standing[i].y() += settings_.vibration_rad * pitch(driven_m);
    standing[i].z() += settings_.vibration_rad * roll(driven_m);
  }
  const double begin_m = -margin_cells * cell_m;
  xy_m_ = {begin_m, cell_m, std::move(places)};
  standing_ = {begin_m, cell_m, std::move(standing)};
}

void VehicleMotion::set_timetable(std::size_t cells) {
  const Wander pace(mix(settings_.seed, 63), 45);
  std::vector<double> bend_limit(cells + 1), pace_factor(cells + 1);
  for (std::size_t i = 0; i <= cells; ++i) {
    const double way_m = static_cast<double>(i) * cell_m;
    const auto place = xy_m_.at(way_m);
    const double curvature =
        std::abs(place.first.x() * place.second.y() - place.first.y() * place.second.x()) /
        std::pow(place.first.norm(), 3);
    bend_limit[i] = settings_.mean_speed_m_per_s / (settings_.bend_radius_m * std::max(curvature, 1e-6));
    pace_factor[i] = 1 + 0.08 * pace(way_m);
  }
  const auto speeds_at = [&](double cruise_m_per_s) {
    std::vector<double> limits(cells + 1);
    for (std::size_t i = 0; i <= cells; ++i)
      limits[i] = std::min(cruise_m_per_s * pace_factor[i], bend_limit[i]);
    return speeds(std::move(limits), cell_m, settings_.acceleration_m_per_s2);
  };

  // The cruising speed that gives the mean; where that would be far above the mean, because bends and ramps
  // take too much of a short drive, the drive takes longer instead.
  const double way_m = static_cast<double>(cells) * cell_m;
  const double wanted_s = way_m / settings_.mean_speed_m_per_s;
  double low = 0.5 * settings_.mean_speed_m_per_s, high = 1.4 * settings_.mean_speed_m_per_s;
  for (int round = 0; round < 40; ++round) {
    const double middle = 0.5 * (low + high);
    (duration_s(speeds_at(middle), cell_m) > wanted_s ? low : high) = middle;
  }
  const std::vector<double> speed = speeds_at(high);
  const double driving_s = duration_s(speed, cell_m);
  roll_stamp_ns_ = settings_.start_stamp_ns + static_cast<std::int64_t>(settings_.standstill_s * 1e9);
  stop_stamp_ns_ = roll_stamp_ns_ + static_cast<std::int64_t>(driving_s * 1e9);

  // The way at each knot in time; the acceleration is constant within a cell.
  using Knot = UniformSpline<1>::Vector;
  std::vector<Knot> knots;
  std::size_t cell = 0;
  double cell_begin_s = settings_.standstill_s;
  const auto knot_count = static_cast<std::size_t>((settings_.standstill_s + driving_s) / knot_s) + 4;
  for (std::size_t knot = 0; knot < knot_count; ++knot) {
    const double time_s = static_cast<double>(knot) * knot_s;
    const auto cell_s = [&] { return 2 * cell_m / (speed[cell] + speed[cell + 1]); };
    while (cell < cells && time_s >= cell_begin_s + cell_s()) {
      cell_begin_s += cell_s();
      ++cell;
    }
    double here_m = static_cast<double>(cell) * cell_m;
    if (cell < cells && time_s > cell_begin_s) {
      const double into_s = time_s - cell_begin_s;
      const double acceleration =
          (speed[cell + 1] * speed[cell + 1] - speed[cell] * speed[cell]) / (2 * cell_m);
      here_m += speed[cell] * into_s + 0.5 * acceleration * into_s * into_s;
    }
    knots.emplace_back(Knot::Constant(here_m));
  }
  // The spline reaches two knots around each of its points: it rolls a little before and stands a little
  // after.
  way_m_ = {0, knot_s, std::move(knots)};
  roll_stamp_ns_ -= static_cast<std::int64_t>(2 * knot_s * 1e9);
  stop_stamp_ns_ += static_cast<std::int64_t>(2 * knot_s * 1e9);
}

double VehicleMotion::way_m(std::int64_t stamp_ns) const {
  return way_m_.at(static_cast<double>(stamp_ns - settings_.start_stamp_ns) * 1e-9).value.x();
}

VehicleMotion::State VehicleMotion::at(std::int64_t stamp_ns) const {
  const auto way = way_m_.at(static_cast<double>(stamp_ns - settings_.start_stamp_ns) * 1e-9);
  const double speed = way.first.x();
  const auto xy = xy_m_.at(way.value.x());
  const auto standing = standing_.at(way.value.x());

  const double yaw = std::atan2(xy.first.y(), xy.first.x());
  const double pitch = standing.value.y();
  const double roll = standing.value.z();
  State state;
  state.town_from_body.rotation = Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(pitch, Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(roll, Vector3d::UnitX());
  state.town_from_body.translation_m = {xy.value.x(), xy.value.y(), standing.value.x()};

  const Vector3d velocity(xy.first.x() * speed, xy.first.y() * speed, standing.first.x() * speed);
  state.velocity_m_per_s = state.town_from_body.rotation.conjugate() * velocity;
  const double yaw_rate =
      speed * (xy.first.x() * xy.second.y() - xy.first.y() * xy.second.x()) / xy.first.squaredNorm();
  const double pitch_rate = speed * standing.first.y();
  const double roll_rate = speed * standing.first.z();
  state.rate_rad_per_s = {roll_rate - yaw_rate * std::sin(pitch),
                          pitch_rate * std::cos(roll) + yaw_rate * std::sin(roll) * std::cos(pitch),
                          -pitch_rate * std::sin(roll) + yaw_rate * std::cos(roll) * std::cos(pitch)};
  return state;
}

}  // namespace alces::sim
