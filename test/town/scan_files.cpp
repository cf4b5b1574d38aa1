#include "scan_files.h"

#include <fmt/core.h>

#include <fstream>

namespace alces::sim {

bool write_pcd(const std::filesystem::path& path, const std::vector<Point>& points) {
  std::ofstream file(path, std::ios::binary);
  file << fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT "
      "1 1 1\n"
      "WIDTH {0}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
      points.size());
  static_assert(sizeof(Point) == 3 * sizeof(float));
  file.write(reinterpret_cast<const char*>(points.data()),
             static_cast<std::streamsize>(points.size() * sizeof(Point)));
  return file.flush().good();
}

std::string tum_line(double stamp, const Pose& pose) {
  const Eigen::Vector3d& t = pose.translation_m;
  const Eigen::Quaterniond& q = pose.rotation;
  return fmt::format("{:.15g} {:.6f} {:.6f} {:.6f} {:.9f} {:.9f} {:.9f} {:.9f}\n", stamp, t.x(), t.y(), t.z(),
                     q.x(), q.y(), q.z(), q.w());
}

}  // namespace alces::sim
