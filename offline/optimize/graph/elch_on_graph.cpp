#include "elch_on_graph.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <deque>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "graph_parts.h"
#include "graph_start.h"
#include "offline/io/files/error.h"
#include "offline/map/memory_plan.h"
#include "planar_pose.h"

namespace alces::offline {
namespace {

bool is_odometry_edge(const Constraint& c) {
  return c.from + std::uint64_t{1} == c.to || c.to + std::uint64_t{1} == c.from;
}

EdgeVariance variance_of(const ConstraintGraph& graph, const Constraint& c) {
  constexpr double half_angle = 4;  // (angle / half the angle)^2
  constexpr double axes = 3;        // an edge's label sums over them
  Eigen::Matrix3d in_to = Eigen::Matrix3d::Identity();
  EdgeVariance variance;
  if (graph.is_planar) {
    const Eigen::Matrix3d covariance = c.planar_information.inverse();
    in_to.topLeftCorner<2, 2>() = covariance.topLeftCorner<2, 2>();
    in_to(2, 2) = covariance.topLeftCorner<2, 2>().trace() / 2;  // any: nothing moves along z
    variance.rotation_rad2 = axes * covariance(2, 2);
  } else {
    const Matrix6d covariance = c.information.inverse();
    in_to = covariance.topLeftCorner<3, 3>();
    const Eigen::Vector3d rotation = covariance.bottomRightCorner<3, 3>().diagonal();
    variance.rotation_rad2 = half_angle * rotation.sum();
    for (std::size_t axis = 0; axis < 3; ++axis)
      variance.rotation_shares[axis] = rotation[static_cast<Eigen::Index>(axis)] / rotation.sum();
  }
  variance.x_m2 = in_to(0, 0);
  variance.y_m2 = in_to(1, 1);
  variance.z_m2 = in_to(2, 2);
  return variance;
}

class Drive {
 public:
  Drive(ConstraintGraph& graph, const ElchSettings& settings)
      : graph_(graph), settings_(settings), capacity_(capacity_for(graph)), block_(bytes_for(capacity_)) {
    Arena arena(block_.bytes());
    poses_.emplace(arena, capacity_);
    sharing_.emplace(arena, capacity_);
    assert(!arena.overflowed());
    place_.assign(graph.vertices.size(), no_index);
    waiting_.resize(graph.vertices.size());
  }

  void run(const ElchCallbacks& callbacks, ElchResult& result) {
    std::vector<std::uint32_t> order(graph_.constraints.size());
    std::iota(order.begin(), order.end(), 0U);
    const auto key = [&](std::uint32_t i) {
      const Constraint& c = graph_.constraints[i];
      return std::pair(std::max(c.from, c.to), !is_odometry_edge(c));
    };
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });

    const auto fixed = std::find_if(graph_.vertices.begin(), graph_.vertices.end(),
                                    [](const ConstraintVertex& v) { return v.is_fixed; });
    place(fixed == graph_.vertices.end() ? 0 : static_cast<std::uint32_t>(fixed - graph_.vertices.begin()),
          (fixed == graph_.vertices.end() ? graph_.vertices.front() : *fixed).map_from_body);
    is_done_.assign(order.size(), false);
    std::size_t done = 0;
    for (const std::uint32_t next : order) {
      ready_.push_back(next);
      while (!ready_.empty()) {
        const std::uint32_t i = ready_.front();
        ready_.pop_front();
        if (is_done_[i]) continue;
        if (!result.was_stopped && callbacks.stop_requested && callbacks.stop_requested())
          result.was_stopped = true;
        if (!process(i, result)) continue;
        is_done_[i] = true;
        ++done;
        if (callbacks.progress) callbacks.progress(done, order.size());
      }
    }
    for (std::size_t i = 0; i < place_.size(); ++i) {
      Pose& pose = graph_.vertices[i].map_from_body;
      pose = poses_->poses()[place_[i]];
      if (graph_.is_planar)
        pose = planar_pose(pose.translation_m.x(), pose.translation_m.y(), heading_rad(pose));
    }
  }

 private:
  static PoseGraph::Capacity capacity_for(const ConstraintGraph& graph) {
    return {.vertices = static_cast<std::uint32_t>(graph.vertices.size()),
            .edges = static_cast<std::uint32_t>(graph.constraints.size())};
  }
  static std::size_t bytes_for(const PoseGraph::Capacity& capacity) {
    Arena counting;
    const PoseGraph poses(counting, capacity);
    const LoopCorrection sharing(counting, capacity);
    return counting.used_bytes();
  }

