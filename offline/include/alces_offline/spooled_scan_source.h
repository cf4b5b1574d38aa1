// All scans of a source once through, and from then on in any order, any number of times: for work that goes
// over the same scans again and again, where the source is a drive that can only be replayed from its begin.
//
// Points lie in a file without a name, 12 bytes each, which goes away with the object whatever ends the
// program; in memory are some 150 bytes a scan.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "alces_offline/scan_source.h"

namespace alces::offline {

class SpooledScanSource final : public ScanSource {
 public:
  using Progress = std::function<void(std::size_t done, std::size_t total)>;

  /// Reads `source` to its end, or until `stop_requested` says so (was_stopped()). `folder` takes the file.
  /// OutputError for it; what the source throws.
  SpooledScanSource(ScanSource& source, const std::filesystem::path& folder, const Progress& progress = {},
                    const std::function<bool()>& stop_requested = {});
  ~SpooledScanSource() override;

  [[nodiscard]] bool was_stopped() const { return was_stopped_; }
  /// The scan that read() was asked for last.
  [[nodiscard]] std::size_t last_read() const { return last_read_; }

  [[nodiscard]] std::size_t size() const override { return scans_.size(); }
  bool read(std::size_t index, std::vector<Point>& points) override;
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
    std::uint64_t offset = 0;
    std::size_t points = 0;
    std::string name;
    std::size_t number = 0;
    std::optional<Pose> odometry;
    std::optional<double> stamp_s;
  };

  std::filesystem::path folder_;
  int descriptor_ = -1;
  std::vector<Scan> scans_;
  std::string description_;
  std::vector<std::string> warnings_;
  std::size_t last_read_ = 0;
  bool was_stopped_ = false;
};

}  // namespace alces::offline
