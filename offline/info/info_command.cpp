// alces info: what is in there? One JSON object per thing; the text for people is the same object, indented.
#include <fmt/chrono.h>
#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "alces_drivers/stamp.h"
#include "alces_platform/recording/byte_source.h"
#include "alces_platform/recording/recording_reader.h"
#include "bag_info.h"
#include "offline/io/bags/own_recording.h"
#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "offline/io/files/json_text.h"
#include "offline/io/map_folder/stored_scan_file.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_source.h"
#include "offline/program/bag_options.h"
#include "offline/program/command.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* info_footer = R"(Examples:
  alces info scans/                a folder of scans: counts, extent, odometry, points that are not finite
  alces info town                  a map folder: its trajectory, points, graph, and the summary of its run
  alces info drive.mcap            a recorded drive: duration, messages by topic, whether it is whole
  alces info bag/                  a bag of ROS: topics, rates, frames, fields, and which would make a map
  alces info graph.g2o --json      a pose graph (g2o, TORO), for machines

Also: trajectories (TUM, KITTI, 4x4 matrices, 3DTK) and single scans (PLY, PCD, LAS, 3DTK, KITTI, CSV).)";

class Extent {
 public:
  void include(const Eigen::Vector3d& point) { box_.extend(point); }
  [[nodiscard]] Json json() const {
    Json json;
    if (box_.isEmpty()) return json;
    static constexpr const char* names[3] = {"x_m", "y_m", "z_m"};
    for (int axis = 0; axis < 3; ++axis) {
      const auto round = [](double value) { return std::round(value * 1000) / 1000 + 0.0; };
      json[names[axis]] = {round(box_.min()(axis)), round(box_.max()(axis))};
    }
    return json;
  }

 private:
  Eigen::AlignedBox3d box_;
};

Json describe(const Trajectory& trajectory) {
  Json json;
  double length_m = 0;
  double longest_step_m = 0;
  Extent extent;
  std::size_t invalid = 0;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const Pose& pose = trajectory.poses[i];
    if (!is_valid(pose)) {
      ++invalid;
      continue;
    }
    extent.include(pose.translation_m);
    if (i == 0 || !is_valid(trajectory.poses[i - 1])) continue;
    const double step_m = (pose.translation_m - trajectory.poses[i - 1].translation_m).norm();
    length_m += step_m;
    longest_step_m = std::max(longest_step_m, step_m);
  }
  json["poses"] = trajectory.size();
  json["path_length_m"] = length_m;
  json["longest_step_m"] = longest_step_m;
  json["extent"] = extent.json();
  json["invalid_poses"] = invalid;
  if (trajectory.has_time && trajectory.size() > 0) {
    const auto [first, last] = std::minmax_element(trajectory.stamps_s.begin(), trajectory.stamps_s.end());
    json["first_stamp_s"] = *first;
    json["time_span_s"] = *last - *first;
  } else {
    json["stamps"] = "scan numbers";
  }
  return json;
}

