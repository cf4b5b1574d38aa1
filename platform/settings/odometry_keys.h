// The keys of [odometry] and [gps]: where the vehicle goes.
#pragma once

#include "alces_platform/settings/vehicle_settings.h"
#include "quantities.h"

namespace alces::settings {

struct VisitCanSignal {
  template <typename Row, typename Visitor>
  void operator()(Row& source, Visitor& visit) const {
    auto& signal = source.signal;
    visit.need({"id", "start_bit", "length"});
    visit.hex("id", source.id, 4294967295.0, "");
    if (visit.wants("extended", source.is_extended)) visit.flag("extended", source.is_extended, "");
    visit.number("start_bit", signal.start_bit, 0, 511, "");
    visit.number("length", signal.length, 1, 64, "");
    visit.choice("order", signal.order, {{"intel", ByteOrder::intel}, {"motorola", ByteOrder::motorola}}, "");
    visit.choice("type", signal.type,
                 {{"unsigned", RawType::unsigned_integer},
                  {"signed", RawType::signed_integer},
                  {"float", RawType::float_ieee}},
                 "");
    visit.number("factor", signal.factor, -1e12, 1e12, "");
    visit.number("offset", signal.offset, -1e15, 1e15, "");
    if (visit.wants("minimum", signal.has_limits())) visit.number("minimum", signal.minimum, -1e15, 1e15, "");
    if (visit.wants("maximum", signal.has_limits())) visit.number("maximum", signal.maximum, -1e15, 1e15, "");
    visit.expect(
        (source.id & 0x80000000) == 0, "id",
        "a DBC file sets bit 31 of an extended identifier: take 2147483648 (0x80000000) off, and write "
        "extended = true");
    visit.expect(source.id <= 0x1FFFFFFF, "id", "an identifier has 29 bits at most");
    visit.expect(source.is_extended || source.id <= 0x7FF, "id", "id needs extended = true");
    visit.expect(is_valid(signal), "start_bit", "start_bit, length, order, type and factor give no signal");
  }
};

template <typename Config, typename Visitor>
void visit_odometry(Config& odometry, Visitor& visit) {
  visit.table(
      "odometry",
      "Speeds and turning rates from CAN frames. A signal is described as in a DBC file:\n"
      "  id          of the frame; extended = true: 29 bits\n"
      "  start_bit   order = \"intel\" (DBC: @1): the least significant bit, bit b being bit b % 8 of byte b "
      "/ 8;\n"
      "              order = \"motorola\" (DBC: @0): the most significant bit, in the same numbering\n"
      "  length      bits\n"
      "  type        \"signed\" (DBC: -), \"unsigned\" (DBC: +), \"float\"\n"
      "  value = raw * factor + offset must come out in the unit of the key: m/s, rad/s\n"
      "  minimum, maximum: of the value; what lies outside is not believed\n"
      "A signal that is left out does not exist.");
  visit.choice("kind", odometry.kind, {{"wheels", OdometryKind::wheels}, {"vehicle", OdometryKind::vehicle}},
               "wheels: left and right speed; vehicle: speed and yaw rate");
  visit.number("wheel_base_m", odometry.wheel_base_m, 0, 100,
               "from the left wheels' track to the right's, as effective for turning");
  const auto signal = [&visit](const char* key, auto& source, const char* comment) {
    visit.optional_row(key, source, source.exists(), VisitCanSignal{}, comment);
  };
  signal("left_speed_m_s", odometry.left_speed_m_s, "Of the left wheels, ahead.");
  signal("right_speed_m_s", odometry.right_speed_m_s, "Of the right wheels, ahead.");
  signal("speed_m_s", odometry.speed_m_s, "Of the vehicle, ahead.");
  signal("yaw_rate_rad_s", odometry.yaw_rate_rad_s,
         "Anticlockwise: a gyro, where there are wheels; it takes the place of theirs.");
  signal("roll_rate_rad_s", odometry.roll_rate_rad_s, "Positive: the left side rises.");
  signal("pitch_rate_rad_s", odometry.pitch_rate_rad_s, "Positive: the nose sinks.");
  signal("alive_counter", odometry.alive_counter, "Changes with every cycle of the sender.");
  duration_ms(visit, "latency_ms", odometry.latency_ns, 0, an_hour_ms,
              "a value is that much older than its frame; means over 20 ms: 10");
  visit.flag("learn_rate_bias", odometry.learn_rate_bias,
             "take off the rates' mean while the vehicle stands");
  visit.number("standstill_speed_m_s", odometry.standstill_speed_m_s, 0, 10, "up to this it stands");
  duration_s(visit, "standstill_s", odometry.standstill_ns, 1e-3, an_hour_s, "for so long before it counts");
  angle_deg(visit, "maximum_bias_deg_s", odometry.maximum_bias_rad_s, 0, 360, "");
  visit.number("maximum_speed_m_s", odometry.maximum_speed_m_s, 1e-3, 1000, "what the vehicle can do");
  angle_deg(visit, "maximum_rate_deg_s", odometry.maximum_rate_rad_s, 1e-3, 1e5, "");
  visit.number("maximum_acceleration_m_s2", odometry.maximum_acceleration_m_s2, 1e-3, 1e5, "");
  angle_deg(visit, "maximum_rate_change_deg_s2", odometry.maximum_rate_change_rad_s2, 1e-3, 1e7, "");
  visit.number("patience_values", odometry.patience, 0, 1e6,
               "refused changes in a row, then they are believed");
  duration_ms(visit, "maximum_wait_ms", odometry.maximum_wait_ns, 0, an_hour_ms,
              "for the frame after a time; then it is extrapolated");
  duration_ms(visit, "maximum_extrapolation_ms", odometry.maximum_extrapolation_ns, 0, an_hour_ms, "");
  duration_ms(visit, "timeout_ms", odometry.timeout_ns, 1, an_hour_ms,
              "frames farther apart are not bridged");
  duration_s(visit, "frozen_after_s", odometry.frozen_after_ns, 0, an_hour_s,
             "the same data while moving; 0: not looked for");
  duration_ms(visit, "alive_timeout_ms", odometry.alive_timeout_ns, 0, an_hour_ms, "the same alive counter");
  auto& errors = odometry.errors;
  visit.number("way_error", errors.way, 0, 1,
               "standard deviations, for the covariance of odom -> body: share of the way");
  visit.number("slip_error", errors.slip, 0, 1, "share of the way that comes and goes within seconds");
  visit.number("turn_error", errors.turn, 0, 1, "share of a turn");
  angle_deg(visit, "bias_error_deg_s", errors.bias_rad_s, 0, 360, "of the rates, while no bias was learned");
  angle_deg(visit, "noise_error_deg_sqrt_s", errors.noise_rad_per_sqrt_s, 0, 360, "of the rates");
  angle_deg(visit, "tilt_error_deg", errors.tilt_rad, 0, 90, "of the ground, where no rates measure it");
}

template <typename Settings, typename Visitor>
void visit_gps(Settings& vehicle, Visitor& visit) {
  auto& gps = vehicle.scanner.gps;
  visit.table("gps", "A receiver that writes NMEA 0183 (GGA, GNS, RMC). It helps to find loops, no more.");
  visit.text("device", vehicle.gps_device, "better one of /dev/serial/by-id");
  visit.number("line_baud", vehicle.gps_baud, 300, 4e6, "");
  duration_ms(visit, "delay_ms", gps.delay_ns, 0, 60000, "from the fix's time to its line's last byte");
  duration_s(visit, "maximum_age_s", gps.maximum_age_ns, 1e-3, an_hour_s, "");
  duration_s(visit, "gga_silence_s", gps.gga_silence_ns, 0, an_hour_s,
             "without GGA for so long: GNS or RMC will do");
  visit.number("minimum_satellites", gps.minimum_satellites, 0, 1000, "");
  visit.number("maximum_hdop", gps.maximum_hdop, 0.01, 1000, "");
  visit.number("maximum_speed_m_s", gps.maximum_speed_m_s, 0.01, 1e5, "faster is a jump ...");
  visit.number("jump_slack_m", gps.jump_slack_m, 0, 1e6, "... beyond this");
  visit.number("jump_patience_fixes", gps.jump_patience, 1, 1e6, "that agree, then the jump is believed");
  visit.flag("accepts_simulated", gps.accepts_simulated, "fixes of quality 6, 7, 8");
}

}  // namespace alces::settings
