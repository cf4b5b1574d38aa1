#include "offline/io/scans/scan_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <random>

#include "offline/io/files/lzf.h"
#include "offline/io/files/text_numbers.h"
#include "offline/io/map_folder/trajectory.h"
#include "support/test_data.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace {

std::vector<Point> read_all(const std::filesystem::path& path) {
  ScanPoints scan;
  open_scans(path)->read(0, scan);
  return scan.points;
}

void check_points(const std::vector<Point>& points, const std::vector<std::array<float, 3>>& expected) {
  REQUIRE(points.size() == expected.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK(points[i].x == expected[i][0]);
    CHECK(points[i].y == expected[i][1]);
    CHECK(points[i].z == expected[i][2]);
  }
}

template <typename T>
std::string bytes(T value, bool big_endian = false) {
  std::string text(sizeof(T), 0);
  std::memcpy(text.data(), &value, sizeof(T));
  if (big_endian) std::reverse(text.begin(), text.end());
  return text;
}

std::string pcd_header(std::string_view fields, std::string_view sizes, std::string_view types,
                       std::string_view counts, std::uint64_t points, std::string_view data) {
  return fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT {}\nWIDTH "
      "{}\n"
      "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\nDATA {}\n",
      fields, sizes, types, counts, points, points, data);
}

std::string pcd_xyz(std::uint64_t points, std::string_view data) {
  return pcd_header("x y z", "4 4 4", "F F F", "1 1 1", points, data);
}

// Plain and slow: the longest earlier match, found by looking everywhere.
std::string lzf_compress(std::string_view in) {
  std::string out;
  std::string literals;
  const auto flush = [&] {
    for (std::size_t i = 0; i < literals.size(); i += 32) {
      const std::string part = literals.substr(i, 32);
      out += static_cast<char>(part.size() - 1);
      out += part;
    }
    literals.clear();
  };
  for (std::size_t at = 0; at < in.size();) {
    std::size_t best = 0;
    std::size_t distance = 0;
    for (std::size_t from = at > 8192 ? at - 8192 : 0; from < at; ++from) {
      std::size_t length = 0;
      while (length < 264 && at + length < in.size() && in[from + length] == in[at + length]) ++length;
      if (length > best) {
        best = length;
        distance = at - from - 1;
      }
    }
    if (best < 3) {
      literals += in[at++];
      continue;
    }
    flush();
    const std::size_t code = best - 2;
    out += static_cast<char>(std::min<std::size_t>(code, 7) << 5 | distance >> 8);
    if (code >= 7) out += static_cast<char>(code - 7);
    out += static_cast<char>(distance & 255);
    at += best;
  }
  flush();
  return out;
}

}  // namespace

TEST_CASE("plain decimals are parsed to the nearest double, odd spellings too") {
  const auto parse = [](const std::string& text) {
    double value = -12345;
    const char* const stop = parse_number(text.data(), text.data() + text.size(), value);
    return stop == text.data() + text.size() ? value : -99999;
  };
  for (const char* text :
       {"0", "-0", "1", "-4.8", "314.8", "0.0662149", "5.", ".5", "-.25", "9007199254740993",
        "0.1234567890123456789", "12345678901234567890123", "2.84217e-14", "1e5", "-1.5E+3",
        "0.00000000000000000000001", "123456.789012345678"}) {
    CHECK(parse(text) == std::strtod(text, nullptr));
  }
  std::mt19937_64 random(1);
  for (int i = 0; i < 20000; ++i) {
    const double value = std::uniform_real_distribution<double>(-1e5, 1e5)(random);
    const std::string text = fmt::format("{:.{}f}", value, i % 17);
    CHECK(parse(text) == std::strtod(text.c_str(), nullptr));
  }
  CHECK(parse("+1.5") == 1.5);
  CHECK(std::isnan(parse("nan")));
  CHECK(std::isnan(parse("-nan")));
  CHECK(parse("inf") == HUGE_VAL);
  CHECK(parse("-inf") == -HUGE_VAL);
  CHECK(parse("1e999") == HUGE_VAL);
  CHECK(parse("-1e999") == -HUGE_VAL);
  CHECK(parse("1e-999") == 0);
  for (const char* text : {"", "-", "+", ".", "-.", "abc", "1.2.3", "1x", "+-1", "--1", "1e", "0x10", "e5"}) {
    INFO(text);
    CHECK(parse(text) == -99999);
  }
}

