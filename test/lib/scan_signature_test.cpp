#include "alces/scan_signature.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "alces_platform/sim/random.h"
#include "support/plain_scene.h"

using namespace alces;
using namespace alces::test;

namespace {

constexpr double deg = std::numbers::pi / 180;
constexpr float sector_rad = 2 * std::numbers::pi_v<float> / ScanSignature::sectors;

std::vector<Point> seen(const Scene& scene, double x, double y, double yaw_deg, std::uint64_t seed = 1) {
  return scene.scan(pose_at(x, y, 1.5, yaw_deg), 6000, 60, 0.01, seed);
}

std::array<std::byte, ScanSignature::stored_bytes> stored(const ScanSignature& signature) {
  std::array<std::byte, ScanSignature::stored_bytes> bytes{};
  signature.write(bytes);
  return bytes;
}

float best_yaw_rad(const ScanSignature& model, const ScanSignature& data) {
  std::array<YawCandidate, 4> room;
  REQUIRE(model.correlate(data, room) > 0);
  return room[0].yaw_rad;
}

}  // namespace

TEST_CASE("a cell of a signature says how high what stands there reaches, in metres above -2 m") {
  const std::array<Point, 5> points = {{{10, 0.1F, 3.5F},     // sector 0, ring 2
                                        {10, 0.1F, 1.0F},     // lower, in the same cell
                                        {-0.1F, 30, 40.0F},   // sector 16, ring 8: as high as it counts
                                        {-5, -5.1F, -1.5F},   // below the lowest
                                        {59.9F, -0.1F, 0}}};  // the last sector, the last ring
  const ScanSignature signature = ScanSignature::of(points);
  CHECK(signature.cell(0, 2) == 5);
  CHECK(signature.cell(16, 8) == 15);
  CHECK(signature.cell(63, 15) == 2);
  int filled = 0;
  for (std::uint32_t sector = 0; sector < ScanSignature::sectors; ++sector)
    for (std::uint32_t ring = 0; ring < ScanSignature::rings; ++ring)
      if (signature.cell(sector, ring) > 0) ++filled;
  CHECK(filled == 3);
}

TEST_CASE("a point's sector is its azimuth's, all around") {
  for (int step = 0; step < 3600; ++step) {
    const double azimuth_rad = (0.1 * step + 0.01) * deg;
    CAPTURE(step);
    const std::array<Point, 1> point = {{{static_cast<float>(20 * std::cos(azimuth_rad)),
                                          static_cast<float>(20 * std::sin(azimuth_rad)), 1}}};
    const auto sector =
        static_cast<std::uint32_t>(azimuth_rad / (2 * std::numbers::pi) * ScanSignature::sectors);
    REQUIRE(ScanSignature::of(point).cell(sector, 5) == 3);
  }
}

TEST_CASE("a signature does not depend on the order of the points") {
  std::vector<Point> points = seen(street(), 0, 0, 0);
  const auto before = stored(ScanSignature::of(points));
  std::ranges::reverse(points);
  CHECK(stored(ScanSignature::of(points)) == before);
  std::rotate(points.begin(), points.begin() + 1234, points.end());
  CHECK(stored(ScanSignature::of(points)) == before);
}

TEST_CASE("a scan downsampled to a quarter is like itself, more than like another place") {
  const std::vector<Point> points = seen(street(), 0, 0, 0);
  std::vector<Point> few;
  sim::Random random(5);
  for (const Point& point : points)
    if (random.next() % 4 == 0) few.push_back(point);
  const ScanSignature whole = ScanSignature::of(points);
  const float thinned = whole.likeness(ScanSignature::of(few));
  const float elsewhere = whole.likeness(ScanSignature::of(seen(street(), 14, 0, 0)));
  CAPTURE(thinned, elsewhere);
  CHECK(thinned > 0.75F);
  CHECK(thinned > elsewhere + 0.1F);
}

TEST_CASE("the best candidate is the turn between two scans of a place, to within a sector") {
  for (const double yaw_deg : {0.0, 15.0, 30.0, 90.0, 133.0, 180.0, -47.0}) {
    CAPTURE(yaw_deg);
    const ScanSignature model = ScanSignature::of(seen(street(), 0, 0, 0));
    const ScanSignature data = ScanSignature::of(seen(street(), 0.5, 0.3, yaw_deg, 2));
    const double off_rad =
        std::remainder(static_cast<double>(best_yaw_rad(model, data)) - yaw_deg * deg, 2 * std::numbers::pi);
    CHECK(std::abs(off_rad) <= static_cast<double>(sector_rad));
    const float back_and_forth_rad = best_yaw_rad(data, model) + best_yaw_rad(model, data);
    CHECK(std::abs(std::remainder(back_and_forth_rad, 2 * std::numbers::pi_v<float>)) < 0.01F);
  }
}

