// The index line and quadrature.
#include <catch2/catch.hpp>
#include <numbers>

#include "fault_table.h"

namespace alces {
namespace {

using sim::Fault;
using enum ScannerPart;
constexpr unsigned others = FaultBench::drive | FaultBench::laser | FaultBench::odometry | FaultBench::gps;

HarnessSettings with_quadrature() {
  HarnessSettings settings = harness_settings();
  settings.simulated.rig.encoder.quadrature_lines = 256;
  EncoderConfig& encoder = settings.scanner.encoder;
  encoder.a_line = sim::HeadEncoderSettings::a_line;
  encoder.b_line = sim::HeadEncoderSettings::b_line;
  encoder.shape = AngleShape::quadrature;
  encoder.quadrature_counts_per_turn = 1024;
  return settings;
}

TEST_CASE("fault: index pulse missing") {
  FaultBench bench("index pulse missing");
  bench.suffer(Fault::index_missing, 12);
  bench.is_told("encoder", "the index pulses stay away: check the sensor and its line");
  bench.goes_on(others);
  bench.scans_go_on();  // the counts carry the angle on
  bench.is_whole_again(4);
  bench.is_told("encoder", "the index pulses are back");
  bench.is_counted(encoder, "index_missing", 4);
  bench.all_is_well();
}

TEST_CASE("fault: index pulse extra") {
  FaultBench bench("index pulse extra");
  bench.harness.run_s(0.3);
  bench.suffer(Fault::index_extra, 8);
  bench.is_told("encoder", "an index pulse came where none was due");
  bench.is_counted(encoder, "index_extra", 5);
  bench.goes_on(others | FaultBench::index);
  bench.scans_go_on();
  bench.all_is_well();
}

TEST_CASE("fault: index pulse extra, just before a good one") {
  FaultBench bench("index pulse extra, just before a good one");
  // 20 ms before the next good pulse, and then every turn: the wrong one is believed first.
  const double angle_rad = bench.harness.rig().head_angle_rad(bench.harness.now_ns());
  const double way_rad = 2 * std::numbers::pi + std::remainder(0.4 - angle_rad, 2 * std::numbers::pi);
  bench.harness.run_s(way_rad / (std::numbers::pi / 1.2) - 0.0205);
  bench.suffer(Fault::index_extra, 8, 700);
  bench.is_told("encoder", "an index pulse came where none was due");
  bench.goes_on(others);
  bench.is_whole_again(12);
  bench.all_is_well();
}

TEST_CASE("fault: index pulse bouncing") {
  FaultBench bench("index pulse bouncing");
  bench.suffer(Fault::index_bouncing, 8);
  bench.is_told("encoder", "the index pulse bounces");
  bench.is_counted(encoder, "index_bounces", 4);
  bench.goes_on(FaultBench::all);
  bench.scans_go_on();
  bench.all_is_well();
}

TEST_CASE("fault: A and B swapped") {
  FaultBench bench("A and B swapped", with_quadrature());
  bench.suffer(Fault::ab_swapped, 8);
  bench.is_told("encoder", "the head turns against its expected direction, or A and B are swapped");
  bench.is_told("encoder", "quadrature and drive turn in opposite directions: A and B are swapped");
  bench.is_counted(encoder, "quadrature_against_drive");
  bench.goes_on(others);
  bench.is_whole_again(10);
  bench.all_is_well();
}

TEST_CASE("fault: GPIO overflow") {
  FaultBench bench("GPIO overflow");
  bench.suffer(Fault::edges_lost, 5);
  bench.goes_on(others);
  bench.is_whole_again(6);
  bench.is_told("encoder", "edges were lost before they could be read");
  bench.is_counted(encoder, "edges_lost", 2);
  bench.all_is_well();
}

TEST_CASE("fault: GPIO overflow, quadrature") {
  FaultBench bench("GPIO overflow, quadrature", with_quadrature());
  bench.suffer(Fault::edges_lost, 1);
  bench.goes_on(others);
  bench.is_whole_again(8);
  bench.is_told("encoder", "edges were lost before they could be read");
  bench.is_counted(encoder, "edges_lost", 400);
  bench.all_is_well();
}

/// Turned by somebody's hand: forwards, for a while backwards.
class TurnedHead final : public sim::HeadMotor {
 public:
  [[nodiscard]] double angle_rad(std::int64_t now_ns) override {
    if (last_ns != no_stamp_ns) angle += velocity * seconds(now_ns - last_ns);
    last_ns = now_ns;
    return angle;
  }
  [[nodiscard]] double velocity_rad_per_s(std::int64_t) override { return velocity; }

  double velocity = std::numbers::pi / 1.2;
  double angle = 1;
  std::int64_t last_ns = no_stamp_ns;
};

TEST_CASE("fault: head turned backwards by hand") {
  TurnedHead head;
  HarnessSettings settings = with_quadrature();
  settings.scanner.has_motor = false;
  settings.head = &head;
  FaultBench bench("head turned backwards by hand", settings);
  head.velocity = -head.velocity;
  bench.endure(6);
  bench.is_told("encoder", "the head turns against its expected direction, or A and B are swapped");
  bench.is_told("assembler", "the head turned round: a scan ends early");
  bench.is_counted(encoder, "reversals");
  bench.is_counted(assembler, "head_reversals");
  bench.goes_on(FaultBench::laser | FaultBench::odometry | FaultBench::gps);
  head.velocity = -head.velocity;
  bench.is_whole_again(6);
  bench.all_is_well();
}

}  // namespace
}  // namespace alces
