#include "alces_drivers/odometry/odometry.h"
#include "alces_drivers/odometry/odometry_uncertainty.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <memory>

#include "alces_platform/sim/random.h"
#include "drivers/notice_log.h"

using namespace alces;

namespace {

constexpr std::int64_t begin_ns = 100 * ns_per_s;
constexpr std::uint32_t wheels_id = 0x1A0;
constexpr std::uint32_t rates_id = 0x18FEF1AA;  // 29 bits
constexpr double wheel_base_m = 0.6;

CanSignal signal(std::uint16_t start, std::uint8_t length, ByteOrder order, double factor) {
  return {.start_bit = start,
          .length = length,
          .order = order,
          .type = RawType::signed_integer,
          .factor = factor};
}

OdometryConfig wheels_config() {
  OdometryConfig config;
  config.kind = OdometryKind::wheels;
  config.left_speed_m_s = {wheels_id, false, signal(0, 24, ByteOrder::intel, 1e-5)};
  config.right_speed_m_s = {wheels_id, false, signal(31, 24, ByteOrder::motorola, 1e-5)};
  config.wheel_base_m = wheel_base_m;
  return config;
}

OdometryConfig vehicle_config() {
  OdometryConfig config;
  config.kind = OdometryKind::vehicle;
  config.speed_m_s = {wheels_id, false, signal(0, 24, ByteOrder::intel, 1e-5)};
  config.yaw_rate_rad_s = {rates_id, true, signal(0, 20, ByteOrder::intel, 1e-5)};
  config.roll_rate_rad_s = {rates_id, true, signal(20, 20, ByteOrder::intel, 1e-5)};
  config.pitch_rate_rad_s = {rates_id, true, signal(40, 20, ByteOrder::intel, 1e-5)};
  return config;
}

struct Twist {
  double speed_m_s = 0;
  Eigen::Vector3d rate_rad_s = Eigen::Vector3d::Zero();
};

CanFrame wheels_frame(double left_m_s, double right_m_s, std::uint8_t alive = 0) {
  const OdometryConfig config = wheels_config();
  CanFrame frame{.id = wheels_id, .size = 8};
  const std::span<std::uint8_t> bytes(frame.data.data(), 8);
  REQUIRE(insert(config.left_speed_m_s.signal, left_m_s, bytes) == SignalStatus::ok);
  REQUIRE(insert(config.right_speed_m_s.signal, right_m_s, bytes) == SignalStatus::ok);
  frame.data[7] = alive;
  return frame;
}

CanFrame wheels_frame(const Twist& twist, std::uint8_t alive = 0) {
  const double half_m_s = 0.5 * wheel_base_m * twist.rate_rad_s.z();
  return wheels_frame(twist.speed_m_s - half_m_s, twist.speed_m_s + half_m_s, alive);
}

CanFrame speed_frame(double speed_m_s) {
  CanFrame frame{.id = wheels_id, .size = 8};
  REQUIRE(insert(vehicle_config().speed_m_s.signal, speed_m_s, std::span(frame.data).first(8)) ==
          SignalStatus::ok);
  return frame;
}

CanFrame rates_frame(const Eigen::Vector3d& rate_rad_s) {
  const OdometryConfig config = vehicle_config();
  CanFrame frame{.id = rates_id, .size = 8, .is_extended = true};
  const std::span<std::uint8_t> bytes(frame.data.data(), 8);
  REQUIRE(insert(config.roll_rate_rad_s.signal, rate_rad_s.x(), bytes) == SignalStatus::ok);
  REQUIRE(insert(config.pitch_rate_rad_s.signal, rate_rad_s.y(), bytes) == SignalStatus::ok);
  REQUIRE(insert(config.yaw_rate_rad_s.signal, rate_rad_s.z(), bytes) == SignalStatus::ok);
  return frame;
}

/// A drive of varying speed and rates, integrated in steps of 0.1 ms.
struct Drive {
  std::function<Twist(double)> twist;
  double duration_s = 10;
  std::vector<Pose> poses;  ///< every ms

