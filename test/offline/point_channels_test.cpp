#include "offline/io/scans/point_channels.h"

#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>

#include "offline/convert/cloud_writer.h"
#include "offline/io/scans/scan_source.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace {

constexpr std::size_t count = 101;

std::vector<Point> points() {
  std::vector<Point> made;
  for (std::size_t i = 0; i < count; ++i) made.push_back({1 + 0.1F * static_cast<float>(i), 2, 3});
  return made;
}

/// From `first` on in steps of `step`.
RawChannels times(const char* name, NumberType type, double first, double step) {
  RawChannels raw;
  raw.time = {name, type};
  for (std::size_t i = 0; i < count; ++i) raw.time.values.push_back(first + step * static_cast<double>(i));
  return raw;
}

struct Taken {
  ScanPoints scan;
  ChannelReading reading;
  std::vector<std::string> warnings;
};

Taken take(const RawChannels& raw, const ChannelContext& context = {}, const ChannelReading& reading = {}) {
  Taken taken{.scan = {.points = points()}, .reading = reading, .warnings = {}};
  take_channels(raw, context, taken.reading, taken.scan, taken.warnings);
  return taken;
}

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

/// "x y z" and whatever else.
std::string pcd(const std::string& fields, const std::string& sizes, const std::string& types,
                const std::string& data) {
  std::string ones;
  for (const char c : fields) ones += c == ' ' ? " 1" : "";
  return fmt::format(
      "VERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT 1{}\nWIDTH {}\nHEIGHT 1\nPOINTS {}\nDATA {}\n", fields,
      sizes, types, ones, count, count, data);
}

}  // namespace

