#include "alces/icp.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <list>
#include <memory>
#include <vector>

#include "alces/horn.h"
#include "support/in_block.h"
#include "support/plain_scene.h"
#include "support/sampled_scan.h"

using namespace alces;
using namespace alces::test;
using alces::sim::Random;

namespace {

constexpr double deg = 3.14159265358979323846 / 180;

using Scan = SampledScan;

IcpConfig config_for(IcpMetric metric) {
  IcpConfig config;
  config.metric = metric;
  if (metric == IcpMetric::point_to_point) {
    config.maximum_iterations = 60;
    config.robust_scale_m = 0;
  }
  return config;
}

IcpResult match(const Scan& model, const Scan& data, const Pose& initial, const IcpConfig& config,
                std::span<IcpIteration> trace = {}) {
  InBlock<Icp> icp(4096U);
  const IcpScan model_scan = model.at();
  const IcpScan data_scan = data.at();
  return icp->match({&model_scan, 1}, {&data_scan, 1}, initial, config, nullptr, trace);
}

bool is_same(const Pose& a, const Pose& b) {
  return a.translation_m == b.translation_m && a.rotation.coeffs() == b.rotation.coeffs();
}

}  // namespace

TEST_CASE("ICP finds how two scans of a room and of a street lie to each other, by both metrics") {
  struct Place {
    Scene scene;
    double reach_m;
    std::size_t points;
  };
  const std::array places = {Place{room(), 12, 4000}, Place{street(), 25, 8000}};
  for (std::size_t place = 0; place < places.size(); ++place) {
    Random random(5 + place);
    for (int round = 0; round < 4; ++round) {
      const Pose map_from_model =
          pose_at(random.uniform(-1, 1), random.uniform(-1, 1), 1, random.uniform(-180, 180));
      const Pose model_from_data =
          pose_at(random.uniform(-0.5, 0.5), random.uniform(-0.4, 0.4), random.uniform(-0.1, 0.1),
                  random.uniform(-6, 6), random.uniform(-2, 2), random.uniform(-2, 2));
      const auto seed = static_cast<std::uint64_t>(100 * round);
      const Scan model(
          places[place].scene.scan(map_from_model, places[place].points, places[place].reach_m, 0.01, seed));
      const Scan data(places[place].scene.scan(map_from_model * model_from_data, places[place].points,
                                               places[place].reach_m, 0.01, seed + 1));
      for (const IcpMetric metric : {IcpMetric::surface, IcpMetric::point_to_point}) {
        const IcpResult result = match(model, data, Pose{}, config_for(metric));
        CAPTURE(place, round, static_cast<int>(metric), to_string(result.verdict), result.iterations,
                result.rms_m);
        CHECK((result.verdict == IcpVerdict::converged ||
               (metric == IcpMetric::point_to_point && result.verdict == IcpVerdict::iteration_limit)));
        // points drawn anew never meet: plain distances keep a noise of their spacing, surfaces slide
        CHECK(distance_m(result.model_from_data, model_from_data) <
              (metric == IcpMetric::surface ? 0.02 : 0.08));
        CHECK(distance_rad(result.model_from_data, model_from_data) <
              (metric == IcpMetric::surface ? 0.2 : 1.0) * deg);
        CHECK(result.overlap > 0.7);
        CHECK(result.overlap <= 1);  // of the data's samples alone; the pairs are the model's, too
        CHECK(result.overlap ==
              Approx(static_cast<double>(result.correspondences) / result.queries).margin(0.02));
        if (metric == IcpMetric::surface) CHECK(result.rms_m < 0.05);
        CHECK(result.weak_direction.isZero(0));
      }
    }
  }
}

TEST_CASE("the same points without noise come to lie on themselves") {
  const std::vector<Point> points = room().scan(pose_at(0, 0, 1, 20), 4000, 12, 0, 3);
  const Pose model_from_data = pose_at(0.2, -0.1, 0.05, 3, 1, -1);
  std::vector<Point> moved;
  for (const Point& point : points) moved.push_back(as_point(model_from_data.inverse() * as_vector(point)));
  const Scan model(points);
  const Scan data(moved);
  for (const IcpMetric metric : {IcpMetric::surface, IcpMetric::point_to_point}) {
    IcpConfig config = config_for(metric);
    config.translation_epsilon_m = 1e-5F;
    config.rotation_epsilon_rad = 1e-6F;
    config.maximum_iterations = 100;
    const IcpResult result = match(model, data, Pose{}, config);
    CAPTURE(static_cast<int>(metric), result.iterations);
    CHECK(result.verdict == IcpVerdict::converged);
    CHECK(distance_m(result.model_from_data, model_from_data) < 2e-4);
    CHECK(distance_rad(result.model_from_data, model_from_data) < 1e-4);
    CHECK(result.rms_m < 1e-3);
    CHECK(result.correspondences == result.queries);
  }
}