TEST_CASE("3DTK scans come in our frame and in metres, with the odometry of their .pose files") {
  const TemporaryFolder folder;
  folder.write("scan000.3d", "100 200 300\n-4.8 1.4 -314.8\n");
  folder.write("scan000.pose", "0 0 0\n0 0 0\n");
  folder.write("scan001.3d", "1 2 3 0.5 17\r\n\n4 5 6 0.5 18");
  folder.write("scan001.pose", "-211.673 0 142.138 \n0 -51.7758 0\n");
  const auto source = open_scans(folder.path());
  REQUIRE(source->size() == 2);
  CHECK(source->warnings().empty());
  CHECK(source->name(1) == "scan001.3d");
  CHECK(source->number(1) == 1);
  CHECK_FALSE(source->stamp_s(0));
  CHECK_THAT(source->description(), Contains("2 scans") && Contains("3DTK") && Contains(".pose"));
  ScanPoints scan;
  source->read(0, scan);
  check_points(scan.points, {{{3, -1, 2}}, {{-3.148F, 0.048F, 0.014F}}});
  source->read(1, scan);
  check_points(scan.points, {{{0.03F, -0.01F, 0.02F}}, {{0.06F, -0.04F, 0.05F}}});
  REQUIRE(source->odometry(1));
  CHECK(same_pose(*source->odometry(1),
                  from_3dtk({{-211.673, 0, 142.138}, {0, -51.7758 / 180 * 3.14159265358979, 0}}), 1e-9));
}

TEST_CASE("the last matrix of a .frames file is the pose where there is no .pose file") {
  const TemporaryFolder folder;
  folder.write("scan000.3d", "1 2 3\n");
  folder.write("scan000.frames",
               "1 0 0 0 0 1 0 0 0 0 1 0 9 9 9 1 1\n1 0 0 0 0 1 0 0 0 0 1 0 100 200 300 1 2\n");
  const auto source = open_scans(folder.path());
  REQUIRE(source->odometry(0));
  CHECK((source->odometry(0)->translation_m - Eigen::Vector3d(3, -1, 2)).norm() < 1e-12);
}

TEST_CASE("a count, words or a comment in the first line of a 3DTK scan are a header") {
  const TemporaryFolder folder;
  for (const char* header : {"1", "# x y z", "# 1 2 3", "361 x 480", "361 rows 480 columns", "1 points",
                             "x y z", "points 1", "scan 7 of a cellar"}) {
    INFO(header);
    check_points(read_all(folder.write("scan000.3d", std::string(header) + "\n100 200 300\n")),
                 {{{3, -1, 2}}});
  }
}

TEST_CASE("a first 3DTK line with two numbers and a word is no header but a bad point") {
  const TemporaryFolder folder;
  for (const char* line : {"two 200 300", "100 two 300", "100 200 three", "x 200 300 0.5", "100 x 300 0.5"}) {
    INFO(line);
    const auto file = folder.write("scan000.3d", std::string(line) + "\n100 200 300\n");
    CHECK_THROWS_WITH(read_all(file), Contains("scan000.3d:1: number"));
  }
}

TEST_CASE("a 3DTK header that promises another number of points is a warning") {
  const TemporaryFolder folder;
  const auto source = open_scans(folder.write("scan000.3d", "7\n1 2 3\n"));
  ScanPoints scan;
  source->read(0, scan);
  source->read(0, scan);
  REQUIRE(source->warnings().size() == 1);
  CHECK_THAT(source->warnings()[0], Contains("promises 7 points, 1 are there"));
}

TEST_CASE("an empty 3DTK or CSV file is a scan of no points") {
  const TemporaryFolder folder;
  CHECK(read_all(folder.write("scan000.3d", "")).empty());
  CHECK(read_all(folder.write("empty.csv", "")).empty());
  CHECK(read_all(folder.write("headed.csv", "x,y,z\n")).empty());
  CHECK(read_all(folder.write("empty.bin", "")).empty());
}

TEST_CASE("NaN and Inf are handed on as they are") {
  const TemporaryFolder folder;
  const std::vector<Point> points = read_all(folder.write("scan000.3d", "nan 1 2\n1 -inf 2\n"));
  REQUIRE(points.size() == 2);
  CHECK(std::isnan(points[0].y));
  CHECK(std::isinf(points[1].z));
}

TEST_CASE("text where numbers belong is an error that names file and line") {
  const TemporaryFolder folder;
  const auto file = folder.write("scan000.3d", "1 2 3\n4 oops 6\n");
  CHECK_THROWS_WITH(read_all(file), Contains("scan000.3d:2:") && Contains("oops"));
  CHECK_THROWS_AS(read_all(file), InputError);
}

