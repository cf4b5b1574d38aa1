#include <fmt/format.h>

#include <array>
#include <cstring>

#include "alces_offline/error.h"
#include "alces_offline/scan_format.h"

namespace alces::offline {

void parse_kitti(const ScanBytes& scan, std::vector<Point>& points) {
  using Record = std::array<float, 4>;
  if (scan.bytes.size() % sizeof(Record) != 0) {
    throw InputError(scan.file,
                     fmt::format("{} bytes are no multiple of 16 (float32 x y z intensity); the file is cut "
                                 "off after {} points or is no KITTI scan",
                                 scan.bytes.size(), scan.bytes.size() / sizeof(Record)));
  }
  points.resize(scan.bytes.size() / sizeof(Record));
  const char* at = scan.bytes.data();
  for (Point& point : points) {
    Record record{};
    std::memcpy(record.data(), at, sizeof(Record));
    point = {record[0], record[1], record[2]};
    at += sizeof(Record);
  }
}

}  // namespace alces::offline
