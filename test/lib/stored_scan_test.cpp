#include "alces/stored_scan.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "alces_platform/sim/random.h"
#include "support/plain_scene.h"

using namespace alces;
using namespace alces::test;

namespace {

constexpr float nan_f = std::numeric_limits<float>::quiet_NaN();
constexpr float inf_f = std::numeric_limits<float>::infinity();

// A scan with everything that a record has room for.
struct Full {
  std::vector<Point> points = street().scan(pose_at(0, 0, 1, 30), 400, 25, 0.01, 1);
  std::vector<SurfaceSample> samples;
  std::vector<std::uint8_t> intensity;
  std::vector<float> time_s;
  std::vector<std::byte> signature;

  Full() {
    sim::Random random(3);
    for (std::size_t i = 0; i < points.size(); ++i) {
      intensity.push_back(static_cast<std::uint8_t>(random.next() & 0xFF));
      time_s.push_back(static_cast<float>(random.uniform(-0.6, 0.6)));
    }
    for (std::uint32_t i = 0; i < 100; ++i) samples.push_back({3 * i, {0, 0.6F, -0.8F}, 0.4F});
    for (int i = 0; i < 300; ++i) signature.push_back(static_cast<std::byte>(random.next()));
  }
  [[nodiscard]] StoredScanContent content() const {
    StoredScanContent content;
    content.points = points;
    content.cell_size_m = 0.2F;
    content.samples = samples;
    content.channels = {intensity, time_s, signature, 7, Point{0.5F, -0.25F, 1.5F}};
    return content;
  }
};

std::vector<std::byte> encode(const StoredScanContent& content) {
  std::vector<std::byte> record(1 << 16);
  record.resize(encode_stored_scan(StoredScanBox(content.points), content, record));
  return record;
}

StoredScanFault parse(std::span<const std::byte> record) {
  StoredScanView view;
  return StoredScanView::parse(record, view);
}

// Reads all that the view shows, which has to be sound.
double sum_of(const StoredScanView& view) {
  double sum = 0;
  bool is_sound = true;
  for (std::uint32_t i = 0; i < view.point_count(); ++i) {
    const Point p = view.point(i);
    is_sound = is_sound && is_finite(p);
    sum += static_cast<double>(p.x + p.y + p.z);
    if (view.has_intensity()) sum += view.intensity(i);
    if (view.has_time()) {
      is_sound = is_sound && std::isfinite(view.time_s(i));
      sum += static_cast<double>(view.time_s(i));
    }
  }
  for (std::uint32_t i = 0; i < view.sample_count(); ++i) {
    const SurfaceSample sample = view.sample(i);
    is_sound = is_sound && sample.index < view.point_count() &&
               std::isfinite(sample.normal[0] + sample.normal[1] + sample.normal[2]);
    sum += sample.index;
  }
  REQUIRE(is_sound);
  return sum;
}

void put(std::vector<std::byte>& record, std::size_t at, std::uint32_t value, std::size_t bytes = 4) {
  for (std::size_t i = 0; i < bytes; ++i) record.at(at + i) = static_cast<std::byte>(value >> (8 * i) & 0xFF);
}

void put_float(std::vector<std::byte>& record, std::size_t at, float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  put(record, at, bits);
}

// Where the content of a block begins.
std::size_t block_at(const std::vector<std::byte>& record, std::size_t points, std::uint32_t kind) {
  std::size_t at = StoredScanLayout::header_bytes + StoredScanLayout::point_bytes * points;
  while (std::to_integer<std::uint32_t>(record.at(at)) != kind) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i)
      length |= std::to_integer<std::size_t>(record.at(at + 4 + i)) << (8 * i);
    at += StoredScanLayout::block_header_bytes + length;
  }
  return at + StoredScanLayout::block_header_bytes;
}

}  // namespace

TEST_CASE("a record gives back what was put in, every channel of it") {
  const Full full;
  const std::vector<std::byte> record = encode(full.content());
  StoredScanView view;
  REQUIRE(StoredScanView::parse(record, view) == StoredScanFault::none);
  const StoredScanBox box(full.points);
  REQUIRE(view.point_count() == full.points.size());
  CHECK(view.cell_size_m() == 0.2F);
  std::size_t wrong = 0;
  for (std::uint32_t i = 0; i < view.point_count(); ++i) {
    const Point p = view.point(i);
    const Point rounded = box.round(full.points[i]);
    if (std::memcmp(&p, &rounded, sizeof p) != 0) ++wrong;
    if (view.intensity(i) != full.intensity[i]) ++wrong;
    if (std::abs(view.time_s(i) - full.time_s[i]) > 1.2F / 65535 / 2 + 1e-6F) ++wrong;
  }
  CHECK(wrong == 0);
  REQUIRE(view.sample_count() == full.samples.size());
  for (std::uint32_t i = 0; i < view.sample_count(); ++i) {
    const SurfaceSample sample = view.sample(i);
    CHECK(sample.index == full.samples[i].index);
    CHECK(sample.normal[1] == Approx(0.6).margin(1e-3));
    CHECK(sample.normal[2] == Approx(-0.8).margin(1e-3));
    CHECK(sample.roughness == Approx(0.4).margin(0.002));
  }
  CHECK(std::ranges::equal(view.signature(), full.signature));
  CHECK(view.signature_version() == 7);
  REQUIRE(view.seen_from());
  CHECK(view.seen_from()->y == -0.25F);
  CHECK(view.seen_from()->z == 1.5F);
}

