// A scan archive on the desk: platform's ScanFile, whose problems are sentences and exceptions here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "alces/scan_archive.h"
#include "alces_platform/recording/scan_file.h"

namespace alces::offline {

class FileArchive final : public ScanArchive {
 public:
  /// Makes the file, or empties an archive of that name; OutputError.
  FileArchive(std::filesystem::path file, std::uint32_t scan_capacity);

  /// One record a scan, scans ascending. False: see problem(); the records before stay readable.
  [[nodiscard]] bool write(std::uint32_t scan, std::span<const std::byte> bytes) override;
  [[nodiscard]] bool read(std::uint32_t scan, std::span<std::byte> bytes) override;

  /// The first thing that went wrong, as a sentence that names the file; empty if nothing did.
  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  void put_in_words();

  std::filesystem::path path_;
  ScanFile file_;
  std::string problem_;
};

}  // namespace alces::offline
