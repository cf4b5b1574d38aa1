// What /tf and /tf_static say: where frames are in each other, at any time.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "alces/pose.h"
#include "pose_track.h"

namespace alces::offline {

class FrameTree {
 public:
  static constexpr std::size_t most_frames = 256;

  /// `is_static`: true for all times. False: more frames than most_frames, or a pose that is none.
  bool add(const std::string& parent, const std::string& child, std::int64_t stamp_ns,
           const Pose& parent_from_child, bool is_static);
  /// Sorts the moving ones. Before all that follows, and after the last add().
  void settle();
  /// Of all moving frames.
  void shift(std::int64_t by_ns);

  [[nodiscard]] bool has(const std::string& frame) const;
  /// `frame` first, then its parent, to the root.
  [[nodiscard]] std::vector<std::string> way_up(const std::string& frame) const;
  /// Whether the frame moves against its parent.
  [[nodiscard]] bool moves(const std::string& frame) const;
  [[nodiscard]] bool are_connected(const std::string& a, const std::string& b) const;
  /// Whether nothing moves between them; false where they are not connected.
  [[nodiscard]] bool are_rigid(const std::string& a, const std::string& b) const;

  /// a_from_b; none: not connected, or not at that time. Identity for a frame and itself.
  [[nodiscard]] std::optional<Pose> between(const std::string& a, const std::string& b,
                                            std::int64_t stamp_ns) const;

  struct Edge {
    std::string parent;
    bool is_static = false;
    Pose parent_from_child;  ///< of a static one
    PoseTrack track;         ///< of a moving one
  };
  /// By the child's name.
  [[nodiscard]] const std::map<std::string, Edge>& edges() const { return edges_; }
  [[nodiscard]] std::uint64_t parents_changed() const { return parents_changed_; }

 private:
  std::map<std::string, Edge> edges_;
  std::uint64_t parents_changed_ = 0;
};

}  // namespace alces::offline
