#include "alces/map_verdict.h"

#include <catch2/catch.hpp>
#include <functional>
#include <numbers>
#include <set>
#include <string>

using namespace alces;

namespace {

/// A drive of 100 steps and 200 m that nothing speaks against.
MapHealth sound() {
  MapHealth health;
  health.scans = 101;
  health.length_m = 200;
  health.closed = 5;
  health.revisits = 2;
  health.expected_error_m = 0.3;
  return health;
}

MapHealth judged(const std::function<void(MapHealth&)>& change) {
  MapHealth health = sound();
  change(health);
  judge_map(health);
  return health;
}

/// Just below and just above each bound of a figure.
void check_bounds(std::uint32_t MapHealth::*figure, MapDoubt doubt, std::uint32_t last_good,
                  std::uint32_t last_doubtful) {
  const auto with = [&](std::uint32_t value) {
    return judged([&](MapHealth& health) { health.*figure = value; });
  };
  CHECK(with(last_good).verdict == MapVerdict::good);
  CHECK(with(last_good).doubt == MapDoubt::none);
  CHECK(with(last_good + 1).verdict == MapVerdict::doubtful);
  CHECK(with(last_good + 1).doubt == doubt);
  CHECK(with(last_doubtful).verdict == MapVerdict::doubtful);
  CHECK(with(last_doubtful + 1).verdict == MapVerdict::bad);
  CHECK(with(last_doubtful + 1).doubt == doubt);
}

}  // namespace

TEST_CASE("a map that nothing speaks against is good, an empty one and one without loops, too") {
  CHECK(judged([](MapHealth&) {}).verdict == MapVerdict::good);
  MapHealth empty;
  judge_map(empty);
  CHECK(empty.verdict == MapVerdict::good);
  CHECK(judged([](MapHealth& health) { health.closed = health.revisits = 0; }).verdict == MapVerdict::good);
}

TEST_CASE("a map in parts is bad") {
  const MapHealth health = judged([](MapHealth& each) { each.parts = 2; });
  CHECK(health.verdict == MapVerdict::bad);
  CHECK(health.doubt == MapDoubt::parts);
}

TEST_CASE(
    "steps on odometry alone are doubted from more than two of a hundred, and bad from more than twenty") {
  check_bounds(&MapHealth::on_odometry, MapDoubt::odometry_alone, 2, 20);
}

TEST_CASE("an expected error counts from half a metre on, as a share of the way") {
  const auto with = [](double expected_m, double length_m) {
    return judged([&](MapHealth& health) {
      health.expected_error_m = expected_m;
      health.length_m = length_m;
    });
  };
  CHECK(with(0.49, 1).verdict == MapVerdict::good);  // half of the way, but not half a metre
  CHECK(with(0.51, 10).verdict == MapVerdict::bad);
  CHECK(with(3.99, 200).verdict == MapVerdict::good);
  CHECK(with(4.01, 200).verdict == MapVerdict::doubtful);
  CHECK(with(9.99, 200).verdict == MapVerdict::doubtful);
  CHECK(with(10.01, 200).verdict == MapVerdict::bad);
  CHECK(with(10.01, 200).doubt == MapDoubt::drift);
}

TEST_CASE("revisits that do not fit are doubted above one in fifteen loops, and bad above a third") {
  const auto with = [](std::uint32_t unmatched, std::uint32_t closed, std::uint32_t implausible) {
    return judged([&](MapHealth& health) {
             health.unmatched = unmatched;
             health.closed = closed;
             health.implausible = implausible;
           })
        .verdict;
  };
  CHECK(with(2, 0, 0) == MapVerdict::good);  // two may be chance
  CHECK(with(3, 0, 0) == MapVerdict::bad);
  CHECK(with(6, 100, 0) == MapVerdict::good);
  CHECK(with(7, 100, 0) == MapVerdict::doubtful);
  CHECK(with(33, 100, 0) == MapVerdict::doubtful);
  CHECK(with(34, 100, 0) == MapVerdict::bad);
  CHECK(with(6, 0, 100) == MapVerdict::good);  // places that look alike say nothing against the map
}

TEST_CASE(
    "scans that see a tenth more or less of the way than the odometry make a map doubtful, a third bad") {
  const auto with = [](double scale) {
    return judged([&](MapHealth& health) { health.odometry_scale = scale; });
  };
  for (const double scale : {0.91, 1.0, 1.09}) CHECK(with(scale).verdict == MapVerdict::good);
  for (const double scale : {0.71, 0.89, 1.11, 1.29}) {
    CHECK(with(scale).verdict == MapVerdict::doubtful);
    CHECK(with(scale).doubt == MapDoubt::odometry_scale);
  }
  for (const double scale : {0.01, 0.69, 1.31, 3.0}) CHECK(with(scale).verdict == MapVerdict::bad);
}

