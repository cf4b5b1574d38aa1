// The keys of [laser_a] and [laser_b]: make, line, mounting.
#pragma once

#include "alces_platform/settings/vehicle_settings.h"
#include "quantities.h"

namespace alces::settings {

struct VisitRayMask {
  template <typename Row, typename Visitor>
  void operator()(Row& mask, Visitor& visit) const {
    visit.need({"ray_from_deg", "ray_to_deg"});
    angle_deg(visit, "ray_from_deg", mask.ray_from_rad, -720, 720, "");
    angle_deg(visit, "ray_to_deg", mask.ray_to_rad, -720, 720, "");
    const bool is_any_head_angle = mask.head_from_rad == 0 && mask.head_to_rad >= 2 * std::numbers::pi;
    if (visit.wants("head_from_deg", !is_any_head_angle))
      angle_deg(visit, "head_from_deg", mask.head_from_rad, -720, 720, "");
    if (visit.wants("head_to_deg", !is_any_head_angle))
      angle_deg(visit, "head_to_deg", mask.head_to_rad, -720, 720, "");
    if (visit.wants("maximum_range_m", mask.maximum_range_m < 1e9))
      visit.number("maximum_range_m", mask.maximum_range_m, 0, 1e9, "");
    visit.expect(mask.ray_from_rad <= mask.ray_to_rad, "ray_to_deg", "ray_to_deg lies before ray_from_deg");
    visit.expect(mask.head_from_rad <= mask.head_to_rad, "head_to_deg",
                 "head_to_deg lies before head_from_deg");
  }
};

template <typename Config, typename Visitor>
void visit_lms2xx(Config& laser, Visitor& visit) {
  visit.number("measuring_baud", laser.baud, 9600, 500000,
               "9600, 19200, 38400, or 500000, which all 75 sweeps a second need");
  visit.numbers("search_baud", laser.candidate_bauds, 0, 0, 500000,
                "where it is looked for after that; 0: none");
  visit.number("address", laser.address, 0, 127, "0 reaches any");
  visit.number("field_of_view_deg", laser.field_of_view_deg, 100, 180, "100 or 180, about straight ahead");
  double resolution_deg = laser.resolution_hundredths_deg / 100.0;
  visit.number("resolution_deg", resolution_deg, 0.25, 1, "1, 0.5, or 0.25 (then with 100 deg)");
  if constexpr (!std::is_const_v<Config>)
    laser.resolution_hundredths_deg = static_cast<std::uint32_t>(std::lround(resolution_deg * 100));
  visit.choice("range_unit", laser.unit, {{"cm", lms2xx::Unit::cm}, {"mm", lms2xx::Unit::mm}}, "");
  using Mode = lms2xx::MeasuringMode;
  visit.choice(
      "measuring_mode", laser.mode,
      {{"fields_a_b_dazzle", Mode::fields_a_b_dazzle},
       {"reflector_8_levels", Mode::reflector_8_levels},
       {"fields_a_b_c", Mode::fields_a_b_c},
       {"reflector_4_levels", Mode::reflector_4_levels},
       {"fields_a_b", Mode::fields_a_b},
       {"reflector_2_levels", Mode::reflector_2_levels},
       {"field_a", Mode::field_a},
       {"no_flags", Mode::no_flags}},
      "reach in mm / in cm; the first three: 8 / 80 m; the next two: 16 / 160 m; the others: 32 / 320 m");
  visit.flag("with_turn_index", laser.with_turn_index, "the laser counts its mirror's turns");
  std::string password(laser.password.begin(), laser.password.end());
  visit.text("password", password, "8 characters, for the installation mode");
  visit.expect(password.size() == laser.password.size(), "password", "password must have 8 characters");
  if constexpr (!std::is_const_v<Config>)
    std::copy_n(password.begin(), laser.password.size(), laser.password.begin());
  visit.number("turns_hz", laser.turns_per_s, 1, 1000, "of the mirror");
  duration_ms(visit, "send_delay_ms", laser.send_delay_ns, 0, 1000,
              "from the end of the field of view to the telegram's first byte");
  visit.flag("is_listen_only", laser.is_listen_only, "it streams already: nothing is sent to it");
}

template <typename Config, typename Visitor>
void visit_cola_b(Config& laser, Visitor& visit) {
  visit.choice(
      "model", laser.model,
      {{"lms1xx", cola_b::Model::lms1xx}, {"lms5xx", cola_b::Model::lms5xx}, {"tim", cola_b::Model::tim}},
      "lms1xx, lms5xx, tim");
  visit.number("scan_frequency_hz", laser.scan_frequency_hz, 1, 1000,
               "expected; set in the laser with sets_scan");
  visit.flag("sets_scan", laser.sets_scan, "have the laser take the frequency and the three angles below");
  visit.number("angle_step_deg", laser.angle_step_deg, 0.01, 10, "");
  visit.number("start_angle_deg", laser.start_angle_deg, -360, 360, "the laser's own angle");
  visit.number("stop_angle_deg", laser.stop_angle_deg, -360, 360, "");
  visit.number("straight_ahead_deg", laser.straight_ahead_deg, -360, 360,
               "the laser's angle that is 0 for us");
  visit.hex("password_hash", laser.password_hash, 4294967295.0, "of \"authorized client\"");
  visit.flag("is_listen_only", laser.is_listen_only, "it streams already: nothing is sent to it");
}

/// Either a serial device, or a host and its port: what is named says which.
template <typename Line, typename Visitor>
void visit_line(Line& line, const std::string& table, Visitor& visit) {
  const bool has_host = visit.wants("host", line.is_tcp);
  const bool has_device = visit.wants("device", !line.is_tcp);
  visit.expect(!has_host || !has_device, "host", table + " has a device and a host: name one of them");
  if constexpr (!std::is_const_v<Line>) {
    if (has_host || has_device) line.is_tcp = has_host;
  }
  if (has_device)
    visit.text("device", line.device, "serial line; better one of /dev/serial/by-id; or host and port");
  if (has_host) visit.text("host", line.host, "TCP; or device, a serial line");
  if (visit.wants("port", line.is_tcp)) visit.number("port", line.port, 1, 65535, "");
}

template <typename Settings, typename Visitor>
void visit_laser(Settings& vehicle, std::size_t number, Visitor& visit) {
  const std::string table = number == 0 ? "laser_a" : "laser_b";
  visit.table(
      table.c_str(),
      number == 0
          ? "The first laser. Where it sits on the head, in the head's frame (REP 103: x ahead, y to the "
            "left, z up,\n"
            "the axis of rotation is z): position, then rotations about the head's fixed axes, first roll "
            "about x,\n"
            "then pitch about y, then yaw about z. The laser's own frame: x straight ahead, its rays turn\n"
            "anticlockwise about its z. Roll 90 stands the scan plane up, its first ray pointing down."
          : "The second laser: back to back with the first, half a turn of the head sees all around.\n"
            "Not there when scanner.lasers is 1. A laser over TCP has these instead of device and of the "
            "keys\n"
            "from measuring_baud on:\n"
            "  make = \"cola_b\"\n"
            "  host = \"192.168.0.1\"\n"
            "  port = 2112\n"
            "  model = \"lms5xx\"                  lms1xx, lms5xx, tim\n"
            "  scan_frequency_hz = 25             expected; set in the laser with sets_scan\n"
            "  sets_scan = false                  true: the laser takes the frequency and these angles:\n"
            "  angle_step_deg = 0.5\n"
            "  start_angle_deg = -5               the laser's own angle\n"
            "  stop_angle_deg = 185\n"
            "  straight_ahead_deg = 90            the laser's angle that is 0 for us\n"
            "  password_hash = 0xF4724744         of its \"authorized client\"\n"
            "  is_listen_only = false");
  auto& make = vehicle.scanner.laser_makes[number];
  visit.choice("make", make, {{"lms2xx", LaserMake::lms2xx}, {"cola_b", LaserMake::cola_b}},
               "lms2xx: SICK LMS 200/211/221/291, serial; cola_b: SICK LMS 1xx, LMS 5xx, TiM, TCP");
  visit_line(vehicle.laser_lines[number], table, visit);
  auto& mounting = vehicle.scanner.assembler.lasers[number];
  placement(visit, mounting.head_from_laser);
  visit.number("minimum_range_m", mounting.minimum_range_m, 0, 1e4, "nearer is the vehicle itself");
  visit.number("maximum_range_m", mounting.maximum_range_m, 0, 1e4, "farther rays are left out");
  visit.expect(mounting.maximum_range_m > mounting.minimum_range_m, "maximum_range_m",
               table + ".maximum_range_m must be larger than its minimum_range_m");
  std::vector<RayMask> masks(mounting.masks.begin(), mounting.masks.begin() + mounting.mask_count);
  visit.rows("masks", masks, LaserMounting::maximum_masks, VisitRayMask{},
             "rays to leave out: {ray_from_deg, ray_to_deg, head_from_deg, head_to_deg, maximum_range_m}");
  if constexpr (!std::is_const_v<Settings>) {
    mounting.masks = {};
    std::copy(masks.begin(), masks.end(), mounting.masks.begin());
    mounting.mask_count = static_cast<std::uint32_t>(masks.size());
  }
  if (make == LaserMake::lms2xx) {
    visit_lms2xx(vehicle.scanner.lms2xx[number], visit);
  } else {
    visit_cola_b(vehicle.scanner.cola_b[number], visit);
  }
}

}  // namespace alces::settings
