#include "alces/scan_store.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "alces/scan_signature.h"
#include "support/in_block.h"
#include "support/memory_archive.h"
#include "support/plain_scene.h"

using namespace alces;
using namespace alces::test;

namespace {

ScanStoreConfig config_with(std::size_t pool_bytes, std::uint32_t slots) {
  ScanStoreConfig config;
  config.scan_capacity = 20;
  config.point_capacity = 2000;
  config.pool_bytes = pool_bytes;
  config.cache_slots = slots;
  config.surface.sample_capacity = 300;
  return config;
}

std::vector<std::vector<Point>> scans(std::size_t count) {
  std::vector<std::vector<Point>> result;
  for (std::size_t i = 0; i < count; ++i) {
    result.push_back(street().scan(pose_at(static_cast<double>(i), 0, 1, 30.0 * static_cast<double>(i)),
                                   500 + 100 * i, 25, 0.01, i));
  }
  return result;
}

struct Loaded {
  std::vector<Point> points;
  std::vector<SurfaceSample> samples;
};

Loaded load(ScanStore& store, std::uint32_t scan) {
  StoredScan stored;
  Loaded loaded;
  REQUIRE(store.load(scan, stored) == Status::ok);
  for (std::uint32_t i = 0; i < stored.tree->size(); ++i) loaded.points.push_back(stored.tree->point(i));
  loaded.samples.assign(stored.samples.begin(), stored.samples.end());
  return loaded;
}

bool is_same(const Loaded& a, const Loaded& b) {
  return a.points.size() == b.points.size() && a.samples.size() == b.samples.size() &&
         std::memcmp(a.points.data(), b.points.data(), a.points.size() * sizeof(Point)) == 0 &&
         std::memcmp(a.samples.data(), b.samples.data(), a.samples.size() * sizeof(SurfaceSample)) == 0;
}

}  // namespace