TEST_CASE("a 3DTK line of two numbers, as a cut off file ends, is an error") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_all(folder.write("scan000.3d", "1 2 3\n4 5")), Contains("scan000.3d:2:"));
  CHECK_THROWS_WITH(read_all(folder.write("scan001.3d", "1 2 3\n4 5\n6 7 8\n")), Contains("scan001.3d:2:"));
}

TEST_CASE("a file of zeros, as a power loss leaves it, is an error") {
  const TemporaryFolder folder;
  CHECK_THROWS_AS(read_all(folder.write("scan000.3d", std::string(4096, '\0'))), InputError);
}

TEST_CASE("a missing number in a 3DTK sequence is skipped and reported") {
  const TemporaryFolder folder;
  for (const int i : {9, 10, 12, 15}) folder.write(fmt::format("scan{}.3d", i), fmt::format("0 0 {}00\n", i));
  const auto source = open_scans(folder.path());
  REQUIRE(source->size() == 4);
  CHECK(source->name(0) == "scan9.3d");
  CHECK(source->number(3) == 15);
  const std::vector<std::string> warnings = source->warnings();
  REQUIRE(warnings.size() == 2);
  CHECK_THAT(warnings[0], Contains("1 scan is missing between scan10.3d and scan12.3d"));
  CHECK_THAT(warnings[1], Contains("2 scans are missing between scan12.3d and scan15.3d"));
}

TEST_CASE("a missing number is reported of any format, where the numbers count the scans") {
  const TemporaryFolder folder;
  const auto warnings_of = [&](const std::string& name, const std::vector<std::string>& numbers) {
    for (const std::string& number : numbers)
      folder.write(name + "/a" + number + ".pcd", pcd_xyz(0, "ascii"));
    return open_scans(folder / name)->warnings();
  };
  const std::vector<std::string> gap = warnings_of("counted", {"007", "008", "010", "011"});
  REQUIRE(gap.size() == 1);
  CHECK_THAT(gap[0], Contains("1 scan is missing between a008.pcd and a010.pcd"));
  CHECK(warnings_of("two of three", {"0", "1", "3"}).size() == 1);
  CHECK(warnings_of("whole", {"1", "2", "3"}).empty());
  CHECK(warnings_of("every tenth", {"0", "10", "20", "40"}).empty());
  CHECK(warnings_of("times in ms", {"1630577758", "1630577861", "1630577958", "1630578061"}).empty());
  CHECK(warnings_of("one", {"7"}).empty());
}

TEST_CASE("numbers beyond 32 bits, which map.ply does not hold, give way to the order with a warning") {
  const TemporaryFolder folder;
  const auto check = [&](const std::vector<std::string>& numbers, bool as_named) {
    const TemporaryFolder scans;
    for (const std::string& number : numbers) scans.write("a" + number + ".pcd", pcd_xyz(0, "ascii"));
    const auto source = open_scans(scans.path());
    CAPTURE(numbers);
    for (std::size_t i = 0; i < numbers.size(); ++i)
      CHECK(source->number(i) == (as_named ? std::stoull(numbers[i]) : i));
    CHECK(source->warnings().size() == (as_named ? 0 : 1));
  };
  check({"4294967294", "4294967295"}, true);
  check({"4294967295", "4294967296"}, false);
  check({"1630577758569490000", "1630577758569490001", "1630577758569490002"}, false);
  check({"16305777585694900000000", "16305777585694900000001"}, false);  // more than 64 bits
  for (const char* number : {"1630577758569490000", "1630577758569490001"})
    folder.write("poses/scan" + std::string(number) + ".pose", "0 0 0 0 0 0");
  CHECK(read_trajectory(folder / "poses").stamps_s == std::vector<double>{0, 1});
}

TEST_CASE("a scan without .pose among others that have one is reported") {
  const TemporaryFolder folder;
  folder.write("scan000.3d", "");
  folder.write("scan000.pose", "0 0 0 0 0 0");
  folder.write("scan001.3d", "");
  const auto source = open_scans(folder.path());
  CHECK(source->odometry(0));
  CHECK_FALSE(source->odometry(1));
  REQUIRE(source->warnings().size() == 1);
  CHECK_THAT(source->warnings()[0], Contains("scan001.3d has no .pose"));
}

TEST_CASE("a pose file of five numbers is an error that names file and expected count") {
  const TemporaryFolder folder;
  folder.write("scan000.3d", "1 2 3\n");
  folder.write("scan000.pose", "0 0 0\n0 0\n");
  CHECK_THROWS_WITH(open_scans(folder.path()), Contains("scan000.pose") && Contains("5 numbers where 6"));
}

