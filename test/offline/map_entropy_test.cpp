#include "offline/evaluate/map_entropy.h"

#include <catch2/catch.hpp>
#include <limits>
#include <numbers>

#include "lum_bench.h"
#include "offline/io/files/error.h"

using namespace alces;
using namespace alces::offline;

namespace {

/// Scans of one cloud each.
class Clouds final : public RoomSource {
 public:
  explicit Clouds(std::vector<std::vector<Point>> clouds)
      : RoomSource(clouds.size()), clouds_(std::move(clouds)) {}
  bool read(std::size_t index, ScanPoints& scan) override {
    scan.points = clouds_[index];
    return true;
  }

 private:
  std::vector<std::vector<Point>> clouds_;
};

/// A ball of normal noise five metres ahead.
std::vector<Point> ball(const Eigen::Vector3d& deviation_m, std::size_t count) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, 1);
  std::vector<Point> points;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d p = Eigen::Vector3d(5, 0, 0) + deviation_m.cwiseProduct(Eigen::Vector3d(
                                                             normal(random), normal(random), normal(random)));
    points.push_back({static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
  }
  return points;
}

MapEntropySettings whole_ball() {
  MapEntropySettings settings;
  settings.radius_m = 1;  // more than reaches across the ball: the covariance is the ball's
  settings.cell_size_m = 1e-4;
  return settings;
}

}  // namespace

TEST_CASE("the entropy of normal noise is what theory says") {
  const Eigen::Vector3d deviation_m(0.05, 0.03, 0.02);
  Clouds clouds({ball(deviation_m, 3000)});
  const MapEntropy entropy = measure_map_entropy(clouds, room_poses(1), whole_ball());
  const double expected =
      0.5 * (2 * std::numbers::pi * std::numbers::e * deviation_m.array().square()).log().sum();
  CHECK(entropy.measured > 2900);
  CHECK(entropy.mean_entropy == Approx(expected).margin(0.05));
  CHECK(entropy.mean_plane_variance_m2 == Approx(0.02 * 0.02).epsilon(0.1));
}

TEST_CASE("poses that disagree make a map less crisp") {
  RoomSource room(5);
  MapEntropySettings settings;
  settings.radius_m = 1;  // the room's walls are sampled thinly
  const MapEntropy crisp = measure_map_entropy(room, room_poses(5), settings);
  const MapEntropy blurred = measure_map_entropy(room, disturbed(room_poses(5), 0.1, 0.01, 2), settings);
  CHECK(crisp.measured > crisp.points / 2);
  CHECK(crisp.points > 1000);
  CHECK(blurred.mean_entropy > crisp.mean_entropy + 0.05);
  CHECK(blurred.mean_plane_variance_m2 > 1.2 * crisp.mean_plane_variance_m2);
}

TEST_CASE("entropy: points that are not finite, too near, too few, or none") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Clouds clouds({{{nan, 0, 0}, {0.1F, 0, 0}, {50, 0, 0}, {5, 0, 0}, {5, 0.1F, 0}}, {}});
  const MapEntropy entropy = measure_map_entropy(clouds, room_poses(2));
  CHECK(entropy.points == 2);
  CHECK(entropy.measured == 0);
  CHECK(entropy.mean_entropy == 0);
  RoomSource none(0);
  CHECK(measure_map_entropy(none, {}).points == 0);
  CHECK_THROWS_AS(measure_map_entropy(clouds, room_poses(3)), InputError);
}
