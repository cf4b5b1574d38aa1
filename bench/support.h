// What the benchmarks share: where scans come from.
#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "alces/point.h"
#include "alces/pose.h"
#include "alces_platform/sim/drive.h"
#include "tables.h"

namespace alces::bench {

/// A real folder, or the town when none is named.
struct Drive {
  std::size_t size = 0;
  std::function<void(std::size_t, std::vector<Point>&)> points;
  std::vector<Pose> odometry;
  std::vector<Pose> truth;  ///< empty: none is known
  std::string name;
};

/// A folder of scans with odometry in it or beside it (odometry.tum), and a trajectory of where they were,
/// unless that is empty.
[[nodiscard]] Drive recorded(const std::string& folder, std::size_t most_scans,
                             const std::string& truth_file = {});

/// A drive through the town, with rays for about so many points a scan.
[[nodiscard]] Drive town(std::uint64_t seed, std::size_t scans, std::size_t returned_points);

class DriveOptions {
 public:
  void add_to(CLI::App& app);
  [[nodiscard]] Drive open() const;

 private:
  std::string folder_;
  std::size_t scans_ = 924;
  std::uint64_t seed_ = 1;
  std::size_t returned_points_ = 35000;
};

/// Downsampled to a point a cell, as the mapper does it.
[[nodiscard]] std::vector<Point> reduced(const std::vector<Point>& points, float cell_size_m);

}  // namespace alces::bench
