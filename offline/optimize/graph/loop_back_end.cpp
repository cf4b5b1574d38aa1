#include "loop_back_end.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "offline/io/files/error.h"
#include "offline/io/map_folder/map_writer.h"

namespace alces::offline {
namespace {

struct AddedBackEnd {
  std::string name;
  MakeGraphRelaxation make;
};

std::vector<AddedBackEnd>& added_back_ends() {
  static std::vector<AddedBackEnd> back_ends;
  return back_ends;
}

}  // namespace

ConstraintVertex vertex_of(const PoseGraph& graph, std::uint32_t i) {
  return {.id = i, .map_from_body = graph.poses()[i], .is_fixed = i == 0};
}

Constraint constraint_of(const Edge& edge) {
  Constraint constraint;
  constraint.from = edge.from;
  constraint.to = edge.to;
  constraint.from_from_to = edge.from_from_to;
  constraint.information = g2o_information(edge.variance);
  return constraint;
}

ConstraintGraph constraint_graph_of(const PoseGraph& graph) {
  ConstraintGraph constraints;
  for (std::uint32_t i = 0; i < graph.vertex_count(); ++i)
    constraints.vertices.push_back(vertex_of(graph, i));
  for (const Edge& edge : graph.edges()) constraints.constraints.push_back(constraint_of(edge));
  return constraints;
}

void add_loop_back_end(std::string name, MakeGraphRelaxation make) {
  const std::vector<std::string> names = loop_back_end_names();
  if (std::find(names.begin(), names.end(), name) == names.end())
    added_back_ends().push_back({std::move(name), make});
}

std::vector<std::string> loop_back_end_names() {
  std::vector<std::string> names{"elch"};
  for (const AddedBackEnd& each : added_back_ends()) names.push_back(each.name);
  names.emplace_back("none");
  return names;
}

std::unique_ptr<GraphRelaxation> make_graph_relaxation(std::string_view name) {
  if (name == "elch" || name == "none") return nullptr;
  for (const AddedBackEnd& each : added_back_ends())
    if (each.name == name) return each.make();
  throw UsageError(fmt::format("no way to close loops is called {}", name));
}

}  // namespace alces::offline
