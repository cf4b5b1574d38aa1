#include <array>
#include <catch2/catch.hpp>
#include <cstring>
#include <filesystem>
#include <vector>

#include "alces_platform/settings/mapper_settings.h"
#include "offline/io/map_folder/file_archive.h"
#include "offline/map/map_run.h"
#include "offline/map/mapper_settings.h"
#include "room.h"
#include "temporary_folder.h"

using namespace alces;
using namespace alces::offline;
using Catch::Contains;

namespace {

std::size_t fixed_bytes(const MapRequest& request, std::uint32_t scans) {
  MapperConfig config = request.config;
  config.scan_capacity = scans;
  config.pool_bytes = 0;
  return Mapper::memory_required(config);
}

std::vector<std::byte> record(std::size_t bytes, int fill) {
  return std::vector<std::byte>(bytes, static_cast<std::byte>(fill));
}

/// A room seen by a scanner whose scans grow, one to the next; some of them do not fit the usual table.
class DenseRoom final : public RoomSource {
 public:
  explicit DenseRoom(std::size_t size) : RoomSource(size) {}
  [[nodiscard]] static std::size_t points_of(std::size_t index) { return 20'000 + 20'000 * index; }
  bool read(std::size_t index, ScanPoints& scan) override {
    ++reads;
    scan.points = scan_room(index, points_of(index));
    return true;
  }
  [[nodiscard]] std::uint64_t file_bytes(std::size_t index) const override { return 12 * points_of(index); }
  std::size_t reads = 0;
};

MapRequest dense_request(std::size_t memory_bytes) {
  MapRequest request = small_request();
  request.config.voxel.cell_capacity = 0;
  request.memory_bytes = memory_bytes;
  return request;
}

}  // namespace

TEST_CASE("the voxel table is sized by the fullest scan") {
  DenseRoom scans(4);
  MapRun run(scans, dense_request(std::size_t{64} << 20));
  CHECK(scans.reads == 3);  // those of 40,000 points and more
  const std::uint32_t capacity = run.mapper().config().voxel.cell_capacity;
  CHECK(capacity > settings::usual_cell_capacity);
  run.run();
  REQUIRE_FALSE(run.problem());
  CHECK(run.thinned_scans() == 0);
  CHECK(run.warnings().empty());
  CHECK(run.coarsest_cell_m() == 0.1);
  CHECK(run.mapped().back().kept_points <= capacity);
  CHECK(run.mapped().back().kept_points + 1024 > capacity);
}

TEST_CASE("where the memory is too small for the fullest scan's cells, they grow, and it is said") {
  DenseRoom scans(4);
  MapRun run(scans, dense_request(std::size_t{16} << 20));
  CHECK(run.memory().block_bytes <= std::size_t{16} << 20);
  run.run();
  REQUIRE_FALSE(run.problem());
  REQUIRE(run.mapped().size() == 4);
  CHECK(run.thinned_scans() >= 1);
  CHECK(run.thinned_scans() < 4);
  CHECK(run.coarsest_cell_m() == 0.2);
  REQUIRE(run.warnings().size() == 1);
  CHECK_THAT(run.warnings()[0], Contains("thinned coarser") && Contains("cell of 0.2 m"));
  CHECK(run.mapper().counters().points_without_cell == 0);
}

TEST_CASE("scans that cannot be more than the usual table holds are not read to size it") {
  DenseRoom scans(1);
  MapperConfig config = dense_request(1).config;
  config.scan_capacity = 1;
  fit_cell_capacity(config, std::size_t{64} << 20, scans);
  CHECK(scans.reads == 1);  // the largest
  CHECK(config.voxel.cell_capacity == settings::usual_cell_capacity);
  RoomSource once(5);  // of a drive nobody knows how large scans will be
  config.voxel.cell_capacity = 0;
  fit_cell_capacity(config, std::size_t{64} << 20, once);
  CHECK(config.voxel.cell_capacity == settings::usual_cell_capacity);
}

TEST_CASE("the plan adds up to one block within the limit") {
  MapperConfig config = small_request().config;
  config.scan_capacity = 1000;
  const std::size_t limit_bytes = std::size_t{8} << 20;
  const MemoryPlan plan = plan_memory(config, limit_bytes);
  CHECK(plan.block_bytes <= limit_bytes);
  CHECK(plan.block_bytes + 64 > limit_bytes);
  CHECK(plan.block_bytes == Mapper::memory_required(config));
  CHECK(plan.block_bytes == plan.pool_bytes + plan.scans_bytes + plan.cache_bytes + plan.working_bytes);
  CHECK(plan.pool_bytes == config.pool_bytes);
}

TEST_CASE("a pool is no larger than the scans can fill it") {
  MapperConfig config = small_request().config;
  config.scan_capacity = 10;
  CHECK(plan_memory(config, std::size_t{1} << 40).block_bytes < std::size_t{8} << 20);
}

TEST_CASE("16 MiB are enough for the defaults and 469 scans") {
  MapperConfig config = default_settings(FrontEnd::standard);
  config.scan_capacity = 469;
  CHECK(plan_memory(config, std::size_t{16} << 20).block_bytes <= std::size_t{16} << 20);
}

