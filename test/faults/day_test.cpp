// A day of scanning at real rates: 24 simulated hours, 6.5 million sweeps, in some minutes. What wraps, wraps
// (the drive's 32-bit position 33 times, the receiver's midnight once); what could drift or grow must not.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numbers>

#include "support/scanner_harness.h"

namespace {
std::uint64_t allocations_in_drivers = 0;

void count_allocation() {
  if (alces::is_in_drivers) ++allocations_in_drivers;
}
}  // namespace

#ifndef ALCES_SANITIZED  // sanitizers bring a malloc of their own
extern "C" {
void* __libc_malloc(std::size_t);               // NOLINT(bugprone-reserved-identifier)
void* __libc_calloc(std::size_t, std::size_t);  // NOLINT(bugprone-reserved-identifier)
void* __libc_realloc(void*, std::size_t);       // NOLINT(bugprone-reserved-identifier)

void* malloc(std::size_t bytes) {  // operator new comes here too
  count_allocation();
  return __libc_malloc(bytes);
}
void* calloc(std::size_t count, std::size_t bytes) {
  count_allocation();
  return __libc_calloc(count, bytes);
}
void* realloc(void* memory, std::size_t bytes) {
  count_allocation();
  return __libc_realloc(memory, bytes);
}
}
#endif

