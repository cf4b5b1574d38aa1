#include "alces_drivers/encoder/encoder.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace alces {
namespace {

constexpr double turn_rad = 2 * std::numbers::pi;

/// Stamps beyond are no times of a monotonic clock; within, differences cannot overflow.
constexpr std::int64_t last_sane_stamp_ns = INT64_MAX / 4;
/// A stamp so far past the last tick is a wrong one.
constexpr std::int64_t future_ns = 10 * ns_per_s;
/// Quadrature lines that are silent say that the head stands; an edge may be on its way so long.
constexpr std::int64_t edge_delay_ns = 10 * ns_per_ms;
constexpr std::int64_t speed_span_ns = 100 * ns_per_ms;
/// Before the first whole turn the ratio of angle to counts is the configuration's, with a gear's tolerance.
constexpr double slip_factor_before_learning = 10;
/// A relative angle whose quadrature lost edges is uncertain by so much more.
constexpr double loss_sigma_rad = 0.1;

}  // namespace

Encoder::Encoder(const EncoderConfig& config, NoticePort& notices)
    : config_(config),
      notices_(notices, "encoder"),
      history_(config.smoothness),
      last_known_angle_rad_(config.index_angle_rad) {}

bool Encoder::is_stamp_good(std::int64_t stamp_ns) {
  const bool is_sane = stamp_ns >= 0 && stamp_ns <= last_sane_stamp_ns;
  if (is_sane && (ticked_ns_ == no_stamp_ns || stamp_ns - ticked_ns_ <= future_ns)) {
    now_ns_ = std::max(now_ns_, stamp_ns);
    return true;
  }
  ++counters_.stamps_absurd;
  return false;
}

void Encoder::begin_anew() {
  history_.clear();
  shape_.clear();
  drop_reference();
  quadrature_.reset();
  has_position_ = false;
  now_ns_ = no_stamp_ns;
  last_pulse_ns_ = pending_pulse_ns_ = last_sync_ns_ = no_stamp_ns;
  last_position_ns_ = last_quadrature_ns_ = last_real_node_ns_ = speed_watched_ns_ = no_stamp_ns;
  is_index_lost_ = false;
  speed_state_ = SpeedState::unknown;
}

void Encoder::on_edge(const GpioEdge& edge, std::int64_t stamp_ns) {
  if (!is_stamp_good(stamp_ns)) return;
  ++counters_.edges;
  if (edge.line == config_.index_line && has_index()) {
    note_sequence(0, edge, stamp_ns);
    if (edge.is_rising == config_.index_is_rising) on_pulse(stamp_ns);
  } else if (edge.line == config_.a_line && edge.line != EncoderConfig::no_line) {
    note_sequence(1, edge, stamp_ns);
    on_quadrature_edge(Quadrature::Line::a, edge, stamp_ns);
  } else if (edge.line == config_.b_line && edge.line != EncoderConfig::no_line) {
    note_sequence(2, edge, stamp_ns);
    on_quadrature_edge(Quadrature::Line::b, edge, stamp_ns);
  } else if (edge.line == config_.sync_line && edge.line != EncoderConfig::no_line) {
    note_sequence(3, edge, stamp_ns);
    if (edge.is_rising) {
      ++counters_.sync_pulses;
      last_sync_ns_ = std::max(last_sync_ns_, stamp_ns);
    }
  } else {
    ++counters_.edges_of_other_lines;
  }
}

void Encoder::note_sequence(std::size_t slot, const GpioEdge& edge, std::int64_t stamp_ns) {
  const std::uint32_t last = last_sequence_[slot];
  last_sequence_[slot] = edge.sequence;
  if (last == 0 || edge.sequence == 0 || edge.sequence == last + 1) return;
  // Counted from 1 again: the line was requested anew, and nobody knows what passed meanwhile.
  count_lost(edge.sequence > last ? edge.sequence - last - 1 : 0, stamp_ns);
  if (edge.line == config_.a_line || edge.line == config_.b_line) break_quadrature();
}

void Encoder::on_edges_lost(std::uint32_t count, std::int64_t stamp_ns) {
  if (!is_stamp_good(stamp_ns)) return;
  count_lost(count, stamp_ns);
  break_quadrature();
}

void Encoder::count_lost(std::uint32_t count, std::int64_t stamp_ns) {
  ++counters_.edge_losses;
  counters_.edges_lost += count;
  notices_.raise(NoticeKind::edges_lost, Severity::warning, stamp_ns,
                 "edges were lost before they could be read", count);
}

