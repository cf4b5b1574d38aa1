// scans.csv of a map folder: what every scan of the map was matched with and took, a line each. For
// spreadsheets, and for the plots of `alces report`.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace alces::offline {

inline constexpr std::array<const char*, 6> stage_names = {"reduce", "store",      "match",
                                                           "detect", "loop_match", "loop_share_out"};

/// Of the new scan's body frame, in the order of HeldDirections.
inline constexpr std::array<const char*, 6> direction_names = {"x", "y", "z", "roll", "pitch", "yaw"};

struct ScanRow {
  std::uint64_t scan = 0;  ///< the number that map.ply and frames/ know it by
  double stamp_s = 0;      ///< 0 where no time is known
  std::uint32_t points = 0;
  std::uint32_t iterations = 0;
  std::uint32_t correspondences = 0;
  double overlap = 0;  ///< share of the samples that found a partner in the scans before
  double rms_m = 0;    ///< of the residuals of these
  bool is_predicted = false;
  std::array<double, stage_names.size()> stage_ms{};
  std::string step = {};       ///< how the scan was placed: a word of StepVerdict's; empty: not known
  std::string doubt = {};      ///< why its last match is not believed: a word of StepDoubt's
  double fit = 0;              ///< share of the samples that lie on the other side's surfaces
  std::uint32_t surfaces = 0;  ///< samples that have a plane
  std::array<double, direction_names.size()> held{};  ///< how well the match holds each direction, 0 to 1
};

struct ScanTable {
  bool has_time = false;
  bool has_held = false;      ///< false: of a map made before directions were measured
  std::vector<ScanRow> rows;  ///< in the order of trajectory.tum
};

/// OutputError.
void write_scan_table(const std::filesystem::path& file, const ScanTable& table);
/// InputError, with the line.
[[nodiscard]] ScanTable read_scan_table(const std::filesystem::path& file);

}  // namespace alces::offline
