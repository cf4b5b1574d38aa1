// Poses of one frame in another over time, as odometry or /tf have them, asked for at any time between.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "alces/pose.h"

namespace alces::offline {

/// A stamp in seconds, as near as a double comes to it: the text of the same stamp gives the same double.
[[nodiscard]] double stamp_in_s(std::int64_t stamp_ns);

/// Memory: 72 bytes a pose, most_poses at most: of a longer track every second pose stays, then every fourth,
/// and so on.
class PoseTrack {
 public:
  static constexpr std::size_t most_poses = 500'000;
  static constexpr std::int64_t largest_gap_ns = 1'000'000'000;  ///< that is bridged
  /// How far beyond its ends, and how far a sample may be off to be taken as it is.
  static constexpr std::int64_t largest_overhang_ns = 20'000'000;
  static constexpr std::int64_t same_time_ns = 1'000;

  /// In any order of time. A pose that is none (not finite, no rotation) is not taken: false.
  bool add(std::int64_t stamp_ns, const Pose& pose);
  /// Sorts; of poses of one time the first stays. Before at() and after the last add().
  void settle();
  void shift(std::int64_t by_ns);

  /// None: before or after all poses, or in a gap.
  [[nodiscard]] std::optional<Pose> at(std::int64_t stamp_ns) const;

  struct Sample {
    std::int64_t stamp_ns = 0;
    Pose pose;
  };
  [[nodiscard]] const std::vector<Sample>& samples() const { return samples_; }
  [[nodiscard]] bool is_empty() const { return samples_.empty(); }
  [[nodiscard]] bool is_thinned() const { return stride_ > 1; }
  [[nodiscard]] std::uint64_t refused() const { return refused_; }

 private:
  std::vector<Sample> samples_;
  std::uint64_t stride_ = 1;
  std::uint64_t offered_ = 0;
  std::uint64_t refused_ = 0;
};

}  // namespace alces::offline
