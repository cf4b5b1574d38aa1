// Where the vehicle's GPS receiver was at a time: what the scan assembler asks.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

namespace alces {

class GpsPosition {
 public:
  /// East, north, up of the first fix, m: between the fixes before and after that time in proportion, or the
  /// one of them that is there. Fixes farther from it than `maximum_age_ns` do not count; nothing: there is
  /// none.
  [[nodiscard]] virtual std::optional<Eigen::Vector3d> position_at(std::int64_t stamp_ns,
                                                                   std::int64_t maximum_age_ns) const = 0;

 protected:
  ~GpsPosition() = default;
};

}  // namespace alces
