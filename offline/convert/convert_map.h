// What `alces convert` does with clouds, scans, maps, trajectories and pose graphs. (Drives, which are
// events, are converted by platform/replay.)
//
//   in:  a map folder, a folder of scans, a bag or one cloud (all that open_scans reads), a trajectory, a
//   pose graph
//        (g2o, TORO), a recording with the scans and poses that alcesd mapped
//   out: a cloud (PLY, PCD, LAS, CSV, KITTI .bin), a trajectory (TUM, KITTI, 3DTK frames), a pose graph, a
//        recording (MCAP); a folder of scans, as PCD in the body's frame, with odometry.tum beside them
//
// A pose graph becomes a pose graph or a trajectory, whose stamps are the vertices' ids. A map folder becomes
// a recording with its clouds, poses, edges and loops; a recording with poses and edges becomes a pose graph.
//
// Clouds are in the map's frame: every scan at its pose. Maps, folders of scans and recordings are read scan
// by scan and single PLY clouds in pieces, so that memory does not grow with them; other single files are
// read whole.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "offline/io/scans/scan_source.h"

namespace alces::offline {

enum class ConversionSource : std::uint8_t { map_folder, scans, cloud, trajectory, graph, recording };
enum class ConversionForm : std::uint8_t {
  ply,
  pcd,
  las,
  csv,
  kitti_scan,
  tum,
  kitti,
  frames,
  g2o,
  toro,
  mcap,
  scan_folder,
};

/// What `in` is, when it is one of these; none: leave it to others.
[[nodiscard]] std::optional<ConversionSource> conversion_source(const std::filesystem::path& in);
/// By the name of OUT: .ply .pcd .las .csv .xyz .bin .tum .kitti .g2o .graph .mcap, and a folder called
/// frames. Any other folder (a name that ends in /) is one of scans where IN is scans.
[[nodiscard]] std::optional<ConversionForm> conversion_form(const std::filesystem::path& out);
/// "ply", "pcd", ..., "kitti-scan", as --to has them.
[[nodiscard]] std::optional<ConversionForm> conversion_form_called(const std::string& name);

struct MapConversion {
  std::filesystem::path in;
  std::filesystem::path out;
  ConversionSource source = ConversionSource::cloud;
  ConversionForm form = ConversionForm::ply;
  std::optional<std::filesystem::path> odometry = {};  ///< poses of the scans, instead of those beside them
  bool no_odometry = false;                            ///< nor those beside them
  double scale = 1;                                    ///< of the scans' coordinates
  std::string scan_format = {};                        ///< ScanSourceOptions::format
  BagTopics bag = {};                                  ///< ScanSourceOptions::bag
};

struct MapConversionReport {
  std::uint64_t scans = 0;
  std::uint64_t points = 0;
  std::uint64_t not_finite = 0;  ///< points left out
  std::uint64_t poses = 0;
  std::uint64_t edges = 0;  ///< of a pose graph
  std::uint64_t loops = 0;  ///< into a recording
  std::vector<std::string> warnings;
};

/// InputError, OutputError, UsageError for what cannot become OUT's form.
MapConversionReport convert_map(const MapConversion& conversion,
                                const std::function<void(std::size_t, std::size_t)>& progress = {});

}  // namespace alces::offline