TEST_CASE(
    "what the odometry says of scale and tilt is overruled by three revisits that were closed, and no "
    "fewer") {
  const auto with = [](std::uint32_t revisits, std::uint32_t unmatched, double scale, double tilt_rad) {
    return judged([&](MapHealth& health) {
             health.closed = 20;
             health.revisits = revisits;
             health.unmatched = unmatched;
             health.odometry_scale = scale;
             health.tilt_rad = tilt_rad;
           })
        .verdict;
  };
  CHECK(with(3, 0, 0.88, 0) == MapVerdict::good);
  CHECK(with(3, 0, 1, 0.26) == MapVerdict::good);
  CHECK(with(2, 0, 0.88, 0) == MapVerdict::doubtful);
  CHECK(with(2, 0, 1, 0.26) == MapVerdict::doubtful);
  CHECK(with(3, 3, 1, 0.26) != MapVerdict::good);  // revisits that fail
  CHECK(with(9, 0, 0.5, 0) == MapVerdict::bad);    // no odometry is off by half
}

TEST_CASE("a map steeper than a street is doubtful, and a hill is not") {
  const auto with = [](double deg) {
    return judged([deg](MapHealth& each) { each.tilt_rad = deg * std::numbers::pi / 180; });
  };
  CHECK(with(11).verdict == MapVerdict::good);
  CHECK(with(13.9).verdict == MapVerdict::good);
  for (const double deg : {14.1, 40.0}) {
    CHECK(with(deg).verdict == MapVerdict::doubtful);
    CHECK(with(deg).doubt == MapDoubt::steep);
  }
}

TEST_CASE("a single scan that fits badly makes a map doubtful, and many do not make it bad") {
  for (const std::uint32_t steps : {1U, 50U}) {
    const MapHealth health = judged([&](MapHealth& each) { each.weak = steps; });
    CHECK(health.verdict == MapVerdict::doubtful);
    CHECK(health.doubt == MapDoubt::weak_steps);
  }
}

TEST_CASE(
    "one step against the odometry that no loop confirms makes a map doubtful, and many do not make it bad") {
  for (const std::uint32_t steps : {1U, 50U}) {
    const MapHealth health = judged([&](MapHealth& each) { each.against_odometry = steps; });
    CHECK(health.verdict == MapVerdict::doubtful);
    CHECK(health.doubt == MapDoubt::odometry_contradicted);
  }
}

TEST_CASE("searching for more than half of the steps makes a map doubtful, and nothing of it makes it bad") {
  const auto with = [](std::uint32_t found, std::uint32_t scans) {
    return judged([&](MapHealth& health) {
      health.found = found;
      health.scans = scans;
    });
  };
  CHECK(with(50, 101).verdict == MapVerdict::good);
  CHECK(with(51, 101).verdict == MapVerdict::doubtful);
  CHECK(with(51, 101).doubt == MapDoubt::searched);
  CHECK(with(100, 101).verdict == MapVerdict::doubtful);
  CHECK(with(20, 21).verdict == MapVerdict::good);  // a few steps tell nothing
}

TEST_CASE("of several doubts the worst is told, and of equally bad ones one") {
  const MapHealth health = judged([](MapHealth& each) {
    each.on_odometry = 5;  // doubtful
    each.against_odometry = 1;
    each.expected_error_m = 11;  // bad
  });
  CHECK(health.verdict == MapVerdict::bad);
  CHECK(health.doubt == MapDoubt::drift);
}

TEST_CASE("no figure that gets worse makes a map better") {
  const auto worsen = [](auto figure, double step) {
    MapHealth health = sound();
    MapVerdict last = MapVerdict::good;
    for (int i = 0; i < 100; ++i) {
      health.*figure = static_cast<std::remove_reference_t<decltype(health.*figure)>>(step * i);
      judge_map(health);
      CHECK(health.verdict >= last);
      CHECK((health.verdict == MapVerdict::good) == (health.doubt == MapDoubt::none));
      last = health.verdict;
    }
    CHECK(last > MapVerdict::good);
  };
  for (std::uint32_t MapHealth::*figure : {&MapHealth::found, &MapHealth::on_odometry, &MapHealth::parts,
                                           &MapHealth::against_odometry, &MapHealth::unmatched}) {
    worsen(figure, 1);
  }
  worsen(&MapHealth::expected_error_m, 0.1);
}

TEST_CASE("every verdict of a map and every doubt of it has words of its own") {
  std::set<std::string> words = {to_string(MapVerdict::good), to_string(MapVerdict::doubtful),
                                 to_string(MapVerdict::bad)};
  CHECK(words.size() == 3);
  for (const MapDoubt doubt : {MapDoubt::none, MapDoubt::parts, MapDoubt::unmatched_revisits, MapDoubt::drift,
                               MapDoubt::odometry_alone, MapDoubt::odometry_contradicted,
                               MapDoubt::odometry_scale, MapDoubt::weak_steps, MapDoubt::searched}) {
    words.insert(to_string(doubt));
  }
  CHECK(words.size() == 12);
}
