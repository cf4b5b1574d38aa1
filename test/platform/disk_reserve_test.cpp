#include "alces_platform/recording/disk_reserve.h"

#include <sys/statvfs.h>

#include <catch2/catch.hpp>
#include <vector>

using namespace alces;

namespace {

struct Taker final : ByteSink {
  bool write(std::span<const std::uint8_t> bytes) override {
    taken += bytes.size();
    return true;
  }
  std::size_t taken = 0;
};

/// Free bytes, and all, of the disk of this folder.
std::pair<std::uint64_t, std::uint64_t> disk(const char* path) {
  struct statvfs figures {};
  REQUIRE(statvfs(path, &figures) == 0);
  return {figures.f_bavail * figures.f_frsize, figures.f_blocks * figures.f_frsize};
}

/// A span of so many bytes that nobody reads.
std::span<const std::uint8_t> bytes(std::uint64_t count) {
  static const std::uint8_t first = 0;
  return {&first, static_cast<std::size_t>(count)};
}

}  // namespace

TEST_CASE("a write that would leave less than the reserve is refused, until the recording ends") {
  const auto [free_bytes, all_bytes] = disk("/tmp");
  const std::uint64_t reserve = all_bytes / 20;
  if (free_bytes < reserve + (16 << 20) || sizeof(std::size_t) < 8) {
    WARN("skipped, no test data: /tmp is nearly full, or sizes have 32 bits");
    return;
  }
  Taker taker;
  DiskReserve disk_reserve(taker);
  CHECK(disk_reserve.write(bytes(free_bytes)));            // nothing was asked for
  disk_reserve.keep_free("/tmp", std::uint64_t{1} << 60);  // more than a twentieth counts as a twentieth
  taker.taken = 0;
  CHECK(disk_reserve.write(bytes(1 << 20)));
  CHECK_FALSE(disk_reserve.write(bytes(free_bytes - reserve / 2)));
  CHECK(taker.taken == 1 << 20);
  disk_reserve.release();
  CHECK(disk_reserve.write(bytes(free_bytes - reserve / 2)));
}

TEST_CASE("a disk that cannot be asked refuses nothing by its reserve") {
  Taker taker;
  DiskReserve disk_reserve(taker);
  disk_reserve.keep_free("/nowhere/at/all", 1 << 20);
  CHECK(disk_reserve.write(bytes(100)));
}
