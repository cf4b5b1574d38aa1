#include "alces/mapper.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "alces/portable_math.h"
#include "alces/symmetric_eigen.h"

namespace alces {
namespace {

bool is_usable(const IcpConfig& config) {
  return config.maximum_iterations > 0 && config.first_distance_limit_m > 0 &&
         config.last_distance_limit_m > 0 && config.limit_factor > 0 && config.limit_factor <= 1;
}

bool is_usable(const MapperConfig& config) {
  constexpr std::uint32_t most = Icp::maximum_model_scans;
  if (config.scans_around_first > most || config.scans_before_last > most) return false;
  if (std::uint64_t{config.scan_capacity} + config.loop_capacity > INT32_MAX) return false;
  // Scans looked at together must all have a slot.
  const std::uint32_t around_loop = 2 * config.scans_around_first + 1 + config.scans_before_last + 1;
  const std::uint32_t together = std::max(config.model_scans + 1, around_loop);
  return config.scan_capacity > 0 && config.cache_slots >= together && config.model_scans > 0 &&
         config.model_scans <= Icp::maximum_model_scans && around_loop <= Icp::maximum_model_scans &&
         config.correspondence_capacity > 0 && config.voxel.cell_capacity > 0 &&
         config.voxel.cell_size_m > 0 && config.voxel.maximum_range_m > config.voxel.minimum_range_m &&
         config.voxel.cell_capacity <= KdTree::maximum_points && config.surface.sample_capacity > 0 &&
         is_usable(config.scan_match) && is_usable(config.loop_match) &&
         config.loop_search.shift_step_m > 0 && config.loop_search.shift_steps <= Icp::maximum_shift_steps &&
         LoopDetector::check(config.detector) == Status::ok;
}

bool is_found(const IcpResult& match) {
  return match.verdict == IcpVerdict::converged || match.verdict == IcpVerdict::iteration_limit;
}

}  // namespace

const char* text(LoopVerdict verdict) {
  switch (verdict) {
    case LoopVerdict::closed:
      return "closed";
    case LoopVerdict::refused_no_match:
      return "refused: the metascans do not come together";
    case LoopVerdict::refused_overlap:
      return "refused: too little overlap";
    case LoopVerdict::refused_residual:
      return "refused: the residuals are too large";
    case LoopVerdict::refused_walls:
      return "refused: too few walls fit";
    case LoopVerdict::refused_implausible:
      return "refused: the correction is larger than the accumulated uncertainty explains";
    case LoopVerdict::refused_capacity:
      return "refused: no room for another edge";
    case LoopVerdict::refused_archive:
      return "refused: a scan could not be brought back";
  }
  return "unknown verdict";
}

Mapper* Mapper::create(std::span<std::byte> block, const MapperConfig& config, Status& status,
                       ScanArchive* archive, StageClock* clock, LoopRelaxation* relaxation) {
  MapperConfig planned = config;
  planned.detector.scan_capacity = config.scan_capacity;
  status = Status::bad_config;
  if (!is_usable(planned)) return nullptr;
  status = Status::block_misaligned;
  if (reinterpret_cast<std::uintptr_t>(block.data()) % Arena::alignment != 0) return nullptr;
  status = Status::block_too_small;
  if (block.size() < memory_required(planned)) return nullptr;
  Arena arena(block);
  // The mapper itself lies at the front of its block; memory_required() counts it the same way.
  void* const place = arena.allocate<std::byte>(sizeof(Mapper)).data();
  Mapper* const mapper = new (place) Mapper(arena, planned);
  if (arena.overflowed()) return nullptr;
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

  const Status stored = store_.add(reduced_.first(report.points.kept));
  if (stored != Status::ok) return refuse(stored);
  const std::uint64_t stored_ns = now_ns();
  report.times.store_ns = stored_ns - reduced_ns;

  Pose map_from_body;
  if (n > 0) {
    const Pose map_from_last = graph_.poses()[n - 1];
    const Pose predicted = predict(odometry_from_body);
    const std::uint32_t model_begin = n - std::min(n, config_.model_scans);
    std::array<IcpScan, maximum_metascan> model;
    std::array<IcpScan, 1> data;
    std::uint32_t model_count = 0;
    IcpResult match;
    match.model_from_data = map_from_last.inverse() * predicted;
    StoredScan newest;
    if (load_metascan(model_begin, n, map_from_last, model, model_count) &&
        store_.load(n, newest) == Status::ok) {
      data[0] = {newest.tree, newest.samples, Pose{}};
      match =
          icp_.match(std::span(model).first(model_count), data, match.model_from_data, config_.scan_match);
    } else {
      report.archive_failed = true;
      ++counters_.archive_failures;
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
    map_from_body = map_from_last * match.model_from_data;

    const PairCovariance covariance =
        config_.label_with_appendix_a ? appendix_a(match.sums) : from_curvature(match);
    Edge edge;
    edge.from = n - 1;
    edge.to = n;
    edge.from_from_to = match.model_from_data;
    edge.variance =
        edge_variance(covariance, match.model_from_data, map_from_last.rotation, config_.edge_uncertainty);
    (void)graph_.add_vertex(
        map_from_body);  // room is certain: as many vertices as scans, as many edges and loops
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
    (void)detector_.add(map_from_body.translation_m, config_.detector.use_gps ? gps_position_m : nullptr);
    const std::optional<LoopDetector::Nearby> nearby =
        detector_.nearest(map_from_body.translation_m, n, std::sqrt(spreads_[n].translation_m2),
                          config_.detector.use_gps ? gps_position_m : nullptr);
    const std::optional<LoopTrigger::Loop> candidate = trigger_.observe(n, nearby);
    report.times.detect_ns = now_ns() - matched_ns;
    if (candidate) {
      report.loop_offered = true;
      close_loop(*candidate, config_.loop_search.candidates, report.loop, report.times);
    }
  }
  return reduced;
}

bool Mapper::finish(LoopReport& loop, StageTimes* times) {
  const std::optional<LoopTrigger::Loop> candidate = trigger_.finish();
  if (!candidate) return false;
  StageTimes taken;
  close_loop(*candidate, config_.loop_search.candidates, loop, taken);
  if (times != nullptr) *times = taken;
  return true;
}

Status Mapper::offer_loop(std::uint32_t first, std::uint32_t last, LoopReport& loop) {
  if (first >= last || last >= scan_count()) return Status::no_such_scan;
  StageTimes times;
  const double distance_m = (graph_.poses()[first].translation_m - graph_.poses()[last].translation_m).norm();
  close_loop({first, last, distance_m}, 1, loop, times);
  return Status::ok;
}

void Mapper::close_loop(LoopTrigger::Loop candidate, std::uint32_t tries, LoopReport& loop,
                        StageTimes& times) {
  for (std::uint32_t attempt = 0; attempt < tries; ++attempt) {
    loop = LoopReport{};
    loop.first = candidate.first;
    loop.last = candidate.last;
    loop.distance_m = candidate.distance_m;
    ++counters_.loops_offered;
    judge_loop(candidate, loop, times);
    if (loop.verdict == LoopVerdict::closed) ++counters_.loops_closed;
    if (loop_count_ < loops_.size()) {
      loops_[loop_count_++] = loop;
    } else {
      ++counters_.loops_not_listed;
    }
    const bool came_together =
        loop.verdict != LoopVerdict::refused_no_match && loop.verdict != LoopVerdict::refused_overlap &&
        loop.verdict != LoopVerdict::refused_residual && loop.verdict != LoopVerdict::refused_walls;
    if (came_together) return;
    // The pose has drifted: perhaps the nearest scan is of another street. An earlier visit may be the right
    // one.
    const Eigen::Vector3d place_m = graph_.poses()[candidate.last].translation_m;
    const std::optional<LoopDetector::Nearby> earlier =
        detector_.nearest(place_m, candidate.first, std::sqrt(spreads_[candidate.last].translation_m2));
    if (!earlier) return;
    candidate.first = earlier->scan;
    candidate.distance_m = earlier->distance_m;
  }
}

IcpResult Mapper::match_loop(std::span<const IcpScan> model, std::span<const IcpScan> data,
                             const Pose& model_from_data) {
  const IcpResult straight = icp_.match(model, data, model_from_data, config_.loop_match);
  const bool is_sure = is_found(straight) && straight.overlap >= config_.loop_search.sure_overlap;
  const IcpResult turned = is_sure ? straight : match_turned(model, data, model_from_data, straight);
  return is_found(turned) ? match_shifted(model, data, turned) : turned;
}

IcpResult Mapper::match_turned(std::span<const IcpScan> model, std::span<const IcpScan> data,
                               const Pose& model_from_data, const IcpResult& straight) {
  // The other starts are tried with scan l alone and few iterations; the best of them is matched in full.
  IcpConfig quick = config_.loop_match;
  quick.maximum_iterations = config_.loop_search.iterations;
  IcpResult best = straight;
  bool is_better = false;
  for (std::uint32_t step = 1; step <= config_.loop_search.turn_steps; ++step) {
    for (const double side : {1.0, -1.0}) {
      Pose turned = model_from_data;
      const double angle_rad = side * step * config_.loop_search.turn_step_rad;
      turned.rotation = turned.rotation * exp_so3({0, 0, angle_rad});
      const IcpResult match = icp_.match(model, data.last(1), turned, quick);
      if (!is_found(match) || (is_found(best) && match.overlap <= best.overlap)) continue;
      best = match;
      is_better = true;
    }
  }
  return is_better ? icp_.match(model, data, best.model_from_data, config_.scan_match) : straight;
}

IcpResult Mapper::match_shifted(std::span<const IcpScan> model, std::span<const IcpScan> data,
                                const IcpResult& match) {
  const LoopSearchConfig& search = config_.loop_search;
  if (search.shift_steps == 0) return match;
  const Eigen::Matrix3d information = match.information.topLeftCorner<3, 3>();
  const Eigen::Vector3d weakest = symmetric_eigen<3>(information).vectors.col(0);
  // As with turns: scan l alone, few iterations, the best of them in full.
  const std::span<const IcpScan> scan_l = data.last(1);
  std::array<double, 3> shifts_m;
  const std::uint32_t shift_count =
      icp_.likely_shifts(model, scan_l, match.model_from_data, weakest, search.shift_step_m,
                         search.shift_steps, config_.loop_match, shifts_m);
  if (shift_count == 0) return match;

  constexpr float near_m = 1.0F;  // a likely shift is off by no more than a fit
  IcpConfig near = config_.loop_match;
  near.first_distance_limit_m = std::max(near.last_distance_limit_m, near_m);
  IcpConfig quick = near;
  quick.maximum_iterations = search.iterations;
  IcpConfig where_it_is = config_.loop_match;
  where_it_is.first_distance_limit_m = where_it_is.last_distance_limit_m;
  where_it_is.maximum_iterations = 1;
  IcpResult best = icp_.match(model, scan_l, match.model_from_data, where_it_is);
  bool is_shifted = false;
  for (const double shift_m : std::span(shifts_m).first(shift_count)) {
    Pose shifted = match.model_from_data;
    shifted.translation_m += shift_m * weakest;
    const IcpResult next = icp_.match(model, scan_l, shifted, quick);
    if (!is_found(next) || next.fit < best.fit + search.shift_gain) continue;
    best = next;
    is_shifted = true;
  }
  return is_shifted ? icp_.match(model, data, best.model_from_data, near) : match;
}

double Mapper::wall_fit(std::span<const IcpScan> model, const IcpScan& scan_l, const IcpResult& match) {
  const Eigen::Matrix3d information = match.information.topLeftCorner<3, 3>();
  const SymmetricEigen<3> directions = symmetric_eigen<3>(information);
  FacingFit both;
  for (const int weaker : {0, 1}) {
    const FacingFit fit = icp_.facing_fit(model, {&scan_l, 1}, match.model_from_data,
                                          directions.vectors.col(weaker), config_.loop_match);
    both.samples += fit.samples;
    both.fitting += fit.fitting;
  }
  return both.samples == 0 ? 0.0 : static_cast<double>(both.fitting) / both.samples;
}

void Mapper::judge_loop(const LoopTrigger::Loop& candidate, LoopReport& loop, StageTimes& times) {
  const std::uint32_t f = candidate.first;
  const std::uint32_t l = candidate.last;
  const Pose map_from_f = graph_.poses()[f];
  const Pose map_from_l = graph_.poses()[l];

  // Dissociated: l and the scans just before it move as one body, whatever they were matched to before.
  const std::uint64_t begin_ns = now_ns();
  const std::uint32_t data_begin = std::max(l - std::min(l, config_.scans_before_last), f + 1);
  const std::uint32_t model_begin = f - std::min(f, config_.scans_around_first);
  const std::uint32_t model_end = std::min(f + config_.scans_around_first + 1, data_begin);
  std::array<IcpScan, maximum_metascan> model;
  std::array<IcpScan, maximum_metascan> data;
  std::uint32_t model_count = 0;
  std::uint32_t data_count = 0;
  if (!load_metascan(model_begin, model_end, map_from_f, model, model_count) ||
      !load_metascan(data_begin, l + 1, map_from_l, data, data_count)) {
    loop.verdict = LoopVerdict::refused_archive;
    return;
  }
  const IcpResult match = match_loop(std::span(model).first(model_count), std::span(data).first(data_count),
                                     map_from_f.inverse() * map_from_l);
  times.loop_match_ns += now_ns() - begin_ns;
  loop.overlap = match.overlap;
  loop.rms_m = match.rms_m;
  loop.iterations = match.iterations;
  const Pose map_from_matched = map_from_f * match.model_from_data;
  loop.correction_m = (map_from_matched.translation_m - map_from_l.translation_m).norm();
  loop.correction_rad = angle_between_rad(map_from_matched.rotation, map_from_l.rotation);
  if (!is_found(match)) {
    loop.verdict = LoopVerdict::refused_no_match;
    return;
  }
  if (match.overlap < config_.belief.minimum_overlap) {
    loop.verdict = LoopVerdict::refused_overlap;
    return;
  }
  if (match.rms_m > config_.belief.maximum_rms_m) {
    loop.verdict = LoopVerdict::refused_residual;
    return;
  }
  loop.wall_fit = wall_fit(std::span(model).first(model_count), data[data_count - 1], match);
  if (loop.correction_m > config_.belief.small_correction_m &&
      loop.wall_fit < config_.belief.minimum_wall_fit) {
    loop.verdict = LoopVerdict::refused_walls;
    return;
  }
  if (counters_.loops_closed == config_.loop_capacity) {
    loop.verdict = LoopVerdict::refused_capacity;
    return;
  }

  const std::uint64_t matched_ns = now_ns();
  if (sharing_.prepare(graph_, f, l) != Status::ok) {
    loop.verdict = LoopVerdict::refused_capacity;
    return;
  }
  loop.mahalanobis2 = sharing_.mahalanobis2(graph_, map_from_matched);
  if (!(loop.mahalanobis2 <= config_.belief.maximum_mahalanobis2)) {
    loop.verdict = LoopVerdict::refused_implausible;
    return;
  }
  const PairCovariance covariance =
      config_.label_with_appendix_a ? appendix_a(match.sums) : from_curvature(match);
  Edge edge;
  edge.from = f;
  edge.to = l;
  edge.closes_loop = true;
  edge.from_from_to = match.model_from_data;
  edge.variance =
      edge_variance(covariance, match.model_from_data, map_from_f.rotation, config_.edge_uncertainty);
  // LOA's time begins with its decomposition, which another back end has only to thank for the belief.
  const std::uint64_t bend_ns = relaxation_ == nullptr ? matched_ns : now_ns();
  if (bend(edge, map_from_matched) != Status::ok) {
    loop.verdict = LoopVerdict::refused_no_match;
    return;
  }
  (void)detector_.rebuild(graph_.poses());
  for (std::uint32_t i = l; i < scan_count(); ++i) {  // l is again as sure as f
    const Spread grown{spreads_[i].translation_m2 - spreads_[l].translation_m2,
                       spreads_[i].rotation_rad2 - spreads_[l].rotation_rad2};
    if (i > l)
      spreads_[i] = {spreads_[f].translation_m2 + grown.translation_m2,
                     spreads_[f].rotation_rad2 + grown.rotation_rad2};
  }
  spreads_[l] = spreads_[f];
  loop.share_ns = now_ns() - bend_ns;
  times.loop_share_ns += loop.share_ns;
  loop.verdict = LoopVerdict::closed;
}

// After sharing_.prepare(), which knows the graph as it was before the edge.
Status Mapper::bend(const Edge& edge, const Pose& map_from_l) {
  if (relaxation_ != nullptr) {
    const Status added = graph_.add_edge(edge);
    if (added != Status::ok) return added;
    if (relaxation_->relax(graph_, graph_.poses())) return Status::ok;
    ++counters_.loops_not_relaxed;
    return sharing_.share(graph_, map_from_l, config_.sharing);
  }
  const Status shared = sharing_.share(graph_, map_from_l, config_.sharing);
  return shared == Status::ok ? graph_.add_edge(edge) : shared;
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
