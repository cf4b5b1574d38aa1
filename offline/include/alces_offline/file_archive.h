// Reduced scans that the point pool has no room for, in a file.
//
// Memory: 24 bytes an archived scan, set aside at the start. The file begins with a line that says what it
// is; an existing file without that line is not overwritten.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "alces/scan_archive.h"

namespace alces::offline {

class FileArchive final : public ScanArchive {
 public:
  /// Makes the file, or empties an archive of that name; OutputError.
  FileArchive(std::filesystem::path file, std::uint32_t scan_capacity);
  FileArchive(const FileArchive&) = delete;
  FileArchive& operator=(const FileArchive&) = delete;
  ~FileArchive();

  /// One record a scan, scans ascending. False: see problem(); the records before stay readable.
  [[nodiscard]] bool write(std::uint32_t scan, std::span<const std::byte> bytes) override;
  [[nodiscard]] bool read(std::uint32_t scan, std::span<std::byte> bytes) override;

  /// The first thing that went wrong, as a sentence that names the file; empty if nothing did.
  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  struct Record {
    std::uint32_t scan = 0;
    std::size_t bytes = 0;
    std::uint64_t position = 0;
  };
  bool fail(const std::string& what);

  std::filesystem::path file_;
  int descriptor_ = -1;
  std::uint64_t end_ = 0;
  std::vector<Record> records_;  // ascending by scan
  std::string problem_;
};

}  // namespace alces::offline
