// Drives that a vehicle has to get through: without odometry for a minute, with a sensor of few rings, in
// snow, in a crowd. Wires, drivers, assembler and mapper as on the vehicle; the map's poses are held against
// the truth, and what happened has to be said.
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "onboard/vehicle_bench.h"

using namespace alces;
using namespace alces::onboard;

namespace {

/// What a drive came to.
struct Outcome {
  Pipeline::Counters counters;
  NoticeList notices;
  MapHealth health;
  std::uint64_t scans_without_odometry = 0;
  std::uint64_t odometry_gaps = 0;
  std::uint64_t odometry_freezes = 0;
  double worst_m = 0;  ///< of the map's poses, against the truth
  double worst_deg = 0;
  double end_m = 0;  ///< of the last 15 of them
  double end_deg = 0;
};

/// Round a block, 90 scans in 114 s; the mapper as it comes.
Outcome drive(const sim::RigSettings& rig, const std::vector<sim::Injection>& faults = {},
              std::size_t scans = 90) {
  sim::SimulatedScannerSettings settings;
  settings.rig = rig;
  settings.rig.motion.scans = scans;
  sim::SimulatedScanner vehicle(settings);
  for (sim::Injection fault : faults) {
    fault.at_ns += vehicle.rig().motion().start_stamp_ns();
    vehicle.rig().inject(fault);
  }
  const settings::VehicleSettings configured = [] {
    settings::VehicleSettings defaults = settings::default_vehicle_settings();
    defaults.mapper.scan_capacity = 192;
    defaults.mapper.pool_bytes = std::size_t{32} << 20;
    return defaults;
  }();
  Outcome outcome;
  MemorySink sink;
  sim::SimulatedRig& wires = vehicle.rig();
  Pipeline pipeline(
      config_of(configured),
      {.ports = {&wires.can_port(), {&wires.byte_port(laser_a_channel), &wires.byte_port(laser_b_channel)}},
       .recording = &sink,
       .listener = &outcome.notices});
  pipeline.start_scanner();
  Feeder feeder(pipeline);
  wires.advance_to(wires.motion().stop_stamp_ns() + ns_per_s, feeder);
  REQUIRE(end_drive(pipeline));

  outcome.counters = pipeline.counters();
  outcome.health = pipeline.health();
  pipeline.scanner().visit_counters([&](ScannerPart part, const std::string& name, std::uint64_t value) {
    if (part == ScannerPart::assembler && name == "scans_without_odometry")
      outcome.scans_without_odometry = value;
    if (part == ScannerPart::odometry && name == "gaps") outcome.odometry_gaps = value;
    if (part == ScannerPart::odometry && name == "freezes") outcome.odometry_freezes = value;
  });
  const std::vector<Pose> poses = poses_of(pipeline);
  std::vector<std::int64_t> stamps_ns;
  for (const Recorded::KeptScan& kept : read_back(sink.bytes).scans) {
    if (kept.scan.was_mapped) stamps_ns.push_back(kept.scan.reference_stamp_ns);
  }
  REQUIRE(stamps_ns.size() == poses.size());
  REQUIRE(poses.size() > 80);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Pose truth = wires.map_from_body(stamps_ns[i], stamps_ns[0]);
    const double off_m = (poses[i].translation_m - truth.translation_m).norm();
    const double off_deg = angle_between_rad(poses[i].rotation, truth.rotation) * 57.29577951;
    outcome.worst_m = std::max(outcome.worst_m, off_m);
    outcome.worst_deg = std::max(outcome.worst_deg, off_deg);
    if (i + 15 < poses.size()) continue;
    outcome.end_m = std::max(outcome.end_m, off_m);
    outcome.end_deg = std::max(outcome.end_deg, off_deg);
  }
  return outcome;
}

/// For a minute in the middle of the drive.
Outcome drive_with(sim::Fault fault, std::int64_t argument = 0) {
  return drive({}, {{fault, 20 * ns_per_s, 60 * ns_per_s, argument}});
}

void check_map(const Outcome& outcome, double most_m, double most_deg) {
  CAPTURE(outcome.worst_m, outcome.worst_deg);
  CHECK(outcome.worst_m < most_m);
  CHECK(outcome.worst_deg < most_deg);
  CHECK(outcome.counters.scans_mapped + outcome.counters.scans_incomplete == outcome.counters.scans);
}

