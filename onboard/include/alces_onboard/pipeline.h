// From events to a map and a recording: everything of alcesd but its devices.
//
//   event ──> recorder ──> Scanner ──> scan ──> MappingWorker ──> result ──> recorder
//
// One thread hands events in (on_event) and drives all but the mapping: it never waits for the mapper, and
// for a file only as long as the ByteSink makes it. The recorder sees each event before the drivers do, and
// for every scan that is assembled one ScanRecord says what became of it:
//
//   mapped ...          it is in the map
//   dropped: ...        the mapper was busy (the newest scan goes, the raw data stays) or was told to stop;
//                       `alces replay` drops it, too, and so makes the same map from the same scans
//   incomplete          profiles are missing, and maps_incomplete_scans is not set
//   not mapped: ...     --no-map, or the map is full
//   anything else       why the mapper refused it
//
// After create() nothing is allocated.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "alces_drivers/notice_rate_limiter.h"
#include "alces_drivers/port/notice_port.h"
#include "alces_drivers/scanner/event.h"
#include "alces_drivers/scanner/scanner.h"
#include "alces_onboard/mapping_worker.h"
#include "alces_onboard/notice_limiter.h"
#include "alces_onboard/page/live_page.h"
#include "alces_onboard/scan_latency.h"
#include "alces_onboard/status_report.h"
#include "alces_platform/linux/retry_delay.h"
#include "alces_platform/recording/recording_writer.h"
#include "alces_platform/settings/memory_plan.h"

namespace alces::onboard {

struct PipelineConfig {
  ScannerConfig scanner;
  MappingWorkerConfig mapping;  ///< points_per_scan and keeps_clouds_and_paths are set from the rest
  bool maps = true;
  bool maps_incomplete_scans = false;
  bool records = true;
  RecordingConfig recording;
  std::uint64_t recording_limit_bytes = 0;            ///< 0: none
  std::int64_t counters_interval_ns = 60 * ns_per_s;  ///< all counters go into the recording so often
  std::int64_t mapping_timeout_ns = 20 * ns_per_s;    ///< a scan that takes the mapper longer: it hangs
};

struct PipelineMemory {
  std::size_t scanner_bytes = 0;
  std::size_t mapper_bytes = 0;
  std::size_t beside_mapper_bytes = 0;  ///< scan slots, clouds, path
  std::size_t recorder_bytes = 0;
  [[nodiscard]] std::size_t total_bytes() const {
    return scanner_bytes + mapper_bytes + beside_mapper_bytes + recorder_bytes;
  }
};

class Pipeline final : public EventSink, public NoticePort, private ScanSink {
 public:
  struct Counters {
    std::uint64_t scans = 0;  ///< assembled; each is one of the following
    std::uint64_t scans_mapped = 0;
    std::uint64_t scans_dropped = 0;     ///< the mapper was busy
    std::uint64_t scans_left = 0;        ///< told to stop before they were mapped
    std::uint64_t scans_incomplete = 0;  ///< and therefore not mapped
    std::uint64_t scans_refused = 0;     ///< by the mapper
    std::uint64_t scans_not_wanted = 0;  ///< --no-map, or the map is full
    std::uint64_t scans_predicted = 0;   ///< of the mapped: the match failed
    std::uint64_t scans_thinned = 0;  ///< of the mapped: more cells than voxel.cell_capacity, so larger ones
    std::uint64_t loops_closed = 0;
    std::uint64_t loops_refused = 0;
    std::uint64_t archive_stalls = 0;     ///< times that the archive could not be written any more
    std::uint64_t archive_retries = 0;    ///< writes tried again meanwhile
    std::uint64_t archive_losses = 0;     ///< scans that could not be brought back to be matched with
    std::uint64_t mapper_hangs = 0;       ///< times that the mapper did not come back in mapping_timeout_ns
    std::uint64_t edges_skipped = 0;      ///< not recorded: more at once than a result holds
    std::uint64_t paths_skipped = 0;      ///< not recorded, because the one before was not yet
    std::uint64_t notices = 0;            ///< told; those held back are not among them
    std::uint64_t notices_held_back = 0;  ///< too many of one source: notice_limiter.h
    std::uint64_t events_after_end = 0;

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("scans", scans);
      visit("scans_mapped", scans_mapped);
      visit("scans_dropped", scans_dropped);
      visit("scans_left", scans_left);
      visit("scans_incomplete", scans_incomplete);
      visit("scans_refused", scans_refused);
      visit("scans_not_wanted", scans_not_wanted);
      visit("scans_predicted", scans_predicted);
      visit("scans_thinned", scans_thinned);
      visit("loops_closed", loops_closed);
      visit("loops_refused", loops_refused);
      visit("archive_stalls", archive_stalls);
      visit("archive_retries", archive_retries);
      visit("archive_losses", archive_losses);
      visit("mapper_hangs", mapper_hangs);
      visit("edges_skipped", edges_skipped);
      visit("paths_skipped", paths_skipped);
      visit("notices", notices);
      visit("notices_held_back", notices_held_back);
      visit("events_after_end", events_after_end);
    }
  };

  struct Dependencies {
    Scanner::Ports ports;
    LivePage* page = nullptr;       ///< for other programs
    ByteSink* recording = nullptr;  ///< needed when config.records
    ScanArchive* archive = nullptr;
    StageClock* clock = nullptr;
    NoticePort* listener = nullptr;  ///< people
  };

  [[nodiscard]] static PipelineMemory memory_required(const PipelineConfig& config);

