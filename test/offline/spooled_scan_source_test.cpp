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
  bool read(std::size_t index, ScanPoints& scan) override {
    REQUIRE(index == next_++);
    if (index >= 5) return false;
    scan.clear();
    scan.points = index == 2 ? std::vector<Point>() : scan_room(index, 50);
    if (index == 3) scan.points[0].x = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 0; i < scan.size(); ++i) {
      if (has_time(index)) scan.time_s.push_back(static_cast<float>(i + index));
      if (has_intensity(index)) scan.intensity.push_back(static_cast<std::uint8_t>(i + 3 * index));
    }
    return true;
  }

  static bool has_time(std::size_t index) { return index >= 3; }
  static bool has_intensity(std::size_t index) { return index % 2 == 0; }

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
  ScanPoints scan;
  for (const std::size_t i : {std::size_t{4}, std::size_t{0}, std::size_t{4}}) {
    REQUIRE(scans.read(i, scan));
    const std::vector<Point> expected = scan_room(i, 50);
    REQUIRE(scan.size() == expected.size());
    CHECK(scan.points.back().x == expected.back().x);
    CHECK(scan.points.back().z == expected.back().z);
    REQUIRE(scan.time_s.size() == (OnceThrough::has_time(i) ? 50 : 0));
    if (OnceThrough::has_time(i)) CHECK(scan.time_s.back() == static_cast<float>(49 + i));
    REQUIRE(scan.intensity.size() == (OnceThrough::has_intensity(i) ? 50 : 0));
    if (OnceThrough::has_intensity(i)) CHECK(scan.intensity.back() == 49 + 3 * i);
    CHECK(scans.name(i) == once.name(i));
    CHECK(scans.number(i) == i);
    CHECK(same_pose(*scans.odometry(i), room_from_body(i), 1e-12));
  }
  REQUIRE(scans.read(2, scan));
  CHECK(scan.points.empty());
  REQUIRE(scans.read(3, scan));
  CHECK_FALSE(is_finite(scan.points[0]));
  CHECK_FALSE(scans.read(5, scan));
}

TEST_CASE("a spooled source without room for its file says so") {
  const TemporaryFolder folder;
  OnceThrough once;
  CHECK_THROWS_AS(SpooledScanSource(once, folder / "none"), OutputError);
}
