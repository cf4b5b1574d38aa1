#include "alces_drivers/encoder/encoder.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>

#include "alces_platform/sim/random.h"
#include "drivers/notice_log.h"

using namespace alces;

namespace {

constexpr double turn_rad = 2 * std::numbers::pi;
constexpr double speed_rad_s = 2.618;
constexpr std::int64_t begin_ns = 50 * ns_per_s;

/// What happens on the wires, in the order in which it is handed on.
struct Wire {
  enum Kind { edge, position, lost, tick } kind = tick;
  std::int64_t arrives_ns = 0;
  std::int64_t stamp_ns = 0;
  GpioEdge line;
  std::int32_t counts = 0;
  std::uint32_t lost_count = 0;
};

constexpr std::uint8_t index_line = 0;
constexpr std::uint8_t a_line = 1;
constexpr std::uint8_t b_line = 2;

/// A head whose angle is a function of time, and what its sensors make of it.
struct Head {
  std::function<double(double)> angle_rad = [](double t_s) { return speed_rad_s * t_s - 1.0; };
  double duration_s = 30;
  double counts_per_turn = 4000 * 66;
  double true_counts_per_turn = 4000 * 66;
  double start_counts = 0;
  double quadrature_counts_per_turn = 1024;
  bool has_index = true;
  bool has_drive = true;
  bool has_quadrature = false;
  double jitter_ns = 0;  ///< of the drive's stamps, standard deviation
  std::uint64_t seed = 1;

  [[nodiscard]] double truth_rad(std::int64_t stamp_ns) const {
    return angle_rad(seconds(stamp_ns - begin_ns));
  }

  [[nodiscard]] std::vector<Wire> wires() const {
    std::vector<Wire> all;
    sim::Random random(seed);
    const auto end_ns = begin_ns + static_cast<std::int64_t>(duration_s * 1e9);
    const auto add_edge = [&](std::uint8_t line, bool is_rising, std::int64_t stamp_ns) {
      Wire wire;
      wire.kind = Wire::edge;
      wire.stamp_ns = wire.arrives_ns = stamp_ns;
      wire.line = {line, is_rising, 0};
      all.push_back(wire);
    };
    // Edges where a quantised angle changes, found to the nanosecond.
    const auto crossings = [&](double counts, auto emit) {
      const auto level = [&](std::int64_t t) {
        return static_cast<std::int64_t>(std::floor(truth_rad(t) / turn_rad * counts));
      };
      constexpr std::int64_t step = 200 * ns_per_us;
      for (std::int64_t t = begin_ns; t < end_ns; t += step) {
        const std::int64_t from = level(t);
        const std::int64_t to = level(t + step);
        if (from == to) continue;
        std::int64_t low = t;
        std::int64_t high = t + step;
        while (high - low > 1) {
          const std::int64_t middle = low + (high - low) / 2;
          (level(middle) == from ? low : high) = middle;
        }
        emit(high, from, to);
      }
    };
    if (has_index) {
      crossings(1, [&](std::int64_t t, std::int64_t, std::int64_t) {
        add_edge(index_line, true, t);
        add_edge(index_line, false, t + 2 * ns_per_ms);
      });
    }
    if (has_quadrature) {
      crossings(quadrature_counts_per_turn, [&](std::int64_t t, std::int64_t from, std::int64_t to) {
        // Levels of the quarter steps 0..3: A 0 1 1 0, B 0 0 1 1.
        const auto a = [](std::int64_t n) { return ((n & 3) == 1) || ((n & 3) == 2); };
        const auto b = [](std::int64_t n) { return (n & 3) >= 2; };
        if (a(from) != a(to)) add_edge(a_line, a(to), t);
        if (b(from) != b(to)) add_edge(b_line, b(to), t);
      });
    }
    for (std::int64_t t = begin_ns; t < end_ns && has_drive; t += 10 * ns_per_ms) {
      Wire wire;
      wire.kind = Wire::position;
      wire.stamp_ns = t + static_cast<std::int64_t>(jitter_ns * random.normal());
      wire.arrives_ns = t + ns_per_ms;
      const double counts = std::floor(start_counts + truth_rad(t) / turn_rad * true_counts_per_turn);
      wire.counts = static_cast<std::int32_t>(static_cast<std::uint32_t>(static_cast<std::int64_t>(counts)));
      all.push_back(wire);
    }
    for (std::int64_t t = begin_ns; t < end_ns; t += 20 * ns_per_ms) {
      Wire wire;
      wire.stamp_ns = wire.arrives_ns = t;
      all.push_back(wire);
    }
    std::ranges::stable_sort(all, {}, &Wire::arrives_ns);
    return all;
  }
};

EncoderConfig config_for(const Head& head) {
  EncoderConfig config;
  config.index_line = head.has_index ? index_line : EncoderConfig::no_line;
  config.shape = head.has_drive        ? AngleShape::drive
                 : head.has_quadrature ? AngleShape::quadrature
                                       : AngleShape::none;
  if (head.has_drive) config.drive_counts_per_turn = head.counts_per_turn;
  if (head.has_quadrature) {
    config.a_line = a_line;
    config.b_line = b_line;
    config.quadrature_counts_per_turn = head.quadrature_counts_per_turn;
  }
  return config;
}

struct Asked {
  std::int64_t stamp_ns = 0;
  AngleAnswer response;
};

/// Plays the wires and asks on the way, as an assembler does: for times 13 ms apart, each until it is ok or
/// lost.
struct Run {
  NoticeLog log;
  std::unique_ptr<Encoder> encoder;
  std::vector<Asked> answers;

