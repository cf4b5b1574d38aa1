#include "alces/icp.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "alces/symmetric_eigen.h"
#include "alces/symmetric_solve.h"

namespace alces {
namespace {

struct FloatTransform {
  float r[9];  // rows
  float t[3];

  explicit FloatTransform(const Pose& pose = Pose{}) {
    const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column)
        r[3 * row + column] = static_cast<float>(rotation(row, column));
      t[row] = static_cast<float>(pose.translation_m[row]);
    }
  }
  [[nodiscard]] Point rotate(const Point& p) const {
    return {r[0] * p.x + r[1] * p.y + r[2] * p.z, r[3] * p.x + r[4] * p.y + r[5] * p.z,
            r[6] * p.x + r[7] * p.y + r[8] * p.z};
  }
  Point operator*(const Point& p) const {
    const Point q = rotate(p);
    return {q.x + t[0], q.y + t[1], q.z + t[2]};
  }
};

Point operator-(const Point& a, const Point& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
float dot(const Point& a, const Point& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
Point cross(const Point& a, const Point& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Eigen::Vector3d as_vector(const Point& p) {
  return {static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)};
}

// Normal equations J^T W J x = J^T W e, x = (translation, rotation vector), J = [ I | -[q]x ] or its part
// along a normal. Rows are summed in float, four lanes at a time, and carried into double before float loses
// digits.
class NormalEquations {
 public:
  void add_plane(const Point& q, const Point& n, float error_m, float weight) {
    const Point turn = cross(q, n);
    const Lanes low = {n.x, n.y, n.z, turn.x};
    const Lanes high = {turn.y, turn.z, error_m, 0};
    const Lanes weighted_low = weight * low;
    const Lanes weighted_high = weight * high;
    for (int row = 0; row < 4; ++row) {
      low_[row] += weighted_low[row] * low;
      high_[row] += weighted_low[row] * high;
    }
    for (int row = 4; row < 6; ++row) {
      low_[row] += weighted_high[row - 4] * low;
      high_[row] += weighted_high[row - 4] * high;
    }
    if (++pending_ == carry_after) carry();
  }
  void add_point(const Point& q, const Point& error_m, float weight) {
    add_plane(q, {1, 0, 0}, error_m.x, weight);
    add_plane(q, {0, 1, 0}, error_m.y, weight);
    add_plane(q, {0, 0, 1}, error_m.z, weight);
  }
  void carry() {
    for (int row = 0; row < 6; ++row) {
      for (int column = 0; column < 4; ++column) h_(row, column) += static_cast<double>(low_[row][column]);
      for (int column = 4; column < 6; ++column)
        h_(row, column) += static_cast<double>(high_[row][column - 4]);
      b_[row] += static_cast<double>(high_[row][2]);
      low_[row] = Lanes{};
      high_[row] = Lanes{};
    }
    pending_ = 0;
  }
  /// Both after carry().
  [[nodiscard]] Matrix6d matrix() const { return 0.5 * (h_ + h_.transpose()); }
  [[nodiscard]] const Vector6d& right_side() const { return b_; }

 private:
  typedef float Lanes __attribute__((vector_size(16)));
  static constexpr std::uint32_t carry_after = 32;
  Lanes low_[6] = {};   // of each row: columns 0 to 3
  Lanes high_[6] = {};  // columns 4, 5 and the right side
  std::uint32_t pending_ = 0;
  Matrix6d h_ = Matrix6d::Zero();
  Vector6d b_ = Vector6d::Zero();
};

// Weighted sums over correspondences of whole points: what Horn's closed form needs, and the same normal
// equations as rows of points would give, in the time of one row instead of three. Summed as there.
class PointSums {
 public:
  void add(const Point& q, const Point& error_m, float weight) {
    const Lanes place = {q.x, q.y, q.z, 1};
    const Lanes error = {error_m.x, error_m.y, error_m.z, 0};
    const Lanes weighted = weight * place;
    for (int row = 0; row < 4; ++row) {
      place_[row] += weighted[row] * place;
      error_[row] += weighted[row] * error;
    }
    if (++pending_ == carry_after) carry();
  }
  void carry() {
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column)
        places_(row, column) += static_cast<double>(place_[row][column]);
      for (int column = 0; column < 3; ++column)
        errors_(row, column) += static_cast<double>(error_[row][column]);
      place_[row] = Lanes{};
      error_[row] = Lanes{};
    }
    pending_ = 0;
  }
  /// All after carry(). Sums of w (target, q); target = q + error.
  [[nodiscard]] HornSums pairs() const {
    const Eigen::Vector3d place = places_.bottomLeftCorner<1, 3>().transpose();
    return {places_(3, 3), place + errors_.row(3).transpose(), place,
            places_.topLeftCorner<3, 3>() + errors_.topRows<3>()};
  }
  [[nodiscard]] Matrix6d matrix() const {  // rows [ I | -[q]x ]
    const Eigen::Matrix3d products = places_.topLeftCorner<3, 3>();
    const double x = places_(3, 0);
    const double y = places_(3, 1);
    const double z = places_(3, 2);
    Eigen::Matrix3d cross_sum;
    cross_sum << 0, -z, y, z, 0, -x, -y, x, 0;
    Matrix6d h;
    h.topLeftCorner<3, 3>() = places_(3, 3) * Eigen::Matrix3d::Identity();
    h.bottomLeftCorner<3, 3>() = cross_sum;
    h.topRightCorner<3, 3>() = -cross_sum;
    h.bottomRightCorner<3, 3>() = products.trace() * Eigen::Matrix3d::Identity() - products;
    return h;
  }
  [[nodiscard]] Vector6d right_side() const {  // the torque q x e is the antisymmetric part of q e^T
    Vector6d b;
    b << errors_.row(3).transpose(), errors_(1, 2) - errors_(2, 1), errors_(2, 0) - errors_(0, 2),
        errors_(0, 1) - errors_(1, 0);
    return b;
  }

 private:
  typedef float Lanes __attribute__((vector_size(16)));
  static constexpr std::uint32_t carry_after = 32;
  Lanes place_[4] = {};  // of w (q, 1) (q, 1)^T
  Lanes error_[4] = {};  // of w (q, 1) (error, 0)^T
  std::uint32_t pending_ = 0;
  Eigen::Matrix4d places_ = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 4, 3> errors_ = Eigen::Matrix<double, 4, 3>::Zero();
};

