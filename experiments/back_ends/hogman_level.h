// One level of HOG-Man's hierarchy: a graph, and how its vertices are put together in groups, each of which
// is a vertex of the level above. See hogman.h.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "offline/optimize/graph/constraint_graph.h"

namespace alces::offline {

class HogManLevel {
 public:
  explicit HogManLevel(bool is_planar) { graph_.is_planar = is_planar; }

  void add_vertex(const ConstraintVertex& vertex);
  /// Returns its position.
  std::uint32_t add_constraint(const Constraint& constraint);

  /// Puts new vertices into groups of up to `radius` constraints around their representatives, and brings the
  /// measurements of `above` up to date wherever constraints here are new or have changed.
  void lift(HogManLevel& above, std::uint32_t radius);

  /// Moves the groups to where `above` says that they are, if that is at least so far from where they are or
  /// if they have something new, and optimises their members between the representatives. Returns how many
  /// groups that were.
  std::size_t settle(const HogManLevel& above, double least_motion_m, double least_rotation_rad,
                     std::uint32_t iterations);

  /// The groups of `above` stand again where their representatives do.
  void raise_poses(HogManLevel& above) const;

  [[nodiscard]] ConstraintGraph& graph() { return graph_; }
  [[nodiscard]] const ConstraintGraph& graph() const { return graph_; }

 private:
  void group(std::uint32_t vertex, HogManLevel& above, std::uint32_t radius);
  [[nodiscard]] std::uint32_t joint(HogManLevel& above, std::uint32_t a, std::uint32_t b) const;
  void measure(Constraint& joint);
  void optimize_members(const std::vector<std::uint32_t>& groups, std::uint32_t iterations);
  [[nodiscard]] std::uint32_t other_end(std::uint32_t constraint, std::uint32_t vertex) const {
    return graph_.constraints[constraint].from == vertex ? graph_.constraints[constraint].to
                                                         : graph_.constraints[constraint].from;
  }

  ConstraintGraph graph_;
  std::vector<std::vector<std::uint32_t>> constraints_of_;  // of each vertex
  std::vector<std::uint32_t> news_;                         // constraints that are new or have changed

  // Of each vertex, as far as grouped.
  std::vector<std::uint32_t> group_of_;
  std::vector<std::uint32_t> radius_of_;  // constraints to the representative
  // Of each group.
  std::vector<std::vector<std::uint32_t>> members_;  // in the order they came; the first is representative
  std::vector<bool> has_news_;

  std::vector<std::uint32_t> place_;  // of each vertex in the small graph at hand; no_index in between
};

}  // namespace alces::offline
