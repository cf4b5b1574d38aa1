#include "drive_geometry.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace alces::offline {
namespace {

constexpr int rounds = 20;
constexpr double least_residual_scale_m = 0.002;

struct Line {
  Eigen::Vector2d value = Eigen::Vector2d::Zero();
  Eigen::Vector2d sigma = Eigen::Vector2d::Constant(1e9);
};

/// rows * value = right, with Cauchy weights; the second unknown is left out (0, sigma infinite) when the
/// rows hardly know it.
Line solve_robustly(const std::vector<Eigen::Vector2d>& rows, const std::vector<double>& right) {
  Line line;
  double scale_m = 0.1;
  for (int round = 0; round < rounds; ++round) {
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    std::vector<double> residuals_m;
    double squares = 0;
    double weights = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double e = right[i] - rows[i].dot(line.value);
      const double weight = 1 / (1 + e * e / (4 * scale_m * scale_m));
      information += weight * rows[i] * rows[i].transpose();
      sum += weight * right[i] * rows[i];
      squares += weight * e * e;
      weights += weight;
      residuals_m.push_back(std::abs(e));
    }
    const auto middle = residuals_m.begin() + static_cast<std::ptrdiff_t>(residuals_m.size() / 2);
    std::nth_element(residuals_m.begin(), middle, residuals_m.end());
    if (!(information(0, 0) > 1e-9)) return line;
    const bool has_second = information(1, 1) > 1e-6 * information(0, 0);
    const double variance = squares / std::max(1.0, weights - 2);
    if (has_second) {
      const Eigen::Matrix2d covariance = information.inverse();
      line.value = covariance * sum;
      line.sigma = (variance * covariance.diagonal()).cwiseMax(0).cwiseSqrt();
    } else {
      line.value = {sum[0] / information(0, 0), 0};
      line.sigma = {std::sqrt(variance / information(0, 0)), 1e9};
    }
    scale_m = std::max(least_residual_scale_m, 1.4826 * *middle);
  }
  return line;
}

}  // namespace

DriveGeometry estimate_drive_geometry(std::span<const DriveStep> steps, const Mounting& configured_head,
                                      const DriveGeometrySettings& settings) {
  DriveGeometry result;
  result.head = configured_head;
  std::vector<Eigen::Vector2d> sideways_rows;
  std::vector<double> sideways;
  std::vector<Eigen::Vector2d> ahead_rows;
  std::vector<double> ahead;
  std::vector<Eigen::Vector2d> chords;
  for (const DriveStep& step : steps) {
    const double turn_rad = log_so3(step.matched.rotation).z();
    const double way_m = step.odometry.translation_m.norm();
    const bool is_wanted = step.odometry.translation_m.x() >= settings.least_way_m &&
                           std::abs(turn_rad) <= settings.largest_turn_rad;
    if (!is_wanted) continue;
    const Eigen::Rotation2Dd back(-0.5 * turn_rad);
    const Eigen::Vector2d chord = back * step.matched.translation_m.head<2>();
    const double bend = 2 * std::sin(0.5 * turn_rad);
    sideways_rows.emplace_back(chord.x(), -bend);
    sideways.push_back(-chord.y());
    ahead_rows.emplace_back(way_m, -bend);
    ahead.push_back(chord.x());
    chords.push_back(chord);
    ++result.steps;
    result.way_m += way_m;
    result.turned_rad += std::abs(turn_rad);
  }
  if (result.steps < settings.least_steps) return result;
  const Line yaw_and_x = solve_robustly(sideways_rows, sideways);
  for (std::size_t i = 0; i < ahead.size(); ++i) ahead[i] -= yaw_and_x.value[0] * chords[i].y();
  const Line scale_and_y = solve_robustly(ahead_rows, ahead);
  result.sigma_yaw_rad = yaw_and_x.sigma[0];
  result.sigma_x_m = yaw_and_x.sigma[1];
  result.sigma_y_m = scale_and_y.sigma[1];
  result.odometry_scale = scale_and_y.value[0];
  result.sigma_scale = scale_and_y.sigma[0];
  result.has_yaw = result.sigma_yaw_rad <= settings.largest_sigma_yaw_rad;
  result.has_x = result.has_yaw && result.sigma_x_m <= settings.largest_sigma_m;
  result.has_y = result.has_yaw && result.sigma_y_m <= settings.largest_sigma_m;
  // true_body_from_configured_body: a turn by psi, then a shift.
  Pose correction;
  if (result.has_yaw) correction.rotation = Eigen::AngleAxisd(yaw_and_x.value[0], Eigen::Vector3d::UnitZ());
  if (result.has_x) correction.translation_m.x() = yaw_and_x.value[1];
  if (result.has_y) correction.translation_m.y() = scale_and_y.value[1];
  const Pose body_from_head = correction * pose_of(configured_head);
  result.head = mounting_of(body_from_head);
  // Turning about the body's origin moves the head along with it; what was not estimated stays.
  if (!result.has_x) result.head[key_x] = configured_head[key_x];
  if (!result.has_y) result.head[key_y] = configured_head[key_y];
  return result;
}

}  // namespace alces::offline
