#include "alces/icp.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "alces/symmetric_eigen.h"
#include "alces/symmetric_solve.h"

namespace alces {
namespace {

struct FloatTransform {
  Eigen::Matrix3f rotation;
  Eigen::Vector3f translation;

  explicit FloatTransform(const Pose& pose = Pose{})
      : rotation(pose.rotation.toRotationMatrix().cast<float>()), translation(pose.translation_m.cast<float>()) {}
  Eigen::Vector3f operator*(const Eigen::Vector3f& p) const { return rotation * p + translation; }
};

Point as_point(const Eigen::Vector3f& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3f as_vector(const Point& p) { return {p.x, p.y, p.z}; }

// Normal equations of the surface metric: J^T W J x = J^T W e, x = (translation, rotation vector).
struct NormalEquations {
  Matrix6d h = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();

  void add_plane(const Eigen::Vector3f& q, const Eigen::Vector3f& n, float error, float weight) {
    Eigen::Matrix<float, 6, 1> j;
    j << n, q.cross(n);
    const Eigen::Matrix<float, 6, 1> wj = weight * j;
    for (int c = 0; c < 6; ++c) {
      for (int r = c; r < 6; ++r) h(r, c) += static_cast<double>(wj[r] * j[c]);
      b[c] += static_cast<double>(wj[c] * error);
    }
  }
  void add_point(const Eigen::Vector3f& q, const Eigen::Vector3f& error, float weight) {
    // J = [ I | -[q]x ]
    const float w = weight;
    for (int i = 0; i < 3; ++i) h(i, i) += static_cast<double>(w);
    const Eigen::Vector3f wq = w * q;
    h(4, 0) += static_cast<double>(wq.z());
    h(5, 0) += static_cast<double>(-wq.y());
    h(3, 1) += static_cast<double>(-wq.z());
    h(5, 1) += static_cast<double>(wq.x());
    h(3, 2) += static_cast<double>(wq.y());
    h(4, 2) += static_cast<double>(-wq.x());
    h(3, 3) += static_cast<double>(wq.y() * q.y() + wq.z() * q.z());
    h(4, 4) += static_cast<double>(wq.x() * q.x() + wq.z() * q.z());
    h(5, 5) += static_cast<double>(wq.x() * q.x() + wq.y() * q.y());
    h(4, 3) += static_cast<double>(-wq.x() * q.y());
    h(5, 3) += static_cast<double>(-wq.x() * q.z());
    h(5, 4) += static_cast<double>(-wq.y() * q.z());
    const Eigen::Vector3f torque = q.cross(error);
    for (int i = 0; i < 3; ++i) {
      b[i] += static_cast<double>(w * error[i]);
      b[3 + i] += static_cast<double>(w * torque[i]);
    }
  }
  void complete() { h.triangularView<Eigen::StrictlyUpper>() = h.transpose(); }
};

}  // namespace

const char* text(IcpVerdict verdict) {
  switch (verdict) {
    case IcpVerdict::converged: return "converged";
    case IcpVerdict::iteration_limit: return "iteration limit";
    case IcpVerdict::too_few_correspondences: return "too few correspondences";
    case IcpVerdict::degenerate: return "degenerate geometry";
  }
  return "unknown verdict";
}

Pose horn(const HornSums& sums) {
  const Eigen::Vector3d model_mean = sums.model / sums.weight;
  const Eigen::Vector3d data_mean = sums.data / sums.weight;
  const Eigen::Matrix3d s = sums.data_model / sums.weight - data_mean * model_mean.transpose();
  Eigen::Matrix4d n;
  n << s(0, 0) + s(1, 1) + s(2, 2), s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0),  //
      0, s(0, 0) - s(1, 1) - s(2, 2), s(0, 1) + s(1, 0), s(2, 0) + s(0, 2),                    //
      0, 0, -s(0, 0) + s(1, 1) - s(2, 2), s(1, 2) + s(2, 1),                                   //
      0, 0, 0, -s(0, 0) - s(1, 1) + s(2, 2);
  n.triangularView<Eigen::StrictlyLower>() = n.transpose();
  const Eigen::Vector4d q = symmetric_eigen<4>(n).vectors.col(3);
  Pose model_from_data;
  model_from_data.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
  model_from_data.translation_m = model_mean - model_from_data.rotation * data_mean;
  return model_from_data;
}

IcpResult Icp::match(std::span<const IcpScan> model, std::span<const IcpScan> data, const Pose& initial_model_from_data,
                     const IcpConfig& config, std::span<IcpIteration> trace) {
  IcpResult result;
  result.model_from_data = initial_model_from_data;
  const auto model_count = static_cast<std::uint32_t>(std::min<std::size_t>(model.size(), maximum_model_scans));
  if (model_count == 0) return result;

  // The data's samples, once, in the data frame.
  std::size_t offered = 0;
  for (const IcpScan& scan : data) offered += scan.samples.size();
  const std::size_t stride = std::max<std::size_t>(1, (offered + data_.size() - 1) / std::max<std::size_t>(1, data_.size()));
  std::uint32_t count = 0;
  std::size_t number = 0;
  for (const IcpScan& scan : data) {
    const FloatTransform data_from_body(scan.side_from_body);
    for (const SurfaceSample& sample : scan.samples) {
      if (number++ % stride != 0) continue;
      DataPoint& point = data_[count++];
      point.point = data_from_body * as_vector(scan.tree->point(sample.index));
      point.normal = data_from_body.rotation * Eigen::Map<const Eigen::Vector3f>(sample.normal);
      point.plane_weight = sample.roughness < 1 ? std::max(0.0F, 1.0F - 5.0F * sample.roughness) : 0.0F;
      point.hint = Neighbor::none;
    }
  }
  const std::span<DataPoint> points = data_.first(count);
  std::array<FloatTransform, maximum_model_scans> model_from_body;
  for (std::uint32_t m = 0; m < model_count; ++m) model_from_body[m] = FloatTransform(model[m].side_from_body);

  const std::uint32_t queries_per_sample = std::clamp(config.queries_per_sample, 1U, model_count);
  float limit_m = config.first_distance_limit_m;
  float scale_m = 0;  // of the robust weights: follows the residuals down
  bool is_last = false;
  for (std::uint32_t iteration = 0; iteration < config.maximum_iterations; ++iteration) {
    const FloatTransform model_from_data(result.model_from_data);
    std::array<FloatTransform, maximum_model_scans> body_from_data;
    for (std::uint32_t m = 0; m < model_count; ++m) {
      body_from_data[m] = FloatTransform(model[m].side_from_body.inverse() * result.model_from_data);
    }
    NormalEquations equations;
    HornSums horn_sums;
    IcpSums sums;
    double squared_sum_m2 = 0;
    double weight_sum = 0;
    std::uint32_t queries = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      DataPoint& point = points[i];
      for (std::uint32_t turn = 0; turn < queries_per_sample; ++turn) {
        const std::uint32_t m = (i + turn * (model_count / queries_per_sample)) % model_count;
        ++queries;
        const std::uint32_t hint = queries_per_sample == 1 ? point.hint : Neighbor::none;
        const Neighbor nearest = model[m].tree->nearest(as_point(body_from_data[m] * point.point), limit_m * limit_m, hint);
        point.hint = nearest.index;
        if (nearest.index == Neighbor::none) continue;
        const Eigen::Vector3f target = model_from_body[m] * as_vector(model[m].tree->point(nearest.index));
        const Eigen::Vector3f q = model_from_data * point.point;
        const Eigen::Vector3f error = target - q;
        ++sums.count;
        if (config.metric == IcpMetric::point_to_point) {
          const float squared_m2 = error.squaredNorm();
          float weight = 1;
          if (scale_m > 0) {
            const float ratio = squared_m2 / (scale_m * scale_m);
            weight = 1.0F / ((1.0F + ratio) * (1.0F + ratio));
          }
          horn_sums.add(target.cast<double>(), q.cast<double>(), static_cast<double>(weight));
          squared_sum_m2 += static_cast<double>(weight * squared_m2);
          weight_sum += static_cast<double>(weight);
          equations.add_point(q, error, weight);
        } else {
          const Eigen::Vector3f normal = model_from_data.rotation * point.normal;
          const float along_m = normal.dot(error);
          const float rough_m2 = error.squaredNorm();
          const float squared_m2 = point.plane_weight > 0 ? along_m * along_m : rough_m2;
          float weight = 1;
          if (scale_m > 0) {
            const float ratio = squared_m2 / (scale_m * scale_m);
            weight = 1.0F / ((1.0F + ratio) * (1.0F + ratio));
          }
          if (point.plane_weight > 0) {
            equations.add_plane(q, normal, along_m, weight * point.plane_weight);
            squared_sum_m2 += static_cast<double>(weight * point.plane_weight * along_m * along_m);
            weight_sum += static_cast<double>(weight * point.plane_weight);
          }
          if (config.rough_weight > 0) equations.add_point(q, error, weight * config.rough_weight);
        }
      }
    }
    result.iterations = iteration + 1;
    result.queries = queries;
    result.correspondences = sums.count;
    result.overlap = queries > 0 ? static_cast<double>(sums.count) / queries : 0;
    result.rms_m = weight_sum > 0 ? std::sqrt(squared_sum_m2 / weight_sum) : 0;
    if (sums.count < config.minimum_correspondences) {
      result.verdict = IcpVerdict::too_few_correspondences;
      result.model_from_data = initial_model_from_data;
      return result;
    }
    equations.complete();
    result.information = equations.h / std::max(1e-6, result.rms_m * result.rms_m);

    Pose step;
    if (config.metric == IcpMetric::point_to_point) {
      step = horn(horn_sums);
    } else {
      step = exp_se3(SymmetricSolver<6>(equations.h).solve(equations.b));
    }
    result.model_from_data = step * result.model_from_data;
    const double turned_rad = angle_between_rad(step.rotation, Eigen::Quaterniond::Identity());
    // how far the body itself went, not the frame's origin
    const double moved_m = (step * result.model_from_data.translation_m - result.model_from_data.translation_m).norm();
    if (iteration < trace.size()) trace[iteration] = {limit_m, sums.count, result.rms_m, moved_m, turned_rad};
    const bool still = moved_m < static_cast<double>(config.translation_epsilon_m) &&
                       turned_rad < static_cast<double>(config.rotation_epsilon_rad);
    if (still && is_last) {
      result.verdict = IcpVerdict::converged;
      return result;
    }
    is_last = limit_m <= config.last_distance_limit_m;
    limit_m = std::max(config.last_distance_limit_m, limit_m * config.limit_factor);
    if (config.robust_scale_m > 0) {
      scale_m = std::max(config.robust_scale_m, 3.0F * static_cast<float>(result.rms_m));
    }
  }
  result.verdict = IcpVerdict::iteration_limit;
  return result;
}

}  // namespace alces
