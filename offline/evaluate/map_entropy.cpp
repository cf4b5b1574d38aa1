#include "map_entropy.h"

#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "alces_platform/parallel.h"
#include "offline/io/files/error.h"

namespace alces::offline {
namespace {

using Cell = Eigen::Matrix<std::int64_t, 3, 1>;

// 21 bits an axis: 300 km of cells of 0.3 m.
std::uint64_t key_of(const Cell& cell) {
  constexpr std::int64_t half = std::int64_t{1} << 20;
  std::uint64_t key = 0;
  for (Eigen::Index i = 0; i < 3; ++i)
    key = key << 21U | (static_cast<std::uint64_t>(cell[i] + half) & 0x1FFFFFU);
  return key;
}

Cell cell_of(const Eigen::Vector3d& point, double size_m) {
  return (point / size_m).array().floor().cast<std::int64_t>();
}

// A point of the map in tenths of a millimetre: as exact 200 km away as near by.
struct MapPoint {
  std::int32_t xyz[3];
};
constexpr double unit_m = 1e-4;

Eigen::Vector3d place(const MapPoint& point) {
  return unit_m * Eigen::Vector3d(point.xyz[0], point.xyz[1], point.xyz[2]);
}

}  // namespace

MapEntropy measure_map_entropy(ScanSource& scans, std::span<const Pose> map_from_scan,
                               const MapEntropySettings& settings,
                               const std::function<void(std::size_t, std::size_t)>& progress) {
  if (scans.size() != map_from_scan.size())
    throw InputError(
        fmt::format("poses in the trajectory: {}, scans: {}; give the scans that it was made from",
                    map_from_scan.size(), scans.size()));
  struct Keyed {
    std::uint64_t key;
    MapPoint point;
  };
  std::vector<Keyed> map;
  ScanPoints in_body;
  std::unordered_set<std::uint64_t> taken;
  for (std::size_t scan = 0; scan < scans.size(); ++scan) {
    (void)scans.read(scan, in_body);
    taken.clear();
    for (const Point& p : in_body.points) {
      if (!is_finite(p)) continue;
      const Eigen::Vector3d body = Eigen::Vector3f(p.x, p.y, p.z).cast<double>();
      const double range_m = body.norm();
      if (range_m < settings.min_range_m || range_m > settings.max_range_m) continue;
      if (!taken.insert(key_of(cell_of(body, settings.cell_size_m))).second) continue;
      const Eigen::Vector3d in_map = map_from_scan[scan] * body;
      const Eigen::Vector3d units = (in_map / unit_m).array().round();
      map.push_back({key_of(cell_of(unit_m * units, settings.radius_m)),
                     {{static_cast<std::int32_t>(units.x()), static_cast<std::int32_t>(units.y()),
                       static_cast<std::int32_t>(units.z())}}});
    }
    if (progress) progress(scan + 1, scans.size());
  }
  // Stable: the points of a cell in the order of the scans, thus the same sums every time.
  std::stable_sort(map.begin(), map.end(), [](const Keyed& a, const Keyed& b) { return a.key < b.key; });
  std::unordered_map<std::uint64_t, std::pair<std::size_t, std::size_t>> range_of;
  for (std::size_t begin = 0; begin < map.size();) {
    std::size_t end = begin;
    while (end < map.size() && map[end].key == map[begin].key) ++end;
    range_of.emplace(map[begin].key, std::pair(begin, end));
    begin = end;
  }

  const std::size_t queries = settings.queries == 0 ? map.size() : std::min(settings.queries, map.size());
  struct Figure {
    bool is_measured = false;
    double entropy = 0;
    double variance_m2 = 0;
  };
  std::vector<Figure> figures(queries);
  const double radius_m2 = settings.radius_m * settings.radius_m;
  for_each_index(queries, [&](std::size_t i) {
    const Eigen::Vector3d center = place(map[i * map.size() / queries].point);
    const Cell at = cell_of(center, settings.radius_m);
    std::size_t count = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
    for (std::int64_t n = 0; n < 27; ++n) {
      const auto found = range_of.find(key_of(at + Cell(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)));
      if (found == range_of.end()) continue;
      for (std::size_t k = found->second.first; k < found->second.second; ++k) {
        const Eigen::Vector3d d = place(map[k].point) - center;
        if (d.squaredNorm() > radius_m2) continue;
        ++count;
        sum += d;
        products += d * d.transpose();
      }
    }
    if (count < std::max<std::size_t>(settings.min_neighbours, 2)) return;
    const auto number = static_cast<double>(count);
    const Eigen::Matrix3d covariance = products / number - (sum / number) * (sum / number).transpose();
    const Eigen::Vector3d values =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance, Eigen::EigenvaluesOnly)
            .eigenvalues()
            .cwiseMax(unit_m * unit_m);
    constexpr double one_axis = 2 * std::numbers::pi * std::numbers::e;
    figures[i] = {true, 0.5 * (one_axis * values).array().log().sum(), values[0]};
  });

  MapEntropy entropy;
  entropy.points = map.size();
  for (const Figure& figure : figures) {
    if (!figure.is_measured) continue;
    ++entropy.measured;
    entropy.mean_entropy += figure.entropy;
    entropy.mean_plane_variance_m2 += figure.variance_m2;
  }
  if (entropy.measured > 0) {
    entropy.mean_entropy /= static_cast<double>(entropy.measured);
    entropy.mean_plane_variance_m2 /= static_cast<double>(entropy.measured);
  }
  return entropy;
}

}  // namespace alces::offline
