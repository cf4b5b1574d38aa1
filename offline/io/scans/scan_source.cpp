#include "scan_source.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <map>
#include <mutex>
#include <string_view>
#include <system_error>
#include <utility>

#include "alces_platform/bags/bag_reader.h"
#include "offline/evaluate/evaluation.h"
#include "offline/io/bags/bag_scans.h"
#include "offline/io/bags/bag_trajectory.h"
#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/map_folder/trajectory_files.h"
#include "scan_format.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;

/// Beyond this a float has no millimetres: national grids have millions of metres.
constexpr double farthest_exact_m = 10'000;
/// How far names and odometry may be apart to be of one scan.
constexpr double max_stamp_difference_s = 0.02;

struct Format {
  std::string_view name;
  std::string_view title;
  void (*parse)(const ScanBytes& scan, ScanPoints& out);
  std::array<std::string_view, 4> extensions;  ///< those that make a file of a folder a scan
};

// A folder with several of them is taken for the first: a CSV beside PCD files is a table of something else.
constexpr std::array<Format, 6> formats = {{{"3dtk", "3DTK uos", parse_3dtk, {".3d"}},
                                            {"pcd", "PCD", parse_pcd, {".pcd"}},
                                            {"ply", "PLY", parse_ply, {".ply"}},
                                            {"las", "LAS", parse_las, {".las"}},
                                            {"kitti", "KITTI", parse_kitti, {".bin"}},
                                            {"csv", "CSV", parse_csv, {".csv", ".xyz", ".asc"}}}};

const Format* format_called(std::string_view name) {
  if (binary_record_called(name)) name = "kitti";
  for (const Format& format : formats) {
    if (format.name == name) return &format;
  }
  return nullptr;
}

const Format* format_of(const fs::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension.empty()) return nullptr;
  for (const Format& format : formats) {
    if (std::find(format.extensions.begin(), format.extensions.end(), extension) != format.extensions.end()) {
      return &format;
    }
  }
  return nullptr;
}

struct Entry {
  fs::path file;
  const Format* format = nullptr;
  std::size_t number = 0;
  std::optional<Pose> odometry = {};
  std::optional<double> stamp_s = {};
};

/// What the first scans say of all: their origin, their records, whether their unit can be metres.
class Probe {
 public:
  Probe(const std::vector<Entry>& entries, ScanReading reading, std::optional<double> scan_interval_s)
      : entries_(entries), reading_(reading), scan_interval_s_(scan_interval_s) {
    constexpr std::size_t most_files = 8;  // that hold nothing
    for (std::size_t i = 0; i < std::min(most_files, entries.size()); ++i) {
      try {
        if (look_at(entries[i])) return;
      } catch (const InputError&) {
        // whoever reads it is told
      }
    }
  }

  [[nodiscard]] const ScanReading& reading() const { return reading_; }
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

 private:
  /// False: it has no points.
  bool look_at(const Entry& entry) {
    std::string bytes;
    std::vector<std::string> ignored;
    read_file(entry.file, bytes);
    if (entry.format->parse == parse_kitti && !reading_.record && !bytes.empty())
      reading_.record = recognise_record({entry.file, bytes, notes_});
    ScanPoints scan;
    entry.format->parse({entry.file, bytes, ignored, reading_, entry.stamp_s, scan_interval_s_}, scan);
    std::vector<Point>& points = scan.points;
    std::erase_if(points, [](const Point& point) { return !is_finite(point); });
    if (points.empty()) return false;
    if (!find_origin(entry, points)) check_unit(entry, points);
    return true;
  }