TEST_CASE("PCD: ascii with fields in any order") {
  const TemporaryFolder folder;
  const std::string header =
      pcd_header("rgb z normal y x", "4 4 4 8 4", "U F F F F", "1 1 3 1 1", 2, "ascii");
  check_points(read_all(folder.write("a.pcd", header + "7 3 0 0 1 2 1\n8 6 0 0 1 5 4.5\n")),
               {{{1, 2, 3}}, {{4.5F, 5, 6}}});
}

TEST_CASE("PCD: binary with every type of field") {
  const TemporaryFolder folder;
  const std::string header =
      pcd_header("a y b z c x d", "1 8 2 4 8 4 2", "U F I I U F U", "1 1 3 1 1 1 2", 2, "binary");
  std::string data;
  for (const int i : {1, 2}) {
    data += bytes(std::uint8_t{9}) + bytes(0.5 * i) + std::string(6, 'x') + bytes(std::int32_t{-7 * i});
    data += bytes(std::uint64_t{3}) + bytes(1.25F * static_cast<float>(i)) + std::string(4, 'x');
  }
  check_points(read_all(folder.write("a.pcd", header + data)), {{{1.25F, 0.5F, -7}}, {{2.5F, 1, -14}}});
}

TEST_CASE("PCD: binary_compressed, field by field") {
  const TemporaryFolder folder;
  std::mt19937 random(5);
  std::vector<std::array<float, 3>> expected;
  for (int i = 0; i < 500; ++i) {
    const auto value = static_cast<float>(random() % 7);
    expected.push_back({value, 1, static_cast<float>(i % 3 == 0 ? random() : 0)});
  }
  std::string plain;
  for (const std::size_t axis : {2U, 0U, 1U}) {
    for (const auto& point : expected) plain += bytes(point.at(axis));
    if (axis == 2) plain += std::string(expected.size() * 2, 'i');
  }
  const std::string compressed = lzf_compress(plain);
  CHECK(compressed.size() < plain.size() / 2);
  const std::string file =
      pcd_header("z intensity x y", "4 2 4 4", "F U F F", "1 1 1 1", expected.size(), "binary_compressed") +
      bytes(static_cast<std::uint32_t>(compressed.size())) + bytes(static_cast<std::uint32_t>(plain.size())) +
      compressed;
  check_points(read_all(folder.write("a.pcd", file)), expected);
  CHECK_THROWS_WITH(read_all(folder.write("b.pcd", file.substr(0, file.size() - 10))), Contains("cut off"));
  std::string damaged = file;
  for (std::size_t i = file.size() - compressed.size(); i < file.size(); i += 5) damaged[i] = '\xff';
  CHECK_THROWS_WITH(read_all(folder.write("c.pcd", damaged)), Contains("damaged"));
}

TEST_CASE("LZF that is damaged anywhere is refused or fills its output, never more") {
  std::mt19937 random(6);
  std::string plain;
  for (int i = 0; i < 300; ++i) plain += static_cast<char>(random() % 4);
  const std::string compressed = lzf_compress(plain);
  std::string out(plain.size(), 0);
  REQUIRE(lzf_decompress(compressed, out));
  CHECK(out == plain);
  for (int i = 0; i < 5000; ++i) {
    std::string damaged = compressed.substr(0, 1 + random() % compressed.size());
    damaged[random() % damaged.size()] = static_cast<char>(random());
    (void)lzf_decompress(damaged, out);  // the sanitizers look on
  }
  CHECK_FALSE(lzf_decompress(compressed.substr(0, compressed.size() - 1), out));
  CHECK_FALSE(lzf_decompress("", out));
  CHECK(lzf_decompress("", {}));
}

TEST_CASE("a cut off binary PCD says how many points are there and promised") {
  const TemporaryFolder folder;
  const auto file = folder.write("a.pcd", pcd_xyz(1000, "binary") + std::string(12 * 10 + 5, 'x'));
  CHECK_THROWS_WITH(read_all(file),
                    Contains("a.pcd") && Contains("holds 10 points") && Contains("promises 1000"));
}

TEST_CASE("a cut off ascii PCD says how many points are there and promised") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_all(folder.write("a.pcd", pcd_xyz(3, "ascii") + "1 2 3\n4 5 6\n")),
                    Contains("holds 2 points") && Contains("promises 3"));
  CHECK_THROWS_WITH(read_all(folder.write("b.pcd", pcd_xyz(3, "ascii") + "1 2 3\n4 5\n")),
                    Contains("b.pcd:13:"));
}

