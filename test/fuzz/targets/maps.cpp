// What a map folder holds, as all verbs that take one read it; and files of the desk beside it.
#include <string>
#include <vector>

#include "../memory_file.h"
#include "alces/stored_scan.h"
#include "experiments/reference/building_outlines.h"
#include "offline/io/files/error.h"
#include "offline/io/map_folder/ply_stream.h"
#include "offline/io/map_folder/scan_table.h"
#include "offline/io/map_folder/stored_scan_file.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/optimize/lum/checkpoint.h"
#include "offline/report/report_map.h"

namespace alces::fuzz {
namespace {

template <class Read>
void attempt(const Read& read) {
  try {
    read();
  } catch (const offline::Error&) {
  }
}

ALCES_FUZZ_TARGET(map_folder) {
  const MemoryFolder folder;
  for_each_file(bytes,
                {"run.json", "trajectory.tum", "trajectory_without_loops.tum", "graph.g2o", "scans.csv",
                 "counters.csv", "map.ply"},
                [&](std::string_view name, std::string_view content) { folder.write(name, content); });
  attempt([&] { (void)offline::read_trajectory(folder.path()); });
  attempt([&] { (void)offline::read_scan_table(folder.path() / "scans.csv"); });
  attempt([&] { (void)offline::read_report_map(folder.path(), 1000); });
  attempt([&] { (void)offline::stream_ply(folder.path() / "map.ply", [](std::span<const Point>) {}); });
}

ALCES_FUZZ_TARGET(scans_alces) {
  const MemoryFile file(bytes);
  attempt([&] {
    offline::StoredScanFile scans(file.path());
    for (std::size_t row = 0; row < scans.size(); ++row) attempt([&] { (void)scans.read(row); });
  });
}

/// A record of one scan: what parse() takes, every accessor can read.
ALCES_FUZZ_TARGET(stored_scan) {
  StoredScanView view;
  if (StoredScanView::parse(std::as_bytes(bytes), view) != StoredScanFault::none) return;
  for (std::uint32_t i = 0; i < view.point_count(); ++i) {
    require(is_finite(view.point(i)), "points are finite");
    if (view.has_intensity()) (void)view.intensity(i);
    if (view.has_time()) (void)view.time_s(i);
  }
  for (std::uint32_t i = 0; i < view.sample_count(); ++i)
    require(view.sample(i).index < view.point_count(), "samples are of points that are there");
}

ALCES_FUZZ_TARGET(checkpoint) {
  const MemoryFile file(bytes);
  attempt([&] { (void)offline::read_checkpoint(file.path(), 3, "fuzz"); });
}

ALCES_FUZZ_TARGET(outlines) {
  const MemoryFile file(bytes);
  attempt([&] {
    const auto buildings = offline::read_building_outlines(file.path(), 10);
    (void)offline::extrude_walls(buildings, 100);
  });
}

}  // namespace
}  // namespace alces::fuzz