TEST_CASE("equal inputs give equal bits") {
  const Scan model(room().scan(pose_at(0, 0, 1, 0), 3000, 12, 0.01, 1));
  const Scan data(room().scan(pose_at(0.3, 0.2, 1, 4), 3000, 12, 0.01, 2));
  for (const IcpMetric metric : {IcpMetric::surface, IcpMetric::point_to_point}) {
    const IcpResult one = match(model, data, Pose{}, config_for(metric));
    const IcpResult two = match(model, data, Pose{}, config_for(metric));
    CHECK(is_same(one.model_from_data, two.model_from_data));
    CHECK(one.information == two.information);
    CHECK(one.sums.mtm == two.sums.mtm);
  }
}

TEST_CASE("Horn's closed form is exact on pairs without noise, for any rotation") {
  Random random(9);
  for (int round = 0; round < 200; ++round) {
    Pose model_from_data;
    model_from_data.translation_m = {random.uniform(-50, 50), random.uniform(-50, 50),
                                     random.uniform(-50, 50)};
    model_from_data.rotation =
        exp_so3(Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized() *
                (round < 20 ? 3.14159265358979 : random.uniform(0, 3.1415926)));
    HornSums sums;
    const bool is_planar = round % 4 == 0;
    for (int i = 0; i < (round % 3 == 0 ? 3 : 40); ++i) {
      const Eigen::Vector3d d(random.uniform(-10, 10), random.uniform(-10, 10),
                              is_planar ? 1 : random.uniform(-10, 10));
      sums.add(model_from_data * d, d, random.uniform(0.1, 2));
    }
    // pairs that do not belong are given no weight
    for (int i = 0; i < 5; ++i) sums.add({random.uniform(), 100, 3}, {5, random.uniform(), -40}, 0);
    const Pose found = horn(sums);
    CAPTURE(round);
    CHECK(distance_m(found, model_from_data) < 1e-9);
    CHECK(distance_rad(found, model_from_data) < 1e-10);
    CHECK(std::abs(found.rotation.norm() - 1) < 1e-12);
  }
}

TEST_CASE("Horn's closed form is the minimum: no small motion makes the weighted sum smaller") {
  Random random(10);
  std::vector<Eigen::Vector3d> d;
  std::vector<Eigen::Vector3d> m;
  std::vector<double> w;
  HornSums sums;
  const Pose truth = pose_at(1, 2, 3, 30, 20, 10);
  for (int i = 0; i < 60; ++i) {
    d.emplace_back(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5));
    m.push_back(truth * d.back() + 0.3 * Eigen::Vector3d(random.normal(), random.normal(), random.normal()));
    w.push_back(random.uniform(0.1, 1));
    sums.add(m.back(), d.back(), w.back());
  }
  const auto cost = [&](const Pose& pose) {
    double sum = 0;
    for (std::size_t i = 0; i < d.size(); ++i) sum += w[i] * (m[i] - pose * d[i]).squaredNorm();
    return sum;
  };
  const Pose found = horn(sums);
  for (int axis = 0; axis < 6; ++axis) {
    for (const double step : {-1e-3, 1e-3})
      CHECK(cost(exp_se3(step * Vector6d::Unit(axis)) * found) > cost(found));
  }
}

TEST_CASE("with too few correspondences nothing moves") {
  const Scan model(room().scan(pose_at(0, 0, 1, 0), 2000, 12, 0.01, 1));
  const Scan data(room().scan(pose_at(0, 0, 1, 0), 2000, 12, 0.01, 2));
  const Scan few(room().scan(pose_at(0, 0, 1, 0), 49, 12, 0.01, 3));
  const Scan one(std::vector<Point>{{1, 2, 3}});
  for (const IcpMetric metric : {IcpMetric::surface, IcpMetric::point_to_point}) {
    const IcpConfig config = config_for(metric);
    const Pose away = pose_at(500, 0, 0, 45);
    const IcpResult far_away = match(model, data, away, config);
    CHECK(far_away.verdict == IcpVerdict::too_few_correspondences);
    CHECK(is_same(far_away.model_from_data, away));
    CHECK(far_away.correspondences == 0);
    CHECK(far_away.overlap == 0);
    CHECK(far_away.iterations == 1);

    const Pose near = pose_at(0.01, 0, 0, 0);
    CHECK(match(model, few, near, config).verdict == IcpVerdict::too_few_correspondences);
    CHECK(is_same(match(model, few, near, config).model_from_data, near));
    CHECK(match(model, one, near, config).verdict == IcpVerdict::too_few_correspondences);
    CHECK(is_same(match(one, one, near, config).model_from_data, near));
  }
  InBlock<Icp> icp(100U);
  const IcpScan scan = model.at();
  const Pose initial = pose_at(1, 2, 3, 4);
  const IcpResult without_model = icp->match({}, {&scan, 1}, initial, {});
  CHECK(without_model.verdict == IcpVerdict::too_few_correspondences);
  CHECK(is_same(without_model.model_from_data, initial));
  const IcpResult without_data = icp->match({&scan, 1}, {}, initial, {});
  CHECK(without_data.verdict == IcpVerdict::too_few_correspondences);
  CHECK(is_same(without_data.model_from_data, initial));
}

