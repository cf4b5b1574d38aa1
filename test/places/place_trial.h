// A mapper on a drive through a place, and what it made of the loops: those that it found, and pairs that are
// offered to it.
//
// "Off": a loop that was taken and whose match is more than off_m or off_rad from the truth.
#pragma once

#include <cstdint>
#include <functional>
#include <numbers>
#include <span>
#include <string_view>
#include <vector>

#include "alces/mapper.h"
#include "places/place_drive.h"

namespace alces::places {

inline constexpr double off_m = 0.3;
inline constexpr double off_rad = 2 * std::numbers::pi / 180;

/// One loop that the mapper was offered, or offered to itself.
struct TriedLoop {
  LoopReport report;
  bool is_revisit = false;
  bool is_bare = false;    ///< as Pair says; of the mapper's own it is not known
  Pose before_from_after;  ///< truth of `last`, seen from where the map had it when the loop was offered
  double off_m = 0;        ///< the match against the truth; 0 where no edge came of it
  double off_rad = 0;
  double map_error_m = 0;  ///< mean, with this loop alone
  [[nodiscard]] bool is_taken() const { return report.verdict == LoopVerdict::closed; }
  /// Taken, or right but not needed: what is not refused.
  [[nodiscard]] bool is_recognised() const {
    return !std::string_view(to_string(report.verdict)).starts_with("refused");
  }
  [[nodiscard]] bool is_off() const {
    return is_taken() && (off_m > places::off_m || off_rad > places::off_rad);
  }
};

struct Trial {
  double error_without_m = 0;      ///< mean, laid on the truth as a whole
  double error_with_m = 0;         ///< the same, with the loops that the mapper closed by itself
  std::vector<TriedLoop> offered;  ///< one a pair, each to the map as it was before any was offered
  std::vector<TriedLoop> own;      ///< what the mapper found by itself
  std::uint32_t predicted = 0;     ///< steps that stand on odometry alone
  [[nodiscard]] bool is_worse() const { return error_with_m > 1.1 * error_without_m + 0.02; }
};

/// `poses` laid on `truth` by the rigid motion that fits best: mean distance.
[[nodiscard]] double mean_error_m(std::span<const Pose> poses, std::span<const Pose> truth);

/// Scans as a mapper is fed with them; so that a real drive can be tried as a made-up one.
struct Feed {
  std::function<std::span<const Point>(std::size_t scan)> points;
  std::span<const Pose> odometry;
  std::span<const Pose> truth;
  std::span<const Pair> pairs;
  /// Pairs are offered to the map with the loops that the mapper closed by itself: on a long drive as its
  /// user has it.
  bool offer_with_loops = false;
};
[[nodiscard]] Trial try_mapper(const Feed& feed, const MapperConfig& config);

[[nodiscard]] Trial try_mapper(const PlaceDrive& drive, double noise, const MapperConfig& config);

/// The programs' default, with room for so many scans of a place.
[[nodiscard]] MapperConfig place_config(std::size_t scans);

}  // namespace alces::places
