#include "mounting_estimate.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "flat_patches.h"
#include "offline/io/files/error.h"

namespace alces::offline {
namespace {

using PoseInformation = Eigen::MatrixXd;

constexpr Eigen::Index keys_a_laser = mounting_keys;
constexpr double prior_m = 0.1;
constexpr double prior_rad = 5 * std::numbers::pi / 180;
constexpr double noise_m = 0.02;  // that the prior is weighed against
constexpr std::array<double, 3> first_tolerances_m{0.16, 0.10, 0.06};
constexpr int iterations_a_tolerance = 5;
constexpr int last_iterations = 30;
constexpr double cauchy_factor = 2;  // of the residuals' scale
constexpr double least_distance_scale_m = 0.003;
constexpr double largest_step_m = 0.05;
constexpr double largest_step_rad = 0.04;
constexpr double still_m = 1e-6;
constexpr double still_rad = 1e-7;
constexpr std::size_t least_points_a_view = 12;
constexpr int weighting_rounds = 2;
constexpr double least_seen_share = 0.01;

double median_of(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// A ray's end depends on the mounting: what the derivative needs of a laser.
struct LaserAxes {
  explicit LaserAxes(const Mounting& mounting)
      : rotation(pose_of(mounting).rotation.toRotationMatrix()),
        pitch(Eigen::AngleAxisd(mounting[key_yaw], Eigen::Vector3d::UnitZ()) * Eigen::Vector3d::UnitY()),
        roll(Eigen::AngleAxisd(mounting[key_yaw], Eigen::Vector3d::UnitZ()) *
             (Eigen::AngleAxisd(mounting[key_pitch], Eigen::Vector3d::UnitY()) * Eigen::Vector3d::UnitX())) {}
  Eigen::Matrix3d rotation;
  Eigen::Vector3d pitch;
  Eigen::Vector3d roll;
};

/// The points of a patch over its plane, and how shapes are fitted to them: flat, or bent like a quadric.
class PatchPoints {
 public:
  static constexpr Eigen::Index flat = 3;
  static constexpr Eigen::Index quadric = 6;

  PatchPoints(std::span<const Eigen::Vector3d> ends_m, std::span<const std::uint32_t> which,
              Eigen::Index coefficients)
      : plane(fit_plane(ends_m, which)),
        shapes(coefficients, static_cast<Eigen::Index>(which.size())),
        distances_m(static_cast<Eigen::Index>(which.size())) {
    const double unit_m = std::max(plane.length_m, 1e-3);  // for the matrix' sake
    for (std::size_t k = 0; k < which.size(); ++k) {
      const Eigen::Vector3d offset = ends_m[which[k]] - plane.center_m;
      const double u = offset.dot(plane.along) / unit_m;
      const double v = offset.dot(plane.across) / unit_m;
      Eigen::Matrix<double, quadric, 1> shape;
      shape << 1, u, v, u * u, u * v, v * v;
      const auto column = static_cast<Eigen::Index>(k);
      shapes.col(column) = shape.head(coefficients);
      distances_m[column] = offset.dot(plane.normal);
    }
  }

  PlaneFit plane;
  Eigen::MatrixXd shapes;  ///< a column a point
  Eigen::VectorXd distances_m;
};

/// A shape through some of the points: the matrix of its normal equations, and what is left of the distances.
struct ShapeFit {
  ShapeFit(const PatchPoints& points, const std::vector<Eigen::Index>& which, const Eigen::VectorXd& weights)
      : information(Eigen::MatrixXd::Zero(points.shapes.rows(), points.shapes.rows())) {
    Eigen::VectorXd right = Eigen::VectorXd::Zero(points.shapes.rows());
    for (const Eigen::Index k : which) {
      information.noalias() += weights[k] * points.shapes.col(k) * points.shapes.col(k).transpose();
      right += weights[k] * points.distances_m[k] * points.shapes.col(k);
    }
    information.diagonal().array() += 1e-9 * information(0, 0);
    const Eigen::VectorXd fit = information.ldlt().solve(right);
    for (const Eigen::Index k : which)
      residuals_m.push_back(points.distances_m[k] - points.shapes.col(k).dot(fit));
  }
  Eigen::MatrixXd information;
  std::vector<double> residuals_m;
};

class Solver {
 public:
  Solver(std::vector<StandingRay> rays, std::span<const Mounting> configured,
         const MountingSettings& settings, const std::function<void(std::size_t, std::size_t)>& progress)
      : rays_(std::move(rays)),
        configured_(configured.begin(), configured.end()),
        settings_(settings),
        progress_(progress),
        is_active_(configured.size() * mounting_keys, true) {
    is_active_[key_z] = is_active_[key_yaw] = false;  // of the first laser: the head's
    for (const StandingRay& ray : rays_) stands_ = std::max<std::size_t>(stands_, ray.stand + 1);
    views_.reserve(rays_.size());
    for (const StandingRay& ray : rays_)
      views_.push_back(2 * ray.laser +
                       half_of_plane(configured_[ray.laser], static_cast<double>(ray.ray_angle_rad)));
  }

  MountingEstimate estimate() {
    do {
      solve();
    } while (drop_undetermined());
    return report();
  }

 private:
  [[nodiscard]] std::size_t unknowns() const { return is_active_.size(); }
  [[nodiscard]] Eigen::Index coefficients() const {
    return settings_.surfaces_are_flat ? PatchPoints::flat : PatchPoints::quadric;
  }

  void find_patches(double tolerance_m) {
    FlatPatchSettings settings;
    settings.tolerance_m = tolerance_m;
    patches_.clear();
    const std::vector<Eigen::Vector3d> ends_m = ray_ends_m(rays_, lasers_);
    for (std::size_t stand = 0; stand < stands_; ++stand) {
      std::vector<std::uint32_t> which;
      for (std::size_t i = 0; i < rays_.size(); ++i)
        if (rays_[i].stand == stand) which.push_back(static_cast<std::uint32_t>(i));
      for (FlatPatch& patch : find_flat_patches(ends_m, std::move(which), settings))
        patches_.push_back(std::move(patch));
    }
  }

  // The places of a patch's points, view by view; views of a few points tell nothing.
  [[nodiscard]] std::vector<std::vector<Eigen::Index>> views_of(const FlatPatch& patch) const {
    std::array<std::vector<Eigen::Index>, 2 * ScanAssemblerConfig::maximum_lasers> views;
    for (std::size_t k = 0; k < patch.points.size(); ++k)
      views[static_cast<std::size_t>(views_[patch.points[k]])].push_back(static_cast<Eigen::Index>(k));
    std::vector<std::vector<Eigen::Index>> kept;
    for (auto& view : views)
      if (view.size() >= least_points_a_view) kept.push_back(std::move(view));
    return kept;
  }

  // Of a point's distance from a plane, with the keys of its laser.
  [[nodiscard]] static Vector6d derivative(const StandingRay& ray, const Eigen::Vector3d& normal,
                                           const std::vector<LaserAxes>& axes) {
    const double c = std::cos(ray.head_angle_rad);
    const double s = std::sin(ray.head_angle_rad);
    const Eigen::Vector3d in_head(c * normal.x() + s * normal.y(), c * normal.y() - s * normal.x(),
                                  normal.z());
    const double range_m = static_cast<double>(ray.range_m);
    const double angle_rad = static_cast<double>(ray.ray_angle_rad);
    const LaserAxes& laser = axes[ray.laser];
    const Eigen::Vector3d arm =
        range_m * (std::cos(angle_rad) * laser.rotation.col(0) + std::sin(angle_rad) * laser.rotation.col(1));
    const Eigen::Vector3d moment = arm.cross(in_head);
    Vector6d row;
    row << in_head, laser.roll.dot(moment), laser.pitch.dot(moment), moment.z();
    return row;
  }

  // The normal equations of the mounting, with the shapes eliminated.
  void linearize(PoseInformation& information, Eigen::VectorXd& gradient) {
    const auto count = static_cast<Eigen::Index>(unknowns());
    information = PoseInformation::Zero(count, count);
    gradient = Eigen::VectorXd::Zero(count);
    sensitivity_ = PoseInformation::Zero(count, count);
    const std::vector<Eigen::Vector3d> ends_m = ray_ends_m(rays_, lasers_);
    std::vector<LaserAxes> axes;
    for (const Mounting& laser : lasers_) axes.emplace_back(laser);
    std::vector<double> distances_m;
    double sum = 0;
    double weight_sum = 0;
    for (const FlatPatch& patch : patches_) {
      const PatchPoints points(ends_m, patch.points, coefficients());
      const std::vector<std::vector<Eigen::Index>> views = views_of(patch);
      std::vector<Eigen::Index> all;
      for (const auto& view : views) all.insert(all.end(), view.begin(), view.end());
      const bool tells_something = settings_.surfaces_are_flat ? !all.empty() : views.size() > 1;
      if (!tells_something) continue;
      const double share = std::min(1.0, settings_.points_a_patch / static_cast<double>(all.size()));
      Eigen::VectorXd weights = Eigen::VectorXd::Constant(points.distances_m.size(), share);
      for (int round = 0; round < weighting_rounds; ++round) {
        const ShapeFit fit(points, all, weights);
        for (std::size_t k = 0; k < all.size(); ++k) {
          const double e = fit.residuals_m[k] / (cauchy_factor * scale_m_);
          weights[all[k]] = share / (1 + e * e);
        }
      }
      Eigen::Matrix<double, keys_a_laser, Eigen::Dynamic> rows(keys_a_laser, points.distances_m.size());
      for (const Eigen::Index k : all)
        rows.col(k) = derivative(rays_[patch.points[static_cast<std::size_t>(k)]], points.plane.normal, axes);
      // One shape for all views, against one for each: what is left is how much the views disagree.
      const auto add = [&](const std::vector<Eigen::Index>& which, double sign) {
        const ShapeFit fit(points, which, weights);
        Eigen::MatrixXd mixed = Eigen::MatrixXd::Zero(count, coefficients());
        for (std::size_t i = 0; i < which.size(); ++i) {
          const Eigen::Index k = which[i];
          const double weight = weights[k];
          const double e = fit.residuals_m[i];
          const Eigen::Index at = rays_[patch.points[static_cast<std::size_t>(k)]].laser * keys_a_laser;
          information.block<6, 6>(at, at) += sign * weight * rows.col(k) * rows.col(k).transpose();
          gradient.segment<6>(at) += sign * weight * e * rows.col(k);
          mixed.middleRows<6>(at).noalias() += weight * rows.col(k) * points.shapes.col(k).transpose();
          if (sign < 0) continue;
          sensitivity_.block<6, 6>(at, at) += weight * rows.col(k) * rows.col(k).transpose();
          distances_m.push_back(std::abs(e));
          sum += weight * e * e;
          weight_sum += weight;
        }
        // The shape's own gradient is zero: it was fitted with the same weights.
        information -= sign * (mixed * fit.information.ldlt().solve(mixed.transpose()));
      };
      add(all, 1);
      if (!settings_.surfaces_are_flat)
        for (const auto& view : views) add(view, -1);
    }
    scale_m_ = std::max(least_distance_scale_m, 1.4826 * median_of(std::move(distances_m)));
    variance_m2_ = weight_sum > 0 ? sum / weight_sum : 0;
    for (std::size_t i = 0; i < unknowns(); ++i) {
      const auto key = static_cast<MountingKey>(i % mounting_keys);
      const auto at = static_cast<Eigen::Index>(i);
      const double prior = noise_m / (is_angle(key) ? prior_rad : prior_m);
      information(at, at) += prior * prior;
      gradient[at] +=
          prior * prior *
          (lasers_[i / mounting_keys][i % mounting_keys] - configured_[i / mounting_keys][i % mounting_keys]);
    }
  }

  // The rows and columns that are estimated.
  [[nodiscard]] std::vector<Eigen::Index> active() const {
    std::vector<Eigen::Index> places;
    for (std::size_t i = 0; i < unknowns(); ++i)
      if (is_active_[i]) places.push_back(static_cast<Eigen::Index>(i));
    return places;
  }

  // One Gauss-Newton step; true when it is no longer one.
  bool step() {
    Eigen::VectorXd gradient;
    linearize(information_, gradient);
    const std::vector<Eigen::Index> places = active();
    if (places.empty()) return true;
    const Eigen::VectorXd change =
        -information_(places, places).ldlt().solve(Eigen::VectorXd(gradient(places)));
    double shortening = 1;
    bool is_still = true;
    for (std::size_t k = 0; k < places.size(); ++k) {
      const bool angle = is_angle(static_cast<MountingKey>(places[k] % keys_a_laser));
      const double size = std::abs(change[static_cast<Eigen::Index>(k)]);
      is_still = is_still && size < (angle ? still_rad : still_m);
      shortening = std::max(shortening, size / (angle ? largest_step_rad : largest_step_m));
    }
    for (std::size_t k = 0; k < places.size(); ++k)
      lasers_[static_cast<std::size_t>(places[k]) / mounting_keys]
             [static_cast<std::size_t>(places[k]) % mounting_keys] +=
          change[static_cast<Eigen::Index>(k)] / shortening;
    ++iterations_;
    if (progress_) progress_(iterations_, 60);
    return is_still;
  }

  void check_patches() const {
    if (patches_.size() < settings_.least_patches)
      throw InputError(
          fmt::format("there are {} flat surfaces in the scans, {} are needed; stand where walls are near, "
                      "and check that "
                      "the configured mounting is within 10 cm and 3 deg",
                      patches_.size(), settings_.least_patches));
  }

  void solve() {
    lasers_ = configured_;
    has_converged_ = false;
    scale_m_ = first_tolerances_m[0];
    find_patches(first_tolerances_m[0]);
    if (patches_.empty()) check_patches();
    Eigen::VectorXd gradient;
    linearize(information_, gradient);
    drop_unseen();
    for (const double tolerance_m : first_tolerances_m) {
      if (tolerance_m <= settings_.last_tolerance_m) continue;
      for (int i = 0; i < iterations_a_tolerance; ++i) {
        find_patches(tolerance_m);
        if (patches_.empty()) break;
        if (step()) break;
      }
    }
    for (int i = 0; i < iterations_a_tolerance; ++i) {
      find_patches(settings_.last_tolerance_m);
      check_patches();
      if (step()) break;
    }
    find_patches(settings_.last_tolerance_m);
    check_patches();
    for (int i = 0; i < last_iterations && !has_converged_; ++i) has_converged_ = step();
    linearize(information_, gradient);
  }

  [[nodiscard]] Eigen::VectorXd sigmas(const std::vector<Eigen::Index>& places) const {
    if (places.empty()) return {};
    const Eigen::MatrixXd covariance =
        variance_m2_ * information_(places, places)
                           .ldlt()
                           .solve(Eigen::MatrixXd::Identity(static_cast<Eigen::Index>(places.size()),
                                                            static_cast<Eigen::Index>(places.size())));
    return covariance.diagonal().cwiseMax(0).cwiseSqrt();
  }

  // Takes out, one by one, what the surfaces' shapes swallow but for a remainder: that remainder is where the
  // shapes are not quadrics, and tells nothing of the mounting. True: something was.
  bool drop_unseen() {
    bool has_dropped = false;
    if (settings_.surfaces_are_flat) return has_dropped;
    for (;;) {
      const std::vector<Eigen::Index> places = active();
      if (places.empty()) return has_dropped;
      PoseInformation sensitivity = sensitivity_(places, places);
      // What moves no point has the prior alone, and is found by its standard deviation.
      sensitivity.diagonal().array() += 1e-9 * sensitivity.diagonal().maxCoeff() + 1e-12;
      const Eigen::GeneralizedSelfAdjointEigenSolver<PoseInformation> shares(information_(places, places),
                                                                             sensitivity);
      if (shares.info() != Eigen::Success || shares.eigenvalues()[0] >= least_seen_share) return has_dropped;
      const Eigen::VectorXd direction =
          shares.eigenvectors().col(0).cwiseProduct(sensitivity.diagonal().cwiseSqrt()).cwiseAbs();
      std::size_t which = 0;
      double most = 0;
      for (std::size_t k = 0; k < places.size(); ++k) {
        const double part = direction[static_cast<Eigen::Index>(k)] * preference(places[k]);
        if (part <= most) continue;
        most = part;
        which = k;
      }
      drop(places, which);
      has_dropped = true;
    }
  }

  // What is known of two lasers is often their difference: the first one's value is the one to keep.
  [[nodiscard]] static double preference(Eigen::Index place) { return place < keys_a_laser ? 1.2 : 1; }

  void drop(const std::vector<Eigen::Index>& places, std::size_t which) {
    const double sigma = sigmas(places)[static_cast<Eigen::Index>(which)];
    is_active_[static_cast<std::size_t>(places[which])] = false;
    dropped_.emplace_back(static_cast<std::size_t>(places[which]), sigma);
  }

  // The same with what is less certain than the limits.
  bool drop_undetermined() {
    bool has_dropped = drop_unseen();
    for (;;) {
      const std::vector<Eigen::Index> places = active();
      if (places.empty()) return has_dropped;
      const Eigen::VectorXd sigma = sigmas(places);
      double worst = 1;
      std::size_t which = places.size();
      for (std::size_t k = 0; k < places.size(); ++k) {
        const auto place = static_cast<std::size_t>(places[k]);
        const bool angle = is_angle(static_cast<MountingKey>(place % mounting_keys));
        const double certainty = sigma[static_cast<Eigen::Index>(k)] /
                                 (angle ? settings_.largest_sigma_rad : settings_.largest_sigma_m);
        if (certainty > 1 && certainty * preference(places[k]) > worst) {
          worst = certainty * preference(places[k]);
          which = k;
        }
      }
      if (which == places.size()) return has_dropped;
      drop(places, which);
      has_dropped = true;
    }
  }

  [[nodiscard]] ViewAgreement agreement(std::span<const Mounting> lasers, std::size_t& seen_twice) const {
    ViewAgreement result;
    const std::vector<Eigen::Vector3d> ends_m = ray_ends_m(rays_, lasers);
    std::vector<double> gaps_m;
    double sum = 0;
    double weight_sum = 0;
    double gap_sum = 0;
    for (const FlatPatch& patch : patches_) {
      const PlaneFit plane = fit_plane(ends_m, patch.points);
      std::array<double, 2 * ScanAssemblerConfig::maximum_lasers> offset{};
      std::array<std::size_t, 2 * ScanAssemblerConfig::maximum_lasers> count{};
      for (const std::uint32_t i : patch.points) {
        const double e = plane.normal.dot(ends_m[i] - plane.center_m);
        sum += e * e;
        weight_sum += 1;
        offset[static_cast<std::size_t>(views_[i])] += e;
        ++count[static_cast<std::size_t>(views_[i])];
      }
      double least_m = 1e9;
      double most_m = -1e9;
      int views = 0;
      for (std::size_t view = 0; view < offset.size(); ++view) {
        if (count[view] < least_points_a_view) continue;
        ++views;
        least_m = std::min(least_m, offset[view] / static_cast<double>(count[view]));
        most_m = std::max(most_m, offset[view] / static_cast<double>(count[view]));
      }
      if (views < 2) continue;
      gaps_m.push_back(most_m - least_m);
      gap_sum += (most_m - least_m) * (most_m - least_m);
    }
    seen_twice = gaps_m.size();
    result.rms_m = weight_sum > 0 ? std::sqrt(sum / weight_sum) : 0;
    result.rms_gap_m = gaps_m.empty() ? 0 : std::sqrt(gap_sum / static_cast<double>(gaps_m.size()));
    result.median_gap_m = median_of(std::move(gaps_m));
    return result;
  }

  [[nodiscard]] MountingEstimate report() const {
    MountingEstimate result;
    result.lasers = lasers_;
    const std::vector<Eigen::Index> places = active();
    const Eigen::VectorXd sigma = sigmas(places);
    for (std::size_t i = 0; i < unknowns(); ++i) {
      MountingParameter parameter;
      parameter.laser = i / mounting_keys;
      parameter.key = static_cast<MountingKey>(i % mounting_keys);
      parameter.configured = configured_[parameter.laser][i % mounting_keys];
      parameter.estimated = lasers_[parameter.laser][i % mounting_keys];
      parameter.fate = i == key_z || i == key_yaw ? Fate::same_as_head : Fate::undetermined;
      for (std::size_t k = 0; k < places.size(); ++k) {
        if (static_cast<std::size_t>(places[k]) != i) continue;
        parameter.fate = Fate::estimated;
        parameter.sigma = sigma[static_cast<Eigen::Index>(k)];
      }
      for (const auto& [place, would_be] : dropped_)
        if (place == i) parameter.sigma = would_be;
      result.parameters.push_back(parameter);
    }
    result.before = agreement(configured_, result.patches_seen_twice);
    result.after = agreement(lasers_, result.patches_seen_twice);
    result.rays = rays_.size();
    result.patches = patches_.size();
    result.iterations = iterations_;
    result.has_converged = has_converged_;
    return result;
  }

  std::vector<StandingRay> rays_;
  std::vector<Mounting> configured_;
  MountingSettings settings_;
  const std::function<void(std::size_t, std::size_t)>& progress_;
  std::vector<bool> is_active_;
  std::vector<std::pair<std::size_t, double>> dropped_;  ///< which, and its standard deviation
  std::vector<int> views_;
  std::size_t stands_ = 0;

  std::vector<Mounting> lasers_;
  std::vector<FlatPatch> patches_;
  PoseInformation information_;
  PoseInformation sensitivity_;  ///< what would be known if the surfaces were
  double scale_m_ = 0;           ///< of the residuals
  double variance_m2_ = 0;
  std::size_t iterations_ = 0;
  bool has_converged_ = false;
};

}  // namespace

int half_of_plane(const Mounting& laser, double ray_angle_rad) {
  const Eigen::Matrix3d axes = pose_of(laser).rotation.toRotationMatrix();
  Eigen::Vector3d ahead = axes.col(2).cross(Eigen::Vector3d::UnitZ());
  if (ahead.norm() < 1e-9) return 0;
  ahead.normalize();
  if (ahead.dot(axes.col(0)) < 0) ahead = -ahead;
  const Eigen::Vector3d ray = std::cos(ray_angle_rad) * axes.col(0) + std::sin(ray_angle_rad) * axes.col(1);
  return ray.dot(ahead) < -0.02 ? 1 : 0;  // rays along the axis belong to either
}

MountingEstimate estimate_mounting(std::span<const StandingRay> rays, std::span<const Mounting> configured,
                                   const MountingSettings& settings,
                                   const std::function<void(std::size_t, std::size_t)>& progress) {
  for (std::size_t laser = 0; laser < configured.size(); ++laser) {
    const char letter = static_cast<char>('a' + laser);
    const Eigen::Matrix3d axes = pose_of(configured[laser]).rotation.toRotationMatrix();
    if (std::hypot(axes(0, 2), axes(1, 2)) < 0.2)
      throw InputError(fmt::format(
          "the scan plane of laser_{} lies across the head's axis and turns in itself, by the configuration: "
          "such a head makes no 3D scans; is its roll_deg right?",
          letter));
    if (std::abs(std::cos(configured[laser][key_pitch])) < 0.05)
      throw InputError(
          fmt::format("pitch_deg of laser_{} is next to 90, where roll and yaw are the same; describe the "
                      "mounting with a "
                      "roll instead",
                      letter));
  }
  const std::size_t stride = rays.size() / (std::max<std::size_t>(1, settings.most_rays) + 1) + 1;
  std::vector<StandingRay> taken;
  for (std::size_t i = 0; i < rays.size(); i += stride) {
    if (rays[i].laser < configured.size()) taken.push_back(rays[i]);
  }
  return Solver(std::move(taken), configured, settings, progress).estimate();
}

}  // namespace alces::offline