TEST_CASE("in a corridor the way along it is named as undetermined, and nothing moves along it") {
  // noise-free walls, so that nothing but the points' own grain could tell where along the corridor a scan
  // was taken
  const Scan model(corridor().scan(pose_at(0, 0, 1, 0), 6000, 12, 0, 1));
  const Scan data(corridor().scan(pose_at(0, 0, 1, 0), 6000, 12, 0, 2));
  IcpConfig config;
  config.rough_weight = 0;
  const Pose initial = pose_at(0.4, 0.15, 0.05, 1.5, 0.5, -0.5);
  const IcpResult result = match(model, data, initial, config);
  CHECK(result.verdict == IcpVerdict::degenerate);
  CHECK(std::abs(result.weak_direction[0]) > 0.98);
  CHECK(result.weak_direction.norm() == Approx(1));
  CHECK(result.model_from_data.translation_m.y() == Approx(0).margin(0.01));
  CHECK(result.model_from_data.translation_m.z() == Approx(0).margin(0.01));
  CHECK(distance_rad(result.model_from_data, Pose{}) < 0.1 * deg);
  CHECK(std::abs(result.model_from_data.translation_m.x() - 0.4) < 0.02);  // along: as it was
}

TEST_CASE("on a single plane the match is degenerate, and only height, roll and pitch are corrected") {
  Scene plane;
  plane.rectangle({-100, -100, 0}, {200, 0, 0}, {0, 200, 0});
  const Scan model(plane.scan(pose_at(0, 0, 1, 0), 4000, 10, 0, 1));
  const Scan data(plane.scan(pose_at(0, 0, 1, 0), 4000, 10, 0, 2));
  IcpConfig config;
  config.rough_weight = 0;
  const IcpResult result = match(model, data, pose_at(0.3, -0.2, 0.2, 5, 1, 1), config);
  CHECK(result.verdict == IcpVerdict::degenerate);
  CHECK_FALSE(result.weak_direction.isZero());
  CHECK(result.model_from_data.translation_m.z() == Approx(0).margin(5e-3));
  const Eigen::Vector3d up = result.model_from_data.rotation * Eigen::Vector3d::UnitZ();
  CHECK(std::acos(std::min(1.0, up.z())) < 0.1 * deg);
  CHECK(result.model_from_data.translation_m.x() == Approx(0.3).margin(0.03));
  CHECK(result.model_from_data.translation_m.y() == Approx(-0.2).margin(0.03));
  const Eigen::Vector3d ahead = result.model_from_data.rotation * Eigen::Vector3d::UnitX();
  CHECK(std::atan2(ahead.y(), ahead.x()) == Approx(5 * deg).margin(0.2 * deg));
}

TEST_CASE("scans that share less than half of what they see are matched by what they share") {
  const Scene scene = street();
  const Scan model(scene.scan(pose_at(-8, 0, 1, 0), 8000, 14, 0.01, 1));
  const Scan data(scene.scan(pose_at(4, 0.5, 1, 5), 8000, 14, 0.01, 2));
  const Pose truth = pose_at(-8, 0, 1, 0).inverse() * pose_at(4, 0.5, 1, 5);
  const IcpResult result = match(model, data, pose_at(0.2, -0.15, 0.05, 2) * truth, {});
  CHECK(result.overlap < 0.75);
  CHECK(result.verdict == IcpVerdict::converged);
  CHECK(distance_m(result.model_from_data, truth) < 0.03);
  CHECK(distance_rad(result.model_from_data, truth) < 0.3 * deg);
}

TEST_CASE("every iteration leaves its trace, the limit shrinks, and the bound on iterations holds") {
  const Scan model(room().scan(pose_at(0, 0, 1, 0), 3000, 12, 0.01, 1));
  const Scan data(room().scan(pose_at(0.3, 0.2, 1, 4), 3000, 12, 0.01, 2));
  for (const IcpMetric metric : {IcpMetric::surface, IcpMetric::point_to_point}) {
    for (const std::uint32_t bound : {1U, 2U, 5U, 40U}) {
      IcpConfig config = config_for(metric);
      config.maximum_iterations = bound;
      std::array<IcpIteration, 64> trace;
      const IcpResult result = match(model, data, Pose{}, config, trace);
      REQUIRE(result.iterations >= 1);
      REQUIRE(result.iterations <= bound);
      if (result.verdict == IcpVerdict::iteration_limit) CHECK(result.iterations == bound);
      if (bound <= 2) CHECK(result.verdict == IcpVerdict::iteration_limit);
      CHECK(trace[0].distance_limit_m == config.first_distance_limit_m);
      for (std::uint32_t i = 0; i < result.iterations; ++i) {
        CHECK(trace[i].correspondences >= config.minimum_correspondences);
        CHECK(trace[i].distance_limit_m >= config.last_distance_limit_m);
        if (i > 0) CHECK(trace[i].distance_limit_m <= trace[i - 1].distance_limit_m);
        CHECK(trace[i].rms_m > 0);
      }
      CHECK(trace[0].moved_m > 0);
      CHECK(trace[0].turned_rad > 0);
      CHECK(trace[result.iterations - 1].correspondences == result.correspondences);
      CHECK(trace[result.iterations - 1].rms_m == result.rms_m);
      for (std::uint32_t i = result.iterations; i < trace.size(); ++i) CHECK(trace[i].correspondences == 0);
      // a trace that is too short takes what fits
      std::array<IcpIteration, 1> first;
      CHECK(is_same(match(model, data, Pose{}, config, first).model_from_data, result.model_from_data));
      CHECK(first[0].correspondences == trace[0].correspondences);
    }
  }
}