TEST_CASE("a channel that is not there costs nothing, and one that is costs its entries") {
  const Full full;
  StoredScanContent content = full.content();
  content.channels = {};
  const std::size_t n = full.points.size();
  const std::size_t bare = encode(content).size();
  CHECK(bare == 40 + 6 * n + 8 + 8 * full.samples.size());
  StoredScanView view;
  REQUIRE(StoredScanView::parse(encode(content), view) == StoredScanFault::none);
  CHECK_FALSE(view.has_intensity());
  CHECK_FALSE(view.has_time());
  CHECK(view.signature().empty());
  CHECK_FALSE(view.seen_from());
  content.channels.intensity = full.intensity;
  CHECK(encode(content).size() == bare + 8 + n);
  content.channels.time_s = full.time_s;
  CHECK(encode(content).size() == bare + 8 + n + 16 + 2 * n);
  CHECK(encode(full.content()).size() == bare + 8 + n + 16 + 2 * n + 8 + 300 + 20);
  CHECK(encode(full.content()).size() ==
        StoredScanLayout::record_bytes(static_cast<std::uint32_t>(n), 100, {true, true, 300}));
}

TEST_CASE("the bytes of a record are those of its documentation, on every processor") {
  const std::vector<Point> points = {{1, 2, 3}, {2, 4, 3}};
  const std::vector<SurfaceSample> samples = {{1, {0, 0, 1}, 1}};
  StoredScanContent content;
  content.points = points;
  content.samples = samples;
  content.cell_size_m = 0.5F;
  const std::vector<std::byte> record = encode(content);
  const std::vector<unsigned> expected = {
      1,    0, 1,    0,                                                     // version, channels: samples
      68,   0, 0,    0,    2,    0,    0,    0,                             // bytes, points
      0,    0, 0,    0x3F,                                                  // 0.5
      0,    0, 0x80, 0x3F, 0,    0,    0,    0x40, 0,    0,    0x40, 0x40,  // 1 2 3
      0x80, 0, 0x80, 0x37, 0x80, 0,    0,    0x38, 0,    0,    0,    0,     // 1/65535 2/65535 0
      0,    0, 0,    0,    0,    0,    0xFF, 0xFF, 0xFF, 0xFF, 0,    0,     // codes
      0,    0, 1,    0,    8,    0,    0,    0,      // block: samples, version 1, 8 bytes
      1,    0, 0,    0,    0xFF, 0x00, 0x08, 0x80};  // point 1, roughness 255, u = v = 2048
  REQUIRE(record.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CAPTURE(i);
    CHECK(std::to_integer<unsigned>(record[i]) == expected[i]);
  }
}

TEST_CASE("what does not fit its points, or is no number, is not encoded") {
  const Full full;
  const std::vector<std::byte> whole = encode(full.content());
  std::vector<std::byte> buffer(whole.size());
  const StoredScanBox box(full.points);
  CHECK(encode_stored_scan(box, full.content(), buffer) == whole.size());
  CHECK(encode_stored_scan(box, full.content(), std::span(buffer).first(whole.size() - 1)) == 0);
  StoredScanContent content = full.content();
  content.channels.intensity = std::span(full.intensity).first(5);
  CHECK(encode(content).empty());
  content = full.content();
  content.channels.time_s = std::span(full.time_s).first(5);
  CHECK(encode(content).empty());
  std::vector<float> times = full.time_s;
  times[8] = nan_f;
  content.channels.time_s = times;
  CHECK(encode(content).empty());
  content = full.content();
  content.channels.seen_from = Point{0, inf_f, 0};
  CHECK(encode(content).empty());
  content = full.content();
  const std::vector<std::byte> long_signature(1025);
  content.channels.signature = long_signature;
  CHECK(encode(content).empty());
  content.channels.signature = std::span(long_signature).first(1024);
  CHECK_FALSE(encode(content).empty());
  content.points = {};
  CHECK(encode_stored_scan(box, content, buffer) == 0);
}