  bool find_origin(const Entry& entry, const std::vector<Point>& points) {
    bool is_far = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::vector<double> values;
      values.reserve(points.size());
      for (const Point& point : points)
        values.push_back(static_cast<double>(axis == 0 ? point.x : axis == 1 ? point.y : point.z));
      const double middle = median(values);
      if (std::abs(middle) < farthest_exact_m) continue;
      for (double& value : values) value = std::abs(value - middle);
      // A scan in millimetres is as wide as it is far away; a grid's is not.
      if (median(values) > std::abs(middle) / 10) continue;
      reading_.origin_m.at(axis) = std::floor(middle / 1000) * 1000;
      is_far = true;
    }
    if (is_far)
      notes_.push_back(
          fmt::format("{}: coordinates are given from ({}, {}, {}) m on, all scans alike: floats "
                      "would lose them",
                      entry.file.string(), reading_.origin_m[0], reading_.origin_m[1], reading_.origin_m[2]));
    return is_far;
  }

  void check_unit(const Entry& entry, const std::vector<Point>& points) {
    // A cloud alone is no scan: its size says nothing.
    if (entries_.size() < 2 || entry.format->parse == parse_las || reading_.scale != 1) return;
    std::vector<double> ranges_m;
    ranges_m.reserve(points.size());
    for (const Point& point : points)
      ranges_m.push_back(static_cast<double>(std::hypot(point.x, point.y, point.z)));
    const double range_m = median(ranges_m);
    constexpr double farthest_m = 400;  // half of a scan's points are nearer, of any scanner on a vehicle
    constexpr double nearest_m = 0.25;
    const std::string name = entry.file.string();
    if (range_m > farthest_m) {
      notes_.push_back(fmt::format(
          "{}: half of its points are farther than {:.0f} m; if its numbers are millimetres, give "
          "--scale 0.001, if centimetres, --scale 0.01",
          name, range_m));
    } else if (range_m > 0 && range_m < nearest_m && entry.format == &formats.front()) {
      notes_.push_back(
          fmt::format("{}: half of its points are nearer than {:.2f} m; 3DTK's numbers are "
                      "centimetres, if these are metres, give --scale 100",
                      name, range_m));
    }
  }

  const std::vector<Entry>& entries_;
  ScanReading reading_;
  std::optional<double> scan_interval_s_;
  std::vector<std::string> notes_;
};

class FileScanSource final : public ScanSource {
 public:
  FileScanSource(std::vector<Entry> entries, ScanReading reading, std::string odometry_title,
                 std::optional<OdometryOrigin> odometry_origin, std::vector<TimedPose> motion,
                 std::vector<std::string> warnings)
      : entries_(std::move(entries)),
        reading_(reading),
        odometry_title_(std::move(odometry_title)),
        odometry_origin_(std::move(odometry_origin)),
        motion_(std::move(motion)),
        warnings_(std::move(warnings)) {
    reading_.channels = &channels_;
    std::vector<double> intervals_s;
    for (std::size_t i = 1; i < entries_.size(); ++i) {
      if (entries_[i].stamp_s && entries_[i - 1].stamp_s)
        intervals_s.push_back(*entries_[i].stamp_s - *entries_[i - 1].stamp_s);
    }
    if (!intervals_s.empty() && median(intervals_s) > 0) scan_interval_s_ = median(intervals_s);
  }

  [[nodiscard]] std::size_t size() const override { return entries_.size(); }

  bool read(std::size_t index, ScanPoints& scan) override {
    const Entry& entry = entries_.at(index);
    probe();
    read_file(entry.file, bytes_);
    std::vector<std::string> notes;
    entry.format->parse({entry.file, bytes_, notes, reading_, entry.stamp_s, scan_interval_s_}, scan);
    add_warnings(notes);
    return true;
  }

