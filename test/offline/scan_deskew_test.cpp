#include "offline/io/scans/scan_deskew.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "offline/io/map_folder/trajectory.h"
#include "offline/io/map_folder/trajectory_files.h"
#include "offline/map/map_run.h"
#include "offline/optimize/lum/map_deskew.h"
#include "room.h"
#include "run_alces.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace {

constexpr double interval_s = 0.1;

/// Through the room in a bend that is slowed down: 4 m/s and 1.2 rad/s at first.
Pose room_from_body_at(double time_s) {
  Vector6d twist;
  twist << 4, 0, 0, 0, 0, 1.2;
  const Pose start{Eigen::Quaterniond::Identity(), {-5, -2, 0}};
  return start * exp_se3(twist * (time_s - 0.15 * time_s * time_s));
}

enum class Known { stamps_and_odometry, stamps, nothing };

/// Each point is measured at a time of its own while the body drives on.
class DrivingSource final : public RoomSource {
 public:
  DrivingSource(std::size_t size, Known known, bool has_times = true, bool stands_within = false)
      : RoomSource(size), known_(known), has_times_(has_times), stands_within_(stands_within) {}

  bool read(std::size_t index, ScanPoints& scan) override {
    scan.clear();
    const std::vector<Point> seen = scan_room(index, 6000);
    const double stamp = interval_s * static_cast<double>(index);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const double t = 0.09 * static_cast<double>(i) / static_cast<double>(seen.size());
      const Pose body_from_room = room_from_body_at(stands_within_ ? stamp : stamp + t).inverse();
      const Eigen::Vector3d in_room =
          room_from_body(index) * Eigen::Vector3f(seen[i].x, seen[i].y, seen[i].z).cast<double>();
      const Eigen::Vector3f p = (body_from_room * in_room).cast<float>();
      scan.points.push_back({p.x(), p.y(), p.z()});
      if (has_times_) scan.time_s.push_back(static_cast<float>(t));
      scan.intensity.push_back(static_cast<std::uint8_t>(100 + i % 8));
    }
    return true;
  }
  [[nodiscard]] std::optional<Pose> odometry(std::size_t index) const override {
    if (known_ != Known::stamps_and_odometry) return std::nullopt;
    return room_from_body_at(interval_s * static_cast<double>(index));
  }
  [[nodiscard]] std::optional<double> stamp_s(std::size_t index) const override {
    if (known_ == Known::nothing) return std::nullopt;
    return interval_s * static_cast<double>(index);
  }

 private:
  Known known_;
  bool has_times_;
  bool stands_within_;
};

constexpr std::size_t scans = 20;

std::unique_ptr<MapRun> mapped(ScanSource& source, DeskewMode mode) {
  MapRequest request = small_request();
  request.deskew = mode;
  auto run = std::make_unique<MapRun>(source, request);
  run->run();
  REQUIRE(run->mapper().scan_count() == source.size());
  return run;
}

/// How far off the steps are, root mean square.
double step_error_m(const MapRun& run) {
  const std::span<const Pose> poses = run.mapper().graph().poses();
  double sum = 0;
  std::size_t counted = 0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const auto truth = [](std::size_t scan) {
      return room_from_body_at(interval_s * static_cast<double>(scan));
    };
    const Pose off = (truth(i - 1).inverse() * truth(i)).inverse() * (poses[i - 1].inverse() * poses[i]);
    sum += off.translation_m.squaredNorm();
    ++counted;
  }
  return std::sqrt(sum / static_cast<double>(counted));
}

/// Points of the scan deskewed against those that a body standing at its stamp sees.
double point_error_m(ScanDeskew& deskew, DrivingSource& skewed, std::size_t index) {
  DrivingSource still(skewed.size(), Known::nothing, false, true);
  ScanPoints expected;
  ScanPoints scan;
  still.read(index, expected);
  skewed.read(index, scan);
  deskew.deskew(skewed, index, scan);
  double sum_m = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const Point& a = scan.points[i];
    const Point& b = expected.points[i];
    sum_m += static_cast<double>(std::hypot(a.x - b.x, a.y - b.y, a.z - b.z));
  }
  return sum_m / static_cast<double>(scan.size());
}

}  // namespace

