#include "alces/map_verdict.h"

#include <algorithm>
#include <cmath>

namespace alces {
namespace {

// From here on a figure makes a map doubtful, and from there on bad.
struct Bounds {
  double doubtful;
  double bad;
};
constexpr Bounds drift_share{0.02, 0.05};    // expected error over the way driven
constexpr Bounds odometry_share{0.02, 0.2};  // of the steps
constexpr Bounds searched_share{0.5, 1.1};   // of more than a few steps; by itself never bad
// Tyres wear by a few percent, and wheels skid in bends. Far off it is the scans that slide or stand.
constexpr Bounds odometry_scale_off{0.1, 0.3};
constexpr double allowed_drift_m = 0.5;  // on however short a way
constexpr std::uint32_t few_steps = 20;
constexpr std::uint32_t many_revisits = 3;  // that were closed: they hold a map
constexpr std::uint32_t chance = 2;         // revisits, or steps, that mean nothing yet

}  // namespace

const char* to_string(MapVerdict verdict) {
  switch (verdict) {
    case MapVerdict::good:
      return "good";
    case MapVerdict::doubtful:
      return "doubtful";
    case MapVerdict::bad:
      return "bad";
  }
  return "unknown";
}

const char* to_string(MapDoubt doubt) {
  switch (doubt) {
    case MapDoubt::none:
      return "nothing speaks against it";
    case MapDoubt::parts:
      return "it is in parts that no loop joins";
    case MapDoubt::unmatched_revisits:
      return "scans of places that should be visited again do not fit";
    case MapDoubt::drift:
      return "its steps can be off by more than a map may";
    case MapDoubt::odometry_alone:
      return "too many steps stand on odometry alone";
    case MapDoubt::odometry_contradicted:
      return "steps were believed against the odometry, and no loop has confirmed them";
    case MapDoubt::odometry_scale:
      return "the scans see another way driven than the odometry";
    case MapDoubt::steep:
      return "it is steeper than vehicles with wheels drive: it may be bent";
    case MapDoubt::weak_steps:
      return "scans whose surfaces fit badly are held by odometry as much as by their match";
    case MapDoubt::searched:
      return "too many steps had to be searched for";
  }
  return "unknown";
}

void judge_map(MapHealth& health) {
  health.verdict = MapVerdict::good;
  health.doubt = MapDoubt::none;
  const auto find = [&health](MapDoubt doubt, MapVerdict verdict) {
    if (verdict <= health.verdict) return;
    health.verdict = verdict;
    health.doubt = doubt;
  };
  const auto measure = [&find](MapDoubt doubt, double figure, const Bounds& bounds) {
    if (figure > bounds.bad) {
      find(doubt, MapVerdict::bad);
    } else if (figure > bounds.doubtful) {
      find(doubt, MapVerdict::doubtful);
    }
  };
  const double steps = std::max(1.0, static_cast<double>(health.scans) - 1);
  if (health.parts > 1) find(MapDoubt::parts, MapVerdict::bad);
  if (health.unmatched > chance) {
    // Places that look alike elsewhere are refused as implausible, and say nothing against the map.
    const bool is_rule = 3 * health.unmatched > health.closed + health.implausible;
    const bool is_much = 15 * health.unmatched > health.closed + health.implausible;
    if (is_rule || is_much)
      find(MapDoubt::unmatched_revisits, is_rule ? MapVerdict::bad : MapVerdict::doubtful);
  }
  if (health.expected_error_m > allowed_drift_m)
    measure(MapDoubt::drift, health.expected_error_m / std::max(1.0, health.length_m), drift_share);
  if (health.on_odometry > chance)
    measure(MapDoubt::odometry_alone, health.on_odometry / steps, odometry_share);
  if (health.against_odometry > 0) find(MapDoubt::odometry_contradicted, MapVerdict::doubtful);
  // Scans that slide, or pitch, all along bring no place back to where it was; let alone several.
  const bool is_held_by_loops = health.revisits >= many_revisits && health.unmatched <= chance;
  const double scale_off = std::abs(health.odometry_scale - 1);
  if (!is_held_by_loops || scale_off > odometry_scale_off.bad)
    measure(MapDoubt::odometry_scale, scale_off, odometry_scale_off);
  if (!is_held_by_loops && health.tilt_rad > steepest_rad) find(MapDoubt::steep, MapVerdict::doubtful);
  if (health.weak > 0) find(MapDoubt::weak_steps, MapVerdict::doubtful);
  if (health.found > few_steps) measure(MapDoubt::searched, health.found / steps, searched_share);
}

}  // namespace alces
