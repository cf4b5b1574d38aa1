#include "alces/voxel_grid.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "alces_platform/sim/random.h"
#include "support/in_block.h"
#include "support/plain_voxel_grid.h"

using namespace alces;
using alces::sim::Random;
using alces::test::InBlock;
using alces::test::plain_reduce;
using alces::test::PlainCell;

namespace {

constexpr float nan_m = std::numeric_limits<float>::quiet_NaN();
constexpr float inf_m = std::numeric_limits<float>::infinity();

struct Reduced {
  Status status = Status::ok;
  VoxelGridCounts counts;
  std::vector<Point> points;
};

Reduced reduce(VoxelGrid& grid, std::span<const Point> points, std::size_t room) {
  Reduced result;
  result.points.resize(room);
  result.status = grid.reduce(points, result.points, result.counts);
  result.points.resize(result.counts.kept);
  return result;
}

Reduced reduce(const VoxelGridConfig& config, std::span<const Point> points) {
  InBlock<VoxelGrid> grid(config);
  return reduce(*grid, points, config.cell_capacity);
}

bool is_same(const std::vector<Point>& a, const std::vector<Point>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Point)) == 0);
}

void check_same(const VoxelGridCounts& a, const VoxelGridCounts& b) {
  CHECK(a.points == b.points);
  CHECK(a.kept == b.kept);
  CHECK(a.merged == b.merged);
  CHECK(a.not_finite == b.not_finite);
  CHECK(a.too_near == b.too_near);
  CHECK(a.too_far == b.too_far);
  CHECK(a.without_cell == b.without_cell);
  CHECK(a.cell_size_m == b.cell_size_m);
}

std::uint32_t sum(const VoxelGridCounts& c) {
  return c.kept + c.merged + c.not_finite + c.too_near + c.too_far + c.without_cell;
}

float coordinate(Random& random, double reach_m) {
  return static_cast<float>(random.uniform(-reach_m, reach_m));
}

std::vector<Point> cloud(std::uint64_t seed, std::size_t count, double reach_m) {
  Random random(seed);
  std::vector<Point> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back({coordinate(random, reach_m), coordinate(random, reach_m), coordinate(random, reach_m)});
    if (random.chance(0.002)) points.back().y = nan_m;
    if (random.chance(0.002)) points.back().z = -inf_m;
    if (random.chance(0.002)) points.back().x = 1e30F;
  }
  return points;
}

VoxelGridConfig config_for(CellRepresentative representative) {
  VoxelGridConfig config;
  config.representative = representative;
  config.cell_size_m = 0.25F;
  config.maximum_range_m = 3.0F;
  return config;
}

}  // namespace

TEST_CASE("a cell is represented by the measured point nearest its centroid") {
  const std::vector<Point> points = cloud(1, 20000, 2.5);
  const VoxelGridConfig config = config_for(CellRepresentative::measured);
  const auto plain = plain_reduce(points, config);
  const Reduced reduced = reduce(config, points);
  CHECK(reduced.status == Status::ok);
  check_same(reduced.counts, plain.counts);
  REQUIRE(reduced.points.size() == plain.cells.size());
  std::size_t invented = 0;
  std::size_t farther = 0;
  for (std::size_t i = 0; i < plain.cells.size(); ++i) {
    const PlainCell& cell = plain.cells[i];
    double nearest_m = 1e9;
    bool is_measured = false;
    for (const std::size_t p : cell.points) {
      nearest_m = std::min(nearest_m, cell.distance_m(points[p]));
      is_measured = is_measured || std::memcmp(&points[p], &reduced.points[i], sizeof(Point)) == 0;
    }
    if (!is_measured) ++invented;
    if (cell.distance_m(reduced.points[i]) > nearest_m + 1e-5) ++farther;  // the rounding of float sums
  }
  CHECK(invented == 0);
  CHECK(farther == 0);
}

TEST_CASE("a cell is represented by its centroid") {
  const std::vector<Point> points = cloud(2, 20000, 2.5);
  const VoxelGridConfig config = config_for(CellRepresentative::centroid);
  const auto plain = plain_reduce(points, config);
  const Reduced reduced = reduce(config, points);
  check_same(reduced.counts, plain.counts);
  REQUIRE(reduced.points.size() == plain.cells.size());
  double worst_m = 0;
  for (std::size_t i = 0; i < plain.cells.size(); ++i) {
    worst_m = std::max(worst_m, plain.cells[i].distance_m(reduced.points[i]));
  }
  CHECK(worst_m < 1e-5);
}

