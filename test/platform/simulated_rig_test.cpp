#include "alces_platform/sim/simulated_rig.h"
#include "alces_platform/sim/sensors/put_signal.h"
#include "alces_platform/sim/world/crowd.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

using namespace alces;
using namespace alces::sim;

namespace {

constexpr std::int64_t ms = 1'000'000;
constexpr double deg = std::numbers::pi / 180;

/// A laser without a protocol: every sweep's ranges in centimetres, 75 times a second at 500 kbaud.
class RawLaser final : public SerialDevice {
 public:
  RawLaser(SweepSource& source, std::int64_t start_ns) : source_(source), next_ns_(start_ns) {}
  void on_bytes(std::span<const std::uint8_t> bytes, std::int64_t) override {
    heard.insert(heard.end(), bytes.begin(), bytes.end());
  }
  void on_fault(const Injection& injection) override { faults.push_back(injection.fault); }
  [[nodiscard]] std::uint32_t baud_rate() const override { return 500'000; }
  void poll(std::int64_t now_ns, SerialOutput& output) override {
    const double interval_ns = 1e9 / 75 / 360;
    while (next_ns_ + static_cast<std::int64_t>(180 * interval_ns) <= now_ns) {
      std::vector<float> ranges_m(181);
      source_.sweep(next_ns_, interval_ns, ranges_m);
      std::vector<std::uint8_t> bytes;
      for (const float range : ranges_m) {
        const auto cm = static_cast<unsigned>(std::lround(range * 100));
        bytes.push_back(static_cast<std::uint8_t>(cm & 0xff));
        bytes.push_back(static_cast<std::uint8_t>(cm >> 8));
      }
      output.write(bytes, next_ns_ + static_cast<std::int64_t>(180 * interval_ns), 500'000);
      sweep_count++;
      next_ns_ += 13'333'333;
    }
  }
  std::vector<std::uint8_t> heard;
  std::vector<Fault> faults;
  std::size_t sweep_count = 0;

 private:
  SweepSource& source_;
  std::int64_t next_ns_;
};

/// A node that sends a heartbeat and a PDO every 10 ms, and answers every SDO.
class PlainNode final : public CanNode {
 public:
  [[nodiscard]] std::uint8_t node_id() const override { return 5; }
  void on_frame(const CanFrame& frame, std::int64_t now_ns) override {
    heard.push_back(frame);
    heard_ns.push_back(now_ns);
    if (frame.id == 0x605) ++to_answer_;
  }
  void poll(std::int64_t now_ns, std::vector<CanFrame>& frames) override {
    if (now_ns >= next_ns_) {
      next_ns_ = now_ns + 10 * ms;
      CanFrame frame;
      frame.id = 0x185;
      frame.size = 8;
      frame.data[0] = static_cast<std::uint8_t>(count_++);
      frames.push_back(frame);
      frame.id = 0x705;
      frame.size = 1;
      frame.data[0] = 5;
      frames.push_back(frame);
    }
    for (; to_answer_ > 0; --to_answer_) {
      CanFrame frame;
      frame.id = 0x585;
      frame.size = 8;
      frames.push_back(frame);
    }
  }
  void on_fault(const Injection& injection) override { faults.push_back(injection.fault); }
  std::vector<CanFrame> heard;
  std::vector<std::int64_t> heard_ns;
  std::vector<Fault> faults;

 private:
  std::int64_t next_ns_ = 0;
  int to_answer_ = 0;
  int count_ = 0;
};

struct Heard {
  Event event;
  std::vector<std::uint8_t> bytes;
};

class Recorder final : public EventSink {
 public:
  void on_event(const Event& event) override {
    all.push_back({event, {event.bytes.begin(), event.bytes.end()}});
    all.back().event.bytes = {};
  }
  [[nodiscard]] std::vector<Heard> of(EventKind kind, int channel = -1) const {
    std::vector<Heard> result;
    for (const Heard& heard : all)
      if (heard.event.kind == kind && (channel < 0 || heard.event.channel == channel))
        result.push_back(heard);
    return result;
  }
  [[nodiscard]] std::vector<CanFrame> frames(std::uint32_t id) const {
    std::vector<CanFrame> result;
    for (const Heard& heard : all)
      if (heard.event.kind == EventKind::can_frame && !heard.event.frame.is_error &&
          heard.event.frame.id == id)
        result.push_back(heard.event.frame);
    return result;
  }
  [[nodiscard]] std::string text(std::uint8_t channel) const {
    std::string result;
    for (const Heard& heard : all)
      if (heard.event.kind == EventKind::bytes && heard.event.channel == channel)
        result.append(heard.bytes.begin(), heard.bytes.end());
    return result;
  }
  std::vector<Heard> all;
};

bool same(const Recorder& a, const Recorder& b) {
  return a.all.size() == b.all.size() && std::ranges::equal(a.all, b.all, [](const Heard& x, const Heard& y) {
           return x.event.stamp_ns == y.event.stamp_ns && x.event.kind == y.event.kind &&
                  x.event.channel == y.event.channel && x.event.is_up == y.event.is_up &&
                  x.event.lost_count == y.event.lost_count && x.event.edge == y.event.edge &&
                  x.event.frame == y.event.frame && x.bytes == y.bytes;
         });
}

RigSettings short_drive(std::uint64_t seed = 1) {
  RigSettings settings;
  settings.seed = seed;
  settings.motion.scans = 40;
  settings.motion.standstill_s = 2;
  settings.serial.first_baud_rate = 500'000;
  return settings;
}

std::shared_ptr<const Town> town(std::uint64_t seed = 1) {
  static std::map<std::uint64_t, std::shared_ptr<const Town>> towns;
  auto& one = towns[seed];
  if (!one) {
    MotionSettings motion = short_drive().motion;
    motion.seed = seed;
    one = std::make_shared<const Town>(sim::make_tour(motion).layout);
  }
  return one;
}

/// A rig with two raw lasers and a plain node, run for a while.
struct Run {
  explicit Run(const RigSettings& settings, double seconds = 0)
      : rig(settings, town(settings.seed)),
        start_ns(settings.motion.start_stamp_ns),
        laser_a(rig.sweeps(0), start_ns),
        laser_b(rig.sweeps(1), start_ns + 4'000'000) {
    rig.attach(laser_a_channel, laser_a);
    rig.attach(laser_b_channel, laser_b);
    rig.attach(node);
    if (seconds > 0) go(seconds);
  }
  void go(double until_s) { rig.advance_to(start_ns + static_cast<std::int64_t>(until_s * 1e9), recorder); }
  [[nodiscard]] std::int64_t at(double time_s) const {
    return start_ns + static_cast<std::int64_t>(time_s * 1e9);
  }
  void inject(Fault fault, double at_s, double duration_s = 0, std::int64_t argument = 0) {
    rig.inject({fault, at(at_s), static_cast<std::int64_t>(duration_s * 1e9), argument});
  }
  SimulatedRig rig;
  std::int64_t start_ns;
  RawLaser laser_a, laser_b;
  PlainNode node;
  Recorder recorder;
};

std::int16_t intel(const CanFrame& frame, std::size_t byte) {
  return static_cast<std::int16_t>(frame.data[byte] | frame.data[byte + 1] << 8);
}
std::int16_t motorola(const CanFrame& frame, std::size_t byte) {
  return static_cast<std::int16_t>(frame.data[byte] << 8 | frame.data[byte + 1]);
}

}  // namespace

TEST_CASE("the same settings give the same events: however they are asked for, on one core or many") {
  RigSettings settings = short_drive();
  settings.encoder.quadrature_lines = 64;
  const Run one(settings, 8);
  REQUIRE(one.recorder.all.size() > 8'000);

  Run in_pieces(settings);
  for (double time_s = 0; time_s < 8; time_s += 0.0137) in_pieces.go(time_s);
  in_pieces.go(8);
  CHECK(same(one.recorder, in_pieces.recorder));

  settings.is_parallel = false;
  CHECK(same(one.recorder, Run(settings, 8).recorder));
  CHECK_FALSE(same(one.recorder, Run(short_drive(2), 8).recorder));
  CHECK(one.rig.sweep_counters(0).guessed > one.rig.sweep_counters(0).sweeps * 3 / 4);
}

TEST_CASE("events come in the order in which the host hears of them, none from the future") {
  struct Order final : EventSink {
    void on_event(const Event& event) override {
      REQUIRE(rig->now_ns() >= last_ns);
      REQUIRE(event.stamp_ns <= rig->now_ns());
      REQUIRE(rig->now_ns() - event.stamp_ns < 25 * ms);
      last_ns = rig->now_ns();
      std::int64_t& last_tick = ticks;
      if (event.kind == EventKind::tick) {
        REQUIRE(event.stamp_ns - last_tick == 10 * ms);
        last_tick = event.stamp_ns;
      }
    }
    const SimulatedRig* rig = nullptr;
    std::int64_t last_ns = 0;
    std::int64_t ticks = 0;
  };
  Run run(short_drive());
  Order order;
  order.rig = &run.rig;
  order.ticks = run.start_ns;
  run.rig.advance_to(run.at(5), order);
  CHECK(order.ticks == run.at(5));
}

TEST_CASE("odometry without errors, integrated, is the motion") {
  RigSettings settings = short_drive();
  settings.odometry = settings.odometry.without_errors();
  settings.odometry.signals[0].signal.factor = settings.odometry.signals[1].signal.factor = 0.0001;
  settings.odometry.signals[3].signal.factor = 0.00002;
  Run run(settings, 30);
  double x = 0, y = 0, yaw = 0, way = 0;
  const Pose start = run.rig.town_from_body(run.start_ns);
  std::int64_t last_wheels_ns = 0, last_gyro_ns = 0, last_ns = 0;
  double rate = 0;
  for (const Heard& heard : run.recorder.all) {
    if (heard.event.kind != EventKind::can_frame) continue;
    const CanFrame& frame = heard.event.frame;
    if (frame.id == 0x111) {
      rate = motorola(frame, 0) * 0.00002;
      if (last_gyro_ns != 0) yaw += rate * 1e-9 * static_cast<double>(heard.event.stamp_ns - last_gyro_ns);
      last_gyro_ns = heard.event.stamp_ns;
    } else if (frame.id == 0x110) {
      const double speed = 0.5 * 0.0001 * (intel(frame, 0) + intel(frame, 2));
      if (last_wheels_ns != 0) {
        const double step_s = 1e-9 * static_cast<double>(heard.event.stamp_ns - last_wheels_ns);
        const double middle = yaw - 0.5 * step_s * rate;
        x += speed * step_s * std::cos(middle);
        y += speed * step_s * std::sin(middle);
        way += speed * step_s;
      }
      last_wheels_ns = last_ns = heard.event.stamp_ns;
    }
  }
  const Pose moved = start.inverse() * run.rig.town_from_body(last_ns);
  CHECK(way == Approx(run.rig.motion().way_m(last_ns)).epsilon(0.01));  // slopes are longer than the plan
  REQUIRE(way > 20);
  const Eigen::Vector3d ahead = moved.rotation * Eigen::Vector3d::UnitX();
  CHECK(std::abs(std::remainder(yaw - std::atan2(ahead.y(), ahead.x()), 2 * std::numbers::pi)) < 0.02);
  CHECK(std::hypot(x - moved.translation_m.x(), y - moved.translation_m.y()) <
        0.25);  // slopes are not planar
}

TEST_CASE("odometry as it comes is wrong by what its settings say") {
  Run run(short_drive(), 40);
  const auto wheels = run.recorder.frames(0x110);
  const auto gyro = run.recorder.frames(0x111);
  CHECK(wheels.size() == Approx(2000).margin(2));
  CHECK(gyro.size() == Approx(4000).margin(2));
  for (std::size_t i = 1; i < wheels.size(); ++i)  // the counter in byte 4 goes on
    REQUIRE(static_cast<std::uint8_t>(wheels[i].data[4] - wheels[i - 1].data[4]) == 1);
  double way = 0;
  for (const CanFrame& frame : wheels) way += 0.5e-3 * (intel(frame, 0) + intel(frame, 2)) * 0.02;
  const double share = way / run.rig.motion().way_m(run.at(40)) - 1;
  CHECK(std::abs(share) > 0.002);
  CHECK(std::abs(share) < 0.05);
  // At standstill the wheels say nothing, the gyro its bias and noise.
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < 170; ++i) {
    if (i < 85) REQUIRE(intel(wheels[i], 0) == 0);
    const double rate = motorola(gyro[i], 0) * 1e-4;
    sum += rate;
    squares += rate * rate;
  }
  const double bias = sum / 170, deviation = std::sqrt(squares / 170 - bias * bias);
  CHECK(std::abs(bias) < 1.1 * deg);
  CHECK(deviation == Approx(0.2 * deg).epsilon(0.25));  // 0.02 deg/s/sqrt(Hz) at 100 Hz
}

TEST_CASE("the encoder's edges come where the head passes their angles") {
  RigSettings settings = short_drive();
  settings.encoder.quadrature_lines = 256;
  settings.encoder.latency_us = 2;
  Run run(settings);
  std::map<int, std::uint32_t> counts;
  int a_level = -1;
  for (double time_s = 0.1; time_s < 12; time_s += 0.1) {
    run.recorder.all.clear();
    run.go(time_s);
    for (const Heard& heard : run.recorder.of(EventKind::edge)) {
      const GpioEdge& edge = heard.event.edge;
      REQUIRE(edge.sequence == ++counts[edge.line]);
      const double angle = run.rig.head_angle_rad(heard.event.stamp_ns);
      const double turns = angle / (2 * std::numbers::pi);
      const double late = 2.7 * 300e-6 + 1e-5;  // rad; 0.1 % of the stamps are later than usual
      if (edge.line == 0) {
        const double expected =
            settings.geometry.index_angle_rad + (edge.is_rising ? 0 : settings.encoder.index_width_rad);
        REQUIRE(std::abs(std::remainder(angle - expected, 2 * std::numbers::pi)) < late);
      } else {
        const double phase = edge.line == 1 ? 0 : 0.25;
        const double expected = phase + (edge.is_rising ? 0 : 0.5);
        REQUIRE(std::abs(std::remainder(turns * 256 - expected, 1.0)) < late * 256 / 6.28);
        if (edge.line == 1) {
          REQUIRE(static_cast<int>(edge.is_rising) != a_level);
          a_level = edge.is_rising ? 1 : 0;
        } else {
          REQUIRE(edge.is_rising == (a_level == 1));  // forwards: B rises while A is high
        }
      }
    }
  }
  const double turned = run.rig.head_angle_rad(run.rig.now_ns()) - 1;
  CHECK(turned > 27);
  CHECK(counts[1] == Approx(turned / 6.2832 * 512).margin(3));
  CHECK(counts[0] >= 8);
}

TEST_CASE("turning the other way, the index rises at its other flank and B leads") {
  HeadEncoderSettings settings;
  settings.quadrature_lines = 4;
  settings.latency_us = 0;
  HeadEncoder encoder(settings, 0.4, 1);
  const FaultPlan no_faults;
  std::vector<HeadEncoder::Output> edges;
  for (int step = 0; step <= 1000; ++step)
    encoder.step(step * ms, 0.5 - 0.001 * step, no_faults, edges);  // from 0.5 to -0.5 rad
  std::vector<HeadEncoder::Output> index;
  for (const auto& output : edges)
    if (output.edge.line == 0) index.push_back(output);
  REQUIRE(index.size() == 2);
  CHECK(index[0].edge.is_rising);
  CHECK(static_cast<double>(index[0].stamp_ns) == Approx((0.5 - 0.435) * 1e9).margin(1e4));
  CHECK_FALSE(index[1].edge.is_rising);
  CHECK(static_cast<double>(index[1].stamp_ns) == Approx(0.1e9).margin(1e4));
}

TEST_CASE("ranges are where the geometry has them") {
  RigSettings settings = short_drive();
  settings.range_errors = {};
  settings.range_errors.noise_m = 0;
  settings.range_errors.quantum_m = 0;
  settings.range_errors.mixed_share = 0;
  Run run(settings);
  run.go(12);  // moving
  const std::int64_t stamp = run.at(11.95);
  const double interval_ns = 1e9 / 75 / 360;
  for (const std::uint8_t laser : {std::uint8_t{0}, std::uint8_t{1}}) {
    std::vector<float> ranges_m(181);
    run.rig.sweeps(laser).sweep(stamp, interval_ns, ranges_m);
    int deck = 0, seen = 0;
    for (std::size_t ray = 0; ray < 181; ++ray) {
      const double angle = (static_cast<double>(ray) - 90) * deg;
      const Eigen::Vector3d direction(std::cos(angle), std::sin(angle), 0);
      const std::int64_t ray_ns = stamp + std::llround(interval_ns * static_cast<double>(ray));
      const Pose body_from_laser = settings.geometry.body_from_laser(laser, run.rig.head_angle_rad(ray_ns));
      if (ray == 0) {
        CHECK((body_from_laser.rotation * direction).z() == Approx(-1));  // ray 0 looks down
      }
      if (ranges_m[ray] == 0) continue;
      ++seen;
      const Eigen::Vector3d in_body = body_from_laser * (static_cast<double>(ranges_m[ray]) * direction);
      if (static_cast<double>(ranges_m[ray]) < settings.geometry.own_vehicle_range_m()) {
        CHECK(in_body.z() == Approx(settings.geometry.deck_height_m).margin(1e-3));
        ++deck;
        continue;
      }
      // A ray cast at its own exact time and pose meets the same thing.
      const Pose town_from_laser = run.rig.town_from_body(ray_ns) * body_from_laser;
      const Hit hit = run.rig.town().scene().cast(town_from_laser.translation_m.cast<float>(),
                                                  (town_from_laser.rotation * direction).cast<float>(), 40);
      if (hit.surface == Surface::wall || hit.surface == Surface::ground)
        CHECK(static_cast<double>(hit.range_m) == Approx(static_cast<double>(ranges_m[ray])).margin(0.02));
    }
    CHECK(seen > 60);
    CHECK(deck > 20);
    CHECK(deck < 45);
  }
}

TEST_CASE(
    "with sixteen rings sixteen rays of a sweep measure, two degrees apart, what they measured before") {
  RigSettings settings = short_drive();
  settings.range_errors = {.noise_m = 0, .quantum_m = 0, .mixed_share = 0};
  Run all(settings, 12);
  settings.rings.count = 16;
  Run rings(settings, 12);
  const double interval_ns = 1e9 / 75 / 360;
  std::vector<float> all_m(181), rings_m(181);
  all.rig.sweeps(0).sweep(all.at(11.95), interval_ns, all_m);
  rings.rig.sweeps(0).sweep(rings.at(11.95), interval_ns, rings_m);
  std::size_t seen = 0;
  for (std::size_t ray = 0; ray < 181; ++ray) {
    CAPTURE(ray);
    const bool is_ring = ray >= 75 && ray <= 105 && ray % 2 == 1;  // -15, -13, ... 15 deg
    if (!is_ring) CHECK(rings_m[ray] == 0);
    // Glass is a matter of luck, which other rays have drawn from.
    if (is_ring && all_m[ray] > 0 && rings_m[ray] > 0) {
      CHECK(rings_m[ray] == Approx(all_m[ray]).margin(4.1));
      seen += std::abs(rings_m[ray] - all_m[ray]) < 1e-3F ? 1U : 0U;
    }
  }
  CHECK(seen > 8);
}

TEST_CASE("in snow a tenth of the rays measure a flake before what they would have measured") {
  RigSettings settings = short_drive();
  settings.range_errors = {
      .noise_m = 0, .quantum_m = 0, .window_share = 0, .mixed_share = 0, .dropout_share = 0};
  Run clear(settings, 8);
  settings.range_errors.snow_share = 0.1;
  Run snow(settings, 8);
  const double interval_ns = 1e9 / 75 / 360;
  std::size_t rays = 0, flakes = 0, near_behind = 0;
  for (int sweep = 0; sweep < 40; ++sweep) {
    std::vector<float> clear_m(181), snow_m(181);
    clear.rig.sweeps(0).sweep(clear.at(7 + 0.02 * sweep), interval_ns, clear_m);
    snow.rig.sweeps(0).sweep(snow.at(7 + 0.02 * sweep), interval_ns, snow_m);
    for (std::size_t ray = 90; ray < 181; ++ray) {  // those that look up: over the ground, into the sky
      ++rays;
      const bool is_flake =
          snow_m[ray] >= 1 && snow_m[ray] <= 6 && (clear_m[ray] == 0 || clear_m[ray] > snow_m[ray] + 0.01F);
      flakes += is_flake ? 1U : 0U;
      if (snow_m[ray] > 6 && snow_m[ray] < clear_m[ray] - 5) ++near_behind;
    }
  }
  CHECK(static_cast<double>(flakes) / static_cast<double>(rays) == Approx(0.1).margin(0.03));
  CHECK(near_behind == 0);
}

TEST_CASE("a crowd keeps around the vehicle, walks, and hides what is behind it") {
  RigSettings settings = short_drive();
  settings.crowd.people = 30;
  const auto place = town();
  const VehicleMotion motion(settings.motion, sim::make_tour(settings.motion), *place);
  const Crowd crowd(settings.crowd, 1, motion, *place);
  double slowest_m_per_s = 10, fastest_m_per_s = 0;
  for (std::int64_t stamp_ns = 110'000 * ms; stamp_ns < 130'000 * ms; stamp_ns += 500 * ms) {
    const std::vector<Pole> here = crowd.at(stamp_ns);
    const std::vector<Pole> next = crowd.at(stamp_ns + 500 * ms);
    REQUIRE(here.size() == 30);
    const Eigen::Vector2d vehicle_m = motion.town_from_body(stamp_ns).translation_m.head<2>();
    double mean_m_per_s = 0;
    for (std::size_t i = 0; i < here.size(); ++i) {
      const double range_m = (here[i].foot.head<2>().cast<double>() - vehicle_m).norm();
      CHECK(range_m >= 1.49);
      CHECK(range_m <= 8.01);
      mean_m_per_s += static_cast<double>((next[i].foot - here[i].foot).norm()) / 0.5 / 30;
    }
    slowest_m_per_s = std::min(slowest_m_per_s, mean_m_per_s);
    fastest_m_per_s = std::max(fastest_m_per_s, mean_m_per_s);
  }
  CHECK(slowest_m_per_s > 0.5);
  CHECK(fastest_m_per_s < 3);

  // A ray at somebody's middle ends on him, or on who stands before him.
  settings.range_errors = {.noise_m = 0, .quantum_m = 0, .mixed_share = 0};
  const SweepCaster caster(place->scene(), &crowd, settings.range_errors, settings.geometry, {});
  const std::int64_t stamp_ns = 120'000 * ms;
  const Pose town_from_body = motion.town_from_body(stamp_ns);
  for (const Pole& person : crowd.at(stamp_ns)) {
    const Eigen::Vector3d at_m =
        town_from_body.inverse() * (person.foot.cast<double>() + Eigen::Vector3d(0, 0, 1));
    SweepRequest request;
    request.body_from_laser = settings.geometry.body_from_laser(0, std::atan2(at_m.y(), at_m.x()));
    request.town_from_laser_begin = request.town_from_laser_end = town_from_body * request.body_from_laser;
    request.field_of_view_rad = std::numbers::pi;
    request.middle_stamp_ns = stamp_ns;
    std::vector<float> ranges_m(181);
    request.ranges_m = ranges_m;
    caster.cast(request);
    CHECK(ranges_m[90] > 0.9F);
    CHECK(static_cast<double>(ranges_m[90]) < at_m.head<2>().norm());
  }
}

TEST_CASE("a batch of sweeps is the same in parallel as one after the other") {
  const RigSettings settings = short_drive();
  const auto place = town();
  const Tour tour = sim::make_tour(settings.motion);
  const VehicleMotion motion(settings.motion, tour, *place);
  const SweepCaster caster(place->scene(), nullptr, settings.range_errors, settings.geometry, {});
  std::vector<std::vector<float>> one(60, std::vector<float>(181)), other = one;
  std::vector<SweepRequest> requests;
  for (std::size_t i = 0; i < one.size(); ++i) {
    SweepRequest request;
    request.body_from_laser = settings.geometry.body_from_laser(0, 0.1 * static_cast<double>(i));
    request.town_from_laser_begin =
        motion.town_from_body(static_cast<std::int64_t>(110 + i) * 1000 * ms) * request.body_from_laser;
    request.town_from_laser_end = request.town_from_laser_begin;
    request.field_of_view_rad = std::numbers::pi;
    request.seed = i;
    request.ranges_m = one[i];
    requests.push_back(request);
  }
  caster.cast(requests, true);
  for (std::size_t i = 0; i < one.size(); ++i) requests[i].ranges_m = other[i];
  caster.cast(requests, false);
  CHECK(one == other);
}

TEST_CASE("a guessed sweep is the sweep that would have been cast without guessing, to the millimetre") {
  RigSettings settings = short_drive();
  Run ahead(settings);
  settings.sweeps_cast_ahead = 1;
  Run exact(settings);
  ahead.go(6);
  exact.go(6);
  CHECK(ahead.rig.sweep_counters(0).guessed > 300);
  CHECK(exact.rig.sweep_counters(0).guessed == 0);
  const std::string one = ahead.recorder.text(laser_a_channel), other = exact.recorder.text(laser_a_channel);
  REQUIRE(one.size() == other.size());
  std::size_t different = 0;
  for (std::size_t i = 0; i < one.size(); ++i) different += one[i] != other[i] ? 1U : 0U;
  CHECK(static_cast<double>(different) < 0.02 * static_cast<double>(one.size()));
}

TEST_CASE("a laser's bytes come in bundles at the line's rate, whole and in order") {
  Run run(short_drive(), 3);
  const auto bundles = run.recorder.of(EventKind::bytes, laser_a_channel);
  const std::string all = run.recorder.text(laser_a_channel);
  CHECK(all.size() == Approx(362.0 * 225).margin(800));
  std::int64_t last_ns = 0;
  for (const Heard& bundle : bundles) {
    REQUIRE(bundle.bytes.size() <= 192);
    REQUIRE(bundle.event.stamp_ns >= last_ns);
    last_ns = bundle.event.stamp_ns;
  }
  CHECK(bundles.size() > all.size() / 192);
  // A sweep ends 6.67 ms after its first ray; its 362 bytes take 7.24 ms.
  std::size_t bytes = 0;
  for (const Heard& bundle : bundles) {
    bytes += bundle.bytes.size();
    if (bytes >= 362) {
      CHECK(bundle.event.stamp_ns > run.start_ns + 13'900'000);
      CHECK(bundle.event.stamp_ns < run.start_ns + 17'000'000);
      break;
    }
  }
}

TEST_CASE("every NMEA sentence has its checksum, and positions are near the truth") {
  RigSettings settings = short_drive();
  Run run(settings, 45);
  const std::string text = run.recorder.text(gps_channel);
  std::size_t sentences = 0, fixes = 0;
  double worst_m = 0;
  const GpsReceiver::Geodetic origin{settings.gps.latitude_deg, settings.gps.longitude_deg, 0};
  for (std::size_t begin = text.find('$'); begin != std::string::npos; begin = text.find('$', begin + 1)) {
    const std::size_t star = text.find('*', begin);
    if (star == std::string::npos || star + 4 >= text.size()) break;
    unsigned checksum = 0;
    for (std::size_t i = begin + 1; i < star; ++i) checksum ^= static_cast<unsigned char>(text[i]);
    REQUIRE(std::stoul(text.substr(star + 1, 2), nullptr, 16) == checksum);
    REQUIRE(text.substr(star + 3, 2) == "\r\n");
    REQUIRE(star + 5 - begin <= 82);  // NMEA 0183's longest sentence
    ++sentences;
    std::vector<std::string> fields{""};
    for (std::size_t i = begin; i < star; ++i) {
      if (text[i] == ',')
        fields.emplace_back();
      else
        fields.back() += text[i];
    }
    if (fields[0] != "$GPGGA") {
      REQUIRE(fields[0] == "$GPRMC");
      REQUIRE(fields.size() == 13);
      continue;
    }
    REQUIRE(fields.size() == 15);
    if (fields[6] != "1") continue;
    ++fixes;
    const double latitude = std::stod(fields[2].substr(0, 2)) + std::stod(fields[2].substr(2)) / 60;
    const double longitude = std::stod(fields[4].substr(0, 3)) + std::stod(fields[4].substr(3)) / 60;
    const double second = std::stod(fields[1].substr(2, 2)) * 60 + std::stod(fields[1].substr(4));
    const Eigen::Vector3d true_m =
        run.rig.town_from_body(run.at(second + 1.0 / 3)) * settings.geometry.body_from_antenna_m;
    const double north_m = (latitude - origin.latitude_deg) * deg * 6.376e6;
    const double east_m = (longitude - origin.longitude_deg) * deg * 6.392e6 * std::cos(52.38 * deg);
    worst_m = std::max(worst_m, std::hypot(north_m - true_m.y(), east_m - true_m.x()));
  }
  CHECK(sentences >= 88);
  CHECK(fixes > 5);
  CHECK(worst_m > 0.3);
  CHECK(worst_m < 20);
}

TEST_CASE("GPS is lost between houses, and not everywhere") {
  RigSettings settings;
  settings.lasers = 0;
  SimulatedRig rig(settings);
  Recorder recorder;
  rig.advance_to(rig.motion().roll_stamp_ns() + 600'000 * ms, recorder);
  const std::string text = recorder.text(gps_channel);
  std::size_t with = 0, without = 0;
  for (std::size_t at = text.find("$GPRMC"); at != std::string::npos && at + 18 < text.size();
       at = text.find("$GPRMC", at + 1))
    ++(text[at + 17] == 'A' ? with : without);
  CHECK(with + without > 590);
  CHECK(with > 300);
  CHECK(without > 60);
}

TEST_CASE("frames of the host reach the node, and come back as sent, the answer takes its time") {
  Run run(short_drive());
  run.go(0.1);
  CanFrame request;
  request.id = 0x605;
  request.size = 8;
  REQUIRE(run.rig.can_port().send(request));
  run.recorder.all.clear();
  run.go(0.2);
  REQUIRE(run.recorder.of(EventKind::can_sent).size() == 1);
  CHECK(run.recorder.of(EventKind::can_sent)[0].event.frame == request);
  CHECK(run.recorder.frames(0x585).size() == 1);
  CHECK(std::ranges::count(run.node.heard, request) == 1);
  CHECK(run.node.heard_ns.front() > run.start_ns);
}

TEST_CASE("a full queue and a bus-off controller refuse frames") {
  RigSettings settings = short_drive();
  settings.can.host_queue_frames = 4;
  Run run(settings);
  CanFrame frame;
  frame.size = 8;
  CHECK_FALSE(run.rig.can_port().send(frame));  // the link is not up before the first step
  run.inject(Fault::bus_off, 1, 0.5);
  run.go(0.5);
  for (int i = 0; i < 4; ++i) CHECK(run.rig.can_port().send(frame));
  CHECK_FALSE(run.rig.can_port().send(frame));
  run.go(1.2);
  CHECK_FALSE(run.rig.can_port().send(frame));
  run.go(1.6);
  CHECK(run.rig.can_port().send(frame));
  CHECK(run.rig.can_counters().refused == 3);
  const auto links = run.recorder.of(EventKind::can_link);
  REQUIRE(links.size() == 3);  // up at the start, down, up
  CHECK_FALSE(links[1].event.is_up);
  CHECK(links[2].event.is_up);
  for (const Heard& heard : run.recorder.of(EventKind::can_frame)) {
    if (heard.event.frame.is_error) continue;
    CHECK((heard.event.stamp_ns < run.at(1.001) || heard.event.stamp_ns > run.at(1.499)));
  }
}

TEST_CASE("faults on the CAN bus are what they are called") {
  Run run(short_drive());
  const auto pdos = [&] { return run.recorder.frames(0x185).size(); };
  SECTION("node absent") {
    run.inject(Fault::node_absent, 1, 1);
    run.go(0.999);
    const std::size_t before = pdos();
    run.go(2);
    CHECK(pdos() <= before + 1);
    run.go(3);
    CHECK(pdos() > before + 90);
  }
  SECTION("PDOs lost, half of them") {
    run.inject(Fault::pdo_lost, 0, 10, 500);
    run.go(10);
    CHECK(pdos() > 400);
    CHECK(pdos() < 600);
  }
  SECTION("PDOs twice") {
    run.inject(Fault::pdo_duplicated, 0, 2);
    run.go(2);
    CHECK(pdos() == Approx(400).margin(4));
  }
  SECTION("PDOs late") {
    run.inject(Fault::pdo_delayed, 1, 1, 35'000);
    run.go(3);
    bool is_overtaken = false;
    std::uint8_t last = 0;
    for (const CanFrame& frame : run.recorder.frames(0x185)) {
      if (static_cast<std::uint8_t>(frame.data[0] - last) > 128) is_overtaken = true;
      last = frame.data[0];
    }
    CHECK(is_overtaken);
    CHECK(pdos() == Approx(300).margin(2));
  }
  SECTION("PDOs out of order") {
    run.inject(Fault::pdo_reordered, 1, 1);
    run.go(3);
    int backwards = 0;
    std::uint8_t last = 0;
    for (const CanFrame& frame : run.recorder.frames(0x185)) {
      if (static_cast<std::uint8_t>(frame.data[0] - last) > 128) ++backwards;
      last = frame.data[0];
    }
    CHECK(backwards == Approx(50).margin(2));
    CHECK(pdos() == Approx(300).margin(2));
  }
  SECTION("heartbeats and SDO answers do not come through") {
    run.inject(Fault::heartbeat_lost, 1, 1);
    run.inject(Fault::sdo_silence, 0, 1e6);
    run.go(0.5);
    CanFrame request;
    request.id = 0x605;
    request.size = 8;
    REQUIRE(run.rig.can_port().send(request));
    run.go(3);
    CHECK(run.recorder.frames(0x585).empty());
    CHECK(run.recorder.frames(0x705).size() == Approx(200).margin(2));
    CHECK(pdos() == Approx(300).margin(2));
  }
  SECTION("an emergency message") {
    run.inject(Fault::emergency, 1, 0, 0x4210);
    run.go(2);
    const auto emergencies = run.recorder.frames(0x085);
    REQUIRE(emergencies.size() == 1);
    CHECK(emergencies[0].data[0] == 0x10);
    CHECK(emergencies[0].data[1] == 0x42);
  }
  SECTION("error frames flood the host, data still comes through") {
    run.inject(Fault::error_passive_flood, 1, 1);
    run.go(2.5);
    std::size_t errors = 0;
    for (const Heard& heard : run.recorder.of(EventKind::can_frame))
      errors += heard.event.frame.is_error ? 1U : 0U;
    CHECK(errors == Approx(1000).margin(3));
    CHECK(pdos() == Approx(250).margin(3));
  }
  SECTION("other nodes' traffic loads the bus by 90 percent") {
    run.go(1);
    const std::uint64_t before_us = run.rig.can_counters().busy_us;
    run.inject(Fault::bus_load, 1, 4);
    run.go(5);
    const double share = static_cast<double>(run.rig.can_counters().busy_us - before_us) * 1e-6 / 4;
    CHECK(share > 0.85);
    CHECK(share < 1.0);
    CHECK(pdos() > 480);
  }
  SECTION("what happens inside the drive is handed to it") {
    run.inject(Fault::node_reset, 1);
    run.inject(Fault::sdo_abort, 1, 1);
    run.inject(Fault::drive_fault_once, 1.5);
    run.go(2);
    CHECK(run.node.faults ==
          std::vector<Fault>{Fault::node_reset, Fault::sdo_abort, Fault::drive_fault_once});
  }
}

TEST_CASE("faults on the GPIO lines are what they are called") {
  RigSettings settings = short_drive();
  settings.encoder.quadrature_lines = 32;
  Run run(settings);
  const auto index_edges = [&] {
    std::size_t count = 0;
    for (const Heard& heard : run.recorder.of(EventKind::edge)) count += heard.event.edge.line == 0 ? 1U : 0U;
    return count;
  };
  SECTION("none: one pulse a turn") {
    run.go(12.5);  // five turns, less the ramp
    CHECK(index_edges() == Approx(10).margin(1));
  }
  SECTION("missing") {
    run.inject(Fault::index_missing, 0, 100);
    run.go(12.5);
    CHECK(index_edges() == 0);
  }
  SECTION("extra") {
    run.inject(Fault::index_extra, 0, 100, 1000);
    run.go(12.5);
    CHECK(index_edges() == Approx(10 + 26).margin(2));
  }
  SECTION("bouncing") {
    run.inject(Fault::index_bouncing, 0, 100);
    run.go(12.5);
    CHECK(index_edges() >= 30);
    bool is_rising = false;
    for (const Heard& heard : run.recorder.of(EventKind::edge)) {
      if (heard.event.edge.line != 0) continue;
      CHECK(heard.event.edge.is_rising != is_rising);
      is_rising = heard.event.edge.is_rising;
    }
  }
  SECTION("A and B swapped") {
    run.inject(Fault::ab_swapped, 0, 100);
    run.go(4);
    int a_level = -1, wrong = 0, right = 0;
    for (const Heard& heard : run.recorder.of(EventKind::edge)) {
      const GpioEdge& edge = heard.event.edge;
      if (edge.line == 1) a_level = edge.is_rising ? 1 : 0;
      if (edge.line == 2 && a_level >= 0) ++(edge.is_rising == (a_level == 1) ? right : wrong);
    }
    CHECK(right == 0);
    CHECK(wrong > 20);
  }
  SECTION("the kernel's buffer is full") {
    run.inject(Fault::edges_lost, 2, 1);
    run.go(4);
    const auto lost = run.recorder.of(EventKind::edges_lost);
    REQUIRE(lost.size() >= 1);
    std::uint64_t count = 0;
    for (const Heard& heard : lost) count += heard.event.lost_count;
    CHECK(count == run.rig.counters().edges_lost);
    CHECK(count > 40);
  }
}

TEST_CASE("faults on the lasers' lines are what they are called") {
  Run run(short_drive());
  SECTION("unplugged and back") {
    run.inject(Fault::laser_unplugged, 1, 1);
    run.go(1.5);
    const std::array<std::uint8_t, 1> byte{1};
    CHECK_FALSE(run.rig.byte_port(0).write(byte));
    CHECK(run.rig.byte_port(1).write(byte));
    run.go(3);
    const auto links = run.recorder.of(EventKind::byte_link, laser_a_channel);
    REQUIRE(links.size() == 3);
    CHECK_FALSE(links[1].event.is_up);
    CHECK(links[2].event.is_up);
    for (const Heard& heard : run.recorder.of(EventKind::bytes, laser_a_channel))
      CHECK((heard.event.stamp_ns < run.at(1.004) || heard.event.stamp_ns > run.at(2)));
  }
  SECTION("half a telegram is lost") {
    run.inject(Fault::laser_half_telegram, 1);
    run.go(3);
    CHECK(run.rig.line_counters(0).bytes_lost == 366);
  }
  SECTION("garbage and flipped bits, on laser b") {
    run.inject(Fault::laser_garbage, 1, 1, 1);
    run.inject(Fault::laser_crc_errors, 1, 1, (5000 << 8) + 1);
    run.go(3);
    CHECK(run.rig.line_counters(0).bytes_garbled == 0);
    CHECK(run.rig.line_counters(1).bytes_garbled > 800);
  }
  SECTION("rates that differ garble every byte, both ways") {
    run.go(0.5);
    REQUIRE(run.rig.byte_port(0).set_baud_rate(38'400));
    CHECK_FALSE(run.rig.byte_port(0).set_baud_rate(0));
    run.go(1);
    CHECK(run.rig.line_counters(0).bytes_garbled > 10'000);
    run.laser_a.heard.clear();
    const std::array<std::uint8_t, 4> sent{0x02, 0x00, 0x01, 0x00};
    REQUIRE(run.rig.byte_port(0).write(sent));
    run.go(1.1);
    CHECK(run.laser_a.heard != std::vector<std::uint8_t>(sent.begin(), sent.end()));
    REQUIRE(run.rig.byte_port(0).set_baud_rate(500'000));
    run.go(1.2);
    run.laser_a.heard.clear();
    REQUIRE(run.rig.byte_port(0).write(sent));
    run.go(1.3);
    CHECK(run.laser_a.heard == std::vector<std::uint8_t>(sent.begin(), sent.end()));
  }
  SECTION("what happens inside the laser is handed to it") {
    run.inject(Fault::laser_reset, 1, 0, 1);
    run.inject(Fault::laser_wrong_baud, 1, 0, 7);  // there is no laser 7
    run.go(2);
    CHECK(run.laser_a.faults.empty());
    CHECK(run.laser_b.faults == std::vector<Fault>{Fault::laser_reset});
  }
}

TEST_CASE("faults of odometry and GPS are what they are called") {
  RigSettings settings = short_drive();
  settings.gps.open_sky_for_fix = 0;
  Run run(settings);
  SECTION("frozen: the same speed again and again, the counter goes on or not") {
    const bool counts = GENERATE(false, true);
    run.inject(Fault::odometry_frozen, 10, 1, counts ? 1 : 0);
    run.go(10.02);
    run.recorder.all.clear();
    run.go(10.99);
    const auto frames = run.recorder.frames(0x110);
    REQUIRE(frames.size() > 40);
    for (std::size_t i = 1; i < frames.size(); ++i) {
      CHECK(intel(frames[i], 0) == intel(frames[0], 0));
      CHECK((frames[i].data[4] != frames[i - 1].data[4]) == counts);
    }
  }
  SECTION("the wheels say that they stand, the gyro goes on or not") {
    const bool has_gyro = GENERATE(true, false);
    run.inject(Fault::odometry_frozen, 14, 20, has_gyro ? 2 : 3);
    run.go(14.02);
    run.recorder.all.clear();
    run.go(34);
    CHECK(run.rig.motion().way_m(run.at(34)) - run.rig.motion().way_m(run.at(14)) > 10);  // it drives on
    const auto wheels = run.recorder.frames(0x110);
    REQUIRE(wheels.size() > 900);
    for (std::size_t i = 1; i < wheels.size(); ++i) {
      CHECK(intel(wheels[i], 0) == 0);
      CHECK(intel(wheels[i], 2) == 0);
      CHECK(wheels[i].data[4] != wheels[i - 1].data[4]);
    }
    int fastest = 0;
    for (const CanFrame& frame : run.recorder.frames(0x111))
      fastest = std::max(fastest, std::abs(motorola(frame, 0)));
    CHECK((fastest > 1000) == has_gyro);  // 0.1 rad/s: a bend
  }
  SECTION("silent") {
    run.inject(Fault::odometry_silent, 1, 1);
    run.go(3);
    CHECK(run.recorder.frames(0x110).size() == Approx(100).margin(2));
  }
  SECTION("one absurd speed") {
    run.inject(Fault::odometry_jump, 1);
    run.go(3);
    std::size_t absurd = 0;
    for (const CanFrame& frame : run.recorder.frames(0x110)) absurd += intel(frame, 0) > 20'000 ? 1U : 0U;
    CHECK(absurd == 1);
  }
  SECTION("GPS far away, GPS silent") {
    run.inject(Fault::gps_absurd, 0, 3);
    run.inject(Fault::gps_silent, 3, 10);
    run.go(8);
    const std::string text = run.recorder.text(gps_channel);
    CHECK(std::ranges::count(text, '$') == 6);
    CHECK(text.find(",61") != std::string::npos);  // 1000 km to the north
  }
}

TEST_CASE("signals lie where DBC files say") {
  std::array<std::uint8_t, 8> data{};
  CHECK(put_signal({4, 12, ByteOrder::intel, RawType::unsigned_integer, 0.5, 10}, 10 + 0.5 * 0xabc,
                   data));  // Intel
  CHECK(data[0] == 0xc0);
  CHECK(data[1] == 0xab);
  data = {};
  CHECK(put_signal({3, 12, ByteOrder::motorola, RawType::signed_integer, 1, 0}, -2,
                   data));  // Motorola: from bit 3 of byte 0 down
  CHECK(data[0] == 0x0f);
  CHECK(data[1] == 0xfe);
  data = {};
  CHECK(put_signal({0, 8, ByteOrder::intel, RawType::signed_integer, 1, 0}, 1000, data));  // saturates
  CHECK(data[0] == 127);
  CHECK(put_signal({0, 8, ByteOrder::intel, RawType::signed_integer, 1, 0}, -1000, data));
  CHECK(data[0] == 128);
  CHECK(put_signal({0, 64, ByteOrder::intel, RawType::unsigned_integer, 1, 0}, 1e30, data));
  CHECK(data[7] == 255);
  CHECK_FALSE(put_signal({60, 8, ByteOrder::intel, RawType::unsigned_integer, 1, 0}, 1, data));
  CHECK_FALSE(put_signal({56, 9, ByteOrder::motorola, RawType::unsigned_integer, 1, 0}, 1, data));
  CHECK_FALSE(put_signal({0, 0, ByteOrder::intel, RawType::unsigned_integer, 1, 0}, 1, data));
  CHECK_FALSE(put_signal({0, 65, ByteOrder::intel, RawType::unsigned_integer, 1, 0}, 1, data));
  CHECK_FALSE(put_signal({0, 8, ByteOrder::intel, RawType::unsigned_integer, 0, 0}, 1, data));
}

TEST_CASE("the truth starts at the reference, and every fault has a text") {
  const Run run(short_drive(), 0.01);
  const Pose origin = run.rig.map_from_body(run.at(20), run.at(20));
  CHECK(origin.translation_m.norm() < 1e-9);
  CHECK(run.rig.map_from_body(run.at(30), run.at(20)).translation_m.norm() > 5);
  for (std::uint8_t fault = 0; fault < fault_count; ++fault)
    CHECK(std::strcmp(to_string(static_cast<Fault>(fault)), "unknown fault") != 0);
}
