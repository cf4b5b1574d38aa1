#include <catch2/catch.hpp>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "alces_platform/settings/settings_error.h"
#include "alces_platform/settings/vehicle_settings.h"

using namespace alces;
using namespace alces::settings;
using Catch::Contains;

namespace {

VehicleSettings parsed(const std::string& toml) {
  return parse_vehicle_settings(toml, "vehicle.toml");
}

/// What is said to this file; empty: nothing is wrong with it.
std::string complaint(const std::string& toml) {
  try {
    static_cast<void>(parsed(toml));
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

std::string content_of(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// A list of so many rows.
std::string list(const std::string& key, const std::string& row, int count) {
  std::string text = key + " = [";
  for (int i = 0; i < count; ++i) text += row + ",";
  return text + "]\n";
}

/// [motor] without its lists is no drive; this is the least that is one.
const std::string small_motor =
    "[motor]\n"
    "tpdos = [{number = 1, transmission_type = 1, entries = [{index = 0x6041, bits = 16}, {index = 0x6064, "
    "bits = 32}]},"
    " {number = 2, transmission_type = 1, entries = [{index = 0x606C, bits = 32}]}]\n"
    "rpdos = [{number = 1, transmission_type = 1, entries = [{index = 0x6040, bits = 16}, {index = 0x60FF, "
    "bits = 32}]}]\n";

}  // namespace

TEST_CASE("the example of a vehicle is the default vehicle, every key of it") {
  INFO("to write it again: to_toml(default_vehicle_settings()) into docs/examples/vehicle.toml");
  CHECK(content_of(ALCES_EXAMPLES "/vehicle.toml") == to_toml(default_vehicle_settings()));
}

TEST_CASE("the examples of other vehicles can be read") {
  for (const auto& file : std::filesystem::directory_iterator(ALCES_EXAMPLES)) {
    if (file.path().extension() != ".toml" || file.path().filename() == "map.toml") continue;
    INFO(file.path());
    CHECK_NOTHROW(read_vehicle_settings(file.path()));
  }
}

TEST_CASE("a file of mapper's tables alone is a vehicle's, too") {
  CHECK(to_toml(read_vehicle_settings(ALCES_EXAMPLES "/map.toml")) == to_toml(default_vehicle_settings()));
}

TEST_CASE("a vehicle does not know the fullest scan of a drive to come, and takes the usual room") {
  const VehicleSettings vehicle = parse_vehicle_settings("[voxel]\ncell_capacity = 0\n", "vehicle.toml");
  CHECK(vehicle.mapper.voxel.cell_capacity == 32768);
}

TEST_CASE("an empty file is the default vehicle") {
  for (const char* nothing : {"", "\n\n", "# nothing\n"}) {
    const VehicleSettings vehicle = parsed(nothing);
    CHECK(to_toml(vehicle) == to_toml(default_vehicle_settings()));
    CHECK(vehicle.text == nothing);
  }
}

TEST_CASE("the default vehicle survives being written and read to the bit") {
  const VehicleSettings written = default_vehicle_settings();
  const VehicleSettings read = parsed(to_toml(written));
  CHECK(read.text == to_toml(written));
  CHECK(read.scanner.encoder.index_angle_rad == written.scanner.encoder.index_angle_rad);
  CHECK(read.scanner.encoder.index_sigma_rad == written.scanner.encoder.index_sigma_rad);
  for (std::size_t laser = 0; laser < 2; ++laser) {
    CHECK(read.scanner.assembler.lasers[laser].head_from_laser.rotation.coeffs() ==
          written.scanner.assembler.lasers[laser].head_from_laser.rotation.coeffs());
    CHECK(read.scanner.lms2xx[laser].laser == laser);
    CHECK(std::strcmp(read.scanner.lms2xx[laser].name, laser == 0 ? "laser a" : "laser b") == 0);
  }
  CHECK(read.scanner.motor.tpdos[0].entries.size() == 2);
  CHECK(read.scanner.motor.tpdos[0].forbids_remote_frames);
}

TEST_CASE("a vehicle that differs in every part survives being written and read") {
  VehicleSettings vehicle = default_vehicle_settings();
  ScannerConfig& scanner = vehicle.scanner;
  scanner.motor_patience_ns = 1'234'567'891;
  scanner.position_is_sampled_at_sync = false;
  scanner.motor.reset = MotorReset::node;
  scanner.motor.node = 77;
  scanner.motor.target_velocity_units = -2000;
  scanner.motor.writes = {{0x2000, 255, 1, 0xFF}, {0xFFFF, 0, 4, 0xFFFFFFFF}, {0x6083, 0, 2, 65535}};
  scanner.motor.checks = {{0x1018, 1, 0xFF00, 0x1200}};
  scanner.motor.tpdos[1].cob_id = 0x3A1;
  scanner.motor.tpdos[1].transmission_type = 255;
  scanner.motor.tpdos[1].event_timer_ms = 10;
  scanner.motor.tpdos[1].inhibit_time_100us = 5;
  scanner.motor.tpdos_to_disable = {};
  scanner.encoder.index_line = 1;
  scanner.encoder.sync_line = 0;
  scanner.encoder.a_line = 2;
  scanner.encoder.b_line = 3;
  scanner.encoder.index_angle_rad = -1.2345678;
  scanner.encoder.expected_speed_rad_s = -2;
  scanner.encoder.shape = AngleShape::quadrature;
  scanner.encoder.quadrature_counts_per_turn = 4096;
  vehicle.gpio_lines = {"17", "index \"A\" \\", "4", "5"};
  scanner.laser_makes[1] = LaserMake::cola_b;
  scanner.cola_b[1].model = cola_b::Model::lms1xx;
  scanner.cola_b[1].sets_scan = true;
  scanner.cola_b[1].start_angle_deg = 0;
  scanner.cola_b[1].stop_angle_deg = 90;
  vehicle.laser_lines[1] = {true, "", "192.168.0.1", 2111};
  scanner.lms2xx[0].resolution_hundredths_deg = 25;
  scanner.lms2xx[0].field_of_view_deg = 100;
  scanner.lms2xx[0].unit = lms2xx::Unit::mm;
  scanner.lms2xx[0].mode = lms2xx::MeasuringMode::no_flags;
  scanner.lms2xx[0].password = {'a', '"', '\\', 'd', 'e', 'f', 'g', ' '};
  scanner.lms2xx[0].candidate_bauds = {19200, 0, 0, 0};
  LaserMounting& mounting = scanner.assembler.lasers[0];
  mounting.head_from_laser.rotation = Eigen::Quaterniond(0.1, -0.7, 0.3, 0.2).normalized();
  mounting.head_from_laser.translation_m = {0.1, -0.2, 1.0 / 3};
  mounting.masks[0] = {-1.5, -1.2, 0, 7, 1e9};
  mounting.masks[1] = {0.5, 0.6, 1, 2, 1.5};
  mounting.mask_count = 2;
  scanner.odometry.kind = OdometryKind::vehicle;
  scanner.odometry.left_speed_m_s = {};
  scanner.odometry.alive_counter = {};
  scanner.odometry.speed_m_s = {
      0x1ABCDEF0, true, {7, 32, ByteOrder::motorola, RawType::float_ieee, 1 / 3.6, -0.5, -10, 20}};
  scanner.assembler.own_box_from_m = {-1, -0.5, 0};
  scanner.assembler.own_box_to_m = {1, 0.5, 1.25};
  scanner.assembler.deskew = false;
  scanner.gps.delay_ns = 1;
  vehicle.memory_bytes = 12345678;
  vehicle.archive = "/var/lib/alces/archive";
  vehicle.recording = "drive-%t.mcap";
  vehicle.recording_limit_bytes = std::uint64_t{3} << 30;
  CHECK(vehicle.recording_reserve_bytes == std::uint64_t{1}
                                               << 30);  // a file that does not name it leaves it free
  vehicle.recording_reserve_bytes = 123'456;
  vehicle.fifo_priority = 80;
  vehicle.processor = 3;
  vehicle.locks_memory = true;
  vehicle.mapper.voxel.cell_size_m = 0.123456F;

  const std::string text = to_toml(vehicle);
  INFO(text);
  VehicleSettings read;
  REQUIRE_NOTHROW(read = parsed(text));
  CHECK(to_toml(read) == text);
  CHECK(read.scanner.motor_patience_ns == 1'234'567'891);
  CHECK(read.scanner.gps.delay_ns == 1);
  CHECK(read.scanner.encoder.a_line == 2);
  CHECK(read.scanner.lms2xx[0].resolution_hundredths_deg == 25);
  CHECK(read.scanner.lms2xx[0].password == scanner.lms2xx[0].password);
  CHECK(read.scanner.motor.writes[1].value == 0xFFFFFFFF);
  CHECK(read.scanner.motor.tpdos_to_disable.is_empty());
  CHECK(read.gpio_lines == vehicle.gpio_lines);
  CHECK(read.scanner.odometry.speed_m_s.is_extended);
  CHECK(read.scanner.odometry.speed_m_s.signal.factor == 1 / 3.6);
  CHECK_FALSE(read.scanner.odometry.left_speed_m_s.exists());
  CHECK(read.laser_lines[1].is_tcp);
  CHECK(read.laser_lines[1].port == 2111);
  CHECK(read.recording_limit_bytes == std::uint64_t{3} << 30);
  CHECK(read.recording_reserve_bytes == 123'456);
  CHECK(angle_between_rad(read.scanner.assembler.lasers[0].head_from_laser.rotation,
                          mounting.head_from_laser.rotation) < 1e-9);
}

TEST_CASE("a mounting's angles are rotations about fixed axes: roll, pitch, yaw") {
  const VehicleSettings vehicle =
      parsed("[head]\nx_m = 1\ny_m = 2\nz_m = 3\nroll_deg = 90\npitch_deg = 0\nyaw_deg = 90\n");
  const Pose& body_from_head = vehicle.scanner.assembler.body_from_head;
  // Roll takes y to z, yaw leaves z alone; roll takes z to -y, yaw takes -y to x; yaw takes x to y.
  CHECK((body_from_head * Eigen::Vector3d(0, 1, 0) - Eigen::Vector3d(1, 2, 4)).norm() < 1e-12);
  CHECK((body_from_head * Eigen::Vector3d(0, 0, 1) - Eigen::Vector3d(2, 2, 3)).norm() < 1e-12);
  CHECK((body_from_head * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, 3, 3)).norm() < 1e-12);
  // Positive pitch lowers what looks ahead (REP 103).
  const VehicleSettings pitched = parsed("[head]\nx_m = 0\ny_m = 0\nz_m = 0\npitch_deg = 30\n");
  CHECK((pitched.scanner.assembler.body_from_head * Eigen::Vector3d(1, 0, 0)).z() == Approx(-0.5));
}

TEST_CASE("a mounting that looks straight up or down keeps its rotation") {
  for (const double pitch_deg : {90.0, -90.0, 89.999, -89.999}) {
    for (const double yaw_deg : {0.0, 30.0, -135.0, 180.0}) {
      const std::string head = "[head]\nroll_deg = 20\npitch_deg = " + std::to_string(pitch_deg) +
                               "\nyaw_deg = " + std::to_string(yaw_deg) + "\n";
      INFO(head);
      const VehicleSettings once = parsed(head);
      const VehicleSettings twice = parsed(to_toml(once));
      CHECK(angle_between_rad(once.scanner.assembler.body_from_head.rotation,
                              twice.scanner.assembler.body_from_head.rotation) < 1e-9);
    }
  }
}

TEST_CASE("a table that is there names all lists and signals of its own") {
  const VehicleSettings vehicle = parsed(
      "[odometry]\n"
      "left_speed_m_s = {id = 1, start_bit = 0, length = 16}\n"
      "right_speed_m_s = {id = 1, start_bit = 16, length = 16}\n");
  CHECK(vehicle.scanner.odometry.left_speed_m_s.id == 1);
  CHECK(vehicle.scanner.odometry.left_speed_m_s.signal.factor == 1);
  CHECK_FALSE(vehicle.scanner.odometry.yaw_rate_rad_s.exists());
  CHECK(vehicle.scanner.odometry.wheel_base_m == default_vehicle_settings().scanner.odometry.wheel_base_m);
  const VehicleSettings motor = parsed(small_motor);
  CHECK(motor.scanner.motor.writes.is_empty());
  CHECK(motor.scanner.motor.checks.is_empty());
  CHECK_THAT(complaint("[motor]\nnode = 3\n"),
             Contains("vehicle.toml:1: [motor]: the TPDOs must map 0x6041"));
}

TEST_CASE("negative object values are two's complement in the object's size") {
  const VehicleSettings vehicle =
      parsed(small_motor +
             "writes = [{index = 0x6060, bytes = 1, value = -2}, {index = 0x60FF, bytes = 4, value = -1}]\n");
  CHECK(vehicle.scanner.motor.writes[0].value == 0xFE);
  CHECK(vehicle.scanner.motor.writes[1].value == 0xFFFFFFFF);
  CHECK_THAT(complaint(small_motor + "writes = [{index = 0x6060, bytes = 1, value = 256}]\n"),
             Contains("vehicle.toml:4: motor.writes[0]: value does not fit"));
  CHECK_THAT(complaint(small_motor + "writes = [{index = 0x6060, bytes = 1, value = -129}]\n"),
             Contains("does not fit"));
}

TEST_CASE("a laser is at a device or at a host, not at both") {
  const VehicleSettings vehicle =
      parsed("[laser_a]\nmake = \"cola_b\"\nhost = \"10.0.0.2\"\nmodel = \"tim\"\n");
  CHECK(vehicle.laser_lines[0].is_tcp);
  CHECK(vehicle.laser_lines[0].host == "10.0.0.2");
  CHECK(vehicle.laser_lines[0].port == 2112);
  CHECK_FALSE(vehicle.laser_lines[1].is_tcp);
  CHECK_THAT(complaint("[laser_a]\nhost = \"h\"\ndevice = \"/dev/ttyS0\"\n"),
             Contains("vehicle.toml:2: laser_a"));
  CHECK_THAT(complaint("[laser_a]\nhost = \"\"\n"), Contains("vehicle.toml:2: laser_a has neither"));
  CHECK_THAT(complaint("[laser_b]\n\ndevice = \"/dev/ttyUSB0\"\n"), Contains("vehicle.toml:3: two lasers"));
  CHECK_THAT(complaint("[gps]\ndevice = \"/dev/ttyUSB1\"\n"), Contains("vehicle.toml:2: the GPS receiver"));
}

TEST_CASE("keys of the other make of laser are refused") {
  CHECK_THAT(complaint("[laser_a]\nmodel = \"tim\"\n"),
             Contains("vehicle.toml:2: there is no laser_a.model"));
  CHECK_THAT(complaint("[laser_a]\nmake = \"cola_b\"\nhost = \"h\"\nmeasuring_baud = 9600\n"),
             Contains("vehicle.toml:4: there is no laser_a.measuring_baud"));
}

TEST_CASE("what nobody knows is named with file and line") {
  CHECK_THAT(complaint("\n[motors]\n"), Contains("vehicle.toml:2: there is no table [motors]"));
  CHECK_THAT(complaint("node = 1\n"), Contains("vehicle.toml:1: there is no table [node]"));
  CHECK_THAT(complaint("[scanner]\n\nlaser = 1\n"), Contains("vehicle.toml:3: there is no scanner.laser;"));
  CHECK_THAT(complaint("[motor]\nwrites = [\n  {index = 0x6083, bytes = 4, value = 1, unit = 2},\n]\n"),
             Contains("vehicle.toml:3: there is no motor.writes[0].unit"));
  CHECK_THAT(complaint("[odometry.left_speed_m_s]\nid = 1\nstart_bit = 0\nlength = 8\nscale = 2\n"),
             Contains("vehicle.toml:5: there is no odometry.left_speed_m_s.scale"));
  CHECK_THAT(complaint("[sharing]\nrules = \"paper\"\n"),
             Contains("vehicle.toml:2: there is no loop_correction.rules"));
}

TEST_CASE("what is lacking in a row is named") {
  CHECK_THAT(complaint("[motor]\nwrites = [\n  {index = 0x6083, value = 1},\n]\n"),
             Contains("vehicle.toml:3: motor.writes[0] lacks bytes"));
  CHECK_THAT(complaint("[odometry]\nspeed_m_s = {id = 3}\n"),
             Contains("vehicle.toml:2") && Contains("lacks start_bit"));
}

TEST_CASE("values of a wrong type are named with file and line") {
  CHECK_THAT(complaint("motor = 3\n"), Contains("vehicle.toml:1: motor is a table"));
  CHECK_THAT(complaint("[[motor]]\n"), Contains("vehicle.toml:1: motor is a table"));
  CHECK_THAT(complaint("[motor]\nnode = 1.0\n"), Contains("vehicle.toml:2: motor.node is a whole number"));
  CHECK_THAT(complaint("[motor]\nnode = \"1\"\n"), Contains("vehicle.toml:2: motor.node is a whole number"));
  CHECK_THAT(complaint("[motor]\nwrites = 3\n"), Contains("vehicle.toml:2: motor.writes is a list"));
  CHECK_THAT(complaint("[motor]\nwrites = [3]\n"), Contains("vehicle.toml:2: motor.writes[0] is a table"));
  CHECK_THAT(complaint("[can]\ninterface = 0\n"), Contains("vehicle.toml:2: can.interface is a text"));
  CHECK_THAT(complaint("[gpio]\nlines = \"17\"\n"), Contains("vehicle.toml:2: gpio.lines is a list"));
  CHECK_THAT(complaint("[gpio]\nlines = [1.5]\n"), Contains("gpio.lines holds texts and whole numbers only"));
  CHECK_THAT(complaint("[encoder]\nindex_angle_deg = true\n"),
             Contains("encoder.index_angle_deg is a number"));
  CHECK_THAT(complaint("[encoder]\nindex_is_rising = 1\n"),
             Contains("encoder.index_is_rising is true or false"));
  CHECK_THAT(complaint("[encoder]\nshape = \"square\"\n"), Contains("\"none\", \"drive\", \"quadrature\""));
  CHECK_THAT(complaint("[program]\nmemory = \"64 megs\"\n"),
             Contains("vehicle.toml:2: program.memory is a size"));
  CHECK_THAT(complaint("[program]\nmemory = -1\n"), Contains("program.memory is a size"));
  CHECK_THAT(complaint("[assembler]\nown_box_from_m = [1, 2]\n"),
             Contains("own_box_from_m has 2 entries, not 3"));
  CHECK_THAT(complaint("[assembler]\nown_box_from_m = [1, 2, \"3\"]\n"),
             Contains("own_box_from_m[2] is a number"));
}

TEST_CASE("values out of their range are refused") {
  CHECK_THAT(complaint("[motor]\nnode = 128\n"),
             Contains("vehicle.toml:2: motor.node must lie between 1 and 127"));
  CHECK_THAT(complaint("[motor]\nnode = 4294967297\n"), Contains("must lie between"));
  CHECK_THAT(complaint("[motor]\nnode = -9223372036854775808\n"), Contains("must lie between"));
  CHECK_THAT(complaint("[motor]\nnode = 9223372036854775808\n"), Contains("is no TOML"));
  CHECK_THAT(complaint("[motor]\nwrites = [{index = 0x10000, bytes = 1, value = 0}]\n"),
             Contains("motor.writes[0].index must lie between 0 and 65535"));
  CHECK_THAT(complaint("[motor]\nwrites = [{index = 1, bytes = 8, value = 0}]\n"),
             Contains("motor.writes[0].bytes must lie between 1 and 4"));
  CHECK_THAT(complaint("[motor]\nwrites = [{index = 1, bytes = 4, value = 4294967296}]\n"),
             Contains("motor.writes[0].value must lie between"));
  for (const char* number : {"nan", "inf", "-inf", "1e300", "-1e300"}) {
    INFO(number);
    CHECK_THAT(complaint(std::string("[encoder]\nindex_angle_deg = ") + number + "\n"),
               Contains("must lie between"));
    CHECK_THAT(complaint(std::string("[scanner]\nmotor_patience_s = ") + number + "\n"),
               Contains("must lie between"));
    CHECK_THAT(complaint(std::string("[head]\nx_m = ") + number + "\n"), Contains("must lie between"));
    CHECK_THAT(
        complaint(std::string("[odometry]\nspeed_m_s = {id = 1, start_bit = 0, length = 8, factor = ") +
                  number + "}\n"),
        Contains("must lie between"));
  }
  CHECK_THAT(complaint("[program]\nmemory = \"1KiB\"\n"),
             Contains("program.memory must lie between 1.0 MiB"));
  CHECK_THAT(complaint("[can]\ninterface = \"a-name-that-is-too-long\"\n"),
             Contains("vehicle.toml:2: can.interface"));
  CHECK_THAT(complaint("[can]\ninterface = \"can0\\u0000\"\n"), Contains("can.interface is one line"));
}

TEST_CASE("lists that are too long are refused with their capacity") {
  const std::string write = "{index = 0x6083, bytes = 4, value = 1}";
  CHECK_THAT(complaint("[motor]\n" + list("writes", write, 49)),
             Contains("vehicle.toml:2: motor.writes has 49 entries, there is room for 48"));
  CHECK(complaint(small_motor + list("writes", write, 48)).empty());
  CHECK_THAT(complaint("[motor]\n" + list("checks", "{index = 1, value = 1}", 9)),
             Contains("there is room for 8"));
  const std::string entries = list("entries", "{index = 1, bits = 1}", 9);
  CHECK_THAT(complaint("[motor]\ntpdos = [{number = 1, transmission_type = 1, " +
                       entries.substr(0, entries.size() - 1) + "}]\n"),
             Contains("vehicle.toml:2: motor.tpdos[0].entries has 9 entries, there is room for 8"));
  CHECK_THAT(complaint("[motor]\n" + list("rpdos_to_disable", "{number = 1}", 5)),
             Contains("there is room for 4"));
  CHECK_THAT(complaint("[laser_a]\n" + list("masks", "{ray_from_deg = 0, ray_to_deg = 1}", 9)),
             Contains("laser_a.masks has 9 entries, there is room for 8"));
  CHECK_THAT(complaint("[gpio]\n" + list("lines", "1", 9)), Contains("gpio.lines has 9 entries"));
  CHECK_THAT(complaint("[laser_a]\n" + list("search_baud", "9600", 5)), Contains("there is room for 4"));
}

TEST_CASE("values that do not go together are refused where they stand") {
  CHECK_THAT(complaint("[encoder]\nindex_line = 1\n"),
             Contains("vehicle.toml:2: encoder.index_line is 1, but gpio.lines has 1 entries"));
  CHECK_THAT(complaint("[gpio]\nlines = []\n"),
             Contains("encoder.index_line is 0, but gpio.lines has 0 entries"));
  CHECK_THAT(complaint("[gpio]\nlines = [17, \"17\"]\n"),
             Contains("vehicle.toml:2: gpio.lines names a line twice"));
  CHECK_THAT(complaint("\n[encoder]\nspeed_tolerance = 0.5\n"),
             Contains("vehicle.toml:2: [encoder]: speed_tolerance is not between"));
  CHECK_THAT(complaint("[scanner]\nhas_motor = false\n"), Contains("encoder.shape is \"drive\""));
  CHECK_THAT(complaint("[laser_a]\nminimum_range_m = 50\n"),
             Contains("vehicle.toml:1: laser_a.maximum_range_m"));
  CHECK_THAT(complaint("[laser_b]\nfield_of_view_deg = 120\n"),
             Contains("vehicle.toml:1: [laser_b]: the field of view"));
  CHECK_THAT(complaint("[laser_a]\nmasks = [{ray_from_deg = 2, ray_to_deg = 1}]\n"),
             Contains("vehicle.toml:2: laser_a.masks[0]: ray_to_deg lies before"));
  CHECK_THAT(complaint("[laser_a]\npassword = \"short\"\n"),
             Contains("vehicle.toml:2: password must have 8"));
  CHECK_THAT(
      complaint("[assembler]\nrays_per_profile = 100\n"),
      Contains("vehicle.toml:2: assembler.rays_per_profile is 100, but a profile of laser_a has 181 rays"));
  CHECK_THAT(complaint("[assembler]\nminimum_profiles = 181\n"),
             Contains("vehicle.toml:2: assembler.minimum_profiles"));
  CHECK_THAT(complaint("[odometry]\nwheel_base_m = 0\n"),
             Contains("vehicle.toml:1: [odometry]: odometry from wheels"));
  CHECK_THAT(complaint("[odometry]\nspeed_m_s = {id = 0x800, start_bit = 0, length = 8}\n"),
             Contains("odometry.speed_m_s: id needs extended = true"));
  CHECK_THAT(complaint("[odometry]\nspeed_m_s = {id = 0x98FF0102, start_bit = 0, length = 8}\n"),
             Contains("a DBC file sets bit 31") && Contains("extended = true"));
  CHECK_THAT(complaint("[odometry]\nspeed_m_s = {id = 0x28FF0102, start_bit = 0, length = 8}\n"),
             Contains("29 bits"));
  CHECK_THAT(complaint("[odometry]\nspeed_m_s = {id = 1, start_bit = 510, length = 8}\n"),
             Contains("give no signal"));
  CHECK_THAT(complaint("[gps]\ndevice = \"\"\n"), Contains("vehicle.toml:2: gps.device is empty"));
  CHECK_THAT(complaint("[memory]\ncache_slots = 2\n"),
             Contains("vehicle.toml:2: memory.cache_slots must be"));
}

TEST_CASE("what is not there need not make sense") {
  CHECK(complaint("[scanner]\nhas_gps = false\n[gps]\ndevice = \"\"\n").empty());
  CHECK(complaint("[scanner]\nlasers = 1\n[laser_b]\ndevice = \"/dev/ttyUSB0\"\n").empty());
  CHECK(complaint("[scanner]\nhas_odometry = false\n[odometry]\nwheel_base_m = 0\n").empty());
  CHECK(complaint("[scanner]\nhas_motor = false\n[encoder]\nshape = \"none\"\nmaximum_wait_ms = "
                  "4000\n[motor]\nnode = 1\n")
            .empty());
}

TEST_CASE("what is no TOML, or no file") {
  CHECK_THAT(complaint("[motor]\nnode 1\n"), Contains("vehicle.toml:2: is no TOML"));
  CHECK_THAT(complaint("[motor]\nnode = 1\nnode = 2\n"), Contains("vehicle.toml:3: is no TOML"));
  CHECK_THAT(complaint(std::string("\xff\xfe\x00 nonsense \x80", 14)), Contains("is no TOML"));
  CHECK_THAT(complaint("[motor]\nwrites = " + std::string(100'000, '[')), Contains("is no TOML"));
  CHECK_THAT(complaint("[motor]\nwrites = [ {index = 1"), Contains("is no TOML"));
  CHECK_THROWS_AS(read_vehicle_settings("/nonexistent.toml"), Error);
  CHECK_THROWS_AS(read_vehicle_settings("/tmp"), Error);
  CHECK_THROWS_WITH(read_vehicle_settings("/dev/zero"), Contains("/dev/zero: is no file"));
}

TEST_CASE("no truncation of a good file is taken for something else than TOML or a vehicle") {
  const std::string whole = to_toml(default_vehicle_settings());
  for (std::size_t size = 0; size < whole.size(); size += 97) {
    INFO(size);
    try {
      static_cast<void>(parsed(whole.substr(0, size)));
    } catch (const Error& error) {
      CHECK_THAT(error.what(), Contains("vehicle.toml:"));
    }
  }
}
