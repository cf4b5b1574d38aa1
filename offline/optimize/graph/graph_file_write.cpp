#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

#include "graph_file.h"
#include "offline/io/files/output_file.h"
#include "planar_pose.h"

namespace alces::offline {
namespace {

void append(std::string& line, double number) {
  fmt::format_to(std::back_inserter(line), " {}", number);
}

void append_planar(std::string& line, const Pose& pose) {
  append(line, pose.translation_m.x());
  append(line, pose.translation_m.y());
  append(line, heading_rad(pose));
}

void append_euler(std::string& line, const Pose& pose) {
  for (const double t : pose.translation_m) append(line, t);
  const Eigen::Quaterniond& q = pose.rotation;
  const double sine_of_pitch = 2 * (q.w() * q.y() - q.z() * q.x());
  append(line, std::atan2(2 * (q.w() * q.x() + q.y() * q.z()), 1 - 2 * (q.x() * q.x() + q.y() * q.y())));
  append(line, std::asin(std::clamp(sine_of_pitch, -1.0, 1.0)));
  append(line, std::atan2(2 * (q.w() * q.z() + q.x() * q.y()), 1 - 2 * (q.y() * q.y() + q.z() * q.z())));
}

void append_quaternion(std::string& line, const Pose& pose) {
  for (const double t : pose.translation_m) append(line, t);
  for (const double q : pose.rotation.coeffs()) append(line, q);
}

template <typename Matrix>
void append_upper_triangle(std::string& line, const Matrix& matrix) {
  for (int row = 0; row < matrix.rows(); ++row) {
    for (int column = row; column < matrix.cols(); ++column) append(line, matrix(row, column));
  }
}

void append_pose(std::string& line, const Pose& pose, bool is_planar, GraphFormat format) {
  if (is_planar) {
    append_planar(line, pose);
  } else if (format == GraphFormat::toro) {
    append_euler(line, pose);
  } else {
    append_quaternion(line, pose);
  }
}

void append_information(std::string& line, const Constraint& constraint, bool is_planar, GraphFormat format) {
  const Eigen::Matrix3d& i = constraint.planar_information;
  if (!is_planar) {
    Matrix6d information = constraint.information;
    if (format == GraphFormat::toro) {
      information.rightCols<3>() /= 2;
      information.bottomRows<3>() /= 2;
    }
    append_upper_triangle(line, information);
  } else if (format == GraphFormat::toro) {
    for (const double entry : {i(0, 0), i(0, 1), i(1, 1), i(2, 2), i(0, 2), i(1, 2)}) append(line, entry);
  } else {
    append_upper_triangle(line, i);
  }
}

}  // namespace

void write_graph(const std::filesystem::path& file, const ConstraintGraph& graph, GraphFormat format) {
  const bool is_toro = format == GraphFormat::toro;
  const char* const vertex_tag =
      graph.is_planar ? (is_toro ? "VERTEX2" : "VERTEX_SE2") : (is_toro ? "VERTEX3" : "VERTEX_SE3:QUAT");
  const char* const edge_tag =
      graph.is_planar ? (is_toro ? "EDGE2" : "EDGE_SE2") : (is_toro ? "EDGE3" : "EDGE_SE3:QUAT");

  OutputFile output(file);
  std::string line;
  for (const ConstraintVertex& vertex : graph.vertices) {
    line = fmt::format("{} {}", vertex_tag, vertex.id);
    append_pose(line, vertex.map_from_body, graph.is_planar, format);
    output.write(line += '\n');
  }
  const bool only_first = std::none_of(graph.vertices.begin() + (graph.vertices.empty() ? 0 : 1),
                                       graph.vertices.end(), [](const auto& v) { return v.is_fixed; });
  for (const ConstraintVertex& vertex : graph.vertices) {
    if (vertex.is_fixed && !(is_toro && only_first)) output.write(fmt::format("FIX {}\n", vertex.id));
  }
  for (const Constraint& constraint : graph.constraints) {
    line = fmt::format("{} {} {}", edge_tag, graph.vertices[constraint.from].id,
                       graph.vertices[constraint.to].id);
    append_pose(line, constraint.from_from_to, graph.is_planar, format);
    append_information(line, constraint, graph.is_planar, format);
    output.write(line += '\n');
  }
  output.commit();
}

}  // namespace alces::offline