TEST_CASE("several model scans, each seeing a part, carry a match together") {
  const Scene scene = street();
  const Pose map_from_model = pose_at(0, 0, 1, 10);
  std::list<Scan> parts;
  std::vector<IcpScan> model;
  for (int i = 0; i < 5; ++i) {
    const Pose map_from_body = pose_at(-6 + 3 * i, 0.3 * i, 1, 20 * i);
    parts.emplace_back(scene.scan(map_from_body, 4000, 10, 0.01, static_cast<std::uint64_t>(i)));
    model.push_back(parts.back().at(map_from_model.inverse() * map_from_body));
  }
  const Pose map_from_data = pose_at(1, -0.5, 1, -15);
  std::vector<IcpScan> data;
  for (int i = 0; i < 2; ++i) {
    const Pose map_from_body = pose_at(1 - i, -0.5, 1, -15 - 30 * i);
    parts.emplace_back(scene.scan(map_from_body, 4000, 10, 0.01, static_cast<std::uint64_t>(20 + i)));
    data.push_back(parts.back().at(map_from_data.inverse() * map_from_body));
  }
  const Pose truth = map_from_model.inverse() * map_from_data;
  InBlock<Icp> icp(4096U);
  const IcpResult result = icp->match(model, data, pose_at(0.3, -0.2, 0.05, 3) * truth, {});
  CHECK(result.verdict == IcpVerdict::converged);
  CHECK(distance_m(result.model_from_data, truth) < 0.02);
  CHECK(distance_rad(result.model_from_data, truth) < 0.2 * deg);
  CHECK(result.queries == 4096);
}

TEST_CASE("dealt into groups, sparse model scans fill each other's gaps") {
  std::list<Scan> parts;
  std::vector<IcpScan> model;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {  // of one place: 300 points each
    parts.emplace_back(room().scan(pose_at(0, 0, 1, 0), 300, 12, 0.005, seed), 300);
    model.push_back(parts.back().at());
  }
  const Scan data(room().scan(pose_at(0.3, -0.2, 1, 4), 3000, 12, 0.005, 9), 1024);
  const IcpScan data_scan = data.at();
  const auto matched = [&](std::uint32_t groups) {
    IcpConfig config;
    config.metric = IcpMetric::point_to_point;  // gaps count in full
    config.both_ways = false;
    config.maximum_iterations = 60;
    config.groups = groups;
    InBlock<Icp> icp(4096U);
    return icp->match(model, {&data_scan, 1}, pose_at(0.25, -0.15, 0, 3), config);
  };
  const IcpResult apart = matched(0);
  CHECK(is_same(apart.model_from_data, matched(6).model_from_data));  // each a group of its own
  CHECK(is_same(apart.model_from_data, matched(100).model_from_data));
  const IcpResult together = matched(1);
  CAPTURE(apart.rms_m, together.rms_m);
  CHECK(together.rms_m < 0.6 * apart.rms_m);
  CHECK(matched(3).rms_m < 0.9 * apart.rms_m);
}

TEST_CASE("the searches that a match spares change no bit of what a row of single iterations gives") {
  const Scene scene = street();
  std::list<Scan> parts;
  std::vector<IcpScan> model;
  std::vector<IcpScan> data;
  for (int i = 0; i < 3; ++i) {
    const Pose map_from_body = i == 0 ? pose_at(-3, 0, 1, 0) : pose_at(2, 0.5, 1, 20);
    const double reach_m = i == 1 ? 5 : 10;  // two in one place, but what one sees the other does not
    parts.emplace_back(scene.scan(map_from_body, 4000, reach_m, 0.01, static_cast<std::uint64_t>(i)));
    model.push_back(parts.back().at(map_from_body));
  }
  for (int i = 0; i < 2; ++i) {
    const Pose map_from_body = pose_at(0.5 - i, -0.5, 1, -15 - 30 * i);
    parts.emplace_back(scene.scan(map_from_body, 4000, 10, 0.01, static_cast<std::uint64_t>(20 + i)));
    data.push_back(parts.back().at(map_from_body));
  }
  for (const IcpMetric metric : {IcpMetric::surface, IcpMetric::point_to_point}) {
    for (const Pose& initial : {pose_at(0.6, -0.4, 0.1, 5), pose_at(0.05, 0.02, 0, 0.3)}) {
      IcpConfig config = config_for(metric);
      config.first_distance_limit_m = 3;
      config.last_distance_limit_m = 0.4F;
      config.coarse_stride = 2;  // 4 or 1, every sample asks the same one of three scans all the time
      config.robust_factor = 0;  // its scale is handed on from iteration to iteration
      InBlock<Icp> icp(4096U);
      std::array<IcpIteration, 64> trace;
      const IcpResult whole = icp->match(model, data, initial, config, nullptr, trace);
      CAPTURE(static_cast<int>(metric), whole.iterations);
      REQUIRE(trace[whole.iterations - 1].moved_m < 0.005);  // little enough to spare searches

      IcpResult step;
      step.model_from_data = initial;
      IcpConfig single = config;
      single.maximum_iterations = 1;
      for (const IcpIteration& iteration : std::span(trace).first(whole.iterations)) {
        single.first_distance_limit_m = iteration.distance_limit_m;
        step = icp->match(model, data, step.model_from_data, single);
        REQUIRE(step.correspondences == iteration.correspondences);
        REQUIRE(step.rms_m == iteration.rms_m);
      }
      CHECK(is_same(step.model_from_data, whole.model_from_data));
      CHECK(step.information == whole.information);
      CHECK(step.sums.mtm == whole.sums.mtm);
      CHECK(step.sums.mtz == whole.sums.mtz);
      CHECK(step.fit == whole.fit);
    }
  }
}

