// LOA, the loop optimizer: how much of a closed loop's offset each vertex of the pose graph takes.
// Paper: section 3.5, Algorithm 1, Equation (1), Figures 5 to 7.
//
// A run splits the part of the graph that is connected to f and l into
//
// - trails: ways between two vertices whose weights are already known (at first f: 0 and l: 1), the shortest
//   first; inside a trail the weight is interpolated by the distance along it;
// - branches: what hangs on the trails by one vertex only, be it a tree or has it cycles of its own; it takes
//   the weight of that vertex, its root.
//
// Vertices that are not connected to f and l belong to neither and have weight 0.
//
// Where the paper starts Dijkstra from every member of Omega in every round, this
//   - contracts the chains of degree-2 vertices between junctions once, for all four costs, in O(n + m);
//   - searches from all of Omega at once: every junction knows its nearest member of Omega, and the cheapest
//     chain between two regions is the middle of the overall shortest path;
//   - never starts anew: removing a path turns its inner junctions into members of Omega, so that distances
//     only ever fall, and the search goes on from the new members (why: loop_optimizer.cpp).
// The result is the paper's. Ties are broken by the order of the graph's vertices and edges: equal graphs
// give equal bits.
//
// Cost: prepare O(n + m); a run O(n) to write the weights plus, with j junctions (j <= 2 loops + tree ends),
// O(j log j) when the search is local and at worst O(j log j) for each trail.
// Memory: 76 bytes a vertex and 126 bytes an edge of the capacity.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "alces/arena.h"
#include "alces/pose_graph.h"
#include "alces/status.h"

namespace alces {

/// Which part of an edge's EdgeVariance a run takes for its cost: translation along one of the axes of f's
/// body, as the offset of the loop is seen, or rotation. A variance outside [1e-150, 1e150] counts as the
/// nearer of these bounds, so that no sum overflows.
enum class LoopCost : std::uint8_t { x, y, z, rotation };

class LoopOptimizer {
 public:
  /// One edge of a trail: `half_edge` of the PoseGraph (edge half_edge / 2, see pose_graph.h for its
  /// direction) leads to `vertex`.
  struct TrailStep {
    std::uint32_t half_edge = 0;
    std::uint32_t vertex = 0;
  };

  /// From vertex `start` to vertex `end`, both of which have their weight from earlier trails (or are f and
  /// l); the vertices between get theirs here. start != end.
  struct Trail {
    std::uint32_t start = 0;
    std::uint32_t end = 0;
    std::uint32_t first_step = 0;
    std::uint32_t step_count = 0;
  };

  /// `half_edge` leads from `parent` to `vertex`; `root` is the vertex on a trail whose weight all of the
  /// branch takes.
  struct BranchVertex {
    std::uint32_t vertex = 0;
    std::uint32_t parent = 0;
    std::uint32_t half_edge = 0;
    std::uint32_t root = 0;
  };

  /// For graphs of up to `capacity`.
  // The capacities suffice for any graph: every edge lies in exactly one chain and every chain in at most one
  // trail, so steps, chains, the chains of all trails and trails are no more than edges; junctions and
  // branch vertices are distinct vertices; a heap holds a junction or a chain at most once.
  constexpr LoopOptimizer(Arena& arena, const PoseGraph::Capacity& capacity)
      : junction_of_vertex_(arena.allocate<std::uint32_t>(capacity.vertices)),
        junctions_(arena.allocate<Junction>(capacity.vertices)),
        reach_(arena.allocate<Reach>(capacity.vertices)),
        branches_(arena.allocate<BranchVertex>(capacity.vertices)),
        half_edge_is_walked_(arena.allocate<std::uint8_t>(2 * std::size_t{capacity.edges})),
        chains_(arena.allocate<Chain>(capacity.edges)),
        open_length_(arena.allocate<double>(capacity.edges)),
        half_chains_(arena.allocate<HalfChain>(2 * std::size_t{capacity.edges})),
        chain_steps_(arena.allocate<TrailStep>(capacity.edges)),
        distance_{arena.allocate<double>(capacity.edges), arena.allocate<double>(capacity.edges),
                  arena.allocate<double>(capacity.edges), arena.allocate<double>(capacity.edges)},
        path_half_chains_(arena.allocate<std::uint32_t>(capacity.edges)),
        path_end_(arena.allocate<std::uint32_t>(capacity.edges)),
        trails_(arena.allocate<Trail>(capacity.edges)),
        trail_steps_(arena.allocate<TrailStep>(capacity.edges)),
        unsettled_(arena, capacity.vertices),
        meetings_(arena, capacity.edges) {}

  /// Reads the graph for the loop from vertex f to vertex l. What it needs it copies: the graph may change
  /// afterwards, the weights are those of the graph as it was.
  /// no_such_vertex; no_loop (f is l); disconnected; no_scan_capacity and no_edge_capacity (the graph is
  /// larger than the optimizer). After an error the other calls answer disconnected.
  [[nodiscard]] Status prepare(const PoseGraph& graph, std::uint32_t f, std::uint32_t l);

  /// LOA on one cost: weights[i], in [0, 1], of every vertex of the prepared graph.
  /// disconnected (nothing is prepared), buffer_too_small (fewer weights than vertices).
  [[nodiscard]] Status weights(LoopCost cost, std::span<double> weights);

