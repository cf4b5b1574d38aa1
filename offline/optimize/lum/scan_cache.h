// Prepared scans, a bounded number of them in memory.
//
// A scan is read and prepared when it is first asked for. Where not all fit, prepared scans also go to a
// scratch file, so that later rounds bring them back instead of parsing and thinning them out again. The file
// has no name and goes away with the object, whatever ends the program.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "offline/io/scans/scan_source.h"
#include "prepared_scan.h"

namespace alces::offline {

class ScanCache {
 public:
  struct Counters {
    std::uint64_t prepared = 0;      ///< read from the source
    std::uint64_t brought_back = 0;  ///< read from the scratch file
    std::size_t most_loaded = 0;     ///< at once; never above settings.loaded_scans
    std::size_t most_bytes = 0;
    std::size_t empty = 0;  ///< scans without a usable point
  };

  /// Scan i of the map is scan source_index[i] of `source`; both outlive the cache. `scratch_folder` is used
  /// when there are more scans than loaded_scans.
  ScanCache(ScanSource& source, std::vector<std::size_t> source_index, const LumSettings& settings,
            std::filesystem::path scratch_folder);
  ~ScanCache();

  [[nodiscard]] std::size_t size() const { return source_index_.size(); }
  [[nodiscard]] std::size_t capacity() const { return settings_.loaded_scans; }

  /// Loads these scans (ascending, no more than capacity()), on all cores of the caller's task arena; others
  /// make room, those used longest ago first. InputError naming a scan that cannot be read; OutputError for
  /// the scratch file. Not to be called while scans are in use.
  void load(std::span<const std::uint32_t> scans);

  /// A scan that the last load() asked for.
  [[nodiscard]] const PreparedScan& at(std::uint32_t scan) const { return *loaded_[scan]; }

  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  class Scratch;

  std::unique_ptr<PreparedScan> fetch(std::uint32_t scan);

  ScanSource& source_;
  std::vector<std::size_t> source_index_;
  LumSettings settings_;
  std::filesystem::path scratch_folder_;
  std::unique_ptr<Scratch> scratch_;
  std::vector<std::unique_ptr<PreparedScan>> loaded_;
  std::vector<std::uint64_t> used_;  // when a scan was last asked for
  std::uint64_t clock_ = 0;
  std::size_t loaded_count_ = 0;
  std::size_t loaded_bytes_ = 0;
  std::mutex reading_;
  std::mutex counting_;
  std::mutex idle_mutex_;
  std::vector<std::unique_ptr<ScanPreparation>> idle_;
  Counters counters_;
};

}  // namespace alces::offline
