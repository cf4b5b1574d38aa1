// The encoder's judgement of index pulses.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "alces/portable_math.h"
#include "alces_drivers/encoder/encoder.h"

namespace alces {
namespace {

constexpr double turn_rad = 2 * std::numbers::pi;
/// A pulse within so much, and five sigma, of where it is due needs no second one to be believed.
constexpr double narrow_window_rad = 0.02;
/// So many pulses equally far apart, and not a turn by the counts, raise doubts about counts_per_turn.
constexpr std::uint32_t intervals_to_doubt_ratio = 3;
constexpr double equal_share = 0.05;

}  // namespace

double Encoder::flank_angle_rad(bool is_forward) const {
  return config_.index_angle_rad + (is_forward ? 0.0 : config_.index_width_rad);
}

bool Encoder::is_forward_now() const {
  const std::uint32_t size = shape_.size();
  const double step_rad = size < 2 ? 0.0 : shape_[size - 1].shape_rad - shape_[size - 2].shape_rad;
  return step_rad == 0 ? config_.expected_speed_rad_s > 0 : step_rad > 0;
}

void Encoder::on_pulse(std::int64_t stamp_ns) {
  for (const std::int64_t before_ns : {last_pulse_ns_, pending_pulse_ns_}) {
    if (before_ns == no_stamp_ns) continue;
    if (stamp_ns < before_ns) {
      ++counters_.edges_reordered;
      return;
    }
    if (stamp_ns - before_ns < config_.debounce_ns) {
      ++counters_.index_bounces;
      notices_.raise(NoticeKind::bounce, Severity::info, stamp_ns, "the index pulse bounces",
                     static_cast<std::int64_t>(counters_.index_bounces));
      return;
    }
  }
  if (pending_pulse_ns_ != no_stamp_ns) resolve_pending(true);
  pending_pulse_ns_ = stamp_ns;
  // Where quadrature gives the shape, the count at the pulse is the count now.
  if (config_.shape == AngleShape::quadrature && !shape_.is_empty())
    push_shape(stamp_ns, quadrature_shape_rad());
  if (pending_pulse_ns_ != no_stamp_ns) resolve_pending(false);
}

void Encoder::resolve_pending(bool give_up) {
  const std::int64_t stamp_ns = pending_pulse_ns_;
  double shape_rad = 0;
  if (config_.shape != AngleShape::none && shape_at(stamp_ns, shape_rad)) {
    pending_pulse_ns_ = no_stamp_ns;
    judge_with_shape(stamp_ns, shape_rad);
    return;
  }
  const bool cannot_come =
      config_.shape == AngleShape::none || (!shape_.is_empty() && shape_.newest().stamp_ns > stamp_ns);
  if (!cannot_come && !give_up) return;
  pending_pulse_ns_ = no_stamp_ns;
  judge_by_time(stamp_ns, 0, false);
}

void Encoder::judge_with_shape(std::int64_t stamp_ns, double shape_rad) {
  watch_ratio(stamp_ns, shape_rad);
  if (!reference_.is_known) return take_first(stamp_ns, shape_rad, true);
  if (!reference_.has_shape) return judge_by_time(stamp_ns, shape_rad, true);
  if (stamp_ns <= reference_.stamp_ns) return;
  const bool is_forward = is_forward_now();
  const double way_rad = (shape_rad - reference_.shape_rad) * ratio_;
  const double flank_rad = flank_angle_rad(is_forward);
  const double predicted_rad = reference_.angle_rad + way_rad;
  const std::int64_t turn = std::llround((predicted_rad - flank_rad) / turn_rad);
  const double angle_rad = flank_rad + turn_rad * static_cast<double>(turn);
  const double window_rad =
      std::min(config_.index_window_rad, narrow_window_rad + 5 * predicted_sigma_rad(way_rad));
  const double residual_rad = predicted_rad - angle_rad;
  const bool is_same_flank = is_forward == reference_.is_forward;
  const std::int64_t turns = turn - reference_.turn;
  if (std::abs(residual_rad) > narrow_window_rad && agrees_with_candidate(shape_rad)) {
    // Two pulses that agree with each other and not with the counts: the counts have slipped.
    ++counters_.index_relocks;
    notices_.raise(NoticeKind::relock, Severity::warning, stamp_ns,
                   "the counts slipped against the index, mrad",
                   static_cast<std::int64_t>(residual_rad * 1e3));
    drop_reference();
    return take_first(stamp_ns, shape_rad, true);
  }
  if (std::abs(residual_rad) > window_rad || (turns == 0 && is_same_flank)) {
    return refuse_as_extra(stamp_ns, shape_rad, residual_rad);
  }
  count_missing(turns, stamp_ns);
  const Reference next{true, true, is_forward, stamp_ns, shape_rad, angle_rad, turn, config_.index_sigma_rad};
  share_out(next);
  // One that is well off its place sets the angle; should it be a wrong one, the ratio shall not suffer.
  const bool teaches_ratio = !is_ratio_learned_ || std::abs(residual_rad) <= narrow_window_rad;
  if (turns != 0 && is_same_flank && teaches_ratio) {
    const double measured = (angle_rad - reference_.angle_rad) / (shape_rad - reference_.shape_rad);
    ratio_ = is_ratio_learned_ ? 0.5 * (ratio_ + measured) : measured;
    is_ratio_learned_ = true;
  }
  append(stamp_ns, angle_rad, config_.index_sigma_rad, NodeKind::index);
  take(next);
}

// Counts that waited for this pulse: from the newest node to the pulse, in proportion.
void Encoder::share_out(const Reference& next) {
  double from_angle_rad = reference_.angle_rad;
  double from_shape_rad = reference_.shape_rad;
  std::int64_t from_ns = reference_.stamp_ns;
  if (!history_.is_empty() && history_.newest().stamp_ns > from_ns) {
    from_ns = history_.newest().stamp_ns;
    if (shape_at(from_ns, from_shape_rad)) {
      from_angle_rad = history_.newest().angle_rad;
    } else {
      from_shape_rad = reference_.shape_rad;
    }
  }
  const double whole_rad = next.shape_rad - from_shape_rad;
  if (std::abs(whole_rad) < 1e-9) return;
  const double ratio = (next.angle_rad - from_angle_rad) / whole_rad;
  for (std::uint32_t i = shape_.upper_bound(from_ns); i < shape_.size(); ++i) {
    const ShapeSample sample = shape_[i];
    if (sample.stamp_ns >= next.stamp_ns) break;
    const double way_rad = sample.shape_rad - from_shape_rad;
    const double slip_rad = config_.slip * std::min(std::abs(way_rad), std::abs(whole_rad - way_rad));
    const double sigma_rad =
        portable::hypot(config_.index_sigma_rad, portable::hypot(config_.count_sigma_rad, slip_rad));
    append(sample.stamp_ns, from_angle_rad + way_rad * ratio, sigma_rad, NodeKind::counts);
  }
}

void Encoder::judge_by_time(std::int64_t stamp_ns, double shape_rad, bool has_shape) {
  if (!reference_.is_known) return take_first(stamp_ns, shape_rad, has_shape);
  if (stamp_ns <= reference_.stamp_ns) return;
  const double turns =
      std::abs(config_.expected_speed_rad_s) * seconds(stamp_ns - reference_.stamp_ns) / turn_rad;
  const double whole_turns = std::max(1.0, std::round(std::min(turns, 1e12)));
  const double tolerated = config_.speed_tolerance * whole_turns;
  const bool is_good = std::abs(turns - whole_turns) <= tolerated && (whole_turns == 1 || tolerated < 0.5);
  if (!is_good && turns < 1) return refuse_as_extra(stamp_ns, shape_rad, 0);
  const bool is_forward = config_.expected_speed_rad_s > 0;
  const auto count = static_cast<std::int64_t>(whole_turns);
  const std::int64_t turn = reference_.turn + (is_forward ? count : -count);
  const double angle_rad = flank_angle_rad(is_forward) + turn_rad * static_cast<double>(turn);
  if (is_good) {
    count_missing(count, stamp_ns);
  } else {
    is_break_due_ = true;  // neither one turn at its speed nor several: where it was meanwhile is not known
  }
  append(stamp_ns, angle_rad, config_.index_sigma_rad, NodeKind::index);
  take({true, has_shape, is_forward, stamp_ns, shape_rad, angle_rad, turn, config_.index_sigma_rad});
}

void Encoder::take_first(std::int64_t stamp_ns, double shape_rad, bool has_shape) {
  const bool is_forward = has_shape ? is_forward_now() : config_.expected_speed_rad_s > 0;
  const double flank_rad = flank_angle_rad(is_forward);
  // Where it was, and what it should have turned since: so that a lost angle goes on in its direction.
  double guess_rad = last_known_angle_rad_;
  if (!history_.is_empty()) {
    const AngleNode& last = history_.newest();
    const std::int64_t since_ns = std::max<std::int64_t>(0, stamp_ns - last.stamp_ns);
    guess_rad = last.angle_rad + config_.expected_speed_rad_s * seconds(since_ns);
  }
  const std::int64_t turn = std::llround((guess_rad - flank_rad) / turn_rad);
  const double angle_rad = flank_rad + turn_rad * static_cast<double>(turn);
  reference_ = {true, has_shape, is_forward, stamp_ns, shape_rad, angle_rad, turn, config_.index_sigma_rad};
  if (has_shape) {
    // What came before, back from the pulse.
    const std::int64_t from_ns = history_.is_empty() ? no_stamp_ns : history_.newest().stamp_ns;
    for (std::uint32_t i = shape_.upper_bound(from_ns); i < shape_.size() && shape_[i].stamp_ns < stamp_ns;
         ++i) {
      const double way_rad = (shape_[i].shape_rad - shape_rad) * ratio_;
      append(shape_[i].stamp_ns, angle_rad + way_rad, predicted_sigma_rad(way_rad), NodeKind::counts);
    }
  }
  append(stamp_ns, angle_rad, config_.index_sigma_rad, NodeKind::index);
  take(reference_);
}

void Encoder::take(const Reference& next) {
  reference_ = next;
  last_pulse_ns_ = next.stamp_ns;
  ++counters_.index_pulses;
  has_candidate_ = false;
  if (is_index_lost_)
    notices_.raise(NoticeKind::back, Severity::info, next.stamp_ns, "the index pulses are back");
  is_index_lost_ = false;
  compare_directions(next.stamp_ns);
}

void Encoder::count_missing(std::int64_t turns, std::int64_t stamp_ns) {
  const std::int64_t missing = std::abs(turns) - 1;
  if (missing <= 0) return;
  counters_.index_missing += static_cast<std::uint64_t>(missing);
  notices_.raise(NoticeKind::missing, Severity::warning, stamp_ns, "index pulses were missing", missing);
}

void Encoder::refuse_as_extra(std::int64_t stamp_ns, double shape_rad, double residual_rad) {
  ++counters_.index_extra;
  notices_.raise(NoticeKind::extra, Severity::warning, stamp_ns, "an index pulse came where none was due",
                 static_cast<std::int64_t>(counters_.index_extra));
  if (!reference_.has_shape) return;
  if (is_index_lost_ && is_ratio_learned_) {
    // Pulses come, and for turns none was good: it may be what was learned that is wrong.
    ratio_ = 1;
    is_ratio_learned_ = false;
  }
  has_candidate_ = true;
  candidate_shape_rad_ = shape_rad;
  candidate_residual_rad_ = residual_rad;
}

bool Encoder::agrees_with_candidate(double shape_rad) const {
  if (!has_candidate_) return false;
  const double way_rad = std::abs(shape_rad - candidate_shape_rad_) * ratio_;
  return way_rad > 1 &&
         std::abs(std::remainder(way_rad, turn_rad)) < narrow_window_rad + 5 * slip() * way_rad;
}

// Pulses that come again and again at equal distances are a turn apart, whatever the configuration says.
void Encoder::watch_ratio(std::int64_t stamp_ns, double shape_rad) {
  const double interval_rad = std::abs(shape_rad - seen_pulse_shape_rad_);
  const bool is_equal = std::abs(interval_rad - seen_interval_rad_) < equal_share * seen_interval_rad_;
  equal_intervals_ = is_equal ? equal_intervals_ + 1 : 0;
  seen_pulse_shape_rad_ = shape_rad;
  seen_interval_rad_ = interval_rad;
  if (equal_intervals_ < intervals_to_doubt_ratio ||
      std::abs(interval_rad - turn_rad) < equal_share * turn_rad)
    return;
  const double counts_per_turn = config_.shape == AngleShape::quadrature ? config_.quadrature_counts_per_turn
                                                                         : config_.drive_counts_per_turn;
  notices_.raise(
      NoticeKind::ratio, Severity::error, stamp_ns,
      "index pulses do not come a turn apart; is counts_per_turn right? Counts between the last two",
      static_cast<std::int64_t>(std::min(interval_rad / turn_rad * counts_per_turn, 1e15)));
}

void Encoder::compare_directions(std::int64_t stamp_ns) {
  if (config_.shape != AngleShape::quadrature || !has_position_ || config_.drive_counts_per_turn <= 0) return;
  const double drive_rad = drive_shape_rad() - drive_shape_at_pulse_rad_;
  const double quadrature_rad = quadrature_shape_rad() - quadrature_shape_at_pulse_rad_;
  const bool is_turn = std::min(std::abs(drive_rad), std::abs(quadrature_rad)) > 1;
  if (has_shapes_at_pulse_ && is_turn && (drive_rad > 0) != (quadrature_rad > 0)) {
    ++counters_.quadrature_against_drive;
    notices_.raise(NoticeKind::quadrature, Severity::error, stamp_ns,
                   "quadrature and drive turn in opposite directions: A and B are swapped");
  }
  has_shapes_at_pulse_ = true;
  drive_shape_at_pulse_rad_ = drive_shape_rad();
  quadrature_shape_at_pulse_rad_ = quadrature_shape_rad();
}

}  // namespace alces