  Run(const EncoderConfig& config, const std::vector<Wire>& wires) {
    REQUIRE(validate(config) == nullptr);
    encoder = std::make_unique<Encoder>(config, log);
    std::int64_t next_ns = begin_ns;
    for (const Wire& wire : wires) {
      switch (wire.kind) {
        case Wire::edge:
          encoder->on_edge(wire.line, wire.stamp_ns);
          break;
        case Wire::position:
          encoder->on_drive_position(wire.counts, wire.stamp_ns);
          break;
        case Wire::lost:
          encoder->on_edges_lost(wire.lost_count, wire.stamp_ns);
          break;
        case Wire::tick:
          encoder->on_tick(wire.stamp_ns);
          break;
      }
      for (; next_ns + 20 * ns_per_ms < wire.arrives_ns; next_ns += 13 * ns_per_ms) {
        const AngleAnswer answer = encoder->angle_at(next_ns);
        if (answer.status == AngleStatus::not_yet) break;
        CHECK(std::isfinite(answer.angle_rad));
        CHECK(std::isfinite(answer.sigma_rad));
        answers.push_back({next_ns, answer});
      }
    }
    for (const Asked& asked : answers) {  // what was ok stays what it was
      if (asked.response.status != AngleStatus::ok) continue;
      const AngleAnswer again = encoder->angle_at(asked.stamp_ns);
      if (again.status == AngleStatus::too_old) continue;
      REQUIRE(again.status == AngleStatus::ok);
      REQUIRE(again.angle_rad == asked.response.angle_rad);
      REQUIRE(again.sigma_rad == asked.response.sigma_rad);
    }
  }

  [[nodiscard]] std::size_t ok_count(double from_s = 0, double to_s = 1e9) const {
    return static_cast<std::size_t>(std::ranges::count_if(answers, [&](const Asked& asked) {
      const double t_s = seconds(asked.stamp_ns - begin_ns);
      return asked.response.status == AngleStatus::ok && t_s >= from_s && t_s < to_s;
    }));
  }
  [[nodiscard]] double ok_share(double from_s, double to_s) const {
    return static_cast<double>(ok_count(from_s, to_s)) / ((to_s - from_s) / 0.013);
  }

  /// The largest error modulo whole turns, and the largest error in sigmas.
  struct Errors {
    double rad = 0;
    double sigmas = 0;
  };
  [[nodiscard]] Errors errors(const Head& head, double from_s = 0, double to_s = 1e9) const {
    Errors worst;
    for (const Asked& asked : answers) {
      const double t_s = seconds(asked.stamp_ns - begin_ns);
      if (asked.response.status != AngleStatus::ok || t_s < from_s || t_s >= to_s) continue;
      const double error_rad =
          std::abs(std::remainder(asked.response.angle_rad - head.truth_rad(asked.stamp_ns), turn_rad));
      worst.rad = std::max(worst.rad, error_rad);
      worst.sigmas = std::max(worst.sigmas, error_rad / asked.response.sigma_rad);
    }
    return worst;
  }
};

bool is_index(const Wire& wire) {
  return wire.kind == Wire::edge && wire.line.line == index_line && wire.line.is_rising;
}

/// The stamp of the n-th index pulse.
std::int64_t pulse_ns(const std::vector<Wire>& wires, int n) {
  for (const Wire& wire : wires) {
    if (is_index(wire) && n-- == 0) return wire.stamp_ns;
  }
  return no_stamp_ns;
}

void add_pulse(std::vector<Wire>& wires, std::int64_t stamp_ns) {
  Wire wire;
  wire.kind = Wire::edge;
  wire.stamp_ns = wire.arrives_ns = stamp_ns;
  wire.line = {index_line, true, 0};
  wires.push_back(wire);
  std::ranges::stable_sort(wires, {}, &Wire::arrives_ns);
}

}  // namespace

TEST_CASE("index and drive give the head's angle through wraps of the 32-bit position") {
  Head head;
  head.start_counts = 2147483647.0 - 3e5;  // wraps in the second turn
  const Run run(config_for(head), head.wires());
  CHECK(run.ok_share(3, 29) > 0.99);
  CHECK(run.errors(head).rad < 1e-4);
  CHECK(run.encoder->counters().position_jumps == 0);
  CHECK(run.encoder->counters().index_pulses == 13);
  CHECK(run.encoder->counters().index_missing == 0);
  CHECK(run.encoder->is_speed_in_tolerance());
  double speed = 0;
  REQUIRE(run.encoder->speed(speed));
  CHECK(speed == Approx(speed_rad_s).epsilon(1e-3));
}

