#include "convert_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>
#include <utility>

#include "alces_drivers/stamp.h"
#include "alces_platform/recording/byte_source.h"
#include "alces_platform/recording/recording_reader.h"
#include "cloud_writer.h"
#include "graph_conversion.h"
#include "offline/io/bags/bag_trajectory.h"
#include "offline/io/bags/own_recording.h"
#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "offline/io/map_folder/ply_stream.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/ply_header.h"
#include "offline/io/scans/point_channels.h"
#include "offline/io/scans/scan_source.h"
#include "offline/optimize/graph/graph_file.h"
#include "recorded_graph.h"
#include "recording_file.h"
#include "scan_folder.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;
using ScanProgress = std::function<void(std::size_t, std::size_t)>;

constexpr std::array<std::pair<std::string_view, ConversionForm>, 13> form_names = {
    {{"ply", ConversionForm::ply},
     {"pcd", ConversionForm::pcd},
     {"las", ConversionForm::las},
     {"csv", ConversionForm::csv},
     {"kitti-scan", ConversionForm::kitti_scan},
     {"tum", ConversionForm::tum},
     {"kitti", ConversionForm::kitti},
     {"frames", ConversionForm::frames},
     {"g2o", ConversionForm::g2o},
     {"toro", ConversionForm::toro},
     {"graph", ConversionForm::toro},
     {"mcap", ConversionForm::mcap},
     {"scans", ConversionForm::scan_folder}}};

bool is_trajectory_form(ConversionForm form) {
  return form == ConversionForm::tum || form == ConversionForm::kitti || form == ConversionForm::frames;
}

bool is_graph_form(ConversionForm form) {
  return form == ConversionForm::g2o || form == ConversionForm::toro;
}

CloudForm cloud_form(ConversionForm form) {
  switch (form) {
    case ConversionForm::pcd:
      return CloudForm::pcd;
    case ConversionForm::las:
      return CloudForm::las;
    case ConversionForm::csv:
      return CloudForm::csv;
    case ConversionForm::kitti_scan:
      return CloudForm::kitti;
    default:
      return CloudForm::ply;
  }
}

/// Such a file needs neither its numbers parsed nor an origin: it is streamed whatever its size.
bool has_binary_floats(const fs::path& file) {
  std::string start(std::size_t{64} << 10, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(stream.gcount()));
  try {
    const PlyHeader header = read_ply_header(file, start);
    if (header.encoding == PlyEncoding::ascii || header.elements.empty()) return false;
    const auto& properties = header.elements[0].properties;
    return std::none_of(properties.begin(), properties.end(), [](const PlyProperty& property) {
      const bool is_scaled =
          property.type != NumberType::u8 && channel_called(property.name) == ChannelKind::intensity;
      return is_scaled || (property.name.size() == 1 && property.type == NumberType::f64);
    });
  } catch (const InputError&) {
    return true;  // whoever reads it says what is wrong
  }
}

using Origin = std::array<double, 3>;

/// Of run.json: what the coordinates of a map start from.
Origin origin_of_map(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::is_regular_file(folder / "run.json", ignored)) return {};
  std::string bytes;
  read_file(folder / "run.json", bytes);
  const nlohmann::json run = nlohmann::json::parse(bytes, nullptr, false);
  if (!run.is_object() || !run.contains("origin_m") || !run["origin_m"].is_array() ||
      run["origin_m"].size() != 3)
    return {};
  Origin origin_m{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!run["origin_m"][axis].is_number()) return {};
    origin_m.at(axis) = run["origin_m"][axis].get<double>();
  }
  return origin_m;
}

/// Poses in a national grid put scans of their own frame where floats have no millimetres.
Origin origin_of_poses(const ScanSource& scans) {
  constexpr double farthest_exact_m = 10'000;
  Origin origin_m{};
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const std::optional<Pose> pose = scans.odometry(i);
    if (!pose) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double at_m = pose->translation_m(static_cast<Eigen::Index>(axis));
      if (std::abs(at_m) > farthest_exact_m) origin_m.at(axis) = std::floor(at_m / 1000) * 1000;
    }
    break;
  }
  return origin_m;
}

/// What a cloud starts from, and how much of it the poses still have.
struct Origins {
  Origin cloud_m{};
  Origin poses_m{};
};

