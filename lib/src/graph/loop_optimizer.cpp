// Why the search may go on after a path has been removed, instead of starting anew:
//
// Let d(v) be the distance of junction v to its nearest member of Omega, found along a tree of open chains,
// and s..e the path just removed.
// 1. d never rises. If v's tree path shares no chain with s..e it is as before, and its source, which still
//    has an open chain, is still in Omega. Otherwise let x be the last junction of the tree path that lies on
//    s..e: x has an open chain left, so x is s, e, or an inner junction that joins Omega now, and v is nearer
//    to x than it was to its old source.
// 2. Hence it is enough to set d = 0 at the inner junctions with open chains left and to relax from there. No
//    junction keeps a removed chain in its tree: the junctions behind removed chains are those on s..e, and
//    these are in Omega now or have no open chain.
// 3. A chain u-v of length c whose ends lie in the regions of two members of Omega is a meeting, with key
//    d(u) + c + d(v); the lowest key of all is the length of the shortest path between any two members. Keys
//    only fall as well, and they are renewed whenever an end is settled. A meeting is taken when all
//    junctions up to its key are settled; whatever could lower its key or change its regions is among these,
//    so only "are the regions still two" is left to check.
// A member of Omega that has no open chain is never met again: it need not be dropped.
//
// When no meeting is left, every open component holds one member of Omega: these are the branches. They do
// not depend on the costs: the trails are an open ear decomposition, grown from f..l as far as it goes, of
// the block that f and l would share if an edge joined them. So the first run after prepare() finds them for
// all.
#include "alces/loop_optimizer.h"

#include <algorithm>

