#include "graph_conversion.h"

#include <algorithm>
#include <vector>

#include "offline/optimize/graph/graph_file.h"

namespace alces::offline {

Trajectory trajectory_of_graph(const MapConversion& conversion) {
  std::vector<ConstraintVertex> vertices = read_graph(conversion.in).graph.vertices;
  std::sort(vertices.begin(), vertices.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  Trajectory trajectory;
  for (const ConstraintVertex& vertex : vertices) {
    trajectory.stamps_s.push_back(static_cast<double>(vertex.id));
    trajectory.poses.push_back(vertex.map_from_body);
  }
  return trajectory;
}

void write_graph_as(const ConstraintGraph& graph, const MapConversion& conversion,
                    MapConversionReport& report) {
  write_graph(conversion.out, graph,
              conversion.form == ConversionForm::toro ? GraphFormat::toro : GraphFormat::g2o);
  report.poses = graph.vertices.size();
  report.edges = graph.constraints.size();
}

}  // namespace alces::offline