TEST_CASE("the motion within a scan is taken out by odometry, and by the motion of the last step") {
  DrivingSource source(scans, Known::stamps_and_odometry);
  ScanDeskew none(DeskewMode::none);
  ScanDeskew by_odometry(DeskewMode::odometry);
  ScanDeskew by_velocity(DeskewMode::velocity);
  double skewed_m = 0;
  double odometry_m = 0;
  double velocity_m = 0;
  for (std::size_t i = 0; i < scans; ++i) {
    skewed_m = point_error_m(none, source, i);
    odometry_m = point_error_m(by_odometry, source, i);
    velocity_m = point_error_m(by_velocity, source, i);
    CAPTURE(i, skewed_m, odometry_m, velocity_m);
    CHECK(odometry_m <
          (i + 1 < scans ? 0.02 : 0.06) * skewed_m);  // the last scan's motion goes on as it went
    if (i > 0) {
      const auto at = [](std::size_t scan) {
        return room_from_body_at(interval_s * static_cast<double>(scan));
      };
      const Pose step = at(i - 1).inverse() * at(i);
      by_velocity.observe_step(&step);
    }
    if (i > 1) CHECK(velocity_m < 0.15 * skewed_m);  // since the last step it has slowed down
  }
  CHECK(skewed_m > 0.1);
  CHECK_THAT(by_odometry.text(), Contains("deskewed by odometry: 20 scans") && Contains("0.09 s a scan"));
  CHECK_THAT(by_velocity.text(),
             Contains("motion of the last steps: 18 scans") && Contains("not deskewed: 2 scans"));
  CHECK(by_odometry.json()["by_odometry"] == scans);
}

TEST_CASE("a map of scans with times has steps nearer to the truth, by either motion") {
  DrivingSource with_odometry(scans, Known::stamps_and_odometry);
  DrivingSource with_stamps(scans, Known::stamps);
  const double skewed_m = step_error_m(*mapped(with_stamps, DeskewMode::none));
  const auto by_odometry = mapped(with_odometry, DeskewMode::automatic);
  const auto by_velocity = mapped(with_stamps, DeskewMode::automatic);
  CAPTURE(skewed_m, step_error_m(*by_odometry), step_error_m(*by_velocity));
  CHECK(by_odometry->deskew().json()["by_odometry"] == scans);
  CHECK(by_velocity->deskew().json()["by_velocity"] == scans);  // the first two by a match of theirs
  CHECK(step_error_m(*by_odometry) < 0.7 * skewed_m);
  CHECK(step_error_m(*by_velocity) < 0.7 * skewed_m);
}

TEST_CASE("scans without times have the same poses to the bit, whatever is asked for") {
  DrivingSource source(8, Known::stamps_and_odometry, false);
  const auto with = mapped(source, DeskewMode::automatic);
  const auto without = mapped(source, DeskewMode::none);
  for (std::size_t i = 0; i < 8; ++i) {
    const Pose& a = with->mapper().graph().poses()[i];
    const Pose& b = without->mapper().graph().poses()[i];
    CHECK(a.translation_m == b.translation_m);
    CHECK(a.rotation.coeffs() == b.rotation.coeffs());
  }
  CHECK(with->deskew().text().empty());
}

TEST_CASE("why scans with times are not deskewed is said with the remedy") {
  DrivingSource source(4, Known::nothing);
  const auto run = mapped(source, DeskewMode::automatic);
  CHECK_THAT(run->deskew().text(), Contains("not deskewed: 4 scans") && Contains("--scan-interval"));
  CHECK_THAT(mapped(source, DeskewMode::none)->deskew().text(), Contains("taken as deskewed already"));
}

TEST_CASE("intensities go with their points into the stored scans") {
  DrivingSource source(2, Known::stamps);
  const auto run = mapped(source, DeskewMode::none);
  CHECK(run->has_intensity());
  ScanPoints scan;
  source.read(1, scan);
  std::span<const std::byte> record;
  REQUIRE(run->mapper().read_record(1, record) == Status::ok);
  StoredScanView view;
  REQUIRE(StoredScanView::parse(record, view) == StoredScanFault::none);
  REQUIRE(view.has_intensity());
  REQUIRE(view.point_count() > 1000);
  for (std::uint32_t i = 0; i < view.point_count(); i += 37) {
    std::size_t nearest = 0;
    float least_m = 1e9F;
    for (std::size_t k = 0; k < scan.size(); ++k) {
      const Point& a = scan.points[k];
      const Point b = view.point(i);
      const float m = std::hypot(a.x - b.x, a.y - b.y, a.z - b.z);
      if (m < least_m) nearest = k;
      least_m = std::min(least_m, m);
    }
    CHECK(least_m < 2e-3F);
    CHECK(view.intensity(i) == scan.intensity[nearest]);
  }
}

