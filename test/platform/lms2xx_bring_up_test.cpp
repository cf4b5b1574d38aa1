// The LMS 2xx driver against the simulated laser: every baud rate, every fault.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "alces_drivers/lms2xx/lms2xx.h"
#include "alces_platform/sim/random.h"
#include "alces_platform/sim/sensors/simulated_lms2xx.h"

using alces::LaserState;
using alces::Lms2xx;
using alces::Lms2xxConfig;
using alces::ns_per_ms;
using alces::ns_per_s;
using alces::Profile;
using alces::sim::SimulatedLms2xx;
using alces::sim::SimulatedLms2xxSettings;

namespace {

/// Ray i measures 2 m + 1 cm * i (at 1 deg), and the sweep's own time is in every range: one cm a sweep,
/// modulo 5 m.
class Ramp final : public alces::sim::SweepSource {
 public:
  void sweep(std::int64_t first_ray_stamp_ns, double, std::span<float> ranges_m) override {
    first_ray_stamps_ns.push_back(first_ray_stamp_ns);
    const auto last = static_cast<double>(ranges_m.size() - 1);
    for (std::size_t i = 0; i < ranges_m.size(); ++i) {
      ranges_m[i] = static_cast<float>(2 + 1.8 * static_cast<double>(i) / last);
    }
    if (ranges_m.size() > 20) ranges_m[10] = 0;  // nothing there
  }
  std::vector<std::int64_t> first_ray_stamps_ns;
};

/// Driver and laser on one line, in steps of one millisecond.
class Rig final : public alces::BytePort, public alces::NoticePort, public alces::ProfileSink {
 public:
  explicit Rig(const SimulatedLms2xxSettings& settings, const Lms2xxConfig& config = {})
      : laser(settings, ramp), driver(config, *this, *this, *this) {}

  bool write(std::span<const std::uint8_t> bytes) override {
    if (!takes_bytes) return false;
    laser.on_bytes(bytes, now_ns);
    return true;
  }
  bool set_baud_rate(std::uint32_t baud) override {
    if (baud == impossible_baud) return false;
    laser.set_host_baud(baud);
    return true;
  }
  void raise(const alces::Notice& notice) override { notices.emplace_back(notice.text); }
  void on_profile(const Profile& profile) override { profiles.push_back(profile); }

  void run(double seconds) {
    const std::int64_t end_ns = now_ns + std::llround(seconds * 1e9);
    for (; now_ns < end_ns; now_ns += ns_per_ms) {
      while (const auto chunk = laser.poll(now_ns)) waiting.push_back(*chunk);
      const bool is_held_back = random.chance(hold_back_chance);
      if (is_held_back) held_until_ns = now_ns + 25 * ns_per_ms;
      if (now_ns >= held_until_ns) {
        for (const auto& chunk : waiting)
          driver.on_bytes(chunk.bytes, std::max(chunk.stamp_ns, held_until_ns));
        waiting.clear();
      }
      if (now_ns % (20 * ns_per_ms) == 0) driver.on_tick(now_ns);
    }
  }
  bool run_until_measuring(double seconds) {
    for (double t = 0; t < seconds; t += 0.1) {
      run(0.1);
      if (driver.state() == LaserState::measuring && !profiles.empty()) return true;
    }
    return false;
  }
  [[nodiscard]] bool was_told(const std::string& what) const {
    return std::any_of(notices.begin(), notices.end(),
                       [&](const std::string& text) { return text.find(what) != std::string::npos; });
  }
  void restart_count() {
    profiles.clear();
    notices.clear();
  }

