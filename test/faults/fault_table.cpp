#include "fault_table.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <numbers>
#include <set>

namespace alces {
namespace {

constexpr std::string_view test_prefix = "fault: ";

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(' ');
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(' ') - begin + 1);
}

std::vector<std::vector<std::string>> read_table() {
  std::vector<std::vector<std::string>> rows;
  std::ifstream file(ALCES_FAULT_TABLE);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line.front() != '|' || line.find("---") != std::string::npos) continue;
    std::vector<std::string>& cells = rows.emplace_back();
    std::size_t from = 1;
    for (std::size_t bar = line.find('|', from); bar != std::string::npos; bar = line.find('|', from)) {
      cells.push_back(trimmed(line.substr(from, bar - from)));
      from = bar + 1;
    }
  }
  if (!rows.empty()) rows.erase(rows.begin());  // the heads
  return rows;
}

}  // namespace

const std::vector<std::vector<std::string>>& fault_table() {
  static const auto table = read_table();
  return table;
}

TEST_CASE("the table of faults and the tests are the same list") {
  REQUIRE(fault_table().size() >= 30);
  std::set<std::string> rows;
  for (const std::vector<std::string>& row : fault_table()) {
    INFO(row.front());
    CHECK(row.size() == 5);
    CHECK(rows.insert(row.front()).second);
  }
  std::set<std::string> tests;
  for (const Catch::TestCase& test : Catch::getAllTestCasesSorted(*Catch::getCurrentContext().getConfig())) {
    if (test.name.starts_with(test_prefix)) tests.insert(test.name.substr(test_prefix.size()));
  }
  CHECK(rows == tests);
}

FaultBench::FaultBench(const std::string& row, const HarnessSettings& settings)
    : harness(settings), first_angle_rad_(settings.simulated.first_head_angle_rad) {
  const auto found =
      std::ranges::find_if(fault_table(), [&](const auto& cells) { return cells.front() == row; });
  INFO(row);
  REQUIRE(found != fault_table().end());
  REQUIRE(found->size() == 5);
  reported_ = (*found)[1];
  goes_on_ = (*found)[2];
  recovers_ = (*found)[3];
  REQUIRE(harness.bring_up());
  harness.run_s(7);
}

void FaultBench::suffer(sim::Fault fault, double duration_s, std::int64_t argument) {
  harness.inject(fault, duration_s, argument);
  endure(duration_s);
}

void FaultBench::endure(double duration_s) {
  notices_before_ = harness.notices.size();
  scans_before_ = harness.scans.size();
  counters_before_.clear();
  harness.scanner().visit_counters(
      [this](ScannerPart, const char*, std::uint64_t value) { counters_before_.push_back(value); });
  delivery_before_ = harness.delivery();
  worst_angle_rad_ = 0;
  angles_ = 0;
  constexpr double piece_s = 0.05;
  double passed_s = 0;
  for (; passed_s + piece_s <= duration_s; passed_s += piece_s) {
    harness.run_s(piece_s);
    const std::int64_t stamp_ns = harness.now_ns() - 200 * ns_per_ms;  // the assembler waits about so long
    const AngleAnswer answer = harness.scanner().encoder().angle_at(stamp_ns);
    if (answer.status != AngleStatus::ok) continue;
    ++angles_;
    const double true_rad =
        first_angle_rad_ + 2 * std::numbers::pi * harness.simulated().drive().head_turns_at(stamp_ns);
    const double off_rad = std::abs(std::remainder(answer.angle_rad - true_rad, 2 * std::numbers::pi));
    worst_angle_rad_ = std::max(worst_angle_rad_, off_rad);
  }
  harness.run_s(duration_s - passed_s);
  delivery_ = harness.delivery();
  duration_s_ = duration_s;
}

void FaultBench::is_told(std::string_view source, std::string_view text) {
  const std::string wanted = std::string(source) + ": " + std::string(text);
  bool was_told = false;
  std::string others;
  for (std::size_t i = notices_before_; i < harness.notices.size(); ++i) {
    const std::string told = std::string(harness.notices[i].source) + ": " + harness.notices[i].text;
    was_told = was_told || told == wanted;
    if (others.find(told) == std::string::npos) others += "\n  " + told;
  }
  INFO("wanted: " << wanted << "\ntold:" << others);
  CHECK(was_told);
  CHECK(reported_.find("`" + wanted + "`") != std::string::npos);
}

