#include "alces_onboard/mapping_worker.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "alces/arena.h"

namespace alces::onboard {
namespace {

/// What lies beside the mapper, laid out or counted by the same lines.
struct Room {
  Room(Arena& arena, const MappingWorkerConfig& config)
      : scans(arena.allocate<Point>(std::size_t{config.scan_slots} * config.points_per_scan)),
        stamps(arena.allocate<std::int64_t>(config.mapper.scan_capacity)) {
    if (!config.keeps_clouds_and_paths) return;
    clouds = arena.allocate<Point>(std::size_t{config.scan_slots} * config.mapper.voxel.cell_capacity);
    path_poses = arena.allocate<Pose>(config.mapper.scan_capacity);
    path_stamps = arena.allocate<std::int64_t>(config.mapper.scan_capacity);
  }
  std::span<Point> scans;
  std::span<std::int64_t> stamps;
  std::span<Point> clouds;
  std::span<Pose> path_poses;
  std::span<std::int64_t> path_stamps;
};

/// Looking at all of the map takes as long as it has scans: where nothing happens, seldom.
constexpr std::uint32_t scans_between_judgements = 50;

bool ends_map(Status status) {
  return status == Status::no_scan_capacity || status == Status::no_point_capacity ||
         status == Status::no_edge_capacity;
}

}  // namespace

std::size_t MappingWorker::memory_beside_mapper(const MappingWorkerConfig& config) {
  Arena arena;
  const Room room(arena, config);
  return arena.overflowed() || !room.scans.empty() ? SIZE_MAX : arena.used_bytes();
}

MappingWorker::MappingWorker(const MappingWorkerConfig& config, ScanArchive* archive, StageClock* clock,
                             LivePage* page)
    : config_(config),
      mapper_block_(Mapper::memory_required(config.mapper)),
      room_block_(memory_beside_mapper(config)),
      scan_slots_(config.scan_slots),
      result_slots_(config.scan_slots),
      scans_(scan_slots_),
      results_(result_slots_),
      clock_(clock),
      page_(page) {
  Arena arena(room_block_.bytes());
  const Room room(arena, config);
  for (std::size_t i = 0; i < scan_slots_.size(); ++i) {
    scan_slots_[i].room = room.scans.subspan(i * config.points_per_scan, config.points_per_scan);
    if (!room.clouds.empty()) {
      const std::size_t cells = config.mapper.voxel.cell_capacity;
      result_slots_[i].room = room.clouds.subspan(i * cells, cells);
    }
  }
  stamps_ = room.stamps;
  path_poses_ = room.path_poses;
  path_stamps_ = room.path_stamps;
  mapper_ = Mapper::create(mapper_block_.bytes(), config.mapper, status_, archive, clock);
}

MappingWorker::~MappingWorker() {
  if (!thread_.is_running()) return;
  abandon();
  close();
  while (!is_finished()) {
    if (front_result() != nullptr) pop_result();
    std::this_thread::yield();
  }
}

void MappingWorker::start_thread() {
  thread_.start([this] { run(); });
}

void MappingWorker::publish_scan() {
  scans_.publish();
  bell_.ring();
}

void MappingWorker::pop_result() {
  results_.pop();
  bell_.ring();
}

void MappingWorker::close() {
  is_closed_.store(true, std::memory_order_release);
  bell_.ring();
}

void MappingWorker::abandon() {
  is_abandoned_.store(true, std::memory_order_release);
}

bool MappingWorker::join_within(std::int64_t limit_ns) {
  return thread_.join_within(limit_ns);
}

void MappingWorker::run() {
  for (;;) {
    const Bell::Strokes heard = bell_.strokes();
    if (run_once()) continue;
    if (is_finished()) return;
    if (is_archive_stalled()) {
      wait_for_archive();
    } else {
      bell_.wait(heard);
    }
  }
}

// In short pieces, so that the end is not kept waiting.
void MappingWorker::wait_for_archive() const {
  for (std::int64_t slept_ns = 0;
       slept_ns < config_.archive_retry_ns && !is_abandoned_.load(std::memory_order_acquire);
       slept_ns += ns_per_ms) {
    std::this_thread::sleep_for(std::chrono::nanoseconds(ns_per_ms));
  }
}

bool MappingWorker::run_once() {
  beats_.fetch_add(1, std::memory_order_release);
  const bool has_worked = work_once();
  beats_.fetch_add(1, std::memory_order_release);
  return has_worked;
}

bool MappingWorker::work_once() {
  if (is_finished()) return false;
  const bool is_closed =
      is_closed_.load(std::memory_order_acquire);  // before looking whether there is a scan
  const ScanSlot* const slot = scans_.front();
  if (slot == nullptr && !is_closed) return false;
  MapResult* const result = results_.claim();
  if (result == nullptr) return false;
  const std::span<Point> room = result->room;
  *result = MapResult{};
  result->room = room;
  if (slot != nullptr) {
    if (!map(*slot, *result)) {
      archive_retries_.fetch_add(1, std::memory_order_relaxed);
      is_archive_stalled_.store(true, std::memory_order_release);
      return false;  // the scan stays, and so does the room for its result
    }
    is_archive_stalled_.store(false, std::memory_order_release);
    scans_.pop();
  } else {
    finish(*result);
  }
  judge_map(*result);
  result->health = health_;
  result->is_map_full = is_map_full_;
  result->figures = {mapper_->scan_count(), mapper_->store_counters().pool_bytes,
                     mapper_->store_counters().archive_bytes, mapper_->store_counters().archived_scans};
  results_.publish();
  if (slot == nullptr) is_finished_.store(true, std::memory_order_release);
  return true;
}

bool MappingWorker::map(const ScanSlot& slot, MapResult& result) {
  result.scan = slot.scan;
  if (is_abandoned_.load(std::memory_order_acquire)) {
    result.scan.verdict = "dropped: told to stop";
    return true;
  }
  if (is_map_full_) {
    result.scan.verdict = "not mapped: the map is full";
    return true;
  }
  const std::uint32_t edges_before = mapper_->graph().edge_count();
  result.status = mapper_->add_scan(slot.room.first(slot.point_count),
                                    slot.scan.has_odometry ? &slot.scan.odometry_from_body : nullptr,
                                    result.report, slot.scan.has_gps ? &slot.scan.gps_position_m : nullptr);
  if (result.status == Status::archive_write_failed) return false;
  is_map_full_ = ends_map(result.status);
  if (result.status != Status::ok && result.status != Status::no_voxel_capacity) {
    result.scan.verdict = to_string(result.status);
    return true;
  }
  result.scan.was_mapped = true;
  result.scan.verdict = result.report.is_predicted ? "mapped where the motion so far puts it"
                        : result.status == Status::no_voxel_capacity ? "mapped, downsampled coarser"
                                                                     : "mapped";
  result.scan.map_index = result.report.scan;
  result.scan.points_reduced = result.report.points.kept;
  result.has_loop = result.report.loop_offered;
  result.loop = result.report.loop;
  stamps_[result.report.scan] = slot.scan.reference_stamp_ns;
  last_scan_ = result.scan;
  publish_place(result);
  std::uint32_t count = 0;
  if (!result.room.empty() && mapper_->read_scan(result.report.scan, result.room, count) == Status::ok)
    result.cloud = result.room.first(count);
  tell_of_graph(edges_before, result);
  return true;
}

void MappingWorker::finish(MapResult& result) {
  result.is_end = true;
  if (is_abandoned_.load(std::memory_order_acquire)) return;
  const std::uint32_t edges_before = mapper_->graph().edge_count();
  result.has_loop = mapper_->finish(result.loop);
  if (result.has_loop) publish_place(result);
  tell_of_graph(edges_before, result);
}

// Of the newest scan; there is one.
void MappingWorker::publish_place(MapResult& result) {
  const std::uint32_t newest = mapper_->scan_count() - 1;
  result.map_from_body = std::as_const(*mapper_).graph().poses()[newest];
  const std::int64_t now_ns =
      clock_ != nullptr ? static_cast<std::int64_t>(clock_->now_ns()) : last_scan_.end_stamp_ns;
  if (result.scan.was_mapped) result.latency_ns = now_ns - last_scan_.end_stamp_ns;
  if (page_ == nullptr) return;
  if (result.has_loop) page_->publish_loop(result.loop, last_scan_.reference_stamp_ns, now_ns);
  page_->publish_pose({last_scan_.reference_stamp_ns, result.map_from_body, last_scan_.has_odometry,
                       last_scan_.odometry_from_body, mapper_->pose_uncertainty(newest)},
                      now_ns);
}

void MappingWorker::tell_of_graph(std::uint32_t edges_before, MapResult& result) {
  const std::span<const Edge> edges = mapper_->graph().edges().subspan(edges_before);
  result.edge_count = static_cast<std::uint32_t>(std::min(edges.size(), result.edges.size()));
  result.edges_left_out = static_cast<std::uint32_t>(edges.size()) - result.edge_count;
  std::copy_n(edges.begin(), result.edge_count, result.edges.begin());
  if (result.has_loop && result.loop.verdict == LoopVerdict::closed) copy_path(result);
}

// By what the scans were, never by the clock: the same scans are judged at the same ones.
void MappingWorker::judge_map(const MapResult& result) {
  const StepVerdict step = result.report.step;
  const bool is_usual = step == StepVerdict::first || step == StepVerdict::believed;
  const bool is_due = result.is_end || result.has_loop ||
                      (result.scan.was_mapped &&
                       (!is_usual || mapper_->scan_count() >= health_.scans + scans_between_judgements));
  if (is_due || (health_.scans == 0 && result.scan.was_mapped)) health_ = mapper_->health();
}

void MappingWorker::copy_path(MapResult& result) {
  if (path_poses_.empty() || !is_path_free_.exchange(false, std::memory_order_acquire)) return;
  const std::span<const Pose> poses = std::as_const(*mapper_).graph().poses();
  std::ranges::copy(poses, path_poses_.begin());
  std::ranges::copy(stamps_.first(poses.size()), path_stamps_.begin());
  path_count_ = static_cast<std::uint32_t>(poses.size());
  result.has_path = true;
}

}  // namespace alces::onboard