TEST_CASE("samples beyond the capacity are downsampled evenly") {
  const Scan model(room().scan(pose_at(0, 0, 1, 0), 4000, 12, 0.01, 1));
  const Scan data(room().scan(pose_at(0.3, 0.2, 1, 4), 4000, 12, 0.01, 2));
  const Pose truth = pose_at(0, 0, 1, 0).inverse() * pose_at(0.3, 0.2, 1, 4);
  const IcpScan model_scan = model.at();
  const IcpScan data_scan = data.at();  // 2048 samples
  for (const std::uint32_t capacity : {300U, 1000U, 2047U, 2048U}) {
    InBlock<Icp> icp(capacity);
    const IcpResult result = icp->match({&model_scan, 1}, {&data_scan, 1}, Pose{}, {});
    CAPTURE(capacity);
    CHECK(result.queries <= capacity);
    CHECK(result.queries >= capacity / 2);
    CHECK(result.verdict == IcpVerdict::converged);
    CHECK(distance_m(result.model_from_data, truth) < 0.04);
  }
}

TEST_CASE("the sums of Appendix A are those of the stacked correspondences") {
  const Scan model(room().scan(pose_at(0, 0, 1, 0), 2000, 12, 0.01, 1));
  const Scan data(room().scan(pose_at(0.05, 0.02, 1, 1), 2000, 12, 0.01, 2));
  const Pose initial = pose_at(0.03, 0.01, 0, 0.5);
  for (const IcpMetric metric : {IcpMetric::surface, IcpMetric::point_to_point}) {
    IcpConfig config = config_for(metric);
    config.coarse_stride = 1;
    config.maximum_iterations = 1;  // so that the correspondences are those of the initial pose ...
    config.both_ways = config.same_side = false;  // ... of all data samples
    const IcpResult result = match(model, data, initial, config);
    Matrix6d mtm = Matrix6d::Zero();
    Vector6d mtz = Vector6d::Zero();
    double ztz_m2 = 0;
    std::uint32_t count = 0;
    for (std::uint32_t i = 0; i < data.tree().size(); ++i) {
      const Eigen::Vector3d q = initial * as_vector(data.tree().point(i));
      const float limit_m = config.first_distance_limit_m;
      const Neighbor nearest = model.tree().nearest(as_point(q), limit_m * limit_m);
      if (nearest.index == Neighbor::none) continue;
      const Eigen::Vector3d p =
          result.model_from_data * as_vector(data.tree().point(i));  // where it came to lie
      const Eigen::Vector3d z = as_vector(model.tree().point(nearest.index)) - p;
      Eigen::Matrix<double, 3, 6> m;
      m << 1, 0, 0, 0, p.z(), -p.y(),  //
          0, 1, 0, -p.z(), 0, p.x(),   //
          0, 0, 1, p.y(), -p.x(), 0;
      mtm += m.transpose() * m;
      mtz += m.transpose() * z;
      ztz_m2 += z.squaredNorm();
      ++count;
    }
    CHECK(result.sums.count == count);
    CHECK((result.sums.mtm - mtm).norm() < 1e-5 * mtm.norm());
    CHECK((result.sums.mtz - mtz).norm() < 1e-3 * std::sqrt(ztz_m2 * count));
    CHECK(result.sums.ztz_m2 == Approx(ztz_m2).epsilon(1e-3));
    CHECK(result.sums.mtm == result.sums.mtm.transpose());
  }
}

TEST_CASE("the information of a match is symmetric, positive and grows with the points") {
  const Scan model(room().scan(pose_at(0, 0, 1, 0), 4000, 12, 0.02, 1));
  const Scan data(room().scan(pose_at(0.1, 0.1, 1, 2), 4000, 12, 0.02, 2));
  const Scan fewer(room().scan(pose_at(0.1, 0.1, 1, 2), 4000, 12, 0.02, 2), 512);
  const IcpResult result = match(model, data, Pose{}, {});
  const IcpResult with_fewer = match(model, fewer, Pose{}, {});
  CHECK(result.information == result.information.transpose());
  CHECK(result.information.diagonal().minCoeff() > 0);
  for (int i = 0; i < 6; ++i) CHECK(result.information(i, i) > 2 * with_fewer.information(i, i));
}

