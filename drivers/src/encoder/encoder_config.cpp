#include <cmath>
#include <numbers>

#include "alces_drivers/encoder/encoder.h"

namespace alces {
namespace {

bool is_positive(double value) {
  return std::isfinite(value) && value > 0;
}

bool is_not_negative(double value) {
  return std::isfinite(value) && value >= 0;
}

bool lines_differ(const EncoderConfig& config) {
  const std::array<std::uint8_t, 4> lines{config.index_line, config.a_line, config.b_line, config.sync_line};
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (std::size_t j = i + 1; j < lines.size(); ++j) {
      if (lines[i] == lines[j] && lines[i] != EncoderConfig::no_line) return false;
    }
  }
  return true;
}

}  // namespace

const char* validate(const EncoderConfig& config) {
  constexpr std::uint8_t none = EncoderConfig::no_line;
  if (!lines_differ(config)) return "two signals of the encoder are on one line";
  if ((config.a_line == none) != (config.b_line == none)) return "quadrature needs both lines, A and B";
  if (config.drive_direction != 1 && config.drive_direction != -1)
    return "drive_direction is neither 1 nor -1";
  if (config.quadrature_direction != 1 && config.quadrature_direction != -1) {
    return "quadrature_direction is neither 1 nor -1";
  }
  if (!is_not_negative(config.drive_counts_per_turn)) return "drive_counts_per_turn is negative or no number";
  if (!is_not_negative(config.quadrature_counts_per_turn))
    return "quadrature_counts_per_turn is negative or no number";
  if (config.shape == AngleShape::drive && !is_positive(config.drive_counts_per_turn)) {
    return "drive_counts_per_turn must be positive when the drive gives the shape";
  }
  if (config.shape == AngleShape::quadrature &&
      (config.a_line == none || !is_positive(config.quadrature_counts_per_turn))) {
    return "the shape from quadrature needs the lines A and B and quadrature_counts_per_turn";
  }
  if (config.shape == AngleShape::none && config.index_line == none)
    return "neither an index line nor counts";
  if (!std::isfinite(config.expected_speed_rad_s) || std::abs(config.expected_speed_rad_s) < 1e-3) {
    return "expected_speed_rad_s is 0 or no number";
  }
  if (!is_positive(config.speed_tolerance) || config.speed_tolerance >= 0.5) {
    return "speed_tolerance is not between 0 and 0.5";
  }
  if (!std::isfinite(config.index_angle_rad) || !is_not_negative(config.index_width_rad)) {
    return "index_angle_rad or index_width_rad is no angle";
  }
  if (!is_positive(config.index_window_rad) || config.index_window_rad > 1) {
    return "index_window_rad is not between 0 and 1";
  }
  if (!is_not_negative(config.index_sigma_rad) || !is_not_negative(config.count_sigma_rad) ||
      !is_not_negative(config.slip) || !is_not_negative(config.smoothness.acceleration_rad_s2) ||
      !is_not_negative(config.smoothness.speed_ripple_rad_s) || !is_positive(config.maximum_sigma_rad)) {
    return "an uncertainty is negative or no number";
  }
  constexpr std::int64_t hour_ns = 3600 * ns_per_s;
  for (const std::int64_t duration_ns :
       {config.debounce_ns, config.drive_latency_ns, config.node_interval_ns, config.maximum_gap_ns,
        config.maximum_wait_ns, config.maximum_extrapolation_ns}) {
    if (duration_ns < 0 || duration_ns > hour_ns) return "a duration is negative or longer than an hour";
  }
  const double turn_s = 2 * std::numbers::pi / std::abs(config.expected_speed_rad_s);
  if (seconds(config.debounce_ns) > 0.5 * turn_s) return "debounce_ns is longer than half a turn";
  if (config.shape == AngleShape::none &&
      seconds(config.maximum_wait_ns) < turn_s * (1 + config.speed_tolerance)) {
    return "maximum_wait_ns must be longer than the slowest turn when there are index pulses alone";
  }
  return nullptr;
}

}  // namespace alces