  explicit Drive(std::function<Twist(double)> motion, double seconds_long = 10)
      : twist(std::move(motion)), duration_s(seconds_long) {
    Pose pose;
    for (int i = 0; i < static_cast<int>(duration_s * 1e4); ++i) {
      if (i % 10 == 0) poses.push_back(pose);
      const Twist now = twist((i + 0.5) * 1e-4);
      Vector6d step;
      step << now.speed_m_s * 1e-4, 0, 0, now.rate_rad_s * 1e-4;
      pose = pose * exp_se3(step);
    }
  }
  [[nodiscard]] const Pose& at_ms(int ms) const { return poses[static_cast<std::size_t>(ms)]; }
};

Twist winding(double t_s) {
  Twist twist;
  twist.speed_m_s = 1.6 + 0.4 * std::sin(0.7 * t_s);
  twist.rate_rad_s = {0, 0, 0.5 * std::sin(0.9 * t_s)};
  return twist;
}

std::int64_t stamp(int ms) {
  return begin_ns + ms * ns_per_ms;
}

double distance_m(const Pose& a, const Pose& b) {
  return (a.translation_m - b.translation_m).norm();
}

/// Wheels' frames every 20 ms from `from_ms` up to before `to_ms`, and a tick with each.
void drive_wheels(Odometry& odometry, const std::function<Twist(double)>& twist, int from_ms, int to_ms,
                  std::int64_t shift_ns = 0) {
  for (int ms = from_ms; ms < to_ms; ms += 20) {
    odometry.on_frame(wheels_frame(twist(ms * 1e-3), static_cast<std::uint8_t>(ms / 20)),
                      stamp(ms) + shift_ns);
    odometry.on_tick(stamp(ms) + shift_ns);
  }
}

}  // namespace

TEST_CASE("wheel speeds are integrated along exact arcs") {
  NoticeLog log;
  auto odometry = std::make_unique<Odometry>(wheels_config(), log);
  REQUIRE(validate(wheels_config()) == nullptr);
  const auto circle = [](double) { return Twist{2.0, {0, 0, 0.5}}; };  // radius 4 m
  drive_wheels(*odometry, circle, 0, 10001);
  const MotionAnswer answer = odometry->pose_at(stamp(10000));
  REQUIRE(answer.status == MotionStatus::ok);
  const Eigen::Vector3d truth(4 * std::sin(5.0), 4 * (1 - std::cos(5.0)), 0);
  CHECK((answer.odometry_from_body.translation_m - truth).norm() < 1e-6);
  CHECK(odometry->pose_at(stamp(9993)).status == MotionStatus::ok);  // between two frames: on the arc as well
  const double angle = 0.5 * 9.993;
  const Eigen::Vector3d between(4 * std::sin(angle), 4 * (1 - std::cos(angle)), 0);
  CHECK((odometry->pose_at(stamp(9993)).odometry_from_body.translation_m - between).norm() < 1e-6);
}

TEST_CASE("a winding drive is followed to a millimetre") {
  NoticeLog log;
  auto odometry = std::make_unique<Odometry>(wheels_config(), log);
  const Drive drive(winding);
  drive_wheels(*odometry, winding, 0, 9990);
  for (int ms = 0; ms < 9900; ms += 37) {
    const MotionAnswer answer = odometry->pose_at(stamp(ms));
    REQUIRE(answer.status == MotionStatus::ok);
    CHECK(distance_m(answer.odometry_from_body, drive.at_ms(ms)) < 1e-3);
    CHECK(angle_between_rad(answer.odometry_from_body.rotation, drive.at_ms(ms).rotation) < 1e-3);
  }
}

