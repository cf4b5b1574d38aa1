// alces_drive_scans: the scans that the drivers make of a recorded drive, as a folder: scanNNNN.pcd,
// odometry.tum.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "offline/replay/drive_replay.h"
#include "scan_files.h"

namespace {

using namespace alces;

void write_scans(const std::string& drive, const std::filesystem::path& folder) {
  offline::DriveReplay replay(drive, {});
  std::filesystem::create_directories(folder);
  std::ofstream odometry(folder / "odometry.tum");
  offline::ScanPoints scan;
  std::size_t count = 0;
  for (; replay.read(count, scan); ++count) {
    const auto pose = replay.odometry(count);
    const auto stamp_s = replay.stamp_s(count);
    if (!pose || !stamp_s)
      throw std::runtime_error(fmt::format("scan {} has no odometry or no stamp", count));
    odometry << sim::tum_line(*stamp_s, *pose);
    const std::filesystem::path file = folder / fmt::format("scan{:04}.pcd", count);
    if (!sim::write_pcd(file, scan.points))
      throw std::runtime_error(fmt::format("cannot write {}", file.string()));
  }
  if (!odometry.flush().good()) throw std::runtime_error("cannot write odometry.tum");
  fmt::print("{} scans in {}\n", count, folder.string());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Writes the scans that the drivers make of a recorded drive, with the odometry of each");
  std::string drive;
  std::filesystem::path folder;
  app.add_option("DRIVE", drive, "A recording, or a folder of traces")->required();
  app.add_option("--out", folder, "Folder to write (made if missing)")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    write_scans(drive, folder);
  } catch (const std::exception& error) {
    fmt::print(stderr, "alces_drive_scans: {}\n", error.what());
    return 3;
  }
  return 0;
}