namespace alces {
namespace {

constexpr double pi = std::numbers::pi;

std::int64_t resident_bytes() {
  std::ifstream file("/proc/self/statm");
  std::int64_t all_pages = 0;
  std::int64_t resident_pages = 0;
  file >> all_pages >> resident_pages;
  return resident_pages * 4096;
}

/// How far off the scanner's times and angles are, in one hour.
struct Errors {
  double angle_rad = 0;  ///< at most: the encoder's angle at a scan's reference time, against the shaft's
  double angle_square_sum = 0;
  std::uint64_t angles = 0;
  double boundary_rad = 0;    ///< where scans begin, against the multiples of half a turn
  double sweep_ns = 0;        ///< a scan's first ray, against the mirror's true turns
  double scan_period_ns = 0;  ///< from reference to reference, against half a turn of the head
};

TEST_CASE("24 hours at real rates: memory flat, no drift in time, counters consistent", "[day]") {
  const char* const wanted_hours =
      std::getenv("ALCES_DAY_HOURS");  // a shorter day, for those who look for something
  const int hours = wanted_hours != nullptr ? std::atoi(wanted_hours) : 24;
  REQUIRE(hours >= 2);
  HarnessSettings settings = harness_settings();
  settings.records = false;
  settings.simulated.lasers[0].turns_per_s = 75.003;  // 40 ppm off, as quartzes are
  settings.simulated.rig.motion.scans = static_cast<std::size_t>(hours) * 3000;
  ScannerHarness harness(settings);
  REQUIRE(harness.bring_up());

  const double turn_ns = 1e9 / settings.simulated.lasers[0].turns_per_s;
  const std::int64_t first_ray_ns = harness.simulated().laser(0).settings().first_ray_stamp_ns;
  const auto true_angle_rad = [&](std::int64_t stamp_ns) {
    return settings.simulated.first_head_angle_rad +
           2 * pi * harness.simulated().drive().head_turns_at(stamp_ns);
  };

  harness.run_s(120);  // the drivers have learned what they can
  harness.scans.clear();
  const ScannerHarness::Delivery first = harness.delivery();
  const std::uint64_t first_events = harness.events;
  const std::uint64_t first_sweeps = harness.simulated().laser(0).counters().sweeps_sent;
  const std::uint64_t first_scans = harness.scans_seen;
  const std::uint64_t first_incomplete = harness.incomplete_scans_seen;
  const std::size_t first_notices = harness.notices.size();
  const std::uint64_t first_gps_back = harness.counter(ScannerPart::gps, "time_backwards");
  const std::uint64_t first_motor_failures = harness.counter(ScannerPart::motor, "motor_failures");

  std::vector<Errors> errors;
  std::vector<std::int64_t> resident;
  std::int64_t last_reference_ns = no_stamp_ns;
  std::uint32_t without_odometry = 0;
  for (int hour = 0; hour < hours; ++hour) {
    Errors& hours_errors = errors.emplace_back();
    for (int piece = 0; piece < 360; ++piece) {  // 10 s each: that far back the encoder remembers
      harness.run_s(10);
      for (const ScannerHarness::ScanSeen& scan : harness.scans) {
        const AngleAnswer answer = harness.scanner().encoder().angle_at(scan.reference_stamp_ns);
        if (answer.status == AngleStatus::ok) {
          const double off_rad =
              std::remainder(answer.angle_rad - true_angle_rad(scan.reference_stamp_ns), 2 * pi);
          hours_errors.angle_square_sum += off_rad * off_rad;
          ++hours_errors.angles;
          hours_errors.angle_rad = std::max(hours_errors.angle_rad, std::abs(off_rad));
        }
        const double begin_rad = true_angle_rad(scan.begin_stamp_ns);
        hours_errors.boundary_rad =
            std::max(hours_errors.boundary_rad, std::abs(std::remainder(begin_rad, pi)));
        const auto since_ns = static_cast<double>(scan.begin_stamp_ns - first_ray_ns);
        hours_errors.sweep_ns = std::max(hours_errors.sweep_ns, std::abs(std::remainder(since_ns, turn_ns)));
        if (last_reference_ns != no_stamp_ns) {
          const auto period_ns = static_cast<double>(scan.reference_stamp_ns - last_reference_ns);
          hours_errors.scan_period_ns = std::max(hours_errors.scan_period_ns, std::abs(period_ns - 1.2e9));
        }
        last_reference_ns = scan.reference_stamp_ns;
        if (!scan.has_odometry) ++without_odometry;
      }
      harness.scans.clear();
    }
    resident.push_back(resident_bytes());
    std::printf(
        "hour %2d: angle %.1e rad, begin %.3f rad, first ray %.0f us, period %.1f ms; resident %.1f MB\n",
        hour, hours_errors.angle_rad, hours_errors.boundary_rad, hours_errors.sweep_ns * 1e-3,
        hours_errors.scan_period_ns * 1e-6, static_cast<double>(resident.back()) * 1e-6);
    std::fflush(stdout);
  }

  // Bounds, the same at the end as at the start.
  for (const Errors& each : errors) {
    CHECK(each.angle_rad < 2e-3);
    CHECK(each.boundary_rad < 0.04);  // a sweep's turn
    CHECK(each.sweep_ns < 0.5e6);
    CHECK(each.scan_period_ns < 2 * turn_ns);
  }
  const auto rms_rad = [](const Errors& each) {
    return std::sqrt(each.angle_square_sum / static_cast<double>(each.angles));
  };
  CHECK(errors.front().angles > 2900);
  CHECK(errors.back().angles > 2900);
  CHECK(rms_rad(errors.back()) < 1.3 * rms_rad(errors.front()) + 1e-5);
  CHECK(errors.back().sweep_ns < 1.5 * errors.front().sweep_ns + 20e3);

  // What came is what went out, and it is what it should be.
  const double duration_s = 3600.0 * hours;
  const ScannerHarness::Delivery last = harness.delivery();
  const auto since = [](std::uint64_t before, std::uint64_t after) {
    return static_cast<double>(after - before);
  };
  CHECK(since(first_scans, harness.scans_seen) == Approx(duration_s / 1.2).margin(2));
  CHECK(harness.incomplete_scans_seen == first_incomplete);
  CHECK(without_odometry == 0);
  CHECK(since(first.profiles, last.profiles) == Approx(duration_s * 75.003).margin(2));
  CHECK(since(first_sweeps, harness.simulated().laser(0).counters().sweeps_sent) ==
        Approx(since(first.profiles, last.profiles)).margin(2));
  CHECK(since(first.positions, last.positions) == Approx(duration_s * 100).margin(2));
  CHECK(since(first.pulses, last.pulses) == Approx(duration_s / 2.4).margin(2));
  CHECK(since(first.odometry, last.odometry) == Approx(duration_s * 50).margin(2));
  CHECK(since(first.fixes, last.fixes) == Approx(duration_s).margin(2));
  CHECK(harness.counter(ScannerPart::gps, "time_backwards") == first_gps_back);
  CHECK(harness.counter(ScannerPart::motor, "motor_failures") == first_motor_failures);
  CHECK(harness.events > first_events);
  CHECK(harness.account().empty());
  for (std::size_t i = first_notices; i < harness.notices.size(); ++i) {
    UNSCOPED_INFO(harness.notices[i].source << ": " << harness.notices[i].text);
  }
  CHECK(harness.notices.size() == first_notices);  // nothing to complain of in a whole day

#ifndef ALCES_SANITIZED
  CHECK(allocations_in_drivers == 0);
  CHECK(resident.back() - resident.front() < (std::int64_t{1} << 20));
#endif
}

}  // namespace
}  // namespace alces
