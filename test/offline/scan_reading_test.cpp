// What the files of others leave unsaid: which column, which stamp, which origin, which unit, which record.
#include <fmt/format.h>

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <random>

#include "offline/convert/convert_map.h"
#include "offline/io/files/input_file.h"
#include "offline/io/map_folder/trajectory.h"
#include "offline/io/scans/scan_source.h"
#include "room.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace {

std::vector<Point> read_all(ScanSource& source, std::size_t index = 0) {
  ScanPoints scan;
  source.read(index, scan);
  return scan.points;
}

std::vector<Point> read_all(const std::filesystem::path& path, const ScanSourceOptions& options = {}) {
  return read_all(*open_scans(path, options));
}

void check_first(const std::vector<Point>& points, std::size_t count, const std::array<float, 3>& first) {
  REQUIRE(points.size() == count);
  CHECK(points[0].x == first[0]);
  CHECK(points[0].y == first[1]);
  CHECK(points[0].z == first[2]);
}

template <typename T>
void append(std::string& bytes, T value) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), &value, sizeof(T));
  bytes.append(raw.data(), raw.size());
}

std::string tum_line(double stamp_s, double x_m) {
  return fmt::format("{:.6f} {} 0 0 0 0 0 1\n", stamp_s, x_m);
}

/// The walls of the room at a place of a national grid, 16 mm apart to the last point.
constexpr std::array<double, 3> grid_m = {463'800, 5'428'300, 117};

std::string grid_csv() {
  std::string text = "x,y,z\n";
  for (int i = 0; i < 500; ++i)
    text += fmt::format("{:.3f},{:.3f},{:.3f}\n", grid_m[0] + 0.016 * i, grid_m[1] + 0.017 * i,
                        grid_m[2] + 0.001 * i);
  return text;
}

}  // namespace

TEST_CASE("CSV: a comment that names the columns counts, prose does not") {
  const TemporaryFolder folder;
  check_first(read_all(folder.write("a.csv", "# ring,x,y,z,intensity\n7,1,2,3,90\n")), 1, {1, 2, 3});
  check_first(read_all(folder.write("b.csv", "# made by hand\n# ring x y z\n7 1 2 3\n")), 1, {1, 2, 3});
  check_first(read_all(folder.write("c.csv", "# the scanner of y\n1,2,3\n# z, y, x\n4,5,6\n")), 2, {1, 2, 3});
  check_first(read_all(folder.write("d.csv",
                                    "i,\"Points_m_XYZ:0\",\"Points_m_XYZ:1\",\"Points_m_XYZ:2\"\n7,1,2,3\n")),
              1, {1, 2, 3});
  check_first(read_all(folder.write("e.csv", "ring,x [m],y [m],z [m]\n7,1,2,3\n")), 1, {1, 2, 3});
}

TEST_CASE("CSV: a count above the points is passed over, and believed only as far as it is true") {
  const TemporaryFolder folder;
  const auto source = open_scans(folder.write("a.xyz", "2\n1 2 3 9\n4 5 6 9\n"));
  check_first(read_all(*source), 2, {1, 2, 3});
  CHECK(source->warnings().empty());
  check_first(read_all(folder.write("b.asc", "//X Y Z I\n2\n1 2 3 9\n4 5 6 9\n")), 2, {1, 2, 3});
  const auto cut = open_scans(folder.write("c.xyz", "3\n1 2 3\n4 5 6\n"));
  check_first(read_all(*cut), 2, {1, 2, 3});
  REQUIRE(cut->warnings().size() == 1);
  CHECK_THAT(cut->warnings()[0], Contains("promises 3 points, 2 are there"));
}

TEST_CASE("CSV: decimal commas where something else separates, and never silently where nothing does") {
  const TemporaryFolder folder;
  check_first(read_all(folder.write("a.csv", "x;y;z\n1,5;-2,25;3\n4;5;6,125\n")), 2, {1.5F, -2.25F, 3});
  check_first(read_all(folder.write("b.xyz", "1,5 -2,25 3,0\n")), 1, {1.5F, -2.25F, 3});
  check_first(read_all(folder.write("c.csv", "1.5, -2.25, 3\n")), 1, {1.5F, -2.25F, 3});
  CHECK_THROWS_WITH(read_all(folder.write("d.csv", "x,y,z\n1,5,-2,25,3,0\n")),
                    Contains("d.csv:2:") && Contains("6 columns") && Contains("decimal commas"));
}

TEST_CASE("a UTF-8 byte-order mark is no part of the first cell") {
  const TemporaryFolder folder;
  check_first(read_all(folder.write("a.csv", "\xEF\xBB\xBFx,y,z\n1,2,3\n")), 1, {1, 2, 3});
  check_first(read_all(folder.write("b.3d",
                                    "\xEF\xBB\xBF"
                                    "100 200 300\n")),
              1, {3, -1, 2});
  CHECK(read_trajectory(folder.write("a.tum",
                                     "\xEF\xBB\xBF"
                                     "0.5 1 2 3 0 0 0 1\n"))
            .stamps_s[0] == 0.5);
}