/// Without odometry a scan keeps the motion of its 1.2 s in it: in a bend 20 deg and 1.3 m. So much its
/// pose may be off there, and half as much again of the steps before; when odometry is back the map is right
/// again.
void check_map_without_odometry(const Outcome& outcome) {
  check_map(outcome, 2.1, 10);
  CAPTURE(outcome.end_m, outcome.end_deg);
  CHECK(outcome.end_m < 0.5);
  CHECK(outcome.end_deg < 1.5);
  CHECK(outcome.health.found > 0);  // in the bends
  CHECK(outcome.health.parts == 1);
  CHECK(outcome.health.verdict != MapVerdict::bad);
}

void check_not_off_and_good(const Outcome& outcome) {
  CAPTURE(outcome.worst_m, outcome.end_m);
  const bool is_off = outcome.worst_m > 2.1 || outcome.end_m > 0.5;
  CHECK((!is_off || outcome.health.verdict != MapVerdict::good));
}

}  // namespace

TEST_CASE("a drive with nothing wrong is mapped within its bounds, and no odometry is missed") {
  const Outcome outcome = drive({});
  check_map(outcome, 0.3, 1);
  CHECK(outcome.health.verdict == MapVerdict::good);
  CHECK(outcome.odometry_gaps + outcome.odometry_freezes == 0);
  CHECK(outcome.scans_without_odometry <= 1);  // of the first turn
}

TEST_CASE("without messages of the odometry for a minute the drive is mapped, and the silence is told") {
  const Outcome outcome = drive_with(sim::Fault::odometry_silent);
  CHECK(outcome.notices.has("odometry: no believable odometry frames any more"));
  CHECK(outcome.notices.has("assembler: no odometry: scans are made as if the vehicle stood"));
  CHECK(outcome.odometry_gaps == 1);
  CHECK(outcome.scans_without_odometry >= 48);
  check_map_without_odometry(outcome);
}

TEST_CASE("with the odometry frozen for a minute the drive is mapped, and the frozen sender is told") {
  const Outcome outcome = drive_with(sim::Fault::odometry_frozen, 0);
  CHECK(outcome.notices.has("odometry: the sender's alive counter stands still"));
  CHECK(outcome.odometry_freezes == 1);
  CHECK(outcome.scans_without_odometry >= 48);
  check_map_without_odometry(outcome);
}

TEST_CASE(
    "with the same speeds for a minute, counted on, the drive is mapped, and the frozen data are told") {
  const Outcome outcome = drive_with(sim::Fault::odometry_frozen, 1);
  CHECK(outcome.notices.has("odometry: the same data come again and again though the vehicle moves"));
  CHECK(outcome.odometry_freezes == 1);
  CHECK(outcome.scans_without_odometry >= 44);
  check_map_without_odometry(outcome);
}

TEST_CASE(
    "with wheels that say for a minute that they stand the drive is mapped, and the contradiction is told") {
  const Outcome outcome = drive_with(sim::Fault::odometry_frozen, 2);
  CHECK(outcome.notices.has("odometry: the wheels say that they stand though the gyro turns"));
  CHECK(outcome.odometry_freezes == 1);
  check_map_without_odometry(outcome);
}

TEST_CASE("with an odometry that says for a minute that the vehicle stands the drive is mapped") {
  check_map_without_odometry(drive_with(sim::Fault::odometry_frozen, 3));
}

TEST_CASE("a map that an odometry which says that the vehicle stands has pulled off is not called good") {
  check_not_off_and_good(drive_with(sim::Fault::odometry_frozen, GENERATE(2, 3)));
}

TEST_CASE("a map that is off after a minute without odometry is not called good") {
  check_not_off_and_good(drive_with(sim::Fault::odometry_silent));
}

TEST_CASE("without odometry for a minute in the middle of a longer drive the map does not come apart") {
  check_map_without_odometry(
      drive({}, {{sim::Fault::odometry_silent, 90 * ns_per_s, 60 * ns_per_s, 0}}, 150));
}

TEST_CASE("with a sensor of sixteen rings the drive is mapped") {
  sim::RigSettings rig;
  rig.rings.count = 16;
  const Outcome outcome = drive(rig);
  check_map(outcome, 0.5, 1.5);
  CHECK(outcome.health.verdict == MapVerdict::good);
}

TEST_CASE("in snow, a tenth of the rays on flakes, the drive is mapped") {
  sim::RigSettings rig;
  rig.range_errors.snow_share = 0.1;
  const Outcome outcome = drive(rig);
  check_map(outcome, 0.4, 1);
  CHECK(outcome.health.verdict == MapVerdict::good);
}

TEST_CASE("in a crowd that walks around the vehicle the drive is mapped") {
  sim::RigSettings rig;
  rig.crowd.people = GENERATE(std::size_t{5}, std::size_t{30});
  const Outcome outcome = drive(rig);
  check_map(outcome, 0.6, 2);
  CHECK(outcome.health.verdict == MapVerdict::good);
}
