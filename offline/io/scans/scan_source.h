// Scans from the files of others, one in memory at a time.
//
// `open_scans` recognises 3DTK's uos folders (scanNNN.3d), PCD, PLY, LAS, KITTI .bin and CSV: a folder of
// them, one file, or several; and bags of ROS (bag_scans.h). Files are taken in the natural order of their
// numbers (scan9 before scan10). Whatever the file's convention, points come out in the body frame of REP
// 103, metres; only 3DTK's frame is known to differ and is converted, all other formats are taken as they
// are.
//
// Odometry comes, in this order, from ScanSourceOptions::odometry, from the scans' own .pose files, from
// their .frames files, or from a trajectory beside the scans: odometry.tum, trajectory.tum, alidarPose.csv,
// poses.txt, or the only *.tum; of several others none is taken, and warnings() says so. KITTI's poses.txt
// speaks of the camera; with a calib.txt beside it ("Tr:") it is turned into the scanner's. Poses belong to
// scans by the stamps in the files' names, else by their numbers, else by their order; description() says
// which.
//
// Coordinates of a national grid would lose metres as floats. One origin is taken off all scans of an input,
// in double precision: whole kilometres, of the first scan whose median lies farther than 10 km away.
//
// Errors are InputError. What is no error but should be seen (a missing number in a sequence, a scan without
// pose) is a sentence in warnings().
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "alces/pose.h"
#include "scan_points.h"

namespace alces::offline {

/// Where the odometry of scans came from.
struct OdometryOrigin {
  std::filesystem::path path;  ///< a file, or the folder of .pose or .frames files
  std::string digest;          ///< of what it held (ContentDigest)
  std::string paired_by;       ///< "stamp", "number", "order"
};

/// A pose of the odometry, and when the body was there.
struct TimedPose {
  double time_s = 0;
  Pose odometry_from_body;
};

class ScanSource {
 public:
  ScanSource() = default;
  ScanSource(const ScanSource&) = delete;
  ScanSource& operator=(const ScanSource&) = delete;
  virtual ~ScanSource() = default;

  /// How many scans there are; of a source that finds out as it goes: at most, and exactly at its end.
  [[nodiscard]] virtual std::size_t size() const = 0;

  /// Replaces `scan` by scan `index`: its points, NaN and Inf included, in file order, with the channels that
  /// they have. False: there is no such scan, the source has ended (only of sources whose size() is not
  /// exact). Not to be called from two threads at once; all other functions may run meanwhile.
  virtual bool read(std::size_t index, ScanPoints& scan) = 0;