TEST_CASE("a direction is held where the data fit nowhere else along it, and only there") {
  const auto one = [](const IcpScan& scan) { return std::span(&scan, 1); };
  const Eigen::Vector3d along = Eigen::Vector3d::UnitX();
  InBlock<Icp> icp(4096U);
  const Pose at = pose_at(0.4, 0, 1, 0);
  const auto is_held = [&](const Scene& scene, double least_m, double most_m) {
    const Scan model(scene.scan(at, 12000, 14, 0.01, 1));
    const Scan data(scene.scan(at, 12000, 14, 0.01, 2));
    const IcpScan model_scan = model.at();
    const IcpScan data_scan = data.at();
    return icp->is_held(one(model_scan), one(data_scan), Pose{}, along, least_m, most_m, IcpConfig{});
  };
  CHECK(is_held(walled_street(), -4, 4));
  CHECK_FALSE(is_held(corridor(), -4, 4));
  CHECK(is_held(corridor(), -0.2, 0.25));  // the map knows it better than a fit is wide
  CHECK_FALSE(is_held(corridor(), 0.5, 0.9));

  SECTION("without a model nothing is held") {
    const Scan data(corridor().scan(at, 2000, 14, 0.01, 2));
    const IcpScan data_scan = data.at();
    CHECK_FALSE(icp->is_held({}, one(data_scan), Pose{}, along, -4, 4, IcpConfig{}));
  }
}

TEST_CASE("what lies across long walls says how far along them the data have slid") {
  const Scene street = walled_street();
  const Pose at = pose_at(0.4, 0, 1, 0);
  const Scan model(street.scan(at, 12000, 14, 0.01, 1));
  const Scan data(street.scan(at, 12000, 14, 0.01, 2));
  const IcpScan model_scan = model.at();
  const IcpScan data_scan = data.at();
  const auto one = [](const IcpScan& scan) { return std::span(&scan, 1); };
  const Eigen::Vector3d along = Eigen::Vector3d::UnitX();
  InBlock<Icp> icp(4096U);
  std::array<double, 3> shifts_m{};
  for (const double slid_m : {-3.7, -1.2, -0.5, 0.6, 2.2, 3.9}) {
    const Pose slid = pose_at(slid_m, 0, 0, 0);
    const auto found =
        icp->likely_shifts(one(model_scan), one(data_scan), slid, along, 0.1, 40, IcpConfig{}, shifts_m);
    CAPTURE(slid_m, found, shifts_m[0]);
    REQUIRE(found >= 1);
    CHECK(shifts_m[0] == Approx(-slid_m).margin(0.11));
  }

  SECTION("where they lie right most of what faces along fits, a metre beside it next to nothing") {
    const FacingFit right = icp->facing_fit(one(model_scan), one(data_scan), Pose{}, along, IcpConfig{});
    const FacingFit beside =
        icp->facing_fit(one(model_scan), one(data_scan), pose_at(1, 0, 0, 0), along, IcpConfig{});
    const FacingFit ground = icp->facing_fit(one(model_scan), one(data_scan), pose_at(1, 0, 0, 0),
                                             Eigen::Vector3d::UnitZ(), IcpConfig{});
    CAPTURE(right.samples, right.fitting, beside.fitting, ground.samples, ground.fitting);
    CHECK(right.samples >= 10);
    CHECK(right.fitting * 4 >= right.samples * 3);
    CHECK(beside.samples == right.samples);
    CHECK(beside.fitting * 5 <= beside.samples);
    CHECK(ground.samples > 100);
    CHECK(ground.samples <= Icp::maximum_facing_samples);
    CHECK(ground.fitting * 2 > ground.samples);
    CHECK(icp->facing_fit({}, one(data_scan), Pose{}, along, IcpConfig{}).samples == 0);
  }
  SECTION("where they already fit best, nothing is offered") {
    CHECK(icp->likely_shifts(one(model_scan), one(data_scan), Pose{}, along, 0.1, 40, IcpConfig{},
                             shifts_m) == 0);
  }
  SECTION("no more are offered than there is room for, nor farther than asked") {
    const Pose slid = pose_at(2.2, 0, 0, 0);
    CHECK(icp->likely_shifts(one(model_scan), one(data_scan), slid, along, 0.1, 40, IcpConfig{}, {}) == 0);
    const auto found =
        icp->likely_shifts(one(model_scan), one(data_scan), slid, along, 0.1, 15, IcpConfig{}, shifts_m);
    for (std::uint32_t i = 0; i < found; ++i) CHECK(std::abs(shifts_m[i]) <= 1.5);
  }
  SECTION("nothing lies across a corridor, no model, too many steps: none") {
    const Scene plain = corridor();
    const Scan there(plain.scan(pose_at(0, 0, 1, 0), 6000, 14, 0, 1));
    const Scan again(plain.scan(pose_at(0, 0, 1, 0), 6000, 14, 0, 2));
    const IcpScan there_scan = there.at();
    const IcpScan again_scan = again.at();
    CHECK(icp->likely_shifts(one(there_scan), one(again_scan), Pose{}, along, 0.1, 40, IcpConfig{},
                             shifts_m) == 0);
    CHECK(icp->likely_shifts({}, one(data_scan), Pose{}, along, 0.1, 40, IcpConfig{}, shifts_m) == 0);
    CHECK(icp->likely_shifts(one(model_scan), {}, Pose{}, along, 0.1, 40, IcpConfig{}, shifts_m) == 0);
    CHECK(icp->likely_shifts(one(model_scan), one(data_scan), Pose{}, along, 0.1,
                             Icp::maximum_shift_steps + 1, IcpConfig{}, shifts_m) == 0);
  }
}

