#include "frame_tree.h"

#include <algorithm>

namespace alces::offline {

bool FrameTree::add(const std::string& parent, const std::string& child, std::int64_t stamp_ns,
                    const Pose& parent_from_child, bool is_static) {
  auto found = edges_.find(child);
  if (found == edges_.end()) {
    if (edges_.size() >= most_frames || parent == child) return false;
    found = edges_.emplace(child, Edge{parent, is_static, {}, {}}).first;
  }
  Edge& edge = found->second;
  if (edge.parent != parent) {  // two publishers that do not agree: the first stays
    ++parents_changed_;
    return false;
  }
  if (!is_static) {
    edge.is_static = false;
    return edge.track.add(stamp_ns, parent_from_child);
  }
  PoseTrack checked;
  if (!checked.add(stamp_ns, parent_from_child)) return false;
  edge.parent_from_child = checked.samples().front().pose;
  return true;
}

void FrameTree::settle() {
  for (auto& [child, edge] : edges_) edge.track.settle();
}

void FrameTree::shift(std::int64_t by_ns) {
  for (auto& [child, edge] : edges_) edge.track.shift(by_ns);
}

bool FrameTree::has(const std::string& frame) const {
  return edges_.contains(frame) || std::any_of(edges_.begin(), edges_.end(),
                                               [&](const auto& each) { return each.second.parent == frame; });
}

std::vector<std::string> FrameTree::way_up(const std::string& frame) const {
  std::vector<std::string> way = {frame};
  for (auto at = edges_.find(frame); at != edges_.end(); at = edges_.find(way.back())) {
    if (std::find(way.begin(), way.end(), at->second.parent) != way.end()) break;  // a circle
    way.push_back(at->second.parent);
  }
  return way;
}

bool FrameTree::moves(const std::string& frame) const {
  const auto found = edges_.find(frame);
  return found != edges_.end() && !found->second.is_static;
}

bool FrameTree::are_connected(const std::string& a, const std::string& b) const {
  return way_up(a).back() == way_up(b).back();
}

bool FrameTree::are_rigid(const std::string& a, const std::string& b) const {
  if (a == b) return true;
  if (!are_connected(a, b)) return false;
  const std::vector<std::string> up_a = way_up(a);
  const std::vector<std::string> up_b = way_up(b);
  const auto is_still = [&](const std::vector<std::string>& way, const std::vector<std::string>& other) {
    for (const std::string& frame : way) {
      if (std::find(other.begin(), other.end(), frame) != other.end()) return true;  // from here on common
      if (moves(frame)) return false;
    }
    return true;
  };
  return is_still(up_a, up_b) && is_still(up_b, up_a);
}

std::optional<Pose> FrameTree::between(const std::string& a, const std::string& b,
                                       std::int64_t stamp_ns) const {
  if (a == b) return Pose{};
  const std::vector<std::string> up_a = way_up(a);
  const std::vector<std::string> up_b = way_up(b);
  if (up_a.back() != up_b.back()) return std::nullopt;
  /// common_from_frame, up to the first frame that the other way has, too
  const auto climb = [&](const std::vector<std::string>& way,
                         const std::vector<std::string>& other) -> std::optional<Pose> {
    std::optional<Pose> from_start;
    for (const std::string& frame : way) {
      if (std::find(other.begin(), other.end(), frame) != other.end()) return from_start.value_or(Pose{});
      const Edge& edge = edges_.at(frame);
      const std::optional<Pose> step = edge.is_static ? edge.parent_from_child : edge.track.at(stamp_ns);
      if (!step) return std::nullopt;
      from_start = from_start ? *step * *from_start : *step;
    }
    return std::nullopt;
  };
  const std::optional<Pose> common_from_a = climb(up_a, up_b);
  const std::optional<Pose> common_from_b = climb(up_b, up_a);
  if (!common_from_a || !common_from_b) return std::nullopt;
  const bool a_is_common = std::find(up_b.begin(), up_b.end(), a) != up_b.end();
  return a_is_common ? *common_from_b : common_from_a->inverse() * *common_from_b;
}

}  // namespace alces::offline