TEST_CASE("a PCD header that promises four billion points allocates nothing") {
  const TemporaryFolder folder;
  for (const char* data : {"ascii", "binary", "binary_compressed"}) {
    for (const std::uint64_t points : {4000000000ULL, 18446744073709551615ULL}) {
      CHECK_THROWS_AS(read_all(folder.write("a.pcd", pcd_xyz(points, data) + "1 2 3\n")), InputError);
    }
  }
  const std::string huge = pcd_xyz(357913941, "binary_compressed") + bytes(std::uint32_t{4}) +
                           bytes(std::uint32_t{357913941U * 12U}) + "abcd";
  CHECK_THROWS_WITH(read_all(folder.write("b.pcd", huge)), Contains("damaged"));
}

TEST_CASE("a PCD field of a size that its type cannot have is an error") {
  const TemporaryFolder folder;
  const auto header = [](std::string_view sizes, std::string_view types, std::string_view counts) {
    return pcd_header("x y z", sizes, types, counts, 1, "binary") + std::string(100, 'x');
  };
  CHECK_THROWS_WITH(read_all(folder.write("a.pcd", header("3 4 4", "F F F", "1 1 1"))), Contains("size 3"));
  CHECK_THROWS_WITH(read_all(folder.write("a.pcd", header("2 4 4", "F F F", "1 1 1"))), Contains("size 2"));
  CHECK_THROWS_WITH(read_all(folder.write("a.pcd", header("4 4 4", "Q F F", "1 1 1"))), Contains("type Q"));
  CHECK_THROWS_WITH(read_all(folder.write("a.pcd", header("4 4", "F F F", "1 1 1"))), Contains("a.pcd:4:"));
  CHECK_THROWS_WITH(read_all(folder.write("a.pcd", header("4 4 four", "F F F", "1 1 1"))), Contains("four"));
  CHECK_THROWS_AS(read_all(folder.write("a.pcd", header("4 4 4", "F F F", "0 1 1"))), InputError);
}

TEST_CASE("a PCD without x, y or z says which fields it has") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(
      read_all(folder.write("a.pcd", pcd_header("x y intensity", "4 4 4", "F F F", "1 1 1", 0, "ascii"))),
      Contains("x y intensity"));
}

TEST_CASE("a PCD header that never ends, or of other data, is an error") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_all(folder.write("a.pcd", "VERSION 0.7\nFIELDS x y z\n")), Contains("DATA"));
  CHECK_THROWS_AS(read_all(folder.write("a.pcd", "")), InputError);
  CHECK_THROWS_AS(read_all(folder.write("a.pcd", "\x89PNG\r\n")), InputError);
  CHECK_THROWS_WITH(read_all(folder.write("a.pcd", pcd_xyz(0, "zipped"))), Contains("zipped"));
}

TEST_CASE("PLY: ascii with other elements, lists and properties around the points") {
  const TemporaryFolder folder;
  const auto file =
      folder.write("a.ply",
                   "ply\r\nformat ascii 1.0\r\ncomment hello\r\nelement face 2\r\n"
                   "property list uchar int vertex_indices\r\nelement vertex 2\r\nproperty double z\r\n"
                   "property list uchar float extra\r\nproperty float x\r\nproperty float y\r\n"
                   "end_header\r\n3 0 1 2\r\n0\r\n3 2 9 9 1 2\r\n6 0 4 5\r\n");
  check_points(read_all(file), {{{1, 2, 3}}, {{4, 5, 6}}});
}

TEST_CASE("PLY: binary of either byte order") {
  const TemporaryFolder folder;
  for (const bool big : {false, true}) {
    std::string file = fmt::format(
        "ply\nformat binary_{}_endian 1.0\nelement camera 2\nproperty float f\nproperty uchar id\n"
        "element face 1\nproperty list uchar int vertex_indices\nelement vertex 2\nproperty float x\n"
        "property short y\nproperty uchar red\nproperty double z\nproperty list ushort float "
        "weights\nend_header\n",
        big ? "big" : "little");
    file += bytes(1.0F, big) + "i" + bytes(2.0F, big) + "j";
    file += bytes(std::uint8_t{3}) + std::string(12, 'f');
    for (const int i : {1, 2}) {
      file +=
          bytes(1.5F * static_cast<float>(i), big) + bytes(static_cast<std::int16_t>(-300 * i), big) + "r";
      file += bytes(0.25 * i, big) + bytes(static_cast<std::uint16_t>(i), big) +
              std::string(4 * static_cast<std::size_t>(i), 'w');
    }
    check_points(read_all(folder.write("a.ply", file)), {{{1.5F, -300, 0.25F}}, {{3, -600, 0.5F}}});
    CHECK_THROWS_WITH(read_all(folder.write("b.ply", file.substr(0, file.size() - 1))),
                      Contains("holds 1 points") && Contains("promises 2"));
  }
}