  [[nodiscard]] std::string name(std::size_t index) const override {
    return entries_.at(index).file.filename();
  }
  [[nodiscard]] std::size_t number(std::size_t index) const override { return entries_.at(index).number; }
  /// Poses of scans whose coordinates start elsewhere, too, start there.
  [[nodiscard]] std::optional<Pose> odometry(std::size_t index) const override {
    std::optional<Pose> pose = entries_.at(index).odometry;
    if (pose) move_to_origin(*pose);
    return pose;
  }
  [[nodiscard]] std::vector<TimedPose> motion(std::size_t index, double from_s, double to_s) const override {
    if (motion_.empty()) return ScanSource::motion(index, from_s, to_s);
    const auto is_before = [](const TimedPose& pose, double time_s) { return pose.time_s < time_s; };
    auto begin = std::lower_bound(motion_.begin(), motion_.end(), from_s, is_before);
    auto end = std::lower_bound(begin, motion_.end(), to_s, is_before);
    if (begin != motion_.begin()) --begin;
    if (end != motion_.end()) ++end;
    // beside either end of the drive it goes on as it went
    if (end - begin < 2 && begin != motion_.begin()) --begin;
    if (end - begin < 2 && end != motion_.end()) ++end;
    std::vector<TimedPose> poses(begin, end);
    for (TimedPose& pose : poses) move_to_origin(pose.odometry_from_body);
    return poses;
  }
  [[nodiscard]] std::optional<double> stamp_s(std::size_t index) const override {
    return entries_.at(index).stamp_s;
  }
  [[nodiscard]] std::uint64_t file_bytes(std::size_t index) const override {
    std::error_code failed;
    const std::uintmax_t bytes = fs::file_size(entries_.at(index).file, failed);
    return failed ? 0 : bytes;
  }

  [[nodiscard]] std::string description() const override {
    return fmt::format("{} {}, {}, {}", size(), size() == 1 ? "scan" : "scans",
                       entries_.front().format->title, odometry_title_);
  }

  [[nodiscard]] std::vector<std::string> warnings() const override {
    const std::scoped_lock lock(mutex_);
    return warnings_;
  }

  [[nodiscard]] std::array<double, 3> origin_m() const override {
    probe();
    return reading_.origin_m;
  }
  [[nodiscard]] std::optional<OdometryOrigin> odometry_origin() const override { return odometry_origin_; }
  [[nodiscard]] std::string channels() const override {
    probe();
    const std::scoped_lock lock(mutex_);
    return channels_.text();
  }
  [[nodiscard]] bool has_intensity() const override {
    probe();
    return channels_.full_intensity > 0;
  }

 private:
  void move_to_origin(Pose& pose) const {
    const std::array<double, 3> origin_m = FileScanSource::origin_m();
    if (origin_m == std::array<double, 3>{}) return;
    const Eigen::Vector3d origin(origin_m[0], origin_m[1], origin_m[2]);
    pose.translation_m += pose.rotation * origin - origin;
  }

  /// Before the first scan is handed on; the same whichever scan that is.
  void probe() const {
    std::call_once(is_probed_, [this] {
      const Probe found(entries_, reading_, scan_interval_s_);
      reading_ = found.reading();
      add_warnings(found.notes());
    });
  }

  void add_warnings(const std::vector<std::string>& notes) const {
    const std::scoped_lock lock(mutex_);
    for (const std::string& note : notes) {
      // a scan may be read more than once
      if (std::find(warnings_.begin(), warnings_.end(), note) == warnings_.end()) warnings_.push_back(note);
    }
  }

  std::vector<Entry> entries_;
  mutable ScanReading reading_;
  mutable ChannelReading channels_;
  std::optional<double> scan_interval_s_;
  std::string odometry_title_;
  std::optional<OdometryOrigin> odometry_origin_;
  std::vector<TimedPose> motion_;  ///< all poses of a trajectory on the scans' clock; empty: there is none
  std::string bytes_;              // of one file; kept, so that its memory is used again
  mutable std::once_flag is_probed_;
  mutable std::mutex mutex_;
  mutable std::vector<std::string> warnings_;
};

class Opener {
 public:
  explicit Opener(const ScanSourceOptions& options) : options_(options) {
    reading_.scale = options.scale;
    if (options.format.empty()) return;
    format_ = format_called(options.format);
    reading_.record = binary_record_called(options.format);
    if (format_ == nullptr)
      throw UsageError(fmt::format("--format {}: is none of {}, float32xN and float64xN (N numbers a point)",
                                   options.format, fmt::join(scan_format_names(), ", ")));
  }

