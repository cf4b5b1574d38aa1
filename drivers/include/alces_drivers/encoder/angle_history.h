// What is known of the head's angle: nodes in time that are written once and never changed, and the way
// between two of them, a straight line.
//
// The line is wrong by at most a/2 (t - t0)(t1 - t) where the head's acceleration stays below a, and by at
// most r min(t - t0, t1 - t) where its speed stays within r of the mean: the smaller of both is added to the
// nodes' sigma.
//
// Memory: 24 bytes a node.
#pragma once

#include <cstdint>

#include "alces_drivers/encoder/head_angle.h"
#include "alces_drivers/stamp_ring.h"

namespace alces {

struct AngleNode {
  std::int64_t stamp_ns = 0;
  double angle_rad = 0;
  float sigma_rad = 0;
  bool is_connected = false;  ///< the way from the node before is known
  bool is_extrapolated = false;
};

/// How steadily the head turns.
struct HeadSmoothness {
  double acceleration_rad_s2 = 2;    ///< at most, while it runs
  double speed_ripple_rad_s = 0.03;  ///< deviation of the speed from its mean over a turn
};

class AngleHistory {
 public:
  static constexpr std::uint32_t capacity = 2048;

  explicit AngleHistory(const HeadSmoothness& smoothness) : smoothness_(smoothness) {}

  /// False, and nothing happens, when the node is not after the newest one.
  bool append(const AngleNode& node);
  void clear() { nodes_.clear(); }

  [[nodiscard]] bool is_empty() const { return nodes_.is_empty(); }
  [[nodiscard]] const AngleNode& newest() const { return nodes_.newest(); }

  /// ok; too_old before the oldest node; lost where the way is not known; not_yet after the newest node.
  [[nodiscard]] AngleAnswer at(std::int64_t stamp_ns) const;

  /// Mean speed over at least `span_ns` back from the newest node, or over what there is of it without a
  /// break (false: a single node).
  [[nodiscard]] bool speed(std::int64_t span_ns, double& speed_rad_s) const;

 private:
  StampRing<AngleNode, capacity> nodes_;
  HeadSmoothness smoothness_;
};

}  // namespace alces
