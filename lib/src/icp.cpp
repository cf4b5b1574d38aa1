#include "alces/icp.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "alces/symmetric_eigen.h"
#include "float_transform.h"
#include "icp_sums.h"

namespace alces {
namespace {

// Geman-McClure: residuals well above the scale count little. Scale 0: all count alike.
float robust_weight(float squared_m2, float scale_m) {
  if (!(scale_m > 0)) return 1;
  const float ratio = 1.0F + squared_m2 / (scale_m * scale_m);
  return 1.0F / (ratio * ratio);
}

constexpr float planar_roughness = 0.2F;  // at and above, a sample has no plane

struct Step {
  Pose model_from_model;
  Vector6d weak_direction = Vector6d::Zero();  // zero: none
};

// What one iteration minimises, gathered correspondence by correspondence.
struct Minimizer {
  Minimizer(const IcpConfig& icp_config, float robust_scale_m)
      : config(icp_config), scale_m(robust_scale_m) {}

  /// Whole distances.
  void add(const Point& target, const Point& q) {
    const Point error_m = target - q;
    const float squared_m2 = dot(error_m, error_m);
    const float weight = robust_weight(squared_m2, scale_m);
    ++count;
    points.add(q, error_m, weight);
    add_residual(squared_m2, weight);
  }
  /// Distances along normals, where there are some.
  void add(const Point& target, const Point& q, const Point& normal, float plane_weight) {
    const Point error_m = target - q;
    ++count;
    if (plane_weight > 0) {
      const float along_m = dot(normal, error_m);
      const float weight = plane_weight * robust_weight(along_m * along_m, scale_m);
      equations.add_plane(q, normal, along_m, weight);
      add_residual(along_m * along_m, weight);
      return;
    }
    const float weight = robust_weight(dot(error_m, error_m), scale_m);
    equations.add_point(q, error_m, weight * config.rough_weight);
  }

  [[nodiscard]] double rms_m() const { return weight_sum > 0 ? std::sqrt(squared_sum_m2 / weight_sum) : 0; }

  // The step to the minimum, except along a direction that is undetermined: with radians weighed by the
  // points' typical distance, one whose curvature is below `degenerate_ratio` of the largest.
  [[nodiscard]] Step solve(Matrix6d& information) {
    equations.carry();
    points.carry();
    const bool is_of_points = config.metric == IcpMetric::point_to_point;
    const Matrix6d h = is_of_points ? points.matrix() : equations.matrix();
    const Vector6d right_side = is_of_points ? points.right_side() : equations.right_side();
    information = h / std::max(1e-6, rms_m() * rms_m());
    const double lever_m = std::sqrt(h.bottomRightCorner<3, 3>().trace() / h.topLeftCorner<3, 3>().trace());
    Vector6d unit = Vector6d::Ones();
    unit.tail<3>().setConstant(1.0 / std::max(lever_m, 1e-6));
    const SymmetricEigen<6> eigen = symmetric_eigen<6>(unit.asDiagonal() * h * unit.asDiagonal());
    Step step;
    Vector6d twist = Vector6d::Zero();
    for (int i = 0; i < 6; ++i) {
      const Vector6d direction = unit.cwiseProduct(eigen.vectors.col(i));
      if (eigen.values[i] > static_cast<double>(config.degenerate_ratio) * eigen.values[5]) {
        twist += direction.dot(right_side) / eigen.values[i] * direction;
      } else if (step.weak_direction.isZero()) {
        step.weak_direction = direction.normalized();
      }
    }
    const bool in_closed_form = is_of_points && step.weak_direction.isZero();
    step.model_from_model = in_closed_form ? horn(points.pairs()) : exp_se3(twist);
    return step;
  }

  const IcpConfig& config;
  float scale_m;
  std::uint32_t count = 0;

 private:
  void add_residual(float squared_m2, float weight) {
    squared_sum_m2 += static_cast<double>(weight * squared_m2);
    weight_sum += static_cast<double>(weight);
  }