/// A scan as it is handed on: its number, and its place in the map.
struct ScanTag {
  std::uint32_t number = 0;
  std::size_t row = 0;
  double stamp_s = 0;
};

/// What takes scans: a cloud in the map's frame, or a recording.
class ScanTaker {
 public:
  ScanTaker() = default;
  ScanTaker(const ScanTaker&) = delete;
  ScanTaker& operator=(const ScanTaker&) = delete;
  virtual ~ScanTaker() = default;
  /// `intensity`: as many as points, or none.
  virtual void take(std::span<const Point> points_in_body, std::span<const std::uint8_t> intensity,
                    const Pose& map_from_body, const ScanTag& scan) = 0;
  virtual void finish(MapConversionReport& report) = 0;
};

class CloudTaker final : public ScanTaker {
 public:
  CloudTaker(const fs::path& out, ConversionForm form, const Origin& origin_m, bool has_intensity)
      : writer_(open_cloud_writer(out, cloud_form(form), origin_m, has_intensity)) {}

  void take(std::span<const Point> points_in_body, std::span<const std::uint8_t> intensity,
            const Pose& map_from_body, const ScanTag& scan) override {
    points_.clear();
    const Eigen::Matrix3d rotation = map_from_body.rotation.toRotationMatrix();
    for (const Point& point : points_in_body) {
      const Eigen::Vector3d in_body = Eigen::Vector3f(point.x, point.y, point.z).cast<double>();
      const Eigen::Vector3f in_map = (rotation * in_body + map_from_body.translation_m).cast<float>();
      points_.push_back({in_map.x(), in_map.y(), in_map.z()});
    }
    writer_->add(points_, scan.number, scan.stamp_s, intensity);
  }
  void finish(MapConversionReport& report) override {
    report.points = writer_->written();
    report.not_finite = writer_->not_finite();
    writer_->finish();
  }

 private:
  std::unique_ptr<CloudWriter> writer_;
  std::vector<Point> points_;
};

/// /alces/pose, /tf and /alces/cloud in the body's frame of every scan, with the edges and loops that end at
/// it; /alces/path at the end.
class RecordingTaker final : public ScanTaker {
 public:
  RecordingTaker(const fs::path& out, RecordedGraph graph)
      : file_(out, desk_recording_config(configuration_, 0, 0)), graph_(std::move(graph)) {
    const auto by_last = [](const auto& a, const auto& b) { return last_of(a) < last_of(b); };
    std::stable_sort(graph_.edges.begin(), graph_.edges.end(), by_last);
    std::stable_sort(graph_.loops.begin(), graph_.loops.end(), by_last);
  }

  void take(std::span<const Point> points_in_body, std::span<const std::uint8_t> /*intensity*/,
            const Pose& map_from_body, const ScanTag& scan) override {
    finite_.clear();
    for (const Point& point : points_in_body) {
      if (is_finite(point)) finite_.push_back(point);
    }
    not_finite_ += points_in_body.size() - finite_.size();
    const std::int64_t stamp_ns = std::max<std::int64_t>(0, std::llround(scan.stamp_s * 1e9));
    file_.writer().advance_to(stamp_ns);
    file_.writer().write_pose({stamp_ns, map_from_body});  // first: where the cloud is to be shown
    if (!file_.writer().write_cloud({stamp_ns, finite_})) ++too_large_;
    write_graph_up_to(scan.row, stamp_ns);
    points_ += finite_.size();
    stamps_ns_.push_back(stamp_ns);
    poses_.push_back(map_from_body);
  }
  void finish(MapConversionReport& report) override {
    if (!poses_.empty()) {
      write_graph_up_to(SIZE_MAX, stamps_ns_.back());
      file_.writer().write_path({stamps_ns_.back(), stamps_ns_, poses_});
    }
    if (too_large_ > 0)
      report.warnings.push_back(
          fmt::format("{} scans are larger than a message can be and are left out", too_large_));
    report.points = points_;
    report.not_finite = not_finite_;
    report.edges = next_edge_;
    report.loops = next_loop_;
    file_.commit();
  }

 private:
  static std::size_t last_of(const GraphEdgeRecord& edge) { return std::max(edge.from, edge.to); }
  static std::size_t last_of(const LoopRecord& loop) { return std::max(loop.first, loop.last); }

