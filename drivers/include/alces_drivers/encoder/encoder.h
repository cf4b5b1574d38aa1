// The head's angle at any past time: one angle out of index pulses, counts and time.
//
// Three kinds of knowledge go in, any of which may be absent:
//   index pulse     one edge a turn on a GPIO line, sharp to microseconds: where the head is, absolutely
//   counts          the drive's position (CiA 402 object 0x6064 in a TPDO, 32 bits, wraps), or quadrature
//                   on two GPIO lines: how it turned in between. Their zero means nothing, and they may
//                   creep (belt, slip)
//   expected speed  which way it should turn and how fast: to judge the others, and to bridge with
//
//   index and counts  the shape of the turn from the counts, its ends from the pulses. The ratio of angle
//                     to counts is learned from the turns before (`wait_for_index` false), or is this
//                     turn's own: the answer waits for the pulse that ends the turn (true), and creep is
//                     shared out over the turn in proportion
//   index alone       constant speed between pulses; an answer waits for the next pulse
//   counts alone      angle relative to the first count; the uncertainty grows with the way turned
//
// What was answered as ok never changes: nodes of the angle (angle_history.h) are written once, in order of
// time. What a later pulse tells corrects only the time after the newest node: the head's angle then makes up
// the difference by the next node (5 to 20 ms), and sigma before the pulse said that it could be so.
//
// Judged: pulses that bounce (debounce_ns), come where none is due (extra), or stay away (missing); a head
// that turns back, stands, or leaves its speed; A and B swapped; counts that jump (the drive was reset),
// stand still or come in the wrong order; edges that the kernel lost; stamps that cannot be. All are counted;
// people hear of them at once, and while they go on after 1, 2, 4, ... 64 s (notice_rate_limiter.h). After
// each of them the next good pulse brings the angle back.
//
// The profile-sync line is counted and its last stamp kept. It does not refine the rays' times: the laser
// drivers' filter of delays does that, and a head with such a line can check it by last_sync_stamp_ns().
//
// Memory: about 65 KiB in the object. on_...: O(1), O(counts of a turn) at a pulse; angle_at: O(log
// capacity).
#pragma once

#include <array>
#include <cstdint>

#include "alces_drivers/encoder/angle_history.h"
#include "alces_drivers/encoder/edge.h"
#include "alces_drivers/encoder/head_angle.h"
#include "alces_drivers/encoder/quadrature.h"
#include "alces_drivers/notice_rate_limiter.h"
#include "alces_drivers/stamp.h"

namespace alces {

/// Where the shape of a turn comes from.
enum class AngleShape : std::uint8_t { none, drive, quadrature };

struct EncoderConfig {
  static constexpr std::uint8_t no_line = 255;

  std::uint8_t index_line = 0;
  std::uint8_t a_line = no_line;
  std::uint8_t b_line = no_line;
  std::uint8_t sync_line = no_line;

  bool index_is_rising = true;  ///< the edge that counts when the head turns in its positive direction
  double index_angle_rad = 0;   ///< the head's angle at that edge; of counts alone: at the first count
  double index_width_rad = 0;  ///< from that edge to the pulse's other flank, which counts when it turns back
  double index_sigma_rad = 2e-4;  ///< of the mark, and of the edge's stamp times the speed
  std::int64_t debounce_ns = 20 * ns_per_ms;
  double index_window_rad =
      0.15;  ///< a pulse farther from where the counts expect it is not believed at once

  AngleShape shape = AngleShape::drive;
  std::int8_t drive_direction = 1;        ///< -1: the drive's counts fall when the head's angle grows
  double drive_counts_per_turn = 0;       ///< of the head, gear included; 0: the drive's position is not used
  std::int8_t quadrature_direction = 1;   ///< -1: B leads A when the head's angle grows
  double quadrature_counts_per_turn = 0;  ///< quarter steps: four a line of the disc
  double count_sigma_rad = 3e-4;          ///< of a count's time and rounding, as an angle
  double slip = 1e-3;  ///< radians that the counts may creep a radian, once the ratio is learned
  std::int64_t drive_latency_ns = 0;  ///< a position is that much older than its stamp

