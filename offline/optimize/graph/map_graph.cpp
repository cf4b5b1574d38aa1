#include "map_graph.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <system_error>
#include <unordered_map>
#include <utility>
#include <vector>

#include "gauss_newton.h"
#include "graph_file.h"
#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "offline/io/files/json_text.h"
#include "offline/io/files/output_file.h"
#include "offline/io/files/staged_folder.h"
#include "offline/io/map_folder/map_health.h"
#include "offline/io/map_folder/map_writer.h"
#include "offline/io/map_folder/ply_stream.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;

nlohmann::json read_report(const fs::path& file) {
  if (!fs::exists(file)) return nullptr;
  std::string bytes;
  read_file(file, bytes);
  try {
    return nlohmann::json::parse(bytes);
  } catch (const nlohmann::json::exception& error) {
    throw InputError(file, std::string("is no JSON (") + error.what() + "); map again");
  }
}

// Rows of the trajectory by the scans' numbers that map.ply holds. Where stamps are times the numbers are
// taken as they come: map.ply is written row by row.
class RowOfScan {
 public:
  explicit RowOfScan(const Trajectory& trajectory)
      : rows_(trajectory.size()), has_time_(trajectory.has_time) {
    if (has_time_) return;
    for (std::size_t i = 0; i < rows_; ++i)
      row_.emplace(static_cast<std::uint32_t>(trajectory.stamps_s[i]), i);
  }
  [[nodiscard]] std::size_t operator()(const fs::path& file, std::uint32_t scan) {
    auto known = row_.find(scan);
    if (known == row_.end() && has_time_ && row_.size() < rows_)
      known = row_.emplace(scan, row_.size()).first;
    if (known == row_.end()) {
      throw InputError(file,
                       fmt::format("a point comes from scan {}, which trajectory.tum does not hold; map "
                                   "again",
                                   scan));
    }
    return known->second;
  }

 private:
  std::size_t rows_;
  bool has_time_;
  std::unordered_map<std::uint32_t, std::size_t> row_;
};

void write_points(const fs::path& to, const MapGraph& map, const ConstraintGraph& graph) {
  const fs::path from = map.folder / "map.ply";
  RowOfScan row_of_scan(map.trajectory);
  const bool has_intensity = ply_has_intensity(from);
  PlyMapWriter writer(
      to, has_intensity ? PlyMapWriter::Attribute::scan_and_intensity : PlyMapWriter::Attribute::scan);
  stream_ply_pieces(from, [&](const PlyPiece& piece) {
    const auto& [points, scans, intensity] = piece;
    if (scans.empty())
      throw InputError(from, "its points do not say which scan they come from; map the scans again");
    for (std::size_t begin = 0; begin < points.size();) {
      std::size_t end = begin;
      while (end < points.size() && scans[end] == scans[begin]) ++end;
      const std::size_t row = row_of_scan(from, scans[begin]);
      const Pose moved = graph.vertices[row].map_from_body * map.graph.vertices[row].map_from_body.inverse();
      writer.add(points.subspan(begin, end - begin), moved, scans[begin],
                 has_intensity ? intensity.subspan(begin, end - begin) : intensity);
      begin = end;
    }
  });
  writer.finish();
}

/// What `alces map` and `alces replay` write beside the map itself: of the drive, whatever its poses become.
constexpr std::array carried_files = {"trajectory_without_loops.tum", "scans.csv", "counters.csv",
                                      "scans.alces"};

void carry(const fs::path& from, const fs::path& to) {
  std::vector<char> part(std::size_t{1} << 20);  // stored scans may be more than memory holds
  for (const char* name : carried_files) {
    if (!fs::exists(from / name)) continue;
    std::ifstream source(from / name, std::ios::binary);
    OutputFile file(to / name);
    while (source) {
      source.read(part.data(), static_cast<std::streamsize>(part.size()));
      file.write({part.data(), static_cast<std::size_t>(source.gcount())});
    }
    if (!source.eof()) throw InputError(from / name, "cannot be read; check the path and its permissions");
    file.commit();
  }
}

Trajectory with_poses_of(const ConstraintGraph& graph, Trajectory trajectory) {
  trajectory.poses.clear();
  for (const ConstraintVertex& vertex : graph.vertices) trajectory.poses.push_back(vertex.map_from_body);
  return trajectory;
}

template <typename Write>
void put(StagedFolder& stage, const Write& write) {
  try {
    write(stage.staging());
    stage.commit();
  } catch (const OutputError& error) {
    throw OutputError(stage.renamed(error.what()));
  }
}

}  // namespace

MapGraph read_map_graph(const fs::path& folder) {
  MapGraph map;
  map.folder = folder;
  for (const char* name : {"graph.g2o", "trajectory.tum", "map.ply"}) {
    if (!fs::exists(folder / name)) {
      throw InputError(folder,
                       fmt::format("holds no {}; a folder that 'alces map' or 'alces replay' wrote is "
                                   "needed here, or a graph file",
                                   name));
    }
  }
  map.graph = read_graph(folder / "graph.g2o").graph;
  map.trajectory = read_trajectory(folder / "trajectory.tum");
  if (map.graph.is_planar || map.graph.vertices.size() != map.trajectory.size()) {
    throw InputError(folder, fmt::format("graph.g2o has {} vertices and trajectory.tum {} poses; they are of "
                                         "different maps",
                                         map.graph.vertices.size(), map.trajectory.size()));
  }
  map.report = read_report(folder / "run.json");
  return map;
}

nlohmann::json write_map_graph(const fs::path& out, const MapGraph& map, const ConstraintGraph& graph,
                               const nlohmann::json& optimize,
                               const std::function<void(const fs::path&)>& write_more) {
  std::error_code ignored;
  if (fs::equivalent(out, map.folder, ignored)) {
    throw UsageError(out.string() + ": is the map itself; write the better one to a folder of its own");
  }
  StagedFolder stage(out);
  const Trajectory trajectory = with_poses_of(graph, map.trajectory);
  nlohmann::json report = map.report.is_object() ? map.report : nlohmann::json::object();
  const auto loops = std::count_if(graph.constraints.begin(), graph.constraints.end(), is_loop);
  add_optimization(report, optimize, static_cast<std::size_t>(loops));
  put(stage, [&](const fs::path& folder) {
    write_tum(folder / "trajectory.tum", trajectory);
    write_graph(folder / "graph.g2o", graph, GraphFormat::g2o);
    write_3dtk_frames(folder / "frames", trajectory);
    write_points(folder / "map.ply", map, graph);
    carry(map.folder, folder);
    if (write_more) write_more(folder);
    OutputFile file(folder / "run.json");
    file.write(json_text(report) + "\n");
    file.commit();
  });
  return report;
}

void write_graph_folder(const fs::path& out, const ConstraintGraph& graph) {
  StagedFolder stage(out);
  Trajectory trajectory;
  for (const ConstraintVertex& vertex : graph.vertices)
    trajectory.stamps_s.push_back(static_cast<double>(vertex.id));
  put(stage, [&](const fs::path& folder) {
    write_tum(folder / "trajectory.tum", with_poses_of(graph, std::move(trajectory)));
    write_graph(folder / "graph.g2o", graph, GraphFormat::g2o);
  });
}

}  // namespace alces::offline
