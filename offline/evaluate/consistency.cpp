// The part of evaluation.h that needs no ground truth.
#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <nanoflann.hpp>
#include <nlohmann/json.hpp>

#include "alces_platform/parallel.h"
#include "evaluation.h"
#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "offline/io/files/json_text.h"

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wnull-dereference"  // GCC 12 inside std::vector::resize of nanoflann
#endif

namespace alces::offline {

namespace {

struct PointCloud {
  std::vector<Point> points;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t index, std::size_t axis) const {
    const Point& point = points[index];
    return axis == 0 ? point.x : axis == 1 ? point.y : point.z;
  }
  template <class Box>
  [[nodiscard]] bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

// Distances between tree and query in float: exact to some micrometres at 20 m, and only used to rank
// neighbours.
using KdTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, PointCloud>,
                                                   PointCloud, 3, std::uint32_t>;
constexpr std::size_t leaf_size = 10;

Eigen::Vector3d vector(const Point& point) {
  return Eigen::Vector3f(point.x, point.y, point.z).cast<double>();
}

std::vector<Point> within_range(std::span<const Point> points, const ConsistencySettings& settings) {
  std::vector<Point> kept;
  kept.reserve(points.size());
  for (const Point& point : points) {
    if (!is_finite(point)) continue;
    const double range_m = vector(point).norm();
    if (range_m >= settings.min_range_m && range_m <= settings.max_range_m) kept.push_back(point);
  }
  return kept;
}

/// Normal of the plane through the points, if they lie on one.
std::optional<Eigen::Vector3d> normal(const PointCloud& cloud, std::span<const std::uint32_t> neighbours,
                                      double max_eigenvalue_ratio) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const std::uint32_t i : neighbours) mean += vector(cloud.points[i]);
  mean /= static_cast<double>(neighbours.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const std::uint32_t i : neighbours) {
    const Eigen::Vector3d difference = vector(cloud.points[i]) - mean;
    covariance += difference * difference.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);  // ascending
  if (!(solver.eigenvalues()(0) < max_eigenvalue_ratio * solver.eigenvalues()(1))) return std::nullopt;
  return solver.eigenvectors().col(0);
}

std::optional<double> median_of_overlapping(const std::vector<PairConsistency>& pairs) {
  std::vector<double> residuals_m;
  for (const PairConsistency& pair : pairs) {
    if (pair.median_residual_m) residuals_m.push_back(*pair.median_residual_m);
  }
  if (residuals_m.empty()) return std::nullopt;
  return median(residuals_m);
}

}  // namespace

struct SurfaceModel::Tree {
  PointCloud cloud;
  std::vector<Eigen::Vector3f> normals;  // beside the points; zero where there is no plane
  std::size_t normal_count = 0;
  std::unique_ptr<KdTree> index;
};

SurfaceModel::SurfaceModel(std::span<const Point> points, const ConsistencySettings& settings)
    : tree_(std::make_unique<Tree>()), settings_(settings) {
  PointCloud& cloud = tree_->cloud;
  cloud.points = within_range(points, settings);
  if (cloud.points.size() < settings.normal_neighbours) return;
  tree_->index = std::make_unique<KdTree>(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(leaf_size));
  std::vector<std::uint32_t> neighbours(settings.normal_neighbours);
  std::vector<float> square_distances(settings.normal_neighbours);
  tree_->normals.reserve(cloud.points.size());
  for (const Point& point : cloud.points) {
    const std::array<float, 3> query{point.x, point.y, point.z};
    const std::size_t found =
        tree_->index->knnSearch(query.data(), neighbours.size(), neighbours.data(), square_distances.data());
    const auto direction = normal(cloud, std::span(neighbours).first(found), settings.max_eigenvalue_ratio);
    tree_->normals.push_back(direction ? Eigen::Vector3f(direction->cast<float>()) : Eigen::Vector3f::Zero());
    if (direction) ++tree_->normal_count;
  }
}

SurfaceModel::~SurfaceModel() = default;
SurfaceModel::SurfaceModel(SurfaceModel&&) noexcept = default;
SurfaceModel& SurfaceModel::operator=(SurfaceModel&&) noexcept = default;

std::size_t SurfaceModel::size() const {
  return tree_->normal_count;
}

std::vector<double> SurfaceModel::residuals_m(std::span<const Point> b, const Pose& a_from_b) const {
  std::vector<double> residuals_m;
  if (!tree_->index) return residuals_m;
  const std::vector<Point> points = within_range(b, settings_);
  const Eigen::Matrix3d rotation = a_from_b.rotation.toRotationMatrix();
  const auto max_square_distance = static_cast<float>(settings_.max_distance_m * settings_.max_distance_m);
  for (std::size_t i = 0; i < points.size(); i += settings_.every) {
    const Eigen::Vector3d point = rotation * vector(points[i]) + a_from_b.translation_m;
    const Eigen::Vector3f query = point.cast<float>();
    std::uint32_t nearest = 0;
    float square_distance = 0;
    nanoflann::KNNResultSet<float, std::uint32_t> result(1);
    result.init(&nearest, &square_distance);
    square_distance = max_square_distance;  // the search prunes by what lies here
    if (!tree_->index->findNeighbors(result, query.data(), nanoflann::SearchParams())) continue;
    if (tree_->normals[nearest].isZero()) continue;
    const Eigen::Vector3d difference = point - vector(tree_->cloud.points[nearest]);
    residuals_m.push_back(std::abs(difference.dot(tree_->normals[nearest].cast<double>())));
  }
  return residuals_m;
}

