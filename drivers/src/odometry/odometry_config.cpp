#include <cmath>

#include "alces_drivers/odometry/odometry.h"

namespace alces {
namespace {

bool is_positive(double value) {
  return std::isfinite(value) && value > 0;
}

}  // namespace

const char* validate(const OdometryConfig& config) {
  for (const CanSignalSource* source :
       {&config.left_speed_m_s, &config.right_speed_m_s, &config.speed_m_s, &config.yaw_rate_rad_s,
        &config.roll_rate_rad_s, &config.pitch_rate_rad_s, &config.alive_counter}) {
    if (!source->exists()) continue;
    if (!is_valid(source->signal)) return "a signal's length, start bit, factor or offset is impossible";
    if (source->id > (source->is_extended ? 0x1FFFFFFFU : 0x7FFU))
      return "a signal's CAN identifier is too large";
  }
  if (config.kind == OdometryKind::wheels) {
    if (!config.left_speed_m_s.exists() || !config.right_speed_m_s.exists()) {
      return "odometry from wheels needs left_speed_m_s and right_speed_m_s";
    }
    if (!is_positive(config.wheel_base_m)) return "wheel_base_m is not positive";
  } else if (!config.speed_m_s.exists() || !config.yaw_rate_rad_s.exists()) {
    return "odometry from the vehicle needs speed_m_s and yaw_rate_rad_s";
  }
  if (!is_positive(config.maximum_speed_m_s) || !is_positive(config.maximum_rate_rad_s) ||
      !is_positive(config.maximum_acceleration_m_s2) || !is_positive(config.maximum_rate_change_rad_s2)) {
    return "what the vehicle can do at most is not positive";
  }
  if (!(config.standstill_speed_m_s >= 0) || !(config.maximum_bias_rad_s >= 0)) {
    return "standstill_speed_m_s or maximum_bias_rad_s is negative";
  }
  constexpr std::int64_t hour_ns = 3600 * ns_per_s;
  for (const std::int64_t duration_ns :
       {config.latency_ns, config.standstill_ns, config.maximum_wait_ns, config.maximum_extrapolation_ns,
        config.timeout_ns, config.frozen_after_ns, config.alive_timeout_ns}) {
    if (duration_ns < 0 || duration_ns > hour_ns) return "a duration is negative or longer than an hour";
  }
  const OdometryErrors& errors = config.errors;
  for (const double error : {errors.way, errors.slip, errors.turn, errors.bias_rad_s,
                             errors.noise_rad_per_sqrt_s, errors.tilt_rad}) {
    if (!std::isfinite(error) || error < 0) return "an error of the odometry is negative or no number";
  }
  if (config.timeout_ns == 0 || config.standstill_ns == 0) return "timeout_ns or standstill_ns is 0";
  return nullptr;
}

}  // namespace alces