TEST_CASE("a cut off binary PLY says how many points are there and promised, four billion allocate nothing") {
  const TemporaryFolder folder;
  const auto header = [](std::string_view format, std::uint64_t count) {
    return fmt::format(
        "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
        "end_header\n",
        format, count);
  };
  CHECK_THROWS_WITH(read_all(folder.write("a.ply", header("binary_little_endian", 5) + std::string(30, 'x'))),
                    Contains("holds 2 points") && Contains("promises 5"));
  for (const std::uint64_t count : {4000000000ULL, 18446744073709551615ULL}) {
    CHECK_THROWS_AS(read_all(folder.write("a.ply", header("binary_little_endian", count) + "x")), InputError);
    CHECK_THROWS_WITH(read_all(folder.write("a.ply", header("ascii", count) + "1 2 3\n")),
                      Contains("holds 1 points"));
  }
}

TEST_CASE("PLY: text among the numbers of an ascii file is an error that names the line") {
  const TemporaryFolder folder;
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nend_header\n";
  for (const char* bad : {"4 five 6 0\n", "4 5 6 red\n", "four 5 6 0\n"}) {
    INFO(bad);
    const auto file = folder.write("a.ply", header + "1 2 3 0\n" + bad + "7 8 9 0\n");
    CHECK_THROWS_WITH(read_all(file), Contains("a.ply:10: \"") && !Contains("\n"));
  }
}

TEST_CASE("PLY headers that are none are errors") {
  const TemporaryFolder folder;
  for (const char* header :
       {"", "plx\n", "ply\nformat ascii 1.0\n", "ply\nend_header\n", "ply\nformat ebcdic 1.0\nend_header\n",
        "ply\nformat ascii 1.0\nelement vertex\nend_header\n",
        "ply\nformat ascii 1.0\nelement vertex -1\nend_header\n",
        "ply\nformat ascii 1.0\nproperty float x\nend_header\n",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\nend_header\n",
        "ply\nformat ascii 1.0\nend_header\n",
        "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nend_header\n",
        "ply\nformat ascii 1.0\nelement vertex 0\nproperty\nend_header\n"}) {
    INFO(header);
    CHECK_THROWS_AS(read_all(folder.write("a.ply", header)), InputError);
  }
}

TEST_CASE("KITTI: four floats a point") {
  const TemporaryFolder folder;
  const std::string file = bytes(1.0F) + bytes(2.0F) + bytes(3.0F) + bytes(0.5F);
  check_points(read_all(folder.write("000000.bin", file)), {{{1, 2, 3}}});
  CHECK_THROWS_WITH(read_all(folder.write("000001.bin", file + "abc")),
                    Contains("000001.bin") && Contains("19 bytes"));
}

TEST_CASE("a KITTI sequence brings poses, calibration and times from beside its velodyne folder") {
  const TemporaryFolder folder;
  for (const char* name : {"velodyne/000000.bin", "velodyne/000001.bin"}) folder.write(name, "");
  folder.write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 2\n");
  SECTION("without calibration the poses are taken as they are, and that is said") {
    const auto source = open_scans(folder.path());
    REQUIRE(source->size() == 2);
    CHECK(source->odometry(1)->translation_m.z() == 2);
    REQUIRE(source->warnings().size() == 1);
    CHECK_THAT(source->warnings()[0], Contains("calib.txt"));
  }
  SECTION("with it, ahead of the camera (z) is ahead of the scanner (x)") {
    folder.write("calib.txt", "P0: 1 2 3\nTr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n");
    folder.write("times.txt", "0.0\n0.1037359\n");
    for (const auto& path : {folder.path(), folder / "velodyne"}) {
      const auto source = open_scans(path);
      CHECK((source->odometry(1)->translation_m - Eigen::Vector3d(2, 0, 0)).norm() < 1e-12);
      CHECK(source->stamp_s(1) == 0.1037359);
      CHECK(source->warnings().empty());
    }
  }
}