TEST_CASE("the angle grows from turn to turn without a step at the index") {
  Head head;
  const Run run(config_for(head), head.wires());
  double before_rad = -1e9;
  for (const Asked& asked : run.answers) {
    if (asked.response.status != AngleStatus::ok) continue;
    CHECK(asked.response.angle_rad > before_rad);
    before_rad = asked.response.angle_rad;
  }
  CHECK(before_rad > 11 * turn_rad);
}

TEST_CASE(
    "counts that creep are corrected by the index: learned, or shared out over the turn when one waits") {
  Head head;
  head.true_counts_per_turn = head.counts_per_turn * 1.003;  // 19 mrad a turn
  EncoderConfig config = config_for(head);
  const Run learned(config, head.wires());
  CHECK(learned.errors(head).sigmas < 3);
  CHECK(learned.errors(head, 6, 30).rad < 2e-4);  // two turns were enough
  CHECK(learned.ok_share(6, 29) > 0.99);

  config.wait_for_index = true;
  config.maximum_wait_ns = 4 * ns_per_s;
  const Run waited(config, head.wires());
  CHECK(waited.errors(head, 3, 30).rad < 2e-4);  // already in the first turn
  CHECK(waited.ok_share(3, 24) > 0.99);
}

TEST_CASE("a head that waits for its index gives no answer before it") {
  Head head;
  EncoderConfig config = config_for(head);
  config.wait_for_index = true;
  config.maximum_wait_ns = 4 * ns_per_s;
  std::vector<Wire> wires = head.wires();
  const std::int64_t third_ns = pulse_ns(wires, 3);
  std::erase_if(wires, [&](const Wire& wire) { return wire.arrives_ns >= third_ns; });
  Run run(config, wires);
  CHECK(run.encoder->angle_at(third_ns - ns_per_s).status == AngleStatus::not_yet);
  // Then the wait is over, and the learned ratio has to do; what was unknown becomes known, what was ok
  // stays.
  run.encoder->on_tick(third_ns + 3 * ns_per_s + 200 * ns_per_ms);
  const AngleAnswer answer = run.encoder->angle_at(third_ns - ns_per_s);
  REQUIRE(answer.status == AngleStatus::ok);
  CHECK(answer.angle_rad ==
        Approx(head.truth_rad(third_ns - ns_per_s) +
               turn_rad * std::round((answer.angle_rad - head.truth_rad(third_ns - ns_per_s)) / turn_rad))
            .margin(1e-3));
}

TEST_CASE("with index pulses alone the speed between two is taken as constant") {
  Head head;
  head.has_drive = false;
  head.angle_rad = [](double t_s) { return speed_rad_s * t_s + 0.01 * std::sin(2.0 * t_s); };
  EncoderConfig config = config_for(head);
  config.maximum_wait_ns = 4 * ns_per_s;
  const Run run(config, head.wires());
  CHECK(run.ok_share(3, 24) > 0.99);
  CHECK(run.errors(head).rad < 0.03);
  CHECK(run.errors(head).sigmas < 3);
}

TEST_CASE("with the drive alone the angle is relative and its uncertainty grows") {
  Head head;
  head.has_index = false;
  const Run run(config_for(head), head.wires());
  CHECK(run.ok_share(0.1, 29) > 0.99);
  const Asked& first = run.answers[1];
  const Asked& last = run.answers.back();
  CHECK(last.response.angle_rad - first.response.angle_rad ==
        Approx(head.truth_rad(last.stamp_ns) - head.truth_rad(first.stamp_ns)).margin(2e-4));
  CHECK(last.response.sigma_rad > 10 * first.response.sigma_rad);
}

TEST_CASE("quadrature gives the shape where there is no drive position") {
  Head head;
  head.has_drive = false;
  head.has_quadrature = true;
  head.angle_rad = [](double t_s) { return speed_rad_s * t_s + 0.05 * std::sin(3.0 * t_s); };
  EncoderConfig config = config_for(head);
  config.count_sigma_rad = 0.5 * turn_rad / head.quadrature_counts_per_turn;
  const Run run(config, head.wires());
  CHECK(run.ok_share(3, 29) > 0.99);
  CHECK(run.errors(head).sigmas < 3);
  CHECK(run.errors(head).rad < 1.1 * turn_rad / head.quadrature_counts_per_turn);
  CHECK(run.encoder->counters().quadrature_repeats == 0);
}