  std::unique_ptr<ScanSource> folder(fs::path folder) {
    std::error_code ignored;
    std::vector<fs::path> files = list_files(folder);
    if (std::none_of(files.begin(), files.end(),
                     [](const fs::path& file) { return format_of(file) != nullptr; }) &&
        fs::is_directory(folder / "velodyne", ignored)) {
      folder /= "velodyne";  // a sequence of KITTI's odometry benchmark
      files = list_files(folder);
    }
    leave_out_maps(folder, files);
    std::optional<fs::path> trajectory;
    if (!options_.no_odometry) trajectory = trajectory_beside(folder);
    if (has_map_beside_ && trajectory && trajectory->filename() == "trajectory.tum") trajectory.reset();
    if (format_ != nullptr) take_as_asked(files, trajectory);
    const Format* chosen = nullptr;
    for (const Format& format : formats) {
      if (format_ != nullptr) break;
      const auto fits = [&](const fs::path& file) {
        return format_of(file) == &format && file != trajectory;
      };
      const auto count = std::count_if(files.begin(), files.end(), fits);
      if (count == 0) continue;
      if (chosen == nullptr) {
        chosen = &format;
        for (const fs::path& file : files) {
          if (fits(file)) entries_.push_back({.file = file, .format = &format});
        }
      } else {
        warnings_.push_back(
            fmt::format("{}: {} {} files are not read, the folder is taken for {} scans; name files to "
                        "read others",
                        folder.string(), count, format.title, chosen->title));
      }
    }
    if (entries_.empty()) {
      throw InputError(folder,
                       "the folder holds no scans: no .3d, .pcd, .ply, .las, .bin, .csv, .xyz or .asc files");
    }
    return finish(trajectory);
  }

