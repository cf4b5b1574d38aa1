#include "scan_cache.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "alces_platform/parallel.h"
#include "offline/io/files/error.h"
#include "offline/io/files/scratch_file.h"

namespace alces::offline {

// Records of prepared scans.
class ScanCache::Scratch {
 public:
  Scratch(const std::filesystem::path& folder, std::size_t scans) : file_(folder), records_(scans) {}

  [[nodiscard]] bool has(std::uint32_t scan) const { return records_[scan].has_value(); }

  void write(std::uint32_t scan, const std::string& bytes) {
    std::uint64_t begin = 0;
    {
      const std::lock_guard lock(mutex_);
      begin = end_;
      end_ += bytes.size();
    }
    file_.write(begin, bytes.data(), bytes.size());
    records_[scan] = Record{begin, bytes.size()};
  }

  void read(std::uint32_t scan, std::string& bytes) const {
    const Record& record = *records_[scan];
    bytes.resize(record.size);
    file_.read(record.begin, bytes.data(), bytes.size());
  }

 private:
  struct Record {
    std::uint64_t begin = 0;
    std::size_t size = 0;
  };

  ScratchFile file_;
  std::vector<std::optional<Record>> records_;
  std::mutex mutex_;
  std::uint64_t end_ = 0;
};

ScanCache::ScanCache(ScanSource& source, std::vector<std::size_t> source_index, const LumSettings& settings,
                     std::filesystem::path scratch_folder)
    : source_(source),
      source_index_(std::move(source_index)),
      settings_(settings),
      scratch_folder_(std::move(scratch_folder)),
      loaded_(source_index_.size()),
      used_(source_index_.size(), 0) {
  if (source_index_.size() > settings_.loaded_scans)
    scratch_ = std::make_unique<Scratch>(scratch_folder_, source_index_.size());
}

ScanCache::~ScanCache() = default;

std::unique_ptr<PreparedScan> ScanCache::fetch(std::uint32_t scan) {
  auto prepared = std::make_unique<PreparedScan>();
  if (scratch_ && scratch_->has(scan)) {
    std::string bytes;
    scratch_->read(scan, bytes);
    if (!prepared->from_bytes(bytes))
      throw InputError(scratch_folder_, "the scratch file for scans was damaged; run again");
    const std::lock_guard lock(counting_);
    ++counters_.brought_back;
    return prepared;
  }
  ScanPoints read;
  {
    const std::lock_guard lock(reading_);
    if (!source_.read(source_index_[scan], read))
      throw InputError(
          fmt::format("{} ({}) is missing: the source ends before it; give the scans that the map was "
                      "made of",
                      source_.name(source_index_[scan]), source_.description()));
  }
  std::unique_ptr<ScanPreparation> preparation;
  {
    const std::lock_guard lock(idle_mutex_);
    if (!idle_.empty()) {
      preparation = std::move(idle_.back());
      idle_.pop_back();
    }
  }
  if (!preparation) preparation = std::make_unique<ScanPreparation>(settings_);
  *prepared = preparation->prepare(read.points);
  if (scratch_) scratch_->write(scan, prepared->to_bytes());
  {
    const std::lock_guard lock(idle_mutex_);
    idle_.push_back(std::move(preparation));
  }
  const std::lock_guard lock(counting_);
  ++counters_.prepared;
  if (prepared->size() == 0) ++counters_.empty;
  return prepared;
}

void ScanCache::load(std::span<const std::uint32_t> scans) {
  ++clock_;
  std::vector<std::uint32_t> missing;
  for (const std::uint32_t scan : scans) {
    used_[scan] = clock_;
    if (!loaded_[scan]) missing.push_back(scan);
  }
  if (missing.empty()) return;
  const std::size_t room =
      settings_.loaded_scans - std::min<std::size_t>(settings_.loaded_scans, loaded_count_);
  if (missing.size() > room) {
    std::vector<std::uint32_t> leaving;
    for (std::uint32_t scan = 0; scan < loaded_.size(); ++scan)
      if (loaded_[scan] && used_[scan] != clock_) leaving.push_back(scan);
    std::stable_sort(leaving.begin(), leaving.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return used_[a] < used_[b]; });
    leaving.resize(std::min(leaving.size(), missing.size() - room));
    for (const std::uint32_t scan : leaving) {
      loaded_bytes_ -= loaded_[scan]->bytes();
      loaded_[scan].reset();
      --loaded_count_;
    }
  }
  for_each_index(missing.size(), [&](std::size_t i) { loaded_[missing[i]] = fetch(missing[i]); });
  loaded_count_ += missing.size();
  for (const std::uint32_t scan : missing) loaded_bytes_ += loaded_[scan]->bytes();
  counters_.most_loaded = std::max(counters_.most_loaded, loaded_count_);
  counters_.most_bytes = std::max(counters_.most_bytes, loaded_bytes_);
}

}  // namespace alces::offline
