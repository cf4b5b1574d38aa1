// Scan formats, from bytes to points.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "../memory_file.h"
#include "offline/io/files/error.h"
#include "offline/io/files/lzf.h"
#include "offline/io/scans/scan_format.h"
#include "offline/io/scans/scan_source.h"

namespace alces::fuzz {
namespace {

using offline::ScanBytes;

template <class Parse>
void parse_cloud(std::span<const std::uint8_t> bytes, const char* name, const Parse& parse) {
  const std::filesystem::path file(name);
  const std::string text(as_text(bytes));  // a 0 behind its end
  std::vector<std::string> warnings;
  offline::ScanPoints scan;
  try {
    parse(ScanBytes{file, text, warnings}, scan);
  } catch (const offline::InputError&) {
    return;
  }
  require(scan.size() <= bytes.size(), "a point takes a byte at least");
  require(scan.time_s.empty() || scan.time_s.size() == scan.size(), "a time a point");
  require(scan.intensity.empty() || scan.intensity.size() == scan.size(), "an intensity a point");
}

ALCES_FUZZ_TARGET(pcd) {
  parse_cloud(bytes, "scan.pcd", offline::parse_pcd);
}
ALCES_FUZZ_TARGET(ply) {
  parse_cloud(bytes, "scan.ply", offline::parse_ply);
}
ALCES_FUZZ_TARGET(las) {
  parse_cloud(bytes, "scan.las", offline::parse_las);
}
ALCES_FUZZ_TARGET(csv) {
  parse_cloud(bytes, "scan.csv", offline::parse_csv);
}
ALCES_FUZZ_TARGET(uos) {
  parse_cloud(bytes, "scan000.3d", offline::parse_3dtk);
}
ALCES_FUZZ_TARGET(kitti) {
  parse_cloud(bytes, "000000.bin", [](const ScanBytes& scan, offline::ScanPoints& out) {
    ScanBytes recognised = scan;
    recognised.reading.record = offline::recognise_record(scan);
    offline::parse_kitti(recognised, out);
  });
}

ALCES_FUZZ_TARGET(lzf) {
  if (bytes.size() < 2) return;
  std::string out(bytes[0] + 256U * bytes[1], '\0');
  (void)offline::lzf_decompress(as_text(bytes.subspan(2)), out);
}

/// A folder of scans with poses beside them: names, pairing, one origin, warnings.
ALCES_FUZZ_TARGET(scan_folder) {
  const MemoryFolder folder;
  for_each_file(bytes,
                {"scan000.3d", "scan000.pose", "scan001.3d", "scan001.pose", "scan001.frames", "1.5.pcd",
                 "2.25.pcd", "0.ply", "000000.bin", "a.csv", "b.las", "odometry.tum", "alidarPose.csv",
                 "poses.txt", "calib.txt", "times.txt"},
                [&](std::string_view name, std::string_view content) { folder.write(name, content); });
  try {
    const auto scans = offline::open_scans(folder.path());
    offline::ScanPoints scan;
    for (std::size_t i = 0; i < scans->size(); ++i) {
      try {
        require(scans->read(i, scan), "a scan of a folder is there");
      } catch (const offline::InputError&) {
      }
      (void)scans->odometry(i);
      (void)scans->stamp_s(i);
      require(!scans->name(i).empty(), "a scan has a name");
    }
    require(!scans->description().empty(), "a source describes itself");
    (void)scans->warnings();
  } catch (const offline::InputError&) {
  }
}

}  // namespace
}  // namespace alces::fuzz
