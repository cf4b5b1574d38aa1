#include <cmath>
#include <numbers>

#include "alces_drivers/assembler/scan_assembler.h"

namespace alces {
namespace {

bool is_usable(const RayMask& mask) {
  return std::isfinite(mask.ray_from_rad) && std::isfinite(mask.ray_to_rad) &&
         std::isfinite(mask.head_from_rad) && std::isfinite(mask.head_to_rad) &&
         mask.ray_from_rad <= mask.ray_to_rad && mask.head_from_rad <= mask.head_to_rad &&
         !std::isnan(mask.maximum_range_m);
}

const char* validate(const LaserMounting& laser) {
  if (!is_valid(laser.head_from_laser)) return "head_from_laser is no pose";
  const bool is_range_good = laser.minimum_range_m >= 0 && laser.maximum_range_m > laser.minimum_range_m &&
                             std::isfinite(laser.maximum_range_m);
  if (!is_range_good) return "a laser's maximum_range_m must be above its minimum_range_m";
  if (laser.mask_count > LaserMounting::maximum_masks) return "a laser has more than 8 masks";
  for (std::uint32_t i = 0; i < laser.mask_count; ++i) {
    if (!is_usable(laser.masks[i])) return "a mask's angles are no numbers, or end before they begin";
  }
  return nullptr;
}

}  // namespace

const char* validate(const ScanAssemblerConfig& config) {
  const ScanAssemblerCapacity& capacity = config.capacity;
  if (capacity.rays_per_profile == 0 || capacity.rays_per_profile > Profile::maximum_rays) {
    return "rays_per_profile is not between 1 and 1200";
  }
  if (capacity.waiting_profiles == 0 || capacity.points_per_scan == 0) return "a capacity is 0";
  if (config.laser_count == 0 || config.laser_count > ScanAssemblerConfig::maximum_lasers) {
    return "laser_count is neither 1 nor 2";
  }
  for (std::uint32_t i = 0; i < config.laser_count; ++i) {
    if (const char* const laser_problem = validate(config.lasers[i])) return laser_problem;
  }
  if (!is_valid(config.body_from_head)) return "body_from_head is no pose";
  if (!(config.turn_rad >= 0.1) || !(config.turn_rad <= 4 * std::numbers::pi)) {
    return "turn_rad is not between 0.1 rad and two turns";
  }
  if (!(std::abs(config.boundary_rad) < 100)) return "boundary_rad is no angle";
  if (!(config.boundary_tolerance_rad > 0)) return "boundary_tolerance_rad is not positive";
  if (!(config.stop_angle_rad > 0)) return "stop_angle_rad is not positive";
  if (!(config.interpolation_error_m > 0)) return "interpolation_error_m is not positive";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!std::isfinite(config.own_box_from_m[axis]) || !std::isfinite(config.own_box_to_m[axis])) {
      return "the vehicle's own box has a corner that is no number";
    }
  }
  constexpr std::int64_t hour_ns = 3600 * ns_per_s;
  for (const std::int64_t duration_ns :
       {config.settle_ns, config.maximum_wait_ns, config.stop_after_ns, config.gps_maximum_age_ns}) {
    if (duration_ns < 0 || duration_ns > hour_ns) return "a duration is negative or longer than an hour";
  }
  return nullptr;
}

}  // namespace alces
