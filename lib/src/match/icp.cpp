#include "alces/icp.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "alces/symmetric_eigen.h"
#include "alces/symmetric_solve.h"
#include "geometry/float_transform.h"
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

// Whether the scanner that saw the point `seen` (its body frame) stood behind the surface with this normal
// (the same frame), which the other scanner saw from in front, under a cosine of `incidence`. Where both look
// along the surface, the normal is not sure enough to tell.
bool is_behind(const Point& seen, const Point& normal, float incidence) {
  constexpr float sure = 0.1F;  // of the cosines' difference: some 6 deg
  const float range_m = std::sqrt(dot(seen, seen));
  const float other_incidence = -dot(normal, seen) / range_m;
  return other_incidence < 0 && incidence - other_incidence > sure;
}

struct Motion {
  double moved_m = 0;
  double turned_rad = 0;
  [[nodiscard]] bool is_still(const IcpConfig& config) const {
    return moved_m < static_cast<double>(config.translation_epsilon_m) &&
           turned_rad < static_cast<double>(config.rotation_epsilon_rad);
  }
};

Motion motion(const Pose& from, const Pose& to) {
  return {(to.translation_m - from.translation_m).norm(), angle_between_rad(to.rotation, from.rotation)};
}

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
  // points' typical distance, one whose curvature is below `least_ratio` of the largest.
  [[nodiscard]] Step solve(const Pose& model_from_data, const IcpPrior* prior, double least_ratio,
                           IcpResult& result) {
    equations.carry();
    points.carry();
    const bool is_of_points = config.metric == IcpMetric::point_to_point;
    Matrix6d h = is_of_points ? points.matrix() : equations.matrix();
    Vector6d right_side = is_of_points ? points.right_side() : equations.right_side();
    const double variance_m2 = std::max(1e-6, rms_m() * rms_m());
    const double lever_m = std::sqrt(h.bottomRightCorner<3, 3>().trace() / h.topLeftCorner<3, 3>().trace());
    result.information = h / variance_m2;
    result.lever_m = lever_m;
    if (prior != nullptr) weigh(model_from_data, *prior, variance_m2, lever_m, h, right_side);
    Vector6d unit = Vector6d::Ones();
    unit.tail<3>().setConstant(1.0 / std::max(lever_m, 1e-6));
    const SymmetricEigen<6> eigen = symmetric_eigen<6>(unit.asDiagonal() * h * unit.asDiagonal());
    Step step;
    Vector6d twist = Vector6d::Zero();
    for (int i = 0; i < 6; ++i) {
      const Vector6d direction = unit.cwiseProduct(eigen.vectors.col(i));
      if (eigen.values[i] > least_ratio * eigen.values[5]) {
        twist += direction.dot(right_side) / eigen.values[i] * direction;
      } else if (step.weak_direction.isZero()) {
        step.weak_direction = direction.normalized();
      }
    }
    const bool in_closed_form = is_of_points && prior == nullptr && step.weak_direction.isZero();
    step.model_from_model = in_closed_form ? horn(points.pairs()) : exp_se3(twist);
    return step;
  }

  const IcpConfig& config;
  float scale_m;
  std::uint32_t count = 0;

 private:
  // Takes the normal equations of the correspondences to those of match and prior together, each as sure as
  // it is: (A + P) x = A x_match + P x_prior with A = C^-1 = H (noise H + F)^-1 H / s^2.
  void weigh(const Pose& model_from_data, const IcpPrior& prior, double variance_m2, double lever_m,
             Matrix6d& h, Vector6d& right_side) const {
    const IcpUncertainty& uncertainty = config.uncertainty;
    Vector6d force = Vector6d::Constant(uncertainty.pull * count);
    force.tail<3>() *= lever_m * lever_m;
    Matrix6d spread = uncertainty.noise * h;
    spread.diagonal() += force;
    const Matrix6d doubt = h * SymmetricSolver<6>(spread).inverse();
    // A step (translation, rotation vector) about the model's origin moves the data's place by its lever.
    const Eigen::Vector3d& p = model_from_data.translation_m;
    Matrix6d place = Matrix6d::Identity();
    place.topRightCorner<3, 3>() << 0, p.z(), -p.y(), -p.z(), 0, p.x(), p.y(), -p.x(), 0;
    Vector6d missing;
    missing.head<3>() = prior.model_from_data.translation_m - p;
    missing.tail<3>() = log_so3(prior.model_from_data.rotation * model_from_data.rotation.conjugate());
    const Matrix6d weight = variance_m2 * SymmetricSolver<6>(prior.covariance).inverse();
    right_side = doubt * right_side + place.transpose() * (weight * missing);
    h = doubt * h + place.transpose() * weight * place;
    h = (0.5 * (h + h.transpose())).eval();
  }
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

