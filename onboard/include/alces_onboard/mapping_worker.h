// The mapper on a thread of its own, between two rings: scans go in, what became of each comes out.
//
//   acquisition thread               mapping thread
//   claim_scan, publish_scan  ──>  ring of scans   ──>  Mapper::add_scan
//   front_result, pop_result  <──  ring of results <──  pose, edges, loop, reduced points
//
// Acquisition never waits: claim_scan() answers null when the mapper is behind, and the caller drops that
// newest scan. The mapping thread does wait for room in the ring of results. Results come in the order of the
// scans, one each, and a last one when the map is finished. No thread needs to be: run_once() does the same
// work step by step, so that a test knows the order of things.
//
// After a scan for which the map has no room (no_scan_capacity, no_point_capacity, no_edge_capacity) nothing
// more is mapped, so that the map ends in one place, as `alces replay` ends there.
//
// An archive that cannot be written (a full disk) is tried again with the same scan every `archive_retry_ns`;
// meanwhile scans wait, and are dropped when there is no more room for them. An archive that does not answer
// at all (a stalled disk) holds the mapping thread: beats() stand still, which the acquisition thread sees.
//
// Where each scan lies, and each loop, is on the shared page before the result is: its readers wait for no
// recorder.
//
// Memory, all of it taken by the constructor: the mapper's block, scan_slots times points_per_scan points of
// 12 bytes, and when results are kept whole as many times cell_capacity points, and 72 bytes a scan of
// capacity for the path after a loop.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "alces/mapper.h"
#include "alces_onboard/bell.h"
#include "alces_onboard/leavable_thread.h"
#include "alces_onboard/page/live_page.h"
#include "alces_onboard/recorder/spsc_ring.h"
#include "alces_platform/recording/records.h"
#include "alces_platform/settings/memory_plan.h"

namespace alces::onboard {

struct MappingWorkerConfig {
  MapperConfig mapper;  ///< complete: scan_capacity and pool_bytes are not 0
  std::uint32_t scan_slots = 4;
  std::uint32_t points_per_scan = 65536;
  bool keeps_clouds_and_paths = true;  ///< for a recording
  std::int64_t archive_retry_ns = 200 * ns_per_ms;
};

/// A scan on its way to the mapper.
struct ScanSlot {
  ScanRecord scan;  ///< as assembled
  std::span<Point> room;
  std::uint32_t point_count = 0;
};

/// How full the map is.
struct MapFigures {
  std::uint32_t scans = 0;
  std::uint64_t pool_bytes = 0;
  std::uint64_t archive_bytes = 0;
  std::uint32_t archived_scans = 0;
};

/// What became of a scan.
struct MapResult {
  bool is_end = false;  ///< the last result: no scan, but perhaps a loop that finish() closed
  ScanRecord scan;      ///< with verdict and place in the map
  Status status = Status::ok;
  bool is_map_full = false;
  ScanReport report;
  Pose map_from_body;
  std::int64_t latency_ns = 0;  ///< from the scan's last ray to its pose; 0: not in the map, or no clock
  std::array<Edge, 4> edges;    ///< that came into the graph
  std::uint32_t edge_count = 0;
  std::uint32_t edges_left_out = 0;  ///< that there was no room for here
  bool has_loop = false;
  LoopReport loop;
  bool has_path = false;   ///< path() is of now; take_path() when it was read
  std::span<Point> cloud;  ///< reduced points; empty when they are not kept
  MapFigures figures;
  MapHealth health;       ///< as it was judged last
  std::span<Point> room;  ///< for the cloud
};

class MappingWorker {
 public:
  /// Bytes beside the mapper's own block.
  [[nodiscard]] static std::size_t memory_beside_mapper(const MappingWorkerConfig& config);

  /// std::bad_alloc. When the mapper cannot be made, status() says why and nothing else may be called.
  /// `page`, unless null, and all that is referred to outlive it.
  MappingWorker(const MappingWorkerConfig& config, ScanArchive* archive, StageClock* clock,
                LivePage* page = nullptr);
  MappingWorker(const MappingWorker&) = delete;
  MappingWorker& operator=(const MappingWorker&) = delete;
  ~MappingWorker();