TEST_CASE("swapped A and B are told from the drive") {
  Head head;
  head.has_quadrature = true;
  std::vector<Wire> wires = head.wires();
  for (Wire& wire : wires) {
    if (wire.kind == Wire::edge && wire.line.line != index_line)
      wire.line.line = wire.line.line == a_line ? b_line : a_line;
  }
  EncoderConfig config = config_for(head);
  config.shape = AngleShape::quadrature;
  const Run swapped(config, wires);
  CHECK(swapped.encoder->counters().quadrature_against_drive > 5);
  CHECK(swapped.log.has("A and B are swapped"));
  CHECK(swapped.encoder->counters().reversals == 1);

  const Run right(config, head.wires());
  CHECK(right.encoder->counters().quadrature_against_drive == 0);
  CHECK(right.encoder->counters().reversals == 0);
}

TEST_CASE("missing, extra and bouncing pulses are counted and do not move the angle") {
  Head head;
  const std::vector<Wire> clean = head.wires();
  const EncoderConfig config = config_for(head);

  std::vector<Wire> missing = clean;
  const std::array<std::int64_t, 3> gone{pulse_ns(clean, 3), pulse_ns(clean, 4), pulse_ns(clean, 7)};
  std::erase_if(missing, [&](const Wire& wire) {
    return is_index(wire) && std::ranges::count(gone, wire.stamp_ns) > 0;
  });
  const Run without(config, missing);
  CHECK(without.encoder->counters().index_missing == 3);
  CHECK(without.encoder->counters().index_losses == 1);  // two in a row
  CHECK(without.errors(head).rad < 1e-3);
  CHECK(without.errors(head).sigmas < 3);
  CHECK(without.ok_share(3, 29) > 0.99);

  std::vector<Wire> extra = clean;
  for (const int n : {2, 5, 6}) add_pulse(extra, pulse_ns(clean, n) + 700 * ns_per_ms);
  const Run with(config, extra);
  CHECK(with.encoder->counters().index_extra == 3);
  CHECK(with.encoder->counters().index_pulses == 13);
  CHECK(with.errors(head).rad < 1e-3);

  std::vector<Wire> bouncing = clean;
  for (int n = 1; n < 9; ++n) {
    for (int i = 1; i < 4; ++i) add_pulse(bouncing, pulse_ns(clean, n) + i * 3 * ns_per_ms);
  }
  const Run bounced(config, bouncing);
  CHECK(bounced.encoder->counters().index_bounces == 24);
  CHECK(bounced.encoder->counters().index_pulses == 13);
  CHECK(bounced.errors(head).rad < 1e-3);
}

TEST_CASE("missing and extra pulses are told apart without counts, too") {
  Head head;
  head.has_drive = false;
  EncoderConfig config = config_for(head);
  config.maximum_wait_ns = 6 * ns_per_s;
  std::vector<Wire> wires = head.wires();
  const std::int64_t gone_ns = pulse_ns(wires, 3);
  const std::int64_t near_ns = pulse_ns(wires, 6);
  std::erase_if(wires, [&](const Wire& wire) { return is_index(wire) && wire.stamp_ns == gone_ns; });
  add_pulse(wires, near_ns + 900 * ns_per_ms);
  const Run run(config, wires);
  CHECK(run.encoder->counters().index_missing == 1);
  CHECK(run.encoder->counters().index_extra == 1);
  CHECK(run.errors(head).rad < 1e-3);
  CHECK(run.ok_share(3, 22) > 0.99);
}

TEST_CASE("whatever the wires do, an answer's error stays within what its sigma says") {
  std::uint64_t missed = 0;
  std::uint64_t extra = 0;
  std::uint64_t bounced = 0;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    CAPTURE(seed);
    sim::Random random(seed);
    Head head;
    head.seed = seed;
    head.duration_s = 40;
    head.has_drive = seed % 3 != 0;
    head.has_quadrature = !head.has_drive && seed % 2 == 0;
    const double ripple = random.uniform(0, 0.02);
    const double frequency = random.uniform(0.3, 3);
    const double direction = random.chance(0.5) ? 1 : -1;
    head.angle_rad = [=](double t_s) {
      return direction * (speed_rad_s * t_s + ripple / frequency * std::sin(frequency * t_s));
    };
    head.true_counts_per_turn = head.counts_per_turn * random.uniform(0.997, 1.003);
    head.jitter_ns = 5e4;
    EncoderConfig config = config_for(head);
    config.expected_speed_rad_s *= direction;
    config.wait_for_index = head.has_drive && random.chance(0.5);
    config.smoothness.speed_ripple_rad_s = 0.02;
    if (head.has_quadrature) config.count_sigma_rad = 0.5 * turn_rad / head.quadrature_counts_per_turn;
    if (config.wait_for_index || config.shape == AngleShape::none) config.maximum_wait_ns = 4 * ns_per_s;
    std::vector<Wire> wires;
    for (const Wire& wire : head.wires()) {
      if (is_index(wire) && random.chance(0.1)) continue;
      if (wire.kind == Wire::position && random.chance(0.05)) continue;
      wires.push_back(wire);
      if (is_index(wire) && random.chance(0.2)) {
        wires.push_back(wire);
        wires.back().stamp_ns = wires.back().arrives_ns = wire.stamp_ns + random.integer(1, 15) * ns_per_ms;
      }
      if (is_index(wire) && random.chance(0.15)) {
        wires.push_back(wire);
        wires.back().stamp_ns = wires.back().arrives_ns =
            wire.stamp_ns + random.integer(200, 1900) * ns_per_ms;
      }
      if (wire.kind == Wire::position && random.chance(0.02)) wires.push_back(wire);
    }
    std::ranges::stable_sort(wires, {}, &Wire::arrives_ns);
    const Run run(config, wires);
    CHECK(run.errors(head).sigmas < 4);
    CHECK(run.ok_count() > 800);
    missed += run.encoder->counters().index_missing;
    extra += run.encoder->counters().index_extra;
    bounced += run.encoder->counters().index_bounces;
  }
  CHECK(missed > 20);
  CHECK(extra > 20);
  CHECK(bounced > 20);
}