Json describe(ScanSource& scans) {
  ScanPoints scan;
  const std::vector<Point>& points = scan.points;
  std::vector<std::size_t> counts;
  Trajectory odometry;
  odometry.has_time = true;
  std::size_t total = 0;
  std::size_t not_finite = 0;
  std::size_t empty = 0;
  double max_range_m = 0;
  Extent extent;
  Progress progress("reading scans");
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (!scans.read(i, scan)) break;
    const std::optional<Pose> pose = scans.odometry(i);
    const std::optional<double> stamp_s = scans.stamp_s(i);
    if (pose) {
      odometry.poses.push_back(*pose);
      odometry.stamps_s.push_back(stamp_s.value_or(static_cast<double>(scans.number(i))));
    }
    if (!stamp_s) odometry.has_time = false;
    for (const Point& point : points) {
      if (!is_finite(point)) {
        ++not_finite;
        continue;
      }
      const Eigen::Vector3d in_body = Eigen::Vector3f(point.x, point.y, point.z).cast<double>();
      max_range_m = std::max(max_range_m, in_body.norm());
      extent.include(pose ? *pose * in_body : in_body);
    }
    if (points.empty()) ++empty;
    counts.push_back(points.size());
    total += points.size();
    progress(i + 1, scans.size());
  }
  std::sort(counts.begin(), counts.end());
  Json json;
  json["description"] = scans.description();
  json["scans"] = scans.size();
  if (const std::string channels = scans.channels(); !channels.empty()) json["channels"] = channels;
  json["points"] = total;
  if (counts.size() > 1) {
    json["points_per_scan"] = {
        {"min", counts.front()}, {"median", counts[counts.size() / 2]}, {"max", counts.back()}};
    json["empty_scans"] = empty;
  }
  json["points_not_finite"] = not_finite;
  json["longest_range_m"] = max_range_m;
  json[odometry.poses.empty() ? "extent_in_body_frame" : "extent_at_odometry"] = extent.json();
  if (!odometry.poses.empty()) json["odometry"] = describe(odometry);
  if (const auto warnings = scans.warnings(); !warnings.empty()) json["warnings"] = warnings;
  return json;
}

/// Counts by tag; vertices and edges in the way of g2o, TORO and HOG-Man.
Json describe_graph(const fs::path& file) {
  std::ifstream stream(file);
  if (!stream) throw InputError(file, "cannot be opened for reading");
  std::map<std::string, std::size_t> tags;
  std::size_t vertices = 0;
  std::size_t edges = 0;
  std::size_t not_between_neighbours = 0;
  Extent extent;
  std::string line;
  for (std::size_t number = 1; std::getline(stream, line); ++number) {
    std::istringstream words(line);
    std::string tag;
    if (!(words >> tag) || tag.front() == '#') continue;
    ++tags[tag];
    if (tag.rfind("VERTEX", 0) == 0) {
      const bool planar = tag == "VERTEX2" || tag == "VERTEX_SE2" || tag == "VERTEX_XY";
      long long id = 0;
      Eigen::Vector3d position = Eigen::Vector3d::Zero();
      words >> id >> position.x() >> position.y();
      if (!planar) words >> position.z();
      if (!words) throw InputError(file, number, "a vertex needs a number and a position");
      ++vertices;
      extent.include(position);
    } else if (tag.rfind("EDGE", 0) == 0) {
      long long from = 0;
      long long to = 0;
      if (!(words >> from >> to)) throw InputError(file, number, "an edge needs the numbers of two vertices");
      ++edges;
      if (std::abs(from - to) != 1) ++not_between_neighbours;
    }
  }
  if (stream.bad()) throw InputError(file, "cannot be read to its end; check the disk");
  if (vertices + edges == 0)
    throw InputError(file, "holds no VERTEX and no EDGE lines; is this a pose graph?");
  Json json;
  json["vertices"] = vertices;
  json["edges"] = edges;
  json["edges_that_close_loops"] = not_between_neighbours;
  json["extent"] = extent.json();
  json["lines_by_tag"] = tags;
  return json;
}

/// "2011-07-05 09:14:03Z".
std::string utc_text(std::int64_t utc_ns) {
  const auto since_epoch = std::chrono::nanoseconds(utc_ns);
  const std::chrono::sys_seconds time(std::chrono::floor<std::chrono::seconds>(since_epoch));
  return fmt::format("{:%Y-%m-%d %H:%M:%S}Z", time);
}

/// The members of run.json; long lists become their length, loops are counted by what became of them.
Json summary_of_run(const fs::path& file) {
  std::string bytes;
  read_file(file, bytes);
  const Json run = Json::parse(bytes, nullptr, false);
  if (!run.is_object()) throw InputError(file, "is no JSON object; map the scans again");
  Json summary;
  for (const auto& [key, value] : run.items()) {
    if (key == "loops" && value.is_array()) {
      const auto taken = std::count_if(value.begin(), value.end(), [](const Json& loop) {
        return loop.is_object() && loop.contains("accepted") && loop["accepted"] == true;
      });
      summary["loops_closed"] = taken;
      summary["loops_refused"] = static_cast<std::ptrdiff_t>(value.size()) - taken;
    } else if (value.is_array() && value.size() > 4) {
      summary[key] = fmt::format("{} entries", value.size());
    } else {
      summary[key] = value;
    }
  }
  return summary;
}

