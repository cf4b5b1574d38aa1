#include "alces_drivers/motor/speed_supervisor.h"

namespace alces {
namespace {

/// 64 bits, so that the most negative number has one too.
std::int64_t magnitude(std::int64_t value) {
  return value < 0 ? -value : value;
}

}  // namespace

bool SpeedSupervisor::is_standing(std::int32_t velocity_units) const {
  return magnitude(velocity_units) <= config_.stall_units;
}

SpeedVerdict SpeedSupervisor::judge(std::int64_t target_units, std::int64_t velocity_units) const {
  if (magnitude(velocity_units - target_units) <= config_.tolerance_units) return SpeedVerdict::good;
  if (magnitude(velocity_units) <= config_.stall_units) return SpeedVerdict::stalled;
  if (target_units != 0 && (velocity_units < 0) != (target_units < 0)) return SpeedVerdict::wrong_way;
  return magnitude(velocity_units) < magnitude(target_units) ? SpeedVerdict::too_slow
                                                             : SpeedVerdict::too_fast;
}

void SpeedSupervisor::observe(std::int32_t target_units, std::int32_t velocity_units, std::int64_t stamp_ns) {
  const SpeedVerdict verdict = judge(target_units, velocity_units);
  const bool is_other_side = (verdict == SpeedVerdict::good) != (verdict_ == SpeedVerdict::good);
  if (since_ns_ == no_stamp_ns || is_other_side) since_ns_ = stamp_ns;
  verdict_ = verdict;
  last_ns_ = stamp_ns;
}

}  // namespace alces
