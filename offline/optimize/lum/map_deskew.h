// The scans of a map whose points have times, deskewed by the map's own poses: what its mapper had is no
// better known than where the map says that the body was.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_deskew.h"
#include "offline/io/scans/scan_source.h"

namespace alces::offline {

class MapDeskewedSource final : public ScanSource {
 public:
  /// `source_index`: of each pose of the trajectory.
  MapDeskewedSource(std::unique_ptr<ScanSource> scans, const Trajectory& trajectory,
                    const std::vector<std::size_t>& source_index);

  bool read(std::size_t index, ScanPoints& scan) override;
  /// The map's pose; none: the scan is not in the map.
  [[nodiscard]] std::optional<Pose> odometry(std::size_t index) const override { return poses_.at(index); }

  [[nodiscard]] std::size_t size() const override { return scans_->size(); }
  [[nodiscard]] std::string name(std::size_t index) const override { return scans_->name(index); }
  [[nodiscard]] std::size_t number(std::size_t index) const override { return scans_->number(index); }
  [[nodiscard]] std::optional<double> stamp_s(std::size_t index) const override {
    return scans_->stamp_s(index);
  }
  [[nodiscard]] std::uint64_t file_bytes(std::size_t index) const override {
    return scans_->file_bytes(index);
  }
  [[nodiscard]] std::string description() const override { return scans_->description(); }
  [[nodiscard]] std::vector<std::string> warnings() const override { return scans_->warnings(); }
  [[nodiscard]] std::array<double, 3> origin_m() const override { return scans_->origin_m(); }
  [[nodiscard]] std::string channels() const override { return scans_->channels(); }
  [[nodiscard]] bool has_intensity() const override { return scans_->has_intensity(); }

 private:
  std::unique_ptr<ScanSource> scans_;
  std::vector<std::optional<Pose>> poses_;  ///< of each scan of the source
  ScanDeskew deskew_{DeskewMode::odometry};
};

}  // namespace alces::offline