  double expected_speed_rad_s =
      2.618;  ///< negative: the head turns in its negative direction (half a turn in 1.2 s)
  double speed_tolerance = 0.2;  ///< of it
  HeadSmoothness smoothness;

  bool wait_for_index = false;
  std::int64_t node_interval_ns = 5 * ns_per_ms;   ///< counts that come faster are downsampled
  std::int64_t maximum_gap_ns = 250 * ns_per_ms;   ///< between counts; a longer one is bridged by pulses only
  std::int64_t maximum_wait_ns = 400 * ns_per_ms;  ///< for what comes after; then it is done without. With
                                                   ///< wait_for_index or without counts: more than a turn
  std::int64_t maximum_extrapolation_ns = 200 * ns_per_ms;  ///< past the last reference; then lost
  double maximum_sigma_rad = 0.1;                           ///< a worse angle is lost
};

/// Null, or one clause that names the value that cannot be.
[[nodiscard]] const char* validate(const EncoderConfig& config);

struct EncoderCounters {
  std::uint64_t edges = 0;
  std::uint64_t edges_of_other_lines = 0;
  std::uint64_t edges_lost = 0;       ///< as far as the kernel tells how many
  std::uint64_t edge_losses = 0;      ///< times that it lost some
  std::uint64_t edges_reordered = 0;  ///< before the last one of their line
  std::uint64_t stamps_absurd = 0;
  std::uint64_t clock_steps = 0;   ///< time ran back by seconds: begun anew
  std::uint64_t index_pulses = 0;  ///< taken as references
  std::uint64_t index_bounces = 0;
  std::uint64_t index_extra = 0;
  std::uint64_t index_missing = 0;
  std::uint64_t index_relocks = 0;  ///< the counts had slipped: the pulses were believed
  std::uint64_t index_losses = 0;   ///< times that pulses stayed away for more than two and a half turns
  std::uint64_t sync_pulses = 0;
  std::uint64_t quadrature_repeats = 0;        ///< the same edge twice
  std::uint64_t quadrature_against_drive = 0;  ///< turns in which A/B and the drive disagree on the direction
  std::uint64_t positions = 0;
  std::uint64_t positions_reordered = 0;
  std::uint64_t positions_duplicated = 0;
  std::uint64_t position_jumps = 0;
  std::uint64_t position_gaps = 0;  ///< longer than maximum_gap_ns
  std::uint64_t reversals = 0;
  std::uint64_t speed_excursions = 0;  ///< times that the speed left its tolerance
  std::uint64_t angles_extrapolated = 0;
  std::uint64_t history_breaks = 0;  ///< stretches of time whose angle is lost

  template <class Visitor>
  void visit(Visitor&& visit) const {
    visit("edges", edges);
    visit("edges_of_other_lines", edges_of_other_lines);
    visit("edges_lost", edges_lost);
    visit("edge_losses", edge_losses);
    visit("edges_reordered", edges_reordered);
    visit("stamps_absurd", stamps_absurd);
    visit("clock_steps", clock_steps);
    visit("index_pulses", index_pulses);
    visit("index_bounces", index_bounces);
    visit("index_extra", index_extra);
    visit("index_missing", index_missing);
    visit("index_relocks", index_relocks);
    visit("index_losses", index_losses);
    visit("sync_pulses", sync_pulses);
    visit("quadrature_repeats", quadrature_repeats);
    visit("quadrature_against_drive", quadrature_against_drive);
    visit("positions", positions);
    visit("positions_reordered", positions_reordered);
    visit("positions_duplicated", positions_duplicated);
    visit("position_jumps", position_jumps);
    visit("position_gaps", position_gaps);
    visit("reversals", reversals);
    visit("speed_excursions", speed_excursions);
    visit("angles_extrapolated", angles_extrapolated);
    visit("history_breaks", history_breaks);
  }
};

class Encoder final : public HeadAngle {
 public:
  /// The configuration must be one that validate() finds nothing wrong with.
  Encoder(const EncoderConfig& config, NoticePort& notices);

