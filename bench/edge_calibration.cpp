// How far the variances of the edges tell the truth: drives with a known truth are mapped without loops, and the
// error of every step, and of chains of steps, is compared with what the edges' labels predict.
#include <fmt/core.h>

#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "alces/mapper.h"
#include "alces_offline/mapper_settings.h"
#include "alces_offline/memory_plan.h"
#include "alces_offline/scan_source.h"
#include "alces_offline/trajectory.h"
#include "support.h"

namespace {

using namespace alces;
using namespace alces::bench;

struct Settings {
  std::vector<std::string> folders;  ///< NAME=SCANS:TRUTH
  std::vector<std::uint64_t> seeds;
  std::size_t returned_points = 15800;
  std::size_t most_scans = 924;
  std::string settings_file;
  std::string dump;
};

nlohmann::json numbers(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

/// Maps without loops; every edge with what the match said, and what it should have said.
nlohmann::json map_drive(const Drive& drive, const Settings& settings) {
  MapperConfig config = offline::default_settings(offline::FrontEnd::standard);
  if (!settings.settings_file.empty()) offline::read_settings(settings.settings_file, config);
  config.scan_capacity = static_cast<std::uint32_t>(drive.size);
  config.close_loops = false;
  const offline::MemoryPlan plan = offline::plan_memory(config, std::size_t{1} << 30);
  const offline::MemoryBlock block(plan.block_bytes);
  Status status = Status::ok;
  Mapper* const mapper = Mapper::create(block.bytes(), config, status);
  if (mapper == nullptr) throw std::runtime_error(text(status));
  nlohmann::json reports = nlohmann::json::array();
  std::vector<Point> points;
  for (std::size_t i = 0; i < drive.size; ++i) {
    print_progress(i, drive.size);
    drive.points(i, points);
    ScanReport report;
    status = mapper->add_scan(points, &drive.odometry[i], report);
    if (status != Status::ok && status != Status::no_voxel_capacity) throw std::runtime_error(text(status));
    reports.push_back({{"match", text(report.match)},
                       {"overlap", report.overlap},
                       {"rms_m", report.rms_m},
                       {"correspondences", report.correspondences},
                       {"kept", report.points.kept},
                       {"iterations", report.iterations},
                       {"predicted", report.is_predicted}});
  }
  print_progress(1, 1);
  nlohmann::json steps = nlohmann::json::array();
  const std::span<const Pose> poses = mapper->graph().poses();
  for (const Edge& edge : mapper->graph().edges()) {
    const Pose truth = drive.truth[edge.from].inverse() * drive.truth[edge.to];
    const Eigen::Quaterniond& axes = poses[edge.from].rotation;
    nlohmann::json step = reports[edge.to];
    step["from"] = edge.from;
    step["to"] = edge.to;
    step["translation_error_m"] =
        numbers(axes * (edge.from_from_to.translation_m - truth.translation_m));
    step["rotation_error_rad"] =
        numbers(axes * log_so3(edge.from_from_to.rotation * truth.rotation.conjugate()));
    step["step_m"] = truth.translation_m.norm();
    step["turn_rad"] = angle_between_rad(truth.rotation, Eigen::Quaterniond::Identity());
    step["variance"] = {edge.variance.x_m2, edge.variance.y_m2, edge.variance.z_m2,
                        edge.variance.rotation_rad2};
    steps.push_back(step);
  }
  nlohmann::json places = nlohmann::json::array();
  for (std::size_t i = 0; i < drive.size; ++i) {
    const auto pose = [](const Pose& p) {
      const Eigen::Quaterniond& q = p.rotation;
      const Eigen::Vector3d& t = p.translation_m;
      return nlohmann::json{t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
    };
    places.push_back({{"map", pose(poses[i])}, {"truth", pose(drive.truth[i])}});
  }
  return {{"name", drive.name}, {"steps", steps}, {"poses", places}};
}

Drive from_folder(const std::string& name, const std::string& folder, const std::string& truth_file,
                  std::size_t most_scans) {
  const std::shared_ptr<offline::ScanSource> source = offline::open_scans(folder);
  const offline::Trajectory truth = offline::read_trajectory(truth_file);
  Drive drive;
  drive.size = std::min(source->size(), most_scans);
  if (truth.size() < drive.size) throw std::runtime_error(truth_file + " has fewer poses than there are scans");
  drive.name = name;
  drive.points = [source](std::size_t index, std::vector<Point>& points) {
    source->read(index, points);
    std::erase_if(points, [](const Point& point) { return !is_finite(point); });
  };
  for (std::size_t i = 0; i < drive.size; ++i) {
    const std::optional<Pose> odometry = source->odometry(i);
    if (!odometry) throw std::runtime_error(source->name(i) + " has no odometry");
    drive.odometry.push_back(*odometry);
    drive.truth.push_back(truth.poses[0].inverse() * truth.poses[i]);
  }
  return drive;
}

void measure(const Settings& settings) {
  nlohmann::json all = nlohmann::json::array();
  for (const std::uint64_t seed : settings.seeds) {
    Drive drive = town(seed, settings.most_scans, settings.returned_points);
    drive.name = fmt::format("town {}", seed);
    all.push_back(map_drive(drive, settings));
    fmt::print("{}\n", drive.name);
  }
  for (const std::string& text : settings.folders) {
    const std::size_t equals = text.find('=');
    const std::size_t colon = text.find(':', equals);
    if (equals == std::string::npos || colon == std::string::npos)
      throw std::runtime_error(text + ": a drive is named as NAME=SCANS:TRUTH");
    const Drive drive = from_folder(text.substr(0, equals), text.substr(equals + 1, colon - equals - 1),
                                    text.substr(colon + 1), settings.most_scans);
    all.push_back(map_drive(drive, settings));
    fmt::print("{}\n", drive.name);
  }
  if (!settings.dump.empty()) std::ofstream(settings.dump) << all.dump() << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("How well the edges' variances predict the errors of steps and chains of steps");
  Settings settings;
  app.add_option("--town", settings.seeds, "Seeds of towns to drive through");
  app.add_option("--drive", settings.folders, "NAME=SCANS:TRUTH, a folder of scans with odometry and a trajectory");
  app.add_option("--returned-points", settings.returned_points, "Of a scan of the town, about")->capture_default_str();
  app.add_option("--scans", settings.most_scans, "At most, of each drive")->capture_default_str();
  app.add_option("--config", settings.settings_file, "Settings of the mapper, as alces map takes them");
  app.add_option("--dump", settings.dump, "File to write: every step as JSON");
  return alces::bench::run(argc, argv, app, [&] { measure(settings); });
}
