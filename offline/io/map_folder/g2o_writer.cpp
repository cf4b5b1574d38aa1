#include <fmt/format.h>

#include <iterator>
#include <string>

#include "map_writer.h"
#include "offline/io/files/output_file.h"

namespace alces::offline {
namespace {

// 17 digits where it costs nothing to give all: an optimiser starts again from exactly these numbers.
void append_pose(std::string& line, const Pose& pose) {
  const Eigen::Vector3d& t = pose.translation_m;
  const Eigen::Quaterniond& q = pose.rotation;
  fmt::format_to(std::back_inserter(line), " {} {} {} {} {} {} {}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(),
                 q.w());
}

}  // namespace

Matrix6d g2o_information(const EdgeVariance& variance) {
  constexpr double half_angle = 4;  // (angle / half the angle)^2
  Matrix6d information = Matrix6d::Zero();
  information.topLeftCorner<3, 3>().diagonal() << 1 / variance.x_m2, 1 / variance.y_m2, 1 / variance.z_m2;
  for (int axis = 0; axis < 3; ++axis) {
    const double about_axis_rad2 =
        variance.rotation_rad2 * variance.rotation_shares[static_cast<std::size_t>(axis)];
    information(3 + axis, 3 + axis) = half_angle / about_axis_rad2;
  }
  return information;
}

void write_g2o(const std::filesystem::path& file, const PoseGraph& graph) {
  OutputFile output(file);
  std::string line;
  for (std::uint32_t i = 0; i < graph.vertex_count(); ++i) {
    line = fmt::format("VERTEX_SE3:QUAT {}", i);
    append_pose(line, graph.poses()[i]);
    output.write(line + "\n");
  }
  if (graph.vertex_count() > 0) output.write("FIX 0\n");
  for (const Edge& edge : graph.edges()) {
    line = fmt::format("EDGE_SE3:QUAT {} {}", edge.from, edge.to);
    append_pose(line, edge.from_from_to);
    const Matrix6d information = g2o_information(edge.variance);
    for (int row = 0; row < 6; ++row) {
      for (int column = row; column < 6; ++column) {
        fmt::format_to(std::back_inserter(line), " {:.12g}", information(row, column));
      }
    }
    output.write(line + "\n");
  }
  output.commit();
}

}  // namespace alces::offline
