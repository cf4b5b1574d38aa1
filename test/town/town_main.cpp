// alces_town: writes a synthetic drive as a folder of scans: scanNNN.pcd, odometry.tum, truth.tum.
#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>

#include "alces_platform/sim/drive.h"
#include "scan_files.h"

namespace {

using namespace alces;

template <typename PoseOf>
bool write_tum(const std::filesystem::path& path, std::size_t size, PoseOf pose_of) {
  std::ofstream file(path);
  for (std::size_t i = 0; i < size; ++i) file << sim::tum_line(static_cast<double>(i), pose_of(i));
  return file.flush().good();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Makes a synthetic drive through a procedural town: scans of a rotating 2D laser scanner, odometry, "
      "truth");
  sim::DriveSettings settings;
  std::filesystem::path folder;
  double noise_mm = 1000 * settings.scanner.noise_m;
  bool look_alike = false;
  app.add_option("--scans", settings.scans, "Number of scans, 1.34 m apart")->capture_default_str();
  app.add_option("--seed", settings.seed, "Another seed is another town and another drive")
      ->capture_default_str();
  app.add_option("--out", folder, "Folder to write (made if missing)")->required();
  app.add_option("--points-per-scan", settings.scanner.points_per_scan, "Rays a scan, in profiles of 181")
      ->capture_default_str();
  app.add_option("--noise-mm", noise_mm, "Standard deviation of a range")->capture_default_str();
  app.add_option("--max-range", settings.scanner.max_range_m, "Metres")->capture_default_str();
  app.add_flag("--look-alike", look_alike, "Instead: one street with two stretches built alike, 384 m apart");
  CLI11_PARSE(app, argc, argv);
  settings.scanner.noise_m = noise_mm / 1000;

  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    fmt::print(stderr, "alces_town: cannot make the folder {}: {}\n", folder.string(), error.message());
    return 3;
  }
  sim::LookAlike alike{look_alike ? sim::look_alike_drive(settings.seed, settings)
                                  : sim::LookAlike{sim::drive(settings), 0, 0, {}}};
  const sim::Drive& drive = alike.drive;
  if (look_alike) fmt::print("scans {} and {} look alike\n", alike.first, alike.second);

  bool good = write_tum(folder / "truth.tum", drive.size(),
                        [&](std::size_t i) -> const Pose& { return drive.truth(i); });
  good &= write_tum(folder / "odometry.tum", drive.size(),
                    [&](std::size_t i) -> const Pose& { return drive.odometry(i); });
  std::atomic<bool> all_good{good};
  std::atomic<std::size_t> done{0}, points_written{0};
  std::mutex progress;
  tbb::parallel_for(std::size_t{0}, drive.size(), [&](std::size_t i) {
    thread_local std::vector<Point> points;
    drive.points(i, points);
    points_written += points.size();
    if (!sim::write_pcd(folder / fmt::format("scan{:03}.pcd", i), points)) all_good = false;
    const std::size_t count = ++done;
    if (count % 20 == 0 || count == drive.size()) {
      const std::lock_guard lock(progress);
      fmt::print(stderr, "\r{} of {} scans", count, drive.size());
    }
  });
  fmt::print(stderr, "\n");
  if (!all_good) {
    fmt::print(stderr, "alces_town: cannot write all files into {} (space? permissions?)\n", folder.string());
    return 3;
  }
  fmt::print("{} scans of {} rays, {} points a scan come back; tour of {:.0f} m; written to {}\n",
             drive.size(), drive.rays(), points_written / drive.size(), drive.tour_length_m(),
             folder.string());
  return 0;
}
