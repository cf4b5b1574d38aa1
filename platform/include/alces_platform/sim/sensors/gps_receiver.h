// A GPS receiver on a serial line: NMEA 0183, GGA and RMC once a second.
//
// Position error: a slow wander (Gauss-Markov) and white noise, both larger where houses hide the sky.
// Whether there is a fix at all follows from the town: rays go up from the antenna, and below a share of open
// sky the fix is lost, and comes back two seconds after there is enough of it again. The same street has the
// same outages on every lap.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "alces_platform/sim/random.h"
#include "alces_platform/sim/sensors/serial_line.h"
#include "alces_platform/sim/world/scene.h"
#include "alces_platform/sim/world/vehicle_motion.h"

namespace alces::sim {

struct GpsSettings {
  double latitude_deg = 52.3800;  ///< of the town's origin; x is east, y is north
  double longitude_deg = 9.7200;
  double altitude_m = 55;
  double wander_m = 2.0;  ///< standard deviation of east and north under open sky; up: 1.8 times that
  double wander_s = 60;
  double noise_m = 0.4;
  double open_sky_for_fix = 0.7;  ///< share of the sky above 20 deg; of these streets a quarter has less
  double reacquire_s = 2;
  std::uint32_t baud_rate = 9600;
  double latency_s = 0.12;  ///< from the second to the first byte
  std::uint32_t first_time_of_day_s = 10 * 3600;
};

class GpsReceiver final : public SerialDevice {
 public:
  GpsReceiver(const GpsSettings& settings, std::uint64_t seed, const VehicleMotion& motion,
              const Scene& scene, const Eigen::Vector3d& body_from_antenna_m, std::int64_t start_stamp_ns,
              const FaultPlan& faults);

  void on_bytes(std::span<const std::uint8_t>, std::int64_t) override {}
  void poll(std::int64_t now_ns, SerialOutput& output) override;
  [[nodiscard]] std::uint32_t baud_rate() const override { return settings_.baud_rate; }

  /// East, north, up of the town's origin as the receiver's coordinates: for tests.
  struct Geodetic {
    double latitude_deg = 0, longitude_deg = 0, altitude_m = 0;
  };
  [[nodiscard]] Geodetic geodetic(const Eigen::Vector3d& east_north_up_m) const;

 private:
  [[nodiscard]] double open_sky(const Eigen::Vector3d& antenna_m) const;
  void sentences(std::int64_t stamp_ns);
  void append(const char* body);

  GpsSettings settings_;
  const VehicleMotion& motion_;
  const Scene& scene_;
  Eigen::Vector3d body_from_antenna_m_;
  const FaultPlan& faults_;
  Random random_;
  std::int64_t start_stamp_ns_;
  std::int64_t next_ns_;  ///< second
  Eigen::Vector3d wander_m_ = Eigen::Vector3d::Zero();
  double open_for_s_ = 10;
  std::string text_;  ///< not yet sent
};

}  // namespace alces::sim
