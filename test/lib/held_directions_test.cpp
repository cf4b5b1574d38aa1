#include "alces/held_directions.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "support/in_block.h"
#include "support/plain_scene.h"
#include "support/sampled_scan.h"

using namespace alces;
using namespace alces::test;

namespace {

HeldDirections held_in(const Scene& scene, double yaw_deg) {
  const SampledScan model(scene.scan(pose_at(0, 0, 1.5, 0), 6000, 30, 0.01, 1));
  const SampledScan data(scene.scan(pose_at(0, 0, 1.5, yaw_deg), 6000, 30, 0.01, 2));
  const IcpScan model_scan = model.at();
  const IcpScan data_scan = data.at();
  InBlock<Icp> icp(std::uint32_t{4096});
  IcpConfig config;
  config.degenerate_ratio = 0;  // whether or not, the shares say how well
  const IcpResult match = icp->match({&model_scan, 1}, {&data_scan, 1}, pose_at(0, 0, 0, yaw_deg), config);
  REQUIRE(match.correspondences > 1000);
  return held_directions(match);
}

/// 60 m long, without ends in sight.
Scene tunnel() {
  Scene scene;
  scene.rectangle({-60, -2, 0}, {120, 0, 0}, {0, 4, 0});
  scene.rectangle({-60, -2, 0}, {120, 0, 0}, {0, 0, 3});
  scene.rectangle({-60, 2, 0}, {120, 0, 0}, {0, 0, 3});
  return scene;
}

Scene field() {
  Scene scene;
  scene.rectangle({-60, -60, 0}, {120, 0, 0}, {0, 120, 0});
  return scene;
}

Scene closed_room() {
  Scene scene;
  scene.rectangle({-6, -5, 0}, {12, 0, 0}, {0, 10, 0});
  scene.box({-6, -5, 0}, {6, 5, 5});
  return scene;
}

}  // namespace

TEST_CASE("a room holds all six directions") {
  const HeldDirections held = held_in(closed_room(), 0);
  CAPTURE(held.x, held.y, held.z, held.roll, held.pitch, held.yaw);
  CHECK(held.weakest() > 0.05F);
  CHECK(held.x + held.y + held.z <= 1.01F);
}

TEST_CASE("a tunnel does not hold the direction along it, whichever way the scanner looks") {
  const HeldDirections along = held_in(tunnel(), 0);
  CAPTURE(along.x, along.y, along.z, along.roll, along.pitch, along.yaw);
  CHECK(along.x < 0.01F);
  CHECK(std::min({along.y, along.z, along.pitch, along.yaw}) > 0.1F);
  CHECK(along.weakest() == along.x);  // roll is held by walls that are near: little where samples lie far off
  const HeldDirections across = held_in(tunnel(), 90);  // now the body's y axis points along it
  CAPTURE(across.x, across.y);
  CHECK(across.y < 0.01F);
  CHECK(across.x == Approx(along.y).margin(0.05));
}

TEST_CASE("a field holds height, roll and pitch, and neither place nor heading") {
  const HeldDirections held = held_in(field(), 0);
  CAPTURE(held.x, held.y, held.z, held.roll, held.pitch, held.yaw);
  CHECK(std::max({held.x, held.y, held.yaw}) < 0.01F);
  CHECK(std::min({held.z, held.roll, held.pitch}) > 0.1F);
}

TEST_CASE("a match that did not come about holds nothing") {
  CHECK(held_directions(IcpResult{}).weakest() == 0);
  CHECK(held_directions(IcpResult{}).z == 0);
}
