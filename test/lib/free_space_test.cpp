#include "alces/free_space.h"

#include <catch2/catch.hpp>

#include "support/in_block.h"
#include "support/plain_scene.h"
#include "support/sampled_scan.h"

using namespace alces;
using namespace alces::test;

namespace {

constexpr float tolerance_m = 0.5F;

/// A room of 12 m by 8 m with a cupboard in it, and how its scans stand in each other's view.
Scene room() {
  Scene scene;
  scene.rectangle({-6, -4, -1}, {12, 0, 0}, {0, 8, 0});
  scene.box({-6, -4, -1}, {6, 4, 2});
  scene.box({3, 2, -1}, {5, 3.5, 1});
  return scene;
}

SampledScan scan_at(const Pose& room_from_body, std::uint64_t seed) {
  return SampledScan(room().scan(room_from_body, 12000, 30, 0.01, seed));
}

FreeSpaceCount seen(const SampledScan& viewer, const SampledScan& other, const Pose& viewer_from_other) {
  InBlock<FreeSpace> view;
  view->look(viewer.tree());
  return view->count(other.tree(), other.samples(), viewer_from_other, tolerance_m);
}

}  // namespace

TEST_CASE("two scans of a room that lie where they were taken leave each other's free space free") {
  const Pose there = pose_at(1.5, -0.8, 0, 70);
  const SampledScan one = scan_at(Pose{}, 1);
  const SampledScan other = scan_at(there, 2);
  for (const FreeSpaceCount& count : {seen(one, other, there), seen(other, one, there.inverse())}) {
    CAPTURE(count.agreeing, count.standing);
    CHECK(count.known() > 800);
    CHECK(count.share() < 0.01);
  }
}

TEST_CASE("walls that are laid into what the other scan looked through stand in its free space") {
  const SampledScan one = scan_at(Pose{}, 1);
  const SampledScan other = scan_at(Pose{}, 2);
  const FreeSpaceCount here = seen(one, other, Pose{});
  for (const Pose& wrong : {pose_at(2.5, 0, 0, 0), pose_at(0, -2, 0, 0), pose_at(0, 0, 1.2, 0)}) {
    const FreeSpaceCount count = seen(one, other, wrong);
    CAPTURE(count.agreeing, count.standing);
    CHECK(count.share() > 0.05);
    CHECK(is_clearly_more(count, here, 3));
    CHECK_FALSE(is_clearly_more(here, count, 0));
  }
}

TEST_CASE("what lies behind a wall says nothing, however many surfaces there are") {
  const SampledScan one = scan_at(Pose{}, 1);
  const SampledScan next_door = scan_at(Pose{}, 2);
  const FreeSpaceCount count = seen(one, next_door, pose_at(0, 30, 0, 0));
  CHECK(count.known() == 0);
  CHECK(count.share() == 0);
  CHECK(count.hidden > 800);
}

TEST_CASE("rooms that do not see each other lie apart, one room, and walls in the way, do not") {
  const SampledScan one = scan_at(Pose{}, 1);
  const SampledScan other = scan_at(Pose{}, 2);
  const FreeSpaceCount usual = seen(one, other, Pose{});
  CHECK_FALSE(lies_apart(usual, usual, 3));
  CHECK(lies_apart(seen(one, other, pose_at(0, 30, 0, 0)), usual, 3));  // next door but one
  CHECK(lies_apart(seen(one, other, pose_at(-40, 5, 0, 90)), usual, 3));
  for (const Pose& wrong : {pose_at(2.5, 0, 0, 0), pose_at(0, -2, 0, 0), pose_at(0, 0, 0, 40)})
    CHECK_FALSE(lies_apart(seen(one, other, wrong), usual, 3));
  CHECK_FALSE(lies_apart({100, 0, 120}, {110, 0, 130}, 3));  // as much is behind as between neighbours
  CHECK(lies_apart({100, 0, 500}, {400, 0, 200}, 3));
  CHECK_FALSE(lies_apart({0, 0, 0}, usual, 3));    // nothing is known
  CHECK_FALSE(lies_apart({0, 0, 100}, usual, 3));  // or too little
  CHECK_FALSE(lies_apart({0, 0, 0}, {0, 0, 0}, 3));
}

TEST_CASE("directions in which nothing was seen say nothing") {
  Scene wall;
  wall.rectangle({8, -4, -2}, {0, 8, 0}, {0, 0, 4});
  const SampledScan one(wall.scan(Pose{}, 4000, 30, 0.01, 1));
  const SampledScan other(wall.scan(Pose{}, 4000, 30, 0.01, 2));
  CHECK(seen(one, other, Pose{}).share() == 0);
  CHECK(seen(one, other, pose_at(-3, 0, 0, 0)).share() > 0.5);  // before it
  CHECK(seen(one, other, pose_at(0, 0, 0, 180)).known() == 0);  // at the back of the scanner
}

TEST_CASE("a wall seen along its length does not stand before itself") {
  Scene corridor;
  corridor.rectangle({-20, 1, -1}, {40, 0, 0}, {0, 0, 2.5});
  corridor.rectangle({-20, -1, -1}, {40, 0, 0}, {0, 0, 2.5});
  const SampledScan one(corridor.scan(Pose{}, 12000, 25, 0.01, 1));
  const SampledScan other(corridor.scan(pose_at(3, 0, 0, 0), 12000, 25, 0.01, 2));
  const FreeSpaceCount count = seen(one, other, pose_at(3, 0, 0, 0));
  CAPTURE(count.agreeing, count.standing);
  CHECK(count.agreeing > 300);
  CHECK(count.share() < 0.01);
}

TEST_CASE("an empty view, and no samples, give no count") {
  InBlock<FreeSpace> view;
  const KdTree nothing;
  view->look(nothing);
  const SampledScan scan = scan_at(Pose{}, 1);
  CHECK(view->count(scan.tree(), scan.samples(), Pose{}, tolerance_m).known() == 0);
  view->look(scan.tree());
  CHECK(view->count(scan.tree(), {}, Pose{}, tolerance_m).known() == 0);
}

TEST_CASE("a share from few samples is no proof, the same share from many is") {
  CHECK_FALSE(is_clearly_more({20, 5, 0}, {30, 0, 0}, 2));
  CHECK(is_clearly_more({2000, 500, 0}, {3000, 0, 0}, 2));
  CHECK_FALSE(is_clearly_more({0, 0, 0}, {0, 0, 0}, 0));
  CHECK_FALSE(is_clearly_more({1000, 20, 0}, {1000, 20, 0}, 0));
}
