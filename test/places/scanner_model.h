// Three scanners to look at a place with. Each stands still while it turns: a scan is rigid.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "alces/point.h"
#include "alces/pose.h"
#include "alces_platform/sim/world/range_errors.h"
#include "alces_platform/sim/world/scene.h"

namespace alces::places {

enum class Scanner : std::uint8_t {
  turning,  ///< a 2D laser on a turning head: a vertical profile every 2 deg, a ray every degree; LMS 291's
            ///< errors
  rings16,  ///< 16 rings from -15 to 15 deg, a ray every 0.8 deg
  rings64,  ///< 64 rings from -24.9 to 2 deg, a ray every 0.6 deg
};
inline constexpr Scanner all_scanners[] = {Scanner::turning, Scanner::rings16, Scanner::rings64};
[[nodiscard]] std::string_view name(Scanner scanner);
[[nodiscard]] std::optional<Scanner> scanner_named(std::string_view name);

class ScannerModel {
 public:
  ScannerModel(Scanner scanner, double reach_m);

  /// Above the floor.
  [[nodiscard]] double height_m() const { return height_m_; }
  [[nodiscard]] std::size_t rays() const { return directions_.size(); }

  /// What it sees from a place, in its own frame: origin in the scanner, x ahead.
  [[nodiscard]] std::vector<Point> scan(const sim::Scene& scene, const Pose& world_from_scanner,
                                        std::uint64_t seed) const;

 private:
  double height_m_ = 1;
  std::size_t column_rays_ = 1;  ///< rays between which a range jump may mix
  double own_vehicle_rad_ = 0;   ///< rays steeper down than this end on the own vehicle
  sim::RangeErrors errors_;
  std::vector<Eigen::Vector3d> directions_;
};

}  // namespace alces::places
