#include "graph_conversion.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "alces_offline/error.h"
#include "alces_offline/graph/graph_file.h"

namespace alces::offline {

Trajectory trajectory_of_graph(const MapConversion& conversion) {
  std::vector<ConstraintVertex> vertices = read_graph(conversion.in).graph.vertices;
  std::sort(vertices.begin(), vertices.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  if (conversion.form == ConversionForm::frames && vertices.front().id < 0)
    throw InputError(conversion.in,
                     fmt::format("3DTK numbers frames from 0, and a vertex has the id {}; write TUM",
                                 vertices.front().id));
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