// Moments of the correspondences, from which Appendix A's sums follow.
struct Moments {
  std::uint32_t count = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  double products[6] = {};  // xx xy xz yy yz zz of the points
  double squared_m2 = 0;

  void add(const Point& q, const Point& error_m) {
    ++count;
    point += as_vector(q);
    residual += as_vector(error_m);
    torque += as_vector(cross(q, error_m));
    const float terms[6] = {q.x * q.x, q.x * q.y, q.x * q.z, q.y * q.y, q.y * q.z, q.z * q.z};
    for (int i = 0; i < 6; ++i) products[i] += static_cast<double>(terms[i]);
    squared_m2 += static_cast<double>(dot(error_m, error_m));
  }
  [[nodiscard]] IcpSums sums() const {  // rows M_i = [ I | -[q]x ]
    IcpSums sums;
    sums.count = count;
    sums.mtz << residual, torque;
    sums.ztz_m2 = squared_m2;
    Eigen::Matrix3d cross_sum;
    cross_sum << 0, -point.z(), point.y(), point.z(), 0, -point.x(), -point.y(), point.x(), 0;
    Eigen::Matrix3d product_sum;
    product_sum << products[0], products[1], products[2], products[1], products[3], products[4], products[2],
        products[4], products[5];
    sums.mtm.topLeftCorner<3, 3>() = count * Eigen::Matrix3d::Identity();
    sums.mtm.bottomLeftCorner<3, 3>() = cross_sum;
    sums.mtm.topRightCorner<3, 3>() = -cross_sum;
    sums.mtm.bottomRightCorner<3, 3>() = product_sum.trace() * Eigen::Matrix3d::Identity() - product_sum;
    return sums;
  }
};

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

Pose horn(const HornSums& sums) {
  const Eigen::Vector3d model_mean = sums.model / sums.weight;
  const Eigen::Vector3d data_mean = sums.data / sums.weight;
  const Eigen::Matrix3d s = sums.data_model / sums.weight - data_mean * model_mean.transpose();
  Eigen::Matrix4d n;
  n << s(0, 0) + s(1, 1) + s(2, 2), s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0),  //
      0, s(0, 0) - s(1, 1) - s(2, 2), s(0, 1) + s(1, 0), s(2, 0) + s(0, 2),                   //
      0, 0, -s(0, 0) + s(1, 1) - s(2, 2), s(1, 2) + s(2, 1),                                  //
      0, 0, 0, -s(0, 0) - s(1, 1) + s(2, 2);
  n.triangularView<Eigen::StrictlyLower>() = n.transpose();
  const Eigen::Vector4d q = symmetric_eigen<4>(n).vectors.col(3);
  Pose model_from_data;
  model_from_data.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
  model_from_data.translation_m = model_mean - model_from_data.rotation * data_mean;
  return model_from_data;
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

