#include "loop_back_ends.h"

#include <exception>
#include <span>

#include "hogman.h"
#include "toro.h"

namespace alces::offline {
namespace {

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
      for (; edge_count_ < graph.edge_count(); ++edge_count_)
        hogman_.add_constraint(constraint_of(graph.edges()[edge_count_]));
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

std::unique_ptr<GraphRelaxation> make_toro_relaxation() {
  return std::make_unique<ToroRelaxation>();
}

std::unique_ptr<GraphRelaxation> make_hogman_relaxation() {
  return std::make_unique<HogManRelaxation>();
}

void add_loop_back_ends() {
  add_loop_back_end("toro", make_toro_relaxation);
  add_loop_back_end("hogman", make_hogman_relaxation);
}

}  // namespace alces::offline