  void on_edge(const GpioEdge& edge, std::int64_t stamp_ns);
  /// `count` edges are missing from the lines, 0: nobody knows how many.
  void on_edges_lost(std::uint32_t count, std::int64_t stamp_ns);
  void on_drive_position(std::int32_t counts, std::int64_t stamp_ns);
  /// At least every 20 ms. `now_ns` is the time that answers are waited for by.
  void on_tick(std::int64_t now_ns);

  [[nodiscard]] AngleAnswer angle_at(std::int64_t stamp_ns) const override;

  /// The newest speed, and whether there is one.
  [[nodiscard]] bool speed(double& speed_rad_s) const;
  [[nodiscard]] bool is_speed_in_tolerance() const { return speed_state_ == SpeedState::inside; }
  /// An index pulse tells where the head is (without an index line: a count came).
  [[nodiscard]] bool is_referenced() const { return reference_.is_known; }
  [[nodiscard]] std::int64_t last_index_stamp_ns() const { return last_pulse_ns_; }
  [[nodiscard]] std::int64_t last_sync_stamp_ns() const { return last_sync_ns_; }

  [[nodiscard]] const EncoderCounters& counters() const { return counters_; }
  [[nodiscard]] const EncoderConfig& config() const { return config_; }

 private:
  static constexpr std::uint32_t shape_capacity = 1024;

  enum class NoticeKind : std::uint8_t {
    edges_lost,
    back,
    bounce,
    extra,
    missing,
    loss,
    relock,
    quadrature,
    jump,
    gap,
    reversal,
    speed,
    clock,
    ratio,
    count
  };
  enum class SpeedState : std::uint8_t { unknown, inside, outside };
  enum class NodeKind : std::uint8_t { counts, index, extrapolated };

  /// The shape: an angle whose zero means nothing, from the counts.
  struct ShapeSample {
    std::int64_t stamp_ns = 0;
    double shape_rad = 0;
  };
  struct Reference {
    bool is_known = false;
    bool has_shape = false;  ///< shape_rad is known too
    bool is_forward = true;  ///< which flank it was
    std::int64_t stamp_ns = no_stamp_ns;
    double shape_rad = 0;
    double angle_rad = 0;
    std::int64_t turn = 0;  ///< angle = flank's angle + 2 pi turn
    double sigma_rad = 0;
  };

  // encoder.cpp: what comes in, time, nodes
  [[nodiscard]] bool is_stamp_good(std::int64_t stamp_ns);
  void begin_anew();
  void on_quadrature_edge(Quadrature::Line line, const GpioEdge& edge, std::int64_t stamp_ns);
  void note_sequence(std::size_t slot, const GpioEdge& edge, std::int64_t stamp_ns);
  void count_lost(std::uint32_t count, std::int64_t stamp_ns);
  void break_quadrature();
  void push_shape(std::int64_t stamp_ns, double shape_rad);
  void drop_reference();
  [[nodiscard]] bool shape_at(std::int64_t stamp_ns, double& shape_rad) const;
  void append(std::int64_t stamp_ns, double angle_rad, double sigma_rad, NodeKind kind);
  void append_predicted(const ShapeSample& sample);
  void append_predicted_until(std::int64_t stamp_ns);
  void extrapolate_until(std::int64_t stamp_ns);
  void watch_speed(std::int64_t stamp_ns);
  void watch_index(std::int64_t stamp_ns);
  [[nodiscard]] bool is_speed_plausible(double speed_rad_s) const;
  /// What the counts may creep a radian, as far as their ratio to the angle is known.
  [[nodiscard]] double slip() const;
  [[nodiscard]] double predicted_sigma_rad(double way_rad) const;
  [[nodiscard]] double quadrature_shape_rad() const;
  [[nodiscard]] double drive_shape_rad() const;
  [[nodiscard]] double sign() const { return config_.expected_speed_rad_s < 0 ? -1.0 : 1.0; }
  [[nodiscard]] bool has_index() const { return config_.index_line != EncoderConfig::no_line; }

