#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "offline/io/bags/bag_trajectory.h"
#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "offline/io/files/number_table.h"
#include "offline/io/files/text_numbers.h"
#include "trajectory.h"
#include "trajectory_files.h"

namespace alces::offline {
namespace {

// How far a rotation may be from one before it is no rounding of a text file any more.
constexpr double rotation_tolerance = 0.01;

constexpr double rad_per_deg = 3.14159265358979323846 / 180.0;

void check_finite(const std::filesystem::path& file, std::size_t line, std::span<const double> numbers) {
  if (!std::all_of(numbers.begin(), numbers.end(), [](double number) { return std::isfinite(number); })) {
    throw InputError(file, line, "a pose holds NaN or Inf; remove or correct it");
  }
}

void check_rotation(const std::filesystem::path& file, std::size_t line, const Eigen::Matrix4d& matrix) {
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const bool orthonormal =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <
      rotation_tolerance;
  if (!orthonormal || rotation.determinant() < 0) {
    throw InputError(file, line,
                     orthonormal ? "the matrix mirrors, it is no rotation; is its frame left-handed?"
                                 : "the matrix is no rotation; its columns must be orthogonal, of length 1");
  }
}

/// Where in a line the numbers of a pose stand.
struct PoseColumns {
  std::optional<std::size_t> stamp;
  std::array<std::size_t, 3> position{};
  std::array<std::size_t, 4> quaternion{};  ///< x y z w
  double stamps_a_second = 1;               ///< as its name says the unit; 0: it does not
};

constexpr PoseColumns tum_columns = {0, {1, 2, 3}, {4, 5, 6, 7}, 0};

/// "q_RS_w []" is axis w of "q_rs"; "tx" axis x of "t"; "pose.position.x" axis x of "pose.position".
struct AxisName {
  std::string of;
  char axis = 0;
};

AxisName axis_name(const std::string& cell) {
  AxisName name;
  for (const char c : cell.substr(0, cell.find_first_of("[("))) {
    if (c != ' ') name.of.push_back(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
  }
  if (name.of.size() > 2 && name.of.ends_with("_m")) name.of.resize(name.of.size() - 2);
  if (name.of.empty()) return name;
  name.axis = name.of.back();
  name.of.pop_back();
  while (!name.of.empty() && (name.of.back() == '_' || name.of.back() == '.')) name.of.pop_back();
  return name;
}

bool names_quaternion(const std::string& of) {
  return of == "q" || of.starts_with("q_") || of.starts_with("quat") || of.ends_with("orientation") ||
         of.ends_with("rotation") || of == "rot";
}

bool names_position(const std::string& of) {
  return of.empty() || of == "t" || of == "p" || of == "pos" || of.starts_with("p_") || of == "trans" ||
         of.ends_with("position") || of.ends_with("translation");
}

std::optional<double> stamps_a_second_of(const std::string& cell) {
  std::string name;
  for (const char c : cell) name.push_back(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
  const bool is_stamp = name == "t" || name.find("time") != std::string::npos ||
                        name.find("stamp") != std::string::npos || name == "sec" || name == "secs";
  if (!is_stamp) return std::nullopt;
  using Unit = std::pair<const char*, double>;
  for (const auto& [unit, a_second] : {Unit{"ns", 1e9}, Unit{"us", 1e6}, Unit{"ms", 1e3}, Unit{"s", 1}}) {
    const std::string text = unit;
    if (name.find("[" + text + "]") != std::string::npos || name.ends_with("_" + text) ||
        name.find("(" + text + ")") != std::string::npos)
      return a_second;
  }
  return 0;
}

/// The columns that a heading names; none where it does not name position and quaternion whole.
std::optional<PoseColumns> columns_named(const std::vector<std::string>& cells) {
  PoseColumns columns;
  columns.stamps_a_second = 0;
  std::array<bool, 3> has_position{};
  std::array<bool, 4> has_quaternion{};
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (const auto a_second = stamps_a_second_of(cells[i]); a_second && !columns.stamp) {
      columns.stamp = i;
      columns.stamps_a_second = *a_second;
      continue;
    }
    const AxisName name = axis_name(cells[i]);
    const std::size_t axis = std::string_view("xyzw").find(name.axis);
    if (axis > 3) continue;
    if (names_quaternion(name.of)) {
      if (!has_quaternion.at(axis)) columns.quaternion.at(axis) = i;
      has_quaternion.at(axis) = true;
    } else if (axis < 3 && names_position(name.of)) {
      if (!has_position.at(axis)) columns.position.at(axis) = i;
      has_position.at(axis) = true;
    }
  }
  const auto all = [](const auto& found) {
    return std::all_of(found.begin(), found.end(), [](bool each) { return each; });
  };
  if (!all(has_position) || !all(has_quaternion)) return std::nullopt;
  return columns;
}

/// The last heading that names a pose's columns. InputError where it does not fit the lines below it.
std::optional<PoseColumns> named_columns(const std::filesystem::path& file, const NumberTable& table) {
  std::optional<PoseColumns> columns;
  for (const std::vector<std::string>& heading : table.headings()) {
    const auto named = columns_named(heading);
    if (!named) continue;
    if (heading.size() != table.row(0).size()) {
      throw InputError(file, table.line(0),
                       fmt::format("has {} numbers where the line of names above has {} columns; correct one "
                                   "of them",
                                   table.row(0).size(), heading.size()));
    }
    columns = named;
  }
  return columns;
}

Pose pose_of(const std::filesystem::path& file, std::size_t line, std::span<const double> row,
             const PoseColumns& columns) {
  Pose pose;
  const auto& [x, y, z] = columns.position;
  const auto& [qx, qy, qz, qw] = columns.quaternion;
  pose.translation_m = {row[x], row[y], row[z]};
  pose.rotation = Eigen::Quaterniond(row[qw], row[qx], row[qy], row[qz]);
  if (std::abs(pose.rotation.norm() - 1.0) > rotation_tolerance) {
    throw InputError(file, line,
                     fmt::format("the quaternion has length {:.4g} instead of 1; TUM's order is stamp x y z "
                                 "qx qy qz qw",
                                 pose.rotation.norm()));
  }
  pose.rotation.normalize();
  return pose;
}

/// Stamps as the file has them become seconds, scan numbers stay.
void settle_stamps(const std::filesystem::path& file, double a_second, Trajectory& trajectory) {
  const auto& stamps = trajectory.stamps_s;
  const double largest = *std::max_element(stamps.begin(), stamps.end());
  const bool has_unit = a_second != 0;
  if (!has_unit) {
    a_second = 1;
    // in seconds these would be after the year 5000
    for (const double unit : {1e3, 1e6, 1e9})
      if (largest >= 1e8 * unit) a_second = unit;
    if (a_second > 1)
      trajectory.notes.push_back(fmt::format("{}: stamps as large as {:.0f} are taken as {}", file.string(),
                                             largest,
                                             a_second == 1e3   ? "milliseconds"
                                             : a_second == 1e6 ? "microseconds"
                                                               : "nanoseconds"));
  }
  constexpr double least_epoch_s = 1e8;  // 1973; nobody has so many scans
  trajectory.has_time =
      has_unit || a_second > 1 || largest >= least_epoch_s ||
      std::any_of(stamps.begin(), stamps.end(), [](double stamp) { return stamp != std::floor(stamp); });
  for (double& stamp : trajectory.stamps_s) stamp /= a_second;
}

Trajectory read_columns(const std::filesystem::path& file, const NumberTable& table,
                        const PoseColumns& columns) {
  Trajectory trajectory;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    check_finite(file, table.line(i), table.row(i));
    trajectory.stamps_s.push_back(columns.stamp ? table.row(i)[*columns.stamp] : static_cast<double>(i));
    trajectory.poses.push_back(pose_of(file, table.line(i), table.row(i), columns));
  }
  trajectory.has_stamps = columns.stamp.has_value();
  if (trajectory.has_stamps) settle_stamps(file, columns.stamps_a_second, trajectory);
  return trajectory;
}

Trajectory read_tum(const std::filesystem::path& file, const NumberTable& table) {
  Trajectory trajectory = read_columns(file, table, tum_columns);
  if (file.extension() != ".tum")
    trajectory.notes.push_back(
        fmt::format("{}: its columns have no names and are read as TUM has them: stamp x y z qx qy qz qw; "
                    "name them in a # line if w comes first",
                    file.string()));
  return trajectory;
}

// `numbers`: the upper three rows of the matrix
Pose matrix_pose(const std::filesystem::path& file, std::size_t line, std::span<const double> numbers) {
  check_finite(file, line, numbers);
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topRows<3>() = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(numbers.data());
  check_rotation(file, line, matrix);
  return Pose::from_matrix(matrix);
}

Trajectory read_kitti(const std::filesystem::path& file, const NumberTable& table) {
  Trajectory trajectory;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    trajectory.stamps_s.push_back(static_cast<double>(i));
    trajectory.poses.push_back(matrix_pose(file, table.line(i), table.row(i).first(12)));
  }
  return trajectory;
}

Trajectory read_matrices(const std::filesystem::path& file, const NumberTable& table) {
  if (table.rows() % 4 != 0) {
    throw InputError(
        file, table.line(table.rows() - 1),
        fmt::format("{} lines of four numbers are no whole number of 4x4 matrices; the file is cut off or "
                    "has a line too many",
                    table.rows()));
  }
  Trajectory trajectory;
  bool all_ones = true;
  for (std::size_t i = 0; i < table.rows(); i += 4) {
    const std::span<const double> last = table.row(i + 3);
    check_finite(file, table.line(i + 3), last);
    if (last[0] != 0 || last[1] != 0 || last[2] != 0) {
      throw InputError(file, table.line(i + 3),
                       "the last line of a 4x4 matrix must be 0 0 0 1 or 0 0 0 STAMP");
    }
    all_ones = all_ones && last[3] == 1;
    trajectory.stamps_s.push_back(last[3]);
    trajectory.poses.push_back(matrix_pose(file, table.line(i), table.numbers().subspan(4 * i, 12)));
  }
  trajectory.has_stamps = !all_ones;
  if (!all_ones) {
    settle_stamps(file, 0, trajectory);
    trajectory.has_time = true;
  } else {
    for (std::size_t i = 0; i < trajectory.size(); ++i) trajectory.stamps_s[i] = static_cast<double>(i);
  }
  return trajectory;
}

Trajectory read_trajectory_file(const std::filesystem::path& file) {
  const NumberTable table = NumberTable::read(file);
  if (table.rows() == 0) throw InputError(file, "holds no poses");
  const std::size_t columns = table.row(0).size();
  for (std::size_t i = 0; i < table.rows(); ++i) {
    if (table.row(i).size() != columns) {
      throw InputError(file, table.line(i),
                       fmt::format("has {} numbers where {} are expected, as in the lines before",
                                   table.row(i).size(), columns));
    }
  }
  if (const auto named = named_columns(file, table)) return read_columns(file, table, *named);
  switch (columns) {
    case 8:
      return read_tum(file, table);
    case 4:
      return read_matrices(file, table);
    case 12:
      return read_kitti(file, table);
    case 16:
      return read_kitti(file, table);  // the same with its last row
    default:
      throw InputError(
          file, table.line(0),
          fmt::format("lines of {} numbers are no trajectory; 8 (TUM), 12 (KITTI), four lines of 4 "
                      "(matrices), or any with the columns' names above them are read",
                      columns));
  }
}

std::vector<std::filesystem::path> files_ending(const std::vector<std::filesystem::path>& files,
                                                std::string_view extension) {
  std::vector<std::filesystem::path> chosen;
  for (const std::filesystem::path& file : files) {
    if (file.extension() == extension) chosen.push_back(file);
  }
  return chosen;
}

Trajectory read_3dtk_folder(const std::vector<std::filesystem::path>& files,
                            Pose (*read)(const std::filesystem::path&)) {
  Trajectory trajectory;
  trajectory.has_stamps = true;
  // as the scans beside them are numbered
  const bool named = std::all_of(files.begin(), files.end(), [](const std::filesystem::path& file) {
    return number_in_name(file).value_or(UINT64_MAX) <= largest_scan_number;
  });
  for (const std::filesystem::path& file : files) {
    trajectory.stamps_s.push_back(static_cast<double>(named ? *number_in_name(file) : trajectory.size()));
    trajectory.poses.push_back(read(file));
  }
  return trajectory;
}

}  // namespace