TEST_CASE("names with decimals are in the order of time, and know their stamps") {
  CHECK(natural_less("17.103417.pcd", "17.2.pcd"));
  CHECK_FALSE(natural_less("17.2.pcd", "17.103417.pcd"));
  CHECK(natural_less("scan9.pcd", "scan10.pcd"));
  CHECK(natural_less("v1.2.9.pcd", "v1.2.10.pcd"));
  CHECK(stamp_in_name("cloud_17.25.pcd") == 17.25);
  CHECK(stamp_in_name("1403636579763555584.pcd") == Approx(1403636579.763555584).epsilon(1e-15));
  CHECK(stamp_in_name("1700000000123.bin") == 1700000000.123);
  CHECK_FALSE(stamp_in_name("000123.bin"));
  CHECK_FALSE(stamp_in_name("scan007.3d"));
  CHECK_FALSE(number_in_name("17.25.pcd"));
  const TemporaryFolder folder;
  for (const char* name : {"17.2.csv", "17.103417.csv", "17.0.csv"})
    folder.write(std::string("scans/") + name, "1,2,3\n");
  const auto source = open_scans(folder / "scans");
  REQUIRE(source->size() == 3);
  CHECK(source->name(1) == "17.103417.csv");
  CHECK(source->stamp_s(1) == 17.103417);
  CHECK(source->number(2) == 2);
  CHECK(source->warnings().empty());
}

TEST_CASE("poses belong to scans by the stamps in the names, whatever their order and number") {
  const TemporaryFolder folder;
  for (const char* name : {"17.0", "17.103417", "17.2"})
    folder.write(std::string("scans/") + name + ".csv", "1,2,3\n");
  const auto shuffled = folder.write(
      "shuffled.tum", tum_line(17.2, 3) + tum_line(17.05, 9) + tum_line(17.0, 1) + tum_line(17.1034, 2));
  const auto source = open_scans(folder / "scans", {.odometry = shuffled});
  for (std::size_t i = 0; i < 3; ++i)
    CHECK(source->odometry(i)->translation_m.x() == static_cast<double>(i + 1));
  CHECK_THAT(source->description(), Contains("by stamp"));
  CHECK(source->warnings().empty());
  SECTION("a scan without a pose is told, and stays without") {
    const auto holed = folder.write("holed.tum", tum_line(17.0, 1) + tum_line(17.2, 3) + tum_line(18, 4));
    const auto partly = open_scans(folder / "scans", {.odometry = holed});
    CHECK(partly->odometry(2)->translation_m.x() == 3);
    CHECK_FALSE(partly->odometry(1));
    REQUIRE(partly->warnings().size() == 1);
    CHECK_THAT(partly->warnings()[0], Contains("1 of 3 scans") && Contains("17.103417.csv"));
  }
  SECTION("stamps of another clock are paired in their order, and that is a warning") {
    const auto other = folder.write("other.tum", tum_line(1.5, 1) + tum_line(1.6, 2) + tum_line(1.7, 3));
    const auto ordered = open_scans(folder / "scans", {.odometry = other});
    CHECK(ordered->odometry(1)->translation_m.x() == 2);
    CHECK_THAT(ordered->description(), Contains("by order"));
    CHECK_THAT(ordered->warnings().at(0), Contains("another clock"));
    const auto fewer = folder.write("fewer.tum", tum_line(1.5, 1) + tum_line(1.6, 2));
    CHECK_THROWS_WITH(open_scans(folder / "scans", {.odometry = fewer}), Contains("none of its 2 poses"));
  }
}

TEST_CASE("a trajectory with the scans' numbers in another order is paired by number") {
  const TemporaryFolder folder;
  for (const char* name : {"a5", "a6", "a7"}) folder.write(std::string("scans/") + name + ".csv", "1,2,3\n");
  const auto file = folder.write("p.tum", "7 3 0 0 0 0 0 1\n5 1 0 0 0 0 0 1\n6 2 0 0 0 0 0 1\n");
  const auto source = open_scans(folder / "scans", {.odometry = file});
  CHECK(source->odometry(0)->translation_m.x() == 1);
  CHECK(source->odometry(2)->translation_m.x() == 3);
  CHECK_THAT(source->description(), Contains("by number"));
  CHECK_FALSE(open_scans(folder / "scans", {.no_odometry = true})->odometry(0));
}