TEST_CASE("the two faces of a thin wall are no pair: what was seen from the other side holds nothing") {
  // Model and data look at one wall from its two sides, and over it at a lower one farther off.
  constexpr double thickness_m = 0.2;
  const auto scene_with = [](double face_y_m) {
    Scene scene;
    scene.rectangle({-6, -6, 0}, {12, 0, 0}, {0, 14, 0});
    scene.rectangle({-6, -6, 0}, {0, 14, 0}, {0, 0, 2});
    scene.rectangle({6, -6, 0}, {0, 14, 0}, {0, 0, 2});
    scene.rectangle({-6, 8, 0}, {12, 0, 0}, {0, 0, 0.8});
    scene.rectangle({-6, face_y_m, 0}, {12, 0, 0}, {0, 0, 3});
    return scene;
  };
  const Pose from = pose_at(0, -3, 1, 0);
  const Pose beyond = pose_at(0, 3, 1, 0);
  const Scan model(scene_with(0).scan(from, 5000, 15, 0.005, 1));
  const Scan data(scene_with(thickness_m).scan(beyond, 5000, 15, 0.005, 2));
  const Pose truth = from.inverse() * beyond;
  for (const bool same_side : {true, false}) {
    for (const bool both_ways : {true, false}) {
      IcpConfig config;
      config.same_side = same_side;
      config.both_ways = both_ways;
      const IcpResult result = match(model, data, truth, config);
      const double off_m = std::abs((result.model_from_data.translation_m - truth.translation_m).y());
      CAPTURE(same_side, both_ways, off_m, result.behind, result.correspondences, to_string(result.verdict));
      CHECK((off_m < 0.01) == same_side);
      CHECK((result.behind > 200) == same_side);
      CHECK((result.behind == 0) == !same_side);
    }
  }
}

TEST_CASE("asked both ways, a match and the same with its sides exchanged are each other's inverse") {
  IcpConfig config;
  config.translation_epsilon_m = 1e-6F;
  config.rotation_epsilon_rad = 1e-7F;
  config.maximum_iterations = 100;
  double both_m = 0;
  double one_m = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    // As many samples, but of a scan that is three times as dense.
    const Scan dense(room().scan(pose_at(0, 0, 1, 0), 6000, 12, 0.01, seed), 1024);
    const Scan sparse(room().scan(pose_at(0.4, 0.3, 1, 5), 2000, 12, 0.01, 100 + seed), 1024);
    const Pose start = pose_at(0.35, 0.35, 0, 4);
    const auto disagreement_m = [&](bool both_ways) {
      config.both_ways = both_ways;
      const IcpResult there = match(dense, sparse, start, config);
      const IcpResult back = match(sparse, dense, start.inverse(), config);
      return (there.model_from_data * back.model_from_data).translation_m.norm();
    };
    both_m += disagreement_m(true) / 6;
    one_m += disagreement_m(false) / 6;
  }
  CAPTURE(both_m, one_m);
  CHECK(both_m < 0.0005);
  CHECK(one_m > 3 * both_m);
}

TEST_CASE(
    "a match that has converged is finished with what lies near its surfaces, and nowhere that is open") {
  // Of the things on the ground each scanner sees the side towards it: they pull the ground's samples up in
  // front of it.
  Scene cluttered = room();
  for (int i = 0; i < 40; ++i) {
    const double x_m = -4.5 + 0.45 * (i % 20);
    const double y_m = i < 20 ? -1.5 : 1.5;
    cluttered.rectangle({x_m, y_m, 0}, {0.1, 0, 0}, {0, 0, 0.12});
    cluttered.rectangle({x_m, y_m, 0}, {0, 0.1, 0}, {0, 0, 0.12});
  }
  IcpConfig config;
  config.maximum_iterations = 60;
  double matched_rad = 0;
  double finished_rad = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Pose from = pose_at(0, 0, 1, 0);
    const Pose to = pose_at(0.6, 0.1, 1, 4);
    const Scan model(cluttered.scan(from, 6000, 12, 0.01, seed), 1024);
    const Scan data(cluttered.scan(to, 6000, 12, 0.01, 50 + seed), 1024);
    const Pose truth = from.inverse() * to;
    const auto error_rad = [&](std::uint32_t iterations) {
      config.finish_iterations = iterations;
      const IcpResult result = match(model, data, truth, config);
      CHECK(result.verdict == IcpVerdict::converged);
      return angle_between_rad(result.model_from_data.rotation, truth.rotation);
    };
    matched_rad += error_rad(0) / 8;
    finished_rad += error_rad(8) / 8;
  }
  CAPTURE(matched_rad, finished_rad);
  CHECK(finished_rad < 0.97 * matched_rad);

  const Scene open = corridor();
  const Scan model(open.scan(pose_at(0, 0, 1, 0), 4000, 14, 0.01, 1));
  const Scan data(open.scan(pose_at(0, 0, 1, 0), 4000, 14, 0.01, 2));
  const auto along_m = [&](std::uint32_t iterations) {
    config.finish_iterations = iterations;
    return match(model, data, pose_at(0.3, 0, 0, 0), config).model_from_data.translation_m.x();
  };
  CHECK(std::abs(along_m(8) - along_m(0)) < 0.002);
}