  [[nodiscard]] Status status() const { return status_; }

  /// std::system_error when the system has no more threads.
  void start_thread();

  // The acquisition thread's.
  [[nodiscard]] ScanSlot* claim_scan() { return scans_.claim(); }
  void publish_scan();
  [[nodiscard]] const MapResult* front_result() { return results_.front(); }
  void pop_result();
  /// The trajectory after the last loop that has_path told of, and its scans' reference times.
  [[nodiscard]] std::span<const Pose> path() const { return path_poses_.first(path_count_); }
  [[nodiscard]] std::span<const std::int64_t> path_stamps_ns() const {
    return path_stamps_.first(path_count_);
  }
  void take_path() { is_path_free_.store(true, std::memory_order_release); }
  [[nodiscard]] std::size_t waiting_scans() const { return scans_.size(); }
  [[nodiscard]] std::size_t scan_slots() const { return scans_.capacity(); }
  /// No more scans: the mapper works off what waits, finishes, and says so with a last result.
  void close();
  /// What waits is not mapped any more, but still answered for; the scan in work is finished.
  void abandon();
  /// After the last result was popped, or when it does not come. False: the thread hangs, and is left.
  [[nodiscard]] bool join_within(std::int64_t limit_ns);

  /// Changes whenever the mapping thread begins or ends a piece of work: one scan, or the end.
  [[nodiscard]] std::uint32_t beats() const { return beats_.load(std::memory_order_acquire); }
  /// It is at work, or there is some for it.
  [[nodiscard]] bool is_busy() const { return beats() % 2 != 0 || waiting_scans() > 0; }
  /// The archive cannot be written: the scan is tried again.
  [[nodiscard]] bool is_archive_stalled() const {
    return is_archive_stalled_.load(std::memory_order_acquire);
  }
  [[nodiscard]] std::uint64_t archive_retries() const {
    return archive_retries_.load(std::memory_order_relaxed);
  }

  // The mapping thread's, or that of a test without threads.
  /// One scan, or the end. False: there is nothing to do now, or no room for its result, or the archive could
  /// not be written and the scan waits for another try.
  bool run_once();
  [[nodiscard]] bool is_finished() const { return is_finished_.load(std::memory_order_acquire); }
  /// Only while no other thread maps.
  [[nodiscard]] const Mapper& mapper() const { return *mapper_; }

 private:
  void run();
  [[nodiscard]] bool work_once();
  void wait_for_archive() const;
  /// False: the archive cannot be written.
  [[nodiscard]] bool map(const ScanSlot& slot, MapResult& result);
  void finish(MapResult& result);
  void publish_place(MapResult& result);
  void tell_of_graph(std::uint32_t edges_before, MapResult& result);
  void copy_path(MapResult& result);
  void judge_map(const MapResult& result);

  MappingWorkerConfig config_;
  settings::MemoryBlock mapper_block_;
  settings::MemoryBlock room_block_;
  std::vector<ScanSlot> scan_slots_;
  std::vector<MapResult> result_slots_;
  SpscRing<ScanSlot> scans_;
  SpscRing<MapResult> results_;
  std::span<Pose> path_poses_;
  std::span<std::int64_t> path_stamps_;
  std::span<std::int64_t> stamps_;  ///< of the scans in the map
  std::uint32_t path_count_ = 0;
  std::atomic<bool> is_path_free_{true};
  Mapper* mapper_ = nullptr;
  StageClock* clock_ = nullptr;
  LivePage* page_ = nullptr;
  ScanRecord last_scan_;  ///< in the map
  Status status_ = Status::ok;
  bool is_map_full_ = false;
  MapHealth health_;

  Bell bell_;
  std::atomic<bool> is_closed_{false};
  std::atomic<bool> is_abandoned_{false};
  std::atomic<bool> is_finished_{false};
  std::atomic<std::uint32_t> beats_{0};  ///< odd: at work
  std::atomic<bool> is_archive_stalled_{false};
  std::atomic<std::uint64_t> archive_retries_{0};
  LeavableThread thread_;
};

}  // namespace alces::onboard
