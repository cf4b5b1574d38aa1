// scans.alces of a map folder: the map's scans as its mapper stored them (alces/stored_scan.h), a record for
// each row of trajectory.tum, so that the map can be matched to again without the scans it was made from.
// Little-endian:
//
//   offset  bytes  what
//   0       8      89 41 4C 43 45 53 0D 0A
//   8       4      version of the file, 1
//   12      4      number of scans
//   16      4      0
//   20      4      CRC-32 of the 20 bytes before
//
// then for each scan a head of 24 bytes, and its record:
//
//   0       4      row, counted from 0
//   4       4      bytes of the record
//   8       8      the scan's number, as in map.ply and frames/
//   16      4      CRC-32 of the record
//   20      4      CRC-32 of the 20 bytes before
//
// Memory: 24 bytes a scan, and a record.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "alces/stored_scan.h"
#include "offline/io/files/output_file.h"

namespace alces::offline {

class StoredScanWriter {
 public:
  /// OutputError, as all others.
  StoredScanWriter(const std::filesystem::path& file, std::uint32_t scans);
  void add(std::uint64_t number, std::span<const std::byte> record);
  /// After as many scans as were promised.
  void finish();

 private:
  OutputFile file_;
  std::uint32_t rows_ = 0;
};

class StoredScanFile {
 public:
  /// Checks the header and all heads, and that the file is as long as they say; InputError.
  explicit StoredScanFile(std::filesystem::path file);

  [[nodiscard]] std::size_t size() const { return scans_.size(); }
  [[nodiscard]] std::uint64_t number(std::size_t row) const { return scans_.at(row).number; }

  /// Checks the record of a row, every field, and shows it until the next call; InputError.
  [[nodiscard]] const StoredScanView& read(std::size_t row);

 private:
  struct Scan {
    std::uint64_t number = 0;
    std::uint64_t position = 0;  ///< of the record
    std::uint32_t bytes = 0;
    std::uint32_t crc32 = 0;
  };
  void read_bytes(std::uint64_t position, std::size_t bytes);  ///< into record_
  [[nodiscard]] Scan read_head(std::uint64_t position, std::size_t row, std::size_t rows);
  [[noreturn]] void fail(const std::string& what) const;

  std::filesystem::path path_;
  std::ifstream stream_;
  std::uint64_t file_bytes_ = 0;
  std::vector<Scan> scans_;
  std::vector<std::byte> record_;
  StoredScanView view_;
};

}  // namespace alces::offline