  void write_graph_up_to(std::size_t row, std::int64_t stamp_ns) {
    for (; next_edge_ < graph_.edges.size() && last_of(graph_.edges[next_edge_]) <= row; ++next_edge_) {
      graph_.edges[next_edge_].stamp_ns = stamp_ns;
      file_.writer().write_edge(graph_.edges[next_edge_]);
    }
    for (; next_loop_ < graph_.loops.size() && last_of(graph_.loops[next_loop_]) <= row; ++next_loop_) {
      graph_.loops[next_loop_].stamp_ns = stamp_ns;
      file_.writer().write_loop(graph_.loops[next_loop_]);
    }
  }

  std::string configuration_;
  RecordingFile file_;
  RecordedGraph graph_;
  std::size_t next_edge_ = 0;
  std::size_t next_loop_ = 0;
  std::vector<Point> finite_;
  std::vector<std::int64_t> stamps_ns_;
  std::vector<Pose> poses_;
  std::uint64_t points_ = 0;
  std::uint64_t not_finite_ = 0;
  std::uint64_t too_large_ = 0;
};

std::unique_ptr<ScanTaker> open_taker(const MapConversion& conversion, const Origin& origin_m,
                                      bool has_intensity) {
  if (conversion.form == ConversionForm::mcap) {
    RecordedGraph graph;
    if (conversion.source == ConversionSource::map_folder)
      graph = read_recorded_graph(conversion.in, read_trajectory(conversion.in).size());
    return std::make_unique<RecordingTaker>(conversion.out, std::move(graph));
  }
  return std::make_unique<CloudTaker>(conversion.out, conversion.form, origin_m, has_intensity);
}

/// The map's points scan by scan, taken back into the body's frame.
void take_map(const fs::path& folder, ScanTaker& taker, MapConversionReport& report) {
  const Trajectory trajectory = read_trajectory(folder);
  // Where no time is known the stamps are the numbers that map.ply has; else its scans come in the same
  // order.
  std::map<std::uint32_t, std::size_t> pose_of;
  for (std::size_t i = 0; !trajectory.has_time && i < trajectory.size(); ++i)
    pose_of[static_cast<std::uint32_t>(std::llround(trajectory.stamps_s[i]))] = i;
  std::vector<Point> points;
  std::vector<std::uint8_t> intensity;
  std::uint32_t number = 0;
  const auto hand_on = [&] {
    if (points.empty()) return;
    const std::size_t pose = trajectory.has_time          ? report.scans
                             : pose_of.count(number) != 0 ? pose_of[number]
                                                          : SIZE_MAX;
    if (pose >= trajectory.size())
      throw InputError(
          folder / "map.ply",
          fmt::format("has a scan {} that trajectory.tum has no pose for; map the scans again", number));
    const Pose body_from_map = trajectory.poses[pose].inverse();
    for (Point& point : points) {
      const Eigen::Vector3f in_map(point.x, point.y, point.z);
      const Eigen::Vector3f in_body = (body_from_map * in_map.cast<double>()).cast<float>();
      point = {in_body.x(), in_body.y(), in_body.z()};
    }
    taker.take(points, intensity, trajectory.poses[pose], {number, pose, trajectory.stamps_s[pose]});
    ++report.scans;
    points.clear();
    intensity.clear();
  };
  stream_ply_pieces(folder / "map.ply", [&](const PlyPiece& piece) {
    if (piece.scans.empty())
      throw InputError(folder / "map.ply",
                       "its points do not say which scan they come from; map the scans again");
    for (std::size_t i = 0; i < piece.points.size(); ++i) {
      if (piece.scans[i] != number) hand_on();
      number = piece.scans[i];
      points.push_back(piece.points[i]);
      if (!piece.intensity.empty()) intensity.push_back(piece.intensity[i]);
    }
  });
  hand_on();
}