  /// Error, when a configuration cannot be; std::bad_alloc.
  Pipeline(const PipelineConfig& config, const Dependencies& dependencies);
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;
  ~Pipeline() = default;

  /// Maps on a thread of its own from now on; otherwise run_mapper_once() does. std::system_error.
  void start_mapping_thread();
  /// One scan, or the end of the map. False: nothing to do.
  bool run_mapper_once() { return worker_ && worker_->run_once(); }

  void start_scanner() { scanner_->start(); }
  /// In order; a second time: at once, by the motor's quick stop. The recording keeps when.
  void stop_scanner();
  [[nodiscard]] bool has_scanner_ended() const { return scanner_->has_ended(); }
  /// The drive said that the motor has no torque and stands, or there is no motor.
  [[nodiscard]] bool is_motor_confirmed() const {
    return !config_.scanner.has_motor || scanner_->motor().state() == MotorState::stopped;
  }

  /// See Scanner: for EventLoop::wake_at().
  [[nodiscard]] std::int64_t next_wake_ns() const { return scanner_->next_wake_ns(); }
  /// The one way in. Also takes the mapper's results.
  void on_event(const Event& event) override;
  /// From the acquisition thread: printed, counted, recorded.
  void raise(const Notice& notice) override;

  // The end, in this order.
  /// No more events: the open scan becomes a last, incomplete one; the mapper works off what waits.
  void end_events();
  /// Takes the mapper's results; from then on, in place of events.
  void take_results();
  /// What waits is not mapped any more.
  void abandon_mapping();
  /// For a watchdog: the mapping thread comes back from its work, as this one does.
  [[nodiscard]] bool are_threads_alive() const { return !is_mapper_hung_; }
  [[nodiscard]] bool is_mapping_finished() const { return is_mapping_finished_; }
  /// Once the mapping is finished, or is not waited for any more: the last counters, and the file's end.
  /// False: not all of it was taken.
  bool finish_recording();
  /// The mapping thread did not come back: it still uses what is here, so that this must not be destroyed.
  [[nodiscard]] bool was_mapper_left() const { return was_mapper_left_; }

  [[nodiscard]] StatusReport status() const;
  [[nodiscard]] const Counters& counters() const { return counters_; }
  /// Of the map, as it was judged last.
  [[nodiscard]] const MapHealth& health() const { return health_; }
  [[nodiscard]] const Scanner& scanner() const { return *scanner_; }
  [[nodiscard]] const RecordingWriter* recorder() const { return recorder_; }
  /// Only without a mapping thread, or after its end; null with maps = false.
  [[nodiscard]] const Mapper* mapper() const { return worker_ ? &worker_->mapper() : nullptr; }

 private:
  static constexpr std::size_t rate_scans = 8;
  static constexpr std::int64_t status_interval_ns = 100 * ns_per_ms;  ///< on the page
  enum class NoticeKind : std::uint8_t {
    thinned,
    loops,
    paths,
    edges,
    part,
    contradiction,
    doubtful,
    bad,
    archive,
    archive_loss,
    hang,
    count
  };

  void tell(const Notice& notice);
  /// Of a capacity that was exceeded, at its first and then ever more seldom.
  void say(NoticeKind kind, const char* text, std::uint64_t count, Severity severity = Severity::warning);
  void on_scan(const Scan& scan) override;
  void on_result(const MapResult& result);
  void watch_health(const MapResult& result);
  void watch_mapper();
  void watch_archive();
  [[nodiscard]] std::int64_t pose_age_ns() const;
  void record_result(const MapResult& result);
  void record_counters();
  void watch_recording();
  void publish(const Event& event);
  void answer(const ScanRecord& scan, const char* verdict, std::uint64_t& counter);

  PipelineConfig config_;
  NoticePort* listener_ = nullptr;
  LivePage* page_ = nullptr;
  std::int64_t status_published_ns_ = no_stamp_ns;
  std::uint64_t nodes_published_ = 0;
  std::optional<settings::MemoryBlock> scanner_block_;
  std::optional<settings::MemoryBlock> recorder_block_;
  Scanner* scanner_ = nullptr;
  RecordingWriter* recorder_ = nullptr;  ///< null: nothing is recorded
  std::unique_ptr<MappingWorker> worker_;

  bool is_recording_ = false;  ///< false also beyond the limit; the file's end is still to be written
  bool is_ended_ = false;
  bool is_mapping_finished_ = false;
  bool is_map_full_ = false;
  std::int64_t now_ns_ = 0;
  std::int64_t counters_recorded_ns_ = no_stamp_ns;
  std::array<std::int64_t, rate_scans> scan_stamps_ns_{};
  RateLimiter drop_notice_{10 * ns_per_s};
  NoticeLimiter notice_limiter_;
  NoticeRateLimiter<NoticeKind> capacity_notices_;
  MapFigures figures_;
  MapHealth health_;
  bool has_pose_ = false;
  Pose map_from_body_;
  std::int64_t pose_stamp_ns_ = no_stamp_ns;
  std::uint32_t mapper_beats_ = 0;
  std::int64_t mapper_beat_ns_ = no_stamp_ns;  ///< since when there are so many
  bool is_mapper_hung_ = false;
  bool was_mapper_left_ = false;
  bool is_archive_stalled_ = false;
  std::uint64_t dropped_before_stall_ = 0;
  ScanLatency latency_;
  bool has_loop_ = false;
  LoopReport last_loop_;
  Counters counters_;
};

}  // namespace alces::onboard
