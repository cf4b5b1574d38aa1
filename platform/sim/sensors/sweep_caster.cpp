#include "alces_platform/sim/sensors/sweep_caster.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "alces_platform/parallel.h"
#include "alces_platform/sim/random.h"

namespace alces::sim {
namespace {

/// A guess is right if it is this near: 2 us and 0.1 mrad are 2 mm at 20 m, an eighth of the noise.
constexpr std::int64_t stamp_tolerance_ns = 2'000;
constexpr double angle_tolerance_rad = 1e-4;

std::int64_t after(std::int64_t stamp_ns, double duration_ns) {
  return stamp_ns + std::llround(duration_ns);
}

/// Which rays measure.
std::vector<bool> rays_of(const Rings& rings, std::size_t rays, double field_of_view_rad) {
  std::vector<bool> measures(rays, rings.count == 0);
  if (rays < 2) return measures;
  for (std::uint32_t ring = 0; ring < rings.count; ++ring) {
    const double share = rings.count > 1 ? static_cast<double>(ring) / (rings.count - 1) - 0.5 : 0;
    const double place = (share * rings.span_rad / field_of_view_rad + 0.5) * static_cast<double>(rays - 1);
    if (place < 0 || place > static_cast<double>(rays - 1)) continue;
    measures[static_cast<std::size_t>(std::lround(place))] = true;
  }
  return measures;
}

}  // namespace

void SweepCaster::cast(const SweepRequest& request) const {
  const std::size_t rays = request.ranges_m.size();
  if (rays == 0) return;
  const auto limit_m = static_cast<float>(errors_.max_range_m);
  const double drop_m = request.body_from_laser.translation_m.z() - geometry_.deck_height_m;
  const Eigen::Vector2d axis_m = geometry_.body_from_head.translation_m.head<2>();
  RangeMeter meter(errors_);
  Random random(request.seed);
  const std::vector<bool> measures = rays_of(rings_, rays, request.field_of_view_rad);
  const std::vector<Pole> people =
      crowd_ == nullptr ? std::vector<Pole>() : crowd_->at(request.middle_stamp_ns);
  for (std::size_t ray = 0; ray < rays; ++ray) {
    if (!measures[ray]) {
      request.ranges_m[ray] = 0;
      continue;
    }
    const double fraction = rays > 1 ? static_cast<double>(ray) / static_cast<double>(rays - 1) : 0.5;
    const double angle = (fraction - 0.5) * request.field_of_view_rad;
    const Eigen::Vector3d direction(std::cos(angle), std::sin(angle), 0);

    const Eigen::Vector3d in_body = request.body_from_laser.rotation * direction;
    if (in_body.z() < 0) {  // perhaps the own deck
      const double range_m = drop_m / -in_body.z();
      const Eigen::Vector2d there_m =
          request.body_from_laser.translation_m.head<2>() + range_m * in_body.head<2>() - axis_m;
      if (there_m.squaredNorm() < geometry_.deck_radius_m * geometry_.deck_radius_m) {
        request.ranges_m[ray] = static_cast<float>(meter.measure_near(range_m, random));
        continue;
      }
    }
    const Pose town_from_laser =
        interpolate(request.town_from_laser_begin, request.town_from_laser_end, fraction);
    const Eigen::Vector3f origin = town_from_laser.translation_m.cast<float>();
    const Eigen::Vector3f towards = (town_from_laser.rotation * direction).cast<float>();
    Hit hit = scene_.cast(origin, towards, limit_m);
    for (const Pole& person : people) meets(person, origin, towards, hit);
    request.ranges_m[ray] = static_cast<float>(meter.measure(hit, random));
  }
}

void SweepCaster::cast(std::span<const SweepRequest> requests, bool is_parallel) const {
  if (is_parallel && requests.size() > 1) {
    for_each_index(requests.size(), [&](std::size_t i) { cast(requests[i]); });
  } else {
    for (const SweepRequest& request : requests) cast(request);
  }
}

LaserSweeps::LaserSweeps(const Settings& settings, const SweepCaster& caster, const VehicleMotion& motion,
                         const HeadTrack& head, const RigGeometry& geometry)
    : settings_(settings), caster_(caster), motion_(motion), head_(head), geometry_(geometry) {}

LaserSweeps::Guess LaserSweeps::guess(std::int64_t first_ray_stamp_ns, double ray_interval_ns,
                                      std::size_t rays) const {
  Guess guess;
  guess.first_ray_stamp_ns = first_ray_stamp_ns;
  const double duration_ns = ray_interval_ns * static_cast<double>(rays - 1);
  guess.begin_angle_rad = head_.angle_rad(first_ray_stamp_ns);
  guess.end_angle_rad = head_.angle_rad(after(first_ray_stamp_ns, duration_ns));
  guess.ranges_m.resize(rays);
  return guess;
}

SweepRequest LaserSweeps::request(Guess& guess, double ray_interval_ns) const {
  const std::int64_t begin_ns = guess.first_ray_stamp_ns;
  const std::int64_t end_ns =
      after(begin_ns, ray_interval_ns * static_cast<double>(guess.ranges_m.size() - 1));
  const Pose begin = geometry_.body_from_laser(settings_.laser, guess.begin_angle_rad);
  const Pose end = geometry_.body_from_laser(settings_.laser, guess.end_angle_rad);
  SweepRequest request;
  request.town_from_laser_begin = motion_.town_from_body(begin_ns) * begin;
  request.town_from_laser_end = motion_.town_from_body(end_ns) * end;
  request.body_from_laser = interpolate(begin, end, 0.5);
  request.field_of_view_rad = settings_.field_of_view_rad;
  request.middle_stamp_ns = begin_ns + (end_ns - begin_ns) / 2;
  request.seed = mix(settings_.seed, settings_.laser, static_cast<std::uint64_t>(begin_ns));
  request.ranges_m = guess.ranges_m;
  return request;
}

void LaserSweeps::cast_ahead(std::int64_t first_ray_stamp_ns, double ray_interval_ns, std::size_t rays) {
  const bool guesses = period_ns_ > 0 && patience_sweeps_ == 0;
  const std::size_t count = guesses ? std::max<std::size_t>(1, settings_.batch) : 1;
  counters_.wasted += guesses_.size();
  guesses_.clear();
  std::vector<SweepRequest> requests;
  guesses_.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    guesses_.push_back(
        guess(first_ray_stamp_ns + static_cast<std::int64_t>(i) * period_ns_, ray_interval_ns, rays));
  for (Guess& one : guesses_) requests.push_back(request(one, ray_interval_ns));
  caster_.cast(requests, settings_.is_parallel);
}

void LaserSweeps::sweep(std::int64_t first_ray_stamp_ns, double ray_interval_ns, std::span<float> ranges_m) {
  if (ranges_m.empty()) return;
  ++counters_.sweeps;
  const Guess needed = guess(first_ray_stamp_ns, ray_interval_ns, ranges_m.size());
  const bool is_right = !guesses_.empty() && [&] {
    const Guess& next = guesses_.front();
    return next.ranges_m.size() == ranges_m.size() &&
           std::abs(next.first_ray_stamp_ns - first_ray_stamp_ns) <= stamp_tolerance_ns &&
           std::abs(next.begin_angle_rad - needed.begin_angle_rad) <= angle_tolerance_rad &&
           std::abs(next.end_angle_rad - needed.end_angle_rad) <= angle_tolerance_rad;
  }();
  if (is_right) {
    ++counters_.guessed;
    wrong_in_a_row_ = 0;
  } else {
    // Guessing wrong costs a batch each time: wait longer after each.
    if (!guesses_.empty()) {
      wrong_in_a_row_ = std::min<std::uint32_t>(wrong_in_a_row_ + 1, 4);
      patience_sweeps_ = 1U << wrong_in_a_row_;
    } else if (patience_sweeps_ > 0) {
      --patience_sweeps_;
    }
    period_ns_ = last_stamp_ns_ == INT64_MIN ? 0 : first_ray_stamp_ns - last_stamp_ns_;
    if (period_ns_ > 200'000'000) period_ns_ = 0;  // it had stopped
    cast_ahead(first_ray_stamp_ns, ray_interval_ns, ranges_m.size());
  }
  last_stamp_ns_ = first_ray_stamp_ns;
  std::ranges::copy(guesses_.front().ranges_m, ranges_m.begin());
  guesses_.erase(guesses_.begin());
}

}  // namespace alces::sim
