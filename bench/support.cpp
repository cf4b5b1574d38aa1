#include "support.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "alces/voxel_grid.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_source.h"
#include "support/in_block.h"

namespace alces::bench {
namespace {

/// As many rays as bring back about so many points: most of them look into the sky or through windows.
std::size_t rays_for(const sim::DriveSettings& settings, std::size_t returned_points) {
  const sim::Drive drive = sim::drive(settings);
  std::size_t points = 0;
  std::size_t rays = 0;
  for (std::size_t i = 0; i < drive.size(); i += std::max<std::size_t>(1, drive.size() / 10)) {
    points += drive.points(i).size();
    rays += drive.rays();
  }
  return returned_points * rays / std::max<std::size_t>(1, points);
}

Drive from_town(sim::DriveSettings settings, std::size_t returned_points) {
  settings.scanner.points_per_scan = rays_for(settings, returned_points);
  const auto town = std::make_shared<sim::Drive>(sim::drive(settings));
  Drive drive;
  drive.size = town->size();
  drive.name = fmt::format("the town, seed {}, {} rays a scan", settings.seed, town->rays());
  drive.points = [town](std::size_t index, std::vector<Point>& points) { town->points(index, points); };
  for (std::size_t i = 0; i < drive.size; ++i) {
    drive.odometry.push_back(town->odometry(i));
    drive.truth.push_back(town->truth(i));
  }
  return drive;
}

}  // namespace

void DriveOptions::add_to(CLI::App& app) {
  app.add_option("SCANS", folder_, "Folder of scans with odometry; without it: the synthetic town");
  app.add_option("--scans", scans_, "At most; the town's drive has as many")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--seed", seed_, "Of the town")->capture_default_str();
  app.add_option("--returned-points", returned_points_, "Of a scan of the town, about")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}

Drive recorded(const std::string& folder, std::size_t most_scans, const std::string& truth_file) {
  offline::ScanSourceOptions options;
  const std::filesystem::path beside = std::filesystem::path(folder).lexically_normal() / "../odometry.tum";
  if (std::filesystem::exists(beside)) options.odometry = beside;
  const std::shared_ptr<offline::ScanSource> source = offline::open_scans(folder, options);
  Drive drive;
  drive.size = std::min(source->size(), most_scans);
  drive.name = fmt::format("{} ({})", folder, source->description());
  drive.points = [source](std::size_t index, std::vector<Point>& points) {
    offline::ScanPoints scan;
    source->read(index, scan);
    points = std::move(scan.points);
    std::erase_if(points, [](const Point& point) { return !is_finite(point); });
  };
  for (std::size_t i = 0; i < drive.size; ++i) {
    const std::optional<Pose> odometry = source->odometry(i);
    if (!odometry) throw std::runtime_error(source->name(i) + " has no odometry");
    drive.odometry.push_back(*odometry);
  }
  if (truth_file.empty()) return drive;
  const offline::Trajectory truth = offline::read_trajectory(truth_file);
  if (truth.size() != source->size())
    throw std::runtime_error(truth_file + ": not as many poses as there are scans");
  for (std::size_t i = 0; i < drive.size; ++i)
    drive.truth.push_back(truth.poses[0].inverse() * truth.poses[i]);
  return drive;
}

Drive town(std::uint64_t seed, std::size_t scans, std::size_t returned_points) {
  sim::DriveSettings settings;
  settings.scans = scans;
  settings.seed = seed;
  return from_town(settings, returned_points);
}

Drive DriveOptions::open() const {
  return folder_.empty() ? town(seed_, scans_, returned_points_) : recorded(folder_, scans_);
}

std::vector<Point> reduced(const std::vector<Point>& points, float cell_size_m) {
  VoxelGridConfig config;
  config.cell_size_m = cell_size_m;
  config.cell_capacity = static_cast<std::uint32_t>(points.size());
  test::InBlock<VoxelGrid> grid(config);
  std::vector<Point> few(points.size());
  VoxelGridCounts counts;
  (void)grid->reduce(points, few, counts);  // an empty scan stays one
  few.resize(counts.kept);
  return few;
}

}  // namespace alces::bench
