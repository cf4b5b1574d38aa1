#include "alces/step_judge.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include <string>

#include "support/plain_scene.h"

using namespace alces;
using namespace alces::test;

namespace {

constexpr double usual_fit = 0.6;
constexpr StepVerification belief;

/// A match that nothing speaks against, where the odometry has it.
IcpResult good_match() {
  IcpResult match;
  match.verdict = IcpVerdict::converged;
  match.model_from_data = pose_at(1, 0, 0, 2);
  match.overlap = 0.8;
  match.fit = match.balanced_fit = usual_fit;
  return match;
}

MotionPrior::Prediction predicted_well(bool from_odometry = true) {
  MotionPrior::Prediction prediction;
  prediction.last_from_next = pose_at(1, 0, 0, 2);
  prediction.variance = Vector6d::Constant(1e-4);
  prediction.from_odometry = from_odometry;
  return prediction;
}

StepDoubt judged(const IcpResult& match, bool was_searched,
                 const MotionPrior::Prediction& prediction = predicted_well()) {
  return judge_step(match, prediction, usual_fit, was_searched, belief);
}

}  // namespace

TEST_CASE("a match that fits, rests and goes where it was predicted is believed, searched for or not") {
  for (const bool was_searched : {false, true}) {
    for (const bool from_odometry : {false, true})
      CHECK(judged(good_match(), was_searched, predicted_well(from_odometry)) == StepDoubt::none);
    IcpResult slid = good_match();  // along a corridor: the prior holds it there
    slid.verdict = IcpVerdict::degenerate;
    CHECK(judged(slid, was_searched) == StepDoubt::none);
  }
}

TEST_CASE("a match of too few pairs is none, whatever its other figures say") {
  IcpResult match = good_match();
  match.verdict = IcpVerdict::too_few_correspondences;
  CHECK(judged(match, false) == StepDoubt::no_match);
  CHECK(judged(match, true) == StepDoubt::no_match);
}

TEST_CASE("too little overlap is doubted from just below the bound, searched for or not") {
  IcpResult match = good_match();
  for (const bool was_searched : {false, true}) {
    match.overlap = belief.minimum_overlap;
    CHECK(judged(match, was_searched) == StepDoubt::none);
    match.overlap = std::nextafter(belief.minimum_overlap, 0.0);
    CHECK(judged(match, was_searched) == StepDoubt::overlap);
  }
}

TEST_CASE("a fit below what is usual asks for a search, and half of that will do after it") {
  const auto with_fit = [](double fit) {
    IcpResult match = good_match();
    match.balanced_fit = fit;
    return match;
  };
  CHECK(judged(with_fit(0.81 * usual_fit), false) == StepDoubt::none);
  CHECK(judged(with_fit(0.79 * usual_fit), false) == StepDoubt::fit);
  CHECK(judged(with_fit(0.79 * usual_fit), true) == StepDoubt::none);
  // An odometry agrees with it: less will do.
  CHECK(judged(with_fit(0.31 * usual_fit), true) == StepDoubt::none);
  CHECK(judged(with_fit(0.29 * usual_fit), true) == StepDoubt::fit);
  // However little is usual, some of it there must be.
  for (const bool was_searched : {false, true}) {
    CHECK(judge_step(with_fit(0.14), predicted_well(), 0.1, was_searched, belief) == StepDoubt::fit);
    CHECK(judge_step(with_fit(0.16), predicted_well(), 0.1, was_searched, belief) == StepDoubt::none);
  }
}

TEST_CASE("a match that still moved asks for a search, and after it is taken for what it is") {
  IcpResult match = good_match();
  match.verdict = IcpVerdict::iteration_limit;
  CHECK(judged(match, false) == StepDoubt::restless);
  CHECK(judged(match, true) == StepDoubt::none);
}

TEST_CASE("a motion that odometry does not explain is doubted, unless a search finds it fits as usual") {
  IcpResult match = good_match();
  const double sigma_m = 0.01;
  const double far_m = std::sqrt(belief.maximum_mahalanobis2) * sigma_m;
  for (const double share : {0.99, 1.01}) {
    match.model_from_data = predicted_well().last_from_next;
    match.model_from_data.translation_m.y() += share * far_m;
    const bool is_explained = share < 1;
    CHECK((judged(match, false) == StepDoubt::none) == is_explained);
    match.balanced_fit = usual_fit;
    CHECK(judged(match, true) == StepDoubt::none);
    match.balanced_fit = 0.7 * usual_fit;
    CHECK(judged(match, true) == (is_explained ? StepDoubt::none : StepDoubt::motion));
    match.balanced_fit = usual_fit;
  }
}

TEST_CASE("without odometry a surprising motion asks for a search, and is believed when that found it") {
  IcpResult match = good_match();
  match.balanced_fit = 0.7 * usual_fit;
  match.model_from_data = pose_at(-4, 2, 0, 50);
  CHECK(judged(match, true, predicted_well(false)) == StepDoubt::none);
  match.balanced_fit = usual_fit;
  CHECK(judged(match, false, predicted_well(false)) == StepDoubt::motion);
}

TEST_CASE("the very first step without odometry is always searched for, however well it fits") {
  MotionPrior::Prediction blind = predicted_well(false);
  blind.is_blind = true;
  blind.variance = Vector6d::Constant(100);
  CHECK(judged(good_match(), false, blind) == StepDoubt::motion);
  CHECK(judged(good_match(), true, blind) == StepDoubt::none);
}

TEST_CASE("what is usual follows the steps of the drive, the first ones fast") {
  UsualFit usual;
  const double assumed = usual.fit();
  usual.learn(0.9);
  CHECK(usual.fit() == Approx(assumed + (0.9 - assumed) / 4));  // the start counts as three steps
  for (int i = 0; i < 200; ++i) usual.learn(0.9);
  CHECK(usual.fit() == Approx(0.9).margin(0.02));
  for (int i = 0; i < 35; ++i) usual.learn(0.3);  // half of the last fifty
  CHECK(usual.fit() == Approx(0.6).margin(0.03));
}

TEST_CASE("what a fit lacks of the usual one counts the more the more steps have shown what is usual") {
  UsualFit usual;
  CHECK(usual.lost(0.1) == 0);  // nothing has been seen yet
  usual.learn(0.6);
  const double early = usual.lost(0.3);
  for (int i = 0; i < 200; ++i) usual.learn(0.6);
  CHECK(early == Approx(0.5 / 4));
  CHECK(usual.lost(0.3) == Approx(0.5).margin(0.04));
  CHECK(usual.lost(0.7) == 0);
  CHECK(usual.lost(0) <= 1);
}

TEST_CASE("every verdict and every doubt has words of its own") {
  std::set<std::string> words;
  for (const StepVerdict verdict :
       {StepVerdict::first, StepVerdict::believed, StepVerdict::found, StepVerdict::against_odometry,
        StepVerdict::on_odometry, StepVerdict::apart, StepVerdict::rejoined}) {
    words.insert(to_string(verdict));
  }
  CHECK(words.size() == 7);
  for (const StepDoubt doubt : {StepDoubt::none, StepDoubt::no_match, StepDoubt::overlap, StepDoubt::fit,
                                StepDoubt::restless, StepDoubt::motion}) {
    words.insert(to_string(doubt));
  }
  CHECK(words.size() == 13);
}