namespace alces {
namespace {

double usable_cost(double variance) {
  return std::clamp(variance, 1e-150, 1e150);
}

}  // namespace

void LoopOptimizer::Heap::clear(std::uint32_t id_count) {
  std::ranges::fill(place_.first(id_count), no_index);
  size_ = 0;
}

void LoopOptimizer::Heap::insert_or_lower(std::uint32_t id, double key) {
  std::uint32_t at = place_[id];
  if (at == no_index) {
    at = size_++;
  } else if (key >= entries_[at].key) {
    return;
  }
  const Entry entry{key, id};
  while (at > 0) {
    const std::uint32_t above = (at - 1) / 2;
    if (entry.key >= entries_[above].key) break;
    entries_[at] = entries_[above];
    place_[entries_[at].id] = at;
    at = above;
  }
  entries_[at] = entry;
  place_[id] = at;
}

std::uint32_t LoopOptimizer::Heap::pop() {
  const std::uint32_t lowest = entries_[0].id;
  place_[lowest] = no_index;
  const Entry last = entries_[--size_];
  if (size_ == 0) return lowest;
  std::uint32_t at = 0;
  for (std::uint32_t child = 1; child < size_; child = 2 * at + 1) {
    child += static_cast<std::uint32_t>(child + 1 < size_ && entries_[child + 1].key < entries_[child].key);
    if (entries_[child].key >= last.key) break;
    entries_[at] = entries_[child];
    place_[entries_[at].id] = at;
    at = child;
  }
  entries_[at] = last;
  place_[last.id] = at;
  return lowest;
}

Status LoopOptimizer::prepare(const PoseGraph& graph, std::uint32_t f, std::uint32_t l) {
  is_prepared_ = false;
  branches_are_known_ = false;
  trail_count_ = branch_count_ = 0;
  if (graph.vertex_count() > junctions_.size()) return Status::no_scan_capacity;
  if (graph.edge_count() > chains_.size()) return Status::no_edge_capacity;
  if (f >= graph.vertex_count() || l >= graph.vertex_count()) return Status::no_such_vertex;
  if (f == l) return Status::no_loop;

  f_ = f;
  l_ = l;
  vertex_count_ = graph.vertex_count();
  junction_count_ = chain_count_ = step_count_ = 0;
  std::ranges::fill(junction_of_vertex_.first(vertex_count_), no_index);
  std::ranges::fill(half_edge_is_walked_.first(2 * std::size_t{graph.edge_count()}), std::uint8_t{0});

  // breadth first from f, junction by junction: other components stay untouched
  junction_at(graph, f);
  for (std::uint32_t junction = 0; junction < junction_count_; ++junction) {
    std::uint32_t half_edge = graph.first_half_edge(junctions_[junction].vertex);
    for (; half_edge != no_index; half_edge = graph.next_half_edge(half_edge)) {
      if (half_edge_is_walked_[half_edge] == 0) walk_chain(graph, junction, half_edge);
    }
  }
  if (junction_of_vertex_[l] == no_index) return Status::disconnected;
  is_prepared_ = true;
  return Status::ok;
}

std::uint32_t LoopOptimizer::junction_at(const PoseGraph& graph, std::uint32_t vertex) {
  std::uint32_t& junction = junction_of_vertex_[vertex];
  if (junction == no_index) {
    junction = junction_count_++;
    junctions_[junction] = {vertex, graph.degree(vertex), no_index};
  }
  return junction;
}

void LoopOptimizer::walk_chain(const PoseGraph& graph, std::uint32_t junction, std::uint32_t half_edge) {
  const std::span<const Edge> edges = graph.edges();
  const std::span<TrailStep> steps = chain_steps_;
  const std::array<std::span<double>, 4> distance = distance_;
  const std::uint32_t f = f_;
  const std::uint32_t l = l_;
  const Eigen::Quaterniond f_from_map = graph.poses()[f].rotation.conjugate();
  std::uint32_t step = step_count_;
  double x = 0;
  double y = 0;
  double z = 0;
  double rotation = 0;
  half_edge_is_walked_[half_edge] = 1;
  for (;;) {
    const Edge& edge = edges[half_edge / 2];
    const std::uint32_t vertex = (half_edge & 1) == 0 ? edge.to : edge.from;
    const Eigen::Vector3d along_f_m2 =
        translation_covariance(edge.variance, f_from_map * graph.poses()[edge.to].rotation).diagonal();
    distance[0][step] = x += usable_cost(along_f_m2.x());
    distance[1][step] = y += usable_cost(along_f_m2.y());
    distance[2][step] = z += usable_cost(along_f_m2.z());
    distance[3][step] = rotation += usable_cost(edge.variance.rotation_rad2);
    steps[step] = {half_edge, vertex};
    ++step;
    if (graph.degree(vertex) != 2 || vertex == f || vertex == l) break;
    const std::uint32_t way_back = half_edge ^ 1;
    const std::uint32_t first = graph.first_half_edge(vertex);
    half_edge = first == way_back ? graph.next_half_edge(first) : first;
  }
  half_edge_is_walked_[half_edge ^ 1] = 1;

  const std::uint32_t end = junction_at(graph, steps[step - 1].vertex);
  const std::uint32_t chain = chain_count_++;
  chains_[chain] = {step_count_, step};
  step_count_ = step;
  half_chains_[2 * chain] = {junctions_[junction].first_half_chain, end};
  junctions_[junction].first_half_chain = 2 * chain;
  half_chains_[2 * chain + 1] = {junctions_[end].first_half_chain, junction};
  junctions_[end].first_half_chain = 2 * chain + 1;
}

void LoopOptimizer::find_trails(std::span<const double> distance) {
  for (std::uint32_t junction = 0; junction < junction_count_; ++junction) {
    reach_[junction] = {std::numeric_limits<double>::infinity(), no_index, no_index,
                        junctions_[junction].degree};
  }
  for (std::uint32_t chain = 0; chain < chain_count_; ++chain) {
    open_length_[chain] = distance[chains_[chain].end_step - 1];
  }
  unsettled_.clear(junction_count_);
  meetings_.clear(chain_count_);
  path_count_ = trail_count_ = 0;
  join_omega(junction_of_vertex_[f_]);
  join_omega(junction_of_vertex_[l_]);
  for (;;) {
    if (!unsettled_.empty() && (meetings_.empty() || unsettled_.lowest_key() <= meetings_.lowest_key())) {
      settle(unsettled_.pop());
      continue;
    }
    if (meetings_.empty()) break;
    const std::uint32_t chain = meetings_.pop();
    const bool joins_two = reach_[source(2 * chain)].source != reach_[target(2 * chain)].source;
    if (joins_two && open_length_[chain] != closed) close_path(chain);
  }
  if (!branches_are_known_) find_branches();
}

void LoopOptimizer::join_omega(std::uint32_t junction) {
  Reach& reach = reach_[junction];
  reach.distance = 0;
  reach.source = junction;
  reach.arrived_by = no_index;
  if (reach.open_chains > 0) unsettled_.insert_or_lower(junction, 0);
}

void LoopOptimizer::settle(std::uint32_t junction) {
  const Reach here = reach_[junction];
  std::uint32_t half_chain = junctions_[junction].first_half_chain;
  for (; half_chain != no_index; half_chain = half_chains_[half_chain].next) {
    const double length = open_length_[half_chain / 2];
    if (length == closed) continue;
    const std::uint32_t neighbour = target(half_chain);
    Reach& there = reach_[neighbour];
    const double distance_there = here.distance + length;
    // when this junction's own distance fell by less than the sum can show, its source is news all the same
    const bool is_nearer = distance_there < there.distance;
    const bool is_renamed = distance_there == there.distance && there.arrived_by == half_chain;
    if (there.source == here.source && !is_nearer) continue;
    if (is_nearer || is_renamed) {
      there.distance = distance_there;
      there.source = here.source;
      there.arrived_by = half_chain;
      unsettled_.insert_or_lower(neighbour, distance_there);
    } else if (!unsettled_.holds(neighbour)) {  // if it does, it will find this meeting
      meetings_.insert_or_lower(half_chain / 2, distance_there + there.distance);
    }
  }
}

/// The path that meets in `chain` becomes a trail.
void LoopOptimizer::close_path(std::uint32_t chain) {
  const std::uint32_t begin = path_count_ == 0 ? 0 : path_end_[path_count_ - 1];
  std::uint32_t end = begin;
  const std::uint32_t u = source(2 * chain);
  const std::uint32_t v = target(2 * chain);
  for (std::uint32_t h = reach_[u].arrived_by; h != no_index; h = reach_[source(h)].arrived_by) {
    path_half_chains_[end++] = h;
  }
  std::ranges::reverse(path_half_chains_.subspan(begin, end - begin));
  path_half_chains_[end++] = 2 * chain;
  for (std::uint32_t h = reach_[v].arrived_by; h != no_index; h = reach_[source(h)].arrived_by) {
    path_half_chains_[end++] = h ^ 1;
  }
  path_end_[path_count_++] = end;

  const std::span<const std::uint32_t> path = path_half_chains_.subspan(begin, end - begin);
  for (const std::uint32_t h : path) {
    open_length_[h / 2] = closed;
    --reach_[source(h)].open_chains;
    --reach_[target(h)].open_chains;
  }
  for (const std::uint32_t h : path.first(path.size() - 1)) join_omega(target(h));
}

void LoopOptimizer::find_branches() {
  branch_count_ = 0;
  for (std::uint32_t root = 0; root < junction_count_; ++root) {
    const bool in_omega = reach_[root].distance == 0 && reach_[root].arrived_by == no_index;
    if (!in_omega || reach_[root].open_chains == 0) continue;
    // breadth first; the list of branch vertices is the queue
    std::uint32_t head = branch_count_;
    const std::uint32_t root_vertex = junctions_[root].vertex;
    add_branch(root, root_vertex);
    for (; head < branch_count_; ++head) {
      const std::uint32_t junction = junction_of_vertex_[branches_[head].vertex];
      if (junction != no_index) add_branch(junction, root_vertex);
    }
  }
  branches_are_known_ = true;
}

/// Appends what the open chains at `junction` lead to.
void LoopOptimizer::add_branch(std::uint32_t junction, std::uint32_t root_vertex) {
  reach_[junction].source = no_index;  // visited
  std::uint32_t half_chain = junctions_[junction].first_half_chain;
  for (; half_chain != no_index; half_chain = half_chains_[half_chain].next) {
    if (open_length_[half_chain / 2] == closed) continue;
    open_length_[half_chain / 2] = closed;
    const Chain& chain = chains_[half_chain / 2];
    std::uint32_t parent = junctions_[junction].vertex;
    const std::uint32_t last = chain.end_step - 1;
    for (std::uint32_t i = chain.first_step; i < last; ++i) {
      if ((half_chain & 1) == 0) {
        branches_[branch_count_++] = {chain_steps_[i].vertex, parent, chain_steps_[i].half_edge, root_vertex};
      } else {
        const std::uint32_t mirrored = last - (i - chain.first_step);
        branches_[branch_count_++] = {chain_steps_[mirrored - 1].vertex, parent,
                                      chain_steps_[mirrored].half_edge ^ 1, root_vertex};
      }
      parent = branches_[branch_count_ - 1].vertex;
    }
    const std::uint32_t end = target(half_chain);
    if (reach_[end].source == no_index) continue;
    reach_[end].source = no_index;
    const std::uint32_t half_edge =
        (half_chain & 1) == 0 ? chain_steps_[last].half_edge : chain_steps_[chain.first_step].half_edge ^ 1;
    branches_[branch_count_++] = {junctions_[end].vertex, parent, half_edge, root_vertex};
  }
}

Status LoopOptimizer::weights(LoopCost cost, std::span<double> weights) {
  if (!is_prepared_) return Status::disconnected;
  if (weights.size() < vertex_count_) return Status::buffer_too_small;
  const std::span<const double> distance = distance_[static_cast<std::size_t>(cost)];
  find_trails(distance);

  std::ranges::fill(weights.first(vertex_count_), 0.0);
  weights[l_] = 1;
  std::uint32_t begin = 0;
  for (const std::uint32_t end : path_end_.first(path_count_)) {
    const std::span<const std::uint32_t> path = path_half_chains_.subspan(begin, end - begin);
    begin = end;
    double path_length = 0;
    for (const std::uint32_t h : path) path_length += distance[chains_[h / 2].end_step - 1];
    const double start_weight = weights[junctions_[source(path.front())].vertex];
    const double end_weight = weights[junctions_[target(path.back())].vertex];
    const double slope = (end_weight - start_weight) / path_length;
    const auto [lowest, highest] = std::minmax(start_weight, end_weight);  // against the last bit's rounding

    double walked = 0;
    for (const std::uint32_t h : path) {
      const Chain& chain = chains_[h / 2];
      const std::uint32_t last = chain.end_step - 1;
      const double length = distance[last];
      // w_i = w_s + d(s, i) / d(s, e) (w_e - w_s); against its direction a chain is measured from its end
      const bool forward = (h & 1) == 0;
      const double offset = start_weight + slope * (forward ? walked : walked + length);
      const double chain_slope = forward ? slope : -slope;
      for (std::uint32_t i = chain.first_step; i < last; ++i) {
        weights[chain_steps_[i].vertex] = std::clamp(offset + chain_slope * distance[i], lowest, highest);
      }
      walked += length;
      if (h != path.back()) {
        weights[junctions_[target(h)].vertex] = std::clamp(start_weight + slope * walked, lowest, highest);
      }
    }
  }
  for (const BranchVertex& branch : branches()) weights[branch.vertex] = weights[branch.root];
  return Status::ok;
}

Status LoopOptimizer::decompose(LoopCost cost) {
  if (!is_prepared_) return Status::disconnected;
  find_trails(distance_[static_cast<std::size_t>(cost)]);
  std::uint32_t begin = 0;
  std::uint32_t step_count = 0;
  for (const std::uint32_t end : path_end_.first(path_count_)) {
    const std::span<const std::uint32_t> path = path_half_chains_.subspan(begin, end - begin);
    begin = end;
    Trail& trail = trails_[trail_count_++];
    trail = {junctions_[source(path.front())].vertex, junctions_[target(path.back())].vertex, step_count, 0};
    for (const std::uint32_t h : path) {
      const Chain& chain = chains_[h / 2];
      if ((h & 1) == 0) {
        for (std::uint32_t i = chain.first_step; i < chain.end_step; ++i)
          trail_steps_[step_count++] = chain_steps_[i];
        continue;
      }
      for (std::uint32_t i = chain.end_step; i-- > chain.first_step;) {
        const std::uint32_t vertex =
            i == chain.first_step ? junctions_[target(h)].vertex : chain_steps_[i - 1].vertex;
        trail_steps_[step_count++] = {chain_steps_[i].half_edge ^ 1, vertex};
      }
    }
    trail.step_count = step_count - trail.first_step;
  }
  return Status::ok;
}

}  // namespace alces