void Encoder::break_quadrature() {
  quadrature_.reset();
  if (config_.shape != AngleShape::quadrature) return;
  append_predicted_until(last_sane_stamp_ns);
  if (!history_.is_empty()) {
    last_known_sigma_rad_ = static_cast<double>(history_.newest().sigma_rad) + loss_sigma_rad;
  }
  shape_.clear();
  drop_reference();
}

void Encoder::on_quadrature_edge(Quadrature::Line line, const GpioEdge& edge, std::int64_t stamp_ns) {
  if (stamp_ns < last_quadrature_ns_) ++counters_.edges_reordered;
  last_quadrature_ns_ = std::max(last_quadrature_ns_, stamp_ns);
  const Quadrature::Step step = quadrature_.on_edge(line, edge.is_rising);
  if (step.is_repeated) ++counters_.quadrature_repeats;
  quadrature_counts_ += step.counts;
  if (config_.shape == AngleShape::quadrature && step.counts != 0)
    push_shape(stamp_ns, quadrature_shape_rad());
}

void Encoder::on_drive_position(std::int32_t counts, std::int64_t stamp_ns) {
  if (!is_stamp_good(stamp_ns) || config_.drive_counts_per_turn <= 0) return;
  const std::int64_t sampled_ns = stamp_ns - config_.drive_latency_ns;
  if (has_position_ && sampled_ns <= last_position_ns_) {
    ++(sampled_ns == last_position_ns_ && counts == last_position_ ? counters_.positions_duplicated
                                                                   : counters_.positions_reordered);
    return;
  }
  ++counters_.positions;
  if (has_position_) {
    // The difference modulo 2^32 is the way, however often the count has wrapped.
    const std::uint32_t difference =
        static_cast<std::uint32_t>(counts) - static_cast<std::uint32_t>(last_position_);
    const auto step = static_cast<std::int32_t>(difference);
    const double way_rad = turn_rad * static_cast<double>(step) / config_.drive_counts_per_turn;
    const double duration_s = seconds(sampled_ns - last_position_ns_);
    if (std::abs(way_rad) <= 3 * std::abs(config_.expected_speed_rad_s) * duration_s + 0.1) {
      drive_counts_ += step;
    } else {
      ++counters_.position_jumps;
      notices_.raise(NoticeKind::jump, Severity::warning, stamp_ns,
                     "the drive's position jumped (was it reset?); waiting for the next index pulse", step);
      if (config_.shape == AngleShape::drive) {
        append_predicted_until(last_sane_stamp_ns);
        if (!history_.is_empty()) {
          last_known_sigma_rad_ = static_cast<double>(history_.newest().sigma_rad) +
                                  std::abs(config_.expected_speed_rad_s) * duration_s;
        }
        shape_.clear();
        drop_reference();
      }
    }
  }
  has_position_ = true;
  last_position_ = counts;
  last_position_ns_ = sampled_ns;
  if (config_.shape == AngleShape::drive) push_shape(sampled_ns, drive_shape_rad());
}

double Encoder::drive_shape_rad() const {
  return turn_rad * config_.drive_direction * static_cast<double>(drive_counts_) /
         config_.drive_counts_per_turn;
}

double Encoder::quadrature_shape_rad() const {
  return turn_rad * config_.quadrature_direction * static_cast<double>(quadrature_counts_) /
         config_.quadrature_counts_per_turn;
}

void Encoder::on_tick(std::int64_t now_ns) {
  if (now_ns < 0 || now_ns > last_sane_stamp_ns) {
    ++counters_.stamps_absurd;
    return;
  }
  if (ticked_ns_ != no_stamp_ns && now_ns < ticked_ns_ - clock_step_ns) {
    ++counters_.clock_steps;
    notices_.raise(NoticeKind::clock, Severity::error, now_ns,
                   "time ran backward; the head's angle begins anew");
    begin_anew();
  }
  ticked_ns_ = now_ns;
  now_ns_ = std::max(now_ns_, now_ns);
  const bool is_silent =
      !shape_.is_empty() && now_ns - edge_delay_ns > shape_.newest().stamp_ns + config_.node_interval_ns;
  if (config_.shape == AngleShape::quadrature && is_silent)
    push_shape(now_ns - edge_delay_ns, quadrature_shape_rad());
  if (pending_pulse_ns_ != no_stamp_ns) resolve_pending(now_ns - pending_pulse_ns_ > config_.maximum_gap_ns);
  const std::int64_t due_ns = now_ns - config_.maximum_wait_ns;
  if (!history_.is_empty() && history_.newest().stamp_ns < due_ns) {
    append_predicted_until(due_ns);
    extrapolate_until(due_ns);
  }
  watch_index(now_ns);
}

