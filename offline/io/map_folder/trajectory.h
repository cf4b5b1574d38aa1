// Trajectories in the formats of others.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "alces/pose.h"

namespace alces::offline {

struct Trajectory {
  /// One a pose: seconds where the file knows them (has_time), scan numbers otherwise.
  std::vector<double> stamps_s;
  /// map_from_body
  std::vector<Pose> poses;
  bool has_time = false;
  /// The file says its stamps; false: they are the lines' numbers from 0.
  bool has_stamps = false;
  /// What was assumed that a reader should know, a sentence each.
  std::vector<std::string> notes = {};

  [[nodiscard]] std::size_t size() const { return poses.size(); }
};

/// Recognises by content, so the file's name does not matter:
///   - TUM: `stamp x y z qx qy qz qw` a line, # comments. Whole numbers count as scan numbers, from 1e8 on as
///   seconds, and as ms, us or ns where they are so large that seconds would be beyond the year 5000;
///   - columns that a comment or the first line names (EuRoC's ground truth, ROS): by their names, in any
///   order and with others between. Eight columns without names are TUM's, and of files not called .tum a
///   note says so;
///   - KITTI: the 12 numbers of a 3x4 matrix a line;
///   - 4x4 matrices, four lines a pose, also with the stamp in place of the last 1 (alidarPose.csv);
///   - a folder of 3DTK .frames (the last line's matrix) or, without them, .pose files, numbered by name;
///   - a map folder (its trajectory.tum);
///   - a bag, or BAG:TOPIC (bag_trajectory.h).
/// Numbers may be separated by blanks, tabs, commas or semicolons. InputError otherwise.
[[nodiscard]] Trajectory read_trajectory(const std::filesystem::path& file_or_folder);

/// position in cm, Euler angles in deg, six numbers: a 3DTK .pose file.
[[nodiscard]] Pose read_3dtk_pose(const std::filesystem::path& file);
/// The last line's matrix of a 3DTK .frames file.
[[nodiscard]] Pose read_3dtk_frames(const std::filesystem::path& file);

/// Metres to 1e-7, quaternions to 1e-12; OutputError.
void write_tum(const std::filesystem::path& file, const Trajectory& trajectory);
/// 3x4 row by row, 12 significant digits; stamps are lost. OutputError.
void write_kitti(const std::filesystem::path& file, const Trajectory& trajectory);
/// scanNNN.frames for every pose (NNN: the stamp where stamps are scan numbers, else the place in the order),
/// ready for 3DTK's `show`; makes the folder. OutputError.
void write_3dtk_frames(const std::filesystem::path& folder, const Trajectory& trajectory);

}  // namespace alces::offline