std::vector<PairGroup> neighbour_pairs(std::size_t scan_count) {
  PairGroup next{"next", {}};
  PairGroup five_apart{"five apart", {}};
  for (std::uint32_t i = 5; i + 1 < scan_count; i += 10) {
    next.pairs.emplace_back(i, i + 1);
    if (i + 5 < scan_count) five_apart.pairs.emplace_back(i, i + 5);
  }
  return {next, five_apart};
}

Revisits find_revisits(std::span<const Pose> map_from_scan, const RevisitSettings& settings) {
  std::vector<ScanPair> all;
  const auto count = static_cast<std::uint32_t>(map_from_scan.size());
  for (std::uint32_t a = 0; a < count; ++a) {
    for (std::uint32_t b = a + settings.min_gap; b < count; ++b) {
      const double distance_m = (map_from_scan[a].translation_m - map_from_scan[b].translation_m).norm();
      if (distance_m <= settings.max_distance_m) all.emplace_back(a, b);
    }
  }
  Revisits revisits;
  revisits.found = all.size();
  if (all.size() <= settings.max_pairs) {
    revisits.pairs = std::move(all);
  } else {
    for (std::size_t i = 0; i < settings.max_pairs; ++i) {
      revisits.pairs.push_back(all[i * all.size() / settings.max_pairs]);
    }
  }
  return revisits;
}

std::vector<ScanPair> read_pairs(const std::filesystem::path& file, std::size_t scan_count) {
  std::string bytes;
  read_file(file, bytes);
  const nlohmann::json json = nlohmann::json::parse(bytes, nullptr, false);
  if (!json.is_array()) throw InputError(file, "is no JSON list of pairs [[a, b], ...]");
  std::vector<ScanPair> pairs;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const auto is_scan = [&](const nlohmann::json& value) {
      return value.is_number_unsigned() && value.get<std::uint64_t>() < scan_count;
    };
    const nlohmann::json& entry = json[i];
    if (!entry.is_array() || entry.size() != 2 || !is_scan(entry[0]) || !is_scan(entry[1])) {
      throw InputError(file, fmt::format("entry {} is {}, not a pair of scans below {}", i,
                                         json_text(entry, -1), scan_count));
    }
    pairs.emplace_back(entry[0].get<std::uint32_t>(), entry[1].get<std::uint32_t>());
  }
  if (pairs.empty()) throw InputError(file, "holds no pairs");
  return pairs;
}

std::vector<GroupConsistency> measure_consistency(
    ScanSource& scans, std::span<const Pose> map_from_scan, std::span<const PairGroup> groups,
    const ConsistencySettings& settings, const std::function<void(std::size_t, std::size_t)>& progress) {
  if (scans.size() != map_from_scan.size()) {
    throw InputError(
        fmt::format("poses in the trajectory: {}, scans: {}; give the scans that it was made from",
                    map_from_scan.size(), scans.size()));
  }
  std::vector<GroupConsistency> results;
  std::map<std::uint32_t, std::vector<PairConsistency*>> pairs_by_a;
  std::size_t total = 0;
  for (const PairGroup& group : groups) {
    GroupConsistency& result = results.emplace_back();
    result.name = group.name;
    for (const ScanPair& pair : group.pairs) {
      if (pair.first >= scans.size() || pair.second >= scans.size()) {
        throw InputError(fmt::format("the pair ({}, {}) is not among the {} scans", pair.first, pair.second,
                                     scans.size()));
      }
      result.pairs.push_back({pair, 0, std::nullopt});
    }
    total += group.pairs.size();
  }
  for (GroupConsistency& result : results) {
    for (PairConsistency& pair : result.pairs) pairs_by_a[pair.pair.first].push_back(&pair);
  }
  const std::vector<std::pair<std::uint32_t, std::vector<PairConsistency*>>> work(pairs_by_a.begin(),
                                                                                  pairs_by_a.end());
  std::mutex reading;
  std::mutex reporting;
  std::size_t done = 0;
  const auto read = [&](std::size_t index, ScanPoints& scan) {
    const std::lock_guard lock(reading);
    (void)scans.read(index, scan);
  };
  for_each_index(work.size(), [&](std::size_t i) {
    const auto& [a, pairs] = work[i];
    ScanPoints scan;
    read(a, scan);
    const SurfaceModel model(scan.points, settings);
    for (PairConsistency* pair : pairs) {
      const std::uint32_t b = pair->pair.second;
      read(b, scan);
      const std::vector<double> residuals_m =
          model.residuals_m(scan.points, map_from_scan[a].inverse() * map_from_scan[b]);
      pair->correspondences = residuals_m.size();
      if (residuals_m.size() >= settings.min_correspondences) pair->median_residual_m = median(residuals_m);
      const std::lock_guard lock(reporting);
      ++done;
      if (progress) progress(done, total);
    }
  });
  for (GroupConsistency& result : results) {
    for (const PairConsistency& pair : result.pairs) {
      if (!pair.median_residual_m) ++result.without_overlap;
    }
    result.median_m = median_of_overlapping(result.pairs);
  }
  return results;
}

}  // namespace alces::offline