TEST_CASE("a cell is represented by its centre") {
  const std::vector<Point> points = cloud(3, 20000, 2.5);
  const VoxelGridConfig config = config_for(CellRepresentative::center);
  const auto plain = plain_reduce(points, config);
  const Reduced reduced = reduce(config, points);
  check_same(reduced.counts, plain.counts);
  REQUIRE(reduced.points.size() == plain.cells.size());
  double worst_m = 0;
  for (std::size_t i = 0; i < plain.cells.size(); ++i) {
    const auto error_m = [&](float got, int axis) {
      const double center_m =
          (static_cast<double>(plain.cells[i].index[static_cast<std::size_t>(axis)]) + 0.5) * 0.25;
      worst_m = std::max(worst_m, std::abs(static_cast<double>(got) - center_m));
    };
    error_m(reduced.points[i].x, 0);
    error_m(reduced.points[i].y, 1);
    error_m(reduced.points[i].z, 2);
  }
  CHECK(worst_m < 1e-6);
}

TEST_CASE("the counts of a reduction add up, whatever comes in") {
  for (std::uint64_t seed = 10; seed < 30; ++seed) {
    VoxelGridConfig config;
    config.cell_size_m = 0.5F;
    config.cell_capacity = 300;
    config.maximum_range_m = 5;
    config.representative = static_cast<CellRepresentative>(seed % 3);
    const std::vector<Point> points = cloud(seed, static_cast<std::size_t>(1000 + seed), 4);
    const Reduced reduced = reduce(config, points);
    check_same(reduced.counts, plain_reduce(points, config).counts);
    CHECK(sum(reduced.counts) == points.size());
    CHECK(reduced.counts.points == points.size());
    CHECK(reduced.status == Status::no_voxel_capacity);
  }
}

TEST_CASE("cells meet at their borders, and on both sides of zero they are different ones") {
  VoxelGridConfig config;
  config.cell_size_m = 1;
  config.minimum_range_m = 0;
  config.representative = CellRepresentative::center;
  std::vector<Point> points;
  for (const float x : {-0.25F, 0.25F}) {
    for (const float y : {-0.25F, 0.25F}) {
      for (const float z : {-0.25F, 0.25F}) points.push_back({x, y, z});
    }
  }
  const Reduced corner = reduce(config, points);
  REQUIRE(corner.counts.kept == 8);
  for (std::size_t i = 0; i < 8; ++i) {
    CHECK(corner.points[i].x == 2 * points[i].x);
    CHECK(corner.points[i].y == 2 * points[i].y);
    CHECK(corner.points[i].z == 2 * points[i].z);
  }

  // A border belongs to the cell above it.
  const std::vector<Point> borders = {{-1, 0.5F, 0.5F},   {-0.5F, 0.5F, 0.5F}, {0, 0.5F, 0.5F},
                                      {0.5F, 0.5F, 0.5F}, {1, 0.5F, 0.5F},     {-0.0F, 0.5F, 0.5F}};
  const Reduced along = reduce(config, borders);
  REQUIRE(along.counts.kept == 3);
  CHECK(along.points[0].x == -0.5F);
  CHECK(along.points[1].x == 0.5F);
  CHECK(along.points[2].x == 1.5F);
}

TEST_CASE("with more cells than the table has, cells double until every point finds one") {
  VoxelGridConfig config;
  config.cell_size_m = 1;
  config.cell_capacity = 3;
  config.representative = CellRepresentative::centroid;
  const std::vector<Point> points = {{1.25F, 0, 0}, {2.25F, 0, 0}, {3.25F, 0, 0}, {4.25F, 0, 0},
                                     {1.75F, 0, 0}, {5.25F, 0, 0}, {3.75F, 0, 0}, {4.5F, 0, 0}};
  InBlock<VoxelGrid> grid(config);
  const Reduced reduced = reduce(*grid, points, 8);
  CHECK(reduced.status == Status::no_voxel_capacity);
  CHECK(reduced.counts.cell_size_m == 2);
  CHECK(reduced.counts.kept == 3);
  CHECK(reduced.counts.merged == 5);
  CHECK(reduced.counts.without_cell == 0);
  REQUIRE(reduced.points.size() == 3);
  CHECK(reduced.points[0].x == 1.5F);
  CHECK(reduced.points[1].x == Approx(9.25 / 3));
  CHECK(reduced.points[2].x == Approx(14.0 / 3));

  SECTION("the caller's room is a capacity too") {
    const Reduced two = reduce(*grid, points, 2);
    CHECK(two.status == Status::no_voxel_capacity);
    CHECK(two.counts.cell_size_m == 4);
    CHECK(two.counts.kept == 2);
    CHECK(two.counts.without_cell == 0);
    const Reduced none = reduce(*grid, points, 0);
    CHECK(none.status == Status::no_voxel_capacity);
    CHECK(none.counts.without_cell == 8);
  }
  SECTION("and the grid is as good as new afterwards, at the size that it is configured to") {
    const Reduced again = reduce(*grid, std::span(points).last(2), 8);
    CHECK(again.status == Status::ok);
    CHECK(again.counts.cell_size_m == 1);
    CHECK(again.counts.kept == 2);
    CHECK(again.points[0].x == 3.75F);
  }
}

