// Which motion is taken out of a scan whose points have times (alces/deskew.h), and what came of it over a
// drive.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "alces/deskew.h"
#include "scan_source.h"

namespace alces::offline {

enum class DeskewMode : std::uint8_t {
  automatic,  ///< by the odometry where there is one, else by the velocity
  odometry,
  velocity,  ///< the motion of the last steps goes on
  none,      ///< the scans are rigid already
};
[[nodiscard]] std::optional<DeskewMode> deskew_mode_called(std::string_view name);
[[nodiscard]] std::vector<std::string> deskew_mode_names();

class ScanDeskew {
 public:
  explicit ScanDeskew(DeskewMode mode) : mode_(mode) {}

  /// Scan `index` as it was read, before it is mapped: its points become those seen from where the body was
  /// at its stamp. Without times it stays as it is, to the bit.
  void deskew(const ScanSource& scans, std::size_t index, ScanPoints& scan);

  /// The drive begins, and what it begins with can be told by a match of its first two scans alone.
  [[nodiscard]] bool needs_first_step(const ScanSource& scans, const ScanPoints& first) const;
  /// That match: a velocity to begin with. `last_from_next` as in observe_step().
  void observe_first_step(const ScanSource& scans, const ScanPoints& first, const ScanPoints& second,
                          const Pose& last_from_next);
  /// Deskews with the velocity as it is now, and counts nothing: for that match. False: it stays as it is.
  bool deskew_uncounted(ScanPoints& scan) const;

  /// The scan just deskewed was matched: the step from the one before, or null where it is not believed.
  void observe_step(const Pose* last_from_next);

  /// For people, one line: what was done, and what was not and why; empty where no scan has times.
  [[nodiscard]] std::string text() const;
  /// For run.json.
  [[nodiscard]] nlohmann::json json() const;

 private:
  [[nodiscard]] std::string deskew_by_odometry(const ScanSource& scans, std::size_t index, ScanPoints& scan);
  [[nodiscard]] std::string deskew_by_velocity(ScanPoints& scan);
  [[nodiscard]] std::string apply(const Deskew& deskew, ScanPoints& scan);

  DeskewMode mode_;
  std::optional<Vector6d> twist_per_s_;  ///< of the last steps
  std::optional<double> time_s_;         ///< of the scan just deskewed
  std::optional<double> last_time_s_;    ///< of the one before
  std::vector<Point> before_;            ///< kept, so that its memory is used again
  std::size_t with_times_ = 0;
  std::size_t by_odometry_ = 0;
  std::size_t by_velocity_ = 0;
  std::map<std::string, std::size_t> not_deskewed_;  ///< by reason
  double longest_scan_s_ = 0;
  double largest_shift_m_ = 0;
};

}  // namespace alces::offline
