// A synthetic drive through a town, with everything a mapper gets (points, odometry) and what it is measured
// by (truth). Scans are cast when asked for: about 20 ms each, nothing is kept. A drive is a function of its
// settings alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "alces/point.h"
#include "alces/pose.h"
#include "alces_platform/sim/scanner.h"
#include "alces_platform/sim/world/route.h"
#include "alces_platform/sim/world/town.h"

namespace alces::sim {

/// Wheels and a gyro: planar, and wrong like a real one.
struct OdometrySettings {
  double scale_error = 0.015;            ///< of the way, either sign
  double way_noise = 0.01;               ///< standard deviation, share of a step
  double heading_bias_deg_per_m = 0.02;  ///< standard deviation of the constant part
  double heading_walk_deg = 0.15;        ///< standard deviation a step
  double turn_scale_error = 0.01;        ///< share of a turn
};

/// What such wheels and gyro say of a way: identity at first.
[[nodiscard]] std::vector<Pose> planar_odometry(const std::vector<Pose>& truth,
                                                const OdometrySettings& settings, std::uint64_t seed);

struct DriveSettings {
  std::size_t scans = 924;
  std::uint64_t seed = 1;
  ScannerSettings scanner;
  OdometrySettings odometry;
};

class Drive {
 public:
  Drive(const DriveSettings& settings, const Tour& tour);

  [[nodiscard]] std::size_t size() const { return truth_.size(); }
  /// The points of scan `index`, in its body frame; any thread, any order, always the same.
  void points(std::size_t index, std::vector<Point>& points) const;
  [[nodiscard]] std::vector<Point> points(std::size_t index) const;
  /// map_from_body, the map being the body frame of scan 0.
  [[nodiscard]] const Pose& truth(std::size_t index) const { return truth_[index]; }
  /// The same as the odometry has it: planar, drifting, identity at scan 0.
  [[nodiscard]] const Pose& odometry(std::size_t index) const { return odometry_[index]; }
  /// Rays cast a scan.
  [[nodiscard]] std::size_t rays() const { return scanner_.rays(); }
  /// Way round the tour before it starts over.
  [[nodiscard]] double tour_length_m() const { return tour_length_m_; }
  [[nodiscard]] const Town& town() const { return *town_; }
  [[nodiscard]] const Pose& town_from_body(std::size_t index) const { return town_from_body_[index]; }

 private:
  std::shared_ptr<const Town> town_;
  Scanner scanner_;
  std::vector<Pose> town_from_body_, truth_, odometry_;
  double tour_length_m_ = 0;
};

[[nodiscard]] Drive drive(const DriveSettings& settings);

/// A drive along one street, of which two stretches 384 m apart are built alike (houses, trees, ground; not
/// the parked cars): scans `first` and `second` see the same, though they are far from each other. 394 scans.
struct LookAlike {
  Drive drive;
  std::size_t first;
  std::size_t second;
  Pose first_from_second;  ///< the false match: where the second scan seems to have been taken, seen from the
                           ///< first
};
[[nodiscard]] LookAlike look_alike_drive(std::uint64_t seed, const DriveSettings& settings = {});

}  // namespace alces::sim
