#include "toro.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "offline/io/files/error.h"
#include "offline/optimize/graph/graph_parts.h"
#include "spanning_tree.h"

namespace alces::offline {
namespace {

// Covariances as spheres, one for translation and one for rotation, which is what lets an error be spread
// without asking in which frame. In 1 / m^2 and 1 / rad^2.
struct Information {
  double translation = 0;
  double rotation = 0;

  Information& operator+=(const Information& other) {
    translation += other.translation;
    rotation += other.rotation;
    return *this;
  }
};

Information spherical_information(const ConstraintGraph& graph, const Constraint& constraint) {
  if (graph.is_planar) {
    const Eigen::Matrix3d& planar = constraint.planar_information;
    return {planar.topLeftCorner<2, 2>().trace() / 2, planar(2, 2)};
  }
  constexpr double half_angle = 4;  // (angle / vector part of its quaternion)^2
  const Matrix6d& full = constraint.information;
  return {full.topLeftCorner<3, 3>().trace() / 3, full.bottomRightCorner<3, 3>().trace() / (3 * half_angle)};
}

// The way through the tree that a constraint bends: up from `from` to the top, down to `to`.
struct Way {
  std::uint32_t constraint = 0;
  std::uint32_t top = 0;
  Information information;
};

class Toro {
 public:
  explicit Toro(ConstraintGraph& graph)
      : graph_(graph),
        tree_(spanning_tree(graph)),
        parent_from_vertex_(graph.vertices.size()),
        yielding_(graph.vertices.size()) {
    for (const std::uint32_t v : tree_.from_root) {
      if (v == tree_.root) continue;
      const Pose& map_from_parent = graph.vertices[tree_.parent[v]].map_from_body;
      parent_from_vertex_[v] = map_from_parent.inverse() * graph.vertices[v].map_from_body;
    }
    find_ways();
    precondition();
  }

  void iterate(double rate) {
    for (const Way& way : ways_) satisfy(graph_.constraints[way.constraint], way, rate);
  }

  void write_poses() {
    for (const std::uint32_t v : tree_.from_root) {
      ConstraintVertex& vertex = graph_.vertices[v];
      if (v == tree_.root || vertex.is_fixed) continue;
      vertex.map_from_body = graph_.vertices[tree_.parent[v]].map_from_body * parent_from_vertex_[v];
    }
  }

 private:
  // A vertex of a way while it is bent, in the frame of the way's top, and its part of the whole bend:
  // negative on the side of `from`, which goes to meet `to`.
  struct Step {
    std::uint32_t vertex = 0;
    Pose top_from_vertex;
    double translation_part = 0;
    double rotation_part = 0;
  };

  void find_ways() {
    for (std::uint32_t i = 0; i < graph_.constraints.size(); ++i) {
      const Constraint& constraint = graph_.constraints[i];
      ways_.push_back(
          {i, tree_.meeting(constraint.from, constraint.to), spherical_information(graph_, constraint)});
    }
    // From the root to the leaves: what is bent later does not undo what was bent before it.
    std::stable_sort(ways_.begin(), ways_.end(),
                     [this](const Way& a, const Way& b) { return tree_.depth[a.top] < tree_.depth[b.top]; });
  }

  // yielding_[v]: the inverse of all information that runs over the edge from v to its parent.
  void precondition() {
    std::vector<Information> over(graph_.vertices.size());
    std::vector<Information> own(graph_.vertices.size());
    for (const Way& way : ways_) {
      const Constraint& constraint = graph_.constraints[way.constraint];
      over[constraint.from] += way.information;
      over[constraint.to] += way.information;
      over[way.top] += {-2 * way.information.translation, -2 * way.information.rotation};
      if (tree_.parent[constraint.from] == constraint.to) own[constraint.from] += way.information;
      if (tree_.parent[constraint.to] == constraint.from) own[constraint.to] += way.information;
    }
    for (std::size_t i = tree_.from_root.size(); i-- > 1;) {
      const std::uint32_t v = tree_.from_root[i];
      over[tree_.parent[v]] += over[v];
      if (graph_.vertices[v].is_fixed) continue;  // yields nothing
      // not below its own constraint's, whatever the differences of large numbers leave of it
      yielding_[v] = {1 / std::max(over[v].translation, own[v].translation),
                      1 / std::max(over[v].rotation, own[v].rotation)};
    }
  }

  // The steps of one side, from its end up to below the top.
  void climb(std::uint32_t end, std::uint32_t top, std::vector<Step>& steps, Information& whole) const {
    steps.clear();
    for (std::uint32_t v = end; v != top; v = tree_.parent[v]) {
      steps.push_back({v, {}, 0, 0});
      whole += yielding_[v];
    }
  }

  // Poses and parts, from the top down; returns the end's pose.
  Pose lay(std::vector<Step>& steps, double sign, const Information& whole) const {
    Pose top_from_vertex;
    Information below_top;
    for (std::size_t i = steps.size(); i-- > 0;) {
      Step& step = steps[i];
      top_from_vertex = top_from_vertex * parent_from_vertex_[step.vertex];
      below_top += yielding_[step.vertex];
      step.top_from_vertex = top_from_vertex;
      if (whole.translation > 0) step.translation_part = sign * below_top.translation / whole.translation;
      if (whole.rotation > 0) step.rotation_part = sign * below_top.rotation / whole.rotation;
    }
    return top_from_vertex;
  }

