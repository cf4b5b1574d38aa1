#include "link_sums.h"

#include <algorithm>
#include <cmath>

#include "alces/symmetric_eigen.h"

namespace alces::offline {
namespace {

constexpr float planar_roughness = 0.2F;  // at and above, a sample has no plane

// Geman-McClure: residuals well above the scale count little.
double robust_weight(double squared_m2, double scale_m) {
  if (!(scale_m > 0)) return 1;
  const double ratio = 1 + squared_m2 / (scale_m * scale_m);
  return 1 / (ratio * ratio);
}

Eigen::Vector3f float_vector(const Point& p) {
  return {p.x, p.y, p.z};
}

class Summation {
 public:
  // One row: the residual e along n at the place p.
  void add_row(const Eigen::Vector3d& p, const Eigen::Vector3d& n, double e, double weight) {
    const Eigen::Vector3d turn = p.cross(n);
    const double row[6] = {n.x(), n.y(), n.z(), turn.x(), turn.y(), turn.z()};
    std::size_t at = 0;
    for (std::size_t r = 0; r < 6; ++r) {
      const double weighted = weight * row[r];
      for (std::size_t c = r; c < 6; ++c) sums.mtm[at++] += weighted * row[c];
      sums.mtz[r] += weighted * e;
    }
    sums.ztz_m2 += weight * e * e;
  }
  void add_point(const Eigen::Vector3d& p, const Eigen::Vector3d& error, double weight) {
    add_row(p, Eigen::Vector3d::UnitX(), error.x(), weight);
    add_row(p, Eigen::Vector3d::UnitY(), error.y(), weight);
    add_row(p, Eigen::Vector3d::UnitZ(), error.z(), weight);
  }
  LinkSums sums;
};

// One end's view: a body and where it lies about the middle.
struct End {
  const PreparedScan& scan;
  Eigen::Matrix3f rotation;
  Eigen::Vector3f place_m;

