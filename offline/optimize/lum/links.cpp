#include "links.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace alces::offline {
namespace {

// Cells of the grid as one number; two cells that share one only cost a look at a distance too many.
std::uint64_t cell(std::int64_t x, std::int64_t y, std::int64_t z) {
  return static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15U +
         static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4FU +
         static_cast<std::uint64_t>(z) * 0x165667B19E3779F9U;
}

}  // namespace

std::vector<ScanLink> find_links(std::span<const Pose> map_from_scan, const LumSettings& settings) {
  std::vector<ScanLink> links;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> grid;
  const double reach_m = settings.link_distance_m;
  std::vector<std::pair<double, std::uint32_t>> near;
  for (std::uint32_t j = 0; j < map_from_scan.size(); ++j) {
    const Eigen::Vector3d& place = map_from_scan[j].translation_m;
    const Eigen::Matrix<std::int64_t, 3, 1> at = (place / reach_m).array().floor().cast<std::int64_t>();
    near.clear();
    for (std::int64_t x = at.x() - 1; x <= at.x() + 1; ++x)
      for (std::int64_t y = at.y() - 1; y <= at.y() + 1; ++y)
        for (std::int64_t z = at.z() - 1; z <= at.z() + 1; ++z) {
          const auto found = grid.find(cell(x, y, z));
          if (found == grid.end()) continue;
          for (const std::uint32_t k : found->second) {
            const double distance_m = (map_from_scan[k].translation_m - place).norm();
            if (distance_m <= reach_m) near.emplace_back(distance_m, k);
          }
        }
    grid[cell(at.x(), at.y(), at.z())].push_back(j);
    if (j > 0) near.emplace_back(-1, j - 1);  // the one before, however far
    std::sort(near.begin(), near.end());
    std::vector<std::uint32_t> chosen;
    for (const auto& [distance_m, k] : near) {
      if (settings.links_a_scan > 0 && chosen.size() >= settings.links_a_scan) break;
      if (std::find(chosen.begin(), chosen.end(), k) == chosen.end()) chosen.push_back(k);
    }
    std::sort(chosen.begin(), chosen.end());
    for (const std::uint32_t k : chosen) links.push_back({j, k});
  }
  return links;
}

}  // namespace alces::offline
