// A ScanArchive in a file: the reduced scans that the mapper's memory has no room for.
//
// The file begins with a line that says what it is; an existing file without that line is not overwritten.
// Memory: 24 bytes a scan of capacity, set aside by open(); nothing is allocated after that. Reads and writes
// wait for the disk: for the mapping thread, not for the one that acquires.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "alces/scan_archive.h"

namespace alces {

enum class ScanFileProblem : std::uint8_t {
  none,
  cannot_make,     ///< the file
  in_use,          ///< by another process
  not_an_archive,  ///< it exists and is something else
  cannot_empty,
  cannot_write_begin,
  out_of_order,  ///< scans are to ascend
  too_many,      ///< more than the capacity
  cannot_write,
  not_archived,  ///< never, or in another size
  cannot_read,
  ends_early,  ///< the file has been cut meanwhile
};
[[nodiscard]] const char* to_string(ScanFileProblem problem);

class ScanFile final : public ScanArchive {
 public:
  ScanFile() = default;
  ScanFile(const ScanFile&) = delete;
  ScanFile& operator=(const ScanFile&) = delete;
  ~ScanFile();

  /// Makes the file, or empties an archive of that name. False: problem().
  [[nodiscard]] bool open(const char* path, std::uint32_t scan_capacity);

  /// One record a scan, scans ascending. False: see problem(); the records before stay readable.
  [[nodiscard]] bool write(std::uint32_t scan, std::span<const std::byte> bytes) override;
  [[nodiscard]] bool read(std::uint32_t scan, std::span<std::byte> bytes) override;

  /// The first thing that went wrong; with which scan, and errno where the system said why.
  [[nodiscard]] ScanFileProblem problem() const { return problem_; }
  [[nodiscard]] std::uint32_t problem_scan() const { return problem_scan_; }
  [[nodiscard]] int error_number() const { return error_number_; }

 private:
  struct Record {
    std::uint32_t scan = 0;
    std::size_t bytes = 0;
    std::uint64_t position = 0;
  };
  bool fail(ScanFileProblem problem, std::uint32_t scan, int error_number);

  int descriptor_ = -1;
  std::uint64_t end_ = 0;
  std::vector<Record> records_;  ///< ascending by scan
  std::uint32_t capacity_ = 0;
  ScanFileProblem problem_ = ScanFileProblem::none;
  std::uint32_t problem_scan_ = 0;
  int error_number_ = 0;
};

}  // namespace alces