void take_scans(ScanSource& scans, const Origin& poses_origin_m, ScanTaker& taker,
                MapConversionReport& report, const ScanProgress& progress) {
  ScanPoints scan;
  std::size_t without_pose = 0;
  for (std::size_t i = 0; scans.read(i, scan); ++i) {
    std::optional<Pose> pose = scans.odometry(i);
    if (!pose) ++without_pose;
    if (pose) pose->translation_m -= Eigen::Vector3d(poses_origin_m[0], poses_origin_m[1], poses_origin_m[2]);
    taker.take(scan.points, scan.intensity, pose.value_or(Pose{}),
               {static_cast<std::uint32_t>(scans.number(i)), i,
                scans.stamp_s(i).value_or(static_cast<double>(scans.number(i)))});
    ++report.scans;
    if (progress) progress(i + 1, scans.size());
    if (i + 1 >= scans.size()) break;
  }
  report.warnings = scans.warnings();
  // scans of a national grid are where they belong without one
  if (without_pose > 0 && report.scans > 1 && scans.origin_m() == Origin{})
    report.warnings.push_back(
        fmt::format("{} of {} scans have no pose and are put at the origin; give them with --odometry",
                    without_pose, report.scans));
}

/// The trajectory that the vehicle had at the end: of its last path, and of the poses since.
Trajectory recorded_trajectory(const fs::path& file) {
  FileSource source(file.c_str());
  if (!source.is_open()) throw InputError(file, "cannot be opened for reading");
  RecordingReader reader(source);
  if (!reader.open()) throw InputError(file, "is no recording (MCAP)");
  std::map<std::int64_t, Pose> poses;
  RecordedMessage message;
  while (reader.next(message)) {
    if (const auto* pose = std::get_if<PoseRecord>(&message.content))
      poses[pose->stamp_ns] = pose->map_from_body;
    const auto* path = std::get_if<PathRecord>(&message.content);
    if (path == nullptr || path->stamps_ns.size() != path->map_from_body.size()) continue;
    for (std::size_t i = 0; i < path->stamps_ns.size(); ++i)
      poses[path->stamps_ns[i]] = path->map_from_body[i];
  }
  check_read(file, source.error_number());
  if (poses.empty())
    throw InputError(file, fmt::format("holds no poses: nobody mapped while it was recorded; make a map with "
                                       "alces replay {} --out MAP",
                                       file.string()));
  Trajectory trajectory;
  trajectory.has_time = true;
  for (const auto& [stamp_ns, pose] : poses) {
    trajectory.stamps_s.push_back(seconds(stamp_ns));
    trajectory.poses.push_back(pose);
  }
  return trajectory;
}

void take_recording(const fs::path& file, ScanTaker& taker, MapConversionReport& report) {
  const Trajectory trajectory = recorded_trajectory(file);
  std::map<std::int64_t, std::size_t> pose_of;
  for (std::size_t i = 0; i < trajectory.size(); ++i) pose_of[std::llround(trajectory.stamps_s[i] * 1e9)] = i;
  FileSource source(file.c_str());
  RecordingReader reader(source);
  if (!reader.open()) throw InputError(file, "is no recording (MCAP)");
  std::uint64_t without_pose = 0;
  RecordedMessage message;
  while (reader.next(message)) {
    const auto* cloud = std::get_if<CloudRecord>(&message.content);
    if (cloud == nullptr) continue;
    const auto pose = pose_of.find(cloud->stamp_ns);
    if (pose == pose_of.end()) {
      ++without_pose;
      continue;
    }
    taker.take(cloud->points, {}, trajectory.poses[pose->second],
               {static_cast<std::uint32_t>(report.scans), pose->second, trajectory.stamps_s[pose->second]});
    ++report.scans;
  }
  check_read(file, source.error_number());
  for (const std::string& problem : reader.problems())
    report.warnings.push_back(file.string() + ": " + problem);
  if (without_pose > 0)
    report.warnings.push_back(
        fmt::format("{}: {} clouds have no pose and are left out", file.string(), without_pose));
  if (report.scans == 0) throw InputError(file, "holds no clouds; make a map with alces replay");
}

Trajectory trajectory_of(const MapConversion& conversion) {
  switch (conversion.source) {
    case ConversionSource::map_folder:
    case ConversionSource::trajectory:
      return read_trajectory(conversion.in);
    case ConversionSource::recording:
      return recorded_trajectory(conversion.in);
    case ConversionSource::graph:
      return trajectory_of_graph(conversion);
    case ConversionSource::scans:
    case ConversionSource::cloud:
      break;
  }
  const std::unique_ptr<ScanSource> scans = open_scans(
      conversion.in,
      {.odometry = conversion.odometry, .no_odometry = conversion.no_odometry, .bag = conversion.bag});
  Trajectory trajectory;
  trajectory.has_time = true;
  for (std::size_t i = 0; i < scans->size(); ++i) {
    const std::optional<Pose> pose = scans->odometry(i);
    if (!pose)
      throw InputError(conversion.in,
                       fmt::format("{} has no pose; give the poses with --odometry", scans->name(i)));
    trajectory.poses.push_back(*pose);
    trajectory.has_time = trajectory.has_time && scans->stamp_s(i).has_value();
    trajectory.stamps_s.push_back(scans->stamp_s(i).value_or(static_cast<double>(scans->number(i))));
  }
  return trajectory;
}

