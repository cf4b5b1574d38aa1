#include "alces/start_search.h"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "support/in_block.h"
#include "support/plain_scene.h"
#include "support/sampled_scan.h"

using namespace alces;
using namespace alces::test;

namespace {

constexpr double deg = std::numbers::pi / 180;
constexpr auto all_around = static_cast<float>(std::numbers::pi);

/// A hall of 30 m by 20 m with machines in it, no two corners alike.
Scene hall() {
  Scene scene;
  scene.rectangle({-15, -10, 0}, {30, 0, 0}, {0, 20, 0});
  scene.box({-15, -10, 0}, {15, 10, 6});
  scene.box({-12, -8, 0}, {-5, -5, 3});
  scene.box({3, 4, 0}, {5, 9, 2.5});
  scene.box({9, -9, 0}, {13, -7, 3});
  scene.box({-9, 5, 0}, {-7, 7, 4});
  return scene;
}

struct Bench {
  InBlock<StartSearch> search;
  std::array<Start, StartSearch::most_starts> room;

  std::span<const Start> find(const SampledScan& model, const SampledScan& data, const Pose& guess,
                              float turn_rad = all_around,
                              const Eigen::Quaterniond& level_from_model = Eigen::Quaterniond::Identity(),
                              const StartSearchConfig& config = {}) {
    const IcpScan model_scan = model.at();
    const IcpScan data_scan = data.at();
    const std::uint32_t found =
        search->find({&model_scan, 1}, {&data_scan, 1}, guess, level_from_model, turn_rad, config, room);
    REQUIRE(found <= room.size());
    return std::span(room).first(found);
  }
};

bool is_near(const Start& start, const Pose& truth) {
  return distance_m(start.model_from_data, truth) < 1.2 &&
         distance_rad(start.model_from_data, truth) < 8 * deg;
}

}  // namespace

TEST_CASE(
    "a scan turned by any angle and 8 m away is found, in a hall and in a street, and ICP arrives from "
    "there") {
  Bench bench;
  const std::array scenes = {hall(), street()};
  for (std::size_t place = 0; place < scenes.size(); ++place) {
    const Pose map_from_model = pose_at(-3, -1, 1, 0);
    const SampledScan model(scenes[place].scan(map_from_model, 5000, 30, 0.01, 1));
    for (const double yaw_deg : {90.0, -90.0, 180.0, 30.0}) {
      const Pose map_from_data = pose_at(4.7, 1.2, 1, yaw_deg);
      const SampledScan data(scenes[place].scan(map_from_data, 5000, 30, 0.01, 2));
      const Pose truth = map_from_model.inverse() * map_from_data;
      const std::span<const Start> starts = bench.find(model, data, Pose{});
      CAPTURE(place, yaw_deg);
      REQUIRE_FALSE(starts.empty());
      const auto found =
          std::ranges::find_if(starts, [&](const Start& start) { return is_near(start, truth); });
      REQUIRE(found != starts.end());
      InBlock<Icp> icp(4096U);
      const IcpScan model_scan = model.at();
      const IcpScan data_scan = data.at();
      const IcpResult match = icp->match({&model_scan, 1}, {&data_scan, 1}, found->model_from_data,
                                         {.maximum_iterations = 40, .first_distance_limit_m = 2.5F});
      CHECK(distance_m(match.model_from_data, truth) < 0.03);
      CHECK(distance_rad(match.model_from_data, truth) < 0.3 * deg);
    }
  }
}

TEST_CASE("starts come best first, tell how much hits, and are different places") {
  Bench bench;
  const SampledScan model(hall().scan(pose_at(0, 0, 1, 0), 5000, 30, 0.01, 1));
  const SampledScan data(hall().scan(pose_at(2, 1, 1, 40), 5000, 30, 0.01, 2));
  const std::span<const Start> starts = bench.find(model, data, Pose{});
  REQUIRE(starts.size() > 2);
  CHECK(is_near(starts[0], pose_at(2, 1, 0, 40)));
  CHECK(starts[0].share > 0.7F);
  for (std::size_t i = 0; i < starts.size(); ++i) {
    CHECK(starts[i].share > 0);
    CHECK(starts[i].share <= 1);
    if (i > 0) CHECK(starts[i].share <= starts[i - 1].share);
    for (std::size_t j = 0; j < i; ++j)
      CHECK(distance_rad(starts[i].model_from_data, starts[j].model_from_data) > 0.15);
  }
}

