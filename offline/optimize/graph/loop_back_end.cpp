#include "loop_back_end.h"

#include <array>
#include <exception>
#include <utility>

#include "hogman.h"
#include "offline/io/map_folder/map_writer.h"
#include "toro.h"

namespace alces::offline {
namespace {

constexpr std::array<std::pair<LoopBackEnd, std::string_view>, 4> back_ends{{{LoopBackEnd::elch, "elch"},
                                                                             {LoopBackEnd::toro, "toro"},
                                                                             {LoopBackEnd::hogman, "hogman"},
                                                                             {LoopBackEnd::none, "none"}}};

ConstraintVertex vertex_of(const PoseGraph& graph, std::uint32_t i) {
  return {.id = i, .map_from_body = graph.poses()[i], .is_fixed = i == 0};
}

// Nothing thrown may reach the mapper.
template <typename Optimize>
bool relaxed(std::span<Pose> map_from_body, std::string& problem, const Optimize& optimize) {
  try {
    const std::vector<ConstraintVertex>& vertices = optimize();
    for (const ConstraintVertex& vertex : vertices) {
      if (is_valid(vertex.map_from_body)) continue;
      problem = "the optimiser returned a pose that is none";
      return false;
    }
    for (std::size_t i = 1; i < map_from_body.size(); ++i) map_from_body[i] = vertices[i].map_from_body;
    return true;
  } catch (const std::exception& error) {
    problem = error.what();
    return false;
  }
}

class ToroRelaxation final : public GraphRelaxation {
 public:
  bool relax(const PoseGraph& graph, std::span<Pose> map_from_body) override {
    return relaxed(map_from_body, problem_, [&]() -> const std::vector<ConstraintVertex>& {
      constraints_ = constraint_graph_of(graph);
      optimize_toro(constraints_);
      return constraints_.vertices;
    });
  }

 private:
  ConstraintGraph constraints_;
};

class HogManRelaxation final : public GraphRelaxation {
 public:
  bool relax(const PoseGraph& graph, std::span<Pose> map_from_body) override {
    return relaxed(map_from_body, problem_, [&]() -> const std::vector<ConstraintVertex>& {
      for (; vertex_count_ < graph.vertex_count(); ++vertex_count_)
        hogman_.add_vertex(vertex_of(graph, vertex_count_));
      for (; edge_count_ < graph.edge_count(); ++edge_count_) {
        const Edge& edge = graph.edges()[edge_count_];
        hogman_.add_constraint(constraint_of(edge));
      }
      hogman_.update();
      return hogman_.graph().vertices;
    });
  }

 private:
  HogMan hogman_{false, {}};
  std::uint32_t vertex_count_ = 0;
  std::uint32_t edge_count_ = 0;
};

}  // namespace

std::string_view name(LoopBackEnd back_end) {
  for (const auto& [each, text] : back_ends)
    if (each == back_end) return text;
  return "unknown";
}

std::optional<LoopBackEnd> loop_back_end(std::string_view name) {
  for (const auto& [back_end, text] : back_ends)
    if (text == name) return back_end;
  return std::nullopt;
}

std::vector<std::string> loop_back_end_names() {
  std::vector<std::string> names;
  for (const auto& [back_end, text] : back_ends) names.emplace_back(text);
  return names;
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

std::unique_ptr<GraphRelaxation> make_graph_relaxation(LoopBackEnd back_end) {
  switch (back_end) {
    case LoopBackEnd::toro:
      return std::make_unique<ToroRelaxation>();
    case LoopBackEnd::hogman:
      return std::make_unique<HogManRelaxation>();
    case LoopBackEnd::elch:
    case LoopBackEnd::none:
      break;
  }
  return nullptr;
}

}  // namespace alces::offline