AngleAnswer Encoder::angle_at(std::int64_t stamp_ns) const {
  const AngleAnswer answer = history_.at(stamp_ns);
  if (answer.status == AngleStatus::not_yet) {
    const bool is_overdue = ticked_ns_ != no_stamp_ns && stamp_ns < ticked_ns_ - config_.maximum_wait_ns;
    return {is_overdue ? AngleStatus::lost : AngleStatus::not_yet, 0, 0};
  }
  // A relative angle may become as uncertain as it likes: it says so.
  const bool is_too_vague = has_index() && answer.sigma_rad > config_.maximum_sigma_rad;
  if (answer.status == AngleStatus::ok && is_too_vague) return {AngleStatus::lost, 0, 0};
  return answer;
}

bool Encoder::speed(double& speed_rad_s) const {
  return history_.speed(speed_span_ns, speed_rad_s);
}

void Encoder::drop_reference() {
  if (!history_.is_empty()) last_known_angle_rad_ = history_.newest().angle_rad;
  reference_ = {};
  has_candidate_ = false;
  has_shapes_at_pulse_ = false;
  is_break_due_ = true;
}

void Encoder::push_shape(std::int64_t stamp_ns, double shape_rad) {
  if (!shape_.is_empty()) {
    const std::int64_t since_ns = stamp_ns - shape_.newest().stamp_ns;
    if (since_ns <= 0 || (since_ns < config_.node_interval_ns && pending_pulse_ns_ == no_stamp_ns)) return;
    if (since_ns > config_.maximum_gap_ns) {
      ++counters_.position_gaps;
      notices_.raise(NoticeKind::gap, Severity::warning, stamp_ns,
                     "no counts of the head's position for a while, ms", since_ns / ns_per_ms);
    }
    // What would be overwritten cannot wait any longer for its pulse.
    if (shape_.is_full()) append_predicted_until(shape_.oldest().stamp_ns);
  }
  shape_.push({stamp_ns, shape_rad});
  if (pending_pulse_ns_ != no_stamp_ns) resolve_pending(false);
  if (!has_index() && !reference_.is_known) {
    reference_ = {.is_known = true,
                  .has_shape = true,
                  .stamp_ns = stamp_ns,
                  .shape_rad = shape_rad,
                  .angle_rad = last_known_angle_rad_,
                  .sigma_rad = last_known_sigma_rad_};
  }
  if (!config_.wait_for_index || !has_index()) append_predicted_until(stamp_ns);
}

bool Encoder::shape_at(std::int64_t stamp_ns, double& shape_rad) const {
  const std::uint32_t after = shape_.upper_bound(stamp_ns);
  if (after == 0) return false;
  const ShapeSample& from = shape_[after - 1];
  shape_rad = from.shape_rad;
  if (from.stamp_ns == stamp_ns) return true;
  if (after == shape_.size()) return false;
  const ShapeSample& to = shape_[after];
  if (to.stamp_ns - from.stamp_ns > config_.maximum_gap_ns) return false;
  const double fraction = seconds(stamp_ns - from.stamp_ns) / seconds(to.stamp_ns - from.stamp_ns);
  shape_rad += fraction * (to.shape_rad - from.shape_rad);
  return true;
}

bool Encoder::is_speed_plausible(double speed_rad_s) const {
  return std::abs(speed_rad_s - config_.expected_speed_rad_s) <=
         config_.speed_tolerance * std::abs(config_.expected_speed_rad_s);
}

void Encoder::append(std::int64_t stamp_ns, double angle_rad, double sigma_rad, NodeKind kind) {
  AngleNode node{stamp_ns, angle_rad, static_cast<float>(sigma_rad), false, kind == NodeKind::extrapolated};
  if (!history_.is_empty()) {
    const AngleNode& last = history_.newest();
    if (stamp_ns <= last.stamp_ns) return;
    const std::int64_t way_ns = stamp_ns - last.stamp_ns;
    const bool is_bridged =
        kind == NodeKind::index && is_speed_plausible((angle_rad - last.angle_rad) / seconds(way_ns));
    node.is_connected = kind == NodeKind::extrapolated ||
                        (!is_break_due_ && (way_ns <= config_.maximum_gap_ns || is_bridged));
    if (!node.is_connected) ++counters_.history_breaks;
  }
  if (kind != NodeKind::extrapolated) {
    is_break_due_ = false;
    last_real_node_ns_ = stamp_ns;
    last_real_sigma_rad_ = sigma_rad;
  }
  if (history_.append(node)) watch_speed(stamp_ns);
}

double Encoder::slip() const {
  const bool is_guess = has_index() && !is_ratio_learned_;
  return config_.slip * (is_guess ? slip_factor_before_learning : 1.0);
}