const char* to_string(IcpVerdict verdict) {
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

std::span<Icp::Sample> Icp::gather(std::span<const IcpScan> scans, std::span<Sample> room) {
  std::size_t offered = 0;
  for (const IcpScan& scan : scans) offered += scan.samples.size();
  if (offered == 0 || room.empty()) return {};
  const std::size_t kept = std::min(offered, room.size());
  std::size_t number = 0;
  std::size_t count = 0;
  for (const IcpScan& scan : scans) {
    const FloatTransform side_from_body(scan.side_from_body);
    for (const SurfaceSample& sample : scan.samples) {
      // Spread evenly: kept of offered, like the steps of a line drawn in pixels.
      const bool is_kept = (number + 1) * kept / offered != number * kept / offered;
      ++number;
      if (!is_kept) continue;
      const Point place = scan.tree->point(sample.index);
      const Point normal = {sample.normal[0], sample.normal[1], sample.normal[2]};
      const float range_m = std::sqrt(dot(place, place));
      Sample& point = room[count++];
      point.point = side_from_body * place;
      point.normal = side_from_body.rotate(normal);
      point.plane_weight = std::max(0.0F, 1.0F - sample.roughness / planar_roughness);
      point.incidence = range_m > 0 ? -dot(normal, place) / range_m : 1.0F;
      point.scan = maximum_model_scans;  // none
      point.nearest = Neighbor::none;
    }
  }
  return room.first(count);
}

// Near the end of a match points move by millimetres, and most of their neighbours stay the same. A search is
// spared where that is certain: the neighbour is nearer than any other point can have come since. The answers
// are those of the searches, to the bit.
void Icp::find_nearest(Sample& point, std::uint32_t scan, const KdTree& tree, const Point& place,
                       float limit_m) {
  std::uint32_t hint = Neighbor::none;
  if (point.scan == scan) {
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
  point.scan = scan;
  point.asked = place;
  point.others_m = std::sqrt(others_m2);
}

// The samples of one side, and what they ask: the other side's scans in turn.
struct Icp::Direction {
  std::span<Sample> samples;
  std::span<const IcpScan> asked;
  bool of_model = false;     // whose samples these are
  std::uint32_t groups = 1;  // that `asked` is dealt into: samples ask them in turn
  std::array<FloatTransform, maximum_model_scans> asked_from_body;
  std::array<FloatTransform, maximum_model_scans> body_from_samples;  // at the pose of `place`
  FloatTransform model_from_data;

  Direction(std::span<Sample> own, std::span<const IcpScan> others, bool is_of_model, const IcpConfig& config)
      : samples(own), asked(others), of_model(is_of_model) {
    const auto count = static_cast<std::uint32_t>(asked.size());
    groups = config.groups == 0 ? count : std::min(config.groups, count);
    for (std::size_t k = 0; k < asked.size(); ++k)
      asked_from_body[k] = FloatTransform(asked[k].side_from_body);
  }
  void place(const Pose& pose) {
    model_from_data = FloatTransform(pose);
    const Pose asked_from_samples = of_model ? pose.inverse() : pose;
    for (std::size_t k = 0; k < asked.size(); ++k)
      body_from_samples[k] = FloatTransform(asked[k].side_from_body.inverse() * asked_from_samples);
  }
  // A pair in the model frame: where the data lie, where the model lies, and the sample's normal.
  struct Pair {
    Point data;
    Point model;
    Point normal;
  };
  [[nodiscard]] Pair pair(const Sample& sample) const {
    const Point found = asked_from_body[sample.scan] * asked[sample.scan].tree->point(sample.nearest);
    if (of_model) return {model_from_data * found, sample.point, sample.normal};
    return {model_from_data * sample.point, found, model_from_data.rotate(sample.normal)};
  }
  /// Finds the i-th sample's partner among the scans that it asks, or none. False: it was seen from the other
  /// side.
  [[nodiscard]] bool ask(Sample& sample, std::size_t i, float limit_m, const IcpConfig& config) const {
    const auto first = static_cast<std::uint32_t>(i % groups);
    if (first + groups >= asked.size()) {
      find_nearest(sample, first, *asked[first].tree, body_from_samples[first] * sample.point, limit_m);
    } else {
      find_nearest_in_group(sample, first, limit_m);
    }
    const bool looks_at_sides = config.metric == IcpMetric::surface && config.same_side;
    return !(looks_at_sides && sample.nearest != Neighbor::none && is_seen_from_behind(sample));
  }
  // The nearest of all scans of a group.
  void find_nearest_in_group(Sample& sample, std::uint32_t first, float limit_m) const {
    float least_m2 = limit_m * limit_m;
    sample.nearest = Neighbor::none;
    for (std::uint32_t scan = first; scan < asked.size(); scan += groups) {
      const Point place = body_from_samples[scan] * sample.point;
      float others_m2 = 0;
      const std::uint32_t index = asked[scan].tree->nearest(place, least_m2, Neighbor::none, others_m2).index;
      if (index == Neighbor::none) continue;
      const Point error_m = asked[scan].tree->point(index) - place;
      least_m2 = dot(error_m, error_m);
      sample.scan = scan;
      sample.nearest = index;
    }
  }
  void add(const Sample& sample, bool has_planes, Minimizer& minimizer) const {
    const Pair found = pair(sample);
    if (has_planes) {
      minimizer.add(found.model, found.data, found.normal, sample.plane_weight);
    } else {
      minimizer.add(found.model, found.data);
    }
  }
  [[nodiscard]] bool is_seen_from_behind(const Sample& sample) const {
    return is_behind(asked[sample.scan].tree->point(sample.nearest),
                     body_from_samples[sample.scan].rotate(sample.normal), sample.incidence);
  }
};

// How many of the surfaces that face along each of three axes fit; the axes are those of the normals'
// scatter.
struct Icp::FacingShares {
  Eigen::Matrix3f axes;
  std::uint32_t all[3] = {};
  std::uint32_t fitting[3] = {};

  FacingShares(std::span<const Sample> data, std::span<const Sample> model,
               const FloatTransform& model_from_data) {
    Eigen::Matrix3f scatter = Eigen::Matrix3f::Zero();
    const auto add = [&scatter](const Point& n) {
      const Eigen::Vector3f normal(n.x, n.y, n.z);
      scatter += normal * normal.transpose();
    };
    for (const Sample& sample : data)
      if (sample.plane_weight > 0) add(model_from_data.rotate(sample.normal));
    for (const Sample& sample : model)
      if (sample.plane_weight > 0) add(sample.normal);
    axes = symmetric_eigen<3, float>(scatter).vectors;
    for (const Sample& sample : data)
      if (sample.plane_weight > 0) ++all[axis(model_from_data.rotate(sample.normal))];
    for (const Sample& sample : model)
      if (sample.plane_weight > 0) ++all[axis(sample.normal)];
  }
  [[nodiscard]] int axis(const Point& n) const {
    const Eigen::Vector3f along = (axes.transpose() * Eigen::Vector3f(n.x, n.y, n.z)).cwiseAbs();
    return along.x() >= along.y() && along.x() >= along.z() ? 0 : along.y() >= along.z() ? 1 : 2;
  }
  void add_fitting(const Point& n) { ++fitting[axis(n)]; }
  [[nodiscard]] double mean() const {
    constexpr std::uint32_t few = 20;  // tell nothing
    double sum = 0;
    int axes_seen = 0;
    for (int k = 0; k < 3; ++k) {
      if (all[k] < few) continue;
      sum += static_cast<double>(fitting[k]) / all[k];
      ++axes_seen;
    }
    return axes_seen > 0 ? sum / axes_seen : 0;
  }
};

IcpResult Icp::match(std::span<const IcpScan> model, std::span<const IcpScan> data,
                     const Pose& initial_model_from_data, const IcpConfig& config, const IcpPrior* prior,
                     std::span<IcpIteration> trace) {
  IcpResult result;
  result.model_from_data = initial_model_from_data;
  if (model.empty() || model.size() > maximum_model_scans || data.size() > maximum_model_scans) return result;
  std::size_t offered = 0;
  for (const IcpScan& scan : data) offered += scan.samples.size();
  const std::size_t total = std::min(offered, samples_.size());
  const bool has_planes = config.metric == IcpMetric::surface;
  const std::size_t of_data = has_planes && config.both_ways ? (total + 1) / 2 : total;
  std::array<Direction, 2> directions = {
      Direction(gather(data, samples_.first(of_data)), model, false, config),
      Direction(gather(model, samples_.subspan(of_data, total - of_data)), data, true, config)};

  float limit_m = config.first_distance_limit_m;
  float scale_m = 0;  // of the robust weights: follows the residuals down
  result.verdict = IcpVerdict::iteration_limit;
  for (std::uint32_t iteration = 0; iteration < config.maximum_iterations; ++iteration) {
    const bool is_fine = limit_m <= config.last_distance_limit_m;
    const std::size_t stride = is_fine ? 1 : std::max<std::uint32_t>(1, config.coarse_stride);
    Minimizer minimizer(config, scale_m);
    result.queries = 0;
    result.behind = 0;
    std::uint32_t asked_by_data = 0;
    std::uint32_t found_by_data = 0;
    for (Direction& direction : directions) {
      direction.place(result.model_from_data);
      const std::uint32_t found_before = minimizer.count;
      for (std::size_t i = 0; i < direction.samples.size(); i += stride) {
        ++result.queries;
        if (!direction.ask(direction.samples[i], i / stride, limit_m, config)) {
          ++result.behind;
        } else if (direction.samples[i].nearest != Neighbor::none) {
          direction.add(direction.samples[i], has_planes, minimizer);
        }
      }
      if (!direction.of_model) {
        asked_by_data = result.queries;
        found_by_data = minimizer.count - found_before;
      }
    }
    result.iterations = iteration + 1;
    result.correspondences = minimizer.count;
    result.overlap = asked_by_data > 0 ? static_cast<double>(found_by_data) / asked_by_data : 0;
    result.rms_m = minimizer.rms_m();
    if (minimizer.count * stride < config.minimum_correspondences) {
      result.verdict = IcpVerdict::too_few_correspondences;
      result.model_from_data = initial_model_from_data;
      return result;
    }

    // A prior determines every direction.
    const double least_ratio = prior != nullptr ? 0 : static_cast<double>(config.degenerate_ratio);
    const Step step = minimizer.solve(result.model_from_data, prior, least_ratio, result);
    const Pose moved = step.model_from_model * result.model_from_data;
    const Motion change = motion(result.model_from_data, moved);
    if (iteration < trace.size())
      trace[iteration] = {limit_m, minimizer.count, result.rms_m, change.moved_m, change.turned_rad};
    result.model_from_data = moved;
    result.weak_direction = step.weak_direction;
    if (change.is_still(config) && is_fine) {
      result.verdict = IcpVerdict::converged;
      break;
    }
    limit_m = std::max(config.last_distance_limit_m, limit_m * config.limit_factor);
    if (config.robust_factor > 0) {
      scale_m = std::max(config.robust_scale_m, config.robust_factor * static_cast<float>(result.rms_m));
    }
  }
  if (!result.weak_direction.isZero()) result.verdict = IcpVerdict::degenerate;

  FacingShares shares(directions[0].samples, directions[1].samples, FloatTransform(result.model_from_data));
  std::uint32_t fitting = 0;
  Moments moments;  // of the last iteration's correspondences, at the pose they led to
  for (Direction& direction : directions) {
    direction.place(result.model_from_data);
    for (const Sample& sample : direction.samples) {
      if (sample.nearest == Neighbor::none) continue;
      if (has_planes && config.same_side && direction.is_seen_from_behind(sample)) continue;
      const Direction::Pair pair = direction.pair(sample);
      const Point error_m = pair.model - pair.data;
      moments.add(pair.data, error_m);
      const float off_m =
          sample.plane_weight > 0 ? dot(pair.normal, error_m) : std::sqrt(dot(error_m, error_m));
      if (!(std::abs(off_m) < config.fit_distance_m)) continue;
      ++fitting;
      if (sample.plane_weight > 0) shares.add_fitting(pair.normal);
    }
  }
  if (total > 0) result.fit = static_cast<double>(fitting) / static_cast<double>(total);
  result.balanced_fit = shares.mean();
  result.sums = moments.sums();
  // Where half of the surfaces do not fit, there is more that is wrong.
  constexpr double least_fit = 0.5;
  if (has_planes && result.verdict == IcpVerdict::converged && config.finish_iterations > 0 &&
      result.balanced_fit >= least_fit)
    finish(model, data, config, prior, result);
  return result;
}

// Wrong partners on the ground lie above it more often than below, and nearer to the other scanner's side.
// All data samples ask once more, and what is off counts less: that halves the bias which remains.
void Icp::finish(std::span<const IcpScan> model, std::span<const IcpScan> data, const IcpConfig& config,
                 const IcpPrior* prior, IcpResult& result) {
  // Between long walls it would slide: what the match left nearly open stays as it is.
  constexpr double least_ratio = 3e-3;
  Direction direction(gather(data, samples_), model, false, config);
  IcpResult finished = result;  // of it only the pose is kept: how sure a match is, is known of the match
  for (std::uint32_t iteration = 0; iteration < config.finish_iterations; ++iteration) {
    Minimizer minimizer(config, std::max(config.robust_scale_m,
                                         config.finish_robust_factor * static_cast<float>(finished.rms_m)));
    direction.place(finished.model_from_data);
    for (std::size_t i = 0; i < direction.samples.size(); ++i) {
      Sample& sample = direction.samples[i];
      if (direction.ask(sample, i, config.last_distance_limit_m, config) && sample.nearest != Neighbor::none)
        direction.add(sample, true, minimizer);
    }
    if (minimizer.count < config.minimum_correspondences) return;
    finished.rms_m = minimizer.rms_m();
    const Step step = minimizer.solve(finished.model_from_data, prior, least_ratio, finished);
    const Pose moved = step.model_from_model * finished.model_from_data;
    const bool is_still = motion(finished.model_from_data, moved).is_still(config);
    finished.model_from_data = moved;
    ++result.iterations;
    if (is_still) break;
  }
  result.model_from_data = finished.model_from_data;
}

}  // namespace alces
