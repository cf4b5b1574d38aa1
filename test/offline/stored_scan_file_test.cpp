#include "offline/io/map_folder/stored_scan_file.h"

#include <catch2/catch.hpp>
#include <cstring>
#include <nlohmann/json.hpp>

#include "offline/io/map_folder/map_folder.h"
#include "offline/io/map_folder/trajectory.h"
#include "room.h"
#include "run_alces.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace fs = std::filesystem;

namespace {

std::vector<std::byte> record_of(std::size_t scan, const ScanChannels& channels = {}) {
  const std::vector<Point> points = scan_room(scan, 200);
  const std::vector<SurfaceSample> samples = {{3, {0, 0, 1}, 0.1F}, {150, {1, 0, 0}, 0.2F}};
  StoredScanContent content;
  content.points = points;
  content.cell_size_m = 0.1F;
  content.samples = samples;
  content.channels = channels;
  std::vector<std::byte> record(10'000);
  record.resize(encode_stored_scan(StoredScanBox(points), content, record));
  REQUIRE_FALSE(record.empty());
  return record;
}

fs::path write_three(const TemporaryFolder& folder) {
  const fs::path file = folder / "scans.alces";
  StoredScanWriter writer(file, 3);
  for (std::size_t i = 0; i < 3; ++i) writer.add(10 * i, record_of(i));
  writer.finish();
  return file;
}

/// What is said of the file with these bytes, reading all of it.
std::string complaint(const TemporaryFolder& folder, const std::string& bytes) {
  const fs::path path = folder.write("changed.alces", bytes);
  try {
    StoredScanFile file(path);
    for (std::size_t row = 0; row < file.size(); ++row) (void)file.read(row);
  } catch (const InputError& error) {
    CHECK_THAT(error.what(), Contains(path.string()));
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a file of stored scans gives back records, numbers and channels") {
  const TemporaryFolder folder;
  const std::vector<std::uint8_t> intensity(200, 77);
  const std::vector<float> time_s(200, 0.25F);
  const std::vector<std::byte> signature(64, std::byte{9});
  const std::vector<std::byte> bare = record_of(0);
  const std::vector<std::byte> full = record_of(1, {intensity, time_s, signature, 2, Point{0, 0, 1}});
  StoredScanWriter writer(folder / "scans.alces", 2);
  writer.add(5, bare);
  writer.add(1ULL << 40, full);
  CHECK_FALSE(fs::exists(folder / "scans.alces"));  // before it is whole
  writer.finish();
  StoredScanFile file(folder / "scans.alces");
  REQUIRE(file.size() == 2);
  CHECK(file.number(0) == 5);
  CHECK(file.number(1) == 1ULL << 40);
  CHECK(file.read(1).intensity(199) == 77);
  CHECK(file.read(1).time_s(3) == 0.25F);
  CHECK(file.read(1).signature_version() == 2);
  REQUIRE(file.read(1).seen_from());
  CHECK(file.read(0).point_count() == 200);
  CHECK_FALSE(file.read(0).has_time());
  CHECK(fs::file_size(folder / "scans.alces") == 3 * 24 + bare.size() + full.size());
}

TEST_CASE("whichever byte of a file of stored scans is wrong, it is said where, and never taken") {
  const TemporaryFolder folder;
  const std::string good = content_of(write_three(folder));
  CHECK(complaint(folder, good).empty());
  const std::size_t record_bytes = record_of(0).size();
  std::size_t unnoticed = 0;
  for (std::size_t at = 0; at < good.size(); at += at < 80 ? 1 : 13) {
    std::string changed = good;
    changed[at] = static_cast<char>(changed[at] ^ 0x10);
    if (complaint(folder, changed).empty()) ++unnoticed;
  }
  CHECK(unnoticed == 0);
  std::size_t accepted = 0;
  for (std::size_t bytes = 0; bytes < good.size(); bytes += bytes < 80 ? 1 : 17) {
    if (complaint(folder, good.substr(0, bytes)).empty()) ++accepted;
  }
  CHECK(accepted == 0);

  const auto flipped = [&](std::size_t at) {
    std::string changed = good;
    changed[at] = static_cast<char>(changed[at] ^ 1);
    return complaint(folder, changed);
  };
  CHECK_THAT(flipped(3), Contains("no file of stored scans"));
  CHECK_THAT(flipped(12), Contains("checksum of its header"));
  CHECK_THAT(flipped(24 + 5), Contains("scan 0 of 3 at byte 24: the checksum of its head"));
  CHECK_THAT(flipped(24 + record_bytes + 24 + 24 + 7),
             Contains("scan 1 of 3 at byte " + std::to_string(24 + record_bytes + 48) + ": its checksum"));
  CHECK_THAT(complaint(folder, good.substr(0, good.size() - 1)), Contains("ends within scan 2 of 3"));
  CHECK_THAT(complaint(folder, good.substr(0, good.size() - record_bytes - 24)),
             Contains("ends before scan 2 of 3"));
  CHECK_THAT(complaint(folder, good + "x"), Contains("1 bytes behind its last scan"));
  CHECK_THAT(complaint(folder, ""), Contains("less than a header"));
  CHECK_THROWS_AS(StoredScanFile(folder / "none"), InputError);
}

TEST_CASE("a record that is wrong from the beginning is named although its checksum holds") {
  const TemporaryFolder folder;
  std::vector<std::byte> record = record_of(0);
  record[8] = record[9] = std::byte{0};  // no points
  StoredScanWriter writer(folder / "scans.alces", 1);
  writer.add(0, record);
  writer.finish();
  CHECK_THAT(complaint(folder, content_of(folder / "scans.alces")),
             Contains("scan 0 of 1 at byte 48: it has no points"));
}

TEST_CASE("a map folder holds the map's scans, better poses keep them, and info checks them") {
  const TemporaryFolder folder;
  for (std::size_t i = 0; i < 6; ++i) folder.write("scans/scan00" + std::to_string(i) + ".3d", room_3d(i));
  folder.write("tiny.toml", "[memory]\npool_bytes = 30000\n");
  std::string in_pool;
  for (const std::string more : {"", " --config tiny.toml"}) {  // all in the pool; most in the archive
    REQUIRE(run_alces(folder, "map scans --out map" + more).status == 0);
    StoredScanFile file(folder / "map/scans.alces");
    REQUIRE(file.size() == 6);
    const nlohmann::json run = nlohmann::json::parse(content_of(folder / "map/run.json"));
    std::uint64_t points = 0;
    for (std::size_t row = 0; row < 6; ++row) {
      CHECK(file.number(row) == row);
      points += file.read(row).point_count();
      CHECK(file.read(row).sample_count() > 100);
      CHECK(file.read(row).cell_size_m() == 0.1F);
    }
    CHECK(run["counters"]["points_stored"] == points);
    CHECK((run["counters"]["scans_archived"] > 0) == !more.empty());
    if (more.empty()) in_pool = content_of(folder / "map/scans.alces");
  }
  const std::string stored = content_of(folder / "map/scans.alces");
  CHECK(stored == in_pool);

  REQUIRE(run_alces(folder, "optimize map --out better").status == 0);
  CHECK(content_of(folder / "better/scans.alces") == stored);

  const nlohmann::json info = nlohmann::json::parse(run_alces(folder, "info better --json").out);
  CHECK(info["scans.alces"]["scans"] == 6);
  CHECK(info["scans.alces"]["bytes"] == stored.size());
  CHECK(info["scans.alces"]["coarsest_cell_m"] == 0.1);

  std::string changed = stored;
  changed[stored.size() / 2] = static_cast<char>(changed[stored.size() / 2] ^ 4);
  folder.write("map/scans.alces", changed);
  const ProgramOutcome outcome = run_alces(folder, "info map");
  CHECK(outcome.status == 3);
  CHECK_THAT(outcome.err, Contains("map/scans.alces: scan ") && Contains("its checksum differs"));
  CHECK(is_one_sentence(outcome.err));
  folder.write("map/scans.alces", content_of(write_three(folder)));
  CHECK_THAT(run_alces(folder, "info map").err, Contains("holds 3 scans, and trajectory.tum 6 poses"));
}
