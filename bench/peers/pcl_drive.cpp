// PCL's ICP and GICP on a drive, scan against the one before, as a peer for our front end: time a scan and
// drift.
//   bench_pcl_drive --method gicp --scans 924 --seed 1        the synthetic town
//   bench_pcl_drive --method icp --folder DIR                 what `alces map` reads, truth.tum beside
#include <fmt/core.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/pcl_config.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/icp.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "alces/pose.h"
#include "alces_platform/sim/drive.h"
#include "offline/io/files/error.h"
#include "offline/io/scans/scan_source.h"

namespace {

using alces::Pose;
using Cloud = pcl::PointCloud<pcl::PointXYZ>;

struct Input {
  std::size_t size = 0;
  std::function<Cloud::Ptr(std::size_t)> cloud;
  std::vector<Pose> odometry;
  std::vector<Pose> truth;  ///< empty: none is known
};

std::vector<Pose> read_tum(const std::filesystem::path& path) {
  std::vector<Pose> poses;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream numbers(line);
    double stamp = 0;
    Pose pose;
    Eigen::Vector3d& t = pose.translation_m;
    Eigen::Quaterniond& q = pose.rotation;
    if (numbers >> stamp >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w())
      poses.push_back(pose);
  }
  return poses;
}

// Where a scan has no odometry none is used: the last step is the guess for the next.
Input from_folder(const std::filesystem::path& folder) {
  const std::shared_ptr<alces::offline::ScanSource> source = alces::offline::open_scans(folder);
  Input input;
  input.size = source->size();
  for (std::size_t i = 0; i < input.size; ++i) {
    if (const auto pose = source->odometry(i)) input.odometry.push_back(*pose);
  }
  if (input.odometry.size() < input.size) input.odometry.clear();
  input.truth = read_tum(folder / "truth.tum");
  if (input.truth.size() < input.size) input.truth.clear();
  input.cloud = [source](std::size_t i) {
    alces::offline::ScanPoints scan;
    source->read(i, scan);
    auto cloud = std::make_shared<Cloud>();
    for (const alces::Point& point : scan.points) {
      if (is_finite(point)) cloud->push_back({point.x, point.y, point.z});
    }
    return cloud;
  };
  return input;
}

