#include "alces_onboard/pipeline.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "alces_onboard/error.h"

namespace alces::onboard {
namespace {

MappingWorkerConfig worker_config(const PipelineConfig& config) {
  MappingWorkerConfig worker = config.mapping;
  worker.points_per_scan = config.scanner.assembler.capacity.points_per_scan;
  worker.keeps_clouds_and_paths = config.records;
  return worker;
}

ScanRecord record_of(const Scan& scan) {
  ScanRecord record;
  record.number = scan.number;
  record.reference_stamp_ns = scan.reference_stamp_ns;
  record.begin_stamp_ns = scan.begin_stamp_ns;
  record.end_stamp_ns = scan.end_stamp_ns;
  record.is_incomplete = scan.is_incomplete;
  record.profiles = scan.profiles;
  record.profiles_missing = scan.profiles_missing;
  record.rays_without_range = scan.rays_without_range;
  record.points = static_cast<std::uint32_t>(scan.points.size());
  record.head_turn_rad = scan.head_turn_rad;
  record.angle_sigma_rad = scan.angle_sigma_rad;
  record.has_odometry = scan.has_odometry;
  record.odometry_from_body = scan.odometry_from_body;
  record.has_gps = scan.has_gps;
  record.gps_position_m = scan.gps_position_m;
  return record;
}

LoopRecord record_of(const LoopReport& loop, std::int64_t stamp_ns) {
  LoopRecord record;
  record.stamp_ns = stamp_ns;
  record.first = loop.first;
  record.last = loop.last;
  record.is_closed = loop.verdict == LoopVerdict::closed;
  record.verdict = to_string(loop.verdict);
  record.distance_m = loop.distance_m;
  record.overlap = loop.overlap;
  record.rms_m = loop.rms_m;
  record.mahalanobis2 = loop.mahalanobis2;
  record.correction_m = loop.correction_m;
  record.correction_rad = loop.correction_rad;
  record.iterations = loop.iterations;
  return record;
}

GraphEdgeRecord record_of(const Edge& edge, std::int64_t stamp_ns) {
  return {stamp_ns,           edge.from,          edge.to,
          edge.closes_loop,   edge.from_from_to,  edge.variance.x_m2,
          edge.variance.y_m2, edge.variance.z_m2, edge.variance.rotation_rad2};
}

/// All counters of a part of the scanner, as a struct with visit().
struct PartCounters {
  const Scanner& scanner;
  ScannerPart part;
  template <class Visitor>
  void visit(Visitor&& visit) const {
    scanner.visit_counters(part, visit);
  }
};

/// The mapper's, which its results carry.
struct FigureCounters {
  const MapFigures& figures;
  const MapHealth& health;
  std::int64_t pose_age_ns;  ///< of the newest scan in the map
  template <class Visitor>
  void visit(Visitor&& visit) const {
    visit("scans", std::uint64_t{figures.scans});
    visit("pool_bytes", figures.pool_bytes);
    visit("archive_bytes", figures.archive_bytes);
    visit("archived_scans", std::uint64_t{figures.archived_scans});
    visit("pose_age_ms", static_cast<std::uint64_t>(pose_age_ns / ns_per_ms));
    visit("verdict", static_cast<std::uint64_t>(health.verdict));  // 0 good, 1 doubtful, 2 bad
    visit("parts", std::uint64_t{health.parts});
    visit("steps_on_odometry", std::uint64_t{health.on_odometry});
    visit("steps_against_odometry", std::uint64_t{health.against_odometry});
  }
};

/// The map has become what `health` says. Whole sentences, for a notice puts none together.
const char* sentence(const MapHealth& health) {
  const bool is_bad = health.verdict == MapVerdict::bad;
  switch (health.doubt) {
    case MapDoubt::none:
      break;
    case MapDoubt::parts:
      return "the map is bad until loops join its parts; parts";
    case MapDoubt::unmatched_revisits:
      return is_bad ? "the map is bad: scans of places that should be visited again do not fit; refused loops"
                    : "the map is doubtful: scans of places that should be visited again do not fit; refused "
                      "loops";
    case MapDoubt::drift:
      return is_bad
                 ? "the map is bad: its steps can be off by more than a map may; expected error in mm"
                 : "the map is doubtful: its steps can be off by more than a map may; expected error in mm";
    case MapDoubt::odometry_alone:
      return is_bad ? "the map is bad: too many steps stand on odometry alone; steps"
                    : "the map is doubtful: too many steps stand on odometry alone; steps";
    case MapDoubt::odometry_contradicted:
      return "the map is doubtful until loops confirm the steps that were believed against the odometry; "
             "steps";
    case MapDoubt::odometry_scale:
      return "the map is doubtful: the scans see another way driven than the odometry; metres a kilometre of "
             "odometry";
    case MapDoubt::steep:
      return "the map is doubtful: it is steeper than vehicles with wheels drive; tilt in degrees";
    case MapDoubt::weak_steps:
      return "the map is doubtful: scans whose surfaces fit badly are held by odometry as much as by their "
             "match; "
             "steps";
    case MapDoubt::searched:
      return "the map is doubtful: too many steps had to be searched for; steps";
  }
  return "the map is worse than before";
}

std::uint64_t figure(const MapHealth& health) {
  switch (health.doubt) {
    case MapDoubt::none:
      return 0;
    case MapDoubt::parts:
      return health.parts;
    case MapDoubt::unmatched_revisits:
      return health.unmatched;
    case MapDoubt::drift:
      return static_cast<std::uint64_t>(std::llround(1000 * health.expected_error_m));
    case MapDoubt::odometry_alone:
      return health.on_odometry;
    case MapDoubt::odometry_contradicted:
      return health.against_odometry;
    case MapDoubt::odometry_scale:
      return static_cast<std::uint64_t>(std::llround(1000 * health.odometry_scale));
    case MapDoubt::steep:
      return static_cast<std::uint64_t>(std::llround(health.tilt_rad * 180 / std::numbers::pi));
    case MapDoubt::weak_steps:
      return health.weak;
    case MapDoubt::searched:
      return health.found;
  }
  return 0;
}

}  // namespace

PipelineMemory Pipeline::memory_required(const PipelineConfig& config) {
  PipelineMemory memory;
  memory.scanner_bytes = Scanner::memory_required(config.scanner);
  if (config.maps) {
    memory.mapper_bytes = Mapper::memory_required(config.mapping.mapper);
    memory.beside_mapper_bytes = MappingWorker::memory_beside_mapper(worker_config(config));
  }
  if (config.records) memory.recorder_bytes = RecordingWriter::memory_required(config.recording);
  return memory;
}

Pipeline::Pipeline(const PipelineConfig& config, const Dependencies& dependencies)
    : config_(config),
      listener_(dependencies.listener),
      page_(dependencies.page),
      capacity_notices_(*this, "mapper") {
  if (config.records && dependencies.recording != nullptr) {
    recorder_block_.emplace(RecordingWriter::memory_required(config.recording));
    RecordingStatus status = RecordingStatus::ok;
    recorder_ = RecordingWriter::create(recorder_block_->bytes(), config.recording, *dependencies.recording,
                                        this, status);
    if (recorder_ == nullptr)
      throw Error(ExitStatus::configuration, std::string("recording: ") + to_string(status));
    is_recording_ = true;
  }
  if (config.maps) {
    if (config.mapping.scan_slots == 0)
      throw Error(ExitStatus::configuration, "there must be a slot for a scan that waits for the mapper");
    worker_ = std::make_unique<MappingWorker>(worker_config(config), dependencies.archive, dependencies.clock,
                                              dependencies.page);
    if (worker_->status() != Status::ok)
      throw Error(ExitStatus::configuration,
                  std::string("the mapper does not take these settings: ") + to_string(worker_->status()));
  } else {
    is_mapping_finished_ = true;
  }
  scanner_block_.emplace(Scanner::memory_required(config.scanner));
  AssemblerStatus status = AssemblerStatus::ok;
  scanner_ =
      Scanner::create(scanner_block_->bytes(), config.scanner, dependencies.ports, *this, *this, status);
  if (scanner_ == nullptr) {
    const char* const wrong = validate(config.scanner);
    throw Error(ExitStatus::configuration, std::string("the scanner does not take these settings: ") +
                                               (wrong != nullptr ? wrong : to_string(status)));
  }
}

void Pipeline::start_mapping_thread() {
  if (worker_) worker_->start_thread();
}

void Pipeline::stop_scanner() {
  Event stop;
  stop.kind = EventKind::stop;
  stop.stamp_ns = now_ns_;
  on_event(stop);
}

void Pipeline::on_event(const Event& event) {
  if (event.kind == EventKind::tick && is_sane_stamp(event.stamp_ns)) now_ns_ = event.stamp_ns;
  if (is_ended_) {
    ++counters_.events_after_end;
    take_results();
    if (event.kind == EventKind::tick) watch_mapper();
    publish(event);
    return;
  }
  if (is_recording_) recorder_->on_event(event);
  scanner_->on_event(event);
  publish(event);
  take_results();
  if (event.kind == EventKind::tick) watch_mapper();
  if (event.kind == EventKind::tick && is_recording_) watch_recording();
}

// The odometry's frames and every tick: so readers see it at the rate of the ticks at least.
void Pipeline::publish(const Event& event) {
  const bool is_tick = event.kind == EventKind::tick;
  if (page_ == nullptr || !(is_tick || event.kind == EventKind::can_frame) || !is_sane_stamp(event.stamp_ns))
    return;
  const Odometry* const odometry = config_.scanner.has_odometry ? &scanner_->odometry() : nullptr;
  if (is_tick || (odometry != nullptr && odometry->counters().nodes != nodes_published_)) {
    if (odometry != nullptr) nodes_published_ = odometry->counters().nodes;
    page_->publish_odometry(odometry, config_.scanner.odometry.errors, event.stamp_ns);
  }
  if (!is_tick ||
      (status_published_ns_ != no_stamp_ns && event.stamp_ns - status_published_ns_ < status_interval_ns))
    return;
  status_published_ns_ = event.stamp_ns;
  page_->publish_status(status(), event.stamp_ns);
}

void Pipeline::raise(const Notice& notice) {
  std::uint64_t held_back = 0;
  if (!notice_limiter_.may(notice, held_back)) {
    ++counters_.notices_held_back;
    return;
  }
  if (held_back > 0) {
    tell({notice.stamp_ns, Severity::warning, notice.source,
          "raises so many notices that most are held back; since the last",
          static_cast<std::int64_t>(held_back), true});
  }
  tell(notice);
}

void Pipeline::tell(const Notice& notice) {
  ++counters_.notices;
  if (is_recording_) recorder_->write_notice(notice);
  if (listener_ != nullptr) listener_->raise(notice);
}

void Pipeline::answer(const ScanRecord& scan, const char* verdict, std::uint64_t& counter) {
  ++counter;
  if (!is_recording_) return;
  ScanRecord record = scan;
  record.verdict = verdict;
  recorder_->write_scan_info(record);
}

void Pipeline::on_scan(const Scan& scan) {
  scan_stamps_ns_[counters_.scans % rate_scans] = scan.end_stamp_ns;
  ++counters_.scans;
  const ScanRecord record = record_of(scan);
  if (scan.is_incomplete && !config_.maps_incomplete_scans) {
    answer(record, "incomplete", counters_.scans_incomplete);
    return;
  }
  if (!worker_) {
    answer(record, "not mapped: told not to", counters_.scans_not_wanted);
    return;
  }
  ScanSlot* const slot = worker_->claim_scan();
  if (slot == nullptr || scan.points.size() > slot->room.size()) {
    answer(record, "dropped: the mapper was busy", counters_.scans_dropped);
    if (drop_notice_.may(now_ns_)) {
      raise({now_ns_, Severity::warning, "mapper",
             "is behind: scans are dropped, the raw data is still recorded; scans dropped so far",
             static_cast<std::int64_t>(counters_.scans_dropped), true});
    }
    return;
  }
  slot->scan = record;
  std::ranges::copy(scan.points, slot->room.begin());
  slot->point_count = record.points;
  worker_->publish_scan();
}

void Pipeline::take_results() {
  if (!worker_) return;
  while (const MapResult* const result = worker_->front_result()) {
    on_result(*result);
    worker_->pop_result();
  }
}

void Pipeline::on_result(const MapResult& result) {
  figures_ = result.figures;
  if (result.scan.was_mapped) {
    ++counters_.scans_mapped;
    if (result.report.is_predicted) ++counters_.scans_predicted;
    if (result.status == Status::no_voxel_capacity) {
      ++counters_.scans_thinned;
      say(NoticeKind::thinned,
          "a scan has more cells than voxel.cell_capacity and is downsampled coarser; its cell in mm",
          static_cast<std::uint64_t>(
              std::lround(1000.0 * static_cast<double>(result.report.points.cell_size_m))));
    }
    if (result.latency_ns > 0) latency_.add(result.latency_ns);
    has_pose_ = true;
    map_from_body_ = result.map_from_body;
    pose_stamp_ns_ = result.scan.reference_stamp_ns;
  } else if (result.scan.verdict.starts_with("dropped")) {
    ++counters_.scans_left;
  } else if (result.scan.verdict.starts_with("not mapped")) {
    ++counters_.scans_not_wanted;
  } else if (!result.is_end) {
    ++counters_.scans_refused;
  }
  if (result.has_loop) {
    const bool is_closed = result.loop.verdict == LoopVerdict::closed;
    ++(is_closed ? counters_.loops_closed : counters_.loops_refused);
    if (result.loop.verdict == LoopVerdict::refused_capacity)
      say(NoticeKind::loops, "has no room for another loop: none is closed any more (loop_capacity); closed",
          counters_.loops_closed);
    if (is_closed && recorder_ != nullptr && !result.has_path) {
      ++counters_.paths_skipped;
      say(NoticeKind::paths, "a path is not recorded, because the one before waits for the recorder; so far",
          counters_.paths_skipped);
    }
    has_loop_ = true;
    last_loop_ = result.loop;
  }
  if (result.edges_left_out > 0) {
    counters_.edges_skipped += result.edges_left_out;
    say(NoticeKind::edges, "edges of the graph are not recorded: more at once than there is room for; so far",
        counters_.edges_skipped);
  }
  if (result.report.archive_failed ||
      (result.has_loop && result.loop.verdict == LoopVerdict::refused_archive))
    say(NoticeKind::archive_loss,
        "scans cannot be brought back from the archive, and are not matched with; so far",
        ++counters_.archive_losses);
  watch_health(result);
  if (is_recording_) record_result(result);
  if (result.has_path) worker_->take_path();
  if (result.is_map_full && !is_map_full_) {
    is_map_full_ = true;
    raise({now_ns_, Severity::error, "mapper", to_string(result.status)});
    raise({now_ns_, Severity::error, "mapper",
           "the map is full and ends here; recording goes on, and alces replay can map all of it. Scans in "
           "the map",
           result.figures.scans, true});
  }
  if (result.is_end) is_mapping_finished_ = true;
}

void Pipeline::watch_health(const MapResult& result) {
  const MapVerdict before = health_.verdict;
  health_ = result.health;
  if (result.scan.was_mapped && result.report.step == StepVerdict::apart)
    say(NoticeKind::part,
        "a new part of the map begins: the scan fits none before it, and no odometry says where it is; parts",
        health_.parts);
  if (result.scan.was_mapped && result.report.step == StepVerdict::against_odometry)
    say(NoticeKind::contradiction,
        "a scan lies where the odometry says that it cannot; such scans that no loop has confirmed",
        health_.against_odometry);
  if (health_.verdict > before)
    say(health_.verdict == MapVerdict::bad ? NoticeKind::bad : NoticeKind::doubtful, sentence(health_),
        figure(health_));
}

// By this thread's clock: the other one may not come to look at any.
void Pipeline::watch_mapper() {
  if (!worker_) return;
  watch_archive();
  const std::uint32_t beats = worker_->beats();
  if (beats != mapper_beats_ || !worker_->is_busy() || mapper_beat_ns_ == no_stamp_ns) {
    if (is_mapper_hung_)
      raise({now_ns_, Severity::info, "mapper", "is back; the map goes on. Scans dropped so far",
             static_cast<std::int64_t>(counters_.scans_dropped), true});
    mapper_beats_ = beats;
    mapper_beat_ns_ = now_ns_;
    is_mapper_hung_ = false;
    return;
  }
  const std::int64_t since_ns = now_ns_ - mapper_beat_ns_;
  if (since_ns < config_.mapping_timeout_ns) return;
  if (!is_mapper_hung_) ++counters_.mapper_hangs;
  is_mapper_hung_ = true;
  say(NoticeKind::hang,
      "does not come back from a scan (is the disk of its archive stalled?); recording goes on. Seconds so "
      "far",
      static_cast<std::uint64_t>(since_ns / ns_per_s), Severity::error);
}

void Pipeline::watch_archive() {
  const bool is_stalled = worker_->is_archive_stalled();
  counters_.archive_retries = worker_->archive_retries();
  if (is_stalled) {
    if (!is_archive_stalled_) {
      ++counters_.archive_stalls;
      dropped_before_stall_ = counters_.scans_dropped;
    }
    say(NoticeKind::archive, "the scan archive cannot be written; make room on its disk. Scans wait",
        worker_->waiting_scans(), Severity::error);
  } else if (is_archive_stalled_) {
    raise({now_ns_, Severity::info, "mapper", "the scan archive is written again; scans dropped meanwhile",
           static_cast<std::int64_t>(counters_.scans_dropped - dropped_before_stall_), true});
  }
  is_archive_stalled_ = is_stalled;
}

std::int64_t Pipeline::pose_age_ns() const {
  return has_pose_ ? std::max<std::int64_t>(0, now_ns_ - pose_stamp_ns_) : 0;
}

void Pipeline::say(NoticeKind kind, const char* text, std::uint64_t count, Severity severity) {
  capacity_notices_.raise(kind, severity, now_ns_, text, static_cast<std::int64_t>(count));
}

void Pipeline::record_result(const MapResult& result) {
  const std::int64_t stamp_ns = result.is_end ? now_ns_ : result.scan.reference_stamp_ns;
  if (!result.is_end) recorder_->write_scan_info(result.scan);
  if (result.scan.was_mapped) {
    recorder_->write_pose({stamp_ns, result.map_from_body});
    if (!result.cloud.empty()) recorder_->write_cloud({stamp_ns, result.cloud});
  }
  for (const Edge& edge : std::span(result.edges).first(result.edge_count))
    recorder_->write_edge(record_of(edge, stamp_ns));
  if (result.has_loop) recorder_->write_loop(record_of(result.loop, stamp_ns));
  if (result.has_path) recorder_->write_path({stamp_ns, worker_->path_stamps_ns(), worker_->path()});
}

void Pipeline::record_counters() {
  counters_recorded_ns_ = now_ns_;
  recorder_->write_counters(now_ns_, "pipeline", counters_);
  for (std::uint8_t part = 0; part < static_cast<std::uint8_t>(ScannerPart::count); ++part) {
    const auto which = static_cast<ScannerPart>(part);
    recorder_->write_counters(now_ns_, to_string(which), PartCounters{*scanner_, which});
  }
  if (worker_) recorder_->write_counters(now_ns_, "map", FigureCounters{figures_, health_, pose_age_ns()});
  recorder_->write_counters(now_ns_, "recording", recorder_->counters());
  recorder_->write_counters(now_ns_, "recording file", recorder_->file_counters());
}

void Pipeline::watch_recording() {
  if (counters_recorded_ns_ == no_stamp_ns) counters_recorded_ns_ = now_ns_;
  if (now_ns_ - counters_recorded_ns_ >= config_.counters_interval_ns) record_counters();
  const std::uint64_t limit_bytes = config_.recording_limit_bytes;
  if (limit_bytes == 0 ||
      recorder_->file_counters().bytes_written + config_.recording.chunk_bytes < limit_bytes)
    return;
  raise({now_ns_, Severity::warning, "recording", "has reached its limit and ends here; size in bytes",
         static_cast<std::int64_t>(recorder_->file_counters().bytes_written), true});
  is_recording_ = false;
}

void Pipeline::end_events() {
  if (is_ended_) return;
  scanner_->finish();
  is_ended_ = true;
  if (worker_) worker_->close();
}

void Pipeline::abandon_mapping() {
  if (worker_) worker_->abandon();
}

bool Pipeline::finish_recording() {
  // A mapping that is not finished is not waited for: its thread hangs.
  constexpr std::int64_t last_steps_ns = ns_per_s;  // from the last result to the thread's end
  if (worker_) was_mapper_left_ = !worker_->join_within(is_mapping_finished_ ? last_steps_ns : 0);
  if (recorder_ == nullptr) return true;
  if (is_recording_) record_counters();
  is_recording_ = false;
  return recorder_->finish();
}

StatusReport Pipeline::status() const {
  StatusReport report;
  report.phase = to_string(scanner_->phase());
  report.reason = scanner_->reason();
  report.is_scanning = scanner_->phase() == ScannerPhase::scanning;
  report.scans = counters_.scans;
  report.scans_dropped = counters_.scans_dropped;
  report.scans_incomplete = counters_.scans_incomplete;
  const std::uint64_t known = std::min<std::uint64_t>(counters_.scans, rate_scans);
  if (known >= 2) {
    const std::int64_t newest_ns = scan_stamps_ns_[(counters_.scans - 1) % rate_scans];
    const std::int64_t oldest_ns = scan_stamps_ns_[(counters_.scans - known) % rate_scans];
    const double rate = static_cast<double>(known - 1) / std::max(seconds(newest_ns - oldest_ns), 1e-3);
    // three scans overdue: there are none
    if (seconds(now_ns_ - newest_ns) * rate < 3) report.scans_per_s = rate;
  }
  report.is_mapping = worker_ != nullptr;
  report.is_map_full = is_map_full_;
  report.scans_mapped = figures_.scans;
  report.scan_capacity = config_.mapping.mapper.scan_capacity;
  report.has_pose = has_pose_;
  report.map_from_body = map_from_body_;
  report.pose_age_ns = pose_age_ns();
  report.is_archive_stalled = is_archive_stalled_;
  if (is_mapper_hung_) report.mapper_hung_ns = now_ns_ - mapper_beat_ns_;
  report.loops_closed = static_cast<std::uint32_t>(counters_.loops_closed);
  report.loops_refused = static_cast<std::uint32_t>(counters_.loops_refused);
  report.latency_median_ns = latency_.median_ns();
  report.latency_worst_ns = latency_.worst_ns();
  report.health = health_;
  report.has_loop = has_loop_;
  report.last_loop = last_loop_;
  if (worker_) {
    report.waiting_scans = worker_->waiting_scans();
    report.scan_slots = worker_->scan_slots();
  }
  report.pool_used_bytes = figures_.pool_bytes;
  report.pool_bytes = config_.mapping.mapper.pool_bytes;
  report.archive_bytes = figures_.archive_bytes;
  report.is_recording = is_recording_;
  if (recorder_ != nullptr) {
    report.is_recording_stalled = is_recording_ && recorder_->is_stalled();
    report.recording_bytes = recorder_->file_counters().bytes_written;
  }
  return report;
}

}  // namespace alces::onboard