std::optional<std::filesystem::path> find_trajectory(const std::filesystem::path& folder) {
  std::error_code ignored;
  for (const char* name : {"odometry.tum", "trajectory.tum", "alidarPose.csv", "poses.txt"}) {
    if (std::filesystem::is_regular_file(folder / name, ignored)) return folder / name;
  }
  const std::vector<std::filesystem::path> tum = files_ending(list_files(folder), ".tum");
  if (tum.size() == 1) return tum.front();
  return std::nullopt;
}

Trajectory read_trajectory(const std::filesystem::path& file_or_folder) {
  std::error_code ignored;
  if (std::optional<Trajectory> of_bag = read_bag_trajectory(file_or_folder)) return *std::move(of_bag);
  if (!std::filesystem::is_directory(file_or_folder, ignored)) return read_trajectory_file(file_or_folder);
  if (std::filesystem::is_regular_file(file_or_folder / "trajectory.tum", ignored)) {
    return read_trajectory_file(file_or_folder / "trajectory.tum");
  }
  const std::vector<std::filesystem::path> files = list_files(file_or_folder);
  if (const auto frames = files_ending(files, ".frames"); !frames.empty()) {
    return read_3dtk_folder(frames, read_3dtk_frames);
  }
  if (const auto poses = files_ending(files, ".pose"); !poses.empty())
    return read_3dtk_folder(poses, read_3dtk_pose);
  if (const auto beside = find_trajectory(file_or_folder)) return read_trajectory_file(*beside);
  throw InputError(
      file_or_folder,
      "the folder holds no trajectory: no trajectory.tum, .frames, .pose, alidarPose.csv or poses.txt");
}

