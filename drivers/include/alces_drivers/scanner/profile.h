// One sweep of a 2D laser.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace alces {

/// Ranges in the laser's scan plane. Ray i was measured at first_ray_stamp_ns + i * ray_interval_ns and
/// points along first_angle_rad + i * angle_step_rad, anticlockwise about the laser's z axis, 0 along its x
/// axis (straight ahead).
struct Profile {
  static constexpr std::uint32_t maximum_rays = 1200;  ///< LMS 5xx: 190 deg at 1/6 deg has 1141

  std::int64_t first_ray_stamp_ns = 0;
  double ray_interval_ns = 0;
  double first_angle_rad = 0;
  double angle_step_rad = 0;
  std::uint8_t laser = 0;     ///< which of the configured lasers
  std::uint32_t counter = 0;  ///< the device's own count of sweeps or telegrams, where it has one
  bool has_counter = false;
  std::uint32_t count = 0;                    ///< of rays
  std::array<float, maximum_rays> range_m{};  ///< 0: no measurement (no echo, dazzled, masked)

  [[nodiscard]] std::span<const float> ranges_m() const { return {range_m.data(), count}; }
};

class ProfileSink {
 public:
  /// The profile is the caller's and is overwritten by the next one.
  virtual void on_profile(const Profile& profile) = 0;

 protected:
  ~ProfileSink() = default;
};

}  // namespace alces
