#include "alces/motion_prior.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <vector>

#include "alces_platform/sim/random.h"
#include "support/plain_scene.h"

using namespace alces;
using namespace alces::test;
using alces::sim::Random;

namespace {

constexpr double deg = 3.14159265358979323846 / 180;

/// A vehicle that curves about and changes its speed: its steps, as the scanner makes them.
std::vector<Pose> steps(std::size_t count) {
  std::vector<Pose> all;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = 0.4 * static_cast<double>(i);
    all.push_back(pose_at(1.5 + std::sin(t), 0, 0, 6 * std::cos(0.7 * t)));
  }
  return all;
}

/// Drives a prior along: every step is matched as it is, while odometry sees `seen_as(step, number)`.
struct Bench {
  MotionPrior prior;
  Pose odometry;
  MotionPrior::Prediction last;

  explicit Bench(const MotionUncertainty& config = {}) : prior(config) { prior.start(&odometry); }

  void go(const Pose& step, const Pose& seen, bool is_sure = true) {
    odometry = odometry * seen;
    last = prior.predict(&odometry);
    prior.observe(last, step, &odometry, is_sure);
  }
  void go_all(const std::vector<Pose>& way, const std::function<Pose(const Pose&)>& seen_as) {
    for (const Pose& step : way) go(step, seen_as(step));
  }
};

}  // namespace

TEST_CASE("a perfect odometry is repeated to the letter, and gets surer with every step") {
  Bench bench;
  const std::vector<Pose> way = steps(40);
  double sigma_m = 1e9;
  for (std::size_t i = 0; i < way.size(); ++i) {
    bench.go(way[5], way[5]);  // the same step again and again: its size stays
    CAPTURE(i);
    CHECK(bench.last.from_odometry);
    CHECK_FALSE(bench.last.is_blind);
    CHECK(distance_m(bench.last.last_from_next, way[5]) < 1e-9);
    CHECK(bench.last.sigma_m() < sigma_m);
    sigma_m = bench.last.sigma_m();
  }
  CHECK(sigma_m > 0);
  CHECK(bench.prior.heading_rad() == Approx(0).margin(1e-9));
  CHECK(bench.prior.scale() == Approx(1));
  CHECK(bench.prior.delay_steps() == Approx(0).margin(1e-9));
}

TEST_CASE("a scanner mounted askew is found out, and steps are predicted as the scanner makes them") {
  const MotionUncertainty knows;
  MotionUncertainty does_not = knows;
  does_not.learn_heading = false;
  for (const double askew_deg : {12.0, -12.0, 25.0}) {
    for (const MotionUncertainty& config : {knows, does_not}) {
      Bench bench(config);
      const Pose body_from_scanner = pose_at(0, 0, 0, askew_deg);
      bench.go_all(steps(30),
                   [&](const Pose& step) { return body_from_scanner * step * body_from_scanner.inverse(); });
      CAPTURE(askew_deg, config.learn_heading);
      const double off_m = distance_m(bench.last.last_from_next, steps(30).back());
      if (config.learn_heading) {
        CHECK(bench.prior.heading_rad() == Approx(-askew_deg * deg).margin(0.2 * deg));
        CHECK(off_m < 0.02);
      } else {
        CHECK(bench.prior.heading_rad() == 0);
        CHECK(off_m > 0.1);
      }
    }
  }
}

TEST_CASE("worn tyres are found out: the scale comes near the true one, and predictions follow it") {
  for (const double scale : {0.9, 1.1}) {
    Bench bench;
    bench.go_all(steps(60), [&](const Pose& step) {
      Pose seen = step;
      seen.translation_m /= scale;
      return seen;
    });
    CAPTURE(scale);
    CHECK(bench.prior.scale() == Approx(scale).margin(0.005));
    CHECK(distance_m(bench.last.last_from_next, steps(60).back()) < 0.01);
  }
}