TEST_CASE("a head that turns back is followed and reported") {
  Head head;
  head.angle_rad = [](double t_s) { return t_s < 15 ? speed_rad_s * t_s : speed_rad_s * (30 - t_s); };
  std::vector<Wire> wires = head.wires();
  const Run run(config_for(head), wires);
  CHECK(run.encoder->counters().reversals == 1);
  CHECK(run.encoder->counters().speed_excursions == 1);
  CHECK(run.log.has("against its expected direction"));
  CHECK(run.errors(head, 3, 30).rad < 5e-3);
  CHECK(run.ok_share(3, 29) > 0.98);
}

TEST_CASE("a negative direction of counts and of turning is a matter of configuration") {
  Head head;
  head.angle_rad = [](double t_s) { return 2 - speed_rad_s * t_s; };
  EncoderConfig config = config_for(head);
  config.expected_speed_rad_s = -speed_rad_s;
  const Run run(config, head.wires());
  CHECK(run.errors(head).rad < 1e-4);
  CHECK(run.encoder->counters().reversals == 0);
  CHECK(run.encoder->counters().index_missing == 0);

  Head mirrored;  // the drive counts down while the head's angle grows
  std::vector<Wire> wires = mirrored.wires();
  for (Wire& wire : wires) wire.counts = -wire.counts;
  config = config_for(mirrored);
  config.drive_direction = -1;
  const Run other(config, wires);
  CHECK(other.errors(mirrored).rad < 1e-4);
}

TEST_CASE("a drive that is reset in mid-turn costs the angle until the next index pulse") {
  Head head;
  std::vector<Wire> wires = head.wires();
  const std::int64_t reset_ns = pulse_ns(wires, 5) + ns_per_s;
  std::int32_t offset = 0;
  for (Wire& wire : wires) {
    if (wire.kind != Wire::position || wire.arrives_ns < reset_ns) continue;
    if (offset == 0) offset = wire.counts;
    wire.counts -= offset;
  }
  EncoderConfig config = config_for(head);
  const Run run(config, wires);
  CHECK(run.encoder->counters().position_jumps == 1);
  CHECK(run.log.has("the drive's position jumped"));
  CHECK(run.errors(head).rad < 1e-3);
  const double reset_s = seconds(reset_ns - begin_ns);
  CHECK(run.ok_share(reset_s + 2, 29) > 0.98);

  double before_rad = -1e9;  // and goes on in its direction
  for (const Asked& asked : run.answers) {
    if (asked.response.status != AngleStatus::ok) continue;
    CHECK(asked.response.angle_rad > before_rad);
    before_rad = asked.response.angle_rad;
  }
  CHECK(before_rad == Approx(head.truth_rad(run.answers.back().stamp_ns)).margin(1e-3));

  config.maximum_wait_ns = 3 * ns_per_s;  // who waits longer loses nothing but the jump itself
  const Run patient(config, wires);
  CHECK(patient.errors(head).rad < 1e-3);
  CHECK(patient.ok_share(3, 26) > 0.99);
}

TEST_CASE("slipped counts are believed less than two index pulses that agree") {
  Head head;
  std::vector<Wire> wires = head.wires();
  const std::int64_t slip_ns = pulse_ns(wires, 5) + ns_per_s;
  for (Wire& wire : wires) {  // by 80 mrad, in small steps that no plausibility check can see
    if (wire.kind != Wire::position || wire.arrives_ns < slip_ns) continue;
    const double share = std::min(1.0, seconds(wire.arrives_ns - slip_ns) / 0.5);
    wire.counts += static_cast<std::int32_t>(share * 0.08 / turn_rad * head.counts_per_turn);
  }
  const Run run(config_for(head), wires);
  CHECK(run.encoder->counters().index_relocks == 1);
  const double slip_s = seconds(slip_ns - begin_ns);
  CHECK(run.errors(head, 0, slip_s).rad < 1e-3);
  CHECK(run.errors(head, slip_s + 5, 30).rad < 1e-3);
}

