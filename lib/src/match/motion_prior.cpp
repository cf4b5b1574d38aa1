#include "alces/motion_prior.h"

#include <algorithm>
#include <cmath>

#include "alces/portable_math.h"

namespace alces {
namespace {

// By what an odometry's errors grow: the way, and turns, in which wheels slip. At rest the body still rocks.
double size_m(const Pose& step) {
  constexpr double rocking_m = 0.2;
  constexpr double m_per_rad = 1.0;
  return rocking_m + step.translation_m.norm() +
         m_per_rad * angle_between_rad(step.rotation, Eigen::Quaterniond::Identity());
}

Vector6d deviation(const Pose& predicted, const Pose& matched) {
  Vector6d d;
  d.head<3>() = matched.rotation.conjugate() * (matched.translation_m - predicted.translation_m);
  d.tail<3>() = log_so3(predicted.rotation.conjugate() * matched.rotation);
  return d;
}

}  // namespace

double MotionPrior::Prediction::mahalanobis2(const Pose& last_from_next_matched) const {
  const Vector6d d = deviation(last_from_next, last_from_next_matched);
  return d.cwiseAbs2().cwiseQuotient(variance).sum();
}

double MotionPrior::heading_rad() const {
  constexpr double enough_m2 = 4.0;  // of steps multiplied: a few metres of driving
  if (!config_.learn_heading || portable::hypot(cosine_m2_, sine_m2_) < enough_m2) return 0;
  return portable::atan2(sine_m2_, cosine_m2_);
}

double MotionPrior::delay_steps() const {
  constexpr double enough = 1.0;  // of (m^2 + rad^2) by which successive steps differ
  if (!config_.learn_delay || delay_square_ < enough) return 0;
  return std::clamp(delay_product_ / delay_square_, -0.5, 1.0);
}

double MotionPrior::scale() const {
  constexpr double doubt_m2 = 4.0;  // as if a few metres had shown that the odometry is right
  if (!config_.learn_heading) return 1;
  return (doubt_m2 + portable::hypot(cosine_m2_, sine_m2_)) / (doubt_m2 + odometry_m2_);
}

// The step as the scanner makes it: turned by the heading, and with the part that belongs to the step before.
Pose MotionPrior::corrected(const Pose& odometry_step) const {
  Pose step = odometry_step;
  const double delay = delay_steps();
  if (delay > 0 && has_odometry_step_) step = interpolate(odometry_step, last_odometry_step_, delay);
  step.translation_m *= scale();
  const double heading = heading_rad();
  if (heading == 0) return step;
  Pose offset;
  offset.rotation = exp_so3({0, 0, heading});
  return offset * step * offset.inverse();
}

Vector6d MotionPrior::assumed(bool from_odometry) const {
  const double m = from_odometry ? config_.odometry_m_per_m : config_.without_odometry_m;
  const double rad = from_odometry ? config_.odometry_rad_per_m : config_.without_odometry_rad;
  Vector6d variance;
  variance << m * m, m * m, m * m, rad * rad, rad * rad, rad * rad;
  return variance;
}

Vector6d MotionPrior::variance(const Scatter& scatter, bool from_odometry) const {
  return (config_.steps_assumed * assumed(from_odometry) + scatter.sum) /
         (config_.steps_assumed + scatter.weight);
}

MotionPrior::Prediction MotionPrior::from_odometry(const Pose& odometry_step) const {
  Prediction prediction;
  const double size = size_m(odometry_step);
  prediction.last_from_next = corrected(odometry_step);
  prediction.variance = size * size * variance(odometry_, true);
  prediction.from_odometry = true;
  return prediction;
}

MotionPrior::Prediction MotionPrior::as_it_went() const {
  Prediction prediction;
  if (has_step_) prediction.last_from_next = last_step_;
  prediction.variance = variance(velocity_, false);
  prediction.is_blind = !has_step_;
  return prediction;
}

MotionPrior::Prediction MotionPrior::predict(const Pose* odometry_from_body) const {
  const bool has_pair = odometry_from_body != nullptr && has_odometry_;
  if (!has_pair || !is_odometry_trusted()) return as_it_went();
  return from_odometry(last_odometry_.inverse() * *odometry_from_body);
}

void MotionPrior::start(const Pose* odometry_from_body) {
  has_odometry_ = odometry_from_body != nullptr;
  if (has_odometry_) last_odometry_ = *odometry_from_body;
}

void MotionPrior::observe(const Prediction& prediction, const Pose& last_from_next,
                          const Pose* odometry_from_body, bool is_sure) {
  const bool has_pair = odometry_from_body != nullptr && has_odometry_;
  const Pose odometry_step = has_pair ? last_odometry_.inverse() * *odometry_from_body : Pose{};
  bool agrees = true;
  if (is_sure && has_pair) {
    constexpr double far_off = 100;  // ten standard deviations
    agrees = from_odometry(odometry_step).mahalanobis2(last_from_next) < far_off;
    distrust_ = std::clamp(distrust_ + (agrees ? -1 : 1), 0, most_distrust + 2);
  }
  if (is_sure) {
    const auto learn = [&](Scatter& scatter, const Prediction& predicted, double size) {
      const Vector6d now = variance(scatter, predicted.from_odometry);
      const Vector6d squares =
          deviation(predicted.last_from_next, last_from_next).cwiseAbs2() / (size * size);
      constexpr double most = 16;  // one step tells of four standard deviations at most
      const double fade = 1.0 - 1.0 / config_.steps_remembered;
      scatter.sum = fade * scatter.sum + squares.cwiseMin(most * now);
      scatter.weight = fade * scatter.weight + 1.0;
    };
    if (prediction.from_odometry && agrees) learn(odometry_, prediction, size_m(odometry_step));
    if (has_step_) learn(velocity_, as_it_went(), 1);
  }
  if (is_sure && has_pair && agrees) {
    const Eigen::Vector3d& m = last_from_next.translation_m;
    const Eigen::Vector3d& o = odometry_step.translation_m;
    cosine_m2_ += o.x() * m.x() + o.y() * m.y();
    sine_m2_ += o.x() * m.y() - o.y() * m.x();
    odometry_m2_ += o.x() * o.x() + o.y() * o.y();
    if (has_odometry_step_) {
      const auto motion = [](const Pose& step) {
        return Eigen::Vector2d(step.translation_m.head<2>().norm(), log_so3(step.rotation).z());
      };
      const Eigen::Vector2d change = motion(last_odometry_step_) - motion(odometry_step);
      delay_product_ += change.dot(motion(last_from_next) - motion(odometry_step));
      delay_square_ += change.squaredNorm();
    }
  }
  if (has_pair) last_odometry_step_ = odometry_step;
  has_odometry_step_ = has_pair;
  has_odometry_ = odometry_from_body != nullptr;
  if (has_odometry_) last_odometry_ = *odometry_from_body;
  if (!is_sure && has_step_) return;  // it goes on as it was last seen to go
  last_step_ = last_from_next;
  has_step_ = true;
}

}  // namespace alces
