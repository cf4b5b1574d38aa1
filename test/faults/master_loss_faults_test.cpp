// A drive that nobody commands: what the driver finds out and sets, and how long the shaft then takes. The
// page on safety states these times; here they are measured.
#include <catch2/catch.hpp>
#include <fstream>
#include <functional>
#include <sstream>

#include "support/drive_bench.h"

namespace alces {
namespace {

using test::DriveBench;
using Model = sim::SimulatedCia402Drive::Model;

MotorConfig example(const char* file) {
  return settings::read_vehicle_settings(std::string(ALCES_EXAMPLES "/") + file).scanner.motor;
}

sim::SimulatedCia402Drive::Config drive_of(Model model) {
  sim::SimulatedCia402Drive::Config config;
  config.model = model;
  config.motor_turns_per_head_turn = 60;
  if (model == Model::epos4) config.axis.counts_per_turn = 4096;
  if (model == Model::ipos) {
    // 2000 counts a turn; velocities in counts/ms, accelerations in counts/ms^2, both in 16.16 fixed point.
    config.axis.counts_per_turn = 2000;
    config.axis.rpm_per_velocity_unit = 1000.0 / 65536 / 2000 * 60;
    config.axis.rpm_per_s_per_acceleration_unit = 1e6 / 65536 / 2000 * 60;
  }
  return config;
}

struct Case {
  const char* row;  ///< the first cell of the page's table
  const char* file;
  Model model;
  MasterLossReaction reaction;
  /// Makes the drive another one, before it is met.
  std::function<void(sim::ObjectDictionary&)> alter = [](sim::ObjectDictionary&) {};
  std::function<void(MotorConfig&)> configure = [](MotorConfig&) {};
};

/// The greatest code that 0x6007 takes.
std::function<void(sim::ObjectDictionary&)> takes_up_to(std::int64_t most, std::int64_t fault_reaction = 2) {
  return [=](sim::ObjectDictionary& objects) {
    sim::ObjectEntry option = *objects.find(0x6007, 0);
    option.default_value = 0;
    option.maximum = most;
    objects.add(0x6007, 0, option);
    sim::ObjectEntry reaction = *objects.find(0x605E, 0);
    reaction.default_value = fault_reaction;
    objects.add(0x605E, 0, reaction);
  };
}

std::vector<Case> cases() {
  using enum MasterLossReaction;
  const auto nothing = [](sim::ObjectDictionary&) {};
  return {
      {"TMCM-1636, as the example", "vehicle.toml", Model::tmcm1636, none},
      {"EPOS4, as the example", "motor-epos4.toml", Model::epos4, quick_stop},
      {"EPOS4 that takes disable voltage only", "motor-epos4.toml", Model::epos4, disable_voltage,
       takes_up_to(2)},
      {"EPOS4 that takes fault only, 0x605E = 0 (no torque)", "motor-epos4.toml", Model::epos4, fault,
       takes_up_to(1, 0)},
      {"EPOS4 that takes fault only, 0x605E = 1 (slow-down ramp)", "motor-epos4.toml", Model::epos4, fault,
       takes_up_to(1, 1)},
      {"EPOS4 that takes fault only, 0x605E = 2 (quick-stop ramp)", "motor-epos4.toml", Model::epos4, fault,
       takes_up_to(1, 2)},
      {"EPOS4 that takes nothing", "motor-epos4.toml", Model::epos4, none, takes_up_to(0)},
      {"EPOS4 that is not told to watch us", "motor-epos4.toml", Model::epos4, none, nothing,
       [](MotorConfig& config) { config.own_heartbeat_timeout_ms = 0; }},
      {"iPOS, as the example", "motor-ipos.toml", Model::ipos, quick_stop},
  };
}

/// The third cell of the row: seconds; negative: it never stops.
double stated_s(const std::string& row) {
  std::ifstream page(ALCES_SAFETY_PAGE);
  for (std::string line; std::getline(page, line);) {
    if (line.find("| " + row + " |") != 0) continue;
    std::istringstream cells(line);
    std::string cell;
    for (int i = 0; i < 4; ++i) std::getline(cells, cell, '|');
    return cell.find("never") != std::string::npos ? -1 : std::stod(cell);
  }
  FAIL("docs/safety.md has no row: " << row);
  return 0;
}

}  // namespace

TEST_CASE(
    "what a drive does when nobody commands it is found out, set, said, and takes as long as the page says") {
  for (const Case& each : cases()) {
    INFO(each.row);
    MotorConfig config = example(each.file);
    each.configure(config);
    DriveBench bench(config, drive_of(each.model));
    each.alter(bench.drive.objects());
    bench.drive.reset(bench.now_ns);
    bench.run_ms(600);
    REQUIRE(bench.spin_up());
    bench.run_ms(500);
    CHECK(bench.motor->master_loss_reaction() == each.reaction);
    CHECK(bench.notices.count(to_string(each.reaction)) == 1);
    for (const Notice& notice : bench.notices.notices) {
      if (std::string(notice.text) == to_string(each.reaction))
        CHECK((notice.severity == Severity::warning) == is_unsafe(each.reaction));
    }
    const std::int64_t killed_ns = bench.now_ns;
    bench.kill_program();
    while (bench.turns_per_s() != 0 && bench.now_ns - killed_ns < 60 * ns_per_s) bench.step();
    const double took_s = bench.turns_per_s() != 0 ? -1 : seconds(bench.now_ns - killed_ns);
    INFO("took " << took_s << " s");
    CHECK(took_s == Approx(stated_s(each.row)).margin(0.06));
    CHECK((took_s < 0) == is_unsafe(each.reaction));
  }
}

TEST_CASE("the reaction is set before there is torque") {
  DriveBench bench(example("motor-epos4.toml"), drive_of(Model::epos4));
  takes_up_to(3)(bench.drive.objects());
  bench.drive.reset(0);
  bench.motor->start(0);
  while (bench.drive.state() != sim::Cia402State::operation_enabled && bench.now_ns < 10 * ns_per_s)
    bench.step();
  CHECK(bench.drive.objects().value(0x6007) == 3);
}

TEST_CASE("a drive that does not answer what it does without a master is used all the same, and it is said") {
  MotorConfig config = example("motor-epos4.toml");
  config.sdo = {.response_timeout_ns = 50 * ns_per_ms, .retry_limit = 1};
  DriveBench bench(config, drive_of(Model::epos4));
  bench.motor->start(0);
  while (bench.motor->state() != MotorState::enabling && bench.now_ns < 10 * ns_per_s) bench.step();
  // Only the mode's read is answered from here on.
  bench.drive.set_sdo_silent(true);
  bench.run_ms(60);
  bench.drive.set_sdo_silent(false);
  CHECK(bench.run_until(MotorState::running));
  CHECK(bench.motor->counters().failures == 0);
}

TEST_CASE("a maker's watchdog is written, and is said to be what stops the drive") {
  MotorConfig config = example("motor-epos4.toml");
  REQUIRE(config.watchdog_writes.add({0x6086, 0, 2, 0}));
  DriveBench bench(config, drive_of(Model::epos4));
  REQUIRE(bench.spin_up());
  CHECK(bench.motor->master_loss_reaction() == MasterLossReaction::by_maker);
}

}  // namespace alces
