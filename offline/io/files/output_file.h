// A file that appears under its name only when it is whole: written as NAME.part, synced and renamed by
// commit(), so that a power cut, too, leaves the old file or the new one. Devices and pipes (/dev/stdout) are
// written to directly. Every failure is an OutputError with path and reason.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

namespace alces::offline {

class OutputFile {
 public:
  /// The folder must exist.
  explicit OutputFile(std::filesystem::path file);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  /// Without commit() the partial file is removed.
  ~OutputFile();

  void write(std::string_view bytes);
  /// Overwrites bytes written before; for headers whose numbers are known last.
  void patch(std::uint64_t position, std::string_view bytes);
  /// Hands the rest to the operating system, waits until all of it is on the disk, and renames.
  void commit();

 private:
  [[noreturn]] void fail(int error_number);
  void write_fully(const char* data, std::size_t size);
  void flush();

  std::filesystem::path file_;
  std::filesystem::path part_;  // empty for devices
  int descriptor_ = -1;
  std::vector<char> buffer_;
};

/// As long as it lives, files below `folder` are not synced one by one: whoever puts the folder into its
/// place syncs all of them at once. (A map of 1000 scans has 1000 .frames files.)
class SyncedTogether {
 public:
  explicit SyncedTogether(std::filesystem::path folder);
  SyncedTogether(const SyncedTogether&) = delete;
  SyncedTogether& operator=(const SyncedTogether&) = delete;
  ~SyncedTogether();

 private:
  std::filesystem::path folder_;
};

/// As make -p; OutputError.
void make_folder(const std::filesystem::path& folder);

}  // namespace alces::offline
