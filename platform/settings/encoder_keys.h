// The keys of [encoder]: which way the head looks.
#pragma once

#include "alces_drivers/scanner/scanner.h"
#include "quantities.h"

namespace alces::settings {

/// EncoderConfig::no_line is -1 in the file.
template <typename Visitor, typename Line>
void encoder_line(Visitor& visit, const char* key, Line& line, const char* comment) {
  int value = line == EncoderConfig::no_line ? -1 : line;
  visit.number(key, value, -1, 254, comment);
  if constexpr (!std::is_const_v<Line>)
    line = value < 0 ? EncoderConfig::no_line : static_cast<std::uint8_t>(value);
}

template <typename Config, typename Visitor>
void visit_encoder(Config& scanner, Visitor& visit) {
  auto& encoder = scanner.encoder;
  visit.table(
      "encoder",
      "The head's angle: an index pulse a turn says where the head is, counts in between say how it turned.\n"
      "Lines are places in gpio.lines, from 0; -1: not wired. Angles are the head's: anticlockwise, 0 where "
      "its\n"
      "axes are those of [head].");
  encoder_line(visit, "index_line", encoder.index_line, "");
  visit.flag("index_is_rising", encoder.index_is_rising,
             "the edge that counts when the head turns in its positive direction");
  angle_deg(visit, "index_angle_deg", encoder.index_angle_rad, -360, 360, "the head's angle at that edge");
  angle_deg(visit, "index_width_deg", encoder.index_width_rad, 0, 360,
            "from that edge to the pulse's other flank");
  angle_deg(visit, "index_sigma_deg", encoder.index_sigma_rad, 0, 10, "standard deviation of the mark");
  angle_deg(visit, "index_window_deg", encoder.index_window_rad, 0, 57,
            "a pulse farther from where the counts expect it is not believed at once");
  duration_ms(visit, "debounce_ms", encoder.debounce_ns, 0, 60000, "");
  visit.choice(
      "shape", encoder.shape,
      {{"none", AngleShape::none}, {"drive", AngleShape::drive}, {"quadrature", AngleShape::quadrature}},
      "drive: its position in a TPDO; quadrature: A and B; none: the speed is taken as constant");
  visit.number("drive_direction", encoder.drive_direction, -1, 1,
               "1, or -1: its counts fall when the head's angle grows");
  visit.number("drive_counts_per_turn", encoder.drive_counts_per_turn, 0, 1e12, "of the head, gear included");
  visit.flag("drive_is_sampled_at_sync", scanner.position_is_sampled_at_sync,
             "the position's time is that of the SYNC, not of the frame");
  duration_ms(visit, "drive_latency_ms", encoder.drive_latency_ns, 0, 60000,
              "a position is that much older still");
  encoder_line(visit, "a_line", encoder.a_line, "quadrature");
  encoder_line(visit, "b_line", encoder.b_line, "");
  visit.number("quadrature_direction", encoder.quadrature_direction, -1, 1,
               "1: A leads B when the head's angle grows; or -1");
  visit.number("quadrature_counts_per_turn", encoder.quadrature_counts_per_turn, 0, 1e9,
               "of the head: four a line of the disc");
  encoder_line(visit, "sync_line", encoder.sync_line, "a laser's profile-sync output: counted, not used");
  angle_deg(visit, "count_sigma_deg", encoder.count_sigma_rad, 0, 10, "of a count's time and rounding");
  visit.number("slip", encoder.slip, 0, 1, "radians that the counts may creep a radian (belt); gears: 0");
  angle_deg(visit, "expected_speed_deg_s", encoder.expected_speed_rad_s, -36000, 36000,
            "of the head; negative: clockwise");
  visit.number("speed_tolerance", encoder.speed_tolerance, 0, 0.5, "of it");
  angle_deg(visit, "acceleration_deg_s2", encoder.smoothness.acceleration_rad_s2, 0, 1e6,
            "at most, while it runs");
  angle_deg(visit, "speed_ripple_deg_s", encoder.smoothness.speed_ripple_rad_s, 0, 1e5,
            "deviation of the speed from its mean over a turn");
  visit.flag("wait_for_index", encoder.wait_for_index,
             "answer after the pulse that ends the turn: sharper when the counts creep; see maximum_wait_ms");
  duration_ms(visit, "node_interval_ms", encoder.node_interval_ns, 0, 60000,
              "counts that come faster are downsampled");
  duration_ms(visit, "maximum_gap_ms", encoder.maximum_gap_ns, 0, an_hour_ms,
              "between counts; a longer one is bridged by pulses only");
  duration_ms(visit, "maximum_wait_ms", encoder.maximum_wait_ns, 0, an_hour_ms,
              "for what comes after; with wait_for_index or without counts: more than a turn");
  duration_ms(visit, "maximum_extrapolation_ms", encoder.maximum_extrapolation_ns, 0, an_hour_ms,
              "past the last reference; then the angle is lost");
  angle_deg(visit, "maximum_sigma_deg", encoder.maximum_sigma_rad, 0, 360, "a worse angle is lost");
}

}  // namespace alces::settings
