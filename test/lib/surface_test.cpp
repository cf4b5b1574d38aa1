#include "alces/surface.h"

#include <Eigen/Eigenvalues>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "alces_platform/sim/random.h"
#include "support/in_block.h"
#include "support/plain_scene.h"

using namespace alces;
using alces::sim::Random;
using alces::test::InBlock;

namespace {

struct Tree {
  explicit Tree(const std::vector<Point>& points)
      : scratch(static_cast<std::uint32_t>(points.size())), tree(static_cast<std::uint32_t>(points.size())) {
    REQUIRE(tree->build(points, *scratch));
  }
  InBlock<KdTreeScratch> scratch;
  InBlock<KdTree> tree;
};

std::vector<SurfaceSample> samples_of(const KdTree& tree, const SurfaceConfig& config) {
  std::vector<SurfaceSample> samples(config.sample_capacity);
  samples.resize(sample_surface(tree, config, measure_spacing(tree, config.neighbors), samples));
  return samples;
}

Eigen::Vector3d normal(const SurfaceSample& sample) {
  return Eigen::Map<const Eigen::Vector3f>(sample.normal).cast<double>();
}

Eigen::Vector3d vector(const Point& p) {
  return Eigen::Vector3f(p.x, p.y, p.z).cast<double>();
}

Point point(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

std::vector<Point> patch(const Eigen::Vector3d& middle, const Eigen::Vector3d& up, std::size_t count,
                         double noise_m, std::uint64_t seed) {
  Random random(seed);
  const Eigen::Vector3d u = up.unitOrthogonal();
  const Eigen::Vector3d v = up.cross(u);
  std::vector<Point> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back(point(middle + random.uniform(-2, 2) * u + random.uniform(-2, 2) * v +
                           noise_m * random.normal() * up));
  }
  return points;
}

}  // namespace

TEST_CASE("samples of a plane have its normal and no roughness, near the scanner and far away") {
  Random random(1);
  for (const double away_m : {0.0, 100.0, 10000.0}) {
    const Eigen::Vector3d up = Eigen::Vector3d(random.uniform(), random.uniform(), 1).normalized();
    const Tree tree(patch(away_m * Eigen::Vector3d(1, -1, 0), up, 500, 0, 2));
    // floats are 1 mm apart at 10 km
    const double rounding = away_m > 1000 ? 0.02 : 1e-3;
    std::size_t wrong = 0;
    for (const SurfaceSample& sample : samples_of(*tree.tree, {})) {
      if (std::abs(normal(sample).norm() - 1) > 1e-5) ++wrong;
      if (std::abs(normal(sample).dot(up)) < 1 - rounding) ++wrong;
      if (static_cast<double>(sample.roughness) > rounding) ++wrong;
    }
    CAPTURE(away_m);
    CHECK(wrong == 0);
  }
}

TEST_CASE("normals and roughness are those of a fit in double precision") {
  const std::vector<Point> points = patch({5, 3, 1}, Eigen::Vector3d(1, 2, 2).normalized(), 800, 0.05, 3);
  const Tree tree(points);
  const SurfaceConfig config;
  const ScanSpacing spacing = measure_spacing(*tree.tree, config.neighbors);
  std::size_t wrong = 0;
  for (const SurfaceSample& sample : samples_of(*tree.tree, config)) {
    std::array<Neighbor, KdTree::maximum_neighbors> found;
    const Point at = tree.tree->point(sample.index);
    const float reach_m = config.neighbor_reach * spacing.at(static_cast<float>(vector(at).norm()));
    const std::uint32_t count =
        tree.tree->nearest(at, reach_m * reach_m, std::span(found).first(config.neighbors));
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::uint32_t i = 0; i < count; ++i) mean += vector(tree.tree->point(found[i].index)) / count;
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (std::uint32_t i = 0; i < count; ++i) {
      const Eigen::Vector3d d = vector(tree.tree->point(found[i].index)) - mean;
      spread += d * d.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
    const double roughness = solver.eigenvalues()[0] / solver.eigenvalues()[1];
    if (std::abs(static_cast<double>(sample.roughness) - roughness) > 2e-3) ++wrong;
    if (roughness < 0.8 && std::abs(normal(sample).dot(solver.eigenvectors().col(0))) < 0.999) ++wrong;
  }
  CHECK(wrong == 0);
}