TEST_CASE("odometry whose stamps are late by a share of a step is found out, and predicted for") {
  for (const double delay : {0.3, 0.6}) {
    const std::vector<Pose> way = steps(80);
    MotionUncertainty does_not;
    does_not.learn_delay = false;
    Bench bench;
    Bench stubborn(does_not);
    double off_m = 0;
    double stubborn_m = 0;
    for (std::size_t i = 1; i < way.size(); ++i) {
      const Pose seen = interpolate(way[i], way[i - 1], delay);  // a part of it is still the step before
      // The true step is ahead of what is seen: matched is the next one's beginning.
      bench.go(interpolate(way[i], way[i - 1], 2 * delay), seen);
      stubborn.go(interpolate(way[i], way[i - 1], 2 * delay), seen);
      if (i < 40) continue;
      const Pose step = interpolate(way[i], way[i - 1], 2 * delay);
      off_m += distance_m(bench.last.last_from_next, step);
      stubborn_m += distance_m(stubborn.last.last_from_next, step);
    }
    CAPTURE(delay, bench.prior.delay_steps(), off_m, stubborn_m);
    CHECK(bench.prior.delay_steps() > 0.1);
    CHECK(stubborn.prior.delay_steps() == 0);
    CHECK(off_m < 0.6 * stubborn_m);
  }
}

TEST_CASE("an odometry of a plane is found out: height is left open, and the way is not") {
  MotionUncertainty config;
  Bench bench(config);
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    Pose step = pose_at(2, 0, 0.3 * random.normal(), 0);
    bench.go(step, pose_at(2, 0, 0, 0));
  }
  const Vector6d sigma = bench.last.variance.cwiseSqrt();
  CAPTURE(sigma.transpose());
  CHECK(sigma[2] == Approx(0.3).epsilon(0.25));
  CHECK(sigma[0] < 0.2 * sigma[2]);  // what was assumed of it at first fades slowly
  CHECK(sigma[1] < 0.2 * sigma[2]);
}

TEST_CASE("the variance that is learned is that of the deviations, and grows with the step's size") {
  Random random(2);
  Bench bench;
  const double off_per_m = 0.04;
  for (int i = 0; i < 500; ++i) {
    Pose step = pose_at(1.8, 0, 0, 0);
    step.translation_m += 2 * off_per_m * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    bench.go(step, pose_at(1.8, 0, 0, 0));
  }
  const Vector6d sigma = bench.last.variance.cwiseSqrt();
  CAPTURE(sigma.transpose());
  for (int axis = 0; axis < 3; ++axis) CHECK(sigma[axis] == Approx(2 * off_per_m).epsilon(0.25));
  const Pose far = bench.odometry * pose_at(7.8, 0, 0, 0);
  const MotionPrior::Prediction longer = bench.prior.predict(&far);
  CHECK(longer.sigma_m() == Approx(4 * bench.last.sigma_m()).epsilon(0.05));
  // ... so that what is usual has a Mahalanobis length of its degrees of freedom, and ten times that has not.
  Pose usual = longer.last_from_next;
  usual.translation_m += 0.32 * Eigen::Vector3d(1, -1, 1);
  CHECK(longer.mahalanobis2(usual) == Approx(3).margin(1.5));
}

TEST_CASE("how it went is what was last seen for sure: a step on odometry alone says nothing of it") {
  Bench bench;
  for (int i = 0; i < 5; ++i) bench.go(pose_at(1.5, 0, 0, 10), pose_at(1.5, 0, 0, 10));
  bench.go(Pose{}, Pose{}, false);  // the odometry has frozen, and nothing is seen
  CHECK(distance_m(bench.prior.as_it_went().last_from_next, pose_at(1.5, 0, 0, 10)) < 1e-9);
  bench.go(pose_at(0.5, 0, 0, 0), pose_at(0.5, 0, 0, 0), true);
  CHECK(distance_m(bench.prior.as_it_went().last_from_next, pose_at(0.5, 0, 0, 0)) < 1e-9);
}