TEST_CASE("candidates are the peaks of the correlation, the best first, as many as there is room for") {
  const ScanSignature model = ScanSignature::of(seen(street(), 0, 0, 0));
  const ScanSignature data = ScanSignature::of(seen(street(), 2, 0, 70, 3));
  std::array<YawCandidate, ScanSignature::sectors> all;
  const std::uint32_t count = model.correlate(data, all);
  REQUIRE(count >= 2);
  CHECK(count <= ScanSignature::sectors / 2);
  CHECK(all[0].likeness == model.likeness(data));
  for (std::uint32_t i = 1; i < count; ++i) {
    CHECK(all[i].likeness <= all[i - 1].likeness);
    for (std::uint32_t k = 0; k < i; ++k)
      CHECK(std::abs(std::remainder(all[i].yaw_rad - all[k].yaw_rad, 2 * std::numbers::pi_v<float>)) >
            1.5F * sector_rad);
  }
  std::array<YawCandidate, 2> few;
  REQUIRE(model.correlate(data, few) == 2);
  CHECK(few[0].yaw_rad == all[0].yaw_rad);
  CHECK(few[1].yaw_rad == all[1].yaw_rad);
  CHECK(model.correlate(data, {}) == 0);
}

TEST_CASE("the likeness of a signature to itself is 1, to nothing 0, and never above its bound") {
  const ScanSignature nothing;
  std::vector<ScanSignature> places;
  for (const double x : {0.0, 3.0, 8.0, 15.0})
    places.push_back(ScanSignature::of(seen(street(), x, 0, 10 * x)));
  for (const ScanSignature& a : places) {
    CHECK(a.likeness(a) == 1);
    CHECK(a.likeness(nothing) == 0);
    CHECK(nothing.likeness(a) == 0);
    for (const ScanSignature& b : places) {
      CHECK(a.likeness(b) <= a.likeness_bound(b));
      CHECK(a.likeness(b) == b.likeness(a));
    }
  }
  std::array<YawCandidate, 3> room;
  CHECK(places[0].correlate(nothing, room) == 0);
  CHECK(nothing.correlate(nothing, room) == 0);
  CHECK(nothing.likeness_bound(nothing) == 0);
}

TEST_CASE("what is alike all around has one candidate: no turn") {
  std::vector<Point> ring;
  for (int i = 0; i < 640; ++i) {
    const double azimuth_rad = (i + 0.5) * 2 * std::numbers::pi / 640;
    ring.push_back(
        {static_cast<float>(12 * std::cos(azimuth_rad)), static_cast<float>(12 * std::sin(azimuth_rad)), 1});
  }
  const ScanSignature tower = ScanSignature::of(ring);
  std::array<YawCandidate, 3> room;
  REQUIRE(tower.correlate(tower, room) == 1);
  CHECK(room[0].yaw_rad == 0);
  CHECK(room[0].likeness == 1);
}

TEST_CASE("a scan seen from beside is like what a scanner sees there") {
  const ScanSignature there = ScanSignature::of(seen(street(), 5, 1, 0));
  const std::vector<Point> here = seen(street(), 0, 0, 0);
  const float straight = there.likeness(ScanSignature::of(here));
  const float from_beside = there.likeness(ScanSignature::of(here, 5, 1));
  CAPTURE(straight, from_beside);
  CHECK(from_beside > straight + 0.1F);
}

TEST_CASE("a signature that was stored is the same when it is read") {
  const ScanSignature signature = ScanSignature::of(seen(street(), 0, 0, 0));
  const auto bytes = stored(signature);
  ScanSignature read;
  REQUIRE(read.read(bytes, ScanSignature::version));
  CHECK(stored(read) == bytes);
  CHECK(read.likeness(signature) == 1);
  CHECK(read.likeness_bound(signature) == 1);
  SECTION("what is of another version, or of another size, is none") {
    CHECK_FALSE(read.read(bytes, ScanSignature::version + 1));
    CHECK(read.likeness(signature) == 0);
    CHECK_FALSE(read.read(std::span(bytes).first(511), ScanSignature::version));
    CHECK_FALSE(read.read({}, ScanSignature::version));
  }
}

TEST_CASE("points that are no places, or far beyond what counts, leave no trace in a signature") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float inf = std::numeric_limits<float>::infinity();
  const std::array<Point, 7> points = {
      {{nan, 1, 1}, {1, nan, 1}, {1, 1, nan}, {inf, 0, 0}, {0, -inf, 0}, {3e38F, 3e38F, 0}, {1, 1, -inf}}};
  const auto bytes = stored(ScanSignature::of(points));
  CHECK(std::ranges::all_of(bytes, [](std::byte b) { return b == std::byte{0}; }));
  const std::array<Point, 1> high = {{{1, 1.1F, inf}}};
  CHECK(ScanSignature::of(high).cell(8, 0) == ScanSignature::highest);
}
