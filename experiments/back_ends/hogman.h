// HOG-Man: hierarchical optimisation on the manifold of poses, in one go or while a graph grows.
// From: Grisetti, Kuemmerle, Stachniss, Frese, Hertzberg, "Hierarchical optimization on manifolds for online
// 2D and 3D mapping", ICRA 2010.
//
// The graph is seen on several levels. On each, vertices are put together in small connected groups; a group
// is one vertex of the level above, which stands where the group's first member, its representative, does.
// Two groups that a constraint joins are joined above: the measurement is where optimising the two groups
// alone puts the one representative as seen from the other, the information is what that leaves known of it.
// All optimising is Gauss-Newton on the manifold with a sparse Cholesky factorisation (gauss_newton.h).
//
// While a graph grows, update() brings the measurements up to date that something new belongs to, optimises
// the highest level, and goes down only where a group has moved: its members follow rigidly, and are then
// optimised between the representatives, which stay. refine() does what an end result needs: every level in
// full, from the top down, each starting from the one above.
//
// A group's inner constraints count for each of its joints above, as published: higher levels are too sure,
// and only refine() reaches the optimum of all constraints.
//
// Cost: building is O(n + m) small problems; update() the highest level and what changed; refine() as
// Gauss-Newton, a few iterations of it. Memory: about 700 bytes a constraint and 300 a vertex beside the
// systems. One thread; equal graphs give equal bits.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "offline/optimize/graph/constraint_graph.h"

namespace alces::offline {

struct HogManSettings {
  std::uint32_t most_levels = 8;     ///< with the graph itself; 1 is plain Gauss-Newton
  std::uint32_t top_vertices = 250;  ///< a level of more gets another one above it
  std::uint32_t group_radius = 2;    ///< constraints from a representative to its members, at most
  std::uint32_t top_iterations = 10;
  std::uint32_t local_iterations = 3;    ///< of members between representatives
  std::uint32_t refine_iterations = 30;  ///< of the graph itself, in refine(); 0 leaves it out
  /// A group that has moved less is left as it is, and all below it.
  double least_motion_m = 0.01;
  double least_rotation_rad = 0.002;
};

struct HogManResult {
  std::uint32_t iterations = 0;  ///< of the graph itself
  double chi_squared_before = 0;
  double chi_squared = 0;                     ///< at the end
  bool stopped = false;                       ///< by stop_requested
  std::vector<std::uint32_t> level_vertices;  ///< from the graph itself up
};

struct HogManCallbacks {
  std::function<void(std::uint32_t done, std::uint32_t total)> progress;  ///< iterations and levels
  std::function<bool()> stop_requested;  ///< asked now and then; the graph stays whole
};

/// In one go: all levels, then refine(). Fixed vertices keep their poses; where none is, the first does.
/// InputError: the graph falls apart, or holds NaN. CapacityError: memory does not suffice.
HogManResult optimize_hogman(ConstraintGraph& graph, const HogManSettings& settings = {},
                             const HogManCallbacks& callbacks = {});

/// A graph that grows, vertex by vertex and constraint by constraint.
class HogMan {
 public:
  HogMan(bool is_planar, const HogManSettings& settings);
  ~HogMan();
  HogMan(HogMan&&) noexcept;
  HogMan& operator=(HogMan&&) noexcept;

  /// Appends; a constraint's vertices must be there.
  void add_vertex(const ConstraintVertex& vertex);
  void add_constraint(const Constraint& constraint);

  /// Takes in what was added since the last update and optimises as far as that requires. InputError: what
  /// is there does not hang together (the graph stays as it was).
  void update();

  /// Every level in full. Returns the iterations that the graph itself took.
  std::uint32_t refine(const HogManCallbacks& callbacks = {});

  /// The poses as they are now.
  [[nodiscard]] const ConstraintGraph& graph() const;
  [[nodiscard]] std::vector<std::uint32_t> level_vertices() const;

 private:
  friend HogManResult optimize_hogman(ConstraintGraph& graph, const HogManSettings& settings,
                                      const HogManCallbacks& callbacks);
  class Hierarchy;
  std::unique_ptr<Hierarchy> hierarchy_;
};

}  // namespace alces::offline