TEST_CASE("a frozen odometry is distrusted after three sure steps, and trusted again once it agrees") {
  Bench bench;
  const Pose step = pose_at(2, 0, 0, 3);
  for (int i = 0; i < 20; ++i) bench.go(step, step);
  const double sigma_m = bench.last.sigma_m();
  for (int i = 0; i < 3; ++i) {
    CHECK(bench.prior.is_odometry_trusted());
    bench.go(step, Pose{});  // it stands still
    CHECK(bench.last.from_odometry);
  }
  CHECK_FALSE(bench.prior.is_odometry_trusted());
  for (int i = 0; i < 10; ++i) {
    bench.go(step, Pose{});
    CHECK_FALSE(bench.last.from_odometry);
    CHECK(distance_m(bench.last.last_from_next, step) < 1e-9);  // as it went
  }
  int until_trusted = 0;
  while (!bench.prior.is_odometry_trusted() && until_trusted < 50) {
    bench.go(step, step);
    ++until_trusted;
  }
  CHECK(until_trusted >= 2);
  CHECK(until_trusted <= 5);
  bench.go(step, step);
  CHECK(bench.last.from_odometry);
  // What it said while it was frozen was not learned: it is as good as it was.
  CHECK(bench.last.sigma_m() < 1.05 * sigma_m);
  CHECK(bench.prior.scale() == Approx(1).margin(1e-6));
}

TEST_CASE("steps that are not sure teach nothing, neither trust nor distrust") {
  Bench bench;
  const Pose step = pose_at(2, 0, 0, 3);
  for (int i = 0; i < 20; ++i) bench.go(step, step);
  const Vector6d variance = bench.last.variance;
  for (int i = 0; i < 20; ++i) bench.go(step, pose_at(0.1, 1, 0, 40), false);
  CHECK(bench.prior.is_odometry_trusted());
  bench.go(step, step);
  CHECK((bench.last.variance - variance).norm() < 0.1 * variance.norm());
}

TEST_CASE("without odometry the next step is like the last, blindly for the first one") {
  MotionPrior prior;
  prior.start(nullptr);
  const MotionPrior::Prediction first = prior.predict(nullptr);
  CHECK(first.is_blind);
  CHECK_FALSE(first.from_odometry);
  CHECK(first.last_from_next.translation_m.isZero(0));
  prior.observe(first, pose_at(2, 0.1, 0, 5), nullptr, true);
  const MotionPrior::Prediction second = prior.predict(nullptr);
  CHECK_FALSE(second.is_blind);
  CHECK_FALSE(second.from_odometry);
  CHECK(distance_m(second.last_from_next, pose_at(2, 0.1, 0, 5)) < 1e-12);
  // One odometry pose is no step: as it went. Two are.
  const Pose here = pose_at(50, 3, 0, 10);
  CHECK_FALSE(prior.predict(&here).from_odometry);
  prior.observe(second, pose_at(2, 0.1, 0, 5), &here, true);
  const Pose there = here * pose_at(1, 0, 0, 0);
  CHECK(prior.predict(&there).from_odometry);
  CHECK_FALSE(prior.as_it_went().from_odometry);
}

TEST_CASE("a steady drive makes constant velocity sure, an unsteady one does not") {
  const auto sigma_of = [](double wobble_m) {
    Random random(3);
    MotionPrior prior;
    prior.start(nullptr);
    for (int i = 0; i < 200; ++i) {
      const MotionPrior::Prediction prediction = prior.predict(nullptr);
      prior.observe(prediction, pose_at(2 + wobble_m * random.normal(), 0, 0, 0), nullptr, true);
    }
    return std::sqrt(prior.predict(nullptr).variance[0]);
  };
  const double steady_m = sigma_of(0);
  const double unsteady_m = sigma_of(0.5);
  CAPTURE(steady_m, unsteady_m);
  CHECK(steady_m < 0.25);
  CHECK(unsteady_m == Approx(0.5 * std::sqrt(2.0)).epsilon(0.3));
}
