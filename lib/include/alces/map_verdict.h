// What a map is worth, judged from how it came about: before it is handed out, and while it grows.
//
// A map is bad where it surely hangs together wrongly, good where nothing speaks against it, and doubtful in
// between. The bounds were measured on drives with one thing changed at a time, until no map that was off was
// called good and of those that were right nearly all: docs/benchmarks.md.
#pragma once

#include <array>
#include <cstdint>

namespace alces {

enum class MapVerdict : std::uint8_t { good, doubtful, bad };
[[nodiscard]] const char* to_string(MapVerdict verdict);

/// What speaks most against a map.
enum class MapDoubt : std::uint8_t {
  none,
  parts,                  ///< the map is in parts that no loop has joined
  unmatched_revisits,     ///< where the vehicle should be at an earlier place the scans do not fit
  drift,                  ///< the steps can be off by more than a map may
  odometry_alone,         ///< too much of the way stands on odometry
  odometry_contradicted,  ///< steps were believed against the odometry, and no loop has confirmed them
  odometry_scale,         ///< the scans see another way driven than the odometry, all along
  steep,                  ///< the way is steeper than wheels drive, though the odometry is of wheels
  weak_steps,             ///< scans whose surfaces fit badly: odometry holds them as much as the match
  searched,               ///< too many steps had to be searched for
};
[[nodiscard]] const char* to_string(MapDoubt doubt);

/// A way is no steeper than this for vehicles with wheels: 14 deg, a fourth. The steepest streets and ramps
/// have a fifth.
inline constexpr double steepest_rad = 0.245;

struct MapHealth {
  static constexpr std::uint32_t most_weakest = 8;

  MapVerdict verdict = MapVerdict::good;
  MapDoubt doubt = MapDoubt::none;
  std::uint32_t scans = 0;
  std::uint32_t found = 0;             ///< steps that had to be searched for
  std::uint32_t on_odometry = 0;       ///< steps on odometry alone
  std::uint32_t against_odometry = 0;  ///< steps that were believed against it, and that no loop spans
  /// Steps believed, though few of their samples find a partner and fit it, unless there is odometry and a
  /// loop spans them.
  std::uint32_t weak = 0;
  double odometry_scale = 1;   ///< metres driven a metre of the odometry, as the scans see it; 1: no odometry
  std::uint32_t parts = 1;     ///< of the map, that nothing joins
  std::uint32_t closed = 0;    ///< loops
  std::uint32_t revisits = 0;  ///< visits to earlier places that were closed as loops
  std::uint32_t unmatched = 0;    ///< loops refused because the scans do not fit, though they should
  std::uint32_t implausible = 0;  ///< loops refused because the places are others that look alike
  /// The most that a scan is tilted against the first, where the odometry knows no tilt, as that of wheels;
  /// 0 otherwise.
  double tilt_rad = 0;
  double length_m = 0;          ///< driven
  double expected_error_m = 0;  ///< of a pose against the first, standard deviation, mean
  /// The scans where the map hangs together worst, the worst first: `weakest_count` of them.
  std::array<std::uint32_t, most_weakest> weakest = {};
  std::uint32_t weakest_count = 0;
};

/// Sets verdict and doubt from the other figures.
void judge_map(MapHealth& health);

}  // namespace alces