  NormalEquations equations;
  PointSums points;
  double squared_sum_m2 = 0;
  double weight_sum = 0;
};

}  // namespace

const char* text(IcpVerdict verdict) {
  switch (verdict) {
    case IcpVerdict::converged:
      return "converged";
    case IcpVerdict::iteration_limit:
      return "iteration limit";
    case IcpVerdict::too_few_correspondences:
      return "too few correspondences";
    case IcpVerdict::degenerate:
      return "degenerate geometry";
  }
  return "unknown verdict";
}

std::uint32_t Icp::gather(std::span<const IcpScan> data) {
  std::size_t offered = 0;
  for (const IcpScan& scan : data) offered += scan.samples.size();
  if (offered == 0 || data_.empty()) return 0;
  const std::size_t stride = (offered + data_.size() - 1) / data_.size();
  std::uint32_t count = 0;
  std::size_t number = 0;
  for (const IcpScan& scan : data) {
    const FloatTransform data_from_body(scan.side_from_body);
    for (const SurfaceSample& sample : scan.samples) {
      if (number++ % stride != 0) continue;
      DataPoint& point = data_[count++];
      point.point = data_from_body * scan.tree->point(sample.index);
      point.normal = data_from_body.rotate({sample.normal[0], sample.normal[1], sample.normal[2]});
      point.plane_weight = std::max(0.0F, 1.0F - sample.roughness / planar_roughness);
      point.model = maximum_model_scans;  // none
      point.nearest = Neighbor::none;
    }
  }
  return count;
}

// Near the end of a match points move by millimetres, and most of their neighbours stay the same. A search is
// spared where that is certain: the neighbour is nearer than any other point can have come since. The answers
// are those of the searches, to the bit.
void Icp::find_nearest(DataPoint& point, std::uint32_t m, const KdTree& tree, const Point& place,
                       float limit_m) {
  std::uint32_t hint = Neighbor::none;
  if (point.model == m) {
    const Point moved = place - point.asked;
    const float rounding_m = 1e-4F + 1e-6F * (std::abs(place.x) + std::abs(place.y) + std::abs(place.z));
    const float others_m = point.others_m - std::sqrt(dot(moved, moved)) - rounding_m;
    hint = point.nearest;
    if (hint == Neighbor::none) {
      if (limit_m < others_m) return;
    } else {
      const Point error_m = tree.point(hint) - place;
      const float squared_m2 = dot(error_m, error_m);
      if (squared_m2 < limit_m * limit_m && others_m > 0 && squared_m2 < others_m * others_m) return;
    }
  }
  float others_m2 = 0;
  point.nearest = tree.nearest(place, limit_m * limit_m, hint, others_m2).index;
  point.model = m;
  point.asked = place;
  point.others_m = std::sqrt(others_m2);
}

IcpResult Icp::match(std::span<const IcpScan> model, std::span<const IcpScan> data,
                     const Pose& initial_model_from_data, const IcpConfig& config,
                     std::span<IcpIteration> trace) {
  IcpResult result;
  result.model_from_data = initial_model_from_data;
  if (model.empty() || model.size() > maximum_model_scans) return result;
  const std::span<DataPoint> points = data_.first(gather(data));
  std::array<FloatTransform, maximum_model_scans> model_from_body;
  for (std::size_t m = 0; m < model.size(); ++m) model_from_body[m] = FloatTransform(model[m].side_from_body);

  float limit_m = config.first_distance_limit_m;
  float scale_m = 0;  // of the robust weights: follows the residuals down
  const bool has_planes = config.metric == IcpMetric::surface;
  result.verdict = IcpVerdict::iteration_limit;
  for (std::uint32_t iteration = 0; iteration < config.maximum_iterations; ++iteration) {
    const bool is_fine = limit_m <= config.last_distance_limit_m;
    const std::size_t stride = is_fine ? 1 : std::max<std::uint32_t>(1, config.coarse_stride);
    const FloatTransform model_from_data(result.model_from_data);
    std::array<FloatTransform, maximum_model_scans> body_from_data;
    for (std::size_t m = 0; m < model.size(); ++m) {
      body_from_data[m] = FloatTransform(model[m].side_from_body.inverse() * result.model_from_data);
    }

    Minimizer minimizer(config, scale_m);
    result.queries = 0;
    for (std::size_t i = 0; i < points.size(); i += stride) {
      DataPoint& point = points[i];
      const auto m = static_cast<std::uint32_t>((i / stride) % model.size());  // the model's scans in turn
      find_nearest(point, m, *model[m].tree, body_from_data[m] * point.point, limit_m);
      ++result.queries;
      if (point.nearest == Neighbor::none) continue;
      const Point target = model_from_body[m] * model[m].tree->point(point.nearest);
      const Point place = model_from_data * point.point;
      if (has_planes) {
        minimizer.add(target, place, model_from_data.rotate(point.normal), point.plane_weight);
      } else {
        minimizer.add(target, place);
      }
    }
    result.iterations = iteration + 1;
    result.correspondences = minimizer.count;
    result.overlap = result.queries > 0 ? static_cast<double>(minimizer.count) / result.queries : 0;
    result.rms_m = minimizer.rms_m();
    if (minimizer.count * stride < config.minimum_correspondences) {
      result.verdict = IcpVerdict::too_few_correspondences;
      result.model_from_data = initial_model_from_data;
      return result;
    }

    const Step step = minimizer.solve(result.information);
    const Pose moved = step.model_from_model * result.model_from_data;
    const double moved_m = (moved.translation_m - result.model_from_data.translation_m).norm();
    const double turned_rad = angle_between_rad(moved.rotation, result.model_from_data.rotation);
    if (iteration < trace.size())
      trace[iteration] = {limit_m, minimizer.count, result.rms_m, moved_m, turned_rad};
    result.model_from_data = moved;
    result.weak_direction = step.weak_direction;
    const bool is_still = moved_m < static_cast<double>(config.translation_epsilon_m) &&
                          turned_rad < static_cast<double>(config.rotation_epsilon_rad);
    if (is_still && is_fine) {
      result.verdict = IcpVerdict::converged;
      break;
    }
    limit_m = std::max(config.last_distance_limit_m, limit_m * config.limit_factor);
    if (config.robust_factor > 0) {
      scale_m = std::max(config.robust_scale_m, config.robust_factor * static_cast<float>(result.rms_m));
    }
  }
  if (!result.weak_direction.isZero()) result.verdict = IcpVerdict::degenerate;

  std::uint32_t fitting = 0;
  Moments moments;  // of the last iteration's correspondences, at the pose they led to
  const FloatTransform model_from_data(result.model_from_data);
  for (const DataPoint& point : points) {
    if (point.nearest == Neighbor::none) continue;
    const Point q = model_from_data * point.point;
    const Point error_m = model_from_body[point.model] * model[point.model].tree->point(point.nearest) - q;
    moments.add(q, error_m);
    const float off_m = point.plane_weight > 0 ? dot(model_from_data.rotate(point.normal), error_m)
                                               : std::sqrt(dot(error_m, error_m));
    if (std::abs(off_m) < config.fit_distance_m) ++fitting;
  }
  if (!points.empty()) result.fit = static_cast<double>(fitting) / static_cast<double>(points.size());
  result.sums = moments.sums();
  return result;
}

}  // namespace alces