  // encoder_index.cpp: pulses are judged
  void on_pulse(std::int64_t stamp_ns);
  void resolve_pending(bool give_up);
  void judge_with_shape(std::int64_t stamp_ns, double shape_rad);
  void judge_by_time(std::int64_t stamp_ns, double shape_rad, bool has_shape);
  void take_first(std::int64_t stamp_ns, double shape_rad, bool has_shape);
  void take(const Reference& next);
  void share_out(const Reference& next);
  void refuse_as_extra(std::int64_t stamp_ns, double shape_rad, double residual_rad);
  void count_missing(std::int64_t turns, std::int64_t stamp_ns);
  [[nodiscard]] bool agrees_with_candidate(double shape_rad) const;
  void watch_ratio(std::int64_t stamp_ns, double shape_rad);
  void compare_directions(std::int64_t stamp_ns);
  [[nodiscard]] double flank_angle_rad(bool is_forward) const;
  [[nodiscard]] bool is_forward_now() const;

  EncoderConfig config_;
  NoticeRateLimiter<NoticeKind> notices_;
  EncoderCounters counters_;

  std::int64_t now_ns_ = no_stamp_ns;
  std::int64_t ticked_ns_ = no_stamp_ns;

  AngleHistory history_;
  StampRing<ShapeSample, shape_capacity> shape_;
  bool is_break_due_ = false;                     ///< the way to the next node is not known
  std::int64_t last_real_node_ns_ = no_stamp_ns;  ///< the newest that is not extrapolated
  double last_real_sigma_rad_ = 0;
  double ratio_ = 1;  ///< head's angle to shape's
  bool is_ratio_learned_ = false;
  Reference reference_;
  double last_known_angle_rad_ = 0;  ///< where a lost angle is taken up again
  double last_known_sigma_rad_ = 0;  ///< of a relative angle, which no pulse can repair

  // Index line.
  std::int64_t last_pulse_ns_ = no_stamp_ns;
  std::int64_t pending_pulse_ns_ = no_stamp_ns;  ///< waits for the counts after it
  bool has_candidate_ = false;  ///< a pulse that was not believed, in case that the next one agrees with it
  double candidate_shape_rad_ = 0;
  double candidate_residual_rad_ = 0;
  double seen_pulse_shape_rad_ = 0;  ///< of any pulse, believed or not
  double seen_interval_rad_ = 0;
  std::uint32_t equal_intervals_ = 0;
  bool is_index_lost_ = false;

  std::int64_t last_sync_ns_ = no_stamp_ns;

  // Counts.
  bool has_position_ = false;
  std::int32_t last_position_ = 0;
  std::int64_t last_position_ns_ = no_stamp_ns;
  std::int64_t drive_counts_ = 0;  ///< unwrapped, jumps left out
  double drive_shape_at_pulse_rad_ = 0;
  double quadrature_shape_at_pulse_rad_ = 0;
  bool has_shapes_at_pulse_ = false;
  Quadrature quadrature_;
  std::int64_t quadrature_counts_ = 0;
  std::int64_t last_quadrature_ns_ = no_stamp_ns;
  std::array<std::uint32_t, 4> last_sequence_{};  ///< index, a, b, sync

  SpeedState speed_state_ = SpeedState::unknown;
  bool is_reversed_ = false;
  std::int64_t speed_watched_ns_ = no_stamp_ns;
};

}  // namespace alces
