// Does the shaft turn as fast as it was told to? A deviation counts once it has lasted.
#pragma once

#include <cstdint>

#include "alces_drivers/stamp.h"

namespace alces {

enum class SpeedVerdict : std::uint8_t { good, too_slow, too_fast, stalled, wrong_way };

class SpeedSupervisor {
 public:
  /// Velocities in the drive's own unit, not negative. stall_units: what counts as standing still.
  struct Config {
    std::int32_t tolerance_units = 0;
    std::int32_t stall_units = 0;
  };

  explicit SpeedSupervisor(const Config& config) : config_(config) {}

  void restart() { since_ns_ = no_stamp_ns; }
  void observe(std::int32_t target_units, std::int32_t velocity_units, std::int64_t stamp_ns);

  /// Of the last observation.
  [[nodiscard]] SpeedVerdict verdict() const { return verdict_; }
  /// For how long the observations up to the last one have been within the tolerance or, if that was not,
  /// outside; 0: there was none.
  [[nodiscard]] std::int64_t lasted_ns() const { return since_ns_ == no_stamp_ns ? 0 : last_ns_ - since_ns_; }
  [[nodiscard]] bool is_standing(std::int32_t velocity_units) const;

 private:
  [[nodiscard]] SpeedVerdict judge(std::int64_t target_units, std::int64_t velocity_units) const;

  Config config_;
  SpeedVerdict verdict_ = SpeedVerdict::good;
  std::int64_t since_ns_ = no_stamp_ns;  ///< it is good, or it is not good
  std::int64_t last_ns_ = no_stamp_ns;
};

}  // namespace alces