ConstraintGraph graph_of(const MapConversion& conversion) {
  switch (conversion.source) {
    case ConversionSource::graph:
      return read_graph(conversion.in).graph;
    case ConversionSource::map_folder:
      if (!fs::exists(conversion.in / "graph.g2o"))
        throw InputError(conversion.in, "holds no graph.g2o; map the scans again");
      return read_graph(conversion.in / "graph.g2o").graph;
    case ConversionSource::recording:
      return graph_of_recording(conversion.in, recorded_trajectory(conversion.in).poses);
    case ConversionSource::scans:
    case ConversionSource::cloud:
    case ConversionSource::trajectory:
      break;
  }
  throw UsageError(
      fmt::format("{} has no edges between poses; a pose graph comes of another one (.g2o, .graph), of a map "
                  "folder or of "
                  "a recording",
                  conversion.in.string()));
}

}  // namespace

std::optional<ConversionSource> conversion_source(const fs::path& in) {
  std::error_code ignored;
  if (names_bag_topic(in)) return ConversionSource::trajectory;
  if (is_ros_bag(in)) return ConversionSource::scans;
  if (fs::is_directory(in, ignored)) {
    if (fs::exists(in / "map.ply", ignored) && fs::exists(in / "trajectory.tum", ignored))
      return ConversionSource::map_folder;
    bool has_frames = false;
    bool has_records = false;  // .bin and .csv are scans, unless they are of a folder of traces
    bool has_traces = false;
    for (const fs::path& file : list_files(in)) {
      const std::string extension = file.extension().string();
      const std::string name = file.filename().string();
      has_records = has_records || extension == ".bin" || extension == ".csv";
      has_traces = has_traces || extension == ".log" || extension == ".times" || extension == ".nmea" ||
                   name == "vehicle.toml" || name == "gpio.txt" || name.starts_with("laser_");
      for (const char* scan : {".3d", ".pcd", ".ply", ".las", ".xyz", ".asc"}) {
        if (extension == scan) return ConversionSource::scans;
      }
      has_frames = has_frames || extension == ".frames" || extension == ".pose";
    }
    if (has_frames) return ConversionSource::trajectory;
    if (has_records && !has_traces) return ConversionSource::scans;
    return std::nullopt;
  }
  const std::string extension = in.extension().string();
  for (const char* cloud : {".3d", ".pcd", ".ply", ".las", ".laz", ".e57", ".xyz", ".asc"}) {
    if (extension == cloud) return ConversionSource::cloud;
  }
  for (const char* trajectory : {".tum", ".kitti", ".csv"}) {
    if (extension == trajectory) return ConversionSource::trajectory;
  }
  if (extension == ".g2o" || extension == ".graph") return ConversionSource::graph;
  if (extension == ".mcap") return ConversionSource::recording;
  return std::nullopt;
}

std::optional<ConversionForm> conversion_form(const fs::path& out) {
  const fs::path name = out.has_filename() ? out.filename() : out.parent_path().filename();
  if (name == "frames") return ConversionForm::frames;
  const std::string extension = name.extension().string();
  if (extension == ".bin") return ConversionForm::kitti_scan;
  if (extension == ".xyz") return ConversionForm::csv;
  return extension.empty() ? std::nullopt : conversion_form_called(extension.substr(1));
}

std::optional<ConversionForm> conversion_form_called(const std::string& name) {
  for (const auto& [known, form] : form_names) {
    if (name == known) return form;
  }
  return std::nullopt;
}