TEST_CASE("every field of a record that cannot be is named") {
  const Full full;
  const std::size_t n = full.points.size();
  const std::vector<std::byte> good = encode(full.content());
  REQUIRE(parse(good) == StoredScanFault::none);
  const auto with = [&](std::size_t at, std::uint32_t value, std::size_t bytes = 4) {
    std::vector<std::byte> record = good;
    put(record, at, value, bytes);
    return parse(record);
  };
  const auto with_float = [&](std::size_t at, float value) {
    std::vector<std::byte> record = good;
    put_float(record, at, value);
    return parse(record);
  };
  for (std::size_t bytes = 0; bytes < good.size(); bytes += bytes < 60 ? 1 : 97) {
    CAPTURE(bytes);
    CHECK(parse(std::span(good).first(bytes)) == StoredScanFault::too_short);
  }
  std::vector<std::byte> longer = good;
  longer.push_back(std::byte{0});
  CHECK(parse(longer) == StoredScanFault::wrong_length);
  put(longer, 4, static_cast<std::uint32_t>(longer.size()));
  CHECK(parse(longer) == StoredScanFault::wrong_length);
  CHECK(with(0, 2, 2) == StoredScanFault::other_version);
  CHECK(with(0, 0, 2) == StoredScanFault::other_version);
  CHECK(with(2, 0, 2) == StoredScanFault::wrong_length);  // blocks that nobody named
  CHECK(with(2, 0x1E, 2) == StoredScanFault::wrong_blocks);
  CHECK(with(2, 0x3F, 2) == StoredScanFault::too_short);  // a block that is not there
  CHECK(with(8, 0) == StoredScanFault::no_points);
  CHECK(with(8, 0xFFFFFFFF) == StoredScanFault::too_short);
  CHECK(with(8, static_cast<std::uint32_t>(n) - 1) != StoredScanFault::none);
  CHECK(with(8, static_cast<std::uint32_t>(n) + 1) != StoredScanFault::none);
  for (const float value : {nan_f, inf_f, -inf_f}) {
    for (std::size_t at = 12; at < 40; at += 4)
      CHECK(with_float(at, value) == StoredScanFault::box_not_finite);
  }
  for (const std::size_t at : {12U, 28U, 32U, 36U})
    CHECK(with_float(at, -1) == StoredScanFault::box_not_finite);
  for (const std::size_t at : {28U, 32U, 36U})
    CHECK(with_float(at, 3e38F) == StoredScanFault::box_not_finite);  // the far corner
  const std::size_t samples = block_at(good, n, 0);
  CHECK(with(samples, static_cast<std::uint32_t>(n)) == StoredScanFault::sample_without_point);
  CHECK(with(samples + 8 * 99, 0xFFFFFFFF) == StoredScanFault::sample_without_point);
  const std::size_t intensity = block_at(good, n, 1);
  CHECK(with(intensity - 4, static_cast<std::uint32_t>(n) - 1) == StoredScanFault::wrong_block_size);
  const std::size_t time = block_at(good, n, 2);
  CHECK(with(time - 4, static_cast<std::uint32_t>(2 * n)) == StoredScanFault::wrong_block_size);
  CHECK(with(time - 4, 4) == StoredScanFault::wrong_block_size);
  CHECK(with_float(time, nan_f) == StoredScanFault::time_not_finite);
  CHECK(with_float(time + 4, inf_f) == StoredScanFault::time_not_finite);
  CHECK(with_float(time + 4, -1) == StoredScanFault::time_not_finite);
  const std::size_t signature = block_at(good, n, 3);
  CHECK(with(signature - 4, 0) == StoredScanFault::wrong_block_size);
  const std::size_t seen_from = block_at(good, n, 4);
  CHECK(with(seen_from - 4, 11) == StoredScanFault::wrong_block_size);
  CHECK(with_float(seen_from + 8, nan_f) == StoredScanFault::seen_from_not_finite);
}

TEST_CASE("a channel of a later alces is passed over, and the rest is read") {
  const Full full;
  std::vector<std::byte> record = encode(full.content());
  const double sum = [&] {
    StoredScanView view;
    REQUIRE(StoredScanView::parse(record, view) == StoredScanFault::none);
    return sum_of(view);
  }();
  for (const int byte : {9, 0, 3, 0, 5, 0, 0, 0, 1, 2, 3, 4, 5})
    record.push_back(static_cast<std::byte>(byte));
  put(record, 2, 0x1F | 1U << 9, 2);
  put(record, 4, static_cast<std::uint32_t>(record.size()));
  StoredScanView view;
  REQUIRE(StoredScanView::parse(record, view) == StoredScanFault::none);
  CHECK(sum_of(view) == sum);
  put(record, block_at(record, full.points.size(), 1) - 6, 2, 2);  // a later version of the intensities
  REQUIRE(StoredScanView::parse(record, view) == StoredScanFault::none);
  CHECK_FALSE(view.has_intensity());
  CHECK(view.has_time());
}

TEST_CASE("a record of random bytes is refused, or what it shows is sound") {
  const Full full;
  const std::vector<std::byte> good = encode(full.content());
  sim::Random random(11);
  std::size_t sound = 0;
  for (int round = 0; round < 3000; ++round) {
    std::vector<std::byte> record = good;
    const std::size_t reach = round % 2 == 0 ? 60 : record.size();
    for (int flips = 0; flips < 1 + round % 4; ++flips)
      record[static_cast<std::size_t>(random.next() % reach)] = static_cast<std::byte>(random.next());
    if (round % 5 == 0) record.resize(static_cast<std::size_t>(random.next() % record.size()));
    StoredScanView view;
    if (StoredScanView::parse(record, view) == StoredScanFault::none) {
      (void)sum_of(view);
      ++sound;
    } else {
      REQUIRE(view.point_count() == 0);
    }
  }
  CHECK(sound > 100);
}
