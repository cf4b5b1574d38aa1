#include "offline/io/scans/spooled_scan_source.h"

#include <catch2/catch.hpp>
#include <limits>

#include "offline/io/files/error.h"
#include "room.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;

namespace {

/// Gives its scans once, in order, and finds out at the end that there are fewer than it thought.
class OnceThrough final : public RoomSource {
 public:
  OnceThrough() : RoomSource(9) {}
  bool read(std::size_t index, std::vector<Point>& points) override {
    REQUIRE(index == next_++);
    if (index >= 5) return false;
    points = index == 2 ? std::vector<Point>() : scan_room(index, 50);
    if (index == 3) points[0].x = std::numeric_limits<float>::quiet_NaN();
    return true;
  }

 private:
  std::size_t next_ = 0;
};

}  // namespace

TEST_CASE("a spooled source gives any scan at any time, as it was") {
  const TemporaryFolder folder;
  OnceThrough once;
  SpooledScanSource scans(once, folder.path());
  REQUIRE(scans.size() == 5);
  CHECK(std::filesystem::is_empty(folder.path()));  // the file has no name
  std::vector<Point> points;
  for (const std::size_t i : {std::size_t{4}, std::size_t{0}, std::size_t{4}}) {
    REQUIRE(scans.read(i, points));
    const std::vector<Point> expected = scan_room(i, 50);
    REQUIRE(points.size() == expected.size());
    CHECK(points.back().x == expected.back().x);
    CHECK(points.back().z == expected.back().z);
    CHECK(scans.name(i) == once.name(i));
    CHECK(scans.number(i) == i);
    CHECK(same_pose(*scans.odometry(i), room_from_body(i), 1e-12));
  }
  REQUIRE(scans.read(2, points));
  CHECK(points.empty());
  REQUIRE(scans.read(3, points));
  CHECK_FALSE(is_finite(points[0]));
  CHECK_FALSE(scans.read(5, points));
}

TEST_CASE("a spooled source without room for its file says so") {
  const TemporaryFolder folder;
  OnceThrough once;
  CHECK_THROWS_AS(SpooledScanSource(once, folder / "none"), OutputError);
}