  End(const PreparedScan& prepared, const Pose& map_from_body, const Eigen::Vector3d& middle)
      : scan(prepared),
        rotation(map_from_body.rotation.toRotationMatrix().cast<float>()),
        place_m((map_from_body.translation_m - middle).cast<float>()) {}
};

// Samples of `asking` find their nearest points in `asked`; `sign` is +1 where asking is j.
void sum_one_way(const End& asking, const End& asked, const Pose& asked_from_asking, double sign,
                 const LinkPass& pass, const LumSettings& settings, Summation& summation) {
  const Eigen::Matrix3f rotation = asked_from_asking.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f translation_m = asked_from_asking.translation_m.cast<float>();
  const float limit_m2 = pass.distance_limit_m * pass.distance_limit_m;
  const auto scale_m = static_cast<double>(pass.robust_scale_m);
  const auto rough_weight = static_cast<double>(settings.rough_weight);
  const std::span<const SurfaceSample> samples = asking.scan.samples();
  std::uint32_t hint = Neighbor::none;  // samples follow the tree's order: the last answer is near the next
  for (std::size_t i = 0; i < samples.size(); i += pass.stride) {
    const SurfaceSample& sample = samples[i];
    const Eigen::Vector3f body_point = float_vector(asking.scan.tree().point(sample.index));
    const Eigen::Vector3f query = rotation * body_point + translation_m;
    ++summation.sums.queries;
    const Neighbor nearest = asked.scan.tree().nearest({query.x(), query.y(), query.z()}, limit_m2, hint);
    if (nearest.index == Neighbor::none) continue;
    hint = nearest.index;
    ++summation.sums.correspondences;
    const Eigen::Vector3f p = asking.rotation * body_point + asking.place_m;
    const Eigen::Vector3f q =
        asked.rotation * float_vector(asked.scan.tree().point(nearest.index)) + asked.place_m;
    const Eigen::Vector3d error = sign * (q - p).cast<double>();
    const Eigen::Vector3d place = p.cast<double>();
    const double plane_weight =
        static_cast<double>(std::max(0.0F, 1.0F - sample.roughness / planar_roughness));
    if (settings.metric == LumMetric::plane && plane_weight > 0) {
      const Eigen::Vector3d normal =
          (asking.rotation * Eigen::Map<const Eigen::Vector3f>(sample.normal)).cast<double>();
      const double along_m = normal.dot(error);
      const double weight = plane_weight * robust_weight(along_m * along_m, scale_m);
      summation.add_row(place, normal, along_m, weight);
      summation.sums.weight += weight;
    } else {
      double weight = robust_weight(error.squaredNorm(), scale_m);
      if (settings.metric == LumMetric::plane) weight *= rough_weight;
      summation.add_point(place, error, weight);
      summation.sums.weight += weight;
    }
  }
}

}  // namespace

Matrix6d LinkSums::information_sum() const {
  Matrix6d matrix;
  std::size_t at = 0;
  for (Eigen::Index r = 0; r < 6; ++r)
    for (Eigen::Index c = r; c < 6; ++c) matrix(r, c) = matrix(c, r) = mtm[at++];
  return matrix;
}

Vector6d LinkSums::right_side() const {
  return Eigen::Map<const Vector6d>(mtz);
}

double LinkSums::overlap() const {
  return queries > 0 ? static_cast<double>(correspondences) / queries : 0;
}

Eigen::Vector3d middle_of(const Pose& map_from_j, const Pose& map_from_k) {
  return 0.5 * (map_from_j.translation_m + map_from_k.translation_m);
}

Matrix6d middle_from_change(const Pose& map_from_body, const Eigen::Vector3d& middle) {
  // A point at rest with the body at `middle` moves by t + w x (middle - place).
  const Eigen::Vector3d d = middle - map_from_body.translation_m;
  Matrix6d h = Matrix6d::Identity();
  h.topRightCorner<3, 3>() << 0, d.z(), -d.y(), -d.z(), 0, d.x(), d.y(), -d.x(), 0;
  return h;
}

LinkSums sum_link(const PreparedScan& scan_j, const Pose& map_from_j, const PreparedScan& scan_k,
                  const Pose& map_from_k, const LinkPass& pass, const LumSettings& settings) {
  Summation summation;
  const Eigen::Vector3d middle = middle_of(map_from_j, map_from_k);
  const End j(scan_j, map_from_j, middle);
  const End k(scan_k, map_from_k, middle);
  const Pose k_from_j = map_from_k.inverse() * map_from_j;
  if (scan_j.size() == 0 || scan_k.size() == 0) return summation.sums;
  sum_one_way(j, k, k_from_j, 1, pass, settings, summation);
  sum_one_way(k, j, k_from_j.inverse(), -1, pass, settings, summation);
  return summation.sums;
}

LinkEstimate estimate_link(const LinkSums& sums, const LumSettings& settings, std::uint32_t stride) {
  LinkEstimate link;
  link.is_usable = std::uint64_t{sums.correspondences} * stride >= settings.minimum_correspondences &&
                   sums.overlap() >= settings.minimum_overlap && sums.weight > 0;
  if (!link.is_usable) return link;
  const Matrix6d mtm = sums.information_sum();
  const Vector6d mtz = sums.right_side();
  // E in the directions that the correspondences determine: radians weighed by the points' typical distance.
  const double lever_m =
      std::sqrt(mtm.bottomRightCorner<3, 3>().trace() / std::max(1e-12, mtm.topLeftCorner<3, 3>().trace()));
  Vector6d unit = Vector6d::Ones();
  unit.tail<3>().setConstant(1 / std::max(lever_m, 1e-6));
  const SymmetricEigen<6> eigen = symmetric_eigen<6>(unit.asDiagonal() * mtm * unit.asDiagonal());
  constexpr double degenerate_ratio = 1e-3;
  for (int i = 0; i < 6; ++i) {
    if (!(eigen.values[i] > degenerate_ratio * eigen.values[5])) continue;
    const Vector6d direction = unit.cwiseProduct(eigen.vectors.col(i));
    link.offset += direction.dot(mtz) / eigen.values[i] * direction;
  }
  const double explained_m2 = std::max(0.0, link.offset.dot(mtz));
  link.pull_m = std::sqrt(explained_m2 / sums.weight);
  link.rms_m = std::sqrt(std::max(0.0, sums.ztz_m2) / sums.weight);
  const double left_m2 = std::max(0.0, sums.ztz_m2 - explained_m2);
  constexpr double least_m = 1e-4;  // two copies of one scan agree exactly: sure, but not infinitely
  const double floor_m2 = std::max(least_m * least_m, settings.variance_floor_m * settings.variance_floor_m);
  const double count = 2.0 * sums.correspondences - 3.0;
  link.variance_m2 = left_m2 / (settings.metric == LumMetric::point ? count : sums.weight) + floor_m2;
  // With a stride each correspondence stands for that many.
  const double share = static_cast<double>(stride) / link.variance_m2;
  link.information = share * mtm;
  link.right_side = share * mtz;
  return link;
}

}  // namespace alces::offline