TEST_CASE("a start stands on the ground that the model shows, however high and tilted the guess is") {
  Bench bench;
  const SampledScan model(hall().scan(pose_at(0, 0, 1, 0), 8000, 30, 0.01, 1));
  const SampledScan data(hall().scan(pose_at(2, 1, 1, 40), 8000, 30, 0.01, 2));
  const Pose truth = pose_at(2, 1, 0, 40);
  for (const Pose& guess : {pose_at(0, 0, 4, 0), pose_at(1, 0, -4, 20), pose_at(0, 0, 2, 0, 6, -4)}) {
    const std::span<const Start> starts = bench.find(model, data, guess);
    REQUIRE_FALSE(starts.empty());
    const Pose& best = starts[0].model_from_data;
    CAPTURE(guess.translation_m.transpose(), best.translation_m.transpose());
    CHECK(best.translation_m.z() == Approx(0).margin(0.15));
    CHECK((best.rotation * Eigen::Vector3d::UnitZ()).z() > std::cos(1.5 * deg));
    CHECK(is_near(starts[0], truth));
  }
}

TEST_CASE("a model that is tilted is looked at upright") {
  Bench bench;
  const Pose map_from_model = pose_at(0, 0, 1, 25, 12, -9);
  const SampledScan model(hall().scan(map_from_model, 5000, 30, 0.01, 1));
  const Pose map_from_data = pose_at(3, -2, 1, -60, 2, 1);
  const SampledScan data(hall().scan(map_from_data, 5000, 30, 0.01, 2));
  const std::span<const Start> starts = bench.find(model, data, Pose{}, all_around, map_from_model.rotation);
  REQUIRE_FALSE(starts.empty());
  CHECK(is_near(starts[0], map_from_model.inverse() * map_from_data));
}

TEST_CASE("no start is farther or turned further from the guess than asked for") {
  Bench bench;
  const SampledScan model(hall().scan(pose_at(0, 0, 1, 0), 5000, 30, 0.01, 1));
  const SampledScan data(hall().scan(pose_at(5, 4, 1, 90), 5000, 30, 0.01, 2));
  StartSearchConfig near;
  near.reach_m = 3;
  for (const float turn_rad : {0.0F, 0.3F, 1.0F}) {
    const std::span<const Start> starts =
        bench.find(model, data, Pose{}, turn_rad, Eigen::Quaterniond::Identity(), near);
    CHECK_FALSE(starts.empty());
    for (const Start& start : starts) {
      CHECK(start.model_from_data.translation_m.head<2>().cwiseAbs().maxCoeff() <= 3.001);
      CHECK(distance_rad(start.model_from_data, Pose{}) < static_cast<double>(turn_rad) + 0.11);
    }
  }
}

TEST_CASE("where nothing stands upright, or nothing was seen, or there is no room, there is no start") {
  Bench bench;
  Scene plain;
  plain.rectangle({-30, -30, 0}, {60, 0, 0}, {0, 60, 0});
  const SampledScan field(plain.scan(pose_at(0, 0, 1, 0), 4000, 20, 0, 1));
  const SampledScan seen(hall().scan(pose_at(0, 0, 1, 0), 3000, 30, 0.01, 1));
  CHECK(bench.find(seen, field, Pose{}).empty());
  CHECK(bench.find(field, seen, Pose{}).empty());
  const IcpScan scan = seen.at();
  CHECK(bench.search->find({}, {&scan, 1}, Pose{}, Eigen::Quaterniond::Identity(), 1, {}, bench.room) == 0);
  CHECK(bench.search->find({&scan, 1}, {}, Pose{}, Eigen::Quaterniond::Identity(), 1, {}, bench.room) == 0);
  CHECK(bench.search->find({&scan, 1}, {&scan, 1}, Pose{}, Eigen::Quaterniond::Identity(), 1, {}, {}) == 0);
  Pose far;  // beyond the grid of the model
  far.translation_m = {1e6, -1e6, 0};
  CHECK(bench.find(seen, seen, far).empty());
}
