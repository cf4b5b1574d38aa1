#include "ground_plane.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "flat_patches.h"

namespace alces::offline {
namespace {

constexpr int ransac_rounds = 300;
constexpr int refinements = 12;
constexpr double independent_points = 200;
constexpr double close_m = 0.3;  // three points nearer to each other make no plane

/// A plane in the head's frame: normal up, distance of the origin above it.
struct Ground {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double height_m = 0;
  std::vector<std::uint32_t> points;
  double rms_m = 0;
  double spread_m = 1;  ///< of the points along the plane, the narrower way
};

std::vector<std::uint32_t> points_within(std::span<const Eigen::Vector3d> ends_m,
                                         const std::vector<std::uint32_t>& which, const Ground& ground,
                                         double tolerance_m) {
  std::vector<std::uint32_t> near;
  for (const std::uint32_t i : which)
    if (std::abs(ground.normal.dot(ends_m[i]) + ground.height_m) <= tolerance_m) near.push_back(i);
  return near;
}

bool find_ground(std::span<const Eigen::Vector3d> ends_m, const std::vector<std::uint32_t>& which,
                 const Eigen::Vector3d& up, const GroundSettings& settings, Ground& best) {
  if (which.size() < settings.least_points) return false;
  std::mt19937 random(1);  // NOLINT(cert-msc51-cpp): the same every time
  // The mean of a distribution's draws differs between libraries; this does not.
  const auto draw = [&] { return which[random() % which.size()]; };
  std::size_t most = 0;
  for (int round = 0; round < ransac_rounds; ++round) {
    const Eigen::Vector3d& a = ends_m[draw()];
    const Eigen::Vector3d& b = ends_m[draw()];
    const Eigen::Vector3d& c = ends_m[draw()];
    Eigen::Vector3d normal = (b - a).cross(c - a);
    if (normal.norm() < close_m * close_m) continue;
    normal.normalize();
    if (normal.dot(up) < 0) normal = -normal;
    if (normal.dot(up) < std::cos(settings.steepest_rad)) continue;
    Ground candidate;
    candidate.normal = normal;
    candidate.height_m = -normal.dot(a);
    std::size_t count = 0;
    for (const std::uint32_t i : which)
      if (std::abs(normal.dot(ends_m[i]) + candidate.height_m) <= settings.tolerance_m) ++count;
    if (count <= most) continue;
    most = count;
    best = candidate;
  }
  if (most < settings.least_points) return false;
  for (int i = 0; i < refinements; ++i) {
    best.points = points_within(ends_m, which, best, 2 * settings.tolerance_m);
    std::vector<double> weights;
    for (const std::uint32_t p : best.points) {
      const double e = (best.normal.dot(ends_m[p]) + best.height_m) / (0.5 * settings.tolerance_m);
      // A square metre next to the vehicle has many more points than one farther off.
      const double distance_m = std::max(0.5, ends_m[p].head<2>().norm());
      weights.push_back(distance_m / (1 + e * e));
    }
    const PlaneFit plane = fit_plane(ends_m, best.points, weights);
    best.normal = plane.normal.dot(up) < 0 ? Eigen::Vector3d(-plane.normal) : plane.normal;
    best.height_m = -best.normal.dot(plane.center_m);
    best.spread_m = plane.width_m;
  }
  best.points = points_within(ends_m, which, best, settings.tolerance_m);
  double sum = 0;
  for (const std::uint32_t p : best.points) {
    const double e = best.normal.dot(ends_m[p]) + best.height_m;
    sum += e * e;
  }
  best.rms_m = best.points.empty() ? 0 : std::sqrt(sum / static_cast<double>(best.points.size()));
  return best.points.size() >= settings.least_points;
}

}  // namespace

GroundEstimate estimate_ground(std::span<const StandingRay> rays, std::span<const Eigen::Vector3d> ends_m,
                               const Mounting& configured_head, const GroundSettings& settings) {
  GroundEstimate result;
  result.head = configured_head;
  const Pose body_from_head = pose_of(configured_head);
  const Eigen::Vector3d up = body_from_head.rotation.inverse() * Eigen::Vector3d::UnitZ();
  std::uint32_t stands = 0;
  for (const StandingRay& ray : rays) stands = std::max(stands, ray.stand + 1);
  std::vector<Eigen::Vector3d> found;  // z, roll, pitch
  double square_sum = 0;
  double spread_sum_m = 0;
  for (std::uint32_t stand = 0; stand < stands; ++stand) {
    std::vector<std::uint32_t> which;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (rays[i].stand != stand || ends_m[i].head<2>().norm() > settings.reach_m) continue;
      const double z_m = (body_from_head * ends_m[i]).z();
      if (std::abs(z_m - settings.ground_z_m) <= settings.search_m)
        which.push_back(static_cast<std::uint32_t>(i));
    }
    Ground ground;
    if (!find_ground(ends_m, which, up, settings, ground)) continue;
    // Roll, then pitch, that bring the normal upright; yaw leaves it there.
    const Eigen::Vector3d& n = ground.normal;
    found.emplace_back(ground.height_m + settings.ground_z_m, std::atan2(n.y(), n.z()),
                       -std::atan2(n.x(), std::hypot(n.y(), n.z())));
    result.points += ground.points.size();
    square_sum += ground.rms_m * ground.rms_m * static_cast<double>(ground.points.size());
    spread_sum_m += ground.spread_m;
  }
  if (found.empty()) return result;
  result.is_found = true;
  result.stands = found.size();
  const auto count = static_cast<double>(found.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& one : found) mean += one / count;
  Eigen::Vector3d variance = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& one : found)
    if (found.size() > 1) variance += (one - mean).cwiseAbs2() / (count * (count - 1));
  result.rms_m = std::sqrt(square_sum / static_cast<double>(result.points));
  const double of_mean_m = result.rms_m / std::sqrt(independent_points * count);
  const double of_tilt_rad = of_mean_m / std::max(0.1, spread_sum_m / count);
  result.head[key_z] = mean[0];
  result.head[key_roll] = mean[1];
  result.head[key_pitch] = mean[2];
  result.sigma_z_m = std::max(of_mean_m, std::sqrt(variance[0]));
  result.sigma_roll_rad = std::max(of_tilt_rad, std::sqrt(variance[1]));
  result.sigma_pitch_rad = std::max(of_tilt_rad, std::sqrt(variance[2]));
  return result;
}

}  // namespace alces::offline
