// Where the next scan will be found, and how sure that is: from the odometry or, without one, from the last
// step (constant velocity).
//
// What a source is worth is learned from the steps that were matched and believed: a constant heading offset
// between the odometry's body and the scanner, its scale, a constant offset in time, and how far off
// predictions are in each direction. An odometry of a plane that never climbs is found out like this, too.
//
// Cost: O(1) a step. Memory: some 400 bytes, no arena.
#pragma once

#include <cmath>

#include "alces/pose.h"

namespace alces {

/// What is assumed of predictions before the drive has shown better, as standard deviations. Wide on purpose:
/// as sure as `steps_assumed` steps that were seen.
struct MotionUncertainty {
  double odometry_m_per_m = 0.1;       ///< a metre driven, each axis
  double odometry_rad_per_m = 0.05;    ///< a metre driven, each axis; a turn by 1 rad counts as a metre
  double without_odometry_m = 1.0;     ///< a step, each axis: what changes from one step to the next
  double without_odometry_rad = 0.15;  ///< a step, each axis
  double steps_assumed = 5;
  double steps_remembered = 100;  ///< older ones fade: the ground changes
  bool learn_heading = true;      ///< of the scanner in the odometry's body
  bool learn_delay = true;        ///< of the odometry's stamps
};

class MotionPrior {
 public:
  explicit MotionPrior(const MotionUncertainty& config = {}) : config_(config) {}

  struct Prediction {
    Pose last_from_next;
    Vector6d variance = Vector6d::Zero();  ///< of (translation m^2, rotation rad^2), axes of the next scan
    bool from_odometry = false;
    bool is_blind = false;  ///< the very first step, and no odometry: nothing is known of the motion
    [[nodiscard]] double sigma_m() const { return std::sqrt(variance.head<3>().maxCoeff()); }
    [[nodiscard]] double sigma_rad() const { return std::sqrt(variance.tail<3>().maxCoeff()); }
    /// The squared length of a step's deviation from the prediction, in standard deviations (6 degrees of
    /// freedom); `match_variance` is added to the prediction's.
    [[nodiscard]] double mahalanobis2(const Pose& last_from_next_matched) const;
  };

  /// `odometry_from_body`: of the next scan, in the odometry's frame; null: none.
  [[nodiscard]] Prediction predict(const Pose* odometry_from_body) const;

  /// As it went: constant velocity, whatever the odometry says.
  [[nodiscard]] Prediction as_it_went() const;

  /// The first scan: there is no step yet.
  void start(const Pose* odometry_from_body);

  /// The step was matched. `is_sure`: it is believed on its own, and what it tells of predictions is learned.
  /// An odometry that contradicts three sure steps is not asked (frozen, or its wheels spin) until it has
  /// agreed as often.
  void observe(const Prediction& prediction, const Pose& last_from_next, const Pose* odometry_from_body,
               bool is_sure);

  [[nodiscard]] bool is_odometry_trusted() const { return distrust_ < most_distrust; }

  /// Of the scanner in the odometry's body, rad; 0 until some metres tell.
  [[nodiscard]] double heading_rad() const;
  /// Metres of the scanner's motion a metre of the odometry: worn tyres.
  [[nodiscard]] double scale() const;
  /// By which share of a step the odometry's stamps are late (positive) or early; 0 until it is sure.
  [[nodiscard]] double delay_steps() const;

 private:
  // Second moments of the deviations in units of what grows with the step, and how many steps they stand for.
  struct Scatter {
    Vector6d sum = Vector6d::Zero();
    double weight = 0;
  };
  [[nodiscard]] Prediction from_odometry(const Pose& odometry_step) const;
  [[nodiscard]] Vector6d assumed(bool from_odometry) const;
  [[nodiscard]] Vector6d variance(const Scatter& scatter, bool from_odometry) const;
  [[nodiscard]] Pose corrected(const Pose& odometry_step) const;

  static constexpr int most_distrust = 3;

  MotionUncertainty config_;
  int distrust_ = 0;
  Scatter odometry_;
  Scatter velocity_;
  Pose last_odometry_;
  Pose last_odometry_step_;
  Pose last_step_;
  bool has_odometry_ = false;
  bool has_odometry_step_ = false;
  bool has_step_ = false;
  double cosine_m2_ = 0;  // of the heading: sums over steps
  double sine_m2_ = 0;
  double odometry_m2_ = 0;
  double delay_product_ = 0;  // of the delay: sums over steps
  double delay_square_ = 0;
};

}  // namespace alces
