// Bags of ROS, from bytes to scans and poses.
#include <filesystem>
#include <string>

#include "../memory_file.h"
#include "offline/io/bags/bag_trajectory.h"
#include "offline/io/files/error.h"
#include "offline/io/scans/scan_source.h"

namespace alces::fuzz {
namespace {

void read_bag(const std::filesystem::path& bag) {
  try {
    const auto scans = offline::open_scans(bag);
    offline::ScanPoints scan;
    for (std::size_t i = 0; i < scans->size() && i < 20; ++i) {
      require(scans->read(i, scan), "a surveyed scan is there");
      require(scan.time_s.empty() || scan.time_s.size() == scan.size(), "a time a point, or none");
      require(scan.intensity.empty() || scan.intensity.size() == scan.size(),
              "an intensity a point, or none");
      if (const auto pose = scans->odometry(i)) require(is_valid(*pose), "poses are poses");
      require(!scans->name(i).empty(), "a scan has a name");
    }
    require(!scans->description().empty(), "a source describes itself");
    (void)scans->warnings();
  } catch (const offline::InputError&) {
  }
  try {
    (void)offline::read_bag_trajectory(bag);
  } catch (const offline::InputError&) {
  }
}

void read_file_called(const char* name, std::span<const std::uint8_t> bytes) {
  const MemoryFolder folder;
  folder.write(name, as_text(bytes));
  read_bag(folder.path() / name);
}

ALCES_FUZZ_TARGET(bag_mcap) {
  read_file_called("drive.mcap", bytes);
}
ALCES_FUZZ_TARGET(bag_ros1) {
  read_file_called("drive.bag", bytes);
}
ALCES_FUZZ_TARGET(bag_sqlite) {
  read_file_called("drive.db3", bytes);
}

/// metadata.yaml, and what it may name.
ALCES_FUZZ_TARGET(bag_folder) {
  const MemoryFolder folder;
  for_each_file(bytes, {"metadata.yaml", "bag_0.mcap", "bag_1.mcap", "bag_0.db3", "bag_0.mcap.zstd"},
                [&](std::string_view name, std::string_view content) { folder.write(name, content); });
  read_bag(folder.path());
}

}  // namespace
}  // namespace alces::fuzz
