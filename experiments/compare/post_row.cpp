#include "post_row.h"

#include <fmt/format.h>

#include <chrono>

#include "drive_observer.h"
#include "experiments/back_ends/hogman.h"
#include "experiments/back_ends/toro.h"
#include "offline/io/files/error.h"
#include "offline/optimize/graph/map_graph.h"
#include "online_row.h"
#include "scan_relaxation.h"

namespace alces::offline {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

std::vector<Pose> poses_of(const ConstraintGraph& graph) {
  std::vector<Pose> poses;
  poses.reserve(graph.vertices.size());
  for (const ConstraintVertex& vertex : graph.vertices) poses.push_back(vertex.map_from_body);
  return poses;
}

}  // namespace

RowResult run_post_row(const CompareRow& row, const RowResult& drive, SpooledScanSource& scans,
                       const ExperimentRequest& request, const ExperimentCallbacks& callbacks,
                       SharedLinks& links) {
  const auto stop_signal = [&] { return callbacks.stop_signal ? callbacks.stop_signal() : 0; };
  const auto is_stopped = [&] { return stop_signal() != 0; };
  const auto tell = [&](std::string_view stage, std::size_t done, std::size_t total) {
    if (callbacks.progress) callbacks.progress(row.title, stage, done, total);
  };
  const MapGraph map = read_map_graph(request.out / drive.row.key);
  const std::vector<Pose>& start = drive.trajectory.poses;
  std::optional<DriveObserver> observer;
  if (request.truth) observer.emplace(*request.truth, drive);
  const auto observe = [&](std::span<const Pose> poses) {
    if (observer) observer->relaxed(poses, drive.source_index);
  };

  RowResult result = drive;
  result.row = row;
  ConstraintGraph graph;
  nlohmann::json report = {{"with", row.key.substr(row.key.find('+') + 1)}, {"input", drive.row.key}};
  const Clock::time_point begin = Clock::now();
  double spared_s = 0;  // work that another row has done and that counts all the same
  ScanCache cache(scans, drive.source_index, request.lum, request.out);
  if (row.post == PostMethod::lum) {
    ScanRelaxationResult relaxed = relax_scans(
        start, cache, request.lum,
        {.progress = [&](std::uint32_t iteration, std::size_t done,
                         std::size_t total) { tell(fmt::format("iteration {}", iteration), done, total); },
         .iterated = observe,
         .stop_requested = is_stopped});
    result.times.post_front_end_s = relaxed.times.front_end_s;
    result.times.post_back_end_s = relaxed.times.back_end_s;
    result.iterations = relaxed.iterations;
    result.is_converged = relaxed.is_converged;
    result.trajectory.poses = std::move(relaxed.map_from_scan);
    graph = std::move(relaxed.link_graph);
    report["converged"] = result.is_converged;
  } else {
    if (links.matching) {
      spared_s = links.seconds;
    } else {
      links.matching = match_links(
          start, cache, link_matching_settings(request.map.config, request.lum),
          [&](std::size_t done, std::size_t total) { tell("matching links", done, total); }, is_stopped);
      links.seconds = seconds_since(begin);
    }
    if (const int signal = stop_signal(); signal != 0) throw interrupted(row, signal);
    result.times.post_front_end_s = links.seconds;
    graph = links.matching->graph;
    report["links"] = {{"matched", links.matching->links - links.matching->refused},
                       {"refused", links.matching->refused},
                       {"bridges", links.matching->bridges}};
    const Clock::time_point solving = Clock::now();
    const auto iterate = [&](std::uint32_t done, std::uint32_t total) { tell("optimising", done, total); };
    if (row.post == PostMethod::toro) {
      const ToroResult toro = optimize_toro(graph, {}, {.progress = iterate, .stop_requested = is_stopped});
      result.iterations = toro.iterations;
      report["chi_squared"] = toro.chi_squared;
    } else {
      const HogManResult hogman =
          optimize_hogman(graph, {}, {.progress = iterate, .stop_requested = is_stopped});
      result.iterations = hogman.iterations;
      report["chi_squared"] = hogman.chi_squared;
    }
    result.times.post_back_end_s = seconds_since(solving);
    result.trajectory.poses = poses_of(graph);
    observe(result.trajectory.poses);
  }
  if (const int signal = stop_signal(); signal != 0) throw interrupted(row, signal);
  result.times.total_s += seconds_since(begin) + spared_s;
  if (observer) result.watched = observer->watched();
  report["iterations"] = result.iterations;
  report["seconds"] = seconds_since(begin) + spared_s;
  write_map_graph(request.out / row.key, map, graph, report);
  return result;
}

}  // namespace alces::offline
