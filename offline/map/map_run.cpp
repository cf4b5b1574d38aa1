#include "map_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>

#include "offline/io/files/byte_size.h"

namespace alces::offline {
namespace {

using Clock = std::chrono::steady_clock;

double elapsed_s_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// A cell of 0.1F is one of 0.1 m, not of 0.100000001 m.
double metres(float cell_size_m) {
  return std::round(1e6 * static_cast<double>(cell_size_m)) / 1e6;
}

MapperConfig complete(const MapRequest& request, const std::string& back_end, ScanSource& scans) {
  MapperConfig config = request.config;
  if (back_end == "none") config.close_loops = false;
  config.keep_intensity = true;
  constexpr std::size_t most_scans = 100'000'000;  // a scan costs memory: this is far beyond any block
  if (config.scan_capacity == 0)
    config.scan_capacity = static_cast<std::uint32_t>(std::clamp<std::size_t>(scans.size(), 1, most_scans));
  fit_cell_capacity(config, request.memory_bytes, scans, request.is_stopped);
  return config;
}

}  // namespace

MapRun::MapRun(ScanSource& scans, const MapRequest& request)
    : scans_(scans),
      archive_file_(request.archive),
      loop_back_end_(request.config.close_loops ? request.loop_back_end : "none"),
      config_(complete(request, loop_back_end_, scans)),
      plan_(plan_memory(config_, request.memory_bytes)),
      block_(plan_.block_bytes),
      own_relaxation_(make_graph_relaxation(loop_back_end_)),
      relaxation_(request.relaxation != nullptr ? request.relaxation : own_relaxation_.get()),
      deskew_(request.deskew) {
  if (archive_file_) archive_ = std::make_unique<FileArchive>(*archive_file_, config_.scan_capacity);
  Status status = Status::ok;
  mapper_ = Mapper::create(block_.bytes(), config_, status, archive_.get(), &clock_, relaxation_);
  if (mapper_ == nullptr)
    throw UsageError(fmt::format("the mapper does not take these settings: {}; see docs/examples/map.toml",
                                 to_string(status)));
  mapped_.reserve(config_.scan_capacity);
}

void MapRun::run(const Callbacks& callbacks) {
  const Clock::time_point begin = Clock::now();
  ScanPoints scan;
  for (std::size_t index = 0; index < scans_.size(); ++index) {
    if (const int signal = callbacks.stop_signal ? callbacks.stop_signal() : 0; signal != 0) {
      problem_ = Error(fmt::format("{} after {} of {} scans; the map ends there",
                                   signal == SIGINT ? "interrupted" : "told to stop", index, scans_.size()),
                       128 + signal);  // as shells say it: 130 for SIGINT, 143 for SIGTERM
      break;
    }
    const Clock::time_point read_begin = Clock::now();
    try {
      if (index == 0) begin_with_velocity();
      if (!read(index, scan)) break;
    } catch (const Error& error) {
      problem_ = error;
      break;
    }
    read_wait_s_ += elapsed_s_since(read_begin);
    deskew_.deskew(scans_, index, scan);
    if (!add(index, scan)) break;
    if (callbacks.progress) callbacks.progress(index + 1, scans_.size());
  }
  const Clock::time_point finish_begin = Clock::now();
  LoopReport loop;
  StageTimes finish_times;
  if (mapper_->finish(loop, &finish_times) && !mapped_.empty()) {  // listed in loops(); the last scan's time
    mapped_.back().times.loop_match_ns += finish_times.loop_match_ns;
    mapped_.back().times.loop_share_ns += finish_times.loop_share_ns;
  }
  mapping_s_ += elapsed_s_since(finish_begin);
  remember_loops();
  wall_s_ = elapsed_s_since(begin);
}

// False: the run ends here.
bool MapRun::add(std::size_t index, const ScanPoints& scan) {
  const Clock::time_point begin = Clock::now();
  const std::optional<Pose> odometry = scans_.odometry(index);
  ScanReport report;
  const Status status =
      mapper_->add_scan(scan.points, odometry ? &*odometry : nullptr, report, nullptr, scan.intensity);
  mapping_s_ += elapsed_s_since(begin);
  switch (status) {
    case Status::ok:
    case Status::no_voxel_capacity:
      if (status == Status::no_voxel_capacity) ++thinned_scans_;
      coarsest_cell_m_ = std::max(coarsest_cell_m_, metres(report.points.cell_size_m));
      mapped_.push_back({index, report.times, report.points.kept, metres(report.points.cell_size_m),
                         status == Status::no_voxel_capacity, report.iterations, report.correspondences,
                         report.overlap, report.rms_m, report.is_predicted, report.doubt, report.fit,
                         report.surfaces, report.held});
      has_intensity_ = has_intensity_ || !scan.intensity.empty();
      observe_step(report);
      remember_loops();
      break;
    case Status::no_scan_capacity:
    case Status::no_point_capacity:
    case Status::no_edge_capacity:
      problem_ = capacity_problem(index, status);
      return false;
    case Status::archive_write_failed:
      ++archive_write_failures_;
      problem_ = OutputError(archive_->problem());
      return false;
    case Status::archive_read_failed:
      problem_ = InputError(archive_->problem());
      return false;
    default:
      refused_.push_back({index, status});
  }
  if (archive_ && !archive_->problem().empty()) {
    problem_ = InputError(archive_->problem());
    return false;
  }
  return true;
}

bool MapRun::read(std::size_t index, ScanPoints& scan) {
  if (index >= read_ahead_.size()) return scans_.read(index, scan);
  scan = std::move(read_ahead_[index]);
  return true;
}

// Where only steps tell the velocity, the first scans would stay as they are, and all others be matched to
// them. So these two are matched first, alone and in the same memory: skewed alike, they tell nearly the true
// step, and deskewed by it a better one.
void MapRun::begin_with_velocity() {
  ScanPoints scan;
  if (scans_.size() < 2 || !scans_.read(0, scan)) return;
  read_ahead_.push_back(scan);
  if (!deskew_.needs_first_step(scans_, scan)) return;
  try {
    if (!scans_.read(1, scan)) return;
  } catch (const Error&) {
    return;  // whoever maps it is told
  }
  read_ahead_.push_back(scan);
  Status status = Status::ok;
  for (int round = 0; round < 2; ++round) {
    Mapper* const trial = Mapper::create(block_.bytes(), config_, status, nullptr, nullptr, nullptr);
    bool is_matched = trial != nullptr;
    for (std::size_t i = 0; i < 2 && is_matched; ++i) {
      scan = read_ahead_[i];
      (void)deskew_.deskew_uncounted(scan);  // not in the first round
      ScanReport report;
      status = trial->add_scan(scan.points, nullptr, report);
      is_matched = (status == Status::ok || status == Status::no_voxel_capacity) && !report.is_predicted;
    }
    if (!is_matched) break;
    deskew_.observe_first_step(scans_, read_ahead_[0], read_ahead_[1],
                               trial->graph().edges().back().from_from_to);
  }
  mapper_ = Mapper::create(block_.bytes(), config_, status, archive_.get(), &clock_, relaxation_);
}

// For the velocity: the step as it was matched, before a loop bends it.
void MapRun::observe_step(const ScanReport& report) {
  if (report.scan == 0 || report.is_predicted) return;
  const std::span<const Edge> edges = mapper_->graph().edges();
  const auto step = std::find_if(edges.rbegin(), edges.rend(), [&report](const Edge& edge) {
    return !edge.closes_loop && edge.to == report.scan;
  });
  if (step != edges.rend()) deskew_.observe_step(&step->from_from_to);
}

// The mapper tells of a loop once it is closed, and then the poses are bent already. What they were is known
// from a copy that is made anew only when a loop was closed, and is longer by one scan otherwise.
void MapRun::remember_loops() {
  const PoseGraph& graph = mapper_->graph();
  for (; edges_seen_ < graph.edge_count(); ++edges_seen_) {
    const Edge& edge = graph.edges()[edges_seen_];
    if (!edge.closes_loop) poses_before_.push_back(poses_before_[edge.from] * edge.from_from_to);
  }
  if (poses_before_.empty() && graph.vertex_count() > 0) poses_before_.push_back(graph.poses()[0]);
  for (std::size_t i = first_from_last_before_.size(); i < mapper_->loops().size(); ++i) {
    const LoopReport& loop = mapper_->loops()[i];
    first_from_last_before_.push_back(poses_before_[loop.first].inverse() * poses_before_[loop.last]);
  }
  if (mapper_->counters().loops_closed == loops_closed_seen_) return;
  loops_closed_seen_ = mapper_->counters().loops_closed;
  poses_before_.assign(graph.poses().begin(), graph.poses().end());
}

Error MapRun::capacity_problem(std::size_t index, Status status) const {
  const std::string where =
      fmt::format("at {} ({} of {} scans mapped)", scans_.name(index), mapped_.size(), scans_.size());
  if (status == Status::no_scan_capacity)
    return CapacityError(fmt::format(
        "the {} scans that there is room for are reached {}; raise memory.scan_capacity in --config, or "
        "leave it 0",
        config_.scan_capacity, where));
  if (status == Status::no_edge_capacity)
    return CapacityError(
        fmt::format("the room for edges is full {}; raise memory.loop_capacity in --config", where));
  // as the scans so far, with a tenth to spare
  const double mapped = static_cast<double>(std::max<std::size_t>(mapped_.size(), 1));
  const double pool_bytes =
      1.1 * static_cast<double>(plan_.pool_bytes) * static_cast<double>(scans_.size()) / mapped;
  const double mib =
      (static_cast<double>(plan_.block_bytes - plan_.pool_bytes) + pool_bytes) / (1024.0 * 1024);
  return CapacityError(
      fmt::format("the point pool of {} is full {}: give --memory of about {:.0f} MiB, or --archive FILE",
                  format_byte_size(plan_.pool_bytes), where, std::ceil(mib)));
}

Trajectory MapRun::trajectory() const {
  Trajectory trajectory;
  const std::span<const Pose> poses = mapper_->graph().poses();
  trajectory.poses.assign(poses.begin(), poses.end());
  trajectory.has_time = std::all_of(mapped_.begin(), mapped_.end(), [this](const MappedScan& scan) {
    return scans_.stamp_s(scan.source_index).has_value();
  });
  for (const MappedScan& scan : mapped_) {
    trajectory.stamps_s.push_back(trajectory.has_time
                                      ? *scans_.stamp_s(scan.source_index)
                                      : static_cast<double>(scans_.number(scan.source_index)));
  }
  return trajectory;
}

Trajectory MapRun::trajectory_without_loops() const {
  Trajectory trajectory = MapRun::trajectory();
  for (const Edge& edge : mapper_->graph().edges()) {
    if (!edge.closes_loop) trajectory.poses[edge.to] = trajectory.poses[edge.from] * edge.from_from_to;
  }
  return trajectory;
}

double MapRun::length_m() const {
  const std::span<const Pose> poses = mapper_->graph().poses();
  double length_m = 0;
  for (std::size_t i = 1; i < poses.size(); ++i)
    length_m += (poses[i].translation_m - poses[i - 1].translation_m).norm();
  return length_m;
}

std::vector<std::string> MapRun::warnings() const {
  std::vector<std::string> warnings = scans_.warnings();
  for (const RefusedScan& scan : refused_)
    warnings.push_back(
        fmt::format("{} is left out: {}", scans_.name(scan.source_index), to_string(scan.reason)));
  const auto predicted =
      std::count_if(mapped_.begin(), mapped_.end(), [](const MappedScan& scan) { return scan.is_predicted; });
  if (predicted > 0)
    warnings.push_back(
        fmt::format("{} {} not be matched to those before and {} where the motion so far puts {}", predicted,
                    predicted == 1 ? "scan could" : "scans could", predicted == 1 ? "stands" : "stand",
                    predicted == 1 ? "it" : "them"));
  if (thinned_scans_ > 0)
    warnings.push_back(fmt::format(
        "{} {} more than {} cells of {} m, thinned coarser: {}cell of {:.3g} m; give more --memory, "
        "or change voxel.cell_capacity or voxel.cell_size_m in --config",
        thinned_scans_, thinned_scans_ == 1 ? "scan has" : "scans have", config_.voxel.cell_capacity,
        config_.voxel.cell_size_m, thinned_scans_ == 1 ? "" : "largest ", coarsest_cell_m_));
  if (mapper_->counters().loops_not_listed > 0)
    warnings.push_back(fmt::format("{} loops are not listed; raise memory.loop_capacity in --config",
                                   mapper_->counters().loops_not_listed));
  if (mapper_->counters().loops_not_relaxed > 0)
    warnings.push_back(fmt::format(
        "{} of {} loops were shared out by LOA, for the optimiser in its place could not: {}",
        mapper_->counters().loops_not_relaxed, mapper_->counters().loops_closed, relaxation_->problem()));
  return warnings;
}

std::string MapRun::name_in_source(std::uint32_t scan) const {
  return scans_.name(mapped_[scan].source_index);
}

}  // namespace alces::offline
