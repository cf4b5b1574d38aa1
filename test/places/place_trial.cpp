#include "places/place_trial.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstring>
#include <functional>
#include <stdexcept>

#include "alces_platform/settings/mapper_settings.h"
#include "alces_platform/settings/memory_plan.h"

namespace alces::places {
namespace {

/// A mapper in a block that can be taken back to how it was: all of a mapper is in its block.
class BlockMapper {
 public:
  explicit BlockMapper(const MapperConfig& config) : block_(Mapper::memory_required(config)) {
    Status status = Status::ok;
    mapper_ = Mapper::create(block_.bytes(), config, status);
    if (mapper_ == nullptr) throw std::runtime_error(to_string(status));
  }
  Mapper* operator->() const { return mapper_; }
  [[nodiscard]] std::vector<std::byte> copy() const { return {block_.bytes().begin(), block_.bytes().end()}; }
  void restore(const std::vector<std::byte>& copy) {
    std::memcpy(block_.bytes().data(), copy.data(), copy.size());
  }

 private:
  settings::MemoryBlock block_;
  Mapper* mapper_ = nullptr;
};

Pose between(std::span<const Pose> poses, const LoopReport& loop) {
  return poses[loop.first].inverse() * poses[loop.last];
}

/// The match of the loop that was closed last between the two, against the truth.
void judge(TriedLoop& loop, const PoseGraph& graph, std::span<const Pose> truth) {
  if (!loop.is_taken()) return;
  const Pose true_first_from_last = between(truth, loop.report);
  for (std::size_t i = graph.edge_count(); i-- > 0;) {
    const Edge& edge = graph.edges()[i];
    if (!edge.closes_loop || edge.from != loop.report.first || edge.to != loop.report.last) continue;
    loop.off_m = (edge.from_from_to.translation_m - true_first_from_last.translation_m).norm();
    loop.off_rad = angle_between_rad(edge.from_from_to.rotation, true_first_from_last.rotation);
    return;
  }
  throw std::runtime_error("a loop is said to be closed that has no edge");
}

/// Adds all scans. `offered`, where it is wanted, is told of every loop in the order of Mapper::loops():
/// where the map had its scans before it.
void add_all(BlockMapper& mapper, const Feed& feed, const std::function<void(const Pose&)>& offered = {}) {
  std::vector<Pose> before;
  const auto tell = [&](std::size_t known) {
    const std::span<const LoopReport> loops = mapper->loops();
    for (std::size_t i = known; offered && i < loops.size(); ++i) offered(between(before, loops[i]));
  };
  for (std::size_t i = 0; i < feed.truth.size(); ++i) {
    ScanReport report;
    const Pose* const odometry = feed.odometry.empty() ? nullptr : &feed.odometry[i];
    const std::size_t known = mapper->loops().size();
    const std::size_t edges = mapper->graph().edge_count();
    before.assign(mapper->graph().poses().begin(), mapper->graph().poses().end());
    const Status status = mapper->add_scan(feed.points(i), odometry, report);
    if (status != Status::ok && status != Status::no_voxel_capacity)
      throw std::runtime_error(to_string(status));
    if (mapper->loops().size() == known) continue;
    const std::span<const Edge> all = mapper->graph().edges();
    const bool has_step =
        edges < all.size() && !all[edges].closes_loop;  // comes before the loops that it made visible
    before.push_back(has_step ? before[all[edges].from] * all[edges].from_from_to
                              : mapper->graph().poses()[i]);
    tell(known);
  }
  const std::size_t known = mapper->loops().size();
  before.assign(mapper->graph().poses().begin(), mapper->graph().poses().end());
  LoopReport last;
  if (mapper->finish(last)) tell(known);
}

/// Each to the map as it is now.
void offer_pairs(BlockMapper& mapper, const Feed& feed, Trial& trial) {
  const std::vector<std::byte> as_it_is = mapper.copy();
  for (const Pair& pair : feed.pairs) {
    TriedLoop loop;
    loop.is_revisit = pair.is_revisit;
    loop.is_bare = pair.is_bare;
    const std::span<const Pose> poses = mapper->graph().poses();
    const Pose before = poses[pair.first].inverse() * poses[pair.last];
    loop.before_from_after = before.inverse() * (feed.truth[pair.first].inverse() * feed.truth[pair.last]);
    const Status status = mapper->offer_loop(pair.first, pair.last, loop.report);
    if (status != Status::ok) throw std::runtime_error(to_string(status));
    judge(loop, mapper->graph(), feed.truth);
    loop.map_error_m = mean_error_m(mapper->graph().poses(), feed.truth);
    trial.offered.push_back(loop);
    mapper.restore(as_it_is);
  }
}

}  // namespace

double mean_error_m(std::span<const Pose> poses, std::span<const Pose> truth) {
  const auto count = static_cast<Eigen::Index>(poses.size());
  Eigen::Matrix3Xd here(3, count);
  Eigen::Matrix3Xd there(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    here.col(i) = poses[static_cast<std::size_t>(i)].translation_m;
    there.col(i) = truth[static_cast<std::size_t>(i)].translation_m;
  }
  const Eigen::Matrix4d there_from_here = Eigen::umeyama(here, there, false);
  const Eigen::Matrix3Xd laid = (there_from_here.topLeftCorner<3, 3>() * here).colwise() +
                                Eigen::Vector3d(there_from_here.topRightCorner<3, 1>());
  return (laid - there).colwise().norm().mean();
}

MapperConfig place_config(std::size_t scans) {
  MapperConfig config = settings::default_mapper_settings();
  config.scan_capacity = static_cast<std::uint32_t>(scans);
  config.loop_capacity = 256;
  config.pool_bytes = std::size_t{64} << 20;
  return config;
}

Trial try_mapper(const Feed& feed, const MapperConfig& config) {
  Trial trial;
  {
    MapperConfig without = config;
    without.close_loops = false;
    BlockMapper mapper(without);
    add_all(mapper, feed);
    trial.predicted = mapper->counters().scans_predicted;
    trial.error_without_m = mean_error_m(mapper->graph().poses(), feed.truth);
    if (!feed.offer_with_loops) offer_pairs(mapper, feed, trial);
  }
  BlockMapper mapper(config);
  std::vector<Pose> first_from_last_before;
  add_all(mapper, feed, [&](const Pose& before) { first_from_last_before.push_back(before); });
  trial.error_with_m = mean_error_m(mapper->graph().poses(), feed.truth);
  for (std::size_t i = 0; i < mapper->loops().size(); ++i) {
    const LoopReport& report = mapper->loops()[i];
    TriedLoop loop;
    loop.report = report;
    loop.before_from_after = first_from_last_before[i].inverse() * between(feed.truth, report);
    loop.is_revisit = between(feed.truth, report).translation_m.norm() <= 2;
    judge(loop, mapper->graph(), feed.truth);
    loop.map_error_m = trial.error_with_m;
    trial.own.push_back(loop);
  }
  if (feed.offer_with_loops) offer_pairs(mapper, feed, trial);
  return trial;
}

Trial try_mapper(const PlaceDrive& drive, double noise, const MapperConfig& config) {
  const std::vector<Pose> odometry = drive.odometry(noise);
  Feed feed;
  feed.points = [&](std::size_t scan) -> std::span<const Point> { return drive.scans[scan]; };
  feed.odometry = odometry;
  feed.truth = drive.truth;
  feed.pairs = drive.pairs;
  return try_mapper(feed, config);
}

}  // namespace alces::places
