#include "hogman.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "hogman_level.h"
#include "offline/io/files/error.h"
#include "offline/optimize/graph/gauss_newton.h"
#include "offline/optimize/graph/graph_parts.h"

namespace alces::offline {
namespace {

// From where the poses are, or from the measurements along a tree: whichever they fit better.
void choose_hogman_start(ConstraintGraph& graph) {
  ConstraintGraph tree = graph;
  start_from_spanning_tree(tree);
  if (chi_squared(tree) < chi_squared(graph)) graph.vertices = std::move(tree.vertices);
}

}  // namespace

class HogMan::Hierarchy {
 public:
  Hierarchy(bool is_planar, const HogManSettings& settings) : settings_(settings) {
    if (settings.most_levels == 0) throw UsageError("HOG-Man's hierarchy has at least one level");
    levels_.emplace_back(is_planar);
  }

  HogManLevel& bottom() { return levels_.front(); }

  void lift() {
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      const bool is_top = k + 1 == levels_.size();
      if (is_top && (levels_.size() >= settings_.most_levels || vertex_count(k) <= settings_.top_vertices))
        return;
      if (is_top) levels_.emplace_back(levels_[k].graph().is_planar);
      levels_[k].lift(levels_[k + 1], settings_.group_radius);
      if (is_top && vertex_count(k + 1) == vertex_count(k)) {  // nothing to put together: all are fixed
        levels_.pop_back();
        return;
      }
    }
  }

  void hold_a_vertex() {
    std::vector<ConstraintVertex>& vertices = bottom().graph().vertices;
    if (has_fixed_ || vertices.empty()) return;
    has_fixed_ = true;
    if (std::none_of(vertices.begin(), vertices.end(), [](const auto& v) { return v.is_fixed; }))
      vertices.front().is_fixed = true;
  }

  void update() {
    hold_a_vertex();
    require_connected(bottom().graph());
    lift();
    optimize(levels_.back(), settings_.top_iterations, {});
    for (std::size_t k = levels_.size() - 1; k-- > 0;)
      levels_[k].settle(levels_[k + 1], settings_.least_motion_m, settings_.least_rotation_rad,
                        settings_.local_iterations);
  }

  std::uint32_t refine(const HogManCallbacks& callbacks, bool chooses_start) {
    hold_a_vertex();
    require_connected(bottom().graph());
    lift();
    const auto steps_above = static_cast<std::uint32_t>(levels_.size() - 1);
    const std::uint32_t steps = steps_above + settings_.refine_iterations;
    std::uint32_t iterations = 0;
    if (chooses_start) choose_hogman_start(levels_.back().graph());
    for (std::size_t k = levels_.size(); k-- > 0;) {
      if (k + 1 < levels_.size()) levels_[k].settle(levels_[k + 1], 0, 0, settings_.local_iterations);
      GaussNewtonCallbacks own;
      own.stop_requested = callbacks.stop_requested;
      if (k == 0 && callbacks.progress)
        own.progress = [&](const GaussNewtonStep& step) {
          callbacks.progress(steps_above + static_cast<std::uint32_t>(step.iteration), steps);
        };
      const std::uint32_t most = k == 0 ? settings_.refine_iterations : settings_.top_iterations;
      if (most > 0) iterations = optimize(levels_[k], most, own);
      if (k > 0 && callbacks.progress)
        callbacks.progress(static_cast<std::uint32_t>(levels_.size() - k), steps);
    }
    for (std::size_t k = 0; k + 1 < levels_.size(); ++k) levels_[k].raise_poses(levels_[k + 1]);
    return settings_.refine_iterations == 0 ? 0 : iterations;
  }

  [[nodiscard]] const std::vector<HogManLevel>& levels() const { return levels_; }

 private:
  static std::uint32_t optimize(HogManLevel& level, std::uint32_t iterations,
                                const GaussNewtonCallbacks& callbacks) {
    GaussNewtonSettings settings;
    settings.start = GraphStart::file;
    settings.most_iterations = iterations;
    return static_cast<std::uint32_t>(optimize_gauss_newton(level.graph(), settings, callbacks).iterations);
  }

  [[nodiscard]] std::size_t vertex_count(std::size_t level) const {
    return levels_[level].graph().vertices.size();
  }

  HogManSettings settings_;
  std::vector<HogManLevel> levels_;  // from the graph itself up
  bool has_fixed_ = false;
};

HogMan::HogMan(bool is_planar, const HogManSettings& settings)
    : hierarchy_(std::make_unique<Hierarchy>(is_planar, settings)) {}
HogMan::~HogMan() = default;
HogMan::HogMan(HogMan&&) noexcept = default;
HogMan& HogMan::operator=(HogMan&&) noexcept = default;

void HogMan::add_vertex(const ConstraintVertex& vertex) {
  hierarchy_->bottom().add_vertex(vertex);
}

void HogMan::add_constraint(const Constraint& constraint) {
  hierarchy_->bottom().add_constraint(constraint);
}

void HogMan::update() {
  hierarchy_->update();
}

std::uint32_t HogMan::refine(const HogManCallbacks& callbacks) {
  return hierarchy_->refine(callbacks, false);
}

const ConstraintGraph& HogMan::graph() const {
  return hierarchy_->levels().front().graph();
}

std::vector<std::uint32_t> HogMan::level_vertices() const {
  std::vector<std::uint32_t> counts;
  for (const HogManLevel& level : hierarchy_->levels())
    counts.push_back(static_cast<std::uint32_t>(level.graph().vertices.size()));
  return counts;
}

HogManResult optimize_hogman(ConstraintGraph& graph, const HogManSettings& settings,
                             const HogManCallbacks& callbacks) {
  require_connected(graph);
  HogManResult result;
  result.chi_squared_before = chi_squared(graph);
  result.chi_squared = result.chi_squared_before;
  if (!std::isfinite(result.chi_squared_before))
    throw InputError("the graph holds NaN or numbers that are too large: chi-squared is not finite");
  if (graph.constraints.empty()) return result;
  HogManCallbacks own = callbacks;
  own.stop_requested = [&] {
    result.stopped = result.stopped || (callbacks.stop_requested && callbacks.stop_requested());
    return result.stopped;
  };
  HogMan hogman(graph.is_planar, settings);
  for (const ConstraintVertex& vertex : graph.vertices) hogman.add_vertex(vertex);
  for (const Constraint& constraint : graph.constraints) hogman.add_constraint(constraint);
  result.iterations = hogman.hierarchy_->refine(own, true);
  for (std::size_t i = 0; i < graph.vertices.size(); ++i)
    graph.vertices[i].map_from_body = hogman.graph().vertices[i].map_from_body;
  result.chi_squared = chi_squared(graph);
  result.level_vertices = hogman.level_vertices();
  return result;
}

}  // namespace alces::offline