TEST_CASE("speed and three rates in frames of different pace make a 6D pose") {
  NoticeLog log;
  REQUIRE(validate(vehicle_config()) == nullptr);
  auto odometry = std::make_unique<Odometry>(vehicle_config(), log);
  const auto ramps = [](double t_s) {
    Twist twist = winding(t_s);
    twist.rate_rad_s.x() = 0.1 * std::cos(1.1 * t_s);
    twist.rate_rad_s.y() = -0.2 * std::cos(0.8 * t_s);
    return twist;
  };
  const Drive drive(ramps);
  for (int ms = 0; ms < 9990; ++ms) {
    if (ms % 10 == 0) odometry->on_frame(rates_frame(ramps(ms * 1e-3).rate_rad_s), stamp(ms));
    if (ms % 25 == 3) odometry->on_frame(speed_frame(ramps(ms * 1e-3).speed_m_s), stamp(ms));
  }
  double highest_m = 0;
  const Pose start = odometry->pose_at(stamp(3)).odometry_from_body;
  for (int ms = 3; ms < 9900; ms += 41) {
    const MotionAnswer answer = odometry->pose_at(stamp(ms));
    REQUIRE(answer.status == MotionStatus::ok);
    const Pose moved = start.inverse() * answer.odometry_from_body;
    const Pose truth = drive.at_ms(3).inverse() * drive.at_ms(ms);
    CHECK(distance_m(moved, truth) < 5e-3);
    CHECK(angle_between_rad(moved.rotation, truth.rotation) < 2e-3);
    highest_m = std::max(highest_m, std::abs(truth.translation_m.z()));
  }
  CHECK(highest_m > 0.5);  // it did leave the plane
}

TEST_CASE("a positive pitch rate lowers the nose") {
  NoticeLog log;
  auto odometry = std::make_unique<Odometry>(vehicle_config(), log);
  for (int ms = 0; ms <= 1000; ms += 10) {
    odometry->on_frame(speed_frame(1), stamp(ms));
    odometry->on_frame(rates_frame({0, 0.1, 0}), stamp(ms));
  }
  CHECK(odometry->pose_at(stamp(1000)).odometry_from_body.translation_m.z() < -0.04);
}

TEST_CASE("a time is not yet known, then known, extrapolated only after the wait, and stale in the end") {
  NoticeLog log;
  OdometryConfig config = wheels_config();
  auto odometry = std::make_unique<Odometry>(config, log);
  CHECK(odometry->pose_at(stamp(0)).status == MotionStatus::not_yet);
  const auto straight = [](double) { return Twist{2.0, {0, 0, 0}}; };
  drive_wheels(*odometry, straight, 1000, 2001);
  CHECK(odometry->pose_at(stamp(999)).status == MotionStatus::too_old);
  CHECK(odometry->pose_at(stamp(2000)).status == MotionStatus::ok);
  CHECK(odometry->pose_at(stamp(2010)).status == MotionStatus::not_yet);
  odometry->on_tick(stamp(2060));
  CHECK(odometry->pose_at(stamp(2010)).status == MotionStatus::not_yet);
  odometry->on_tick(stamp(2080));
  const MotionAnswer ahead = odometry->pose_at(stamp(2010));
  REQUIRE(ahead.status == MotionStatus::ok);
  CHECK(ahead.is_extrapolated);
  CHECK(ahead.odometry_from_body.translation_m.x() == Approx(2.02).epsilon(1e-9));
  odometry->on_tick(stamp(2500));
  CHECK(odometry->pose_at(stamp(2101)).status == MotionStatus::stale);
  CHECK_FALSE(odometry->is_alive());
  CHECK(odometry->counters().gaps == 1);
  CHECK(log.has("no believable odometry frames"));
  // It comes back, and goes on from where it was.
  drive_wheels(*odometry, straight, 3000, 4001);
  CHECK(odometry->pose_at(stamp(2900)).status == MotionStatus::stale);
  CHECK(odometry->pose_at(stamp(4000)).odometry_from_body.translation_m.x() == Approx(4.0).epsilon(1e-6));
  CHECK(odometry->is_alive());
  CHECK(log.has("come again"));
}