/// Reads and checks all of it.
Json describe_stored_scans(const fs::path& path, std::size_t poses) {
  StoredScanFile file(path);
  if (file.size() != poses)
    throw InputError(path,
                     fmt::format("holds {} scans, and trajectory.tum {} poses; they are of different maps",
                                 file.size(), poses));
  std::uint64_t points = 0;
  std::uint64_t samples = 0;
  std::map<std::string, std::size_t> channels;
  double coarsest_cell_m = 0;
  Progress progress("checking stored scans");
  for (std::size_t row = 0; row < file.size(); ++row) {
    const StoredScanView& scan = file.read(row);
    points += scan.point_count();
    samples += scan.sample_count();
    coarsest_cell_m = std::max(coarsest_cell_m, static_cast<double>(scan.cell_size_m()));
    if (scan.has_intensity()) ++channels["intensity"];
    if (scan.has_time()) ++channels["time"];
    if (!scan.signature().empty()) ++channels["signature"];
    if (scan.seen_from()) ++channels["seen_from"];
    progress(row + 1, file.size());
  }
  Json json;
  json["scans"] = file.size();
  json["points"] = points;
  json["samples"] = samples;
  json["bytes"] = fs::file_size(path);
  json["coarsest_cell_m"] = std::round(coarsest_cell_m * 1e6) / 1e6;
  if (!channels.empty()) json["scans_with_channel"] = channels;
  return json;
}

Json describe_map(const fs::path& folder) {
  Json json;
  const Trajectory trajectory = read_trajectory(folder);
  json["trajectory"] = describe(trajectory);
  if (const fs::path ply = folder / "map.ply"; fs::exists(ply)) {
    Json points = describe(*open_scans(ply));
    points.erase("longest_range_m");
    json["map.ply"] = {{"points", points["points"]},
                       {"points_not_finite", points["points_not_finite"]},
                       {"extent", points["extent_in_body_frame"]}};
  }
  if (const fs::path scans = folder / "scans.alces"; fs::exists(scans))
    json["scans.alces"] = describe_stored_scans(scans, trajectory.size());
  if (const fs::path graph = folder / "graph.g2o"; fs::exists(graph))
    json["graph.g2o"] = describe_graph(graph);
  if (const fs::path run = folder / "run.json"; fs::exists(run)) json["run.json"] = summary_of_run(run);
  return json;
}

Json describe_recording(const fs::path& file) {
  FileSource source(file.c_str());
  if (!source.is_open()) throw InputError(file, "cannot be opened for reading");
  const RecordingSummary summary = summarise_recording(source);
  check_read(file, summary.read_error);
  if (!summary.is_recording) {
    throw InputError(file, summary.problems.empty() ? "is no recording (MCAP)" : summary.problems.front());
  }
  Json json;
  json["is_whole"] = summary.is_whole;
  if (!summary.problems.empty()) json["problems"] = summary.problems;
  json["bytes"] = summary.bytes;
  json["messages"] = summary.messages;
  json["messages_missing"] = summary.messages_missing;
  json["duration_s"] = seconds(summary.end_ns - summary.begin_ns);
  if (summary.utc_offset_ns != 0) json["begin_utc"] = utc_text(summary.begin_ns + summary.utc_offset_ns);
  json["has_configuration"] = summary.has_configuration;
  Json topics = Json::object();
  for (const RecordingSummary::Topic& topic : summary.topics)
    topics[topic.name] = {{"type", topic.type}, {"messages", topic.messages}, {"bytes", topic.bytes}};
  json["topics"] = topics;
  return json;
}

Json with_kind(const char* kind, const fs::path& path, const Json& content) {
  Json json;
  json["path"] = path.string();
  json["kind"] = kind;
  json.update(content);
  return json;
}

