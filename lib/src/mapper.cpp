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
  status = check(planned);
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
  mapper->clock_ = clock;
  mapper->relaxation_ = relaxation;
  status = Status::ok;
  return mapper;
}

void Mapper::OdometryHeading::learn(const Pose& matched_step, const Pose& odometry_step) {
  const Eigen::Vector3d& m = matched_step.translation_m;
  const Eigen::Vector3d& o = odometry_step.translation_m;
  cosine_m2 += o.x() * m.x() + o.y() * m.y();
  sine_m2 += o.x() * m.y() - o.y() * m.x();
}

Pose Mapper::OdometryHeading::correct(const Pose& odometry_step) const {
  constexpr double enough_m2 = 4.0;  // of steps multiplied: a few metres of driving
  const double known_m2 = portable::hypot(cosine_m2, sine_m2);
  if (known_m2 < enough_m2) return odometry_step;
  Pose offset;
  offset.rotation = exp_so3({0, 0, portable::atan2(sine_m2, cosine_m2)});
  return offset * odometry_step * offset.inverse();
}

Pose Mapper::predict(const Pose* odometry_from_body) const {
  const std::span<const Pose> poses = graph_.poses();
  const std::size_t n = poses.size();
  if (odometry_from_body != nullptr && has_odometry_) {
    return poses[n - 1] * heading_.correct(last_odometry_[0].inverse() * *odometry_from_body);
  }
  if (n < 2) return poses[n - 1];
  return poses[n - 1] * (poses[n - 2].inverse() * poses[n - 1]);  // as it went
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

Status Mapper::add_scan(std::span<const Point> points, const Pose* odometry_from_body, ScanReport& report,
                        const Eigen::Vector3d* gps_position_m) {
  report = ScanReport{};
  const std::uint32_t n = graph_.vertex_count();
  report.scan = n;
  const auto refuse = [this](Status status) {
    ++counters_.scans_refused;
    return status;
  };
  if (odometry_from_body != nullptr && !is_valid(*odometry_from_body)) return refuse(Status::bad_pose);
  if (n == config_.scan_capacity) return refuse(Status::no_scan_capacity);
  const Pose map_from_last = n > 0 ? graph_.poses()[n - 1] : Pose{};
  const Pose predicted = n > 0 ? predict(odometry_from_body) : Pose{};
  const Pose last_from_predicted = map_from_last.inverse() * predicted;
  if (!is_valid(predicted) || !is_valid(last_from_predicted)) return refuse(Status::bad_pose);

  const std::uint64_t begin_ns = now_ns();
  const Status reduced = voxel_grid_.reduce(points, reduced_, report.points);
  counters_.points_in += report.points.points;
  counters_.points_not_finite += report.points.not_finite;
  counters_.points_too_near += report.points.too_near;
  counters_.points_too_far += report.points.too_far;
  counters_.points_without_cell += report.points.without_cell;
  if (report.points.kept == 0) return refuse(reduced);
  const std::uint64_t reduced_ns = now_ns();
  report.times.reduce_ns = reduced_ns - begin_ns;

  const Status stored = store_.add(reduced_.first(report.points.kept), report.points.cell_size_m);
  if (stored != Status::ok) return refuse(stored);
  const std::uint64_t stored_ns = now_ns();
  report.times.store_ns = stored_ns - reduced_ns;

  Pose map_from_body;
  if (n > 0) {
    const std::uint32_t model_begin = n - std::min(n, config_.model_scans);
    std::array<IcpScan, maximum_metascan> model;
    std::array<IcpScan, 1> data;
    std::uint32_t model_count = 0;
    IcpResult match;
    match.model_from_data = last_from_predicted;
    StoredScan newest;
    if (load_metascan(model_begin, n, map_from_last, model, model_count) &&
        store_.load(n, newest) == Status::ok) {
      data[0] = {newest.tree, newest.samples, Pose{}};
      match = icp_.match(std::span(model).first(model_count), data, last_from_predicted, config_.scan_match);
    } else {
      report.archive_failed = true;
      ++counters_.archive_failures;
    }
    map_from_body = map_from_last * match.model_from_data;
    if (!is_valid(map_from_body) || !is_valid(match.model_from_data)) {  // at the edge of what is a place
      match = IcpResult{};
      match.model_from_data = last_from_predicted;
      map_from_body = predicted;
    }
    report.match = match.verdict;
    report.iterations = match.iterations;
    report.correspondences = match.correspondences;
    report.overlap = match.overlap;
    report.rms_m = match.rms_m;
    report.is_predicted = match.verdict == IcpVerdict::too_few_correspondences;
    if (report.is_predicted) {
      ++counters_.scans_predicted;
    } else if (config_.learn_odometry_heading && odometry_from_body != nullptr && has_odometry_) {
      heading_.learn(match.model_from_data, last_odometry_[0].inverse() * *odometry_from_body);
    }

    Edge edge;
    edge.from = n - 1;
    edge.to = n;
    edge.from_from_to = match.model_from_data;
    edge.variance = label(match, map_from_last.rotation);
    // Both are certain: there is room for as many vertices as scans and for an edge each, and both poses are
    // valid.
    (void)graph_.add_vertex(map_from_body);
    (void)graph_.add_edge(edge);
    const double step_m2 = match.model_from_data.translation_m.squaredNorm();
    spreads_[n].rotation_rad2 = spreads_[n - 1].rotation_rad2 + edge.variance.rotation_rad2;
    spreads_[n].translation_m2 = spreads_[n - 1].translation_m2 + edge.variance.x_m2 + edge.variance.y_m2 +
                                 edge.variance.z_m2 + spreads_[n].rotation_rad2 * step_m2;
  } else {
    (void)graph_.add_vertex(map_from_body);
  }
  has_odometry_ = odometry_from_body != nullptr;
  if (has_odometry_) last_odometry_[0] = *odometry_from_body;
  const std::uint64_t matched_ns = now_ns();
  report.times.match_ns = matched_ns - stored_ns;

  if (config_.close_loops) {
    if (config_.detector.use_gps && gps_position_m != nullptr && !gps_position_m->allFinite()) {
      ++counters_.gps_not_finite;
      gps_position_m = nullptr;
    }
    if (!config_.detector.use_gps) gps_position_m = nullptr;
    (void)detector_.add(map_from_body.translation_m, gps_position_m);  // certain, as above
    const std::optional<LoopDetector::Nearby> nearby = detector_.nearest(
        map_from_body.translation_m, n, std::sqrt(spreads_[n].translation_m2), gps_position_m);
    const std::optional<LoopTrigger::Loop> candidate = trigger_.observe(n, nearby);
    report.times.detect_ns = now_ns() - matched_ns;
    if (candidate) {
      report.loop_offered = true;
      close_loop(*candidate, config_.loop_search.candidates, report.loop, report.times);
    }
  }
  return reduced;
}

EdgeVariance Mapper::label(const IcpResult& match, const Eigen::Quaterniond& map_from_model) const {
  PairCovariance covariance = config_.label_with_appendix_a ? appendix_a(match.sums) : from_curvature(match);
  if (match.verdict == IcpVerdict::iteration_limit)
    covariance.covariance *= config_.edge_uncertainty.unconverged_factor;
  return edge_variance(covariance, match.model_from_data, map_from_model, config_.edge_uncertainty);
}

bool Mapper::finish(LoopReport& loop, StageTimes* times) {
  const std::optional<LoopTrigger::Loop> candidate = trigger_.finish();
  if (!candidate) return false;
  StageTimes taken;
  close_loop(*candidate, config_.loop_search.candidates, loop, taken);
  if (times != nullptr) *times = taken;
  return true;
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