  void place(std::uint32_t vertex, const Pose& map_from_body) {
    place_[vertex] = poses_->vertex_count();
    check(poses_->add_vertex(map_from_body));
    ready_.insert(ready_.begin(), waiting_[vertex].begin(), waiting_[vertex].end());
    std::vector<std::uint32_t>().swap(waiting_[vertex]);
  }

  // False: neither end is placed yet, it waits for one.
  bool process(std::uint32_t i, ElchResult& result) {
    const Constraint& c = graph_.constraints[i];
    const std::uint32_t from = place_[c.from];
    const std::uint32_t to = place_[c.to];
    if (from == no_index && to == no_index) {
      waiting_[c.from].push_back(i);
      waiting_[c.to].push_back(i);
      return false;
    }
    if (to == no_index) {
      place(c.to, poses_->poses()[from] * c.from_from_to);
      join(c, false);
    } else if (from == no_index) {
      place(c.from, poses_->poses()[to] * c.from_from_to.inverse());
      join(c, false);
    } else if (are_joined(from, to)) {
      ++result.parallel;
    } else if (!result.was_stopped) {
      close(from, to, c);
      ++result.loops;
    }
    return true;
  }

  void close(std::uint32_t from, std::uint32_t to, const Constraint& c) {
    const std::uint32_t f = std::min(from, to);
    const std::uint32_t l = std::max(from, to);
    const Pose f_from_l = f == from ? c.from_from_to : c.from_from_to.inverse();
    check(sharing_->prepare(*poses_, f, l));
    check(sharing_->share(*poses_, poses_->poses()[f] * f_from_l, settings_.rule));
    join(c, true);
  }

  void join(const Constraint& c, bool closes_loop) {
    Edge edge;
    edge.from = place_[c.from];
    edge.to = place_[c.to];
    edge.closes_loop = closes_loop;
    edge.from_from_to = c.from_from_to;
    edge.variance = variance_of(graph_, c);
    check(poses_->add_edge(edge));
  }

  [[nodiscard]] bool are_joined(std::uint32_t a, std::uint32_t b) const {
    if (poses_->degree(a) > poses_->degree(b)) std::swap(a, b);
    for (std::uint32_t h = poses_->first_half_edge(a); h != no_index; h = poses_->next_half_edge(h)) {
      if (poses_->target(h) == b) return true;
    }
    return false;
  }

  // Capacities fit and the graph is checked; what is left are numbers out of bounds.
  static void check(Status status) {
    if (status != Status::ok)
      throw InputError(
          fmt::format("a constraint of the graph cannot be used ({}); is its information or its "
                      "measurement absurd?",
                      to_string(status)));
  }

  ConstraintGraph& graph_;
  ElchSettings settings_;
  PoseGraph::Capacity capacity_;
  MemoryBlock block_;
  std::optional<PoseGraph> poses_;  // vertices in the order they were placed
  std::optional<LoopCorrection> sharing_;
  std::vector<std::uint32_t> place_;  // in poses_, of each vertex
  std::vector<std::vector<std::uint32_t>> waiting_;
  std::deque<std::uint32_t> ready_;
  std::vector<bool> is_done_;
};

}  // namespace

ElchResult close_loops_with_elch(ConstraintGraph& graph, const ElchSettings& settings,
                                 const ElchCallbacks& callbacks) {
  require_connected(graph);
  const auto fixed = std::count_if(graph.vertices.begin(), graph.vertices.end(),
                                   [](const ConstraintVertex& v) { return v.is_fixed; });
  if (fixed > 1) {
    throw InputError(fmt::format(
        "ELCH holds one vertex where it is, the graph fixes {}; remove all but one FIX or use --with gn",
        fixed));
  }
  ElchResult result;
  result.chi_squared_before = chi_squared(graph);
  {
    ConstraintGraph open = graph;
    start_from_odometry(open);
    result.chi_squared_odometry = chi_squared(open);
  }
  Drive(graph, settings).run(callbacks, result);
  result.chi_squared = chi_squared(graph);
  return result;
}

}  // namespace alces::offline
