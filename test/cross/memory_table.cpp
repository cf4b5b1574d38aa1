// memory_table: what a mapper of 512 KiB, 8 MiB, 64 MiB and 1 GiB has room for, as a Markdown table:
// docs/target.md shows it. The planner is that of alcesd and `alces map`; "half full" means scans that keep
// half of the points they may.
#include <algorithm>
#include <array>
#include <cstdio>

#include "alces/mapper.h"
#include "alces_platform/settings/memory_plan.h"

namespace {

using alces::MapperConfig;

struct Row {
  const char* memory;
  const char* settings;
  std::size_t bytes;
  MapperConfig config;
};

// docs/examples/firmware
MapperConfig microcontroller() {
  MapperConfig config = MapperConfig::standard();
  config.loop_capacity = 8;
  config.model_scans = 1;
  config.model_points = 0;
  config.voxel.cell_capacity = 512;
  config.surface.sample_capacity = 96;
  config.correspondence_capacity = 800;
  config.cache_slots = 10;
  return config;
}

MapperConfig small_board() {
  MapperConfig config = MapperConfig::standard();
  config.loop_capacity = 64;
  config.voxel.cell_capacity = 4096;
  config.surface.sample_capacity = 768;
  return config;
}

MapperConfig standard(std::uint32_t loops) {
  MapperConfig config = MapperConfig::standard();
  config.loop_capacity = loops;
  config.voxel.cell_capacity = 32768;
  return config;
}

// As many scans as the pool and the list of poses hold at once, when each keeps `points` points.
struct Room {
  std::size_t scans = 0;
  std::size_t scan_bytes = 0;
};
Room room(MapperConfig config, std::size_t limit_bytes, std::uint32_t points) {
  config.pool_bytes = 0;
  Room best;
  best.scan_bytes =
      alces::StoredScanLayout::record_bytes(points, std::min(points, config.surface.sample_capacity));
  config.scan_capacity = 1;
  const std::size_t fixed_bytes = alces::settings::least_memory(config);
  config.scan_capacity = 1025;
  const std::size_t pose_bytes = (alces::settings::least_memory(config) - fixed_bytes) / 1024;
  best.scans = limit_bytes <= fixed_bytes ? 0 : (limit_bytes - fixed_bytes) / (best.scan_bytes + pose_bytes);
  // Tables are powers of two: step down to what is really planned.
  for (; best.scans > 0; --best.scans) {
    config.scan_capacity = static_cast<std::uint32_t>(best.scans);
    const std::size_t least_bytes = alces::settings::least_memory(config);
    if (least_bytes <= limit_bytes && limit_bytes - least_bytes >= best.scans * best.scan_bytes) break;
  }
  return best;
}

}  // namespace

int main() {
  const std::array<Row, 4> rows = {{
      {"512 KiB", "the firmware's: 512 points a scan", std::size_t{512} << 10, microcontroller()},
      {"8 MiB", "4096 points a scan", std::size_t{8} << 20, small_board()},
      {"64 MiB", "32768 points a scan", std::size_t{64} << 20, standard(1024)},
      {"1 GiB", "32768 points a scan", std::size_t{1} << 30, standard(4096)},
  }};
  std::printf(
      "| memory | settings | scans, each half full | points of these | scans, each full | poses with an "
      "archive | loops |\n");
  std::printf("|---|---|--:|--:|--:|--:|--:|\n");
  for (Row row : rows) {
    row.config.pool_bytes = 0;  // what is left
    const std::uint32_t most = row.config.voxel.cell_capacity;
    const Room half = room(row.config, row.bytes, most / 2);
    const Room full = room(row.config, row.bytes, most);
    std::printf("| %s | %s | %zu | %zu | %zu | %u | %u |\n", row.memory, row.settings, half.scans,
                half.scans * (most / 2), full.scans,
                alces::settings::scans_that_fit(row.config, row.bytes, true), row.config.loop_capacity);
    if (full.scans == 0) return 1;
  }
  return 0;
}