TEST_CASE("one origin is taken off all scans of a national grid, and comes back on export") {
  const TemporaryFolder folder;
  folder.write("scans/0.csv", grid_csv());
  std::string second = "x,y,z\n";
  for (int i = 0; i < 500; ++i)
    second += fmt::format("{:.3f},{:.3f},{}\n", grid_m[0] + 1000 + 0.016 * i, grid_m[1], grid_m[2]);
  folder.write("scans/1.csv", second);
  const auto source = open_scans(folder / "scans");
  const std::vector<Point> tile = read_all(*source, 1);  // not the first one first
  CHECK(source->origin_m() == std::array<double, 3>{463'000, 5'428'000, 0});
  CHECK(tile[1].x - tile[0].x == Approx(0.016).margin(2e-4));
  CHECK(tile[0].x - read_all(*source, 0)[0].x == Approx(1000).margin(1e-3));
  REQUIRE(source->warnings().size() == 1);
  CHECK_THAT(source->warnings()[0], Contains("(463000, 5428000, 0) m") && Contains("all scans alike"));

  for (const char* name : {"out.ply", "out.pcd", "out.las", "out.csv"}) {
    CAPTURE(name);
    const auto report =
        convert_map({folder / "scans", folder / name, ConversionSource::scans, *conversion_form(name)});
    CHECK(report.points == 1000);
    const auto back = open_scans(folder / name);
    const std::vector<Point> points = read_all(*back);
    REQUIRE(points.size() == 1000);
    const std::array<double, 3> origin_m = back->origin_m();
    for (std::size_t i = 0; i < 500; ++i) {
      const double y_m = static_cast<double>(points[i].y) + origin_m[1];
      if (std::abs(y_m - (grid_m[1] + 0.017 * static_cast<double>(i))) > 1e-3) FAIL(i << ": " << y_m);
    }
  }
  const auto floats = convert_map(
      {folder / "scans", folder / "out.bin", ConversionSource::scans, ConversionForm::kitti_scan});
  CHECK_THAT(floats.warnings.back(), Contains("has floats") && Contains("463000"));
}

TEST_CASE("scans in their own frame at poses of a national grid become a cloud without steps") {
  const TemporaryFolder folder;
  folder.write("scans/0.csv", "0.016,0,0\n0.032,0,0\n0.048,0,0\n");
  const auto poses = folder.write("p.tum", "0 463800 5428300 117 0 0 0 1\n");
  convert_map({folder / "scans", folder / "out.csv", ConversionSource::scans, ConversionForm::csv, poses});
  CHECK_THAT(content_of(folder / "out.csv"), Contains("463800.0160,5428300.0000,117.0000,0"));
}

TEST_CASE("a scan in millimetres is told with the remedy, and the remedy works") {
  const TemporaryFolder folder;
  for (std::size_t i = 0; i < 2; ++i) {
    std::string text;
    for (const Point& p : scan_room(i))
      text += fmt::format("{:.0f},{:.0f},{:.0f}\n", 1000 * p.x, 1000 * p.y, 1000 * p.z);
    folder.write(fmt::format("scans/{}.csv", i), text);
  }
  const auto source = open_scans(folder / "scans");
  static_cast<void>(read_all(*source));
  CHECK(source->origin_m() == std::array<double, 3>{});
  REQUIRE(source->warnings().size() == 1);
  CHECK_THAT(source->warnings()[0], Contains("--scale 0.001"));
  const auto scaled = open_scans(folder / "scans", {.scale = 0.001});
  const std::vector<Point> points = read_all(*scaled);
  CHECK(points[7].x == Approx(scan_room(0)[7].x).margin(1e-3));
  CHECK(scaled->warnings().empty());
}

TEST_CASE("five floats a point are recognised, other records are refused with the remedy") {
  const TemporaryFolder folder;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> along(-20, 20);
  std::string five;
  std::string six;
  for (int i = 0; i < 400; ++i) {  // both sizes are multiples of 16
    const std::array<float, 3> p = {along(random), along(random), along(random)};
    for (std::string* bytes : {&five, &six}) {
      for (const float value : p) append(*bytes, value);
      append(*bytes, static_cast<float>(i % 100));  // intensity
    }
    append(five, static_cast<float>(i % 32));  // ring
    append(six, along(random));
    append(six, along(random));
  }
  const auto source = open_scans(folder.write("0.bin", five));
  const std::vector<Point> points = read_all(*source);
  REQUIRE(points.size() == 400);
  CHECK(std::abs(points[399].z) <= 20);
  REQUIRE(source->warnings().size() == 1);
  CHECK_THAT(source->warnings()[0], Contains("five float32") && Contains("--format kitti"));
  CHECK(read_all(folder / "0.bin", {.format = "kitti"}).size() == 500);
  CHECK_THROWS_WITH(read_all(folder.write("1.bin", six)),
                    Contains("no intensities") && Contains("float32x5"));
  CHECK(read_all(folder / "1.bin", {.format = "float32x6"}).size() == 400);
  CHECK_THROWS_WITH(read_all(folder / "1.bin", {.format = "float32x7"}), Contains("no multiple of 28"));
  CHECK_THROWS_WITH(open_scans(folder / "1.bin", {.format = "float16x3"}), Contains("--format float16x3"));
}

TEST_CASE("a format that is named reads files whose names say nothing") {
  const TemporaryFolder folder;
  folder.write("scans/a1.dat", "1 2 3\n");
  folder.write("scans/a2.dat", "4 5 6\n");
  folder.write("scans/notes.md", "none");
  const auto source = open_scans(folder / "scans", {.format = "csv"});
  REQUIRE(source->size() == 2);
  check_first(read_all(*source, 1), 1, {4, 5, 6});
}

TEST_CASE("a map beside the scans it was made of is neither scan nor odometry") {
  const TemporaryFolder folder;
  for (const char* name : {"1.ply", "2.ply"})
    folder.write(std::string("scans/") + name,
                 "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
                 "property float z\nend_header\n");
  SECTION("as alces map leaves it") {
    for (const char* name : {"map.ply", "run.json", "scans.csv"})
      folder.write(std::string("scans/") + name, "");
    folder.write("scans/trajectory.tum", "1 1 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n");
    const auto source = open_scans(folder / "scans");
    CHECK(source->size() == 2);
    CHECK_FALSE(source->odometry(0));
    CHECK_THAT(source->warnings().at(0), Contains("a map beside the scans"));
  }
  SECTION("as any program may") {
    folder.write("scans/GlobalMap.ply", "");
    const auto source = open_scans(folder / "scans");
    CHECK(source->size() == 2);
    CHECK_THAT(source->warnings().at(0), Contains("GlobalMap.ply") && Contains("left out"));
  }
}

TEST_CASE("columns of a trajectory are those that its header names, in any order") {
  const TemporaryFolder folder;
  const Trajectory euroc = read_trajectory(folder.write(
      "e.csv",
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n"
      "1520530308199447626,1,2,3,0.70710678,0,0,0.70710678\n"));
  CHECK(euroc.notes.empty());
  CHECK(euroc.has_time);
  CHECK(euroc.stamps_s[0] == Approx(1520530308.199447626).epsilon(1e-15));
  CHECK((euroc.poses[0] * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, 3, 3)).norm() < 1e-7);
  const Trajectory wide = read_trajectory(folder.write(
      "w.csv",
      "time,field.x,v_x,v_y,v_z,pose.position.x,pose.position.y,pose.position.z,pose.orientation.x,"
      "pose.orientation.y,pose.orientation.z,pose.orientation.w\n0.5,9,9,9,9,1,2,3,0,0,0,1\n"));
  CHECK(wide.poses[0].translation_m == Eigen::Vector3d(1, 2, 3));
  CHECK(wide.stamps_s[0] == 0.5);
  CHECK_THROWS_WITH(read_trajectory(folder.write("bad.csv", "# t x y z qx qy qz qw\n0 1 2 3 0 0 0 1 9\n")),
                    Contains("bad.csv:2:") && Contains("9 numbers") && Contains("8 columns"));
}

TEST_CASE("a quaternion's order is told where nothing names it, and not guessed") {
  const TemporaryFolder folder;
  const std::string line = "0.5 1 2 3 0 0 0 1\n";
  CHECK_THAT(read_trajectory(folder.write("a.txt", line)).notes.at(0), Contains("qx qy qz qw"));
  CHECK(read_trajectory(folder.write("a.tum", line)).notes.empty());
  CHECK(read_trajectory(folder.write("b.txt", "# timestamp tx ty tz qx qy qz qw\n" + line)).notes.empty());
}

TEST_CASE("stamps in whole seconds since 1970, in ms and in ns are times, small whole numbers are scans") {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& stamp) {
    return read_trajectory(folder.write("a.tum", stamp + " 0 0 0 0 0 0 1\n"));
  };
  CHECK(read("1700000000").has_time);
  CHECK(read("1700000000").stamps_s[0] == 1700000000);
  CHECK(read("1700000000500").stamps_s[0] == 1700000000.5);
  CHECK(read("1700000000500000000").stamps_s[0] == 1700000000.5);
  CHECK_THAT(read("1700000000500000000").notes.at(0), Contains("nanoseconds"));
  CHECK_FALSE(read("17").has_time);
  CHECK(read("17").has_stamps);
}

TEST_CASE("a trajectory may have decimal commas") {
  const TemporaryFolder folder;
  const Trajectory read = read_trajectory(folder.write("a.tum", "0,5;1,25;2;3;0;0;0;1\n"));
  CHECK(read.stamps_s[0] == 0.5);
  CHECK(read.poses[0].translation_m.x() == 1.25);
}
