#include "alces_platform/sim/sensors/odometry_sensor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "alces_platform/sim/sensors/put_signal.h"

namespace alces::sim {
namespace {

constexpr double deg = std::numbers::pi / 180;
constexpr std::int64_t error_step_ns = 10'000'000;

std::size_t at(OdometryQuantity quantity) {
  return static_cast<std::size_t>(quantity);
}

bool is_of_wheels(OdometryQuantity quantity) {
  switch (quantity) {
    case OdometryQuantity::speed:
    case OdometryQuantity::left_speed:
    case OdometryQuantity::right_speed:
    case OdometryQuantity::wheel_yaw_rate:
    case OdometryQuantity::left_way:
    case OdometryQuantity::right_way:
      return true;
    case OdometryQuantity::gyro_yaw_rate:
    case OdometryQuantity::gyro_roll_rate:
    case OdometryQuantity::gyro_pitch_rate:
    case OdometryQuantity::counter:
      return false;
  }
  return false;
}

/// What does not fit into the signal comes round from below, as a counter's register does.
double wrapped(const CanSignal& signal, double value) {
  const double span = std::ldexp(signal.factor, signal.length);
  const double low = signal.offset - (signal.type == RawType::signed_integer ? span / 2 : 0);
  return value - span * std::floor((value - low) / span);
}

}  // namespace

OdometrySensorSettings OdometrySensorSettings::without_errors() const {
  OdometrySensorSettings exact = *this;
  exact.scale_error = exact.slip = exact.speed_noise_m_per_s = exact.wheel_turn_error = 0;
  exact.gyro_scale_error = exact.gyro_bias_deg_per_s = exact.gyro_noise_deg_per_sqrt_s = 0;
  exact.gyro_bias_walk_deg_per_s_per_sqrt_s = 0;
  return exact;
}

OdometrySensor::OdometrySensor(const OdometrySensorSettings& settings, std::uint64_t seed,
                               const VehicleMotion& motion, std::int64_t start_stamp_ns)
    : settings_(settings), motion_(motion), random_(mix(seed, 70)), errors_stamp_ns_(start_stamp_ns) {
  Random of_the_drive(mix(seed, 71));
  scale_ += settings.scale_error * of_the_drive.uniform(0.7, 1.3) * (of_the_drive.chance(0.5) ? 1.0 : -1.0);
  turn_scale_ += settings.wheel_turn_error * of_the_drive.normal();
  for (double& scale : gyro_scale_) scale += settings.gyro_scale_error * of_the_drive.normal();
  for (double& bias : gyro_bias_rad_per_s_) bias = settings.gyro_bias_deg_per_s * deg * of_the_drive.normal();
  left_slip_ = settings.slip * of_the_drive.normal();
  right_slip_ = settings.slip * of_the_drive.normal();
  std::uint64_t number = 0;
  for (const OdometryFrame& frame : settings.frames) {
    const auto period_ns = static_cast<std::int64_t>(1e9 / frame.rate_hz);
    // Nodes are not in step with each other.
    const auto phase_ns = static_cast<std::int64_t>(of_the_drive.uniform() * static_cast<double>(period_ns));
    const bool has_wheels = std::ranges::any_of(settings.signals, [&](const OdometrySignal& signal) {
      return signal.can_id == frame.can_id && is_of_wheels(signal.quantity);
    });
    timetables_.push_back({frame,
                           has_wheels,
                           period_ns,
                           start_stamp_ns + phase_ns,
                           start_stamp_ns,
                           0,
                           Random(mix(seed, 72, number++)),
                           0,
                           0,
                           {}});
  }
}

void OdometrySensor::step_errors(std::int64_t now_ns) {
  const double step_s = static_cast<double>(error_step_ns) * 1e-9;
  const double stays = std::exp(-step_s / settings_.slip_s);
  const double comes = settings_.slip * std::sqrt(1 - stays * stays);
  const double walk = settings_.gyro_bias_walk_deg_per_s_per_sqrt_s * deg * std::sqrt(step_s);
  while (errors_stamp_ns_ + error_step_ns <= now_ns) {
    errors_stamp_ns_ += error_step_ns;
    left_slip_ = stays * left_slip_ + comes * random_.normal();
    right_slip_ = stays * right_slip_ + comes * random_.normal();
    for (double& bias : gyro_bias_rad_per_s_) bias += walk * random_.normal();
  }
}

void OdometrySensor::sample(Timetable& timetable, Standing standing) {
  const std::int64_t begin_ns = timetable.last_ns;
  const std::int64_t end_ns = timetable.next_ns;
  const double step_s = std::max(1e-6, static_cast<double>(end_ns - begin_ns) * 1e-9);
  // Simpson's rule: the mean since the last sample.
  const auto begin = motion_.at(begin_ns);
  const auto middle = motion_.at(begin_ns + (end_ns - begin_ns) / 2);
  const auto end = motion_.at(end_ns);
  double speed =
      (begin.velocity_m_per_s.x() + 4 * middle.velocity_m_per_s.x() + end.velocity_m_per_s.x()) / 6;
  Eigen::Vector3d rates = (begin.rate_rad_per_s + 4 * middle.rate_rad_per_s + end.rate_rad_per_s) / 6;
  double turn = 0.5 * settings_.track_m * rates.z() * turn_scale_;
  if (standing != Standing::nothing) speed = turn = 0;
  if (standing == Standing::wheels_and_gyro) rates.setZero();

  step_errors(end_ns);
  Random& random = timetable.random;
  const auto wheel = [&](double true_speed, double slip) {
    // A wheel that stands measures nothing: its error goes with its speed.
    const double noise =
        settings_.speed_noise_m_per_s * random.normal() * std::min(1.0, std::abs(true_speed) / 0.2);
    return scale_ * true_speed * (1 + slip) + noise;
  };
  double left = wheel(speed - turn, left_slip_);
  double right = wheel(speed + turn, right_slip_);
  if (jump_m_per_s_ != 0) {
    left = right = jump_m_per_s_;
  }
  timetable.left_m += left * step_s;
  timetable.right_m += right * step_s;
  auto& values = timetable.values;
  constexpr OdometryQuantity axes[] = {OdometryQuantity::gyro_roll_rate, OdometryQuantity::gyro_pitch_rate,
                                       OdometryQuantity::gyro_yaw_rate};
  const double gyro_noise = settings_.gyro_noise_deg_per_sqrt_s * deg / std::sqrt(step_s);
  for (std::size_t axis = 0; axis < 3; ++axis)
    values[at(axes[axis])] = gyro_scale_[axis] * rates[static_cast<Eigen::Index>(axis)] +
                             gyro_bias_rad_per_s_[axis] + gyro_noise * random.normal();
  values[at(OdometryQuantity::speed)] = 0.5 * (left + right);
  values[at(OdometryQuantity::left_speed)] = left;
  values[at(OdometryQuantity::right_speed)] = right;
  values[at(OdometryQuantity::wheel_yaw_rate)] = (right - left) / settings_.track_m;
  values[at(OdometryQuantity::left_way)] = timetable.left_m;
  values[at(OdometryQuantity::right_way)] = timetable.right_m;
}

void OdometrySensor::poll(std::int64_t now_ns, const FaultPlan& faults, std::vector<Output>& frames) {
  const std::size_t first = frames.size();
  for (Timetable& timetable : timetables_) {
    for (; timetable.next_ns <= now_ns; timetable.next_ns += timetable.period_ns) {
      const Injection* frozen = faults.active(Fault::odometry_frozen, timetable.next_ns);
      const std::int64_t kind = frozen == nullptr ? 0 : frozen->argument;
      if (frozen == nullptr || kind >= 2) {
        sample(timetable, kind == 0   ? Standing::nothing
                          : kind == 2 ? Standing::wheels
                                      : Standing::wheels_and_gyro);
        if (timetable.has_wheels) jump_m_per_s_ = 0;
      }
      timetable.last_ns = timetable.next_ns;
      if (frozen == nullptr || kind >= 1)
        timetable.values[at(OdometryQuantity::counter)] = static_cast<double>(timetable.count++);
      if (faults.active(Fault::odometry_silent, timetable.next_ns) != nullptr) continue;
      Output output;
      output.ready_stamp_ns = timetable.next_ns;
      output.frame.id = timetable.frame.can_id;
      output.frame.is_extended = timetable.frame.is_extended;
      output.frame.size = std::min<std::uint8_t>(timetable.frame.size, 8);
      for (const OdometrySignal& signal : settings_.signals) {
        if (signal.can_id != timetable.frame.can_id) continue;
        const bool counts = signal.quantity == OdometryQuantity::left_way ||
                            signal.quantity == OdometryQuantity::right_way ||
                            signal.quantity == OdometryQuantity::counter;
        const double value = timetable.values[at(signal.quantity)];
        // A signal outside of its frame is a mistake in the table; there is nobody to tell but the test that
        // looks.
        (void)put_signal(signal.signal, counts ? wrapped(signal.signal, value) : value,
                         std::span(output.frame.data).first(output.frame.size));
      }
      frames.push_back(output);
    }
  }
  std::stable_sort(frames.begin() + static_cast<std::ptrdiff_t>(first), frames.end(),
                   [](const Output& a, const Output& b) { return a.ready_stamp_ns < b.ready_stamp_ns; });
}

}  // namespace alces::sim
