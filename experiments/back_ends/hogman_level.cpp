#include "hogman_level.h"

#include <algorithm>
#include <utility>

#include "alces/pose_graph.h"
#include "condense.h"
#include "offline/optimize/graph/gauss_newton.h"
#include "offline/optimize/graph/graph_parts.h"

namespace alces::offline {
namespace {

// Parts that only hang together by vertices outside are problems of their own.
void optimize_each_part(ConstraintGraph& graph, const GaussNewtonSettings& settings) {
  const GraphParts parts = graph_parts(graph);
  std::vector<ConstraintGraph> part_graphs(parts.size());
  std::vector<std::uint32_t> place(graph.vertices.size());
  for (std::size_t i = 0; i < graph.vertices.size(); ++i) {
    ConstraintGraph& part = part_graphs[parts.part_of_vertex[i]];
    part.is_planar = graph.is_planar;
    place[i] = static_cast<std::uint32_t>(part.vertices.size());
    part.vertices.push_back(graph.vertices[i]);
  }
  for (const Constraint& constraint : graph.constraints) {
    Constraint moved = constraint;
    moved.from = place[constraint.from];
    moved.to = place[constraint.to];
    part_graphs[parts.part_of_vertex[constraint.from]].constraints.push_back(moved);
  }
  for (ConstraintGraph& part : part_graphs) optimize_gauss_newton(part, settings);
  for (std::size_t i = 0; i < graph.vertices.size(); ++i)
    graph.vertices[i].map_from_body = part_graphs[parts.part_of_vertex[i]].vertices[place[i]].map_from_body;
}

}  // namespace

void HogManLevel::add_vertex(const ConstraintVertex& vertex) {
  graph_.vertices.push_back(vertex);
  constraints_of_.emplace_back();
  place_.push_back(no_index);
}

std::uint32_t HogManLevel::add_constraint(const Constraint& constraint) {
  const auto index = static_cast<std::uint32_t>(graph_.constraints.size());
  graph_.constraints.push_back(constraint);
  constraints_of_[constraint.from].push_back(index);
  constraints_of_[constraint.to].push_back(index);
  news_.push_back(index);
  return index;
}

void HogManLevel::lift(HogManLevel& above, std::uint32_t radius) {
  for (auto v = static_cast<std::uint32_t>(group_of_.size()); v < graph_.vertices.size(); ++v)
    group(v, above, radius);

  std::vector<std::uint32_t> to_measure;
  for (const std::uint32_t c : news_) {
    const std::uint32_t a = group_of_[graph_.constraints[c].from];
    const std::uint32_t b = group_of_[graph_.constraints[c].to];
    has_news_[a] = true;
    has_news_[b] = true;
    if (a != b) {
      to_measure.push_back(joint(above, a, b));
    } else {  // part of every measurement that the group takes part in
      to_measure.insert(to_measure.end(), above.constraints_of_[a].begin(), above.constraints_of_[a].end());
    }
  }
  news_.clear();
  std::sort(to_measure.begin(), to_measure.end());
  to_measure.erase(std::unique(to_measure.begin(), to_measure.end()), to_measure.end());
  for (const std::uint32_t c : to_measure) measure(above.graph_.constraints[c]);
  above.news_.insert(above.news_.end(), to_measure.begin(), to_measure.end());
  std::sort(above.news_.begin(), above.news_.end());
  above.news_.erase(std::unique(above.news_.begin(), above.news_.end()), above.news_.end());
}

// To the nearest representative, if one is near enough; otherwise the vertex is one itself. Fixed vertices
// always are, so that they stay fixed on all levels.
void HogManLevel::group(std::uint32_t vertex, HogManLevel& above, std::uint32_t radius) {
  std::uint32_t joined_by = no_index;
  std::pair<std::uint32_t, std::uint32_t> best(radius + 1, 0);  // (constraints to it, group)
  for (const std::uint32_t c : constraints_of_[vertex]) {
    const std::uint32_t neighbour = other_end(c, vertex);
    if (neighbour >= group_of_.size()) continue;
    const std::pair candidate(radius_of_[neighbour] + 1, group_of_[neighbour]);
    if (candidate < best) {
      best = candidate;
      joined_by = c;
    }
  }
  if (joined_by == no_index || graph_.vertices[vertex].is_fixed) {
    group_of_.push_back(static_cast<std::uint32_t>(members_.size()));
    radius_of_.push_back(0);
    members_.push_back({vertex});
    has_news_.push_back(true);
    above.add_vertex(graph_.vertices[vertex]);
    return;
  }
  radius_of_.push_back(best.first);
  group_of_.push_back(best.second);
  members_[best.second].push_back(vertex);
  has_news_[best.second] = true;
  // It stands where the group sees it, wherever it was thought to be: the group moves as one.
  const Constraint& constraint = graph_.constraints[joined_by];
  const Pose& map_from_neighbour = graph_.vertices[other_end(joined_by, vertex)].map_from_body;
  graph_.vertices[vertex].map_from_body = constraint.to == vertex
                                              ? map_from_neighbour * constraint.from_from_to
                                              : map_from_neighbour * constraint.from_from_to.inverse();
}

std::uint32_t HogManLevel::joint(HogManLevel& above, std::uint32_t a, std::uint32_t b) const {
  for (const std::uint32_t c : above.constraints_of_[a])
    if (above.other_end(c, a) == b) return c;
  Constraint constraint;
  constraint.from = std::min(a, b);
  constraint.to = std::max(a, b);
  return above.add_constraint(constraint);
}

// The two groups alone, the first one's representative fixed.
void HogManLevel::measure(Constraint& joint) {
  ConstraintGraph pair;
  pair.is_planar = graph_.is_planar;
  std::vector<std::uint32_t> vertices = members_[joint.from];
  vertices.insert(vertices.end(), members_[joint.to].begin(), members_[joint.to].end());
  for (const std::uint32_t v : vertices) {
    place_[v] = static_cast<std::uint32_t>(pair.vertices.size());
    pair.vertices.push_back(graph_.vertices[v]);
  }
  for (const std::uint32_t v : vertices) {
    for (const std::uint32_t c : constraints_of_[v]) {
      if (graph_.constraints[c].from != v || place_[graph_.constraints[c].to] == no_index) continue;
      pair.constraints.push_back(graph_.constraints[c]);
      pair.constraints.back().from = place_[v];
      pair.constraints.back().to = place_[graph_.constraints[c].to];
    }
  }
  const std::uint32_t to = place_[members_[joint.to].front()];
  for (const std::uint32_t v : vertices) place_[v] = no_index;
  condense(pair, 0, to, joint);
}

std::size_t HogManLevel::settle(const HogManLevel& above, double least_motion_m, double least_rotation_rad,
                                std::uint32_t iterations) {
  std::vector<std::uint32_t> changed;
  for (std::uint32_t g = 0; g < members_.size(); ++g) {
    const Pose& there = above.graph_.vertices[g].map_from_body;
    const Pose here = graph_.vertices[members_[g].front()].map_from_body;
    const bool has_moved = (there.translation_m - here.translation_m).norm() >= least_motion_m ||
                           angle_between_rad(there.rotation, here.rotation) >= least_rotation_rad;
    if (!has_moved && !has_news_[g]) continue;
    has_news_[g] = false;
    changed.push_back(g);
    const Pose there_from_here = there * here.inverse();
    for (const std::uint32_t v : members_[g]) {
      Pose& map_from_body = graph_.vertices[v].map_from_body;
      map_from_body = there_from_here * map_from_body;
    }
    graph_.vertices[members_[g].front()].map_from_body = there;  // to the bit
  }
  if (iterations > 0) optimize_members(changed, iterations);
  return changed.size();
}

void HogManLevel::optimize_members(const std::vector<std::uint32_t>& groups, std::uint32_t iterations) {
  ConstraintGraph part;
  part.is_planar = graph_.is_planar;
  std::vector<std::uint32_t> vertices;
  const auto place = [&](std::uint32_t v, bool is_fixed) {
    if (place_[v] != no_index) return;
    place_[v] = static_cast<std::uint32_t>(vertices.size());
    vertices.push_back(v);
    part.vertices.push_back(graph_.vertices[v]);
    part.vertices.back().is_fixed = is_fixed;
  };
  for (const std::uint32_t g : groups)
    for (const std::uint32_t v : members_[g]) place(v, v == members_[g].front());
  const auto own_vertices = static_cast<std::uint32_t>(vertices.size());
  for (std::uint32_t i = 0; i < own_vertices; ++i) {
    if (part.vertices[i].is_fixed) continue;
    const std::uint32_t v = vertices[i];
    for (const std::uint32_t c : constraints_of_[v]) {
      const std::uint32_t other = other_end(c, v);
      place(other, true);  // of a group that stays
      // once: by its first end that is free
      const bool both_are_free = place_[other] < own_vertices && !part.vertices[place_[other]].is_fixed;
      if (both_are_free && graph_.constraints[c].from != v) continue;
      part.constraints.push_back(graph_.constraints[c]);
      part.constraints.back().from = place_[graph_.constraints[c].from];
      part.constraints.back().to = place_[graph_.constraints[c].to];
    }
  }
  GaussNewtonSettings settings;
  settings.start = GraphStart::file;
  settings.most_iterations = iterations;
  if (!part.constraints.empty()) optimize_each_part(part, settings);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    place_[vertices[i]] = no_index;
    if (!part.vertices[i].is_fixed)
      graph_.vertices[vertices[i]].map_from_body = part.vertices[i].map_from_body;
  }
}

void HogManLevel::raise_poses(HogManLevel& above) const {
  for (std::size_t g = 0; g < members_.size(); ++g)
    above.graph_.vertices[g].map_from_body = graph_.vertices[members_[g].front()].map_from_body;
}

}  // namespace alces::offline
