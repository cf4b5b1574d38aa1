#include "recorded_graph.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <utility>

#include "alces_platform/recording/byte_source.h"
#include "alces_platform/recording/recording_reader.h"
#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "offline/io/map_folder/map_writer.h"
#include "offline/optimize/graph/graph_file.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

Json read_loops(const fs::path& file) {
  std::string bytes;
  read_file(file, bytes);
  const Json run = Json::parse(bytes, nullptr, false);
  if (!run.is_object()) throw InputError(file, "is no JSON object; map the scans again");
  Json loops = run.value("loops", Json::array());
  if (!loops.is_array()) throw InputError(file, "\"loops\" is no list; map the scans again");
  return loops;
}

/// Numbers that are missing are 0: run.json of an older version.
double number(const Json& loop, const char* key) {
  return loop.contains(key) && loop[key].is_number() ? loop[key].get<double>() : 0;
}

std::uint32_t row(const Json& loop, const char* key, const fs::path& file, std::size_t i, std::size_t poses) {
  if (!loop.is_object() || !loop.contains(key) || !loop[key].is_number_unsigned() ||
      loop[key].get<std::size_t>() >= poses)
    throw InputError(file, fmt::format("loop {} names no scan below {} as \"{}\"", i, poses, key));
  return loop[key].get<std::uint32_t>();
}

}  // namespace

GraphEdgeRecord edge_record(const Constraint& constraint) {
  constexpr double half_angle = 4;  // (angle / half the angle)^2
  const Matrix6d covariance = constraint.information.llt().solve(Matrix6d::Identity());
  GraphEdgeRecord record;
  record.from = constraint.from;
  record.to = constraint.to;
  record.from_from_to = constraint.from_from_to;
  record.x_m2 = covariance(0, 0);
  record.y_m2 = covariance(1, 1);
  record.z_m2 = covariance(2, 2);
  record.rotation_rad2 = half_angle * covariance.bottomRightCorner<3, 3>().trace();
  return record;
}

RecordedGraph read_recorded_graph(const fs::path& map_folder, std::size_t poses) {
  RecordedGraph recorded;
  std::error_code ignored;
  std::set<std::pair<std::uint32_t, std::uint32_t>> closed;
  if (const fs::path file = map_folder / "run.json"; fs::exists(file, ignored)) {
    const Json loops = read_loops(file);
    for (std::size_t i = 0; i < loops.size(); ++i) {
      const Json& loop = loops[i];
      LoopRecord record;
      record.first = row(loop, "first", file, i, poses);
      record.last = row(loop, "last", file, i, poses);
      record.is_closed = loop.contains("accepted") && loop["accepted"] == true;
      record.distance_m = number(loop, "distance_m");
      record.overlap = number(loop, "overlap");
      record.rms_m = number(loop, "rms_m");
      record.mahalanobis2 = number(loop, "mahalanobis2");
      record.correction_m = number(loop, "correction_m");
      record.correction_rad = number(loop, "correction_deg") * std::numbers::pi / 180;
      record.iterations = static_cast<std::uint32_t>(std::clamp(number(loop, "iterations"), 0.0, 4e9));
      recorded.loops.push_back(record);
      recorded.verdicts.push_back(
          loop.contains("reason") && loop["reason"].is_string() ? loop["reason"].get<std::string>() : "");
      if (record.is_closed) closed.insert(std::minmax(record.first, record.last));
    }
    for (std::size_t i = 0; i < recorded.loops.size(); ++i) recorded.loops[i].verdict = recorded.verdicts[i];
  }
  const fs::path file = map_folder / "graph.g2o";
  if (!fs::exists(file, ignored)) return recorded;
  const ConstraintGraph graph = read_graph(file).graph;
  if (graph.is_planar || graph.vertices.size() != poses)
    throw InputError(file, fmt::format("has {} vertices and trajectory.tum {} poses; map the scans again",
                                       graph.vertices.size(), poses));
  for (const Constraint& constraint : graph.constraints) {
    GraphEdgeRecord edge = edge_record(constraint);
    edge.closes_loop = closed.count(std::minmax(edge.from, edge.to)) > 0;
    recorded.edges.push_back(edge);
  }
  return recorded;
}

ConstraintGraph graph_of_recording(const fs::path& recording, const std::vector<Pose>& map_from_body) {
  ConstraintGraph graph;
  for (const Pose& pose : map_from_body)
    graph.vertices.push_back({static_cast<std::int64_t>(graph.vertices.size()), pose, false});
  if (!graph.vertices.empty()) graph.vertices.front().is_fixed = true;
  FileSource source(recording.c_str());
  RecordingReader reader(source);
  if (!reader.open()) throw InputError(recording, "is no recording (MCAP)");
  RecordedMessage message;
  while (reader.next(message)) {
    const auto* edge = std::get_if<GraphEdgeRecord>(&message.content);
    if (edge == nullptr) continue;
    const EdgeVariance variance{edge->x_m2, edge->y_m2, edge->z_m2, edge->rotation_rad2};
    if (edge->from >= graph.vertices.size() || edge->to >= graph.vertices.size())
      throw InputError(recording, fmt::format("an edge goes from pose {} to {}, and the map has {}; make the "
                                              "map again with alces replay",
                                              edge->from, edge->to, graph.vertices.size()));
    if (!(variance.x_m2 > 0 && variance.y_m2 > 0 && variance.z_m2 > 0 && variance.rotation_rad2 > 0))
      throw InputError(recording, fmt::format("the variance of the edge from pose {} to {} is not positive",
                                              edge->from, edge->to));
    Constraint constraint;
    constraint.from = edge->from;
    constraint.to = edge->to;
    constraint.from_from_to = edge->from_from_to;
    constraint.information = g2o_information(variance);
    graph.constraints.push_back(constraint);
  }
  check_read(recording, source.error_number());
  if (graph.constraints.empty())
    throw InputError(recording, "holds no edges of a pose graph; make a map with alces replay");
  return graph;
}

}  // namespace alces::offline