double Encoder::predicted_sigma_rad(double way_rad) const {
  const double slip_rad = slip() * way_rad;
  return std::sqrt(config_.count_sigma_rad * config_.count_sigma_rad + slip_rad * slip_rad +
                   reference_.sigma_rad * reference_.sigma_rad);
}

void Encoder::append_predicted(const ShapeSample& sample) {
  const double way_rad = (sample.shape_rad - reference_.shape_rad) * ratio_;
  double sigma_rad = predicted_sigma_rad(way_rad);
  // A pulse came where none was due, and none came where one was: the counts may have slipped by the
  // difference.
  if (has_candidate_ && std::abs(way_rad) > turn_rad) sigma_rad += std::abs(candidate_residual_rad_);
  append(sample.stamp_ns, reference_.angle_rad + way_rad, sigma_rad, NodeKind::counts);
}

void Encoder::append_predicted_until(std::int64_t stamp_ns) {
  if (!reference_.is_known || !reference_.has_shape) return;
  std::int64_t from_ns = reference_.stamp_ns - 1;
  if (!history_.is_empty()) from_ns = std::max(from_ns, history_.newest().stamp_ns);
  for (std::uint32_t i = shape_.upper_bound(from_ns); i < shape_.size() && from_ns < stamp_ns; ++i) {
    from_ns = shape_[i].stamp_ns;
    append_predicted(shape_[i]);
  }
}

void Encoder::extrapolate_until(std::int64_t stamp_ns) {
  if (history_.is_empty() || last_real_node_ns_ == no_stamp_ns) return;
  const std::int64_t until_ns = std::min(stamp_ns, last_real_node_ns_ + config_.maximum_extrapolation_ns);
  const AngleNode last = history_.newest();
  double speed_rad_s = 0;
  if (until_ns <= last.stamp_ns || !history_.speed(speed_span_ns, speed_rad_s)) return;
  ++counters_.angles_extrapolated;
  const double sigma_rad =
      last_real_sigma_rad_ + config_.smoothness.speed_ripple_rad_s * seconds(until_ns - last_real_node_ns_);
  append(until_ns, last.angle_rad + speed_rad_s * seconds(until_ns - last.stamp_ns), sigma_rad,
         NodeKind::extrapolated);
}

void Encoder::watch_speed(std::int64_t stamp_ns) {
  if (speed_watched_ns_ != no_stamp_ns && stamp_ns - speed_watched_ns_ < speed_span_ns) return;
  speed_watched_ns_ = stamp_ns;
  double speed_rad_s = 0;
  if (!speed(speed_rad_s)) return;
  const double limit_rad_s = 0.05 * std::abs(config_.expected_speed_rad_s);
  const bool was_reversed = is_reversed_;
  is_reversed_ = speed_rad_s * sign() < (was_reversed ? 0.0 : -limit_rad_s);
  if (is_reversed_ && !was_reversed) {
    ++counters_.reversals;
    notices_.raise(NoticeKind::reversal, Severity::warning, stamp_ns,
                   config_.shape == AngleShape::quadrature
                       ? "the head turns against its expected direction, or A and B are swapped"
                       : "the head turns against its expected direction");
  }
  const bool was_inside = speed_state_ == SpeedState::inside;
  speed_state_ = is_speed_plausible(speed_rad_s) ? SpeedState::inside : SpeedState::outside;
  const auto millirad_s = static_cast<std::int64_t>(std::clamp(speed_rad_s, -1e6, 1e6) * 1e3);
  if (was_inside && speed_state_ == SpeedState::outside) {
    ++counters_.speed_excursions;
    notices_.raise(NoticeKind::speed, Severity::warning, stamp_ns, "the head's speed left its range, mrad/s",
                   millirad_s);
  }
}

void Encoder::watch_index(std::int64_t stamp_ns) {
  if (!has_index() || !reference_.is_known || is_index_lost_) return;
  const bool by_time = !reference_.has_shape || shape_.is_empty();
  const double way_rad = by_time ? std::abs(config_.expected_speed_rad_s) *
                                       seconds(stamp_ns - reference_.stamp_ns) / (1 + config_.speed_tolerance)
                                 : std::abs(shape_.newest().shape_rad - reference_.shape_rad) * ratio_;
  if (way_rad < 2.5 * turn_rad) return;  // two in a row
  is_index_lost_ = true;
  ++counters_.index_losses;
  notices_.raise(NoticeKind::loss, Severity::error, stamp_ns,
                 "the index pulses stay away: check the sensor and its line");
}

}  // namespace alces
