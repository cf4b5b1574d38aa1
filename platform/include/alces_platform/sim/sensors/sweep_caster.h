// Sweeps of the scanner's lasers while vehicle and head move: each ray leaves from where the laser is at its
// own time.
//
// SweepCaster casts any sweeps, a batch of them on all cores. LaserSweeps is one laser's SweepSource: it
// guesses the next sweeps (their times are regular, the head turns steadily), has a batch of them cast at
// once, and hands out those whose guess was right. The guess does not depend on how many cores there are: a
// run is the same with one or many.
//
// Cost: 0.8 us a ray, 0.15 ms a sweep: 22 ms of CPU for a second of two lasers, shared by the cores.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "alces/pose.h"
#include "alces_platform/sim/motor/head_motor.h"
#include "alces_platform/sim/rig_geometry.h"
#include "alces_platform/sim/sensors/sweep_source.h"
#include "alces_platform/sim/world/crowd.h"
#include "alces_platform/sim/world/range_errors.h"
#include "alces_platform/sim/world/scene.h"
#include "alces_platform/sim/world/vehicle_motion.h"

namespace alces::sim {

/// Poses at the first and the last ray; in between, rays are cast from interpolated ones.
struct SweepRequest {
  Pose town_from_laser_begin;
  Pose town_from_laser_end;
  Pose body_from_laser;              ///< in the middle: for the own vehicle
  double field_of_view_rad = 0;      ///< centred on the laser's x axis
  std::int64_t middle_stamp_ns = 0;  ///< where people are
  std::uint64_t seed = 0;            ///< of the sweep's noise
  std::span<float> ranges_m;         ///< filled; 0: no echo
};

/// A sensor of few rings out of a laser of many rays: of each sweep only these measure, the rays nearest to
/// `count` angles spread evenly over `span_rad` about the laser's x axis. The scan plane stands upright and
/// turns with the head, so each of these rays draws a cone round the head's axis, as a beam of a multi-beam
/// lidar does.
struct Rings {
  std::uint32_t count = 0;              ///< 0: every ray measures
  double span_rad = 0.523598775598299;  ///< 30 deg: with 16 rings they are 2 deg apart, from -15 to 15 deg
};

class SweepCaster {
 public:
  /// `crowd` may be null.
  SweepCaster(const Scene& scene, const Crowd* crowd, const RangeErrors& errors, const RigGeometry& geometry,
              const Rings& rings)
      : scene_(scene), crowd_(crowd), errors_(errors), geometry_(geometry), rings_(rings) {}

  void cast(const SweepRequest& request) const;
  /// The same sweeps, shared by all cores if `is_parallel`.
  void cast(std::span<const SweepRequest> requests, bool is_parallel) const;

 private:
  const Scene& scene_;
  const Crowd* crowd_;
  RangeErrors errors_;
  RigGeometry geometry_;
  Rings rings_;
};

class LaserSweeps final : public SweepSource {
 public:
  struct Settings {
    std::uint8_t laser = 0;
    std::uint64_t seed = 1;
    double field_of_view_rad = 3.14159265358979323846;
    std::size_t batch = 16;  ///< sweeps that are cast ahead; 1: none
    bool is_parallel = true;
  };
  /// How good the guesses were.
  struct Counters {
    std::uint64_t sweeps = 0;
    std::uint64_t guessed = 0;  ///< of these: had been cast ahead
    std::uint64_t wasted = 0;   ///< cast ahead for nothing
    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("sweeps", sweeps);
      visit("guessed", guessed);
      visit("wasted", wasted);
    }
  };

  LaserSweeps(const Settings& settings, const SweepCaster& caster, const VehicleMotion& motion,
              const HeadTrack& head, const RigGeometry& geometry);

  void sweep(std::int64_t first_ray_stamp_ns, double ray_interval_ns, std::span<float> ranges_m) override;

  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  struct Guess {
    std::int64_t first_ray_stamp_ns = 0;
    double begin_angle_rad = 0;
    double end_angle_rad = 0;
    std::vector<float> ranges_m;
  };
  [[nodiscard]] Guess guess(std::int64_t first_ray_stamp_ns, double ray_interval_ns, std::size_t rays) const;
  [[nodiscard]] SweepRequest request(Guess& guess, double ray_interval_ns) const;
  void cast_ahead(std::int64_t first_ray_stamp_ns, double ray_interval_ns, std::size_t rays);

  Settings settings_;
  const SweepCaster& caster_;
  const VehicleMotion& motion_;
  const HeadTrack& head_;
  RigGeometry geometry_;
  std::vector<Guess> guesses_;  ///< not yet handed out, in the order of time
  std::int64_t last_stamp_ns_ = INT64_MIN;
  std::int64_t period_ns_ = 0;         ///< between the last two sweeps
  std::uint32_t patience_sweeps_ = 0;  ///< after a wrong guess: so many sweeps without guessing
  std::uint32_t wrong_in_a_row_ = 0;
  Counters counters_;
};

}  // namespace alces::sim
