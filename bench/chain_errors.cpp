#include "chain_errors.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace alces::bench {
namespace {

constexpr std::size_t most_chains = 60;  // of a length

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// What a small movement (translation, rotation) about a place does at the end of a lever.
Matrix6d carried(const Eigen::Vector3d& lever) {
  Matrix6d jacobian = Matrix6d::Identity();
  jacobian.topRightCorner<3, 3>() = -skew(lever);
  return jacobian;
}

Matrix6d spread(const Matrix6d& jacobian, const Vector6d& variance) {
  return jacobian * variance.asDiagonal() * jacobian.transpose();
}

/// What a label says of its edge's translation, at the end of a lever.
Matrix6d translation_spread(const Matrix6d& jacobian, const EdgeVariance& v, const Pose& map_from_to) {
  Matrix6d covariance = Matrix6d::Zero();
  covariance.topLeftCorner<3, 3>() = translation_covariance(v, map_from_to.rotation);
  return jacobian * covariance * jacobian.transpose();
}

/// The same of its rotation.
Matrix6d rotation_spread(const Matrix6d& jacobian, const EdgeVariance& v, const Pose& map_from_to) {
  Matrix6d covariance = Matrix6d::Zero();
  covariance.bottomRightCorner<3, 3>() = rotation_covariance(v, map_from_to.rotation);
  return jacobian * covariance * jacobian.transpose();
}

/// Error of the pose of `to` seen from `from`, on the map's axes.
Vector6d error_between(const MatchedDrive& drive, std::size_t from, std::size_t to) {
  const Pose matched = drive.poses[from].inverse() * drive.poses[to];
  const Pose truth = drive.truth[from].inverse() * drive.truth[to];
  const Eigen::Quaterniond& axes = drive.poses[from].rotation;
  Vector6d error;
  error.head<3>() = axes * (matched.translation_m - truth.translation_m);
  error.tail<3>() = axes * log_so3(matched.rotation * truth.rotation.conjugate());
  return error;
}

}  // namespace

ChainErrors::ChainErrors(const MatchedDrive& drive) : name_(drive.name), group_(drive.group) {
  const std::size_t scans = drive.poses.size();
  const Vector6d ones_t = (Vector6d() << 1, 1, 1, 0, 0, 0).finished();
  const Vector6d ones_r = (Vector6d() << 0, 0, 0, 1, 1, 1).finished();
  for (std::size_t index = 0; index < chain_lengths.size(); ++index) {
    const std::size_t length = chain_lengths[index];
    if (length >= scans) continue;
    const std::size_t possible = scans - length;
    const std::size_t count = std::min(length == 1 ? possible : most_chains, possible);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t begin = k * possible / count;
      const std::size_t end = begin + length;
      Chain chain;
      for (Matrix6d& part : chain.parts) part.setZero();
      chain.error = error_between(drive, begin, end);
      Matrix6d way = Matrix6d::Zero();
      for (std::size_t i = begin; i < end; ++i) {
        const Matrix6d jacobian = carried(drive.poses[end].translation_m - drive.poses[i + 1].translation_m);
        const EdgeVariance& label = drive.edges[i].variance;
        chain.parts[LabelFit::translation] += translation_spread(jacobian, label, drive.poses[i + 1]);
        chain.parts[LabelFit::rotation] += rotation_spread(jacobian, label, drive.poses[i + 1]);
        chain.parts[LabelFit::step_m2] += spread(jacobian, ones_t);
        chain.parts[LabelFit::step_rad2] += spread(jacobian, ones_r);
        way += drive.edges[i].from_from_to.translation_m.norm() * jacobian;
      }
      chain.parts[LabelFit::way_m2] = spread(way, ones_t);
      chain.parts[LabelFit::way_rad2] = spread(way, ones_r);
      const EdgeVariance& last = drive.edges[end - 1].variance;
      chain.end_parts = {translation_spread(Matrix6d::Identity(), last, drive.poses[end]),
                         rotation_spread(Matrix6d::Identity(), last, drive.poses[end])};
      chains_[index].push_back(chain);
    }
  }
  for (const Chain& step : chains_[0]) {
    const Vector6d variance = (step.parts[LabelFit::translation] + step.parts[LabelFit::rotation]).diagonal();
    step_ratios_.head<3>() += step.error.head<3>().cwiseAbs2().cwiseQuotient(variance.head<3>());
    step_ratios_[3] += step.error.tail<3>().squaredNorm() / variance.tail<3>().sum();
  }
  if (!chains_[0].empty()) step_ratios_ = (step_ratios_ / static_cast<double>(chains_[0].size())).cwiseSqrt();
}

Eigen::Vector4d ChainErrors::step_ratios() const {
  return step_ratios_;
}

ChainErrors::Nees ChainErrors::nees(std::size_t length_index, const LabelFit& fit) const {
  Nees nees;
  const auto& value = fit.value;
  for (const Chain& chain : chains_[length_index]) {
    Matrix6d s = Matrix6d::Zero();
    for (std::size_t part = 0; part + 1 < LabelFit::size; ++part) s += value[part] * chain.parts[part];
    s += value[LabelFit::ends] *
         (value[LabelFit::translation] * chain.end_parts[0] + value[LabelFit::rotation] * chain.end_parts[1]);
    const Vector6d& e = chain.error;
    nees.all += e.dot(s.ldlt().solve(e)) / 6;
    const Eigen::Matrix3d st = s.topLeftCorner<3, 3>();
    const Eigen::Matrix3d sr = s.bottomRightCorner<3, 3>();
    nees.translation += e.head<3>().dot(st.ldlt().solve(e.head<3>())) / 3;
    nees.rotation += e.tail<3>().dot(sr.ldlt().solve(e.tail<3>())) / 3;
  }
  nees.chains = chains_[length_index].size();
  if (nees.chains == 0) return nees;
  const auto count = static_cast<double>(nees.chains);
  nees.all /= count;
  nees.translation /= count;
  nees.rotation /= count;
  return nees;
}

LabelFit fit_labels(std::span<const ChainErrors> drives, const std::string& left_out) {
  const auto cost = [&](const LabelFit& fit) {
    double sum = 0;
    for (const ChainErrors& drive : drives) {
      if (drive.group() == left_out) continue;
      for (std::size_t length = 0; length < chain_lengths.size(); ++length) {
        const ChainErrors::Nees nees = drive.nees(length, fit);
        if (nees.chains == 0) continue;
        for (const double ratio : {nees.translation, nees.rotation}) sum += std::log(ratio) * std::log(ratio);
      }
    }
    return sum;
  };
  // One number after the other, up and down by a factor that shrinks. A part that is not needed ends at
  // nothing.
  LabelFit best;
  best.value = {1, 1, 1e-7, 1e-8, 1e-10, 1e-12, 0.1};
  double best_cost = cost(best);
  for (double factor = 10; factor > 1.15;) {
    bool is_better = false;
    for (std::size_t part = 0; part < LabelFit::size; ++part) {
      for (const double by : {factor, 1 / factor}) {
        LabelFit next = best;
        next.value[part] *= by;
        const double next_cost = cost(next);
        if (next_cost >= best_cost) continue;
        best = next;
        best_cost = next_cost;
        is_better = true;
        break;
      }
    }
    if (!is_better) factor = std::sqrt(factor);
  }
  return best;
}

}  // namespace alces::bench