TEST_CASE("a scan that is downsampled coarser is what a grid of that cell size makes of it") {
  for (int representative = 0; representative < 3; ++representative) {
    VoxelGridConfig config;
    config.representative = static_cast<CellRepresentative>(representative);
    config.cell_size_m = 0.1F;
    config.cell_capacity = 3000;
    const std::vector<Point> points = cloud(50, 20000, 2.5);
    const Reduced coarser = reduce(config, points);
    CHECK(coarser.status == Status::no_voxel_capacity);
    REQUIRE(coarser.counts.cell_size_m == 0.4F);  // at 0.2 m most of 15,625 cells are taken
    config.cell_size_m = 0.4F;
    const Reduced configured = reduce(config, points);
    CHECK(configured.status == Status::ok);
    check_same(coarser.counts, configured.counts);
    CHECK(is_same(coarser.points, configured.points));
  }
}

TEST_CASE("tiny cells that grow leave out no more by range than they did, and growing ends") {
  VoxelGridConfig config;
  config.cell_size_m = 1e-5F;
  config.minimum_range_m = 0;
  config.cell_capacity = 8;
  std::vector<Point> points;
  for (int i = 0; i < 4096; ++i) {
    const auto sign = [i](int bit) { return (i >> bit & 1) == 0 ? 1.0F : -1.0F; };
    const float size_m = 0.001F * static_cast<float>(i + 1);
    points.push_back({sign(0) * size_m, sign(1) * size_m, sign(2) * size_m});
  }
  points.push_back({11, 0, 0});
  const Reduced eight = reduce(config, points);
  CHECK(eight.counts.kept == 8);
  CHECK(eight.counts.too_far == 1);
  CHECK(eight.counts.without_cell == 0);
  CHECK(sum(eight.counts) == points.size());
  config.cell_capacity = 7;  // one octant has no cell, however large
  const Reduced seven = reduce(config, points);
  CHECK(seven.status == Status::no_voxel_capacity);
  CHECK(seven.counts.kept == 7);
  CHECK(seven.counts.without_cell == 512);
  CHECK(sum(seven.counts) == points.size());
}

namespace {

// A car's 64 beams in a street of houses, 115,200 points, in the order of the beams from the top to the
// bottom.
std::vector<Point> dense_street() {
  std::vector<Point> points;
  constexpr double pi = 3.14159265358979;
  for (int beam = 0; beam < 64; ++beam) {
    const double elevation = (2.0 - 26.8 * beam / 63) * pi / 180;
    for (int step = 0; step < 1800; ++step) {
      const double azimuth = (step - 900) * pi / 900;
      const double across = std::abs(std::cos(elevation) * std::sin(azimuth));
      double range_m = across > 1e-9 ? 12 / across : 1e9;
      if (elevation < 0) range_m = std::min(range_m, 1.7 / -std::sin(elevation));
      if (range_m > 95) range_m = 95;
      points.push_back({static_cast<float>(range_m * std::cos(elevation) * std::cos(azimuth)),
                        static_cast<float>(range_m * std::cos(elevation) * std::sin(azimuth)),
                        static_cast<float>(range_m * std::sin(elevation))});
    }
  }
  return points;
}

// How many points each sector of 10 deg azimuth and 4 deg elevation has.
std::map<std::pair<int, int>, int> sectors_of(const std::vector<Point>& points) {
  std::map<std::pair<int, int>, int> sectors;
  constexpr double deg = 180 / 3.14159265358979;
  for (const Point& p : points) {
    const auto x = static_cast<double>(p.x);
    const auto y = static_cast<double>(p.y);
    const double azimuth_deg = std::atan2(y, x) * deg;
    const double elevation_deg = std::atan2(static_cast<double>(p.z), std::hypot(x, y)) * deg;
    ++sectors[{static_cast<int>(std::floor(azimuth_deg / 10)),
               static_cast<int>(std::floor((elevation_deg - 2) / 4))}];
  }
  return sectors;
}

}  // namespace

