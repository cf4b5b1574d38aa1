// The one list of a vehicle's keys, in the order of the file, for TomlReader and TomlWriter. Beyond what
// mapper_keys.h asks of a visitor these know texts, sizes, lists and rows: see toml_reader.h.
#pragma once

#include "alces_platform/settings/mapper_keys.h"
#include "encoder_keys.h"
#include "laser_keys.h"
#include "motor_keys.h"
#include "odometry_keys.h"

namespace alces::settings {

/// As many as one request can hold: GpioRequest::line_capacity.
inline constexpr std::size_t maximum_gpio_lines = 8;

template <typename Config, typename Visitor>
void visit_scanner(Config& scanner, Visitor& visit) {
  visit.table("scanner",
              "What there is, and how patient to be. A table of what is not there is read, and not used.");
  visit.flag("has_motor", scanner.has_motor, "false: somebody else turns the head");
  visit.number("lasers", scanner.assembler.laser_count, 1, ScannerConfig::maximum_lasers, "1 or 2");
  visit.flag("has_odometry", scanner.has_odometry, "");
  visit.flag("has_gps", scanner.has_gps, "");
  duration_s(visit, "motor_patience_s", scanner.motor_patience_ns, 1e-3, an_hour_s,
             "for the motor to come up; then the lasers start without it");
  duration_s(visit, "laser_silence_s", scanner.laser_silence_ns, 1e-3, an_hour_s,
             "measuring, and no profile: begun anew");
  duration_s(visit, "scan_patience_s", scanner.scan_patience_ns, 1e-3, an_hour_s,
             "profiles, and no scan: told");
  duration_s(visit, "laser_stop_timeout_s", scanner.laser_stop_timeout_ns, 1e-3, an_hour_s,
             "then the motor is stopped without waiting");
}

template <typename Config, typename Visitor>
void visit_assembler(Config& assembler, Visitor& visit) {
  visit.table("assembler",
              "Profiles put together to scans. A scan is a piece of the head's turn between fixed angles:\n"
              "boundary_deg + k * turn_deg. Two lasers back to back see all around in half a turn, one needs "
              "a whole one.");
  angle_deg(visit, "turn_deg", assembler.turn_rad, 6, 720, "of the head in a scan");
  angle_deg(visit, "boundary_deg", assembler.boundary_rad, -5700, 5700,
            "a head's angle at which scans begin");
  visit.number("expected_profiles", assembler.expected_profiles, 0, 1e6,
               "of a whole scan, of all lasers: 75 / s * 1.2 s * 2; 0: missing ones are not looked for");
  visit.number("minimum_profiles", assembler.minimum_profiles, 0, 1e6, "with fewer the scan is incomplete");
  visit.flag("deskew", assembler.deskew, "false: points as if the vehicle stood during a scan");
  visit.numbers("own_box_from_m", assembler.own_box_from_m, 3, -1e4, 1e4,
                "points in this box are the vehicle's own: x, y, z in the body frame");
  visit.numbers("own_box_to_m", assembler.own_box_to_m, 3, -1e4, 1e4, "no larger than from: there is no box");
  visit.number("rays_per_profile", assembler.capacity.rays_per_profile, 1, Profile::maximum_rays,
               "room; an LMS 2xx has field_of_view_deg + 1");
  visit.number("waiting_profiles", assembler.capacity.waiting_profiles, 1, 1e6,
               "room: profiles a second * the longest wait");
  visit.number("points_per_scan", assembler.capacity.points_per_scan, 1, 1e8, "room");
  angle_deg(visit, "boundary_tolerance_deg", assembler.boundary_tolerance_rad, 1e-6, 360,
            "the first and last profile may be so far from the boundary");
  duration_ms(visit, "settle_ms", assembler.settle_ns, 0, an_hour_ms,
              "profiles wait so long, so that two lasers' go in by their time");
  duration_ms(visit, "maximum_wait_ms", assembler.maximum_wait_ns, 0, an_hour_ms,
              "for angle and motion; more than those of [encoder] and [odometry]");
  angle_deg(visit, "stop_angle_deg", assembler.stop_angle_rad, 1e-6, 360, "a head that turns less ...");
  duration_ms(visit, "stop_after_ms", assembler.stop_after_ns, 0, an_hour_ms, "... in this time stands");
  visit.number("interpolation_error_m", assembler.interpolation_error_m, 1e-9, 1,
               "that speed is bought with");
  duration_s(visit, "gps_maximum_age_s", assembler.gps_maximum_age_ns, 0, an_hour_s, "");
}

template <typename Settings, typename Visitor>
void visit_program(Settings& vehicle, Visitor& visit) {
  const auto size = [&visit](const char* key, auto& bytes, double least, double most, const char* comment) {
    std::uint64_t value = bytes;
    visit.bytes(key, value, least, most, comment);
    if constexpr (!std::is_const_v<std::remove_reference_t<decltype(bytes)>>)
      bytes = static_cast<std::remove_reference_t<decltype(bytes)>>(value);
  };
  visit.table("program",
              "How alcesd runs. Sizes as \"64MiB\" or \"1.5GB\"; files relative to where it is started.");
  size("memory", vehicle.memory_bytes, 1 << 20, 1e13, "of the mapper, taken once");
  visit.text("archive", vehicle.archive, "a file for scans that do not fit; empty: none");
  visit.number("scan_slots", vehicle.scan_slots, 1, 1000, "scans that may wait for the mapper");
  visit.flag("maps_incomplete_scans", vehicle.maps_incomplete_scans, "");
  duration_s(visit, "mapping_timeout_s", vehicle.mapping_timeout_ns, 1, an_hour_s,
             "a scan that takes the mapper longer: it hangs, and the watchdog is told no more");
  visit.text("recording", vehicle.recording,
             "an MCAP file, %t: UTC of the start; empty: nothing is recorded");
  size("recording_limit", vehicle.recording_limit_bytes, 0, 1e15, "then recording ends; 0: none");
  size("recording_reserve", vehicle.recording_reserve_bytes, 0, 1e15,
       "of its disk stays free, at most a twentieth of it: recording waits for room; 0: none");
  visit.number("fifo_priority", vehicle.fifo_priority, 0, 99, "of the acquisition thread; 0: not real-time");
  visit.number("processor", vehicle.processor, -1, 1023, "of the acquisition thread; -1: any");
  visit.flag("locks_memory", vehicle.locks_memory, "no page is ever swapped out");
}

template <typename Page, typename Visitor>
void visit_page(Page& page, Visitor& visit) {
  visit.table("page",
              "Poses and status for programs beside alcesd, in a file on tmpfs that they map: docs/live.md.");
  visit.text("path", page.path, "/run/alces/page is where libalces-client looks; empty: there is none");
  visit.text("group", page.group, "that may read it; empty: alcesd's own");
  visit.text("mode", page.mode, "\"0600\", \"0640\" or \"0644\": readers never write");
  visit.expect(page.mode == "0600" || page.mode == "0640" || page.mode == "0644", "mode",
               "page.mode is one of \"0600\", \"0640\", \"0644\"");
  visit.expect(page.path.empty() || (page.path.front() == '/' && page.path.size() < 4000), "path",
               "page.path must begin with / and have less than 4000 bytes");
}

template <typename Settings, typename Visitor>
void visit_vehicle(Settings& vehicle, Visitor& visit) {
  visit_scanner(vehicle.scanner, visit);

  visit.table("can",
              "The bus with the motor and the odometry. Its bit rate is the system's affair:\n"
              "  ip link set can0 up type can bitrate 1000000 restart-ms 100");
  visit.text("interface", vehicle.can_interface, "");
  visit.expect(!vehicle.can_interface.empty() && vehicle.can_interface.size() <= 15, "interface",
               "can.interface must be the name of a network interface, 1 to 15 characters");

  visit.table("gpio", "Lines with the encoder's signals. gpioinfo lists chips and lines.");
  visit.text("chip", vehicle.gpio_chip, "a name, a path, a number or a label");
  visit.words("lines", vehicle.gpio_lines, maximum_gpio_lines,
              "numbers or names; [encoder] counts them from 0");

  visit_motor(vehicle.scanner.motor, visit);
  if (visit.wants("permit_socket", vehicle.scanner.motor.permit.source == PermitSource::socket))
    visit.text("permit_socket", vehicle.permit_socket, "datagrams: 1 gives the permit, 0 withdraws it");
  visit_encoder(vehicle.scanner, visit);
  for (std::size_t laser = 0; laser < ScannerConfig::maximum_lasers; ++laser)
    visit_laser(vehicle, laser, visit);

  visit.table(
      "head",
      "Where the head stands on the vehicle, in the body's frame (REP 103: x ahead, y to the left, z up; its "
      "origin is\n"
      "what is mapped): the head's axis of rotation is its z, and its x is where it looks at angle 0.\n"
      "Position, then rotations about the body's fixed axes, first roll, then pitch, then yaw.");
  placement(visit, vehicle.scanner.assembler.body_from_head);

  visit_odometry(vehicle.scanner.odometry, visit);
  visit_gps(vehicle, visit);
  visit_assembler(vehicle.scanner.assembler, visit);
  visit_program(vehicle, visit);
  visit_page(vehicle.page, visit);
  visit_mapper(vehicle.mapper, visit);
}

}  // namespace alces::settings
