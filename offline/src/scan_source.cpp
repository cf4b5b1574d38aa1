#include "alces_offline/scan_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <map>
#include <mutex>
#include <string_view>
#include <system_error>
#include <utility>

#include "alces_offline/error.h"
#include "alces_offline/input_file.h"
#include "alces_offline/scan_format.h"
#include "alces_offline/trajectory.h"
#include "alces_offline/trajectory_files.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;

struct Format {
  std::string_view title;
  void (*parse)(const ScanBytes& scan, std::vector<Point>& points);
  std::array<std::string_view, 4> extensions;  ///< those that make a file of a folder a scan
};

// A folder with several of them is taken for the first: a CSV beside PCD files is a table of something else.
constexpr std::array<Format, 6> formats = {{{"3DTK uos", parse_3dtk, {".3d"}},
                                            {"PCD", parse_pcd, {".pcd"}},
                                            {"PLY", parse_ply, {".ply"}},
                                            {"LAS", parse_las, {".las"}},
                                            {"KITTI", parse_kitti, {".bin"}},
                                            {"CSV", parse_csv, {".csv", ".xyz", ".asc"}}}};

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

class FileScanSource final : public ScanSource {
 public:
  FileScanSource(std::vector<Entry> entries, std::string odometry_title, std::vector<std::string> warnings)
      : entries_(std::move(entries)),
        odometry_title_(std::move(odometry_title)),
        warnings_(std::move(warnings)) {}

  [[nodiscard]] std::size_t size() const override { return entries_.size(); }

  bool read(std::size_t index, std::vector<Point>& points) override {
    const Entry& entry = entries_.at(index);
    read_file(entry.file, bytes_);
    std::vector<std::string> notes;
    entry.format->parse({entry.file, bytes_, notes}, points);
    const std::scoped_lock lock(mutex_);
    for (std::string& note : notes) {
      // a scan may be read more than once
      if (std::find(warnings_.begin(), warnings_.end(), note) == warnings_.end())
        warnings_.push_back(std::move(note));
    }
    return true;
  }

  [[nodiscard]] std::string name(std::size_t index) const override {
    return entries_.at(index).file.filename();
  }
  [[nodiscard]] std::size_t number(std::size_t index) const override { return entries_.at(index).number; }
  [[nodiscard]] std::optional<Pose> odometry(std::size_t index) const override {
    return entries_.at(index).odometry;
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

 private:
  std::vector<Entry> entries_;
  std::string odometry_title_;
  std::string bytes_;  // of one file; kept, so that its memory is used again
  mutable std::mutex mutex_;
  std::vector<std::string> warnings_;
};

class Opener {
 public:
  explicit Opener(const ScanSourceOptions& options) : options_(options) {}

  std::unique_ptr<ScanSource> folder(fs::path folder) {
    std::error_code ignored;
    std::vector<fs::path> files = list_files(folder);
    if (std::none_of(files.begin(), files.end(),
                     [](const fs::path& file) { return format_of(file) != nullptr; }) &&
        fs::is_directory(folder / "velodyne", ignored)) {
      folder /= "velodyne";  // a sequence of KITTI's odometry benchmark
      files = list_files(folder);
    }
    const std::optional<fs::path> trajectory = trajectory_beside(folder);
    const Format* chosen = nullptr;
    for (const Format& format : formats) {
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
                       "the folder holds no scans: no .3d, .pcd, .ply, .bin, .csv, .xyz or .asc files");
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
      const Format* format = format_of(file);
      if (format == nullptr && file.extension() == ".txt") format = &formats.back();
      if (format == nullptr) {
        throw InputError(
            file, "is no scan by its extension; .3d, .pcd, .ply, .bin, .csv, .xyz, .asc and .txt are read");
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
    if (number_entries() && counts_by_one()) warn_of_gaps();
    std::string title = "no odometry";
    if (options_.odometry) {
      apply(read_trajectory(*options_.odometry), *options_.odometry, true);
      title = "odometry from " + options_.odometry->string();
    } else if (apply_3dtk(".pose", read_3dtk_pose)) {
      title = "odometry from .pose files";
    } else if (apply_3dtk(".frames", read_3dtk_frames)) {
      title = "odometry from .frames files";
    } else if (trajectory && apply(read_beside(*trajectory), *trajectory, false)) {
      title = "odometry from " + trajectory->string();
    } else {
      warn_of_unused_trajectories();
    }
    return std::make_unique<FileScanSource>(std::move(entries_), std::move(title), std::move(warnings_));
  }

  // Which of several is odometry, and which truth, is not to be guessed.
  void warn_of_unused_trajectories() {
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
    for (Entry& entry : entries_) {
      fs::path file = entry.file;
      file.replace_extension(extension);
      std::error_code ignored;
      if (entry.format == &formats.front() && fs::exists(file, ignored)) {
        entry.odometry = read(file);
        any = true;
      } else {
        without.push_back(
            fmt::format("{} has no {} file: no odometry for it", entry.file.string(), extension));
      }
    }
    if (any) warnings_.insert(warnings_.end(), without.begin(), without.end());
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
    std::vector<std::size_t> pose_of(entries_.size());
    bool whole = true;
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      if (trajectory.size() == entries_.size()) {
        pose_of[i] = i;
        continue;
      }
      const auto stamp = std::find(trajectory.stamps_s.begin(), trajectory.stamps_s.end(),
                                   static_cast<double>(entries_[i].number));
      whole = whole && !trajectory.has_time && stamp != trajectory.stamps_s.end();
      pose_of[i] = static_cast<std::size_t>(stamp - trajectory.stamps_s.begin());
    }
    if (!whole) {
      const std::string what =
          fmt::format("{} poses for {} scans, and their first column is not the scans' numbers",
                      trajectory.size(), entries_.size());
      if (asked_for) throw InputError(file, what + "; give one pose a scan");
      warnings_.push_back(file.string() + ": " + what + "; no odometry");
      return false;
    }
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      entries_[i].odometry = trajectory.poses[pose_of[i]];
      if (trajectory.has_time) entries_[i].stamp_s = trajectory.stamps_s[pose_of[i]];
    }
    return true;
  }

  const ScanSourceOptions& options_;
  std::vector<Entry> entries_;
  std::vector<std::string> warnings_;
};

}  // namespace

std::unique_ptr<ScanSource> open_scans(const fs::path& folder_or_file, const ScanSourceOptions& options) {
  std::error_code ignored;
  if (fs::is_directory(folder_or_file, ignored)) return Opener(options).folder(folder_or_file);
  return Opener(options).files(std::span(&folder_or_file, 1));
}

std::unique_ptr<ScanSource> open_scans(std::span<const fs::path> files, const ScanSourceOptions& options) {
  if (files.empty()) throw InputError("no scans were given; name a folder or scan files");
  if (files.size() == 1) return open_scans(files.front(), options);
  return Opener(options).files(files);
}

}  // namespace alces::offline