  std::unique_ptr<ScanSource> files(std::span<const fs::path> files) {
    for (const fs::path& file : files) {
      std::error_code ignored;
      if (fs::is_directory(file, ignored)) {
        throw InputError(file, "is a folder among several scans; give one folder, or files only");
      }
      if (!fs::exists(file, ignored)) throw InputError(file, "does not exist; check the path");
      if (bags::is_bag(file))
        throw InputError(file, "is a bag among several files; give one bag, or the folder of a split one");
      const Format* format = format_ != nullptr ? format_ : format_of(file);
      if (format == nullptr && file.extension() == ".txt") format = &formats.back();
      if (format == nullptr) {
        throw InputError(
            file,
            "is no scan by its extension; .3d, .pcd, .ply, .las, .bin, .csv, .xyz, .asc and .txt are read, "
            "others with --format");
      }
      entries_.push_back({.file = file, .format = format});
    }
    std::stable_sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
      return natural_less(a.file.native(), b.file.native());
    });
    return finish(std::nullopt);
  }

 private:
  std::unique_ptr<ScanSource> finish(const std::optional<fs::path>& trajectory) {
    const bool is_named = number_entries();
    stamp_entries();
    if (is_named && !has_stamps_ && counts_by_one()) warn_of_gaps();
    std::string title = "no odometry";
    if (options_.no_odometry) {
      title = "no odometry, as asked for";
    } else if (options_.odometry) {
      apply(read_trajectory(*options_.odometry), *options_.odometry, true);
      title = fmt::format("odometry from {} by {}", options_.odometry->string(), paired_by_);
      note_origin(*options_.odometry);
    } else if (apply_3dtk(".pose", read_3dtk_pose)) {
      title = "odometry from .pose files";
    } else if (apply_3dtk(".frames", read_3dtk_frames)) {
      title = "odometry from .frames files";
    } else if (trajectory && apply(read_beside(*trajectory), *trajectory, false)) {
      title = fmt::format("odometry from {} by {}", trajectory->string(), paired_by_);
      note_origin(*trajectory);
    } else {
      warn_of_unused_trajectories();
    }
    for (Entry& entry : entries_) {
      if (!entry.stamp_s && options_.scan_interval_s > 0)
        entry.stamp_s = static_cast<double>(entry.number) * options_.scan_interval_s;
    }
    return std::make_unique<FileScanSource>(std::move(entries_), reading_, std::move(title),
                                            std::move(origin_), std::move(motion_), std::move(warnings_));
  }

  /// The whole map that a program left beside the scans it is of is no scan; that of a map folder, too.
  void leave_out_maps(const fs::path& folder, std::vector<fs::path>& files) {
    std::error_code ignored;
    constexpr std::array<std::string_view, 4> written = {"map.ply", "scans.csv", "counters.csv",
                                                         "covariances.csv"};
    const auto is_written = [&](const fs::path& file) {
      return std::find(written.begin(), written.end(), file.filename().string()) != written.end();
    };
    const auto is_scan = [&](const fs::path& file) {
      return format_of(file) != nullptr && !is_written(file);
    };
    if (fs::is_regular_file(folder / "run.json", ignored) &&
        std::any_of(files.begin(), files.end(), is_scan)) {
      warnings_.push_back(
          fmt::format("{}: there is a map beside the scans; its files (map.ply, trajectory.tum "
                      "and others) are not read as scans or odometry",
                      folder.string()));
      std::erase_if(files, is_written);
      has_map_beside_ = true;
    }
    if (files.size() < 2) return;
    const auto is_map = [&](const fs::path& file) {
      const Format* format = format_of(file);
      std::string stem = file.stem().string();
      for (char& c : stem) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      if (format == nullptr || stem.find("map") == std::string::npos || number_in_name(file) ||
          stamp_in_name(file))
        return false;
      return std::any_of(files.begin(), files.end(), [&](const fs::path& other) {
        return format_of(other) != nullptr && (number_in_name(other) || stamp_in_name(other));
      });
    };
    std::vector<fs::path> kept;
    for (const fs::path& file : files) {
      if (is_map(file)) {
        warnings_.push_back(
            fmt::format("{}: is called a map and has no number as the scans beside it have: it "
                        "is left out; name files to read it",
                        file.string()));
      } else {
        kept.push_back(file);
      }
    }
    files = std::move(kept);
  }

  /// --format: the files that have its extension, or, where none has, the commonest other one.
  void take_as_asked(const std::vector<fs::path>& files, const std::optional<fs::path>& trajectory) {
    std::map<std::string, std::size_t> count_of;
    bool has_own = false;
    constexpr std::array<std::string_view, 6> never = {".pose", ".frames", ".tum", ".json", ".toml", ".g2o"};
    for (const fs::path& file : files) {
      const std::string extension = file.extension().string();
      if (file == trajectory || std::find(never.begin(), never.end(), extension) != never.end()) continue;
      has_own = has_own || format_of(file) == format_;
      ++count_of[extension];
    }
    const auto commonest = std::max_element(count_of.begin(), count_of.end(),
                                            [](const auto& a, const auto& b) { return a.second < b.second; });
    for (const fs::path& file : files) {
      if (file == trajectory || commonest == count_of.end()) continue;
      if (has_own ? format_of(file) == format_ : file.extension().string() == commonest->first)
        entries_.push_back({.file = file, .format = format_});
    }
  }

  void note_origin(const fs::path& path) {
    ContentDigest digest;
    std::string bytes;
    std::error_code ignored;
    const bool is_of_bag = names_bag_topic(path) || bags::is_bag(path);  // of any size: its name has to do
    if (!is_of_bag && !fs::is_directory(path, ignored)) {
      read_file(path, bytes);
      digest.add(bytes);
    }
    origin_ = OdometryOrigin{path, digest.text(), paired_by_};
  }

  /// The stamps in the names, where all names have one and they grow.
  void stamp_entries() {
    std::vector<double> stamps_s;
    for (const Entry& entry : entries_) {
      const auto stamp_s = stamp_in_name(entry.file);
      if (!stamp_s || (!stamps_s.empty() && *stamp_s <= stamps_s.back())) return;
      stamps_s.push_back(*stamp_s);
    }
    has_stamps_ = true;
    for (std::size_t i = 0; i < entries_.size(); ++i) entries_[i].stamp_s = stamps_s[i];
  }

  // Which of several is odometry, and which truth, is not to be guessed.
  void warn_of_unused_trajectories() {
    if (has_map_beside_) return;  // its own, and that is said
    const fs::path parent = entries_.front().file.parent_path();
    const fs::path folder = parent.empty() ? fs::path(".") : parent;
    std::string names;
    std::size_t count = 0;
    for (const fs::path& file : list_files(folder)) {
      if (file.extension() != ".tum") continue;
      names += (count++ > 0 ? ", " : "") + file.filename().string();
    }
    if (count > 1)
      warnings_.push_back(
          fmt::format("{}: {} trajectories beside the scans ({}), and none is used: name one with --odometry",
                      folder.string(), count, names));
  }

  // The numbers in the names, if they name every scan once and are not too large; else the order, and false.
  bool number_entries() {
    bool all_numbered = true;
    bool named = true;
    std::uint64_t largest = 0;
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      const auto number = number_in_name(entries_[i].file);
      all_numbered = all_numbered && number;
      named = named && number && (i == 0 || *number > entries_[i - 1].number);
      entries_[i].number = static_cast<std::size_t>(number.value_or(0));
      largest = std::max(largest, number.value_or(0));
    }
    if (largest > largest_scan_number && all_numbered && entries_.size() > 1)
      warnings_.push_back(fmt::format(
          "{}: the numbers in the names go beyond {}, which is as far as map.ply counts: scans are "
          "numbered in their order, 0 to {}",
          entries_.back().file.filename().string(), largest_scan_number, entries_.size() - 1));
    named = named && largest <= largest_scan_number;
    for (std::size_t i = 0; !named && i < entries_.size(); ++i) entries_[i].number = i;
    return named;
  }

  // Whether a number that is missing means a scan that is missing: always so in 3DTK's folders; elsewhere
  // where 1 is the commonest step from one number to the next, since numbers may also be times, or every
  // tenth scan.
  [[nodiscard]] bool counts_by_one() const {
    if (entries_.front().format == &formats.front()) return true;
    std::map<std::size_t, std::size_t> times_of_step;
    for (std::size_t i = 1; i < entries_.size(); ++i)
      ++times_of_step[entries_[i].number - entries_[i - 1].number];
    const auto commonest = std::max_element(times_of_step.begin(), times_of_step.end(),
                                            [](const auto& a, const auto& b) { return a.second < b.second; });
    return commonest != times_of_step.end() && commonest->first == 1;  // of equally common steps the smallest
  }

  void warn_of_gaps() {
    for (std::size_t i = 1; i < entries_.size(); ++i) {
      const std::size_t missing = entries_[i].number - entries_[i - 1].number - 1;
      if (missing == 0) continue;
      warnings_.push_back(fmt::format(
          "{} {} missing between {} and {}: skipped", missing, missing == 1 ? "scan is" : "scans are",
          entries_[i - 1].file.filename().string(), entries_[i].file.filename().string()));
    }
  }

  bool apply_3dtk(const char* extension, Pose (*read)(const fs::path&)) {
    std::vector<std::string> without;
    bool any = false;
    ContentDigest digest;
    std::string bytes;
    for (Entry& entry : entries_) {
      fs::path file = entry.file;
      file.replace_extension(extension);
      std::error_code ignored;
      if (entry.format == &formats.front() && fs::exists(file, ignored)) {
        entry.odometry = read(file);
        read_file(file, bytes);
        digest.add(bytes);
        any = true;
      } else {
        without.push_back(
            fmt::format("{} has no {} file: no odometry for it", entry.file.string(), extension));
      }
    }
    if (any) {
      warnings_.insert(warnings_.end(), without.begin(), without.end());
      const fs::path parent = entries_.front().file.parent_path();
      origin_ = OdometryOrigin{parent.empty() ? fs::path(".") : parent, digest.text(), "name"};
    }
    return any;
  }

  [[nodiscard]] static std::optional<fs::path> trajectory_beside(const fs::path& folder) {
    if (auto found = find_trajectory(folder)) return found;
    const fs::path sequence = (folder.has_filename() ? folder : folder.parent_path()).parent_path();
    std::error_code ignored;
    if (folder.filename() == "velodyne" && fs::is_regular_file(sequence / "poses.txt", ignored)) {
      return sequence / "poses.txt";
    }
    return std::nullopt;
  }

  Trajectory read_beside(const fs::path& file) {
    Trajectory trajectory = read_trajectory(file);
    if (file.filename() != "poses.txt") return trajectory;
    std::error_code ignored;
    const fs::path calib = file.parent_path() / "calib.txt";
    if (fs::is_regular_file(calib, ignored)) {
      const Pose camera_from_scanner = read_kitti_calibration(calib);
      const Pose scanner_from_camera = camera_from_scanner.inverse();
      for (Pose& pose : trajectory.poses) pose = scanner_from_camera * pose * camera_from_scanner;
    } else {
      warnings_.push_back(file.string() +
                          ": no calib.txt beside it, the poses are taken as the scanner's own");
    }
    const fs::path times = file.parent_path() / "times.txt";
    if (fs::is_regular_file(times, ignored)) {
      std::vector<double> stamps_s = read_times(times);
      if (stamps_s.size() == trajectory.size()) {
        trajectory.stamps_s = std::move(stamps_s);
        trajectory.has_time = true;
      } else {
        warnings_.push_back(fmt::format("{}: {} times for {} poses are not used", times.string(),
                                        stamps_s.size(), trajectory.size()));
      }
    }
    return trajectory;
  }

  bool apply(const Trajectory& trajectory, const fs::path& file, bool asked_for) {
    warnings_.insert(warnings_.end(), trajectory.notes.begin(), trajectory.notes.end());
    if (has_stamps_ && trajectory.has_time && apply_by_stamp(trajectory, file)) return true;
    std::optional<std::vector<std::size_t>> pose_of = poses_by_number(trajectory);
    paired_by_ = "number";
    if (!pose_of && trajectory.size() == entries_.size()) {
      paired_by_ = "order";
      pose_of.emplace(entries_.size());
      for (std::size_t i = 0; i < entries_.size(); ++i) (*pose_of)[i] = i;
    }
    if (!pose_of) {
      const std::string what =
          has_stamps_ && trajectory.has_time
              ? fmt::format("none of its {} poses is within {} s of a stamp in the scans' names",
                            trajectory.size(), max_stamp_difference_s)
              : fmt::format("{} poses for {} scans, and their first column is not the scans' numbers",
                            trajectory.size(), entries_.size());
      if (asked_for) throw InputError(file, what + "; give one pose a scan");
      warnings_.push_back(file.string() + ": " + what + "; no odometry");
      return false;
    }
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      entries_[i].odometry = trajectory.poses[(*pose_of)[i]];
      if (trajectory.has_time) entries_[i].stamp_s = trajectory.stamps_s[(*pose_of)[i]];
    }
    return true;
  }

  /// False: no stamp fits, as of another clock.
  bool apply_by_stamp(const Trajectory& trajectory, const fs::path& file) {
    std::vector<double> stamps_s;
    for (const Entry& entry : entries_) stamps_s.push_back(*entry.stamp_s);
    const Association association = associate_stamps(stamps_s, trajectory.stamps_s, max_stamp_difference_s);
    if (association.pairs.empty()) {
      if (trajectory.size() == entries_.size())
        warnings_.push_back(
            fmt::format("{}: none of its stamps is within {} s of one in the scans' names, as "
                        "of another clock; poses and scans are paired in their order",
                        file.string(), max_stamp_difference_s));
      return false;
    }
    for (const Association::Pair& pair : association.pairs)
      entries_[pair.estimate].odometry = trajectory.poses[pair.truth];
    if (const std::size_t without = entries_.size() - association.pairs.size(); without > 0) {
      const auto first = std::find_if(entries_.begin(), entries_.end(),
                                      [](const Entry& entry) { return !entry.odometry.has_value(); });
      warnings_.push_back(fmt::format(
          "{}: has no pose within {} s of {} of {} scans, of which {} is the "
          "first: no odometry for them",
          file.string(), max_stamp_difference_s, without, entries_.size(), first->file.filename().string()));
    }
    for (std::size_t i = 0; i < trajectory.size(); ++i) {
      if (motion_.empty() || trajectory.stamps_s[i] > motion_.back().time_s)
        motion_.push_back({trajectory.stamps_s[i], trajectory.poses[i]});
    }
    paired_by_ = fmt::format("stamp ({:.3g} s apart at most)", association.largest_time_difference_s);
    return true;
  }

  /// The pose of every scan whose first column is the scan's number; none where one is missing.
  [[nodiscard]] std::optional<std::vector<std::size_t>> poses_by_number(const Trajectory& trajectory) const {
    if (trajectory.has_time) return std::nullopt;
    std::map<double, std::size_t> pose_of_number;
    for (std::size_t i = 0; i < trajectory.size(); ++i) pose_of_number.emplace(trajectory.stamps_s[i], i);
    std::vector<std::size_t> pose_of;
    for (const Entry& entry : entries_) {
      const auto found = pose_of_number.find(static_cast<double>(entry.number));
      if (found == pose_of_number.end()) return std::nullopt;
      pose_of.push_back(found->second);
    }
    return pose_of;
  }

  const ScanSourceOptions& options_;
  const Format* format_ = nullptr;  ///< that all files are to be
  ScanReading reading_;
  std::vector<Entry> entries_;
  bool has_map_beside_ = false;
  bool has_stamps_ = false;  ///< in the names of all
  std::string paired_by_;
  std::optional<OdometryOrigin> origin_;
  std::vector<TimedPose> motion_;
  std::vector<std::string> warnings_;
};

}  // namespace