MapConversionReport convert_map(const MapConversion& conversion, const ScanProgress& progress) {
  const std::string extension = conversion.in.extension().string();
  if (extension == ".laz" || extension == ".e57") {
    throw InputError(conversion.in,
                     "this form needs a library that Debian does not have; write it as LAS or PLY with the "
                     "program it comes from");
  }
  MapConversionReport report;
  if (conversion.form == ConversionForm::scan_folder) {
    if (conversion.source != ConversionSource::scans && conversion.source != ConversionSource::cloud)
      throw UsageError(
          fmt::format("{} is no bag and no scans; a folder of scans comes of these", conversion.in.string()));
    write_scan_folder(conversion, report, progress);
    return report;
  }
  if (is_graph_form(conversion.form)) {
    write_graph_as(graph_of(conversion), conversion, report);
    return report;
  }
  if (is_trajectory_form(conversion.form)) {
    Trajectory trajectory = trajectory_of(conversion);
    report.poses = trajectory.size();
    report.warnings = trajectory.notes;
    if (conversion.source == ConversionSource::map_folder) {
      const Origin origin_m = origin_of_map(conversion.in);
      for (Pose& pose : trajectory.poses)
        pose.translation_m += Eigen::Vector3d(origin_m[0], origin_m[1], origin_m[2]);
    }
    if (conversion.form == ConversionForm::tum) write_tum(conversion.out, trajectory);
    if (conversion.form == ConversionForm::kitti) write_kitti(conversion.out, trajectory);
    if (conversion.form == ConversionForm::frames) write_3dtk_frames(conversion.out, trajectory);
    return report;
  }
  if (conversion.source == ConversionSource::trajectory)
    throw UsageError(fmt::format("{} is a trajectory and has no points; --to tum, kitti or frames",
                                 conversion.in.string()));
  if (conversion.source == ConversionSource::graph)
    throw UsageError(fmt::format("{} is a pose graph and has no points; --to g2o, toro, tum, kitti or frames",
                                 conversion.in.string()));
  // Whatever cannot be read is found before anything is written, where that is cheap.
  std::unique_ptr<ScanSource> scans;
  const bool is_streamed_ply = conversion.source == ConversionSource::cloud && extension == ".ply" &&
                               !conversion.odometry && conversion.scale == 1 &&
                               has_binary_floats(conversion.in);
  Origins origins;
  if (!is_streamed_ply &&
      (conversion.source == ConversionSource::scans || conversion.source == ConversionSource::cloud)) {
    scans = open_scans(conversion.in, {.odometry = conversion.odometry,
                                       .no_odometry = conversion.no_odometry,
                                       .scale = conversion.scale,
                                       .format = conversion.scan_format,
                                       .bag = conversion.bag});
    origins.cloud_m = scans->origin_m();
    if (origins.cloud_m == Origin{}) origins.cloud_m = origins.poses_m = origin_of_poses(*scans);
  } else if (conversion.source == ConversionSource::map_folder) {
    origins.cloud_m = origin_of_map(conversion.in);
  } else if (is_streamed_ply && conversion.in.filename() == "map.ply") {
    origins.cloud_m = origin_of_map(conversion.in.parent_path());
  }

  bool has_intensity = scans != nullptr && scans->has_intensity();
  if (is_streamed_ply) has_intensity = ply_has_intensity(conversion.in);
  if (conversion.source == ConversionSource::map_folder)
    has_intensity = ply_has_intensity(conversion.in / "map.ply");
  const std::unique_ptr<ScanTaker> taker = open_taker(conversion, origins.cloud_m, has_intensity);
  if (scans) {
    take_scans(*scans, origins.poses_m, *taker, report, progress);
  } else if (is_streamed_ply) {
    stream_ply_pieces(conversion.in,
                      [&](const PlyPiece& piece) { taker->take(piece.points, piece.intensity, Pose{}, {}); });
    report.scans = 1;
  } else if (conversion.source == ConversionSource::map_folder) {
    take_map(conversion.in, *taker, report);
  } else {
    take_recording(conversion.in, *taker, report);
  }
  taker->finish(report);
  const bool has_floats =
      conversion.form == ConversionForm::kitti_scan || conversion.form == ConversionForm::mcap;
  if (has_floats && origins.cloud_m != Origin{})
    report.warnings.push_back(
        fmt::format("{}: has floats, which cannot hold such coordinates: they are given from ({}, {}, {}) m "
                    "on; write PLY, "
                    "PCD, LAS or CSV to have them whole",
                    conversion.out.string(), origins.cloud_m[0], origins.cloud_m[1], origins.cloud_m[2]));
  return report;
}

}  // namespace alces::offline