Input from_town(const alces::sim::DriveSettings& settings) {
  const auto drive = std::make_shared<alces::sim::Drive>(alces::sim::drive(settings));
  Input input;
  input.size = drive->size();
  for (std::size_t i = 0; i < input.size; ++i) {
    input.odometry.push_back(drive->odometry(i));
    input.truth.push_back(drive->truth(i));
  }
  input.cloud = [drive](std::size_t i) {
    auto cloud = std::make_shared<Cloud>();
    for (const alces::Point& point : drive->points(i)) cloud->push_back({point.x, point.y, point.z});
    return cloud;
  };
  return input;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "PCL's ICP and GICP, pairwise, on a drive: time a scan and drift without loop closing. One thread");
  std::string method = "gicp";
  std::string folder, out;
  std::size_t stride = 1;
  double voxel_m = 0.10, limit_m = 1.0;
  int iterations = 50;
  alces::sim::DriveSettings settings;
  auto* scans = app.add_option("--scans", settings.scans, "Scans of the drive")->capture_default_str();
  app.add_option("--seed", settings.seed, "Of the town")->capture_default_str();
  app.add_option("--points-per-scan", settings.scanner.points_per_scan, "Of the town's scanner")
      ->capture_default_str();
  app.add_option(
      "--noise-mm",
      [&](const std::vector<std::string>& text) {
        settings.scanner.noise_m = std::stod(text.front()) / 1000;
        return true;
      },
      "Of the town's scanner (15)");
  app.add_option("--folder", folder,
                 "A folder of scans instead of the town, with its odometry if there is any");
  app.add_option("--stride", stride, "Use every n-th scan")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--method", method, "icp or gicp")
      ->check(CLI::IsMember({"icp", "gicp"}))
      ->capture_default_str();
  app.add_option("--voxel", voxel_m, "Edge of a reduction cell, m")->capture_default_str();
  app.add_option("--max-distance", limit_m, "Of correspondences, m")->capture_default_str();
  app.add_option("--iterations", iterations, "At most")->capture_default_str();
  app.add_option("--out", out, "Write the estimated trajectory here (TUM)");
  CLI11_PARSE(app, argc, argv);

  Input input;
  try {
    input = folder.empty() ? from_town(settings) : from_folder(folder);
  } catch (const alces::offline::Error& error) {
    fmt::print(stderr, "bench_pcl_drive: {}\n", error.what());
    return 3;
  }
  if (!folder.empty() && scans->count() > 0) input.size = std::min(input.size, settings.scans);
  if (input.size == 0) {
    fmt::print(stderr, "bench_pcl_drive: no scans\n");
    return 3;
  }

  std::unique_ptr<pcl::Registration<pcl::PointXYZ, pcl::PointXYZ>> registration;
  if (method == "icp")
    registration = std::make_unique<pcl::IterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ>>();
  else
    registration = std::make_unique<pcl::GeneralizedIterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ>>();
  registration->setMaxCorrespondenceDistance(limit_m);
  registration->setMaximumIterations(iterations);
  registration->setTransformationEpsilon(1e-6);

  std::vector<double> total_ms, reduce_ms, errors_m, errors_xy_m, errors_deg, step_errors_m, points, reduced;
  Cloud::Ptr before;
  Pose map_from_before, last_step;
  std::size_t last = 0;
  std::ofstream trajectory;
  if (!out.empty()) trajectory.open(out);
  for (std::size_t i = 0; i < input.size; i += stride) {
    const Cloud::Ptr raw = input.cloud(i);
    const auto start = std::chrono::steady_clock::now();
    auto cloud = std::make_shared<Cloud>();
    pcl::VoxelGrid<pcl::PointXYZ> grid;
    const auto leaf = static_cast<float>(voxel_m);
    grid.setLeafSize(leaf, leaf, leaf);
    grid.setInputCloud(raw);
    grid.filter(*cloud);
    const auto at_match = std::chrono::steady_clock::now();
    Pose map_from_body;
    if (before) {
      const Pose guess =
          input.odometry.empty() ? last_step : input.odometry[last].inverse() * input.odometry[i];
      Cloud aligned;
      registration->setInputTarget(before);
      registration->setInputSource(cloud);
      registration->align(aligned, guess.matrix().cast<float>());
      const Pose before_from_body = Pose::from_matrix(registration->getFinalTransformation().cast<double>());
      map_from_body = map_from_before * before_from_body;
      last_step = before_from_body;
      const auto end = std::chrono::steady_clock::now();
      total_ms.push_back(std::chrono::duration<double, std::milli>(end - start).count());
      reduce_ms.push_back(std::chrono::duration<double, std::milli>(at_match - start).count());
      if (!input.truth.empty()) {
        const Pose step = input.truth[last].inverse() * input.truth[i];
        step_errors_m.push_back((step.translation_m - before_from_body.translation_m).norm());
      }
    }
    points.push_back(static_cast<double>(raw->size()));
    reduced.push_back(static_cast<double>(cloud->size()));
    if (!input.truth.empty()) {
      const Eigen::Vector3d error = map_from_body.translation_m - input.truth[i].translation_m;
      errors_m.push_back(error.norm());
      errors_xy_m.push_back(error.head<2>().norm());
      errors_deg.push_back(alces::angle_between_rad(map_from_body.rotation, input.truth[i].rotation) *
                           57.29577951);
    }
    if (trajectory.is_open()) {
      const Eigen::Vector3d& t = map_from_body.translation_m;
      const Eigen::Quaterniond& q = map_from_body.rotation;
      trajectory << fmt::format("{} {:.6f} {:.6f} {:.6f} {:.9f} {:.9f} {:.9f} {:.9f}\n", i, t.x(), t.y(),
                                t.z(), q.x(), q.y(), q.z(), q.w());
    }
    before = cloud;
    map_from_before = map_from_body;
    last = i;
    if (i % 20 == 0) fmt::print(stderr, "\r{} of {}", i, input.size);
  }
  fmt::print(stderr, "\r");
  fmt::print("PCL {} {}: {} scans, {:.0f} points, {:.0f} after reduction to {} m\n", PCL_VERSION_PRETTY,
             method, points.size(), mean(points), mean(reduced), voxel_m);
  fmt::print("  time a scan [ms]: median {:.1f}, mean {:.1f}, worst {:.1f}; of it reduction median {:.1f}\n",
             median(total_ms), mean(total_ms),
             total_ms.empty() ? 0.0 : *std::max_element(total_ms.begin(), total_ms.end()), median(reduce_ms));
  if (!errors_m.empty())
    fmt::print(
        "  error without loops, no alignment: mean {:.3f} m (x,y {:.3f} m), {:.3f} deg; end {:.3f} m; "
        "a step: median {:.4f} m, worst {:.3f} m\n",
        mean(errors_m), mean(errors_xy_m), mean(errors_deg), errors_m.back(), median(step_errors_m),
        step_errors_m.empty() ? 0.0 : *std::max_element(step_errors_m.begin(), step_errors_m.end()));
  return 0;
}