TEST_CASE("a scan of more cells than the table has loses no region, whatever the order of its points") {
  const std::vector<Point> in_file_order = dense_street();
  const auto seen = sectors_of(in_file_order);
  REQUIRE(seen.size() >= 250);
  std::vector<Point> reversed(in_file_order.rbegin(), in_file_order.rend());
  std::vector<Point> shuffled = in_file_order;
  Random random(7);
  for (std::size_t i = shuffled.size() - 1; i > 0; --i)
    std::swap(shuffled[i], shuffled[static_cast<std::size_t>(random.uniform(0, static_cast<double>(i)))]);
  for (const std::uint32_t capacity : {16384U, 8192U}) {
    VoxelGridConfig config;
    config.cell_capacity = capacity;
    const Reduced first = reduce(config, in_file_order);
    CHECK(first.counts.cell_size_m > 0.1F);
    for (const std::vector<Point>* order :
         {&in_file_order, &std::as_const(reversed), &std::as_const(shuffled)}) {
      const Reduced reduced = reduce(config, *order);
      CHECK(reduced.status == Status::no_voxel_capacity);
      CHECK(reduced.counts.kept <= capacity);
      CHECK(reduced.counts.without_cell == 0);
      CHECK(reduced.counts.cell_size_m == first.counts.cell_size_m);
      CHECK(reduced.counts.kept == first.counts.kept);
      const float cells_per_m = 1 / reduced.counts.cell_size_m;
      const auto cell_of = [&](const Point& p) {
        return std::array<float, 3>{std::floor(p.x * cells_per_m), std::floor(p.y * cells_per_m),
                                    std::floor(p.z * cells_per_m)};
      };
      std::set<std::array<float, 3>> cells;
      for (const Point& p : reduced.points) cells.insert(cell_of(p));
      CHECK(std::ranges::all_of(*order, [&](const Point& p) { return cells.count(cell_of(p)) == 1; }));
      if (reduced.counts.cell_size_m > 0.5F) continue;  // near sectors are smaller than that
      const auto kept = sectors_of(reduced.points);
      CHECK(std::ranges::all_of(
          seen, [&](const auto& sector) { return sector.second < 20 || kept.count(sector.first) == 1; }));
    }
  }
}

TEST_CASE("a table that is full to its last cell keeps them all") {
  VoxelGridConfig config;
  config.cell_size_m = 0.2F;
  config.cell_capacity = 1U << 15;  // 32 cells an axis
  std::vector<Point> points;
  for (int x = -16; x < 16; ++x) {
    for (int y = -16; y < 16; ++y) {
      for (int z = 10; z < 42; ++z) {
        points.push_back({(static_cast<float>(x) + 0.5F) * 0.2F, (static_cast<float>(y) + 0.5F) * 0.2F,
                          (static_cast<float>(z) + 0.5F) * 0.2F});
      }
    }
  }
  const Reduced reduced = reduce(config, points);
  CHECK(reduced.status == Status::ok);
  CHECK(reduced.counts.kept == config.cell_capacity);
  CHECK(is_same(reduced.points, points));
}

TEST_CASE("points that are no numbers, too near or too far are counted and left out") {
  VoxelGridConfig config;
  config.minimum_range_m = 1;
  config.maximum_range_m = 10;
  const std::vector<Point> points = {
      {nan_m, 2, 2}, {2, nan_m, 2},  {2, 2, nan_m},         {inf_m, 2, 2},   {2, -inf_m, 2},  // not finite
      {1e30F, 0, 0}, {0, -1e30F, 0}, {3e38F, 3e38F, 3e38F}, {10.001F, 0, 0}, {6, 6, 6},       // too far
      {0, 0, 0},     {0.999F, 0, 0}, {0.5F, 0.5F, 0.5F},                                      // too near
      {1, 0, 0},     {0, 10, 0}};                                                             // just right
  const Reduced reduced = reduce(config, points);
  CHECK(reduced.status == Status::ok);
  CHECK(reduced.counts.not_finite == 5);
  CHECK(reduced.counts.too_far == 5);
  CHECK(reduced.counts.too_near == 3);
  CHECK(reduced.counts.kept == 2);
  CHECK(is_same(reduced.points, {points[13], points[14]}));
}

