// A source that gives its scans only once and in order (a recorded drive), made one that gives any scan at
// any time: all are read at the beginning, into a scratch file without a name that goes away with the object.
//
// 12 bytes a point on the disk of `folder`, 4 more for times, 1 for intensities; in memory one scan and what
// is known of each.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scan_source.h"

namespace alces::offline {

class ScratchFile;

class SpooledScanSource final : public ScanSource {
 public:
  /// Reads all of `source`; InputError as it does, OutputError. `progress(done, total)` may be empty.
  SpooledScanSource(ScanSource& source, const std::filesystem::path& folder,
                    const std::function<void(std::size_t, std::size_t)>& progress = {});
  ~SpooledScanSource() override;

  [[nodiscard]] std::size_t size() const override { return scans_.size(); }
  bool read(std::size_t index, ScanPoints& scan) override;
  [[nodiscard]] std::string name(std::size_t index) const override { return scans_[index].name; }
  [[nodiscard]] std::size_t number(std::size_t index) const override { return scans_[index].number; }
  [[nodiscard]] std::optional<Pose> odometry(std::size_t index) const override {
    return scans_[index].odometry;
  }
  [[nodiscard]] std::optional<double> stamp_s(std::size_t index) const override {
    return scans_[index].stamp_s;
  }
  [[nodiscard]] std::string description() const override { return description_; }
  [[nodiscard]] std::vector<std::string> warnings() const override { return warnings_; }

 private:
  struct Scan {
    std::uint64_t begin = 0;
    std::size_t points = 0;
    bool has_time = false;
    bool has_intensity = false;
    std::string name;
    std::size_t number = 0;
    std::optional<Pose> odometry;
    std::optional<double> stamp_s;
  };

  std::unique_ptr<ScratchFile> file_;
  std::vector<Scan> scans_;
  std::string description_;
  std::vector<std::string> warnings_;
};

}  // namespace alces::offline
