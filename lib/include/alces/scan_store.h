// The reduced scans of a map in a bounded amount of memory.
//
// A scan is encoded once, as stored_scan.h lays it out: points in the order of their k-d tree, quantised to
// 16 bits an axis within the scan's box (error at most half a step: 0.5 mm for a box of 65 m), its surface
// samples, and what channels it brings. Records fill the point pool first, then go to the ScanArchive. To be
// matched, a record is decoded into one of a few cache slots, where its tree stands ready; decoding is the
// only way in, so where a record lay never changes a pose.
//
// Memory: the pool, 16 bytes a scan, and a slot 16 bytes a point of capacity and 20 a sample.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "alces/arena.h"
#include "alces/kd_tree.h"
#include "alces/scan_archive.h"
#include "alces/status.h"
#include "alces/stored_scan.h"
#include "alces/surface.h"

namespace alces {

struct ScanStoreConfig {
  std::uint32_t scan_capacity = 1024;
  std::uint32_t point_capacity = 16384;  ///< most points of one scan
  std::size_t pool_bytes = std::size_t{32} << 20;
  std::uint32_t cache_slots = 16;  ///< at least as many as scans are looked at together
  SurfaceConfig surface;
  ChannelCapacity channels;  ///< that scans may bring
};

/// A scan ready to be matched; valid until as many other scans as there are slots were asked for.
struct StoredScan {
  const KdTree* tree = nullptr;
  std::span<const SurfaceSample> samples;
  ScanSpacing spacing;
};

class ScanStore {
 public:
  constexpr ScanStore(Arena& arena, const ScanStoreConfig& config)
      : config_(config),
        pool_(arena.allocate<std::byte>(config.pool_bytes)),
        records_(arena.allocate<Record>(config.scan_capacity)),
        slots_(arena.allocate<Slot>(config.cache_slots)),
        tree_scratch_(arena, config.point_capacity),
        point_scratch_(arena.allocate<Point>(config.point_capacity)),
        record_scratch_(arena.allocate<std::byte>(StoredScanLayout::record_bytes(
            config.point_capacity, config.surface.sample_capacity, config.channels))) {
    for (std::uint32_t i = 0; i < config.cache_slots; ++i) {
      Slot slot;
      slot.tree = KdTree(arena, config.point_capacity);
      slot.samples = arena.allocate<SurfaceSample>(config.surface.sample_capacity);
      if (i < slots_.size()) slots_[i] = slot;
    }
  }

  /// Where records go that the pool has no room for; null: nowhere, and add() says no_point_capacity.
  void set_archive(ScanArchive* archive) { archive_ = archive; }

  /// Stores the next scan: finite points, at most point_capacity; as they were downsampled to cells of
  /// `cell_size_m` (0: not known), with what channels there are. no_scan_capacity, no_point_capacity,
  /// archive_write_failed, bad_channel: nothing was stored then. Build of a tree, O(n log n).
  [[nodiscard]] Status add(std::span<const Point> points, float cell_size_m = 0,
                           const ScanChannels& channels = {});

  /// Brings a scan back, from its slot, or decoded into the slot not used for longest.
  /// no_such_scan, archive_read_failed.
  [[nodiscard]] Status load(std::uint32_t scan, StoredScan& stored);

  /// The scan's record as it is stored; valid until the next call of a function that is not const.
  /// no_such_scan, archive_read_failed.
  [[nodiscard]] Status read_record(std::uint32_t scan, std::span<const std::byte>& record);

  [[nodiscard]] std::uint32_t scan_count() const { return scan_count_; }
  [[nodiscard]] std::uint32_t point_count(std::uint32_t scan) const { return records_[scan].point_count; }

  struct Counters {
    std::uint64_t points = 0;         ///< stored
    std::uint64_t pool_bytes = 0;     ///< of the pool in use
    std::uint64_t archive_bytes = 0;  ///< handed to the archive
    std::uint32_t archived_scans = 0;
    std::uint64_t slot_hits = 0;
    std::uint64_t slot_misses = 0;  ///< records decoded again
  };
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  struct Record {
    std::uint64_t offset;  // in the pool; in_archive if it is not there
    std::uint32_t point_count;
    std::uint32_t bytes;
  };
  struct Slot {
    std::uint32_t scan = UINT32_MAX;
    std::uint64_t last_use = 0;
    std::uint32_t sample_count = 0;
    ScanSpacing spacing;
    KdTree tree;
    std::span<SurfaceSample> samples;
  };
  static constexpr std::uint64_t in_archive = UINT64_MAX;

  Slot& oldest_slot();
  bool decode(std::span<const std::byte> record, std::uint32_t scan, Slot& slot);
  static void take_samples(const StoredScanView& view, Slot& slot);

  ScanStoreConfig config_;
  std::span<std::byte> pool_;
  std::span<Record> records_;
  std::span<Slot> slots_;
  KdTreeScratch tree_scratch_;
  std::span<Point> point_scratch_;
  std::span<std::byte> record_scratch_;
  ScanArchive* archive_ = nullptr;
  std::uint32_t scan_count_ = 0;
  std::uint64_t use_ = 0;
  Counters counters_;
};

}  // namespace alces