TEST_CASE("a stored point lies within half a step of where it was") {
  const auto all = scans(5);
  InBlock<ScanStore> store(config_with(1 << 20, 4));
  for (const auto& scan : all) REQUIRE(store->add(scan) == Status::ok);
  for (std::uint32_t s = 0; s < all.size(); ++s) {
    Eigen::Vector3d low = as_vector(all[s][0]);
    Eigen::Vector3d high = low;
    for (const Point& p : all[s]) {
      low = low.cwiseMin(as_vector(p));
      high = high.cwiseMax(as_vector(p));
    }
    const Eigen::Vector3d half_step = (high - low) / 65535 / 2;
    const Loaded loaded = load(*store, s);
    REQUIRE(loaded.points.size() == all[s].size());
    CHECK(store->point_count(s) == all[s].size());
    // nearest original of each: the order is the tree's
    std::size_t wrong = 0;
    for (const Point& p : loaded.points) {
      const bool is_found = std::ranges::any_of(all[s], [&](const Point& original) {
        const Eigen::Vector3d error = (as_vector(p) - as_vector(original)).cwiseAbs();
        return (error.array() <= half_step.array() + 5e-6).all();  // and the rounding of floats at 25 m
      });
      if (!is_found) ++wrong;
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("a stored normal keeps its direction, and a sample its point and roughness") {
  const auto all = scans(1);
  const ScanStoreConfig config = config_with(1 << 20, 2);
  InBlock<ScanStore> store(config);
  REQUIRE(store->add(all[0]) == Status::ok);
  StoredScan stored;
  REQUIRE(store->load(0, stored) == Status::ok);
  std::vector<SurfaceSample> exact(config.surface.sample_capacity);
  exact.resize(sample_surface(*stored.tree, config.surface, stored.spacing, exact));
  REQUIRE(exact.size() == stored.samples.size());
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    if (exact[i].index != stored.samples[i].index) ++wrong;
    if (std::abs(exact[i].roughness - stored.samples[i].roughness) > 0.5F / 255 + 1e-6F) ++wrong;
    const Eigen::Vector3d a = Eigen::Map<const Eigen::Vector3f>(exact[i].normal).cast<double>();
    const Eigen::Vector3d b = Eigen::Map<const Eigen::Vector3f>(stored.samples[i].normal).cast<double>();
    if (a.isZero(0)) continue;  // without a plane: nobody looks at it
    if (std::abs(b.norm() - 1) > 1e-5) ++wrong;
    if (a.cross(b).norm() > 0.001 || a.dot(b) < 0) ++wrong;
  }
  CHECK(wrong == 0);
}

TEST_CASE("pool, archive or a cache of two slots: what is loaded is the same to the bit") {
  const auto all = scans(8);
  InBlock<ScanStore> in_pool(config_with(1 << 20, 16));
  InBlock<ScanStore> in_archive(config_with(0, 16));
  InBlock<ScanStore> mixed(config_with(20000, 2));
  MemoryArchive archive;
  MemoryArchive mixed_archive;
  in_archive->set_archive(&archive);
  mixed->set_archive(&mixed_archive);
  for (const auto& scan : all) {
    REQUIRE(in_pool->add(scan) == Status::ok);
    REQUIRE(in_archive->add(scan) == Status::ok);
    REQUIRE(mixed->add(scan) == Status::ok);
  }
  CHECK(in_pool->counters().archived_scans == 0);
  CHECK(in_archive->counters().archived_scans == 8);
  CHECK(in_archive->counters().pool_bytes == 0);
  CHECK(mixed->counters().archived_scans > 0);
  CHECK(mixed->counters().archived_scans < 8);
  CHECK(mixed->counters().pool_bytes <= 20000);
  std::uint64_t archived_bytes = 0;
  for (const auto& [scan, record] : archive.records) archived_bytes += record.size();
  CHECK(in_archive->counters().archive_bytes == archived_bytes);
  CHECK(in_pool->counters().pool_bytes == archived_bytes);
  for (const std::uint32_t scan : {0U, 7U, 3U, 3U, 5U, 1U, 7U, 0U, 2U, 6U, 4U}) {
    const Loaded expected = load(*in_pool, scan);
    CHECK(is_same(expected, load(*in_archive, scan)));
    CHECK(is_same(expected, load(*mixed, scan)));
  }
  CHECK(in_pool->counters().slot_misses == 0);
  CHECK(mixed->counters().slot_misses > 0);
  CHECK(mixed->counters().slot_misses + mixed->counters().slot_hits == 11);
  std::uint64_t points = 0;
  for (const auto& scan : all) points += scan.size();
  CHECK(in_pool->counters().points == points);
}

TEST_CASE("without room and without an archive a scan is refused, and those before stay") {
  const auto all = scans(3);
  InBlock<ScanStore> store(config_with(8000, 4));
  REQUIRE(store->add(all[0]) == Status::ok);
  const Loaded before = load(*store, 0);
  CHECK(store->add(all[1]) == Status::no_point_capacity);
  CHECK(store->scan_count() == 1);
  CHECK(is_same(before, load(*store, 0)));
  StoredScan stored;
  CHECK(store->load(1, stored) == Status::no_such_scan);
  const std::vector<Point> small(all[2].begin(), all[2].begin() + 50);
  CHECK(store->add(small) == Status::ok);
  CHECK(store->scan_count() == 2);
  CHECK(load(*store, 1).points.size() == 50);
}

TEST_CASE("an archive that fails costs the scan, not the store") {
  const auto all = scans(4);
  InBlock<ScanStore> store(config_with(0, 1));
  MemoryArchive archive;
  store->set_archive(&archive);
  REQUIRE(store->add(all[0]) == Status::ok);
  const Loaded zero = load(*store, 0);
  archive.write_fails = true;
  CHECK(store->add(all[1]) == Status::archive_write_failed);
  CHECK(store->scan_count() == 1);
  CHECK(store->counters().archived_scans == 1);
  archive.write_fails = false;
  CHECK(is_same(zero, load(*store, 0)));
  REQUIRE(store->add(all[2]) == Status::ok);
  const Loaded one = load(*store, 1);
  CHECK(one.points.size() == all[2].size());

  StoredScan stored;
  archive.read_fails = true;
  CHECK(store->load(0, stored) == Status::archive_read_failed);
  CHECK(store->load(0, stored) == Status::archive_read_failed);
  archive.read_fails = false;
  CHECK(is_same(zero, load(*store, 0)));
  CHECK(is_same(one, load(*store, 1)));
  store->set_archive(nullptr);
  CHECK(store->load(0, stored) == Status::archive_read_failed);
}

TEST_CASE("an archive that hands back rubbish is noticed or harmless, and the next read is good again") {
  const auto all = scans(2);
  InBlock<ScanStore> store(config_with(0, 1));
  MemoryArchive archive;
  store->set_archive(&archive);
  REQUIRE(store->add(all[0]) == Status::ok);
  REQUIRE(store->add(all[1]) == Status::ok);
  const Loaded zero = load(*store, 0);
  const std::vector<std::byte> good = archive.records[0];
  StoredScan stored;
  (void)load(*store, 1);

  const auto with_float = [&](std::size_t at, float value) {
    archive.records[0] = good;
    std::memcpy(archive.records[0].data() + at, &value, sizeof value);
  };
  for (std::size_t at = 16; at < 40; at += 4) {  // the box
    with_float(at, std::numeric_limits<float>::quiet_NaN());
    CHECK(store->load(0, stored) == Status::archive_read_failed);
    with_float(at, std::numeric_limits<float>::infinity());
    CHECK(store->load(0, stored) == Status::archive_read_failed);
  }
  archive.records[0] = good;
  const std::uint32_t no_such_point = 0xFFFFFFF0U;
  std::memcpy(archive.records[0].data() + 40 + 6 * all[0].size() + 8, &no_such_point, 4);
  CHECK(store->load(0, stored) == Status::archive_read_failed);

  sim::Random random(1);
  for (int round = 0; round < 200; ++round) {
    archive.records[0] = good;
    for (int flips = 0; flips < 20; ++flips) {
      archive.records[0][static_cast<std::size_t>(random.next() % good.size())] =
          static_cast<std::byte>(random.next());
    }
    const Status status = store->load(0, stored);
    if (status == Status::ok) {
      for (const SurfaceSample& sample : stored.samples) REQUIRE(sample.index < stored.tree->size());
      (void)stored.tree->nearest({1, 2, 3}, 100.0F);
    } else {
      REQUIRE(status == Status::archive_read_failed);
    }
    (void)load(*store, 1);  // out of the only slot
  }
  archive.records[0] = good;
  CHECK(is_same(zero, load(*store, 0)));
}

TEST_CASE("a scan's channels are stored with the points that they belong to") {
  const std::vector<Point> scan = scans(1)[0];
  std::vector<std::uint8_t> intensity;
  std::vector<float> time_s;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    intensity.push_back(static_cast<std::uint8_t>(i % 251));
    time_s.push_back(0.001F * static_cast<float>(i));
  }
  const std::vector<std::byte> signature(100, std::byte{42});
  ScanStoreConfig config = config_with(1 << 20, 2);
  const ScanChannels channels{intensity, time_s, signature, 3, Point{1, 2, 3}};
  {
    InBlock<ScanStore> store(config);
    CHECK(store->add(scan, 0.1F, channels) == Status::bad_channel);  // no room was configured
    CHECK(store->scan_count() == 0);
    CHECK(store->add(scan, 0.1F) == Status::ok);
  }
  config.channels = {true, true, 100};
  config.point_capacity = static_cast<std::uint32_t>(scan.size());
  for (const bool is_archived : {false, true}) {
    config.pool_bytes = is_archived ? 0 : std::size_t{1} << 20;
    InBlock<ScanStore> store(config);
    MemoryArchive archive;
    store->set_archive(&archive);
    ScanChannels short_channels = channels;
    short_channels.time_s = channels.time_s.first(3);
    CHECK(store->add(scan, 0.1F, short_channels) == Status::bad_channel);
    REQUIRE(store->add(scan, 0.1F, channels) == Status::ok);
    std::span<const std::byte> record;
    CHECK(store->read_record(1, record) == Status::no_such_scan);
    REQUIRE(store->read_record(0, record) == Status::ok);
    StoredScanView view;
    REQUIRE(StoredScanView::parse(record, view) == StoredScanFault::none);
    CHECK(view.cell_size_m() == 0.1F);
    CHECK(view.signature().size() == 100);
    CHECK(view.seen_from()->z == 3);
    const StoredScanBox box(scan);
    std::size_t wrong = 0;
    for (std::uint32_t i = 0; i < view.point_count(); ++i) {
      const auto original = static_cast<std::size_t>(std::lround(view.time_s(i) * 1000));
      const Point expected = box.round(scan[original]);
      const Point got = view.point(i);
      if (std::memcmp(&expected, &got, sizeof got) != 0) ++wrong;
      if (view.intensity(i) != intensity[original]) ++wrong;
    }
    CHECK(wrong == 0);
    const Loaded loaded = load(*store, 0);
    CHECK(loaded.samples.size() == view.sample_count());
  }
}

TEST_CASE("capacities of scans and points are kept") {
  ScanStoreConfig config = config_with(1 << 20, 2);
  config.scan_capacity = 3;
  InBlock<ScanStore> store(config);
  const std::vector<Point> few = scans(1)[0];
  CHECK(store->add({}) == Status::empty_scan);
  const std::vector<Point> too_many(2001, Point{1, 2, 3});
  CHECK(store->add(too_many) == Status::no_point_capacity);
  CHECK(store->add(std::span(too_many).first(2000)) == Status::ok);
  CHECK(store->add(few) == Status::ok);
  CHECK(store->add(few) == Status::ok);
  CHECK(store->add(few) == Status::no_scan_capacity);
  CHECK(store->scan_count() == 3);
  const Loaded duplicates = load(*store, 0);
  CHECK(duplicates.points.size() == 2000);
  CHECK(duplicates.points[1234].z == 3);
}

TEST_CASE("one point, and points on a plane or a line, are stored as they are") {
  InBlock<ScanStore> store(config_with(1 << 20, 2));
  REQUIRE(store->add(std::vector<Point>{{1.5F, -2, 1e4F}}) == Status::ok);
  std::vector<Point> line;
  for (int i = 0; i < 100; ++i) line.push_back({static_cast<float>(i), 2, 3});
  REQUIRE(store->add(line) == Status::ok);
  const Loaded one = load(*store, 0);
  REQUIRE(one.points.size() == 1);
  CHECK(one.points[0].x == 1.5F);
  CHECK(one.points[0].z == 1e4F);
  for (const Point& p : load(*store, 1).points) {
    CHECK(p.y == 2);
    CHECK(p.z == 3);
  }
}

TEST_CASE(
    "a record has the signature that its scan was stored with, wherever it lies, and none where there was "
    "none") {
  const auto all = scans(6);
  ScanStoreConfig config = config_with(30000, 2);
  config.channels.signature_bytes = ScanSignature::stored_bytes;
  InBlock<ScanStore> store(config);
  MemoryArchive archive;
  store->set_archive(&archive);
  const auto is_signed = [](std::uint32_t scan) { return scan != 3; };
  for (std::uint32_t i = 0; i < all.size(); ++i) {
    std::array<std::byte, ScanSignature::stored_bytes> bytes;
    ScanSignature::of(all[i]).write(bytes);
    ScanChannels channels;
    if (is_signed(i)) channels.signature = bytes;
    channels.signature_version = ScanSignature::version;
    REQUIRE(store->add(all[i], 0.1F, channels) == Status::ok);
  }
  REQUIRE(store->counters().archived_scans > 0);
  REQUIRE(store->counters().archived_scans < all.size());
  for (std::uint32_t i = 0; i < all.size(); ++i) {
    CAPTURE(i);
    std::span<const std::byte> record;
    REQUIRE(store->read_record(i, record) == Status::ok);
    StoredScanView view;
    REQUIRE(StoredScanView::parse(record, view) == StoredScanFault::none);
    ScanSignature signature;
    CHECK(signature.read(view.signature(), view.signature_version()) == is_signed(i));
    CHECK(signature.likeness(ScanSignature::of(all[i])) == (is_signed(i) ? 1.0F : 0.0F));
  }
}
