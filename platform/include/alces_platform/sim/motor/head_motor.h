// What turns the scanner's head: the seam between the simulated motor drive and everything that looks at the
// head.
#pragma once

#include <cmath>
#include <cstdint>
#include <deque>

namespace alces::sim {

/// The head's true angle, read at the present time only: asked with times that never decrease.
class HeadMotor {
 public:
  /// Anticlockwise seen from above; not wrapped: it goes on counting after a turn.
  [[nodiscard]] virtual double angle_rad(std::int64_t now_ns) = 0;
  [[nodiscard]] virtual double velocity_rad_per_s(std::int64_t now_ns) = 0;

 protected:
  ~HeadMotor() = default;
};

/// Turns without being asked to: up a ramp from standstill, then at one speed for ever. For tests of
/// everything but the drive.
class SteadyHead final : public HeadMotor {
 public:
  SteadyHead(std::int64_t start_stamp_ns, double speed_rad_per_s, double ramp_s = 1,
             double first_angle_rad = 1);

  [[nodiscard]] double angle_rad(std::int64_t now_ns) override;
  [[nodiscard]] double velocity_rad_per_s(std::int64_t now_ns) override;

 private:
  std::int64_t start_stamp_ns_;
  double speed_rad_per_s_;
  double ramp_s_;
  double first_angle_rad_;
};

/// The head's recent past: samples of a HeadMotor, with the angle at any time in between.
class HeadTrack {
 public:
  static constexpr std::int64_t kept_ns = 1'000'000'000;

  /// Samples in the order of time; a sample at the time of the last one replaces it.
  void add(std::int64_t stamp_ns, double angle_rad, double velocity_rad_per_s);

  /// Cubic between samples (position and velocity of both ends), linear beyond the newest and before the
  /// oldest. 0 without samples.
  [[nodiscard]] double angle_rad(std::int64_t stamp_ns) const;

 private:
  struct Sample {
    std::int64_t stamp_ns = 0;
    double angle_rad = 0;
    double velocity_rad_per_s = 0;
  };
  std::deque<Sample> samples_;
};

}  // namespace alces::sim