TEST_CASE("samples are spread evenly over all points, each taken once") {
  const Tree tree(patch({0, 0, 5}, Eigen::Vector3d::UnitZ(), 1000, 0.01, 4));
  for (const std::uint32_t capacity : {1U, 7U, 333U, 999U, 1000U, 5000U}) {
    SurfaceConfig config;
    config.sample_capacity = capacity;
    const std::vector<SurfaceSample> samples = samples_of(*tree.tree, config);
    REQUIRE(samples.size() == std::min(capacity, 1000U));
    const double gap = 1000.0 / static_cast<double>(samples.size());
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (std::abs(samples[i].index - gap * static_cast<double>(i)) > 1) ++wrong;
      if (i > 0 && samples[i].index <= samples[i - 1].index) ++wrong;
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("no more samples are written than the caller has room for") {
  const Tree tree(patch({0, 0, 5}, Eigen::Vector3d::UnitZ(), 100, 0.01, 5));
  std::vector<SurfaceSample> samples(10);
  const ScanSpacing spacing = measure_spacing(*tree.tree, SurfaceConfig{}.neighbors);
  CHECK(sample_surface(*tree.tree, {}, spacing, std::span(samples).first(10)) == 10);
  CHECK(sample_surface(*tree.tree, {}, spacing, std::span(samples).first(0)) == 0);
  CHECK(sample_surface(KdTree(), {}, spacing, samples) == 0);
}

TEST_CASE("a point without enough neighbours within reach has no plane") {
  std::vector<Point> points = patch({0, 0, 0}, Eigen::Vector3d::UnitZ(), 300, 0.01, 6);
  points.push_back({20, 0, 0});
  points.push_back({0, 30, 0});
  const Tree tree(points);
  std::size_t alone = 0;
  for (const SurfaceSample& sample : samples_of(*tree.tree, {})) {
    if (vector(tree.tree->point(sample.index)).norm() < 10) continue;
    ++alone;
    CHECK(normal(sample).isZero(0));
    CHECK(sample.roughness == 1.0F);
  }
  CHECK(alone == 2);
}

TEST_CASE("points in one place have no plane") {
  const Tree tree(std::vector<Point>(50, Point{3, -2, 1.7F}));
  for (const SurfaceSample& sample : samples_of(*tree.tree, {})) {
    REQUIRE(normal(sample).isZero(0));
    REQUIRE(sample.roughness == 1.0F);
  }
}

TEST_CASE("points on a line have no plane") {
  for (const Eigen::Vector3d& along : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(1, 1, 0),
                                       Eigen::Vector3d(0.3, -0.5, 0.7), Eigen::Vector3d(1, 2, 3)}) {
    std::vector<Point> points;
    for (int i = 0; i < 60; ++i) points.push_back(point(Eigen::Vector3d(4, 5, 6) + 0.05 * i * along));
    const Tree tree(points);
    CAPTURE(along.transpose());
    std::size_t with_plane = 0;
    for (const SurfaceSample& sample : samples_of(*tree.tree, {})) {
      if (sample.roughness < 0.2F) ++with_plane;
    }
    CHECK(with_plane == 0);
  }
}

TEST_CASE("a cloud without surfaces is rough") {
  Random random(7);
  std::vector<Point> points;
  for (int i = 0; i < 2000; ++i) {
    points.push_back(point({random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3)}));
  }
  const Tree tree(points);
  const std::vector<SurfaceSample> samples = samples_of(*tree.tree, {});
  double sum = 0;
  for (const SurfaceSample& sample : samples) sum += static_cast<double>(sample.roughness);
  CHECK(sum / static_cast<double>(samples.size()) > 0.3);
}

TEST_CASE("normals look to the scanner, wherever it stands, and from the two sides of a wall both ways") {
  for (const Pose& at : {test::pose_at(0, 0, 1, 0), test::pose_at(3, -3, 2, 130, 20, -10)}) {
    const Tree tree(test::room().scan(at, 4000, 12, 0.01, 1));
    std::size_t with_plane = 0;
    std::size_t away = 0;
    for (const SurfaceSample& sample : samples_of(*tree.tree, {})) {
      if (sample.roughness > 0.2F) continue;
      ++with_plane;
      if (normal(sample).dot(vector(tree.tree->point(sample.index))) > 0) ++away;
    }
    CHECK(with_plane > 1000);
    CHECK(away == 0);
  }
  for (const double y_m : {-4.0, 4.0}) {
    const Tree tree(patch({0, y_m, 0}, Eigen::Vector3d::UnitY(), 500, 0, 2));
    for (const SurfaceSample& sample : samples_of(*tree.tree, {})) REQUIRE(normal(sample).y() * y_m < 0);
  }
}

