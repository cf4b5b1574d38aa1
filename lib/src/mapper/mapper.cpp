#include "alces/mapper.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "alces/portable_math.h"

namespace alces {

Mapper* Mapper::create(std::span<std::byte> block, const MapperConfig& config, Status& status,
                       ScanArchive* archive, StageClock* clock, LoopRelaxation* relaxation) {
  MapperConfig planned = config;
  planned.detector.scan_capacity = config.scan_capacity;
  status = validate(planned);
  if (status != Status::ok) return nullptr;
  status = Status::block_misaligned;
  if (reinterpret_cast<std::uintptr_t>(block.data()) % Arena::alignment != 0) return nullptr;
  status = Status::block_too_small;
  if (block.size() < memory_required(planned)) return nullptr;
  Arena arena(block);
  // The mapper itself lies at the front of its block; memory_required() counts it the same way.
  void* const place = arena.allocate<std::byte>(sizeof(Mapper)).data();
  Mapper* const mapper = new (place) Mapper(arena, planned);
  if (arena.overflowed()) return nullptr;
  mapper->used_bytes_ = arena.used_bytes();
  mapper->store_.set_archive(archive);
  mapper->detector_.clear();
  mapper->motion_[0] = MotionPrior(planned.motion);
  mapper->clock_ = clock;
  mapper->relaxation_ = relaxation;
  status = Status::ok;
  return mapper;
}

bool Mapper::load_metascan(std::uint32_t begin, std::uint32_t end, const Pose& map_from_side,
                           std::span<IcpScan> scans, std::uint32_t& count) {
  const Pose side_from_map = map_from_side.inverse();
  count = 0;
  for (std::uint32_t scan = begin; scan < end; ++scan) {
    StoredScan stored;
    if (store_.load(scan, stored) != Status::ok) return false;
    scans[count++] = {stored.tree, stored.samples, side_from_map * graph_.poses()[scan]};
  }
  return true;
}

// In the order of the paper's Figure 1.
Status Mapper::add_scan(std::span<const Point> points, const Pose* odometry_from_body, ScanReport& report,
                        const Eigen::Vector3d* gps_position_m, std::span<const std::uint8_t> intensity) {
  report = ScanReport{};
  report.scan = scan_count();
  if (!intensity.empty() && intensity.size() != points.size()) return refuse(Status::bad_channel);
  MotionPrior::Prediction prediction;
  const Status predicted = predict(odometry_from_body, prediction);
  if (predicted != Status::ok) return refuse(predicted);
  const Status reduced = reduce(points, report);
  if (report.points.kept == 0) return refuse(reduced);
  const Status stored = store(intensity, report);
  if (stored != Status::ok) return refuse(stored);
  place(prediction, odometry_from_body, report);
  if (config_.close_loops) look_for_loop(report.scan, gps_position_m, report);
  return reduced;
}

Status Mapper::refuse(Status status) {
  ++counters_.scans_refused;
  return status;
}

// Where the next scan may be; that there is room for it, too.
Status Mapper::predict(const Pose* odometry_from_body, MotionPrior::Prediction& prediction) const {
  if (odometry_from_body != nullptr && !is_valid(*odometry_from_body)) return Status::bad_pose;
  if (scan_count() == config_.scan_capacity) return Status::no_scan_capacity;
  if (scan_count() == 0) return Status::ok;
  prediction = motion_[0].predict(odometry_from_body);
  const Pose predicted = graph_.poses().back() * prediction.last_from_next;
  return is_valid(predicted) && is_valid(prediction.last_from_next) ? Status::ok : Status::bad_pose;
}

Status Mapper::reduce(std::span<const Point> points, ScanReport& report) {
  const std::uint64_t begin_ns = now_ns();
  const Status reduced = voxel_grid_.reduce(points, reduced_, report.points);
  counters_.points_in += report.points.points;
  counters_.points_not_finite += report.points.not_finite;
  counters_.points_too_near += report.points.too_near;
  counters_.points_too_far += report.points.too_far;
  counters_.points_without_cell += report.points.without_cell;
  report.times.reduce_ns = now_ns() - begin_ns;
  return reduced;
}

Status Mapper::store(std::span<const std::uint8_t> intensity, ScanReport& report) {
  const std::uint64_t begin_ns = now_ns();
  const std::span<const Point> kept = reduced_.first(report.points.kept);
  std::array<std::byte, ScanSignature::stored_bytes> signature;
  ScanSignature::of(kept).write(signature);
  ScanChannels channels;
  channels.signature = signature;
  channels.signature_version = ScanSignature::version;
  if (!intensity.empty() && !reduced_intensity_.empty()) {
    const std::span<std::uint8_t> of_kept = reduced_intensity_.first(kept.size());
    for (std::uint32_t i = 0; i < of_kept.size(); ++i) of_kept[i] = intensity[voxel_grid_.chosen(i)];
    channels.intensity = of_kept;
  }
  const Status stored = store_.add(kept, report.points.cell_size_m, channels);
  report.times.store_ns = now_ns() - begin_ns;
  return stored;
}

void Mapper::place(const MotionPrior::Prediction& prediction, const Pose* odometry_from_body,
                   ScanReport& report) {
  const std::uint64_t begin_ns = now_ns();
  const std::uint32_t n = report.scan;
  if (odometry_from_body != nullptr) {
    constexpr double no_tilt = 1e-6;
    const Eigen::Quaterniond& turn = odometry_from_body->rotation;
    const bool is_planar = std::abs(turn.x()) < no_tilt && std::abs(turn.y()) < no_tilt;
    has_planar_odometry_ = is_planar && (n == 0 || has_planar_odometry_);
  }
  const Step step = n > 0 ? match_step(n, prediction, report) : Step{};
  if (n > 0) {
    const bool is_sure = step.verdict == StepVerdict::believed || step.verdict == StepVerdict::found ||
                         step.verdict == StepVerdict::against_odometry;
    motion_[0].observe(prediction, step.last_from_next, odometry_from_body, is_sure);
    if (report.is_predicted) ++counters_.scans_predicted;
  } else {
    motion_[0].start(odometry_from_body);
  }
  add_step(n, step);
  report.times.match_ns = now_ns() - begin_ns;
}

void Mapper::look_for_loop(std::uint32_t n, const Eigen::Vector3d* gps_position_m, ScanReport& report) {
  const std::uint64_t begin_ns = now_ns();
  if (config_.detector.use_gps && gps_position_m != nullptr && !gps_position_m->allFinite()) {
    ++counters_.gps_not_finite;
    gps_position_m = nullptr;
  }
  if (!config_.detector.use_gps) gps_position_m = nullptr;
  const Eigen::Vector3d place_m = graph_.poses()[n].translation_m;
  (void)detector_.add(place_m, driven_m_,
                      gps_position_m);  // certain: it has room for as many scans as the graph
  const std::optional<LoopDetector::Nearby> nearby =
      detector_.nearest(place_m, n, std::sqrt(uncertainties_[n].translation_m2), gps_position_m);
  const std::optional<LoopTrigger::Loop> candidate = trigger_.observe(n, nearby);
  report.times.detect_ns = now_ns() - begin_ns;
  if (!candidate) return;
  close_loop(*candidate, config_.loop_search.candidates, report.loop, report.times);
  report.loop_offered = report.loop.verdict != LoopVerdict::known;
}

MapHealth Mapper::health() const {
  MapHealth health;
  health.scans = scan_count();
  health.length_m = driven_m_;
  const auto weakness = [this](std::uint32_t scan) {  // larger is weaker
    const StepRecord& step = steps_[scan];
    const int kind = step.verdict == StepVerdict::apart         ? 2
                     : step.verdict == StepVerdict::on_odometry ? 1
                                                                : 0;
    return 1000 * kind + 255 - step.support_percent;
  };
  double sigma_sum_m = 0;
  health.odometry_scale = motion_[0].scale();
  for (std::uint32_t scan = 0; scan < health.scans; ++scan) {
    if (has_planar_odometry_) {  // map_from_body of the first is the identity
      const Eigen::Quaterniond& turn = graph_.poses()[scan].rotation;
      const double up = 1 - 2 * (turn.x() * turn.x() + turn.y() * turn.y());
      health.tilt_rad = std::max(health.tilt_rad, portable::atan2(std::sqrt(std::max(0.0, 1 - up * up)), up));
    }
    sigma_sum_m += std::sqrt(uncertainties_[scan].translation_m2);
    const StepVerdict verdict = steps_[scan].verdict;
    if (verdict == StepVerdict::found) ++health.found;
    if (verdict == StepVerdict::against_odometry) ++health.against_odometry;
    if (verdict == StepVerdict::on_odometry) ++health.on_odometry;
    const bool is_matched = verdict == StepVerdict::believed || verdict == StepVerdict::found;
    const bool is_known = steps_[scan].is_spanned && steps_[scan].has_odometry;
    if (is_matched && !is_known && steps_[scan].support_percent < 45) ++health.weak;
    if (verdict == StepVerdict::apart) ++health.parts;
    const bool is_weak = verdict == StepVerdict::apart || verdict == StepVerdict::on_odometry ||
                         (scan > 0 && steps_[scan].support_percent < 60);
    if (!is_weak) continue;
    // Kept sorted, the weakest first.
    std::uint32_t place = health.weakest_count;
    while (place > 0 && weakness(health.weakest[place - 1]) < weakness(scan)) --place;
    if (place == MapHealth::most_weakest) continue;
    health.weakest_count = std::min(health.weakest_count + 1, MapHealth::most_weakest);
    for (std::uint32_t i = health.weakest_count - 1; i > place; --i)
      health.weakest[i] = health.weakest[i - 1];
    health.weakest[place] = scan;
  }
  if (health.scans > 0) health.expected_error_m = sigma_sum_m / health.scans;
  std::uint32_t last_closed = 0;
  for (const LoopReport& loop : loops()) {
    switch (loop.verdict) {
      case LoopVerdict::closed: {
        ++health.closed;
        constexpr std::uint32_t one_visit_scans = 10;
        if (health.revisits == 0 || loop.last > last_closed + one_visit_scans) ++health.revisits;
        last_closed = loop.last;
        break;
      }
      case LoopVerdict::refused_implausible:
      case LoopVerdict::refused_needless:
        ++health.implausible;
        break;
      case LoopVerdict::known:
      case LoopVerdict::refused_ambiguous:
      case LoopVerdict::refused_free_space:  // another place that looks alike
      case LoopVerdict::refused_capacity:
      case LoopVerdict::refused_archive:
        break;
      default:
        ++(loop.lies_apart ? health.implausible : health.unmatched);
    }
  }
  judge_map(health);
  return health;
}

bool Mapper::finish(LoopReport& loop, StageTimes* times) {
  const std::optional<LoopTrigger::Loop> candidate = trigger_.finish();
  if (!candidate) return false;
  StageTimes taken;
  close_loop(*candidate, config_.loop_search.candidates, loop, taken);
  if (times != nullptr) *times = taken;
  return loop.verdict != LoopVerdict::known;
}

Status Mapper::read_scan(std::uint32_t scan, std::span<Point> points, std::uint32_t& count) {
  count = 0;
  StoredScan stored;
  const Status status = store_.load(scan, stored);
  if (status != Status::ok) return status;
  if (points.size() < stored.tree->size()) return Status::buffer_too_small;
  count = stored.tree->size();
  for (std::uint32_t i = 0; i < count; ++i) points[i] = stored.tree->point(i);
  return Status::ok;
}

}  // namespace alces