  Ramp ramp;
  SimulatedLms2xx laser;
  Lms2xx driver;
  std::int64_t now_ns = 1000 * ns_per_s;
  std::int64_t held_until_ns = 0;
  double hold_back_chance = 0;
  bool takes_bytes = true;
  std::uint32_t impossible_baud = 0;
  alces::sim::Random random{11};
  std::vector<SimulatedLms2xx::Chunk> waiting;
  std::vector<std::string> notices;
  std::vector<Profile> profiles;
};

/// How far profiles' times are from the truth, at worst.
double worst_stamp_error_ns(const Rig& rig, std::size_t from) {
  double worst = 0;
  for (std::size_t i = from; i < rig.profiles.size(); ++i) {
    const std::int64_t stamp_ns = rig.profiles[i].first_ray_stamp_ns;
    const auto& truths = rig.ramp.first_ray_stamps_ns;
    const auto next = std::lower_bound(truths.begin(), truths.end(), stamp_ns);
    double error = 1e12;
    if (next != truths.end()) error = std::abs(static_cast<double>(*next - stamp_ns));
    if (next != truths.begin())
      error = std::min(error, std::abs(static_cast<double>(*(next - 1) - stamp_ns)));
    worst = std::max(worst, error);
  }
  return worst;
}

}  // namespace

TEST_CASE("the laser is brought up from every baud rate it may be at, and streams at 500 000") {
  const std::uint32_t baud = GENERATE(9600U, 19200U, 38400U, 500000U);
  const bool is_streaming = GENERATE(false, true);
  CAPTURE(baud, is_streaming);
  Rig rig({.baud = baud, .is_streaming = is_streaming});
  rig.driver.start(rig.now_ns);
  CHECK(rig.driver.state() == LaserState::connecting);
  REQUIRE(rig.run_until_measuring(15));
  CHECK(rig.laser.baud() == 500000);
  CHECK(rig.driver.baud() == 500000);
  CHECK(rig.laser.counters().configuration_writes == 0);  // it was as wanted
  CHECK(rig.laser.counters().variant_changes == 0);
  rig.restart_count();
  rig.run(4);
  CHECK(rig.profiles.size() >= 299);
  CHECK(rig.profiles.size() <= 301);
  const Profile& profile = rig.profiles.back();
  CHECK(profile.count == 181);
  CHECK(profile.first_angle_rad == Approx(-1.5707963));
  CHECK(profile.angle_step_rad == Approx(0.017453293));
  CHECK(profile.ray_interval_ns == Approx(1e9 / 75 / 360).epsilon(1e-3));
  CHECK(profile.range_m[0] == Approx(2.00));
  CHECK(profile.range_m[180] == Approx(3.80));
  CHECK(profile.range_m[10] == 0);
  CHECK(rig.driver.ray_counters().beyond_reach >= rig.profiles.size());
  for (std::size_t i = 1; i < rig.profiles.size(); ++i) {
    CHECK(rig.profiles[i].counter == rig.profiles[i - 1].counter + 1);
  }
}

TEST_CASE("what differs in the laser is set, and written to its EEPROM once") {
  Rig rig({.field_of_view_deg = 100, .resolution_hundredths_deg = 50, .unit = alces::lms2xx::Unit::mm},
          {.mode = alces::lms2xx::MeasuringMode::field_a, .with_turn_index = true});
  rig.driver.start(rig.now_ns);
  REQUIRE(rig.run_until_measuring(15));
  CHECK(rig.laser.counters().configuration_writes == 1);
  CHECK(rig.laser.counters().variant_changes == 1);
  CHECK(rig.laser.settings().unit == alces::lms2xx::Unit::cm);
  CHECK(rig.profiles.back().count == 181);

  rig.driver.stop(rig.now_ns);
  rig.run(1);
  CHECK(rig.driver.state() == LaserState::stopped);
  CHECK_FALSE(rig.laser.is_streaming());
  rig.profiles.clear();
  rig.driver.start(rig.now_ns);
  REQUIRE(rig.run_until_measuring(5));
  CHECK(rig.laser.counters().configuration_writes == 1);
}