Json describe(const fs::path& path, const BagTopics& asked) {
  if (is_ros_bag(path)) {
    Progress progress("reading the bag");
    return with_kind("bag", path, describe_bag(path, asked, std::ref(progress)));
  }
  const auto scans = [&] { return with_kind("scans", path, describe(*open_scans(path))); };
  const auto trajectory = [&] { return with_kind("trajectory", path, describe(read_trajectory(path))); };
  if (fs::is_directory(path)) {
    const bool has_map = fs::exists(path / "run.json") || fs::exists(path / "map.ply");
    if (has_map && fs::exists(path / "trajectory.tum"))
      return with_kind("map folder", path, describe_map(path));
    std::unique_ptr<ScanSource> source;
    try {
      source = open_scans(path);
    } catch (const InputError&) {
      try {
        return trajectory();  // a folder of .frames or .pose files alone
      } catch (const InputError&) {
        throw InputError(path, "holds neither scans nor a map nor a trajectory that alces knows");
      }
    }
    return with_kind("scans", path, describe(*source));
  }
  const std::string extension = path.extension().string();
  if (extension == ".mcap") return with_kind("recording", path, describe_recording(path));
  if (extension == ".g2o" || extension == ".graph")
    return with_kind("pose graph", path, describe_graph(path));
  for (const char* scan : {".3d", ".pcd", ".ply", ".las", ".bin", ".xyz", ".asc"}) {
    if (extension == scan) return scans();
  }
  if (extension != ".csv") return trajectory();
  try {
    return trajectory();
  } catch (const InputError&) {
    return scans();
  }
}

/// "path_length_m" reads "path length m"; the names of files and tags stay.
std::string spoken(std::string key) {
  if (key.find('.') == std::string::npos && std::islower(static_cast<unsigned char>(key.front())) != 0) {
    std::replace(key.begin(), key.end(), '_', ' ');
  }
  return key;
}

void print(const Json& json, int indent) {
  for (const auto& [name, value] : json.items()) {
    if (value.is_null() || name.empty()) continue;
    const std::string key = spoken(name);
    const std::string margin(static_cast<std::size_t>(indent), ' ');
    if (value.is_object()) {
      fmt::print("{}{}:\n", margin, key);
      print(value, indent + 2);
    } else if (value.is_array() && value.size() == 2 && value[0].is_number()) {
      fmt::print("{}{}: {} to {}\n", margin, key, json_text(value[0], -1), json_text(value[1], -1));
    } else if (value.is_array()) {
      fmt::print("{}{}:\n", margin, key);
      for (const Json& entry : value) {
        fmt::print("{}  {}\n", margin, entry.is_string() ? entry.get<std::string>() : json_text(entry, -1));
      }
    } else if (value.is_string()) {
      fmt::print("{}{}: {}\n", margin, key, value.get<std::string>());
    } else if (value.is_number_float()) {
      fmt::print("{}{}: {:.3f}\n", margin, key, value.get<double>());
    } else {
      fmt::print("{}{}: {}\n", margin, key, json_text(value, -1));
    }
  }
}

}  // namespace

void add_info_command(CLI::App& alces) {
  struct Options {
    std::string path;
    BagTopics bag;
    bool json = false;
  };
  auto options = std::make_shared<Options>();
  CLI::App* verb = alces.add_subcommand("info", "What a file or folder holds.");
  verb->footer(info_footer);
  verb->add_option("ANY", options->path,
                   "scans, a recording, a bag, a trajectory, a map folder or a pose graph")
      ->required();
  add_bag_options(*verb, options->bag);
  verb->add_flag("--json", options->json, "for machines");
  verb->callback([options] {
    if (!fs::exists(options->path)) throw InputError(options->path, "does not exist; check the path");
    const Json json = describe(fs::path(options->path), options->bag);
    if (options->json) {
      fmt::print("{}\n", json_text(json));
    } else if (json["kind"] == "bag") {
      fmt::print("{}", bag_text(json));
    } else {
      print(json, 0);
    }
  });
}

}  // namespace alces::offline
