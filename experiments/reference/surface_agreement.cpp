#include "surface_agreement.h"

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

namespace alces::offline {
namespace {

constexpr std::uint32_t neighbor_count = 12;
constexpr float neighbor_radius2_m2 = 4;    // a flight has a point every metre or so
constexpr double flat = 0.1;                // smallest over middle eigenvalue
constexpr double same_way = 0.85;           // cosine of 32 degrees
constexpr std::size_t least_agreeing = 50;  // fewer hold nothing

Eigen::Vector3d vector(const Point& point) {
  return Eigen::Vector3f(point.x, point.y, point.z).cast<double>();
}

std::optional<Eigen::Vector3d> normal_at(const KdTree& map, std::span<const Neighbor> neighbors) {
  if (neighbors.size() < neighbor_count / 2) return std::nullopt;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Neighbor& neighbor : neighbors) middle += vector(map.point(neighbor.index));
  middle /= static_cast<double>(neighbors.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Neighbor& neighbor : neighbors) {
    const Eigen::Vector3d away = vector(map.point(neighbor.index)) - middle;
    spread += away * away.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  if (!(solver.eigenvalues()(0) < flat * solver.eigenvalues()(1))) return std::nullopt;
  return solver.eigenvectors().col(0);
}

struct Held {
  Eigen::Vector3d place;
  Eigen::Vector3d normal;
};

double least_curvature_ratio(const std::vector<Held>& held) {
  const auto count = static_cast<double>(held.size());
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Held& each : held) middle += each.place / count;
  double lever2_m2 = 0;
  for (const Held& each : held) lever2_m2 += (each.place - middle).squaredNorm() / count;
  const double lever_m = std::sqrt(lever2_m2);
  if (!(lever_m > 0)) return 0;
  Matrix6d curvature = Matrix6d::Zero();
  for (const Held& each : held) {
    Vector6d row;
    row << each.normal, (each.place - middle).cross(each.normal) / lever_m;
    curvature += row * row.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(curvature, Eigen::EigenvaluesOnly);
  return solver.eigenvalues()(0) / solver.eigenvalues()(5);
}

}  // namespace

SurfaceAgreement surface_agreement(const PreparedScan& scan, const Pose& map_from_body, const KdTree& map,
                                   double limit_m) {
  SurfaceAgreement result;
  std::vector<Held> held;
  std::array<Neighbor, neighbor_count> neighbors;
  for (const SurfaceSample& sample : scan.samples()) {
    const Eigen::Vector3d normal =
        map_from_body.rotation *
        Eigen::Vector3f(sample.normal[0], sample.normal[1], sample.normal[2]).cast<double>();
    if (normal.isZero()) continue;
    const Eigen::Vector3d place = map_from_body * vector(scan.tree().point(sample.index));
    const Eigen::Vector3f query = place.cast<float>();
    const std::uint32_t found =
        map.nearest({query.x(), query.y(), query.z()}, neighbor_radius2_m2, neighbors);
    if (found == 0 || static_cast<double>(neighbors[0].squared_m2) > limit_m * limit_m) continue;
    ++result.samples;
    const auto of_map = normal_at(map, std::span(neighbors).first(found));
    if (!of_map || std::abs(of_map->dot(normal)) < same_way) continue;
    ++result.agreeing;
    held.push_back({place, normal});
  }
  if (held.size() >= least_agreeing) result.least_curvature_ratio = least_curvature_ratio(held);
  return result;
}

}  // namespace alces::offline