TEST_CASE("half a degree and a quarter come as profiles of one mirror turn each") {
  const std::uint32_t resolution = GENERATE(50U, 25U);
  const std::uint32_t field_of_view = resolution == 50 ? 180 : 100;
  Rig rig({}, {.field_of_view_deg = field_of_view, .resolution_hundredths_deg = resolution});
  rig.driver.start(rig.now_ns);
  REQUIRE(rig.run_until_measuring(15));
  rig.restart_count();
  rig.run(2);
  CHECK(rig.profiles.size() >= 149);
  std::vector<bool> seen(4, false);
  for (const Profile& profile : rig.profiles) {
    const double first_deg = profile.first_angle_rad * 57.295779513 + 0.5 * field_of_view;
    const auto quarter = static_cast<std::size_t>(std::lround(4 * first_deg));
    REQUIRE(quarter < 4);
    seen[quarter] = true;
    CHECK(profile.count == (quarter == 0 ? field_of_view + 1 : field_of_view));
    CHECK(profile.angle_step_rad == Approx(0.017453293));
    CHECK(profile.range_m[0] == Approx(2 + 1.8 * first_deg / field_of_view).margin(0.006));
  }
  CHECK(std::count(seen.begin(), seen.end(), true) == (resolution == 50 ? 2 : 4));
}

TEST_CASE("stamps stay within a tenth of a millisecond when the host gets its bytes late and in bundles") {
  Rig rig({.turns_per_s = 74.93, .send_delay_ns = 300'000}, {.send_delay_ns = 300'000});
  rig.hold_back_chance = 0.01;
  rig.driver.start(rig.now_ns);
  REQUIRE(rig.run_until_measuring(15));
  rig.run(10);
  rig.restart_count();
  rig.run(20);
  CHECK(rig.profiles.size() > 1490);
  CHECK(worst_stamp_error_ns(rig, 0) < 100e3);
  for (std::size_t i = 1; i < rig.profiles.size(); ++i) {
    CHECK(rig.profiles[i].counter == rig.profiles[i - 1].counter + 1);
  }
}

TEST_CASE("when the line cannot do 500 000 baud the laser is used at the rate it has") {
  Rig rig({.baud = 38400});
  rig.impossible_baud = 500000;
  rig.driver.start(rig.now_ns);
  REQUIRE(rig.run_until_measuring(20));
  CHECK(rig.driver.baud() == 38400);
  CHECK(rig.was_told("cannot do this baud rate"));
  rig.run(5);
  rig.restart_count();
  rig.run(5);
  CHECK(rig.profiles.size() > 40);
  CHECK(worst_stamp_error_ns(rig, 0) < 300e3);
}

TEST_CASE("the stream survives garbage, checksum errors, half telegrams and lost ones") {
  Rig rig({});
  rig.driver.start(rig.now_ns);
  REQUIRE(rig.run_until_measuring(15));
  rig.run(2);
  rig.restart_count();
  const auto profiles_in_a_second = [&] {
    const std::size_t before = rig.profiles.size();
    rig.run(1);
    return rig.profiles.size() - before;
  };
  SECTION("garbage between telegrams") {
    const std::vector<std::uint8_t> garbage{0x02, 0x80, 0x00, 0x03, 0x55, 0x06, 0x15, 0xff, 0x02, 0x02, 0x80};
    rig.laser.send_garbage(garbage, rig.now_ns);
    CHECK(profiles_in_a_second() >= 72);
    CHECK(rig.driver.parser_counters().bytes_skipped > 5);
  }
  SECTION("checksum errors") {
    rig.laser.spoil_checksums(5);
    const std::size_t profiles = profiles_in_a_second();
    CHECK(profiles >= 68);
    CHECK(profiles <= 71);
    CHECK(rig.driver.parser_counters().crc_errors >= 5);
    CHECK(rig.driver.clock_counters().turns_missed == 5);
  }
  SECTION("half a telegram") {
    rig.laser.truncate_telegrams(1);
    CHECK(profiles_in_a_second() >= 73);
    CHECK(rig.driver.clock_counters().turns_missed == 1);
  }
  SECTION("telegrams lost without a trace") {
    rig.laser.swallow_telegrams(3);
    CHECK(profiles_in_a_second() >= 71);
    CHECK(rig.driver.clock_counters().turns_missed == 3);
  }
  CHECK(rig.driver.state() == LaserState::measuring);
  CHECK(rig.driver.counters().silences == 0);
  const std::size_t settled = rig.profiles.size();
  rig.run(1);
  CHECK(worst_stamp_error_ns(rig, settled) < 100e3);
}

