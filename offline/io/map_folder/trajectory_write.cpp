#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <iterator>
#include <string>

#include "offline/io/files/output_file.h"
#include "trajectory.h"

namespace alces::offline {

void write_tum(const std::filesystem::path& file, const Trajectory& trajectory) {
  OutputFile output(file);
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const Pose& pose = trajectory.poses[i];
    const Eigen::Vector3d& t = pose.translation_m;
    const Eigen::Quaterniond& q = pose.rotation;
    const std::string stamp = fmt::format("{:.{}f}", trajectory.stamps_s[i], trajectory.has_time ? 9 : 0);
    output.write(fmt::format("{} {:.7f} {:.7f} {:.7f} {:.12f} {:.12f} {:.12f} {:.12f}\n", stamp, t.x(), t.y(),
                             t.z(), q.x(), q.y(), q.z(), q.w()));
  }
  output.commit();
}

void write_kitti(const std::filesystem::path& file, const Trajectory& trajectory) {
  OutputFile output(file);
  for (const Pose& pose : trajectory.poses) {
    const Eigen::Matrix4d m = pose.matrix();
    std::string line;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) {
        fmt::format_to(std::back_inserter(line), "{}{:.12g}", line.empty() ? "" : " ", m(row, column));
      }
    }
    output.write(line + "\n");
  }
  output.commit();
}

void write_3dtk_frames(const std::filesystem::path& folder, const Trajectory& trajectory) {
  make_folder(folder);
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const auto number = trajectory.has_time
                            ? std::uint64_t{i}
                            : static_cast<std::uint64_t>(std::llround(trajectory.stamps_s[i]));
    const Eigen::Matrix4d m = matrix_3dtk(trajectory.poses[i]);
    std::string line;
    for (int column = 0; column < 4; ++column) {
      for (int row = 0; row < 4; ++row) fmt::format_to(std::back_inserter(line), "{:.12g} ", m(row, column));
    }
    // 2 is slam6D's "finished" colour; `show` takes the last line as the scan's pose
    OutputFile output(folder / fmt::format("scan{:03}.frames", number));
    output.write(line + "2\n");
    output.commit();
  }
}

}  // namespace alces::offline