TEST_CASE("frames that come twice, late, short or of another node change nothing") {
  NoticeLog log;
  auto clean = std::make_unique<Odometry>(wheels_config(), log);
  auto dirty = std::make_unique<Odometry>(wheels_config(), log);
  drive_wheels(*clean, winding, 0, 5000);
  for (int ms = 0; ms < 5000; ms += 20) {
    const CanFrame frame = wheels_frame(winding(ms * 1e-3), static_cast<std::uint8_t>(ms / 20));
    dirty->on_frame(frame, stamp(ms));
    dirty->on_frame(frame, stamp(ms));                                  // twice
    dirty->on_frame(wheels_frame(Twist{9, {0, 0, 0}}), stamp(ms - 5));  // late
    CanFrame foreign = wheels_frame(Twist{9, {0, 0, 0}});
    foreign.id = 0x1A1;
    dirty->on_frame(foreign, stamp(ms + 1));
    foreign.id = wheels_id;
    foreign.is_extended = true;
    dirty->on_frame(foreign, stamp(ms + 1));
    foreign.is_extended = false;
    foreign.is_remote = true;
    dirty->on_frame(foreign, stamp(ms + 1));
    foreign.is_remote = false;
    foreign.is_error = true;
    dirty->on_frame(foreign, stamp(ms + 1));
    foreign.is_error = false;
    foreign.size = 2;
    dirty->on_frame(foreign, stamp(ms + 1));
    dirty->on_tick(stamp(ms));
  }
  CHECK(dirty->counters().frames_duplicated == 250);
  CHECK(dirty->counters().frames_reordered == 250);
  CHECK(dirty->counters().frames_too_short == 500);  // both signals
  for (int ms = 10; ms < 4980; ms += 33) {
    const MotionAnswer a = clean->pose_at(stamp(ms));
    const MotionAnswer b = dirty->pose_at(stamp(ms));
    REQUIRE(b.status == MotionStatus::ok);
    REQUIRE(a.odometry_from_body.translation_m == b.odometry_from_body.translation_m);
    REQUIRE(a.odometry_from_body.rotation.coeffs() == b.odometry_from_body.rotation.coeffs());
  }
}

TEST_CASE("a value that jumps is not believed, unless it stays") {
  NoticeLog log;
  auto odometry = std::make_unique<Odometry>(wheels_config(), log);
  const auto straight = [](double) { return Twist{1.0, {0, 0, 0}}; };
  drive_wheels(*odometry, straight, 0, 1000);
  odometry->on_frame(wheels_frame(10.0, 10.0), stamp(1000));  // one wild frame
  odometry->on_frame(wheels_frame(80.0, 80.0), stamp(1020));  // and one beyond all
  drive_wheels(*odometry, straight, 1040, 2001);
  CHECK(odometry->counters().jumps == 2);
  CHECK(odometry->counters().values_implausible == 2);
  CHECK(odometry->counters().jumps_believed == 0);
  CHECK(odometry->pose_at(stamp(2000)).odometry_from_body.translation_m.x() == Approx(2.0).epsilon(1e-6));
  const auto fast = [](double) { return Twist{4.0, {0, 0, 0}}; };
  drive_wheels(*odometry, fast, 2020, 4001);
  CHECK(odometry->counters().jumps_believed == 2);
  CHECK(odometry->is_alive());
  CHECK(odometry->pose_at(stamp(4000)).odometry_from_body.translation_m.x() == Approx(9.9).margin(0.2));
}