TEST_CASE("the times of each maker's fields come out as seconds since the scan's stamp") {
  struct Case {
    const char* who;
    RawChannels raw;
    std::optional<double> stamp_s;
    const char* unit;
    bool has_clock;
  };
  const double stamp_s = 1'700'000'000.5;
  const std::vector<Case> cases = {
      {"Ouster", times("t", NumberType::u32, 0, 1e6), stamp_s, " ns ", false},
      {"Velodyne in ROS", times("time", NumberType::f32, 0, 1e-3), stamp_s, " s ", false},
      {"Livox", times("offset_time", NumberType::u32, 0, 1e6), std::nullopt, " ns ", false},
      {"Livox in PointCloud2", times("timestamp", NumberType::f64, stamp_s * 1e9, 1e6), stamp_s, " ns ",
       true},
      {"Hesai", times("timestamp", NumberType::f64, stamp_s, 1e-3), stamp_s, " s ", true},
      {"milliseconds", times("time_offset", NumberType::f32, 0, 1), stamp_s, " ms ", false},
      {"microseconds by name", times("t_us", NumberType::i32, 0, 1000), std::nullopt, " us ", false},
      {"in brackets", times("Time [us]", NumberType::f64, 0, 1000), std::nullopt, " us ", false},
      {"CloudCompare", times("scalar_GpsTime", NumberType::f64, 345'600.25, 1e-3), std::nullopt, " s ", true},
      {"nanoseconds since the start", times("t", NumberType::u64, 1.5e12, 1e6), std::nullopt, " ns ", true}};
  for (const Case& c : cases) {
    CAPTURE(c.who);
    const Taken taken = take(c.raw, {"a.pcd", c.stamp_s, std::nullopt});
    CHECK(taken.warnings.empty());
    CHECK_THAT(taken.reading.text(), Contains(c.unit));
    REQUIRE(taken.scan.time_s.size() == count);
    for (std::size_t i = 0; i < count; ++i)
      CHECK(static_cast<double>(taken.scan.time_s[i]) == Approx(1e-3 * static_cast<double>(i)).margin(1e-6));
    CHECK(taken.scan.clock_s.has_value() == c.has_clock);
  }
}

TEST_CASE("times around a scan's stamp may lie before it") {
  const Taken taken = take(times("time", NumberType::f32, -0.1, 1e-3), {"a.pcd", 50.0, std::nullopt});
  REQUIRE(taken.scan.time_s.size() == count);
  CHECK(taken.scan.time_s.front() == Approx(-0.1));
  CHECK_FALSE(taken.scan.clock_s);
  // the same scan by the clock: the stamp is at its end
  const Taken by_clock = take(times("timestamp", NumberType::f64, 49.9, 1e-3), {"a.pcd", 50.0, std::nullopt});
  REQUIRE(by_clock.scan.time_s.size() == count);
  CHECK(by_clock.scan.time_s.front() == Approx(-0.1));
}

TEST_CASE("the interval between scans decides where a scan alone could be of two units") {
  // 9000 a scan: 9 s in ms, 9 ms in us
  const RawChannels raw = times("t", NumberType::u32, 0, 90);
  CHECK_THAT(take(raw).reading.text(), Contains(" ms "));
  CHECK_THAT(take(raw, {"a.pcd", 5.0, 0.1}).reading.text(), Contains(" us "));
}

TEST_CASE("times that cannot be right are not used, and that is said") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  RawChannels with_nan = times("t", NumberType::f64, 0, 1e-3);
  with_nan.time.values[7] = nan;
  const std::vector<std::pair<RawChannels, const char*>> cases = {
      {times("t", NumberType::u32, 0, 0), "all the same"},
      {times("t", NumberType::f64, 1.7e9, 0), "all the same"},
      {with_nan, "no numbers"},
      {times("time_s", NumberType::f64, 0, 1), "span 100 s"},
      {times("timestamp", NumberType::f64, 1.7e9, 1), "span 100 s"},
      {times("t_ns", NumberType::u32, 0, 10), "takes longer"}};
  for (const auto& [raw, reason] : cases) {
    const Taken taken = take(raw);
    CHECK(taken.scan.time_s.empty());
    CHECK_THAT(taken.reading.text(), Contains("not used") && Contains(reason));
  }
  CHECK_THAT(take(times("t_ms", NumberType::u32, 0, 5), {"a.pcd", 1.0, 0.1}).reading.text(),
             Contains("scans come every 0.1 s"));
}

TEST_CASE("a later scan of bad times is named once a reason, and keeps its points") {
  ChannelReading reading = take(times("t", NumberType::u32, 0, 1e6)).reading;
  const RawChannels same = times("t", NumberType::u32, 5, 0);
  const Taken first = take(same, {"7.pcd"}, reading);
  REQUIRE(first.warnings.size() == 1);
  CHECK_THAT(first.warnings[0], Contains("7.pcd") && Contains("all the same"));
  CHECK(first.scan.time_s.empty());
  CHECK(first.scan.points.size() == count);
  CHECK(take(same, {"8.pcd"}, first.reading).warnings.empty());
  CHECK(take(times("t", NumberType::u32, 0, 1e6), {"9.pcd"}, first.reading).scan.time_s.size() == count);
}

TEST_CASE("rays without a return may have any time") {
  RawChannels raw = times("timestamp", NumberType::f64, 1.7e9, 1e-3);
  Taken taken{.scan = {.points = points()}, .reading = {}, .warnings = {}};
  taken.scan.points[3] = {0, 0, 0};
  raw.time.values[3] = 0;
  taken.scan.points[4].x = std::numeric_limits<float>::quiet_NaN();
  raw.time.values[4] = std::numeric_limits<double>::quiet_NaN();
  take_channels(raw, {}, taken.reading, taken.scan, taken.warnings);
  REQUIRE(taken.scan.time_s.size() == count);
  CHECK(taken.scan.time_s[3] == 0);
  CHECK(taken.scan.time_s[5] == Approx(0.005).margin(1e-6));
}

TEST_CASE("intensities become 8 bits by one scale, whatever a single point shines") {
  struct Case {
    NumberType type;
    double most;
    double full;
  };
  for (const Case& c :
       {Case{NumberType::u8, 40, 255}, Case{NumberType::f32, 0.9, 1}, Case{NumberType::f32, 100, 255},
        Case{NumberType::u16, 200, 255}, Case{NumberType::u16, 3000, 4095},
        Case{NumberType::u16, 60'000, 65'535}, Case{NumberType::f32, 100'000, 131'070}}) {
    CAPTURE(c.most, c.full);
    RawChannels raw;
    raw.intensity = {"Intensity", c.type};
    for (std::size_t i = 0; i < count; ++i)
      raw.intensity.values.push_back(c.most * static_cast<double>(i) / (count - 1));
    if (c.type != NumberType::u8) raw.intensity.values[50] = 1e9;  // a reflector in the sun
    const Taken taken = take(raw);
    REQUIRE(taken.scan.intensity.size() == count);
    CHECK(taken.scan.intensity[0] == 0);
    CHECK(std::abs(taken.scan.intensity[100] - 255 * c.most / c.full) <= 0.5);
    if (c.type != NumberType::u8) CHECK(taken.scan.intensity[50] == 255);
    // the next scan is darker, and so are its numbers
    for (double& value : raw.intensity.values) value = std::min(value, c.most) / 2;
    CHECK(std::abs(take(raw, {}, taken.reading).scan.intensity[100] - 255 * c.most / c.full / 2) <= 0.51);
  }
}

TEST_CASE("intensities that are all 0 or negative are none, and that is said") {
  RawChannels raw;
  raw.intensity = {"intensity", NumberType::u16, std::vector<double>(count, 0.0)};
  CHECK(take(raw).scan.intensity.empty());
  CHECK_THAT(take(raw).reading.text(), Contains("all 0"));
  raw.intensity = {"reflectance", NumberType::f32, std::vector<double>(count, -12.5)};
  CHECK(take(raw).scan.intensity.empty());
  CHECK_THAT(take(raw).reading.text(), Contains("negative"));
}

TEST_CASE("of several fields the one that says it most clearly is taken") {
  const ChannelFields fields =
      find_channels({"x", "y", "z", "signal", "reflectivity", "timestamp", "t", "ring"});
  CHECK(fields.time == 6);
  CHECK(fields.intensity == 4);
  const ChannelFields none = find_channels({"x", "y", "z", "ring", "nx", "rgb", "label"});
  CHECK(none.time == SIZE_MAX);
  CHECK(none.intensity == SIZE_MAX);
}

TEST_CASE("PCD, PLY, CSV, LAS and KITTI files bring the channels that they have") {
  const TemporaryFolder folder;
  std::string binary = pcd("x y z intensity t ring", "4 4 4 4 4 2", "F F F F U U", "binary");
  std::string ascii = pcd("x y z intensity t", "4 4 4 4 4", "F F F F U", "ascii");
  std::string ply = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty "
      "float z\n"
      "property double timestamp\nproperty uchar intensity\nend_header\n",
      count);
  std::string csv = "x,y,z,Intensity,time [us]\n";
  std::string kitti;
  for (std::size_t i = 0; i < count; ++i) {
    const Point p = points()[i];
    const auto shine = static_cast<float>(i);
    for (const float value : {p.x, p.y, p.z, shine}) append(binary, value);
    append(binary, static_cast<std::uint32_t>(i * 1'000'000));
    append(binary, static_cast<std::uint16_t>(i % 16));
    ascii += fmt::format("{} {} {} {} {}\n", p.x, p.y, p.z, shine, i * 1'000'000);
    for (const float value : {p.x, p.y, p.z}) append(ply, value);
    append(ply, 1.7e9 + 1e-3 * static_cast<double>(i));
    append(ply, static_cast<std::uint8_t>(i));
    csv += fmt::format("{},{},{},{},{}\n", p.x, p.y, p.z, shine, i * 1000);
    for (const float value : {p.x, p.y, p.z, shine / 255}) append(kitti, value);
  }
  auto writer = open_cloud_writer(folder / "0.las", CloudForm::las);
  writer->add(points(), 0, 0);
  writer->finish();
  std::string las = content_of(folder / "0.las");
  for (std::size_t i = 0; i < count; ++i) {
    const auto shine = static_cast<std::uint16_t>(i);
    const double time_s = 2.5e8 + 1e-3 * static_cast<double>(i);
    std::memcpy(las.data() + 375 + 30 * i + 12, &shine, 2);
    std::memcpy(las.data() + 375 + 30 * i + 22, &time_s, 8);
  }
  for (const auto& [name, content, has_time] :
       {std::tuple("a.pcd", binary, true), std::tuple("b.pcd", ascii, true), std::tuple("c.ply", ply, true),
        std::tuple("d.csv", csv, true), std::tuple("e.las", las, true), std::tuple("f.bin", kitti, false)}) {
    CAPTURE(name);
    const auto source = open_scans(folder.write(name, content));
    ScanPoints scan;
    REQUIRE(source->read(0, scan));
    CHECK(source->warnings().empty());
    CAPTURE(source->channels());
    REQUIRE(scan.points.size() == count);
    REQUIRE(scan.intensity.size() == count);
    for (std::size_t i = 0; i < count; ++i) CHECK(scan.intensity[i] == i);
    REQUIRE(scan.time_s.size() == (has_time ? count : 0));
    for (std::size_t i = 0; i < scan.time_s.size(); ++i)
      CHECK(static_cast<double>(scan.time_s[i]) == Approx(1e-3 * static_cast<double>(i)).margin(1e-6));
  }
}