  /// What people call it: the file's name without folder.
  [[nodiscard]] virtual std::string name(std::size_t index) const = 0;
  /// The number in the file's name (NNN of scanNNN.3d), 32 bits at most; its place in the order where names
  /// have none, or larger ones.
  [[nodiscard]] virtual std::size_t number(std::size_t index) const = 0;
  /// map_from_body as the data has it.
  [[nodiscard]] virtual std::optional<Pose> odometry(std::size_t index) const = 0;
  [[nodiscard]] virtual std::optional<double> stamp_s(std::size_t index) const = 0;
  /// Of the scan's file; 0: not known, or scans can be read only once and in turn.
  [[nodiscard]] virtual std::uint64_t file_bytes(std::size_t /*index*/) const { return 0; }
  /// For people: "469 scans, 3DTK uos, odometry from .pose files".
  [[nodiscard]] virtual std::string description() const = 0;
  /// So far; reading may add to them.
  [[nodiscard]] virtual std::vector<std::string> warnings() const = 0;
  /// What was taken off the coordinates; odometry() speaks of the same frame. May read the first scans.
  [[nodiscard]] virtual std::array<double, 3> origin_m() const { return {}; }
  /// None: no odometry, or not from files.
  [[nodiscard]] virtual std::optional<OdometryOrigin> odometry_origin() const { return std::nullopt; }
  /// How the body moved from `from_s` to `to_s` on the clock of stamp_s(): the odometry's poses between, in
  /// turn, with the last one before and the first one behind. Fewer than two: not known. By itself a source
  /// has the poses of the scan and its neighbours.
  [[nodiscard]] virtual std::vector<TimedPose> motion(std::size_t index, double from_s, double to_s) const;
  /// For people: which fields became times and intensities, in which unit and why; empty: there are none. May
  /// read the first scans.
  [[nodiscard]] virtual std::string channels() const { return {}; }
  /// Its scans bring intensities. As channels().
  [[nodiscard]] virtual bool has_intensity() const { return false; }
};

/// What is taken of a bag of ROS where its own topics and frames leave a choice (bag_choice.h); all may be
/// empty.
struct BagTopics {
  std::vector<std::string> topics = {};  ///< one of scans, one of odometry, in any order
  std::string frame = {};                ///< the body's
  std::string tf = {};                   ///< the frame of /tf that the odometry is in: "odom"
};

struct ScanSourceOptions {
  /// A trajectory in any format of trajectory.h. It belongs to the scans by stamps where both have them, by
  /// number where its first column holds every scan's, else by order, and then has as many poses as scans.
  std::optional<std::filesystem::path> odometry = {};
  bool no_odometry = false;    ///< poses beside the scans are not read either
  double scale = 1;            ///< of the coordinates of all scans: 0.001 where they are mm
  double scan_interval_s = 0;  ///< from one scan to the next where no stamps are known; 0: they stay unknown
  std::string format = {};     ///< one of scan_format_names(), or float32xN, float64xN; empty: by the names
  BagTopics bag = {};          ///< what is taken of a bag
  /// Bytes done and in all while a bag is surveyed, which reads all of it; may be empty.
  std::function<void(std::size_t, std::size_t)> survey_progress = {};
};

/// As --odometry has it: empty for the poses beside the scans, "none" for no poses at all, or a file.
void choose_odometry(const std::string& option, ScanSourceOptions& options);

/// "3dtk", "pcd", "ply", "las", "kitti", "nuscenes", "csv".
[[nodiscard]] std::vector<std::string> scan_format_names();

/// A folder of scans, one scan file, or a bag.
[[nodiscard]] std::unique_ptr<ScanSource> open_scans(const std::filesystem::path& folder_or_file,
                                                     const ScanSourceOptions& options = {});
/// Several scan files, taken in natural order like those of a folder; or one folder.
[[nodiscard]] std::unique_ptr<ScanSource> open_scans(std::span<const std::filesystem::path> files,
                                                     const ScanSourceOptions& options = {});

/// Parses scan i+1 on a second thread while the caller works on scan i. The caller's scan and the next one
/// are all that is held. Same points in the same order as the source alone; an error in scan i+1 is thrown by
/// the read() that asks for it.
class PrefetchingScanSource final : public ScanSource {
 public:
  explicit PrefetchingScanSource(std::unique_ptr<ScanSource> source);
  ~PrefetchingScanSource() override;

  [[nodiscard]] std::size_t size() const override;
  bool read(std::size_t index, ScanPoints& scan) override;
  [[nodiscard]] std::string name(std::size_t index) const override;
  [[nodiscard]] std::size_t number(std::size_t index) const override;
  [[nodiscard]] std::optional<Pose> odometry(std::size_t index) const override;
  [[nodiscard]] std::optional<double> stamp_s(std::size_t index) const override;
  [[nodiscard]] std::uint64_t file_bytes(std::size_t index) const override;
  [[nodiscard]] std::string description() const override;
  [[nodiscard]] std::vector<std::string> warnings() const override;
  [[nodiscard]] std::array<double, 3> origin_m() const override { return source_->origin_m(); }
  [[nodiscard]] std::optional<OdometryOrigin> odometry_origin() const override {
    return source_->odometry_origin();
  }
  [[nodiscard]] std::vector<TimedPose> motion(std::size_t index, double from_s, double to_s) const override {
    return source_->motion(index, from_s, to_s);
  }
  [[nodiscard]] std::string channels() const override { return source_->channels(); }
  [[nodiscard]] bool has_intensity() const override { return source_->has_intensity(); }

 private:
  struct Worker;
  std::unique_ptr<ScanSource> source_;
  std::unique_ptr<Worker> worker_;
};

}  // namespace alces::offline