TEST_CASE("wild values that do not agree with each other are never believed, however many") {
  NoticeLog log;
  auto odometry = std::make_unique<Odometry>(wheels_config(), log);
  const auto straight = [](double) { return Twist{1.0, {0, 0, 0}}; };
  drive_wheels(*odometry, straight, 0, 1000);
  for (int i = 0; i < 10; ++i)
    odometry->on_frame(wheels_frame(i % 2 * 5 + 5, i % 2 * 5 + 5), stamp(1000 + i * 20));
  CHECK(odometry->counters().jumps == 20);
  CHECK(odometry->counters().jumps_believed == 0);
}

TEST_CASE("the same frame again and again while moving is a frozen sender") {
  NoticeLog log;
  auto odometry = std::make_unique<Odometry>(wheels_config(), log);
  drive_wheels(*odometry, winding, 0, 1000);
  const CanFrame frozen = wheels_frame(winding(1.0));
  for (int ms = 1000; ms < 9000; ms += 20) {
    odometry->on_frame(frozen, stamp(ms));
    odometry->on_tick(stamp(ms));
  }
  CHECK(odometry->counters().freezes == 1);
  CHECK(odometry->pose_at(stamp(8000)).status == MotionStatus::stale);
  CHECK(log.has("the same data"));
  drive_wheels(*odometry, winding, 9000, 10000);
  CHECK(odometry->pose_at(stamp(9900)).status == MotionStatus::ok);

  // A vehicle that stands sends the same frame for hours.
  auto standing = std::make_unique<Odometry>(wheels_config(), log);
  for (int ms = 0; ms < 60000; ms += 20) standing->on_frame(wheels_frame(0.0, 0.0), stamp(ms));
  CHECK(standing->counters().freezes == 0);
  CHECK(standing->pose_at(stamp(59000)).status == MotionStatus::ok);
}

TEST_CASE("an alive counter that stands still freezes the odometry at once") {
  NoticeLog log;
  OdometryConfig config = wheels_config();
  config.alive_counter = {wheels_id, false, signal(56, 8, ByteOrder::intel, 1)};
  auto odometry = std::make_unique<Odometry>(config, log);
  drive_wheels(*odometry, winding, 0, 1000);
  for (int ms = 1000; ms < 2000; ms += 20)
    odometry->on_frame(wheels_frame(winding(ms * 1e-3), 77), stamp(ms));
  CHECK(odometry->counters().freezes == 1);
  CHECK(odometry->pose_at(stamp(1900)).status == MotionStatus::stale);
  drive_wheels(*odometry, winding, 2000, 3000);
  CHECK(odometry->pose_at(stamp(2900)).status == MotionStatus::ok);
}

TEST_CASE("the same speeds and the same gyro are a frozen sender, though its alive counter goes on") {
  NoticeLog log;
  OdometryConfig config = wheels_config();
  config.yaw_rate_rad_s = vehicle_config().yaw_rate_rad_s;
  config.alive_counter = {wheels_id, false, signal(56, 8, ByteOrder::intel, 1)};
  const bool does_gyro_rest = GENERATE(true, false);
  auto odometry = std::make_unique<Odometry>(config, log);
  for (int ms = 0; ms < 8000; ms += 20) {
    odometry->on_frame(wheels_frame(1.0, 1.1, static_cast<std::uint8_t>(ms / 20)), stamp(ms));
    odometry->on_frame(rates_frame({0, 0, does_gyro_rest ? 0.2 : 0.2 + 1e-4 * (ms / 20 % 3)}), stamp(ms));
  }
  CHECK(odometry->counters().freezes == (does_gyro_rest ? 1 : 0));
  CHECK(log.has("the same data come again and again") == does_gyro_rest);
  CHECK((odometry->pose_at(stamp(7900)).status == MotionStatus::stale) == does_gyro_rest);
}