std::vector<TimedPose> ScanSource::motion(std::size_t index, double, double) const {
  std::vector<TimedPose> poses;
  for (std::size_t i = index > 0 ? index - 1 : 0; i < std::min(index + 2, size()); ++i) {
    const std::optional<Pose> pose = odometry(i);
    const std::optional<double> time_s = stamp_s(i);
    if (pose && time_s && (poses.empty() || *time_s > poses.back().time_s)) poses.push_back({*time_s, *pose});
  }
  return poses;
}

void choose_odometry(const std::string& option, ScanSourceOptions& options) {
  options.no_odometry = option == "none";
  if (!option.empty() && !options.no_odometry) options.odometry = option;
}

std::vector<std::string> scan_format_names() {
  std::vector<std::string> names = {"nuscenes"};
  for (const Format& format : formats) names.emplace_back(format.name);
  return names;
}

std::unique_ptr<ScanSource> open_scans(const fs::path& folder_or_file, const ScanSourceOptions& options) {
  std::error_code ignored;
  if (bags::is_bag(folder_or_file)) return open_bag_scans(folder_or_file, options);
  if (fs::is_directory(folder_or_file, ignored)) return Opener(options).folder(folder_or_file);
  return Opener(options).files(std::span(&folder_or_file, 1));
}

std::unique_ptr<ScanSource> open_scans(std::span<const fs::path> files, const ScanSourceOptions& options) {
  if (files.empty()) throw InputError("no scans were given; name a folder or scan files");
  if (files.size() == 1) return open_scans(files.front(), options);
  return Opener(options).files(files);
}

}  // namespace alces::offline