TEST_CASE("a laser that is switched off and on is found again at 9600 baud") {
  Rig rig({});
  rig.driver.start(rig.now_ns);
  REQUIRE(rig.run_until_measuring(15));
  rig.laser.switch_off();
  rig.restart_count();
  rig.run(10);
  CHECK(rig.profiles.size() <= 1);
  CHECK(rig.driver.state() == LaserState::connecting);
  CHECK(rig.driver.counters().silences == 1);
  CHECK(rig.was_told("no measured values come"));
  CHECK(rig.was_told("is the laser powered"));
  CHECK(rig.notices.size() == 2);  // said once, not at every search
  rig.laser.switch_on(rig.now_ns);
  rig.profiles.clear();
  CHECK(rig.run_until_measuring(20));
  CHECK(rig.driver.baud() == 500000);
}

TEST_CASE("a laser that restarts in mid-stream is brought up again") {
  Rig rig({});
  rig.driver.start(rig.now_ns);
  REQUIRE(rig.run_until_measuring(15));
  rig.laser.switch_off();
  rig.laser.switch_on(rig.now_ns);
  rig.run(1);
  rig.profiles.clear();
  CHECK(rig.run_until_measuring(15));
}

TEST_CASE("a pulled cable is survived, whether the platform notices it or not") {
  const bool is_noticed = GENERATE(false, true);
  Rig rig({});
  rig.driver.start(rig.now_ns);
  REQUIRE(rig.run_until_measuring(15));
  rig.laser.set_connected(false);
  if (is_noticed) {
    rig.driver.on_link(false, rig.now_ns);
    CHECK(std::string(rig.driver.reason()) == "the line is down");
  }
  rig.run(5);
  CHECK(rig.driver.state() == LaserState::connecting);
  rig.laser.set_connected(true);
  if (is_noticed) rig.driver.on_link(true, rig.now_ns);
  rig.restart_count();
  REQUIRE(rig.run_until_measuring(is_noticed ? 3 : 15));  // it streams at 500 000 all the time
  rig.run(3);
  rig.restart_count();
  rig.run(1);
  CHECK(rig.profiles.size() >= 74);
}

TEST_CASE("refusals are repeated, then answered with a pause and a new search") {
  Rig rig({.baud = 500000});
  rig.laser.refuse(2);
  rig.driver.start(rig.now_ns);
  REQUIRE(rig.run_until_measuring(10));

  Rig stubborn({.baud = 500000});
  stubborn.laser.refuse(1'000'000);
  stubborn.driver.start(stubborn.now_ns);
  stubborn.run(60);
  CHECK(stubborn.driver.state() == LaserState::connecting);
  CHECK(stubborn.driver.counters().requests < 120);  // back-off
  CHECK(stubborn.notices.size() <= 2);
  stubborn.laser.refuse(0);
  CHECK(stubborn.run_until_measuring(20));
}

TEST_CASE("a refused password, and a laser that then takes it, are told and got over") {
  Rig rig({.baud = 500000, .unit = alces::lms2xx::Unit::mm},
          {.password = {'w', 'r', 'o', 'n', 'g', '!', '!', '!'}});
  rig.driver.start(rig.now_ns);
  rig.run(20);
  CHECK(rig.driver.state() == LaserState::connecting);
  CHECK(rig.was_told("refuses the password"));
  CHECK(rig.driver.counters().refusals >= 2);
}