TEST_CASE("wheels that say that they stand while the gyro turns are not believed until they move again") {
  NoticeLog log;
  OdometryConfig config = wheels_config();
  config.yaw_rate_rad_s = vehicle_config().yaw_rate_rad_s;
  config.learn_rate_bias = true;
  auto odometry = std::make_unique<Odometry>(config, log);
  const auto drive = [&](int from_ms, int to_ms, double speed_m_s, double rate_rad_s) {
    for (int ms = from_ms; ms < to_ms; ms += 20) {
      odometry->on_frame(wheels_frame(speed_m_s, speed_m_s), stamp(ms));
      odometry->on_frame(rates_frame({0, 0, rate_rad_s + 1e-4 * (ms / 20 % 3)}), stamp(ms));
      odometry->on_tick(stamp(ms));
    }
  };
  drive(0, 3000, 0, 0.01);  // it stands, and the gyro has a bias
  CHECK(odometry->pose_at(stamp(2900)).status == MotionStatus::ok);
  drive(3000, 4000, 1, 0.01);
  drive(4000, 4800, 0, 0.3);  // a short contradiction
  CHECK(odometry->counters().freezes == 0);
  drive(4800, 6000, 1, 0.01);
  drive(6000, 8000, 0, 0.3);  // a bend that the wheels know nothing of
  CHECK(odometry->counters().freezes == 1);
  CHECK(log.has("the wheels say that they stand though the gyro turns"));
  drive(8000, 20000, 0, 0.02);  // and straight on
  CHECK(odometry->pose_at(stamp(19900)).status == MotionStatus::stale);
  CHECK(odometry->rate_bias_rad_s().z() == Approx(0.0101).margin(2e-4));  // nothing was learned from it
  drive(20000, 21000, 1, 0.01);
  CHECK(odometry->pose_at(stamp(20900)).status == MotionStatus::ok);
}

TEST_CASE("a gyro's bias is learned while the vehicle stands") {
  const Eigen::Vector3d bias(0.004, -0.003, 0.01);
  const auto heading_after = [&](bool learn) {
    NoticeLog log;
    OdometryConfig config = vehicle_config();
    config.learn_rate_bias = learn;
    auto odometry = std::make_unique<Odometry>(config, log);
    for (int ms = 0; ms <= 8000; ms += 10) {
      odometry->on_frame(speed_frame(ms < 5000 ? 0.0 : 1.0), stamp(ms));
      odometry->on_frame(rates_frame(bias), stamp(ms));
    }
    if (learn) {
      CHECK(odometry->counters().standstills == 4);
      CHECK((odometry->rate_bias_rad_s() - bias).norm() < 1e-6);
    }
    return angle_between_rad(odometry->pose_at(stamp(5000)).odometry_from_body.rotation,
                             odometry->pose_at(stamp(8000)).odometry_from_body.rotation);
  };
  CHECK(heading_after(true) < 1e-4);
  CHECK(heading_after(false) > 0.03);
}

TEST_CASE("a clock that steps back begins a new history, and the pose goes on") {
  NoticeLog log;
  auto odometry = std::make_unique<Odometry>(wheels_config(), log);
  const auto straight = [](double) { return Twist{1.0, {0, 0, 0}}; };
  drive_wheels(*odometry, straight, 0, 2001);
  drive_wheels(*odometry, straight, 0, 2001, -50 * ns_per_s);
  CHECK(odometry->counters().clock_steps == 1);
  const MotionAnswer answer = odometry->pose_at(stamp(2000) - 50 * ns_per_s);
  REQUIRE(answer.status == MotionStatus::ok);
  // The first frame after the step came before the tick that told of it.
  CHECK(answer.odometry_from_body.translation_m.x() == Approx(3.98).epsilon(1e-6));
}