TEST_CASE("LUM reads the scans of such a map with the motion taken out by the map's poses") {
  Trajectory map;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < 5; ++i) {
    map.poses.push_back(room_from_body_at(interval_s * static_cast<double>(i)));
    index.push_back(i);
  }
  MapDeskewedSource source(std::make_unique<DrivingSource>(5, Known::stamps), map, index);
  DrivingSource still(5, Known::nothing, false, true);
  ScanPoints expected;
  ScanPoints scan;
  for (std::size_t i = 0; i < 5; ++i) {
    still.read(i, expected);
    REQUIRE(source.read(i, scan));
    for (std::size_t k = 0; k < scan.size(); k += 100) {
      const Point& a = scan.points[k];
      const Point& b = expected.points[k];
      CHECK(std::hypot(a.x - b.x, a.y - b.y, a.z - b.z) < 0.06F);
    }
  }
}

TEST_CASE(
    "alces map deskews a folder of scans by all poses of a trajectory between their stamps, and says so") {
  const TemporaryFolder folder;
  DrivingSource source(6, Known::nothing);
  ScanPoints scan;
  constexpr double begin_s = 1'700'000'000;
  for (std::size_t i = 0; i < source.size(); ++i) {
    source.read(i, scan);
    std::string csv = "x,y,z,offset_time\n";
    for (std::size_t k = 0; k < scan.size(); ++k)
      csv += fmt::format("{},{},{},{:.0f}\n", scan.points[k].x, scan.points[k].y, scan.points[k].z,
                         1e9 * static_cast<double>(scan.time_s[k]));
    folder.write(fmt::format("scans/{:.6f}.csv", begin_s + interval_s * static_cast<double>(i)), csv);
  }
  Trajectory odometry;
  odometry.has_time = true;
  for (int i = -5; i < 70; ++i) {
    odometry.poses.push_back(room_from_body_at(0.01 * i));
    odometry.stamps_s.push_back(begin_s + 0.01 * i);
  }
  write_tum(folder / "wheels.tum", odometry);

  ScanSourceOptions options;
  options.odometry = folder / "wheels.tum";
  const auto files = open_scans(folder / "scans", options);
  ScanDeskew deskew(DeskewMode::automatic);
  DrivingSource still(6, Known::nothing, false, true);
  ScanPoints expected;
  for (std::size_t i = 0; i < 6; ++i) {
    REQUIRE(files->read(i, scan));
    deskew.deskew(*files, i, scan);
    still.read(i, expected);
    REQUIRE(scan.size() == expected.size());
    for (std::size_t k = 0; k < scan.size(); k += 50) {
      const Point& a = scan.points[k];
      const Point& b = expected.points[k];
      CHECK(std::hypot(a.x - b.x, a.y - b.y, a.z - b.z) < 2e-3F);  // all of it: also of the last scan
    }
  }

  const std::string command = "map scans --odometry wheels.tum --out ";
  const ProgramOutcome outcome = run_alces(folder, command + "map");
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
  CHECK_THAT(outcome.out, Contains("times from offset_time (double) in ns"));
  CHECK_THAT(outcome.out, Contains("deskewed by odometry: 6 scans; 0.09 s a scan"));
  const auto run = nlohmann::json::parse(content_of(folder / "map/run.json"));
  CHECK(run["deskew"]["by_odometry"] == 6);
  CHECK(run["deskew"]["largest_shift_m"].get<double>() > 0.5);
  CHECK_THAT(run["source"]["channels"].get<std::string>(), Contains("offset_time"));
  const ProgramOutcome none = run_alces(folder, command + "none --deskew none");
  CHECK_THAT(none.out, Contains("taken as deskewed already"));
  CHECK(content_of(folder / "none/trajectory.tum") != content_of(folder / "map/trajectory.tum"));
  CHECK(run_alces(folder, command + "bad --deskew imu").status == 2);
}
