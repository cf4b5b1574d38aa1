// A run in the test's own process, over scans out of thin air.
#include "offline/map/map_run.h"

#include <catch2/catch.hpp>
#include <csignal>
#include <limits>

#include "offline/io/map_folder/map_folder.h"
#include "offline/map/mapper_settings.h"
#include "room.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace {

/// A room where one scan is what the test makes of it.
class SpoiltRoom final : public RoomSource {
 public:
  SpoiltRoom(std::size_t size, std::size_t spoilt, std::vector<Point> points)
      : RoomSource(size), spoilt_(spoilt), points_(std::move(points)) {}
  bool read(std::size_t index, ScanPoints& scan) override {
    const bool is_there = RoomSource::read(index, scan);
    if (index == spoilt_) scan.points = points_;
    return is_there;
  }

 private:
  std::size_t spoilt_;
  std::vector<Point> points_;
};

/// Maps six scans of which number 2 is `points`; that one must be refused, and all others mapped.
void check_left_out(const std::vector<Point>& points) {
  SpoiltRoom source(6, 2, points);
  MapRun run(source, small_request());
  run.run();
  CHECK_FALSE(run.problem());
  REQUIRE(run.refused().size() == 1);
  CHECK(run.refused().front().source_index == 2);
  REQUIRE(run.warnings().size() == 1);
  CHECK_THAT(run.warnings().front(), Contains("scan2.synthetic is left out: the scan holds no usable point"));
  CHECK(run.trajectory().stamps_s == std::vector<double>{0, 1, 3, 4, 5});
}

}  // namespace

TEST_CASE("a drive through a room is mapped where it went") {
  RoomSource source(10);
  MapRun run(source, small_request());
  run.run();
  REQUIRE_FALSE(run.problem());
  CHECK(run.warnings().empty());
  const Trajectory trajectory = run.trajectory();
  REQUIRE(trajectory.size() == 10);
  for (std::size_t i = 0; i < 10; ++i)
    CHECK(same_pose(trajectory.poses[i], room_from_body(0).inverse() * room_from_body(i), 0.05));
}

TEST_CASE("an empty scan is left out and named") {
  check_left_out({});
}

TEST_CASE("a scan of NaN and Inf is left out and named") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float inf = std::numeric_limits<float>::infinity();
  check_left_out({{nan, 0, 0}, {1, inf, 1}, {-inf, -inf, -inf}, {2, 2, nan}});
}

TEST_CASE("a scan of points at 1e30 is left out and named") {
  check_left_out({{1e30F, 1e30F, 1e30F}, {-1e30F, 0, 0}, {0, 0, 3e38F}});
}

TEST_CASE("NaN, Inf and 1e30 between good points are counted and change nothing") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<Point> points = scan_room(2);
  points.insert(points.begin() + 7,
                {{nan, 1, 1}, {1e30F, 0, 0}, {std::numeric_limits<float>::infinity(), 0, 0}});
  SpoiltRoom spoilt(6, 2, points);
  MapRun run(spoilt, small_request());
  run.run();
  RoomSource source(6);
  MapRun plain(source, small_request());
  plain.run();
  REQUIRE(run.mapper().scan_count() == 6);
  CHECK(run.mapper().counters().points_not_finite == 2);
  CHECK(run.mapper().counters().points_too_far == plain.mapper().counters().points_too_far + 1);
  CHECK(run.trajectory().poses[5].translation_m == plain.trajectory().poses[5].translation_m);
}

TEST_CASE("a scan of one point is placed by the odometry, and that is said") {
  SpoiltRoom source(6, 2, {{3, 1, 0.5F}});
  MapRun run(source, small_request());
  run.run();
  REQUIRE_FALSE(run.problem());
  REQUIRE(run.mapper().scan_count() == 6);
  REQUIRE(run.warnings().size() == 1);
  CHECK_THAT(run.warnings().front(), Contains("1 scan could not be matched"));
}

TEST_CASE("100,000 scans beyond the capacity: the map ends there and says so") {
  RoomSource source(100'005);
  MapRequest request = small_request();
  request.config.scan_capacity = 5;
  MapRun run(source, request);
  run.run();
  CHECK(run.mapper().scan_count() == 5);
  REQUIRE(run.problem());
  CHECK(run.problem()->exit_status() == 4);
  CHECK_THAT(run.problem()->what(),
             Contains("5 scans") && Contains("5 of 100005 scans mapped") && Contains("memory.scan_capacity"));
  const TemporaryFolder folder;
  prepare_map_folder(folder / "out");
  const nlohmann::json report = write_map_folder(folder / "out", run, {"0", {}, "default", {}});
  CHECK(report["complete"] == false);
  CHECK(read_trajectory(folder / "out").size() == 5);
}

TEST_CASE("asked to stop, a run ends after the scan it is at, with the status that shells know") {
  RoomSource source(50);
  MapRun run(source, small_request());
  std::size_t done = 0;
  run.run({[&done](std::size_t scans, std::size_t) { done = scans; },
           [&done] { return done == 7 ? SIGINT : 0; }});
  CHECK(run.mapper().scan_count() == 7);
  REQUIRE(run.problem());
  CHECK(run.problem()->exit_status() == 130);
  CHECK_THAT(run.problem()->what(), Contains("interrupted after 7 of 50 scans"));
}

TEST_CASE("the frames of a longer map before do not stay, other files do") {
  const TemporaryFolder folder;
  folder.write("out/frames/scan005.frames", "old");
  folder.write("out/frames/scan1000.frames", "old");
  folder.write("out/frames/notes1000.txt", "mine");
  RoomSource source(3);
  MapRun run(source, small_request());
  run.run();
  prepare_map_folder(folder / "out");
  (void)write_map_folder(folder / "out", run, {"0", {}, "default", {}});
  CHECK(std::filesystem::exists(folder / "out/frames/scan002.frames"));
  CHECK_FALSE(std::filesystem::exists(folder / "out/frames/scan005.frames"));
  CHECK_FALSE(std::filesystem::exists(folder / "out/frames/scan1000.frames"));
  CHECK(std::filesystem::exists(folder / "out/frames/notes1000.txt"));
}
