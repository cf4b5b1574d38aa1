// Where a motor's shaft is at any time: constant acceleration from one speed to the next, in closed form.
// Asked for the same time it gives the same answer, however often and in whatever order it is asked.
#pragma once

#include <cstdint>
#include <deque>

namespace alces::sim {

/// Positions in counts, speeds in counts/s, accelerations in counts/s^2 (positive).
class ShaftMotion {
 public:
  explicit ShaftMotion(double position_counts = 0) { segments_.push_back({0, position_counts, 0, 0}); }

  /// From now on towards `target`: away from standstill with `acceleration`, towards it with `deceleration`,
  /// through standstill when the direction changes. What was planned after now is forgotten; times run
  /// forward.
  void ramp_to(std::int64_t now_ns, double target, double acceleration, double deceleration);

  /// At once: something holds the shaft, or it slips.
  void jump_to(std::int64_t now_ns, double speed);

  [[nodiscard]] double position_counts(std::int64_t at_ns) const;
  [[nodiscard]] double speed_counts_per_s(std::int64_t at_ns) const;
  /// When the last speed asked for is reached; from then on it stays.
  [[nodiscard]] std::int64_t end_ns() const { return segments_.back().begin_ns; }
  [[nodiscard]] double final_speed() const { return segments_.back().speed; }

 private:
  struct Segment {
    std::int64_t begin_ns;
    double position;
    double speed;
    double acceleration;
  };

  [[nodiscard]] const Segment& segment_at(std::int64_t at_ns) const;
  void forget_after(std::int64_t now_ns);
  void append(std::int64_t begin_ns, double speed, double acceleration);

  std::deque<Segment> segments_;  ///< the last has no acceleration; before the first the shaft stood still
};

}  // namespace alces::sim