TEST_CASE("CSV: columns by name or the first three, any separator") {
  const TemporaryFolder folder;
  const std::vector<std::array<float, 3>> expected = {{1.5F, -2, 3}, {4, 5e-1F, 6}};
  for (const char* file :
       {"1.5,-2,3\n4,5e-1,6\n", "1.5;-2;3\r\n4;0.5;6", "1.5\t-2\t3\n4\t.5\t6\n",
        "  1.5 -2   3\n  4  0.5 6 \n\n", "x,y,z,nx\n1.5 , -2 ,3 , 9\n4,0.5,6,\n",
        "time;Z;Y;\"X\"\n0;3;-2;1.5\n0;6;0.5;4\n", "# comment\n//X Y Z I\n1.5 -2 3 0\n4 0.5 6 0\n",
        "Points:0,Points:1,Points:2,name\n1.5,-2,3,a\n4,0.5,6,b\n"}) {
    INFO(file);
    check_points(read_all(folder.write("a.csv", file)), expected);
  }
  check_points(read_all(folder.write("a.txt", "1.5 -2 3\n4 0.5 6\n")), expected);
}

TEST_CASE("CSV: text or nothing where a coordinate belongs is an error with its line") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_all(folder.write("a.csv", "x,y,z\n1,2,3\n1,,3\n")), Contains("a.csv:3:"));
  CHECK_THROWS_WITH(read_all(folder.write("a.csv", "1,2,3\n1,2,three\n")), Contains("a.csv:2:"));
  CHECK_THROWS_WITH(read_all(folder.write("a.csv", "1,2\n")), Contains("a.csv:1:"));
}

TEST_CASE("CSV: a header without x, y and z says which columns there are") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_all(folder.write("a.csv", "range,angle,z\n1,2,3\n")), Contains("range angle z"));
}

TEST_CASE("alidarPose.csv and trajectory.tum beside the scans are odometry with stamps") {
  const TemporaryFolder folder;
  folder.write("full000.pcd", pcd_xyz(0, "binary"));
  folder.write("full001.pcd", pcd_xyz(0, "binary"));
  SECTION("matrices") {
    folder.write("alidarPose.csv",
                 "1,0,0,0,\n0,1,0,0,\n0,0,1,0,\n0,0,0,1630577758.5,\n"
                 "0,-1,0,1,\n1,0,0,2,\n0,0,1,3,\n0,0,0,1630577758.75,\n");
  }
  SECTION("TUM") {
    folder.write("trajectory.tum",
                 "# stamp\n1630577758.5 0 0 0 0 0 0 1\n1630577758.75 1 2 3 0 0 0.70710678 0.70710678\n");
  }
  const auto source = open_scans(folder.path());
  REQUIRE(source->size() == 2);
  CHECK(source->stamp_s(1) == 1630577758.75);
  REQUIRE(source->odometry(1));
  CHECK((*source->odometry(1) * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, 3, 3)).norm() < 1e-7);
  CHECK(source->warnings().empty());
}

TEST_CASE("of several trajectories beside the scans, the one called odometry is odometry") {
  const TemporaryFolder folder;
  folder.write("a.ply", "");
  folder.write("truth.tum", "0 9 0 0 0 0 0 1\n");
  folder.write("other.tum", "0 8 0 0 0 0 0 1\n");
  const auto undecided = open_scans(folder.path());
  CHECK_FALSE(undecided->odometry(0));
  REQUIRE(undecided->warnings().size() == 1);
  CHECK_THAT(undecided->warnings()[0], Contains("other.tum, truth.tum") && Contains("--odometry"));
  folder.write("odometry.tum", "0 7 0 0 0 0 0 1\n");
  const auto decided = open_scans(folder.path());
  REQUIRE(decided->odometry(0));
  CHECK(decided->odometry(0)->translation_m.x() == 7);
  CHECK(decided->warnings().empty());
}

TEST_CASE("a given odometry overrides the scans' poses, by order or by number") {
  const TemporaryFolder folder;
  for (const char* name : {"scan000", "scan002"}) {
    folder.write(std::string(name) + ".3d", "");
    folder.write(std::string(name) + ".pose", "0 0 0 0 0 0");
  }
  const auto odometry = folder.write("other.txt", "0 1 0 0 0 0 0 1\n1 2 0 0 0 0 0 1\n2 3 0 0 0 0 0 1\n");
  CHECK(open_scans(folder.path(), {.odometry = odometry})->odometry(1)->translation_m.x() == 3);
  const auto two = folder.write("two.txt", "0 1 0 0 0 0 0 1\n1 2 0 0 0 0 0 1\n");
  CHECK(open_scans(folder.path(), {.odometry = two})->odometry(1)->translation_m.x() == 2);
  const auto one = folder.write("one.txt", "0 1 0 0 0 0 0 1\n");
  CHECK_THROWS_WITH(open_scans(folder.path(), {.odometry = one}), Contains("1 poses for 2 scans"));
}