TEST_CASE("a scan's spacing grows with range where angles are fixed, and is that of its angles") {
  for (const double step_rad : {0.01, 0.02}) {
    std::vector<Point> points;
    for (double azimuth = -1; azimuth < 1; azimuth += step_rad) {
      const double range_m = azimuth < 0 ? 5 : 20;  // two walls about the scanner
      for (double height = -0.3; height < 0.3; height += step_rad)
        points.push_back(point(range_m * Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), height)));
    }
    const Tree tree(points);
    const ScanSpacing spacing = measure_spacing(*tree.tree, 16);
    CAPTURE(step_rad, spacing.per_range, spacing.smallest_m, spacing.typical_m, spacing.typical_range_m);
    // In a square grid the 16th nearest, the point itself included, is a knight's move away.
    const double per_range = std::sqrt(5.0) * step_rad;
    CHECK(static_cast<double>(spacing.per_range) == Approx(per_range).epsilon(0.1));
    CHECK(static_cast<double>(spacing.at(40)) == Approx(40 * per_range).epsilon(0.1));
    CHECK(static_cast<double>(spacing.smallest_m) == Approx(5 * per_range).epsilon(0.1));
    CHECK(spacing.at(0.1F) == spacing.smallest_m);
    CHECK(spacing.typical_range_m > 4.9F);
    CHECK(spacing.typical_range_m < 21.0F);
  }
}

TEST_CASE("of a scanner of few rings the spacing is that along the rings") {
  constexpr double step_rad = 0.004;
  std::vector<Point> points;
  for (int ring = -8; ring < 8; ++ring) {
    for (double azimuth = -1.5; azimuth < 1.5; azimuth += step_rad)
      points.push_back(point(12 * Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0.1 * ring)));
  }
  const Tree tree(points);
  const ScanSpacing spacing = measure_spacing(*tree.tree, 16);
  CHECK(static_cast<double>(spacing.at(12)) == Approx(8 * 12 * step_rad).epsilon(0.15));  // 8 to each side
}

TEST_CASE("of a scan downsampled to cells the spacing near the scanner is that of the cells") {
  std::vector<Point> points;
  for (double x = -4; x < 4; x += 0.1) {
    for (double y = -4; y < 4; y += 0.1) points.push_back(point({x, y, -1}));
  }
  const Tree tree(points);
  const ScanSpacing spacing = measure_spacing(*tree.tree, 16);
  CHECK(static_cast<double>(spacing.at(0.5F)) == Approx(0.1 * std::sqrt(5.0)).epsilon(0.05));
  CHECK(static_cast<double>(spacing.typical_m) == Approx(0.1 * std::sqrt(5.0)).epsilon(0.05));
}

TEST_CASE("a scan twice as large has twice the spacing, and the same a metre of range") {
  const std::vector<Point> points = test::street().scan(test::pose_at(0, 0, 1, 0), 3000, 25, 0, 3);
  std::vector<Point> larger = points;
  for (Point& p : larger) p = {2 * p.x, 2 * p.y, 2 * p.z};
  const Tree tree(points);
  const Tree larger_tree(larger);
  const ScanSpacing spacing = measure_spacing(*tree.tree, 16);
  const ScanSpacing twice = measure_spacing(*larger_tree.tree, 16);
  CHECK(twice.per_range == Approx(spacing.per_range).epsilon(1e-4));
  CHECK(twice.smallest_m == Approx(2 * spacing.smallest_m).epsilon(1e-4));
  CHECK(twice.typical_m == Approx(2 * spacing.typical_m).epsilon(1e-4));
  CHECK(twice.typical_range_m == Approx(2 * spacing.typical_range_m).epsilon(1e-4));
}

TEST_CASE("a scan of no points or a few has no spacing, and does no harm") {
  CHECK(measure_spacing(KdTree(), 16).at(10) == 0);
  const Tree few(std::vector<Point>{{1, 2, 3}, {2, 3, 4}, {5, 5, 5}});
  CHECK(measure_spacing(*few.tree, 16).at(10) == 0);
  for (const SurfaceSample& sample : samples_of(*few.tree, {})) CHECK(normal(sample).isZero(0));
}

TEST_CASE(
    "neighbours much farther than is usual at that range are of another surface, and do not tilt a normal") {
  // A wall 20 m away as a scanner with fixed angles sees it, and 0.9 m behind it another.
  std::vector<Point> points;
  for (double y = -4; y < 4; y += 0.2) {
    for (double z = -2; z < 2; z += 0.2) points.push_back(point({20, y, z}));
  }
  for (double z = -2; z < 2; z += 0.2) points.push_back(point({20.9, 4.9, z}));  // one column of it
  const Tree tree(points);
  const auto tilted = [&](float reach) {
    SurfaceConfig config;
    config.neighbor_reach = reach;
    std::size_t count = 0;
    for (const SurfaceSample& sample : samples_of(*tree.tree, config)) {
      if (vector(tree.tree->point(sample.index)).x() < 20.5) continue;
      if (!normal(sample).isZero(0) && sample.roughness < 0.2F) ++count;  // a plane across both walls
    }
    return count;
  };
  CHECK(tilted(2) == 0);
  CHECK(tilted(20) > 0);
}