  // Slerp about one axis that all vertices of the way share; places follow, seen from their parents.
  Pose turn(std::vector<Step>& steps, const Eigen::Vector3d& rotation_rad) const {
    Pose top_from_parent;
    for (std::size_t i = steps.size(); i-- > 0;) {
      Step& step = steps[i];
      const Eigen::Quaterniond turned = exp_so3(step.rotation_part * rotation_rad);
      step.top_from_vertex.rotation = (turned * step.top_from_vertex.rotation).normalized();
      step.top_from_vertex.translation_m = top_from_parent * parent_from_vertex_[step.vertex].translation_m;
      top_from_parent = step.top_from_vertex;
    }
    return top_from_parent;
  }

  void move(std::vector<Step>& steps, const Eigen::Vector3d& translation_m) {
    Pose top_from_parent;
    for (std::size_t i = steps.size(); i-- > 0;) {
      Step& step = steps[i];
      step.top_from_vertex.translation_m += step.translation_part * translation_m;
      parent_from_vertex_[step.vertex] = top_from_parent.inverse() * step.top_from_vertex;
      top_from_parent = step.top_from_vertex;
    }
  }

  void satisfy(const Constraint& constraint, const Way& way, double rate) {
    Information whole;
    climb(constraint.from, way.top, from_side_, whole);
    climb(constraint.to, way.top, to_side_, whole);
    Pose top_from_from = lay(from_side_, -1, whole);
    Pose top_from_to = lay(to_side_, 1, whole);

    // A gradient step of rate * information * whole errors, which would be more than the error itself when
    // the way is long: taken implicitly (the gradient where the step ends), it never is.
    const auto share = [rate](double information, double yielding) {
      const double step = rate * information * yielding;
      return step / (1 + step);
    };
    const Eigen::Quaterniond wanted = top_from_from.rotation * constraint.from_from_to.rotation;
    const Eigen::Vector3d rotation_rad = share(way.information.rotation, whole.rotation) *
                                         log_so3((wanted * top_from_to.rotation.conjugate()).normalized());
    top_from_from = turn(from_side_, rotation_rad);
    top_from_to = turn(to_side_, rotation_rad);
    const Eigen::Vector3d translation_m =
        share(way.information.translation, whole.translation) *
        (top_from_from * constraint.from_from_to.translation_m - top_from_to.translation_m);
    move(from_side_, translation_m);
    move(to_side_, translation_m);
  }

  ConstraintGraph& graph_;
  SpanningTree tree_;
  std::vector<Pose> parent_from_vertex_;
  std::vector<Information> yielding_;  // inverse information: variances
  std::vector<Way> ways_;
  std::vector<Step> from_side_;
  std::vector<Step> to_side_;
};

// Held at the first rate for a while, then as 1 / time down to the last.
double learning_rate(const ToroSettings& settings, std::uint32_t iteration) {
  const double done = static_cast<double>(iteration + 1) / settings.iterations;
  const double falling = std::max(0.0, done - settings.first_rate_share);
  const double steepness = (settings.first_rate / settings.last_rate - 1) / (1 - settings.first_rate_share);
  return settings.first_rate / (1 + steepness * falling);
}

void check(const ConstraintGraph& graph, const ToroSettings& settings) {
  if (!(settings.first_rate > 0 && settings.last_rate > 0 && settings.first_rate_share >= 0 &&
        settings.first_rate_share < 1))
    throw UsageError("TORO's learning rates must be above 0, and the share of the first in [0, 1)");
  require_connected(graph);
  for (const Constraint& constraint : graph.constraints) {
    const Information information = spherical_information(graph, constraint);
    if (!(information.translation > 0 && information.rotation > 0))
      throw InputError("the constraint from vertex " + std::to_string(graph.vertices[constraint.from].id) +
                       " to " + std::to_string(graph.vertices[constraint.to].id) +
                       " has no positive information; give it one, or leave the constraint out");
  }
}

}  // namespace

ToroResult optimize_toro(ConstraintGraph& graph, const ToroSettings& settings,
                         const ToroCallbacks& callbacks) {
  check(graph, settings);
  ToroResult result;
  result.chi_squared_before = chi_squared(graph);
  result.chi_squared = result.chi_squared_before;
  if (!std::isfinite(result.chi_squared_before))
    throw InputError("the graph holds NaN or numbers that are too large: chi-squared is not finite");
  if (graph.constraints.empty()) return result;
  Toro toro(graph);
  while (result.iterations < settings.iterations && !result.stopped) {
    if (callbacks.stop_requested && callbacks.stop_requested()) {
      result.stopped = true;
      break;
    }
    toro.iterate(learning_rate(settings, result.iterations));
    ++result.iterations;
    if (callbacks.progress) callbacks.progress(result.iterations, settings.iterations);
  }
  if (result.iterations > 0) toro.write_poses();
  result.chi_squared = chi_squared(graph);
  return result;
}

}  // namespace alces::offline