TEST_CASE("answers that are lost or broken during bring-up only cost time") {
  const int which = GENERATE(range(0, 12));
  const int fault = GENERATE(0, 1, 2);
  CAPTURE(which, fault);
  Rig rig({.baud = 9600, .unit = alces::lms2xx::Unit::mm});
  rig.driver.start(rig.now_ns);
  // The fault strikes when the laser has taken `which` telegrams.
  for (int ms = 0; ms < 20000 && rig.laser.counters().telegrams_taken < static_cast<unsigned>(which); ++ms)
    rig.run(1e-3);
  if (fault == 0) rig.laser.swallow_telegrams(1);
  if (fault == 1) rig.laser.spoil_checksums(1);
  if (fault == 2) rig.laser.truncate_telegrams(1);
  CHECK(rig.run_until_measuring(40));
  CHECK(rig.laser.counters().configuration_writes <= 2);
}

TEST_CASE("bytes that the port does not take are sent again") {
  Rig rig({.baud = 500000});
  rig.takes_bytes = false;
  rig.driver.start(rig.now_ns);
  rig.run(5);
  CHECK(rig.driver.counters().writes_refused > 2);
  rig.takes_bytes = true;
  CHECK(rig.run_until_measuring(12));
}

TEST_CASE("a stream is only listened to when nothing may be sent") {
  Rig rig({.baud = 500000, .is_streaming = true}, {.is_listen_only = true});
  rig.driver.start(rig.now_ns);
  rig.run(2);
  CHECK(rig.profiles.size() >= 148);
  CHECK(rig.laser.counters().telegrams_taken == 0);
  rig.driver.stop(rig.now_ns);
  CHECK(rig.driver.state() == LaserState::stopped);
  CHECK(rig.laser.is_streaming());
}

TEST_CASE("values laid out otherwise than configured are refused and told") {
  Rig rig({.baud = 500000, .field_of_view_deg = 100, .is_streaming = true}, {.is_listen_only = true});
  rig.driver.start(rig.now_ns);
  rig.run(2);
  CHECK(rig.profiles.empty());
  CHECK(rig.driver.counters().unexpected_layouts > 100);
  CHECK(rig.was_told("not laid out as configured"));
}

TEST_CASE("a configuration that cannot be is refused with its reason") {
  Rig rig({}, {.field_of_view_deg = 180, .resolution_hundredths_deg = 25});
  rig.driver.start(rig.now_ns);
  CHECK(rig.driver.state() == LaserState::failed);
  CHECK(std::string(rig.driver.reason()).find("0.25") != std::string::npos);
  CHECK(alces::validate({.baud = 115200}) != nullptr);
  CHECK(alces::validate({.turns_per_s = 0}) != nullptr);
  CHECK(alces::validate({}) == nullptr);
}

TEST_CASE("stop before the laser was found, twice, and start again are all in order") {
  Rig rig({});
  rig.driver.stop(rig.now_ns);
  CHECK(rig.driver.state() == LaserState::stopped);
  rig.driver.start(rig.now_ns);
  rig.driver.start(rig.now_ns);
  rig.run(0.05);
  rig.driver.stop(rig.now_ns);
  rig.driver.stop(rig.now_ns);
  CHECK(rig.driver.state() == LaserState::stopped);
  rig.driver.start(rig.now_ns);
  CHECK(rig.run_until_measuring(15));
  rig.laser.switch_off();
  rig.driver.stop(rig.now_ns);
  CHECK(rig.driver.state() == LaserState::stopping);
  rig.run(5);
  CHECK(rig.driver.state() == LaserState::stopped);
  CHECK(rig.was_told("did not confirm"));
}

TEST_CASE("minutes of streaming keep their time") {
  Rig rig({.baud = 500000, .turns_per_s = 75.04});
  rig.driver.start(rig.now_ns);
  REQUIRE(rig.run_until_measuring(5));
  for (int minute = 0; minute < 3; ++minute) {
    rig.run(60);
    const std::size_t count = rig.profiles.size();
    CHECK(count > 4480);
    if (minute > 0) CHECK(worst_stamp_error_ns(rig, 0) < 60e3);
    rig.profiles.clear();
    if (minute > 0)
      rig.ramp.first_ray_stamps_ns.erase(rig.ramp.first_ray_stamps_ns.begin(),
                                         rig.ramp.first_ray_stamps_ns.end() - 100);
  }
  CHECK(rig.driver.parser_counters().bytes_skipped < 20);
}
