// Files beyond what 32 bits count. They are sparse: each piece becomes a hole once it is written, so that
// they take no room on the disk.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "alces_platform/recording/byte_source.h"
#include "alces_platform/recording/file_sink.h"
#include "alces_platform/recording/scan_file.h"

using namespace alces;

namespace {

constexpr std::uint64_t four_gib = std::uint64_t{4} << 30;
constexpr std::size_t piece_bytes = std::size_t{64} << 20;

class LargeFile {
 public:
  LargeFile() {
    path_ = (std::filesystem::temp_directory_path() / "alces_large_XXXXXX").string();
    descriptor_ = ::mkstemp(path_.data());
    zeros_ = ::mmap(nullptr, piece_bytes, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  }
  LargeFile(const LargeFile&) = delete;
  LargeFile& operator=(const LargeFile&) = delete;
  ~LargeFile() {
    ::munmap(zeros_, piece_bytes);
    ::close(descriptor_);
    ::unlink(path_.c_str());
  }
  [[nodiscard]] const char* path() const { return path_.c_str(); }
  [[nodiscard]] std::span<const std::uint8_t> zeros() const {
    return {static_cast<const std::uint8_t*>(zeros_), piece_bytes};
  }
  /// False: this file system has no holes.
  [[nodiscard]] bool punch(std::uint64_t position) const {
    return ::fallocate64(descriptor_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE,
                         static_cast<off64_t>(position), static_cast<off64_t>(piece_bytes)) == 0;
  }

 private:
  std::string path_;
  int descriptor_ = -1;
  void* zeros_ = nullptr;
};

}  // namespace

TEST_CASE("a recording goes on beyond 4 GiB, and is read back and read there") {
  const LargeFile file;
  FileSink sink;
  REQUIRE(sink.open(file.path()));
  while (sink.size() <= four_gib) {
    const std::uint64_t position = sink.size();
    REQUIRE(sink.write(file.zeros()));
    if (!file.punch(position)) {
      WARN("skipped: the temporary folder's file system makes no holes");
      return;
    }
  }
  const std::uint64_t end = sink.size();
  const std::vector<std::uint8_t> mark = {1, 2, 3, 4, 5};
  REQUIRE(sink.write(mark));
  std::array<std::uint8_t, 5> found{};
  REQUIRE(sink.read_back(end, found));
  CHECK(std::vector<std::uint8_t>(found.begin(), found.end()) == mark);
  CHECK_FALSE(sink.read_back(end + 1, found));  // the file ends before
  CHECK(sink.sync());
  CHECK(sink.close());
  CHECK(std::filesystem::file_size(file.path()) == end + mark.size());

  FileSource source(file.path());
  std::vector<std::uint8_t> room(piece_bytes);
  std::uint64_t read = 0;
  std::size_t got = 0;
  while ((got = source.read(room)) == room.size()) read += got;
  CHECK(source.error_number() == 0);
  CHECK(read + got == end + mark.size());
  REQUIRE(got >= mark.size());
  CHECK(std::vector<std::uint8_t>(room.begin() + static_cast<std::ptrdiff_t>(got - mark.size()),
                                  room.begin() + static_cast<std::ptrdiff_t>(got)) == mark);
}

TEST_CASE("a scan archive goes on beyond 4 GiB") {
  const LargeFile file;
  ScanFile archive;
  REQUIRE(archive.open(file.path(), 100));
  std::uint32_t scan = 0;
  for (std::uint64_t position = 0; position <= four_gib; position += piece_bytes) {
    REQUIRE(archive.write(scan++, std::as_bytes(file.zeros())));
    if (position >= piece_bytes && !file.punch(position)) {
      WARN("skipped: the temporary folder's file system makes no holes");
      return;
    }
  }
  const std::array<std::byte, 3> mark = {std::byte{7}, std::byte{8}, std::byte{9}};
  REQUIRE(archive.write(scan, mark));
  std::array<std::byte, 3> found{};
  REQUIRE(archive.read(scan, found));
  CHECK(found == mark);
}