TEST_CASE("wrong counts per turn are named, with what the pulses say") {
  Head head;
  EncoderConfig config = config_for(head);
  config.drive_counts_per_turn = head.counts_per_turn * 0.8;
  const Run run(config, head.wires());
  CHECK(run.log.has("is counts_per_turn right?"));
  for (const Notice& notice : run.log.notices) {
    if (std::string(notice.text).find("counts_per_turn") != std::string::npos) {
      CHECK(static_cast<double>(notice.value) == Approx(head.counts_per_turn).epsilon(1e-3));
    }
  }
}

TEST_CASE("lost edges cost quadrature its angle until the next index pulse") {
  Head head;
  head.has_drive = false;
  head.has_quadrature = true;
  std::vector<Wire> wires = head.wires();
  const std::int64_t lost_ns = pulse_ns(wires, 4) + ns_per_s;
  std::erase_if(wires, [&](const Wire& wire) {
    return wire.kind == Wire::edge && wire.stamp_ns >= lost_ns && wire.stamp_ns < lost_ns + 30 * ns_per_ms;
  });
  Wire lost;
  lost.kind = Wire::lost;
  lost.stamp_ns = lost.arrives_ns = lost_ns + 30 * ns_per_ms;
  lost.lost_count = 12;
  wires.push_back(lost);
  std::ranges::stable_sort(wires, {}, &Wire::arrives_ns);
  EncoderConfig config = config_for(head);
  config.count_sigma_rad = 0.5 * turn_rad / head.quadrature_counts_per_turn;
  config.maximum_wait_ns = 3 * ns_per_s;
  const Run run(config, wires);
  CHECK(run.encoder->counters().edge_losses == 1);
  CHECK(run.encoder->counters().edges_lost == 12);
  CHECK(run.errors(head).rad < 2 * turn_rad / head.quadrature_counts_per_turn);
  CHECK(run.ok_share(3, 26) > 0.98);
}

TEST_CASE("a gap in the kernel's own count of edges is a loss") {
  NoticeLog log;
  Head head;
  Encoder encoder(config_for(head), log);
  encoder.on_edge({index_line, true, 1}, begin_ns);
  encoder.on_edge({index_line, false, 2}, begin_ns + ns_per_ms);
  CHECK(encoder.counters().edge_losses == 0);
  encoder.on_edge({index_line, true, 7}, begin_ns + 2 * ns_per_s);
  CHECK(encoder.counters().edge_losses == 1);
  CHECK(encoder.counters().edges_lost == 4);
  encoder.on_edge({index_line, false, 1}, begin_ns + 3 * ns_per_s);  // the line was requested anew
  CHECK(encoder.counters().edge_losses == 2);
  CHECK(log.has("edges were lost"));
}

TEST_CASE("a drive that falls silent leaves the index pulses to carry the angle on") {
  Head head;
  std::vector<Wire> wires = head.wires();
  const std::int64_t silent_ns = begin_ns + 12 * ns_per_s;
  const std::int64_t again_ns = begin_ns + 22 * ns_per_s;
  std::erase_if(wires, [&](const Wire& wire) {
    return wire.kind == Wire::position && wire.stamp_ns > silent_ns && wire.stamp_ns < again_ns;
  });
  EncoderConfig config = config_for(head);
  config.maximum_wait_ns = 4 * ns_per_s;
  const Run run(config, wires);
  CHECK(run.ok_share(3, 20) > 0.98);
  CHECK(run.ok_share(25, 26) > 0.98);
  CHECK(run.errors(head).sigmas < 4);
  CHECK(run.encoder->counters().position_gaps == 1);
}

TEST_CASE("events that come late, twice or in the wrong order are counted and change nothing") {
  Head head;
  std::vector<Wire> wires = head.wires();
  for (Wire& wire : wires) {
    if (is_index(wire)) wire.arrives_ns += 15 * ns_per_ms;  // after positions that were sampled later
  }
  std::vector<Wire> more = wires;
  for (std::size_t i = 100; i + 200 < wires.size(); i += 50) {
    if (wires[i].kind == Wire::tick) continue;
    more.push_back(wires[i]);
    more.back().arrives_ns += 40 * ns_per_ms;
  }
  std::ranges::stable_sort(more, {}, &Wire::arrives_ns);
  const Run run(config_for(head), more);
  CHECK(run.encoder->counters().positions_duplicated + run.encoder->counters().positions_reordered > 20);
  CHECK(run.errors(head).rad < 1e-3);
  CHECK(run.ok_share(3, 29) > 0.99);
}