TEST_CASE("a trajectory beside the scans that does not fit them is a warning, not odometry") {
  const TemporaryFolder folder;
  folder.write("a.ply", "");
  folder.write("b.ply", "");
  folder.write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  const auto source = open_scans(folder.path());
  CHECK_FALSE(source->odometry(0));
  CHECK_THAT(source->warnings().back(), Contains("no odometry"));
}

TEST_CASE("what else lies in a folder is named in a warning") {
  const TemporaryFolder folder;
  folder.write("a.pcd", pcd_xyz(0, "ascii"));
  folder.write("map.ply", "");
  const auto source = open_scans(folder.path());
  CHECK(source->size() == 1);
  REQUIRE(source->warnings().size() == 1);
  CHECK_THAT(source->warnings()[0], Contains("1 PLY files are not read"));
}

TEST_CASE("several files are taken in the order of their numbers") {
  const TemporaryFolder folder;
  const std::vector<std::filesystem::path> files = {folder.write("scan10.csv", "10,0,0"),
                                                    folder.write("scan9.csv", "9,0,0")};
  const auto source = open_scans(files);
  REQUIRE(source->size() == 2);
  CHECK(source->name(0) == "scan9.csv");
  CHECK(source->number(1) == 10);
}

TEST_CASE("a path that is not there, an empty folder and a foreign file are errors") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(open_scans(folder / "nowhere"), Contains("nowhere"));
  CHECK_THROWS_WITH(open_scans(folder.path()), Contains("no scans"));
  CHECK_THROWS_WITH(open_scans(folder.write("picture.jpg", "")), Contains("picture.jpg"));
  CHECK_THROWS_AS(open_scans(std::vector<std::filesystem::path>{}), InputError);
}

TEST_CASE("a file that goes away between opening and reading is an error") {
  const TemporaryFolder folder;
  const auto file = folder.write("scan000.3d", "1 2 3\n");
  const auto source = open_scans(file);
  std::filesystem::remove(file);
  ScanPoints scan;
  CHECK_THROWS_WITH(source->read(0, scan), Contains("scan000.3d"));
}

TEST_CASE("prefetching gives the same scans in any order, and throws an error where it belongs") {
  const TemporaryFolder folder;
  for (int i = 0; i < 20; ++i) {
    folder.write(fmt::format("scan{:03}.3d", i),
                 i == 13 ? std::string("1 2 3\nbad line\n") : fmt::format("0 0 {}00\n", i));
  }
  PrefetchingScanSource source(open_scans(folder.path()));
  REQUIRE(source.size() == 20);
  ScanPoints scan;
  for (std::size_t i = 0; i < 20; ++i) {
    if (i == 13) {
      CHECK_THROWS_WITH(source.read(i, scan), Contains("scan013.3d:2:"));
    } else {
      source.read(i, scan);
      check_points(scan.points, {{{static_cast<float>(i), 0, 0}}});
    }
  }
  for (const std::size_t i : {5U, 5U, 4U, 18U, 19U, 0U}) {
    source.read(i, scan);
    check_points(scan.points, {{{static_cast<float>(i), 0, 0}}});
  }
  source.read(12, scan);  // and leave while 13 fails
}

TEST_CASE("real scans: 3DTK, small_gicp's PLY and libpointmatcher's CSV") {
  if (!test::has_test_data("icp_pairs")) return;
  ScanPoints scan;
  const auto uos = open_scans(test::test_data("icp_pairs/3dtk_dat"));
  REQUIRE(uos->size() == 3);
  CHECK(uos->odometry(2)->translation_m.x() == Approx(3.37973));
  uos->read(0, scan);
  std::vector<Point> points = scan.points;
  CHECK(points[1].x == 0.0581712F / 100);
  CHECK(points[1].y == -0.100996F);
  CHECK(std::all_of(points.begin(), points.end(), is_finite));

  CHECK(read_all(test::test_data("icp_pairs/small_gicp/source.ply")).size() == 69792);
  points = read_all(test::test_data("icp_pairs/small_gicp/target.ply"));
  CHECK(points.size() == 69088);
  CHECK(std::all_of(points.begin(), points.end(), [](const Point& p) { return std::abs(p.x) < 1000; }));

  points = read_all(test::test_data("icp_pairs/libpointmatcher/car_cloud400.csv"));
  CHECK(points.size() > 10000);
  CHECK(points[0].x == -3.5376F);
  points = read_all(test::test_data("icp_pairs/libpointmatcher/car_cloud401.csv"));
  CHECK(points[0].z == -1.0169336F);
}
