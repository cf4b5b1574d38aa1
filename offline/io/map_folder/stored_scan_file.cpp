#include "stored_scan_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <system_error>
#include <utility>

#include "alces_platform/recording/crc32.h"
#include "offline/io/files/error.h"

namespace alces::offline {
namespace {

constexpr std::array<std::uint8_t, 8> stored_scan_magic = {0x89, 'A', 'L', 'C', 'E', 'S', '\r', '\n'};
constexpr std::uint32_t file_version = 1;
constexpr std::size_t head_bytes = 24;  // the file's header, and a scan's

std::uint32_t crc32_of(std::span<const std::byte> bytes) {
  return crc32({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

class Head {
 public:
  template <typename Integer>
  void put(Integer value) {
    for (std::size_t i = 0; i < sizeof(Integer); ++i)
      bytes_.at(used_++) = static_cast<std::byte>(value >> (8 * i) & 0xFF);
  }
  void put_crc32() { put(crc32_of(std::span(bytes_).first(used_))); }
  [[nodiscard]] std::string_view text() const {
    return {reinterpret_cast<const char*>(bytes_.data()), used_};
  }

 private:
  std::array<std::byte, head_bytes> bytes_{};
  std::size_t used_ = 0;
};

template <typename Integer>
Integer take(std::span<const std::byte> bytes, std::size_t offset) {
  Integer value = 0;
  for (std::size_t i = 0; i < sizeof(Integer); ++i)
    value |= static_cast<Integer>(std::to_integer<Integer>(bytes[offset + i]) << (8 * i));
  return value;
}

bool is_head_whole(std::span<const std::byte> head) {
  return take<std::uint32_t>(head, head_bytes - 4) == crc32_of(head.first(head_bytes - 4));
}

}  // namespace

StoredScanWriter::StoredScanWriter(const std::filesystem::path& file, std::uint32_t scans) : file_(file) {
  Head head;
  for (const std::uint8_t byte : stored_scan_magic) head.put(byte);
  head.put(file_version);
  head.put(scans);
  head.put(std::uint32_t{0});
  head.put_crc32();
  file_.write(head.text());
}

void StoredScanWriter::add(std::uint64_t number, std::span<const std::byte> record) {
  Head head;
  head.put(rows_++);
  head.put(static_cast<std::uint32_t>(record.size()));
  head.put(number);
  head.put(crc32_of(record));
  head.put_crc32();
  file_.write(head.text());
  file_.write({reinterpret_cast<const char*>(record.data()), record.size()});
}

void StoredScanWriter::finish() {
  file_.commit();
}

StoredScanFile::StoredScanFile(std::filesystem::path file) : path_(std::move(file)) {
  std::error_code failed;
  file_bytes_ = std::filesystem::file_size(path_, failed);
  if (!failed) stream_.open(path_, std::ios::binary);
  if (failed || !stream_) throw InputError(path_, "cannot be opened for reading");
  if (file_bytes_ < head_bytes) fail("is no file of stored scans: it has less than a header");
  read_bytes(0, head_bytes);
  const std::span<const std::byte> head(record_);
  for (std::size_t i = 0; i < stored_scan_magic.size(); ++i) {
    if (std::to_integer<std::uint8_t>(head[i]) != stored_scan_magic[i])
      fail("is no file of stored scans: it does not begin like one");
  }
  if (!is_head_whole(head)) fail("the checksum of its header differs");
  if (const auto version = take<std::uint32_t>(head, 8); version != file_version)
    fail(fmt::format("has version {}, this program knows version {}", version, file_version));
  const std::size_t rows = take<std::uint32_t>(head, 12);
  if (rows > (file_bytes_ - head_bytes) / head_bytes)
    fail(fmt::format("ends early: its header promises {} scans", rows));
  std::uint64_t position = head_bytes;
  scans_.reserve(rows);
  for (std::size_t row = 0; row < rows; ++row) {
    scans_.push_back(read_head(position, row, rows));
    position = scans_.back().position + scans_.back().bytes;
  }
  if (position != file_bytes_) fail(fmt::format("has {} bytes behind its last scan", file_bytes_ - position));
}

StoredScanFile::Scan StoredScanFile::read_head(std::uint64_t position, std::size_t row, std::size_t rows) {
  const std::string where = fmt::format("scan {} of {} at byte {}", row, rows, position);
  if (file_bytes_ - position < head_bytes) fail("ends before " + where);
  read_bytes(position, head_bytes);
  if (!is_head_whole(record_)) fail(where + ": the checksum of its head differs");
  if (take<std::uint32_t>(record_, 0) != row) fail(where + ": is another row");
  Scan scan;
  scan.number = take<std::uint64_t>(record_, 8);
  scan.position = position + head_bytes;
  scan.bytes = take<std::uint32_t>(record_, 4);
  scan.crc32 = take<std::uint32_t>(record_, 16);
  if (scan.bytes > file_bytes_ - scan.position) fail("ends within " + where);
  return scan;
}

const StoredScanView& StoredScanFile::read(std::size_t row) {
  const Scan& scan = scans_.at(row);
  const auto where = [&] { return fmt::format("scan {} of {} at byte {}", row, size(), scan.position); };
  read_bytes(scan.position, scan.bytes);
  if (crc32_of(record_) != scan.crc32) fail(where() + ": its checksum differs");
  if (const StoredScanFault fault = StoredScanView::parse(record_, view_); fault != StoredScanFault::none)
    fail(where() + ": " + to_string(fault));
  return view_;
}

void StoredScanFile::read_bytes(std::uint64_t position, std::size_t bytes) {
  record_.resize(bytes);
  stream_.seekg(static_cast<std::streamoff>(position));
  stream_.read(reinterpret_cast<char*>(record_.data()), static_cast<std::streamsize>(bytes));
  if (!stream_) fail(fmt::format("cannot be read at byte {}", position));
}

void StoredScanFile::fail(const std::string& what) const {
  throw InputError(path_, what + "; map again");
}

}  // namespace alces::offline
