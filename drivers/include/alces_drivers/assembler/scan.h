// One assembled 3D scan: points in the body frame at its reference time, motion taken out.
#pragma once

#include <cstdint>
#include <span>

#include <Eigen/Core>

#include "alces/point.h"
#include "alces/pose.h"

namespace alces {

struct Scan {
  std::uint32_t number = 0;  ///< counted from 0 since the scanner started, incomplete ones included
  std::int64_t reference_stamp_ns =
      0;  ///< the time whose body frame the points are in: the middle of the scan
  std::int64_t begin_stamp_ns = 0;
  std::int64_t end_stamp_ns = 0;
  std::span<const Point> points;  ///< the assembler's, valid during the call
  Pose odometry_from_body;        ///< at the reference time
  bool has_odometry = false;
  Eigen::Vector3d gps_position_m =
      Eigen::Vector3d::Zero();  ///< east, north, up of the first fix; loop detection only
  bool has_gps = false;
  bool is_incomplete = false;  ///< profiles are missing, or the turn was not finished
  std::uint32_t profiles = 0;  ///< that went in
  std::uint32_t profiles_missing = 0;
  std::uint32_t rays_without_range = 0;
  double head_turn_rad = 0;    ///< how far the head turned
  double angle_sigma_rad = 0;  ///< the worst uncertainty of the head's angle among the profiles
};

class ScanSink {
 public:
  virtual void on_scan(const Scan& scan) = 0;

 protected:
  ~ScanSink() = default;
};

}  // namespace alces
