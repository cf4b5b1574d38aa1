#include "link_matching.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/task_arena.h>

#include <Eigen/LU>
#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <vector>

#include "alces/pair_covariance.h"
#include "alces_platform/parallel.h"
#include "offline/optimize/lum/link_sum_source.h"
#include "offline/optimize/lum/links.h"

namespace alces::offline {
namespace {

constexpr std::uint32_t link_correspondences = 4096;

/// An Icp and its memory; one a thread.
class LinkMatcher {
 public:
  LinkMatcher() : block_(bytes()), arena_(block_.bytes()), icp_(arena_, link_correspondences) {}
  IcpResult match(const PreparedScan& model, const PreparedScan& data, const Pose& model_from_data,
                  const IcpConfig& config) {
    const IcpScan model_scan{&model.tree(), model.samples(), {}};
    const IcpScan data_scan{&data.tree(), data.samples(), {}};
    return icp_.match({&model_scan, 1}, {&data_scan, 1}, model_from_data, config);
  }

 private:
  static std::size_t bytes() {
    Arena counting;
    const Icp planned(counting, link_correspondences);
    return counting.used_bytes();
  }
  settings::MemoryBlock block_;
  Arena arena_;
  Icp icp_;
};

/// What a change of from_from_to on its left, seen from `from`, is on its right, seen from `to`.
Matrix6d right_from_left(const Pose& from_from_to) {
  const Pose to_from_from = from_from_to.inverse();
  const Eigen::Matrix3d rotation = to_from_from.rotation.toRotationMatrix();
  Eigen::Matrix3d lever;
  const Eigen::Vector3d& t = to_from_from.translation_m;
  lever << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  Matrix6d adjoint = Matrix6d::Zero();
  adjoint.topLeftCorner<3, 3>() = rotation;
  adjoint.topRightCorner<3, 3>() = lever * rotation;
  adjoint.bottomRightCorner<3, 3>() = rotation;
  return adjoint;
}

/// Of g2o's error (t, vector part of q: half the angle), seen from `to`.
Matrix6d information_of(Matrix6d covariance) {
  covariance.topRightCorner<3, 3>() *= 0.5;
  covariance.bottomLeftCorner<3, 3>() *= 0.5;
  covariance.bottomRightCorner<3, 3>() *= 0.25;
  const Matrix6d information = covariance.inverse();
  return 0.5 * (information + information.transpose());
}

Matrix6d diagonal_covariance(double m, double rad) {
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(m * m), Eigen::Vector3d::Constant(rad * rad);
  return variances.asDiagonal();
}

std::optional<Constraint> judge(const ScanLink& link, const IcpResult& match,
                                const LinkMatchingSettings& settings) {
  if (match.verdict == IcpVerdict::too_few_correspondences) return std::nullopt;
  if (match.overlap < settings.minimum_overlap || match.rms_m > settings.maximum_rms_m) return std::nullopt;
  const PairCovariance pair = from_curvature(match);
  if (!pair.is_known) return std::nullopt;
  const Matrix6d adjoint = right_from_left(match.model_from_data);
  Matrix6d covariance = settings.uncertainty.inflation * adjoint * pair.covariance * adjoint.transpose();
  covariance += diagonal_covariance(settings.uncertainty.minimum_translation_m,
                                    settings.uncertainty.minimum_rotation_rad);
  Constraint constraint;
  constraint.from = link.k;
  constraint.to = link.j;
  constraint.from_from_to = match.model_from_data;
  constraint.information = information_of(covariance);
  return constraint;
}

}  // namespace

LinkMatchingSettings link_matching_settings(const MapperConfig& config, const LumSettings& lum) {
  LinkMatchingSettings settings;
  settings.links = lum;
  settings.match = config.scan_match;
  settings.uncertainty = config.edge_uncertainty;
  settings.minimum_overlap = config.loop_verification.minimum_overlap;
  settings.maximum_rms_m = config.loop_verification.maximum_rms_m;
  return settings;
}

LinkMatching match_links(std::span<const Pose> map_from_scan, ScanCache& cache,
                         const LinkMatchingSettings& settings,
                         const std::function<void(std::size_t, std::size_t)>& progress,
                         const std::function<bool()>& stop_requested) {
  const std::vector<ScanLink> links = find_links(map_from_scan, settings.links);
  std::vector<std::optional<Constraint>> matched(links.size());
  tbb::enumerable_thread_specific<LinkMatcher> matchers;
  std::mutex reporting;
  std::size_t done = 0;
  std::atomic<bool> is_stopped = false;
  const auto match_one = [&](std::size_t i) {
    if (is_stopped) return;
    const ScanLink& link = links[i];
    const PreparedScan& model = cache.at(link.k);
    const PreparedScan& data = cache.at(link.j);
    if (model.size() > 0 && data.size() > 0)
      matched[i] =
          judge(link,
                matchers.local().match(model, data, map_from_scan[link.k].inverse() * map_from_scan[link.j],
                                       settings.match),
                settings);
    const std::lock_guard lock(reporting);
    if (stop_requested && stop_requested()) is_stopped = true;
    if (progress) progress(++done, links.size());
  };
  tbb::task_arena arena(settings.links.threads == 0 ? tbb::task_arena::automatic
                                                    : static_cast<int>(settings.links.threads));
  arena.execute([&] {
    for (const std::vector<std::size_t>& batch : batch_links(links, cache.capacity())) {
      cache.load(scans_of(links, batch));
      for_each_index(batch.size(), [&](std::size_t at) { match_one(batch[at]); });
    }
  });

  LinkMatching result;
  result.was_stopped = is_stopped;
  result.links = links.size();
  std::vector<bool> is_bound(map_from_scan.size());  // to a scan before
  for (std::size_t i = 0; i < map_from_scan.size(); ++i)
    result.graph.vertices.push_back({static_cast<std::int64_t>(i), map_from_scan[i], i == 0});
  for (std::size_t i = 0; i < links.size(); ++i) {
    if (!matched[i]) {
      ++result.refused;
      continue;
    }
    is_bound[links[i].j] = true;
    result.graph.constraints.push_back(*matched[i]);
  }
  for (std::uint32_t j = 1; j < map_from_scan.size(); ++j) {
    if (is_bound[j]) continue;
    ++result.bridges;
    Constraint bridge;
    bridge.from = j - 1;
    bridge.to = j;
    bridge.from_from_to = map_from_scan[j - 1].inverse() * map_from_scan[j];
    bridge.information = information_of(diagonal_covariance(settings.bridge_m, settings.bridge_rad));
    result.graph.constraints.push_back(bridge);
  }
  return result;
}

}  // namespace alces::offline
