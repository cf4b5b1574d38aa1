#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "places/place_trial.h"

using namespace alces;
using namespace alces::places;

namespace {

bool same(const std::vector<Point>& a, const std::vector<Point>& b) {
  return std::ranges::equal(
      a, b, [](const Point& p, const Point& q) { return p.x == q.x && p.y == q.y && p.z == q.z; });
}

/// A scanner after the other, so that every kind meets all of them over the seeds.
Scanner scanner_for(Kind kind, std::uint64_t seed) {
  return all_scanners[(static_cast<std::size_t>(kind) + seed) % std::size(all_scanners)];
}

double way_m(const std::vector<Pose>& poses, std::uint32_t from, std::uint32_t to) {
  double sum_m = 0;
  for (std::uint32_t i = from; i < to; ++i)
    sum_m += (poses[i + 1].translation_m - poses[i].translation_m).norm();
  return sum_m;
}

}  // namespace

TEST_CASE("a place is the same for the same seed, and another for another") {
  for (const Kind kind : all_kinds) {
    CAPTURE(name(kind));
    const PlaceDrive one = drive_through(make_place(kind, 7), Scanner::rings16, 2);
    const PlaceDrive again = drive_through(make_place(kind, 7), Scanner::rings16, 2);
    const PlaceDrive other = drive_through(make_place(kind, 8), Scanner::rings16, 2);
    CHECK(same(one.scans[20], again.scans[20]));
    CHECK_FALSE(same(one.scans[20], other.scans[20]));
    CHECK(one.odometry(1).back().translation_m == again.odometry(1).back().translation_m);
  }
}

TEST_CASE("every kind of place offers different places, and revisits where the way comes back") {
  for (const Kind kind : all_kinds) {
    std::size_t others = 0;
    std::size_t revisits = 0;
    for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
      const PlaceDrive drive = drive_through(make_place(kind, seed), Scanner::rings16, 5);
      CAPTURE(name(kind), seed, drive.place.what, drive.truth.size());
      CHECK(drive.truth.size() >= 50);
      CHECK(drive.truth.size() <= 160);
      for (const Pair& pair : drive.pairs) {
        CAPTURE(pair.first, pair.last);
        const double apart_m =
            (drive.truth[pair.first].translation_m - drive.truth[pair.last].translation_m).norm();
        CHECK(way_m(drive.truth, pair.first, pair.last) > 10);
        if (pair.is_revisit) CHECK(apart_m <= 2.0);
        if (!pair.is_revisit) CHECK(apart_m > 1.0);
        ++(pair.is_revisit ? revisits : others);
      }
    }
    CAPTURE(name(kind));
    CHECK(others >= 8);
    CHECK((kind == Kind::pass ? revisits == 0 : revisits >= 4));
  }
}

TEST_CASE("scans of a place lie inside of what the scanner reaches, and some surround it") {
  for (const Kind kind : all_kinds) {
    const Scanner scanner = scanner_for(kind, 3);
    const PlaceDrive drive = drive_through(make_place(kind, 3), scanner, 1);
    CAPTURE(name(kind), name(scanner), drive.place.what);
    for (std::size_t i = 0; i < drive.scans.size(); i += 10) {
      CAPTURE(i);
      CHECK(drive.scans[i].size() > 800);
      std::size_t near = 0;  // the vehicle drives through nothing
      std::size_t far = 0;
      for (const Point& point : drive.scans[i]) {
        const float range_m = std::hypot(point.x, point.y, point.z);
        if (range_m > static_cast<float>(std::min(drive.place.reach_m, 80.0) + 0.1)) ++far;
        if (range_m < 0.4F) ++near;
      }
      CHECK(near == 0);
      CHECK(far == 0);
    }
  }
}

TEST_CASE("a mapper that believes everything is seen to close loops that are off") {
  MapperConfig config;
  std::size_t off = 0;
  for (const std::uint64_t seed : {1U, 2U}) {
    const PlaceDrive drive = drive_through(make_place(Kind::corridors, seed), Scanner::turning, 4);
    config = place_config(drive.truth.size());
    config.loop_verification.minimum_overlap = 0;
    config.loop_verification.maximum_rms_m = 1;
    config.loop_verification.maximum_mahalanobis2 = 1e9;
    config.loop_verification.minimum_wall_fit = 0;
    config.loop_verification.ambiguity_sigmas = 0;
    config.loop_verification.free_space_sigmas = 0;
    const Trial trial = try_mapper(drive, 1, config);
    for (const TriedLoop& loop : trial.offered) {
      if (loop.is_off()) ++off;
      if (loop.is_off()) CHECK_FALSE(loop.is_revisit);
    }
  }
  CHECK(off >= 1);
}

TEST_CASE("of loops that are not there none is taken, of revisits nearly all") {
  std::size_t revisits = 0;
  std::size_t taken = 0;
  for (const Kind kind : all_kinds) {
    const std::uint64_t seed = 11 + static_cast<std::uint64_t>(kind);
    const Scanner scanner = scanner_for(kind, seed);
    const PlaceDrive drive = drive_through(make_place(kind, seed), scanner, 3);
    const MapperConfig config = place_config(drive.truth.size());
    for (const double noise : {1.0, 3.0}) {
      CAPTURE(name(kind), seed, name(scanner), drive.place.what, noise);
      const Trial trial = try_mapper(drive, noise, config);
      for (const TriedLoop& loop : trial.offered) {
        CAPTURE(loop.report.first, loop.report.last, loop.off_m, loop.off_rad, loop.report.mahalanobis2);
        CHECK_FALSE(loop.is_off());
        if (!loop.is_revisit || loop.is_bare) continue;
        ++revisits;
        if (loop.is_recognised()) ++taken;
      }
      for (const TriedLoop& loop : trial.own) {
        CAPTURE(loop.report.first, loop.report.last, loop.off_m, loop.off_rad, loop.report.mahalanobis2);
        CHECK_FALSE(loop.is_off());
      }
      CAPTURE(trial.error_with_m, trial.error_without_m);
      CHECK_FALSE(trial.is_worse());
    }
  }
  CAPTURE(taken, revisits);
  CHECK(10 * taken >= 9 * revisits);
}
