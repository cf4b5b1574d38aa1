#include "alces/surface.h"

#include <Eigen/Eigenvalues>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "alces_platform/sim/random.h"
#include "support/in_block.h"

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
  samples.resize(sample_surface(tree, config, samples));
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
  std::size_t wrong = 0;
  for (const SurfaceSample& sample : samples_of(*tree.tree, config)) {
    std::array<Neighbor, KdTree::maximum_neighbors> found;
    const std::uint32_t count = tree.tree->nearest(tree.tree->point(sample.index),
                                                   config.neighbor_radius_m * config.neighbor_radius_m,
                                                   std::span(found).first(config.neighbors));
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
  CHECK(sample_surface(*tree.tree, {}, std::span(samples).first(10)) == 10);
  CHECK(sample_surface(*tree.tree, {}, std::span(samples).first(0)) == 0);
  CHECK(sample_surface(KdTree(), {}, samples) == 0);
}

TEST_CASE("a point without enough neighbours within the radius has no plane") {
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