  /// LOA's decomposition on one cost, for a caller that shares the offset along the trails in a way of its
  /// own. Fills trails() and branches(), valid until the next call of prepare, weights or decompose.
  /// disconnected.
  [[nodiscard]] Status decompose(LoopCost cost);

  /// In LOA's order: a trail's ends are f, l or inner vertices of earlier trails.
  [[nodiscard]] std::span<const Trail> trails() const { return trails_.first(trail_count_); }

  /// The edges of a trail from its start to its end; the last step's vertex is trail.end.
  [[nodiscard]] std::span<const TrailStep> steps(const Trail& trail) const {
    return trail_steps_.subspan(trail.first_step, trail.step_count);
  }

  /// All branch vertices; each one's parent lies on a trail or comes before it.
  [[nodiscard]] std::span<const BranchVertex> branches() const { return branches_.first(branch_count_); }

 private:
  /// A vertex of the contracted graph: degree other than 2, or f, or l.
  struct Junction {
    std::uint32_t vertex = 0;
    std::uint32_t degree = 0;
    std::uint32_t first_half_chain = 0;
  };

  /// An edge of the contracted graph: chain_steps_[first_step, end_step) lead from one junction to another.
  struct Chain {
    std::uint32_t first_step = 0;
    std::uint32_t end_step = 0;
  };

  /// Half-chain 2c follows chain c, 2c + 1 goes against it, as the half-edges of a PoseGraph do.
  struct HalfChain {
    std::uint32_t next = 0;  ///< of those that leave the same junction
    std::uint32_t target = 0;
  };

  /// What the search knows of a junction.
  struct Reach {
    double distance = 0;           ///< to `source`
    std::uint32_t source = 0;      ///< nearest member of Omega
    std::uint32_t arrived_by = 0;  ///< half-chain that leads here; no_index at a member of Omega
    std::uint32_t open_chains = 0;
  };

  /// Binary heap of (key, id) with the place of every id: an id is in it at most once.
  class Heap {
   public:
    constexpr Heap(Arena& arena, std::size_t capacity)
        : entries_(arena.allocate<Entry>(capacity)), place_(arena.allocate<std::uint32_t>(capacity)) {}
    void clear(std::uint32_t id_count);
    [[nodiscard]] bool empty() const { return size_ == 0; }
    [[nodiscard]] double lowest_key() const { return entries_[0].key; }
    [[nodiscard]] bool holds(std::uint32_t id) const { return place_[id] != no_index; }
    /// Inserts the id, or lowers its key, or leaves it where it is when its key is lower.
    void insert_or_lower(std::uint32_t id, double key);
    /// Removes and returns the id of the lowest key.
    std::uint32_t pop();

   private:
    struct Entry {
      double key = 0;
      std::uint32_t id = 0;
    };
    std::span<Entry> entries_;
    std::span<std::uint32_t> place_;
    std::uint32_t size_ = 0;
  };

  std::uint32_t junction_at(const PoseGraph& graph, std::uint32_t vertex);
  void walk_chain(const PoseGraph& graph, std::uint32_t junction, std::uint32_t half_edge);
  void find_trails(std::span<const double> distance);
  void settle(std::uint32_t junction);
  void join_omega(std::uint32_t junction);
  void close_path(std::uint32_t chain);
  void find_branches();
  void add_branch(std::uint32_t junction, std::uint32_t root_vertex);

  static constexpr double closed = std::numeric_limits<double>::infinity();

  [[nodiscard]] std::uint32_t source(std::uint32_t half_chain) const {
    return half_chains_[half_chain ^ 1].target;
  }
  [[nodiscard]] std::uint32_t target(std::uint32_t half_chain) const {
    return half_chains_[half_chain].target;
  }

  std::span<std::uint32_t> junction_of_vertex_;
  std::span<Junction> junctions_;
  std::span<Reach> reach_;
  std::span<BranchVertex> branches_;
  std::span<std::uint8_t> half_edge_is_walked_;
  std::span<Chain> chains_;
  std::span<double> open_length_;  ///< of each chain, in this run's cost; `closed` once a trail runs over it
  std::span<HalfChain> half_chains_;
  std::span<TrailStep> chain_steps_;
  std::array<std::span<double>, 4> distance_;  ///< per LoopCost, beside chain_steps_: from the chain's begin
  std::span<std::uint32_t> path_half_chains_;  ///< the trails of this run, as half-chains from start to end
  std::span<std::uint32_t> path_end_;          ///< where in path_half_chains_ each of them ends
  std::span<Trail> trails_;
  std::span<TrailStep> trail_steps_;
  Heap unsettled_;  ///< junctions, by distance
  Heap meetings_;   ///< chains between two regions, by the length of the way through them

  std::uint32_t f_ = 0;
  std::uint32_t l_ = 0;
  std::uint32_t vertex_count_ = 0;
  std::uint32_t junction_count_ = 0;
  std::uint32_t chain_count_ = 0;
  std::uint32_t step_count_ = 0;
  std::uint32_t path_count_ = 0;
  std::uint32_t trail_count_ = 0;
  std::uint32_t branch_count_ = 0;
  bool is_prepared_ = false;
  bool branches_are_known_ = false;
};

}  // namespace alces