Pose read_3dtk_pose(const std::filesystem::path& file) {
  const NumberTable table = NumberTable::read(file);
  const std::span<const double> numbers = table.numbers();
  if (numbers.size() != 6) {
    throw InputError(
        file, fmt::format("has {} numbers where 6 are expected: position in cm, Euler angles in degrees",
                          numbers.size()));
  }
  check_finite(file, table.line(0), numbers);
  return from_3dtk({{numbers[0], numbers[1], numbers[2]},
                    rad_per_deg * Eigen::Vector3d(numbers[3], numbers[4], numbers[5])});
}

Pose read_3dtk_frames(const std::filesystem::path& file) {
  const NumberTable table = NumberTable::read(file);
  if (table.rows() == 0)
    throw InputError(file, "holds no matrix; a .frames file has 16 numbers and a type a line");
  const std::size_t last = table.rows() - 1;
  const std::span<const double> row = table.row(last);
  if (row.size() != 16 && row.size() != 17) {
    throw InputError(
        file, table.line(last),
        fmt::format("has {} numbers where 16 are expected, and a 17th for the type", row.size()));
  }
  check_finite(file, table.line(last), row);
  const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix4d>(row.data());  // column by column
  check_rotation(file, table.line(last), matrix);
  return from_matrix_3dtk(matrix);
}

Pose read_kitti_calibration(const std::filesystem::path& calib) {
  std::string bytes;
  read_file(calib, bytes);
  const std::size_t begin = bytes.starts_with("Tr:") ? 0 : bytes.find("\nTr:");
  std::vector<double> numbers;
  if (begin != std::string::npos) {
    const char* at = bytes.data() + bytes.find(':', begin) + 1;
    const char* const end = bytes.data() + bytes.size();
    double value = 0;
    while (true) {
      while (is_blank(*at)) ++at;
      at = parse_number(at, end, value);
      if (at == nullptr) break;
      numbers.push_back(value);
    }
  }
  if (numbers.size() != 12) throw InputError(calib, "has no line \"Tr:\" of 12 numbers");
  return matrix_pose(calib, 1, numbers);
}

std::vector<double> read_times(const std::filesystem::path& file) {
  const NumberTable table = NumberTable::read(file);
  return {table.numbers().begin(), table.numbers().end()};
}

}  // namespace alces::offline