TEST_CASE("stamps that cannot be are refused, and a clock that steps back begins a new angle") {
  NoticeLog log;
  Head head;
  Encoder encoder(config_for(head), log);
  encoder.on_tick(begin_ns);
  for (const std::int64_t stamp_ns : {INT64_MIN, std::int64_t{-1}, INT64_MAX, begin_ns + 3600 * ns_per_s}) {
    encoder.on_edge({index_line, true, 0}, stamp_ns);
    encoder.on_drive_position(5, stamp_ns);
    encoder.on_edges_lost(1, stamp_ns);
    CHECK(encoder.angle_at(stamp_ns).status != AngleStatus::ok);
  }
  encoder.on_tick(INT64_MIN);
  encoder.on_tick(INT64_MAX);
  CHECK(encoder.counters().stamps_absurd == 14);
  CHECK(encoder.counters().index_pulses == 0);

  const std::vector<Wire> wires = head.wires();
  const auto play = [&](std::int64_t shift_ns) {
    for (const Wire& wire : wires) {
      if (wire.kind == Wire::edge) encoder.on_edge(wire.line, wire.stamp_ns + shift_ns);
      if (wire.kind == Wire::position) encoder.on_drive_position(wire.counts, wire.stamp_ns + shift_ns);
      if (wire.kind == Wire::tick) encoder.on_tick(wire.stamp_ns + shift_ns);
    }
    const std::int64_t asked_ns = begin_ns + 20 * ns_per_s;
    const AngleAnswer answer = encoder.angle_at(asked_ns + shift_ns);
    REQUIRE(answer.status == AngleStatus::ok);
    CHECK(std::remainder(answer.angle_rad - head.truth_rad(asked_ns), turn_rad) == Approx(0).margin(1e-3));
  };
  play(0);
  play(-40 * ns_per_s);
  CHECK(encoder.counters().clock_steps == 1);
  play(1000 * ns_per_s);  // and forward
}

TEST_CASE("a head that stops and starts again is known all the while") {
  Head head;
  head.angle_rad = [](double t_s) { return speed_rad_s * (t_s < 10 ? t_s : t_s < 20 ? 10 : t_s - 10); };
  SECTION("by the drive") {}
  SECTION("by quadrature") {
    head.has_drive = false;
    head.has_quadrature = true;
  }
  EncoderConfig config = config_for(head);
  if (head.has_quadrature) config.count_sigma_rad = 0.5 * turn_rad / head.quadrature_counts_per_turn;
  const Run run(config, head.wires());
  CHECK(run.ok_share(3, 29) > 0.99);
  CHECK(run.errors(head, 3, 30).rad < 0.012);
  CHECK(run.encoder->counters().speed_excursions == 1);
  CHECK(run.encoder->counters().reversals == 0);
}

TEST_CASE("index pulses that stay away are reported once, and so is their return") {
  Head head;
  std::vector<Wire> wires = head.wires();
  std::erase_if(wires, [&](const Wire& wire) {
    return is_index(wire) && wire.stamp_ns > begin_ns + 8 * ns_per_s &&
           wire.stamp_ns < begin_ns + 22 * ns_per_s;
  });
  const Run run(config_for(head), wires);
  CHECK(run.encoder->counters().index_losses == 1);
  CHECK(run.log.has("stay away"));
  CHECK(run.log.has("are back"));
  CHECK(run.errors(head).sigmas < 3);
}

TEST_CASE("half an hour of turning adds no error") {
  Head head;
  head.duration_s = 1800;
  const Run run(config_for(head), head.wires());
  CHECK(run.errors(head, 5, 1e9).rad < 1e-4);
  CHECK(run.ok_share(5, 1799) > 0.99);
  CHECK(run.encoder->counters().index_missing + run.encoder->counters().index_extra == 0);
  CHECK(run.encoder->counters().history_breaks == 0);
}

TEST_CASE("the profile-sync line is counted and its last pulse kept") {
  NoticeLog log;
  EncoderConfig config = config_for(Head{});
  config.sync_line = 5;
  Encoder encoder(config, log);
  for (int i = 0; i < 10; ++i) {
    encoder.on_edge({5, true, 0}, begin_ns + i * 13 * ns_per_ms);
    encoder.on_edge({5, false, 0}, begin_ns + i * 13 * ns_per_ms + ns_per_ms);
  }
  encoder.on_edge({9, true, 0}, begin_ns + ns_per_s);
  encoder.on_edge({EncoderConfig::no_line, true, 0}, begin_ns + ns_per_s);
  CHECK(encoder.counters().sync_pulses == 10);
  CHECK(encoder.last_sync_stamp_ns() == begin_ns + 9 * 13 * ns_per_ms);
  CHECK(encoder.counters().edges_of_other_lines == 2);
}

