#include "alces/deskew.h"

#include <algorithm>
#include <cmath>

namespace alces {
namespace {

bool is_same(const Pose& a, const Pose& b) {
  return a.translation_m == b.translation_m && a.rotation.coeffs() == b.rotation.coeffs();
}

/// No body does; arithmetic with more would overflow.
bool is_possible(const Vector6d& twist_per_s) {
  return twist_per_s.allFinite() && twist_per_s.cwiseAbs().maxCoeff() <= farthest_place_m;
}

}  // namespace

const char* to_string(DeskewStatus status) {
  switch (status) {
    case DeskewStatus::ok:
      return "ok";
    case DeskewStatus::no_motion:
      return "the motion is not known: fewer than two poses";
    case DeskewStatus::no_capacity:
      return "more poses than there is room for";
    case DeskewStatus::bad_pose:
      return "a pose or a speed is none";
    case DeskewStatus::times_not_growing:
      return "the times of the poses do not grow";
    case DeskewStatus::times_missing:
      return "not every point has a time";
    case DeskewStatus::time_not_finite:
      return "a time is no number";
    case DeskewStatus::outside_of_motion:
      return "a time lies outside of the motion that is known";
  }
  return "unknown status";
}

void Deskew::clear() {
  count_ = 0;
  is_constant_ = false;
}

DeskewStatus Deskew::add_pose(double time_s, const Pose& fixed_from_body) {
  if (is_constant_) clear();
  if (count_ == knots_.size()) return DeskewStatus::no_capacity;
  if (!is_valid(fixed_from_body)) return DeskewStatus::bad_pose;
  if (!std::isfinite(time_s)) return DeskewStatus::times_not_growing;
  Knot knot{time_s, fixed_from_body, Vector6d::Zero()};
  if (count_ > 0) {
    Knot& before = knots_[count_ - 1];
    const double step_s = time_s - before.time_s;
    if (!(step_s > 0)) return DeskewStatus::times_not_growing;
    // Poses that are the same to the bit are a body that stands, which rounding must not turn.
    Vector6d twist = Vector6d::Zero();
    if (!is_same(before.fixed_from_body, fixed_from_body))
      twist = log_se3(before.fixed_from_body.inverse() * fixed_from_body) / step_s;
    if (!is_possible(twist)) return DeskewStatus::bad_pose;
    before.twist_per_s = knot.twist_per_s = twist;  // behind the last pose it goes on
  }
  knots_[count_++] = knot;
  return DeskewStatus::ok;
}

DeskewStatus Deskew::set_twist(const Vector6d& twist_per_s) {
  clear();
  if (knots_.empty()) return DeskewStatus::no_capacity;
  if (!is_possible(twist_per_s)) return DeskewStatus::bad_pose;
  knots_[0] = {0, Pose{}, twist_per_s};
  count_ = 1;
  is_constant_ = true;
  return DeskewStatus::ok;
}

DeskewStatus Deskew::set_gyro(std::span<const GyroSample> samples, const Eigen::Vector3d& body_velocity_m_s,
                              const Eigen::Vector3d& bias_rad_s) {
  clear();
  if (!body_velocity_m_s.allFinite() || !bias_rad_s.allFinite()) return DeskewStatus::bad_pose;
  Pose fixed_from_body;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (i > 0) {
      const double step_s = samples[i].time_s - samples[i - 1].time_s;
      Vector6d twist;
      twist.head<3>() = body_velocity_m_s;
      twist.tail<3>() = 0.5 * (samples[i - 1].rate_rad_s + samples[i].rate_rad_s) - bias_rad_s;
      if (!twist.isZero(0)) fixed_from_body = fixed_from_body * exp_se3(twist * step_s);
    }
    const DeskewStatus added = samples[i].rate_rad_s.allFinite()
                                   ? add_pose(samples[i].time_s, fixed_from_body)
                                   : DeskewStatus::bad_pose;
    if (added != DeskewStatus::ok) {
      clear();
      return added;
    }
  }
  return count_ < 2 ? DeskewStatus::no_motion : DeskewStatus::ok;
}

bool Deskew::is_inside(double time_s) const {
  return is_constant_ || (time_s >= knots_[0].time_s - config_.longest_extrapolation_s &&
                          time_s <= knots_[count_ - 1].time_s + config_.longest_extrapolation_s);
}

Pose Deskew::at(double time_s) const {
  const std::span<const Knot> knots = std::span<const Knot>(knots_).first(count_);
  const auto behind = std::upper_bound(knots.begin(), knots.end(), time_s,
                                       [](double t, const Knot& knot) { return t < knot.time_s; });
  const Knot& knot = behind == knots.begin() ? knots.front() : *(behind - 1);
  return knot.fixed_from_body * exp_se3(knot.twist_per_s * (time_s - knot.time_s));
}

bool Deskew::stands() const {
  return std::ranges::all_of(std::span<const Knot>(knots_).first(count_),
                             [](const Knot& knot) { return knot.twist_per_s.isZero(0); });
}

DeskewStatus Deskew::pose_at(double time_s, Pose& fixed_from_body) const {
  if (count_ == 0 || (count_ < 2 && !is_constant_)) return DeskewStatus::no_motion;
  if (!std::isfinite(time_s)) return DeskewStatus::time_not_finite;
  if (!is_inside(time_s)) return DeskewStatus::outside_of_motion;
  fixed_from_body = at(time_s);
  return DeskewStatus::ok;
}

DeskewStatus Deskew::apply(std::span<Point> points, std::span<const float> time_s,
                           double reference_time_s) const {
  if (points.size() != time_s.size()) return DeskewStatus::times_missing;
  Pose fixed_from_reference;
  const DeskewStatus known = pose_at(reference_time_s, fixed_from_reference);
  if (known != DeskewStatus::ok) return known;
  for (const float t : time_s) {
    if (!std::isfinite(t)) return DeskewStatus::time_not_finite;
    if (!is_inside(static_cast<double>(t))) return DeskewStatus::outside_of_motion;
  }
  if (stands()) return DeskewStatus::ok;

  const Pose reference_from_fixed = fixed_from_reference.inverse();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_m = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i == 0 || time_s[i] != time_s[i - 1]) {
      const Pose reference_from_body = reference_from_fixed * at(static_cast<double>(time_s[i]));
      rotation = reference_from_body.rotation.toRotationMatrix();
      translation_m = reference_from_body.translation_m;
    }
    Point& point = points[i];
    if (!is_finite(point)) continue;
    const Eigen::Vector3d measured = Eigen::Vector3f(point.x, point.y, point.z).cast<double>();
    const Eigen::Vector3f moved = (rotation * measured + translation_m).cast<float>();
    point = {moved.x(), moved.y(), moved.z()};
  }
  return DeskewStatus::ok;
}

}  // namespace alces
