#include "alces_drivers/odometry/odometry.h"

#include <algorithm>
#include <cmath>

namespace alces {
namespace {

/// A stamp so far past the last tick is a wrong one.
constexpr std::int64_t future_ns = 10 * ns_per_s;
/// Two frames may be stamped close together though their values are a cycle apart.
constexpr double shortest_cycle_s = 0.01;
/// The wheels stand and the gyro turns: so long, and the wheels are not believed.
constexpr std::int64_t contradiction_ns = ns_per_s;
/// How much of a newly measured bias is taken over.
constexpr double bias_gain = 0.3;

}  // namespace

const char* to_string(MotionStatus status) {
  switch (status) {
    case MotionStatus::ok:
      return "ok";
    case MotionStatus::not_yet:
      return "not yet known";
    case MotionStatus::too_old:
      return "too old to be remembered";
    case MotionStatus::stale:
      return "stale";
  }
  return "unknown";
}

Odometry::Odometry(const OdometryConfig& config, NoticePort& notices)
    : config_(config),
      notices_(notices, "odometry"),
      uncertainty_(config.errors, {config.roll_rate_rad_s.exists(), config.pitch_rate_rad_s.exists(),
                                   config.yaw_rate_rad_s.exists()}) {
  const bool has_wheels = config.kind == OdometryKind::wheels;
  if (has_wheels) {
    sources_[left] = config.left_speed_m_s;
    sources_[right] = config.right_speed_m_s;
  } else {
    sources_[speed] = config.speed_m_s;
  }
  sources_[roll] = config.roll_rate_rad_s;
  sources_[pitch] = config.pitch_rate_rad_s;
  sources_[yaw] = config.yaw_rate_rad_s;
  const auto add_message = [this](const CanSignalSource& source) {
    for (Message& message : messages_) {
      if (message.is_used && message.id == source.id && message.is_extended == source.is_extended) return;
      if (message.is_used) continue;
      message.is_used = true;
      message.id = source.id;
      message.is_extended = source.is_extended;
      return;
    }
  };
  for (std::size_t channel = 0; channel < signal_count; ++channel) {
    integrals_[channel].is_used = sources_[channel].exists();
    if (integrals_[channel].is_used) add_message(sources_[channel]);
  }
  if (config.alive_counter.exists()) add_message(config.alive_counter);
}

bool Odometry::is_stamp_good(std::int64_t stamp_ns) {
  const bool is_sane = stamp_ns >= 0 && stamp_ns <= latest_stamp_ns;
  if (is_sane && (ticked_ns_ == no_stamp_ns || stamp_ns - ticked_ns_ <= future_ns)) return true;
  ++counters_.stamps_absurd;
  return false;
}

void Odometry::begin_anew() {
  nodes_.clear();
  is_break_due_ = true;
  for (Message& message : messages_) message.stamp_ns = message.changed_ns = no_stamp_ns;
  for (Integral& integral : integrals_) {
    integral.is_fresh = integral.has_value = false;
    integral.stamp_ns = integral.changed_ns = no_stamp_ns;
  }
  contradiction_ns_ = no_stamp_ns;
  has_alive_counter_ = false;
  standstill_s_ = 0;
  standstill_sum_rad_.setZero();
}

Odometry::Message* Odometry::message_of(const CanFrame& frame) {
  if (frame.is_remote || frame.is_error) return nullptr;
  for (Message& message : messages_) {
    if (message.is_used && message.id == frame.id && message.is_extended == frame.is_extended)
      return &message;
  }
  return nullptr;
}

bool Odometry::is_frame_new(Message& message, const CanFrame& frame, std::int64_t stamp_ns) {
  const std::span<const std::uint8_t> bytes = frame.bytes();
  const bool is_same =
      frame.size == message.size && std::equal(bytes.begin(), bytes.end(), message.data.begin());
  if (message.stamp_ns != no_stamp_ns && stamp_ns <= message.stamp_ns) {
    ++(is_same && stamp_ns == message.stamp_ns ? counters_.frames_duplicated : counters_.frames_reordered);
    return false;
  }
  if (!is_same || message.stamp_ns == no_stamp_ns) message.changed_ns = stamp_ns;
  message.stamp_ns = stamp_ns;
  message.size = frame.size;
  std::copy(bytes.begin(), bytes.end(), message.data.begin());
  return true;
}

void Odometry::on_frame(const CanFrame& frame, std::int64_t stamp_ns) {
  Message* const message = message_of(frame);
  if (message == nullptr || frame.size > CanFrame::maximum_bytes) return;
  ++counters_.frames;
  if (!is_stamp_good(stamp_ns)) return;
  const std::int64_t sampled_ns = stamp_ns - config_.latency_ns;
  if (!is_frame_new(*message, frame, sampled_ns)) return;
  take_alive_counter(frame, sampled_ns);
  note_values(frame, sampled_ns);
  watch_frozen(sampled_ns);
  if (is_frozen_) return;
  for (std::size_t channel = 0; channel < signal_count; ++channel) {
    if (!sources_[channel].is_in(frame)) continue;
    const SignalValue value = extract(sources_[channel].signal, frame.bytes());
    if (value.status == SignalStatus::ok) {
      take_value(channel, value.value, sampled_ns);
    } else {
      ++(value.status == SignalStatus::frame_too_short ? counters_.frames_too_short
                                                       : counters_.values_out_of_limits);
    }
  }
  make_node_if_complete();
}

void Odometry::take_alive_counter(const CanFrame& frame, std::int64_t stamp_ns) {
  if (!config_.alive_counter.is_in(frame)) return;
  const SignalValue value = extract(config_.alive_counter.signal, frame.bytes());
  if (value.status != SignalStatus::ok) {
    ++counters_.frames_too_short;
    return;
  }
  if (!has_alive_counter_ || value.value != alive_value_) alive_changed_ns_ = stamp_ns;
  has_alive_counter_ = true;
  alive_seen_ns_ = stamp_ns;
  alive_value_ = value.value;
}

void Odometry::note_values(const CanFrame& frame, std::int64_t stamp_ns) {
  for (std::size_t channel = 0; channel < signal_count; ++channel) {
    if (!sources_[channel].is_in(frame)) continue;
    const SignalValue value = extract(sources_[channel].signal, frame.bytes());
    if (value.status != SignalStatus::ok) continue;
    Integral& integral = integrals_[channel];
    if (integral.changed_ns == no_stamp_ns || value.value != integral.received)
      integral.changed_ns = stamp_ns;
    integral.received = value.value;
  }
}

/// Nothing has changed for frozen_after_ns, though the vehicle moves.
bool Odometry::do_values_rest(std::int64_t stamp_ns) const {
  if (config_.frozen_after_ns == 0) return false;
  const bool has_gyro = integrals_[roll].is_used || integrals_[pitch].is_used || integrals_[yaw].is_used;
  if (config_.alive_counter.exists() && !has_gyro) return false;  // speeds may be coarse
  const bool has_counter = config_.alive_counter.exists();
  std::int64_t changed_ns = no_stamp_ns;
  bool is_moving = false;
  for (std::size_t channel = 0; channel < signal_count; ++channel) {
    const Integral& integral = integrals_[channel];
    if (!integral.is_used) continue;
    changed_ns = std::max(changed_ns, integral.changed_ns);
    if (has_counter && is_rate(channel)) continue;  // a gyro at rest may show its bias
    is_moving = is_moving || std::abs(integral.value) > config_.standstill_speed_m_s;
  }
  if (!has_counter) {  // whatever else changes in the frames speaks for the sender
    for (const Message& message : messages_) {
      if (message.is_used) changed_ns = std::max(changed_ns, message.changed_ns);
    }
  }
  return is_moving && changed_ns != no_stamp_ns && stamp_ns - changed_ns > config_.frozen_after_ns;
}

bool Odometry::do_wheels_contradict_gyro(std::int64_t stamp_ns) {
  if (config_.kind != OdometryKind::wheels || !integrals_[yaw].is_used) return false;
  const bool do_wheels_stand = integrals_[left].changed_ns != no_stamp_ns &&
                               integrals_[right].changed_ns != no_stamp_ns &&
                               std::abs(integrals_[left].received) <= config_.standstill_speed_m_s &&
                               std::abs(integrals_[right].received) <= config_.standstill_speed_m_s;
  const bool does_gyro_turn =
      integrals_[yaw].changed_ns != no_stamp_ns &&
      std::abs(integrals_[yaw].received - bias_rad_s_.z()) > config_.maximum_bias_rad_s;
  if (!do_wheels_stand) are_wheels_dead_ = false;
  if (!do_wheels_stand || !does_gyro_turn) {
    contradiction_ns_ = no_stamp_ns;
  } else if (contradiction_ns_ == no_stamp_ns) {
    contradiction_ns_ = stamp_ns;
  } else if (stamp_ns - contradiction_ns_ > contradiction_ns) {
    are_wheels_dead_ = true;
  }
  return are_wheels_dead_;
}

void Odometry::watch_frozen(std::int64_t stamp_ns) {
  const bool is_contradiction = do_wheels_contradict_gyro(stamp_ns);
  if (has_alive_counter_ && alive_seen_ns_ - alive_changed_ns_ > config_.alive_timeout_ns) {
    freeze(stamp_ns, "the sender's alive counter stands still");
  } else if (do_values_rest(stamp_ns)) {
    freeze(stamp_ns, "the same data come again and again though the vehicle moves");
  } else if (is_contradiction) {
    freeze(stamp_ns, "the wheels say that they stand though the gyro turns: are their sensors dead?");
  } else {
    is_frozen_ = false;
  }
}

void Odometry::freeze(std::int64_t stamp_ns, const char* text) {
  is_break_due_ = true;
  if (is_frozen_) return;
  is_frozen_ = true;
  is_alive_ = false;
  ++counters_.freezes;
  notices_.raise(NoticeKind::frozen, Severity::error, stamp_ns, text);
}

bool Odometry::is_change_verified(Integral& integral, double value, double limit, std::int64_t stamp_ns) {
  if (!integral.has_value || stamp_ns - integral.stamp_ns > config_.timeout_ns) return true;
  const double allowed = limit * std::max(seconds(stamp_ns - integral.stamp_ns), shortest_cycle_s);
  if (std::abs(value - integral.value) <= allowed) {
    integral.refused_in_a_row = 0;
    return true;
  }
  ++counters_.jumps;
  notices_.raise(NoticeKind::jump, Severity::warning, stamp_ns, "a value jumped and was not believed",
                 static_cast<std::int64_t>(counters_.jumps));
  const bool agrees = integral.refused_in_a_row > 0 && std::abs(value - integral.refused_value) <= allowed;
  integral.refused_in_a_row = agrees ? integral.refused_in_a_row + 1 : 1;
  integral.refused_value = value;
  if (integral.refused_in_a_row < config_.patience) return false;
  ++counters_.jumps_believed;
  integral.refused_in_a_row = 0;
  return true;
}

void Odometry::take_value(std::size_t channel, double value, std::int64_t stamp_ns) {
  Integral& integral = integrals_[channel];
  const bool is_wheel = channel == left || channel == right;
  const double most = is_rate(channel)
                          ? config_.maximum_rate_rad_s
                          : config_.maximum_speed_m_s +
                                (is_wheel ? 0.5 * config_.wheel_base_m * config_.maximum_rate_rad_s : 0.0);
  if (std::abs(value) > most) {
    ++counters_.values_implausible;
    notices_.raise(NoticeKind::implausible, Severity::warning, stamp_ns,
                   "a speed or rate beyond what the vehicle can do was not believed",
                   static_cast<std::int64_t>(counters_.values_implausible));
    return;
  }
  const double most_change =
      is_rate(channel) ? config_.maximum_rate_change_rad_s2 : config_.maximum_acceleration_m_s2;
  if (!is_change_verified(integral, value, most_change, stamp_ns)) return;
  if (integral.has_value)
    integral.sum += 0.5 * (integral.value + value) * seconds(stamp_ns - integral.stamp_ns);
  integral.has_value = integral.is_fresh = true;
  integral.value = value;
  integral.stamp_ns = stamp_ns;
}

// What the signal adds since the last node; its value holds from its own last frame to the node.
double Odometry::increment(std::size_t channel, std::int64_t stamp_ns) {
  Integral& integral = integrals_[channel];
  if (!integral.is_used) return 0;
  const double sum = integral.sum + integral.value * seconds(stamp_ns - integral.stamp_ns);
  const double since_node = sum - integral.sum_at_node;
  // Kept small, so that a day's way does not cost digits.
  integral.sum -= sum;
  integral.sum_at_node = 0;
  integral.is_fresh = false;
  return since_node;
}

void Odometry::make_node_if_complete() {
  std::int64_t stamp_ns = no_stamp_ns;
  for (const Integral& integral : integrals_) {
    if (integral.is_used && !integral.is_fresh) return;
    if (integral.is_used) stamp_ns = std::max(stamp_ns, integral.stamp_ns);
  }
  const bool is_first = nodes_.is_empty();
  if (!is_first && stamp_ns <= nodes_.newest().stamp_ns) return;
  std::array<double, signal_count> increments{};
  for (std::size_t channel = 0; channel < signal_count; ++channel)
    increments[channel] = increment(channel, stamp_ns);

  Node node;
  node.stamp_ns = stamp_ns;
  const std::int64_t since_ns = is_first ? 0 : stamp_ns - nodes_.newest().stamp_ns;
  node.is_connected = !is_first && !is_break_due_ && since_ns <= config_.timeout_ns;
  if (since_ns > config_.timeout_ns && is_alive_) ++counters_.gaps;  // no tick has seen it
  if (node.is_connected) {
    const bool has_wheels = config_.kind == OdometryKind::wheels;
    const double way_m = has_wheels ? 0.5 * (increments[left] + increments[right]) : increments[speed];
    Eigen::Vector3d rotation_rad(increments[roll], increments[pitch], increments[yaw]);
    learn_bias(way_m, rotation_rad, seconds(since_ns));
    rotation_rad -= bias_rad_s_ * seconds(since_ns);
    if (!integrals_[yaw].is_used)
      rotation_rad.z() = (increments[right] - increments[left]) / config_.wheel_base_m;
    node.twist << way_m, 0, 0, rotation_rad;
    const Pose before = last_pose_;
    last_pose_ = last_pose_ * exp_se3(node.twist);
    uncertainty_.add(before, last_pose_, rotation_rad, seconds(since_ns));
  }
  node.odometry_from_body = last_pose_;
  nodes_.push(node);
  ++counters_.nodes;
  if (!is_alive_ && counters_.gaps + counters_.freezes > 0) {
    notices_.raise(NoticeKind::back, Severity::info, stamp_ns,
                   "frames come again; the pose goes on from where it was");
  }
  is_break_due_ = false;
  is_alive_ = true;
}

void Odometry::learn_bias(double way_m, const Eigen::Vector3d& rotation_rad, double duration_s) {
  if (!config_.learn_rate_bias || duration_s <= 0) return;
  Eigen::Vector3d rate_rad_s = rotation_rad / duration_s;
  if (!integrals_[yaw].is_used) rate_rad_s.z() = 0;  // the wheels' has none
  const bool is_standing = std::abs(way_m) <= config_.standstill_speed_m_s * duration_s &&
                           rate_rad_s.cwiseAbs().maxCoeff() <= config_.maximum_bias_rad_s;
  if (!is_standing) {
    standstill_s_ = 0;
    standstill_sum_rad_.setZero();
    return;
  }
  standstill_s_ += duration_s;
  standstill_sum_rad_ += rate_rad_s * duration_s;
  if (standstill_s_ < seconds(config_.standstill_ns)) return;
  const Eigen::Vector3d measured_rad_s = standstill_sum_rad_ / standstill_s_;
  bias_rad_s_ += (has_bias_ ? bias_gain : 1.0) * (measured_rad_s - bias_rad_s_);
  has_bias_ = true;
  uncertainty_.learn_bias(standstill_s_);
  ++counters_.standstills;
  standstill_s_ = 0;
  standstill_sum_rad_.setZero();
}

void Odometry::on_tick(std::int64_t now_ns) {
  if (now_ns < 0 || now_ns > latest_stamp_ns) {
    ++counters_.stamps_absurd;
    return;
  }
  if (ticked_ns_ != no_stamp_ns && now_ns < ticked_ns_ - clock_step_ns) {
    ++counters_.clock_steps;
    notices_.raise(NoticeKind::clock, Severity::error, now_ns,
                   "time ran backward; the pose goes on, its history begins anew");
    begin_anew();
  }
  ticked_ns_ = now_ns;
  if (is_alive_ && !nodes_.is_empty() && now_ns - nodes_.newest().stamp_ns > config_.timeout_ns) {
    is_alive_ = false;
    ++counters_.gaps;
    notices_.raise(NoticeKind::gap, Severity::error, now_ns, "no believable odometry frames any more");
  }
}

MotionAnswer Odometry::pose_at(std::int64_t stamp_ns) const {
  const bool may_come =
      !is_frozen_ && (ticked_ns_ == no_stamp_ns || stamp_ns >= ticked_ns_ - config_.maximum_wait_ns);
  if (nodes_.is_empty()) return {may_come ? MotionStatus::not_yet : MotionStatus::stale, {}, false};
  const std::uint32_t after = nodes_.upper_bound(stamp_ns);
  if (after == 0) return {MotionStatus::too_old, {}, false};
  const Node& from = nodes_[after - 1];
  if (from.stamp_ns == stamp_ns) return {MotionStatus::ok, from.odometry_from_body, false};
  if (after < nodes_.size()) {
    const Node& to = nodes_[after];
    if (!to.is_connected) return {MotionStatus::stale, {}, false};
    const double fraction = seconds(stamp_ns - from.stamp_ns) / seconds(to.stamp_ns - from.stamp_ns);
    return {MotionStatus::ok, from.odometry_from_body * exp_se3(fraction * to.twist), false};
  }
  if (may_come) return {MotionStatus::not_yet, {}, false};
  if (is_frozen_ || stamp_ns - from.stamp_ns > config_.maximum_extrapolation_ns || !from.is_connected) {
    return {MotionStatus::stale, {}, false};
  }
  const double ahead =
      seconds(stamp_ns - from.stamp_ns) / seconds(from.stamp_ns - nodes_[after - 2].stamp_ns);
  return {MotionStatus::ok, from.odometry_from_body * exp_se3(ahead * from.twist), true};
}

OdometryState Odometry::state_at(std::int64_t now_ns) const {
  OdometryState state;
  state.is_valid = is_alive_ && !is_frozen_;
  state.odometry_from_body = state.node = last_pose_;
  if (nodes_.is_empty()) return state;
  const Node& newest = nodes_.newest();
  state.nodes = counters_.nodes;
  state.node_stamp_ns = state.stamp_ns = newest.stamp_ns;
  state.is_connected = newest.is_connected;
  if (!newest.is_connected || !state.is_valid) return state;
  state.velocity = newest.twist / seconds(newest.stamp_ns - nodes_[nodes_.size() - 2].stamp_ns);
  state.stamp_ns = std::clamp(now_ns, newest.stamp_ns, newest.stamp_ns + config_.maximum_extrapolation_ns);
  state.odometry_from_body =
      newest.odometry_from_body * exp_se3(seconds(state.stamp_ns - newest.stamp_ns) * state.velocity);
  return state;
}

}  // namespace alces
