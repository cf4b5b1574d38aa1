// A real pair of scans (small_gicp's, KITTI): registered from identity and from bad starts.
#include "support/registration.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <numbers>
#include <vector>

#include "alces_platform/sim/random.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_source.h"
#include "support/test_data.h"
#include "temporary_folder.h"

using namespace alces;

namespace {

bool has_arrived(const Pose& found, const Pose& truth) {
  return (found.translation_m - truth.translation_m).norm() <= 0.02 &&
         angle_between_rad(found.rotation, truth.rotation) <= 0.2 * std::numbers::pi / 180;
}

std::vector<Point> read_points(const std::filesystem::path& file) {
  offline::ScanPoints scan;
  offline::open_scans(file)->read(0, scan);
  return scan.points;
}

}  // namespace

TEST_CASE("a real pair is registered from identity and from at least 95 % of 200 bad starts") {
  if (!test::has_test_data("icp_pairs/small_gicp/source.ply")) return;
  const std::filesystem::path folder = test::test_data("icp_pairs/small_gicp");
  const Pose truth = offline::read_trajectory(folder / "T_target_source.txt").poses.at(0);
  test::Registration registration(read_points(folder / "target.ply"), read_points(folder / "source.ply"));

  CHECK(has_arrived(registration.match(Pose{}).model_from_data, truth));

  sim::Random random(1);
  int arrived = 0;
  for (int i = 0; i < 200; ++i) {
    const Pose start = test::random_offset(random, 1.0, 10.0);
    if (has_arrived(registration.match(start).model_from_data, truth)) ++arrived;
  }
  CAPTURE(arrived);
  CHECK(arrived >= 190);
}