void FaultBench::nobody_is_told() {
  for (std::size_t i = notices_before_; i < harness.notices.size(); ++i) {
    INFO(harness.notices[i].source << ": " << harness.notices[i].text);
    CHECK(harness.notices[i].severity == Severity::info);
  }
  CHECK(reported_.find("no notice") != std::string::npos);
}

std::uint64_t& FaultBench::counter_before(ScannerPart part, std::string_view name) {
  std::size_t place = 0;
  std::size_t found = SIZE_MAX;
  harness.scanner().visit_counters([&](ScannerPart each_part, const char* each, std::uint64_t) {
    if (each_part == part && name == each && found == SIZE_MAX) found = place;
    ++place;
  });
  INFO(to_string(part) << "." << name);
  REQUIRE(found < counters_before_.size());
  return counters_before_[found];
}

void FaultBench::is_counted(ScannerPart part, std::string_view name, std::uint64_t at_least) {
  const std::string counter = std::string(to_string(part)) + "." + std::string(name);
  INFO(counter);
  CHECK(harness.counter(part, name) - counter_before(part, name) >= at_least);
  CHECK(reported_.find("`" + counter + "`") != std::string::npos);
}

void FaultBench::goes_on(unsigned devices) {
  const auto rate_hz = [this](std::uint64_t before, std::uint64_t after) {
    return static_cast<double>(after - before) / duration_s_;
  };
  INFO("rates, Hz, of laser, drive, odometry while the fault lasted: "
       << rate_hz(delivery_before_.profiles, delivery_.profiles) << " "
       << rate_hz(delivery_before_.positions, delivery_.positions) << " "
       << rate_hz(delivery_before_.odometry, delivery_.odometry));
  const double lasers = harness.scanner().laser_count();
  if ((devices & drive) != 0) CHECK(rate_hz(delivery_before_.positions, delivery_.positions) > 95);
  if ((devices & laser) != 0) CHECK(rate_hz(delivery_before_.profiles, delivery_.profiles) > 74 * lasers);
  if ((devices & odometry) != 0) CHECK(rate_hz(delivery_before_.odometry, delivery_.odometry) > 48);
  const auto whole_s = static_cast<std::uint64_t>(duration_s_);
  if ((devices & gps) != 0) CHECK(delivery_.fixes - delivery_before_.fixes + 1 >= whole_s);
  if ((devices & index) != 0) CHECK(delivery_.pulses - delivery_before_.pulses + 1 >= whole_s * 10 / 24);
}

void FaultBench::angle_is_true(const std::string& within_deg) {
  const double worst_deg = worst_angle_rad_ * 180 / std::numbers::pi;
  INFO("the angle was off by up to " << worst_deg << " deg");
  CHECK(static_cast<double>(angles_) > duration_s_ / 0.05 * 0.9);
  CHECK(worst_deg < std::stod(within_deg));
  CHECK(goes_on_.find("the angle within " + within_deg + " deg") != std::string::npos);
}

void FaultBench::is_whole_again(int limit_s) {
  const double took_s = harness.seconds_until_whole(90);
  INFO("took " << took_s << " s");
  CHECK(took_s <= limit_s);
  CHECK(recovers_.find("within " + std::to_string(limit_s) + " s") != std::string::npos);
}

void FaultBench::scans_go_on() {
  const std::size_t scans = harness.scans.size() - scans_before_;
  CHECK(static_cast<double>(scans) >= duration_s_ / 1.2 - 1);
  for (std::size_t i = scans_before_; i < harness.scans.size(); ++i) {
    INFO("scan " << harness.scans[i].number << " has " << harness.scans[i].profiles << " profiles");
    CHECK_FALSE(harness.scans[i].is_incomplete);
  }
}

void FaultBench::all_is_well() {
  const Scanner& scanner = harness.scanner();
  CHECK(scanner.phase() == ScannerPhase::scanning);
  if (harness.counter(ScannerPart::motor, "motor_starts") != UINT64_MAX) {
    INFO(scanner.motor().reason());
    CHECK(scanner.motor().state() == MotorState::running);
  }
  for (std::uint32_t number = 0; number < scanner.laser_count(); ++number) {
    INFO(scanner.laser(number).reason());
    CHECK(scanner.laser(number).state() == LaserState::measuring);
  }
  CHECK(scanner.odometry().is_alive());
  CHECK(harness.account() == "");
  CHECK(harness.recording().file_counters().messages_lost == 0);
}

}  // namespace alces