TEST_CASE("a pulse's other flank counts when the head turns back") {
  // A mark 0.1 rad wide: the line is high within it, and rises at the far flank when the head comes from
  // there.
  Head head;
  head.has_index = false;
  head.angle_rad = [](double t_s) { return t_s < 15 ? speed_rad_s * t_s - 1 : speed_rad_s * (30 - t_s) - 1; };
  std::vector<Wire> wires = head.wires();
  const auto is_high = [&](std::int64_t t) {
    return head.truth_rad(t) - turn_rad * std::floor(head.truth_rad(t) / turn_rad) < 0.1;
  };
  for (std::int64_t t = begin_ns; t < begin_ns + 29 * ns_per_s; t += 50 * ns_per_us) {
    if (!is_high(t) && is_high(t + 50 * ns_per_us)) add_pulse(wires, t + 25 * ns_per_us);
  }
  EncoderConfig config = config_for(head);
  config.index_line = index_line;
  config.index_width_rad = 0.1;
  const Run run(config, wires);
  CHECK(run.encoder->counters().index_pulses > 10);
  CHECK(run.encoder->counters().index_extra == 0);
  CHECK(run.errors(head, 3, 29).rad < 1e-3);
}

TEST_CASE("the same wires give the same bits") {
  Head head;
  head.jitter_ns = 1e5;
  const std::vector<Wire> wires = head.wires();
  const Run one(config_for(head), wires);
  const Run two(config_for(head), wires);
  REQUIRE(one.answers.size() == two.answers.size());
  for (std::size_t i = 0; i < one.answers.size(); ++i) {
    REQUIRE(one.answers[i].response.angle_rad == two.answers[i].response.angle_rad);
    REQUIRE(one.answers[i].response.sigma_rad == two.answers[i].response.sigma_rad);
  }
}

TEST_CASE("random garbage on every input never gives an answer that is no number") {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    sim::Random random(seed);
    NoticeLog log;
    EncoderConfig config;
    config.a_line = a_line;
    config.b_line = b_line;
    config.sync_line = 3;
    config.drive_counts_per_turn = 1000;
    config.quadrature_counts_per_turn = 100;
    config.shape = seed % 3 == 0   ? AngleShape::drive
                   : seed % 3 == 1 ? AngleShape::quadrature
                                   : AngleShape::none;
    config.wait_for_index = seed % 2 == 0;
    config.maximum_wait_ns = 4 * ns_per_s;
    REQUIRE(validate(config) == nullptr);
    Encoder encoder(config, log);
    std::int64_t now_ns = begin_ns;
    for (int i = 0; i < 20000; ++i) {
      now_ns +=
          random.chance(0.001) ? random.integer(-5000, 5000) * ns_per_ms : random.integer(0, 20) * ns_per_ms;
      const std::int64_t stamp_ns = random.chance(0.01) ? static_cast<std::int64_t>(random.next())
                                                        : now_ns - random.integer(0, 30) * ns_per_ms;
      switch (random.integer(0, 4)) {
        case 0:
          encoder.on_tick(now_ns);
          break;
        case 1:
          encoder.on_drive_position(static_cast<std::int32_t>(random.next()), stamp_ns);
          break;
        case 2:
          encoder.on_edges_lost(static_cast<std::uint32_t>(random.next() & 7), stamp_ns);
          break;
        default:
          encoder.on_edge({static_cast<std::uint8_t>(random.integer(0, 4)), random.chance(0.5),
                           static_cast<std::uint32_t>(random.next() & 3)},
                          stamp_ns);
      }
      const AngleAnswer answer = encoder.angle_at(now_ns - random.integer(0, 5000) * ns_per_ms);
      REQUIRE(std::isfinite(answer.angle_rad));
      REQUIRE(std::isfinite(answer.sigma_rad));
    }
    CHECK(log.notices.size() < 20000);
  }
}

TEST_CASE("an impossible encoder configuration is named") {
  EncoderConfig config = config_for(Head{});
  CHECK(validate(config) == nullptr);
  const auto is_wrong = [](EncoderConfig wrong) { return validate(wrong) != nullptr; };
  const auto with = [&](auto change) {
    EncoderConfig changed = config;
    change(changed);
    return is_wrong(changed);
  };
  CHECK(with([](EncoderConfig& c) { c.drive_counts_per_turn = 0; }));
  CHECK(with([](EncoderConfig& c) { c.a_line = 0; }));
  CHECK(with([](EncoderConfig& c) { c.a_line = 1; }));
  CHECK(with([](EncoderConfig& c) { c.drive_direction = 0; }));
  CHECK(with([](EncoderConfig& c) { c.expected_speed_rad_s = std::nan(""); }));
  CHECK(with([](EncoderConfig& c) { c.debounce_ns = -1; }));
  CHECK(with([](EncoderConfig& c) { c.shape = AngleShape::none; }));  // waits less than a turn
  CHECK(with([](EncoderConfig& c) { c.shape = AngleShape::quadrature; }));
  CHECK(with([](EncoderConfig& c) {
    c.shape = AngleShape::none;
    c.index_line = EncoderConfig::no_line;
  }));
}

TEST_CASE("every counter of the encoder has a name") {
  EncoderCounters counters;
  std::size_t names = 0;
  counters.visit([&](const char* name, std::uint64_t value) {
    ++names;
    CHECK(std::string(name).size() > 3);
    CHECK(value == 0);
  });
  CHECK(names * sizeof(std::uint64_t) == sizeof(counters));
}