TEST_CASE("a range that tiny cells cannot number counts as too far") {
  VoxelGridConfig config;
  config.cell_size_m = 1e-5F;
  const std::vector<Point> points = {{5, 0, 0}, {-5, 0, 0}, {0, 0, -10}, {50, 0, 0}, {0, -99, 0}};
  const Reduced reduced = reduce(config, points);
  CHECK(reduced.counts.kept == 3);
  CHECK(reduced.counts.too_far == 2);
  CHECK(sum(reduced.counts) == 5);
}

TEST_CASE("without a usable point the scan is empty") {
  const VoxelGridConfig config;
  CHECK(reduce(config, {}).status == Status::empty_scan);
  const std::vector<Point> useless = {{nan_m, 0, 0}, {0, 0, 0}, {1e30F, 1e30F, 1e30F}};
  const Reduced reduced = reduce(config, useless);
  CHECK(reduced.status == Status::empty_scan);
  CHECK(reduced.points.empty());
  CHECK(sum(reduced.counts) == 3);
  const std::vector<Point> one = {{1, 2, 3}};
  CHECK(reduce(config, one).status == Status::ok);
}

TEST_CASE("what one scan left behind never shows in the next") {
  const std::vector<Point> a = cloud(40, 5000, 2.5);
  const std::vector<Point> b = cloud(41, 8000, 2.0);
  for (const CellRepresentative representative :
       {CellRepresentative::measured, CellRepresentative::centroid, CellRepresentative::center}) {
    VoxelGridConfig config = config_for(representative);
    config.cell_capacity = 3000;
    InBlock<VoxelGrid> grid(config);
    const Reduced first = reduce(*grid, a, 3000);
    const Reduced between = reduce(*grid, b, 3000);
    const Reduced again = reduce(*grid, a, 3000);
    check_same(first.counts, again.counts);
    CHECK(is_same(first.points, again.points));
    CHECK(is_same(between.points, reduce(config, b).points));
    CHECK(is_same(first.points, reduce(config, a).points));
  }
}

TEST_CASE("equal points in one place make one cell") {
  const std::vector<Point> points(1000, Point{1.5F, -2.5F, 0.25F});
  for (int representative = 0; representative < 2; ++representative) {
    VoxelGridConfig config;
    config.representative = static_cast<CellRepresentative>(representative);
    const Reduced reduced = reduce(config, points);
    REQUIRE(reduced.counts.kept == 1);
    CHECK(reduced.counts.merged == 999);
    CHECK(reduced.points[0].x == Approx(1.5F).epsilon(1e-5));
  }
}

TEST_CASE("the point that stands for a cell is told, so that what belongs to it goes with it") {
  Random random(5);
  std::vector<Point> points;
  for (int i = 0; i < 3000; ++i) {
    const auto along = [&random] { return static_cast<float>(random.uniform(-4, 4)); };
    points.push_back({along(), along(), along()});
  }
  for (const CellRepresentative representative :
       {CellRepresentative::measured, CellRepresentative::centroid}) {
    VoxelGridConfig config;
    config.cell_size_m = 0.5F;
    config.representative = representative;
    InBlock<VoxelGrid> grid(config);
    const Reduced reduced = reduce(*grid, points, config.cell_capacity);
    REQUIRE(reduced.points.size() > 100);
    std::set<std::uint32_t> chosen;
    for (std::uint32_t i = 0; i < reduced.points.size(); ++i) {
      const std::uint32_t which = grid->chosen(i);
      REQUIRE(which < points.size());
      chosen.insert(which);
      const Point& a = points[which];
      const Point& b = reduced.points[i];
      if (representative == CellRepresentative::measured) CHECK(std::memcmp(&a, &b, sizeof(Point)) == 0);
      for (const auto& [of_point, of_cell] : {std::pair(a.x, b.x), std::pair(a.y, b.y), std::pair(a.z, b.z)})
        CHECK(std::floor(of_point / 0.5F) == std::floor(of_cell / 0.5F));
    }
    CHECK(chosen.size() == reduced.points.size());
  }
}