TEST_CASE(
    "the overlap is the data's share, whatever more the model has seen, and whatever share of it was seen "
    "again") {
  const Scene scene = street();
  const Scan wide(scene.scan(pose_at(0, 0, 1, 0), 8000, 25, 0.01, 1));
  const Scan narrow(scene.scan(pose_at(0, 0, 1, 0), 4000, 8, 0.01, 2));
  const IcpResult inside = match(wide, narrow, Pose{}, {});
  const IcpResult outside = match(narrow, wide, Pose{}, {});
  CAPTURE(inside.overlap, outside.overlap);
  CHECK(inside.overlap > 0.95);
  CHECK(outside.overlap < 0.5);
}

TEST_CASE("a prior holds a match along a corridor, where the scans leave it open, and nowhere else") {
  const Scene scene = corridor();
  const Scan model(scene.scan(pose_at(0, 0, 1, 0), 4000, 14, 0.01, 1));
  const Scan data(scene.scan(pose_at(0, 0, 1, 0), 4000, 14, 0.01, 2));  // where along it, nobody can see
  const IcpScan model_scan = model.at();
  const IcpScan data_scan = data.at();
  InBlock<Icp> icp(4096U);
  IcpConfig config;
  config.translation_epsilon_m = 1e-5F;
  config.maximum_iterations = 100;
  for (const double said_m : {-0.8, 0.0, 0.6}) {
    IcpPrior prior;
    prior.model_from_data = pose_at(said_m, 0.3, 0.1, 2);
    prior.covariance = Vector6d(0.05 * 0.05 * Vector6d::Ones()).asDiagonal();
    prior.covariance.diagonal()[1] = prior.covariance.diagonal()[2] = 0.3 * 0.3;
    const IcpResult held =
        icp->match({&model_scan, 1}, {&data_scan, 1}, pose_at(said_m + 0.3, 0.1, 0, 1), config, &prior);
    const IcpResult free =
        icp->match({&model_scan, 1}, {&data_scan, 1}, pose_at(said_m + 0.3, 0.1, 0, 1), config);
    const Eigen::Vector3d& at_m = held.model_from_data.translation_m;
    CAPTURE(said_m, at_m.transpose(), to_string(held.verdict), to_string(free.verdict));
    CHECK(held.verdict == IcpVerdict::converged);
    CHECK(at_m.x() == Approx(said_m).margin(0.02));
    CHECK(std::abs(at_m.y()) < 0.01);
    CHECK(std::abs(at_m.z()) < 0.01);
    CHECK(distance_rad(held.model_from_data, Pose{}) < 0.2 * deg);
    CHECK(std::abs(free.model_from_data.translation_m.x() - said_m) > 0.1);
  }
}

TEST_CASE("a prior does not pull where the scans hold, unless it is surer than they are") {
  const Scan model(room().scan(pose_at(0, 0, 1, 0), 4000, 12, 0.01, 1));
  const Scan data(room().scan(pose_at(0.2, 0.1, 1, 3), 4000, 12, 0.01, 2));
  const Pose truth = pose_at(0, 0, 1, 0).inverse() * pose_at(0.2, 0.1, 1, 3);
  const IcpScan model_scan = model.at();
  const IcpScan data_scan = data.at();
  InBlock<Icp> icp(4096U);
  IcpPrior prior;
  prior.model_from_data = pose_at(0.3, -0.2, 0.1, 2) * truth;
  const auto off_m = [&](double sigma) {
    prior.covariance = sigma * sigma * Matrix6d::Identity();
    return distance_m(icp->match({&model_scan, 1}, {&data_scan, 1}, truth, {}, &prior).model_from_data,
                      truth);
  };
  CAPTURE(off_m(0.2), off_m(1), off_m(1e-5));
  CHECK(off_m(1) < 0.015);
  CHECK(off_m(0.2) < 0.03);
  CHECK(off_m(1e-5) == Approx(distance_m(prior.model_from_data, truth)).epsilon(0.02));
}

TEST_CASE("the ground that fits anywhere does not outvote walls that do not") {
  Scene walls;
  walls.rectangle({-40, -40, 0}, {80, 0, 0}, {0, 80, 0});
  walls.box({6, -3, 0}, {8, 3, 2.5});
  walls.box({-3, 7, 0}, {3, 9, 2.5});
  const Scan model(walls.scan(pose_at(0, 0, 1, 0), 8000, 14, 0.005, 1));
  const Scan data(walls.scan(pose_at(0, 0, 1, 0), 8000, 14, 0.005, 2));
  IcpConfig config;
  const IcpResult right = match(model, data, Pose{}, config);
  config.maximum_iterations = 1;
  config.first_distance_limit_m = config.last_distance_limit_m = 0.3F;  // so that it stays where it is
  const IcpResult beside = match(model, data, pose_at(2.5, 2.5, 0, 0), config);
  CAPTURE(right.fit, right.balanced_fit, beside.fit, beside.balanced_fit);
  CHECK(right.balanced_fit > 0.8);
  CHECK(beside.fit > 0.6);
  CHECK(beside.balanced_fit < 0.6);
}