TEST_CASE("garbage frames at garbage times never give a pose that is no pose") {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    sim::Random random(seed);
    NoticeLog log;
    OdometryConfig config = seed % 2 == 0 ? wheels_config() : vehicle_config();
    config.learn_rate_bias = true;
    config.maximum_acceleration_m_s2 = 1e6;
    config.maximum_rate_change_rad_s2 = 1e6;
    auto odometry = std::make_unique<Odometry>(config, log);
    std::int64_t now_ns = begin_ns;
    for (int i = 0; i < 20000; ++i) {
      now_ns +=
          random.chance(0.001) ? random.integer(-5000, 5000) * ns_per_ms : random.integer(0, 10) * ns_per_ms;
      CanFrame frame;
      frame.is_extended = random.chance(0.5);
      frame.id = frame.is_extended ? rates_id : wheels_id;
      frame.size = static_cast<std::uint8_t>(random.chance(0.9) ? 8 : random.integer(0, 255));
      for (std::size_t byte = 0; byte < 8; ++byte)
        frame.data[byte] = static_cast<std::uint8_t>(random.next());
      odometry->on_frame(frame, random.chance(0.01) ? static_cast<std::int64_t>(random.next()) : now_ns);
      if (random.chance(0.3)) odometry->on_tick(now_ns);
      const MotionAnswer answer = odometry->pose_at(now_ns - random.integer(-100, 3000) * ns_per_ms);
      REQUIRE(is_valid(answer.odometry_from_body));
    }
    CHECK(odometry->counters().nodes > 100);
  }
}

TEST_CASE("an impossible odometry configuration is named") {
  const auto with = [](auto change) {
    OdometryConfig changed = wheels_config();
    change(changed);
    return validate(changed) != nullptr;
  };
  CHECK(with([](OdometryConfig& c) { c.wheel_base_m = 0; }));
  CHECK(with([](OdometryConfig& c) { c.left_speed_m_s.signal.length = 0; }));
  CHECK(with([](OdometryConfig& c) { c.left_speed_m_s.signal.length = 65; }));
  CHECK(with([](OdometryConfig& c) { c.left_speed_m_s.id = 0x800; }));
  CHECK(with([](OdometryConfig& c) { c.kind = OdometryKind::vehicle; }));
  CHECK(with([](OdometryConfig& c) { c.timeout_ns = 0; }));
  CHECK(with([](OdometryConfig& c) { c.maximum_speed_m_s = std::nan(""); }));
}

TEST_CASE("every counter of the odometry has a name") {
  OdometryCounters counters;
  std::size_t names = 0;
  counters.visit([&](const char*, std::uint64_t) { ++names; });
  CHECK(names * sizeof(std::uint64_t) == sizeof(counters));
}

TEST_CASE(
    "the covariance of a straight drive has the way's share ahead, and the gyro's bias and noise across") {
  OdometryErrors errors;
  errors.slip = 0;
  OdometryUncertainty uncertainty(errors, {0, 0, 1});
  Pose pose;
  Pose next;
  for (int i = 0; i < 1000; ++i) {  // 20 s at 1 m/s
    next.translation_m.x() = 0.02 * (i + 1);
    uncertainty.add(pose, next, Eigen::Vector3d::Zero(), 0.02);
    pose = next;
  }
  const Matrix6d covariance = uncertainty.covariance();
  CHECK(std::sqrt(covariance(0, 0)) == Approx(20 * errors.way));
  const double bias2 = errors.bias_rad_s * errors.bias_rad_s;
  const double noise2 = errors.noise_rad_per_sqrt_s * errors.noise_rad_per_sqrt_s;
  CHECK(covariance(5, 5) == Approx(bias2 * 400 + noise2 * 20));
  CHECK(covariance(1, 1) == Approx(bias2 * 200 * 200 + noise2 * 8000.0 / 3).epsilon(0.01));
  CHECK(covariance.isApprox(covariance.transpose()));
  CHECK(covariance(3, 3) == Approx(errors.tilt_rad * errors.tilt_rad));
  CHECK(uncertainty.bias_rad_s() == Approx(errors.bias_rad_s));
  uncertainty.learn_bias(1);
  CHECK(uncertainty.bias_rad_s() == Approx(errors.noise_rad_per_sqrt_s));
}