std::uint32_t Icp::gather_facing(std::span<const IcpScan> data, const Pose& model_from_data,
                                 const Eigen::Vector3d& direction) {
  constexpr float facing = 0.7F;  // cosine of a plane's normal to the direction
  const FloatTransform data_to_model(model_from_data);
  const Point along{static_cast<float>(direction.x()), static_cast<float>(direction.y()),
                    static_cast<float>(direction.z())};
  const std::span<DataPoint> all = data_.first(gather(data));
  std::uint32_t count = 0;
  for (const DataPoint& point : all) {
    const bool faces_along = std::abs(dot(data_to_model.rotate(point.normal), along)) > facing;
    if (point.plane_weight > 0 && faces_along) all[count++] = point;
  }
  const std::uint32_t stride = (count + maximum_facing_samples - 1) / maximum_facing_samples;
  if (stride <= 1) return count;
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < count; i += stride) all[kept++] = all[i];
  return kept;
}

std::uint32_t Icp::count_fitting(std::span<const IcpScan> model, std::span<const DataPoint> points,
                                 const Pose& model_from_data, const IcpConfig& config) {
  constexpr float reach_m = 0.25F;  // about how far apart points of a surface are
  std::array<FloatTransform, maximum_model_scans> body_from_data;
  for (std::size_t m = 0; m < model.size(); ++m) {
    body_from_data[m] = FloatTransform(model[m].side_from_body.inverse() * model_from_data);
  }
  std::uint32_t fitting = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t m = i % model.size();  // the model's scans in turn
    const Point place = body_from_data[m] * points[i].point;
    const Neighbor nearest = model[m].tree->nearest(place, reach_m * reach_m);
    if (nearest.index == Neighbor::none) continue;
    const Point error_m = model[m].tree->point(nearest.index) - place;
    const float off_m = dot(body_from_data[m].rotate(points[i].normal), error_m);
    if (std::abs(off_m) < config.fit_distance_m) ++fitting;
  }
  return fitting;
}

FacingFit Icp::facing_fit(std::span<const IcpScan> model, std::span<const IcpScan> data,
                          const Pose& model_from_data, const Eigen::Vector3d& direction,
                          const IcpConfig& config) {
  FacingFit fit;
  if (model.empty() || model.size() > maximum_model_scans) return fit;
  fit.samples = gather_facing(data, model_from_data, direction);
  fit.fitting = count_fitting(model, data_.first(fit.samples), model_from_data, config);
  return fit;
}

std::uint32_t Icp::likely_shifts(std::span<const IcpScan> model, std::span<const IcpScan> data,
                                 const Pose& model_from_data, const Eigen::Vector3d& direction, double step_m,
                                 std::uint32_t steps, const IcpConfig& config, std::span<double> shifts_m) {
  if (model.empty() || model.size() > maximum_model_scans || steps > maximum_shift_steps) return 0;
  const std::span<const DataPoint> points = data_.first(gather_facing(data, model_from_data, direction));
  std::array<std::uint32_t, 2 * maximum_shift_steps + 1> room{};
  const std::span<std::uint32_t> fitting = std::span(room).first(2 * std::size_t{steps} + 1);
  const auto shift_m = [&](std::size_t s) { return (static_cast<double>(s) - steps) * step_m; };
  for (std::size_t s = 0; s < fitting.size(); ++s) {
    Pose shifted = model_from_data;
    shifted.translation_m += shift_m(s) * direction;
    fitting[s] = count_fitting(model, points, shifted, config);
  }

  // A peak is as wide as a fit: what is beside it is the same place.
  const auto beside = static_cast<std::size_t>(static_cast<double>(config.fit_distance_m) / step_m);
  const auto around = [&](std::size_t s, std::size_t width) {
    const std::size_t begin = s - std::min(s, width);
    return fitting.subspan(begin, std::min(s + width + 1, fitting.size()) - begin);
  };
  const std::uint32_t here = *std::ranges::max_element(around(steps, beside));
  std::uint32_t found = 0;
  while (found < shifts_m.size()) {
    const auto best = std::ranges::max_element(fitting);
    if (*best <= here) break;
    const auto s = static_cast<std::size_t>(best - fitting.begin());
    shifts_m[found++] = shift_m(s);
    std::ranges::fill(around(s, 2 * beside + 1), 0);
  }
  return found;
}

}  // namespace alces