TEST_CASE("too little memory: the least that is needed is stated, and is enough") {
  MapperConfig config = small_request().config;
  config.scan_capacity = 100;
  std::string sentence;
  try {
    (void)plan_memory(config, 10000);
  } catch (const CapacityError& error) {
    sentence = error.what();
    CHECK(error.exit_status() == 4);
  }
  const std::size_t at = sentence.find("--memory '");
  REQUIRE(at != std::string::npos);
  const std::size_t kib = std::stoul(sentence.substr(at + 10));
  CHECK_NOTHROW(plan_memory(config, kib * 1024));
  config.pool_bytes = 0;
  CHECK_THROWS_AS(plan_memory(config, (kib - 1) * 1024), CapacityError);
}

TEST_CASE("with scans in an archive the poses are the same to the last bit") {
  constexpr std::size_t count = 12;
  MapRequest roomy = small_request();
  RoomSource source(count);
  MapRun in_pool(source, roomy);
  in_pool.run();
  REQUIRE_FALSE(in_pool.problem());

  const TemporaryFolder folder;
  MapRequest tight = small_request();
  tight.memory_bytes = fixed_bytes(tight, count) + 30000;  // one scan
  tight.archive = folder / "scans.archive";
  MapRun archived(source, tight);
  archived.run();
  REQUIRE_FALSE(archived.problem());
  CHECK(archived.memory().block_bytes <= tight.memory_bytes);
  CHECK(archived.mapper().store_counters().archived_scans >= count - 2);
  CHECK(in_pool.mapper().store_counters().archived_scans == 0);
  REQUIRE(archived.mapper().scan_count() == count);
  const auto poses = in_pool.mapper().graph().poses();
  const auto archived_poses = archived.mapper().graph().poses();
  for (std::size_t i = 0; i < count; ++i) {
    CHECK(poses[i].translation_m == archived_poses[i].translation_m);
    CHECK(poses[i].rotation.coeffs() == archived_poses[i].rotation.coeffs());
  }
}

TEST_CASE("a full pool without an archive ends the map with what to give instead") {
  MapRequest request = small_request();
  request.memory_bytes = fixed_bytes(request, 12) + 100000;
  RoomSource source(12);
  MapRun run(source, request);
  run.run();
  REQUIRE(run.problem());
  CHECK(run.problem()->exit_status() == 4);
  CHECK_THAT(run.problem()->what(), Contains("point pool") && Contains("--memory of about") &&
                                        Contains("--archive FILE") && Contains("synthetic"));
  CHECK(run.mapper().scan_count() > 0);
  CHECK(run.mapper().scan_count() < 12);
  CHECK(run.trajectory().size() == run.mapper().scan_count());
}

TEST_CASE("an archive gives back what it was given") {
  const TemporaryFolder folder;
  FileArchive archive(folder / "a", 10);
  REQUIRE(archive.write(3, record(1000, 3)));
  REQUIRE(archive.write(7, record(10, 7)));
  std::vector<std::byte> back(1000);
  REQUIRE(archive.read(3, back));
  CHECK(back == record(1000, 3));
  back.resize(10);
  REQUIRE(archive.read(7, back));
  CHECK(back == record(10, 7));
  CHECK(archive.problem().empty());
}

TEST_CASE("an archive says no to scans it does not have, sizes that differ and an order that is none") {
  const TemporaryFolder folder;
  FileArchive archive(folder / "a", 10);
  REQUIRE(archive.write(3, record(1000, 3)));
  std::vector<std::byte> back(999);
  CHECK_FALSE(archive.read(3, back));
  CHECK_FALSE(archive.read(4, back));
  CHECK_FALSE(archive.write(3, record(1000, 3)));
  CHECK_THAT(archive.problem(), Contains((folder / "a").string()));
}

TEST_CASE("an archive that was cut off is noticed") {
  const TemporaryFolder folder;
  FileArchive archive(folder / "a", 10);
  REQUIRE(archive.write(0, record(1000, 1)));
  std::filesystem::resize_file(folder / "a", 500);
  std::vector<std::byte> back(1000);
  CHECK_FALSE(archive.read(0, back));
  CHECK_THAT(archive.problem(), Contains("scan 0: the file ends within a scan"));
}

TEST_CASE("an archive replaces an older archive, but no other file") {
  const TemporaryFolder folder;
  { FileArchive archive(folder / "a", 1); }
  CHECK_NOTHROW(FileArchive(folder / "a", 1));
  const auto precious = folder.write("precious.pcd", "years of work");
  CHECK_THROWS_WITH(FileArchive(precious, 1), Contains("not overwritten"));
  CHECK(content_of(precious) == "years of work");
}

TEST_CASE("an archive on a full disk, or where nothing can be made") {
  CHECK_THROWS_AS(FileArchive("/dev/full", 1), OutputError);
  CHECK_THROWS_AS(FileArchive("/nonexistent/archive", 1), OutputError);
}
