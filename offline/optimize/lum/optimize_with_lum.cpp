#include "optimize_with_lum.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <unordered_map>

#include "checkpoint.h"
#include "offline/io/files/error.h"
#include "offline/io/files/output_file.h"
#include "shared_link_sums.h"

namespace alces::offline {
namespace {

// How long until linked scans are at rest, if their change goes on shrinking as in the last two iterations.
std::optional<double> left_s(const std::vector<LumIteration>& history, const std::vector<double>& seconds,
                             const LumSettings& settings, std::uint32_t iterations) {
  if (history.size() < 3 || !history[history.size() - 3].is_fine) return std::nullopt;
  const double now = history.back().link_change_m;
  const double ratio = std::sqrt(now / history[history.size() - 3].link_change_m);
  const auto most =
      static_cast<double>(settings.maximum_iterations - std::min(settings.maximum_iterations, iterations));
  const double wanted = ratio < 1 && settings.link_change_m > 0 && now > 0
                            ? std::ceil(std::log(settings.link_change_m / now) / std::log(ratio))
                            : most;
  return std::clamp(wanted, 0.0, most) * seconds.back();
}

LumResult relax(const Trajectory& trajectory, const LumRequest& request, const LumCallbacks& callbacks,
                LinkSumSource& sums) {
  LumResult result;
  Relaxation relaxation(trajectory.poses, request.settings, sums);
  const std::string settings = fingerprint(request.settings);
  if (request.resume) {
    if (!request.checkpoint) throw UsageError("there is no checkpoint to resume from");
    relaxation.resume(read_checkpoint(*request.checkpoint, trajectory.size(), settings));
  }
  const auto should_stop = [&] { return callbacks.stop_requested && callbacks.stop_requested(); };
  const auto in_iteration = [&](std::size_t done, std::size_t total) {
    if (callbacks.progress) callbacks.progress(relaxation.state().iterations + 1, done, total);
  };
  while (!relaxation.is_done() && !should_stop()) {
    const auto begin = std::chrono::steady_clock::now();
    result.history.push_back(relaxation.iterate(in_iteration));
    result.seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    if (request.checkpoint) {
      if (request.checkpoint->has_parent_path()) make_folder(request.checkpoint->parent_path());
      write_checkpoint(*request.checkpoint, relaxation.state(), settings);
    }
    if (callbacks.iterated)
      callbacks.iterated(result.history.back(), left_s(result.history, result.seconds, request.settings,
                                                       relaxation.state().iterations));
  }
  result.was_stopped = !relaxation.is_done();
  if (relaxation.outcomes().empty() && trajectory.size() > 1 && !result.was_stopped)
    relaxation.look(in_iteration);
  if (request.settings.covariances && !result.was_stopped) result.covariances = relaxation.covariances();
  result.is_converged = relaxation.state().is_converged;
  result.iterations = relaxation.state().iterations;
  result.map_from_scan = relaxation.state().map_from_scan;
  result.outcomes = relaxation.outcomes();
  result.link_graph = relaxation.link_graph();
  return result;
}

nlohmann::json to_json(const LinkOutcome& outcome, const Trajectory& trajectory) {
  return {{"scan", outcome.link.j},
          {"earlier_scan", outcome.link.k},
          {"stamp", trajectory.stamps_s[outcome.link.j]},
          {"earlier_stamp", trajectory.stamps_s[outcome.link.k]},
          {"weight", outcome.weight},
          {"pull_m", outcome.estimate.pull_m},
          {"rms_m", outcome.estimate.rms_m},
          {"overlap", outcome.overlap},
          {"correspondences", outcome.correspondences}};
}

}  // namespace

std::vector<std::size_t> scans_of_trajectory(const Trajectory& trajectory, const ScanSource& scans) {
  constexpr double same_time_s = 1e-4;  // stamps of trajectory.tum are rounded
  std::vector<std::size_t> indices;
  if (trajectory.has_time) {
    std::vector<std::pair<double, std::size_t>> by_time;
    for (std::size_t i = 0; i < scans.size(); ++i)
      if (const auto stamp_s = scans.stamp_s(i)) by_time.emplace_back(*stamp_s, i);
    std::sort(by_time.begin(), by_time.end());
    for (const double stamp_s : trajectory.stamps_s) {
      const auto found =
          std::lower_bound(by_time.begin(), by_time.end(), std::pair(stamp_s - same_time_s, std::size_t{0}));
      if (found == by_time.end() || found->first > stamp_s + same_time_s)
        throw InputError(
            fmt::format("the map's pose at {:.6f} s has no scan of that time in {}; give the scans that the "
                        "map was made of",
                        stamp_s, scans.description()));
      indices.push_back(found->second);
    }
    return indices;
  }
  std::unordered_map<std::size_t, std::size_t> by_number;
  for (std::size_t i = 0; i < scans.size(); ++i) by_number.emplace(scans.number(i), i);
  for (const double stamp : trajectory.stamps_s) {
    const auto found = by_number.find(static_cast<std::size_t>(std::max(0.0, stamp)));
    if (found == by_number.end())
      throw InputError(
          fmt::format("the map's scan {} is missing ({}); give the scans that the map was made of", stamp,
                      scans.description()));
    indices.push_back(found->second);
  }
  return indices;
}

std::vector<std::filesystem::path> source_of_map(const std::filesystem::path& map_folder,
                                                 const nlohmann::json& run_report) {
  std::vector<std::filesystem::path> paths;
  const nlohmann::json::json_pointer place("/source/paths");
  if (run_report.is_object() && run_report.contains(place) && run_report[place].is_array())
    for (const nlohmann::json& path : run_report[place])
      if (path.is_string()) paths.emplace_back(path.get<std::string>());
  if (paths.empty())
    throw InputError(map_folder / "run.json",
                     "does not say where the scans lie; name them with --scans SCANS");
  for (const std::filesystem::path& path : paths) {
    std::error_code ignored;
    if (!std::filesystem::exists(path, ignored))
      throw InputError(
          map_folder / "run.json",
          fmt::format("says that the scans lie in {}, where nothing is; name them with --scans SCANS",
                      path.string()));
  }
  return paths;
}

LumResult optimize_with_lum(const Trajectory& trajectory, ScanSource& scans, const LumRequest& request,
                            const LumCallbacks& callbacks) {
  const auto prepare = [&] {
    check(request.settings);
    return std::make_unique<ScanCache>(scans, scans_of_trajectory(trajectory, scans), request.settings,
                                       request.scratch_folder);
  };
  ProcessGroup* group = request.group;
  if (group == nullptr || group->size() == 1) {
    const std::unique_ptr<ScanCache> cache = prepare();
    LocalLinkSums sums(*cache, request.settings);
    LumResult result = relax(trajectory, request, callbacks, sums);
    result.cache = cache->counters();
    return result;
  }
  if (group->rank() > 0) {
    LumResult result;
    result.is_worker = true;
    try {
      const std::unique_ptr<ScanCache> cache = prepare();
      LocalLinkSums sums(*cache, request.settings);
      serve_link_sums(*group, sums);
      result.cache = cache->counters();
    } catch (const Error& error) {
      refuse_link_sums(*group, error.what());
    }
    return result;
  }
  // The others wait from here on: whatever happens, `shared` releases them at its end.
  class NoSums final : public LinkSumSource {
    void sum(std::span<const ScanLink>, std::span<const Pose>, const LinkPass&, std::span<LinkSums>,
             const Progress&) override {}
  } no_sums;
  std::unique_ptr<ScanCache> cache;
  try {
    cache = prepare();
  } catch (...) {
    const SharedLinkSums release(*group, no_sums);
    throw;
  }
  LocalLinkSums own(*cache, request.settings);
  SharedLinkSums shared(*group, own);
  LumResult result = relax(trajectory, request, callbacks, shared);
  result.cache = cache->counters();
  return result;
}

void refuse_to_help(ProcessGroup& group, const std::string& problem) {
  if (group.rank() > 0) {
    refuse_link_sums(group, problem);
    return;
  }
  std::string release;
  group.broadcast(release);
}

nlohmann::json lum_report(const LumResult& result, const LumSettings& settings,
                          const Trajectory& trajectory) {
  nlohmann::json distrusted = nlohmann::json::array();
  nlohmann::json bridges = nlohmann::json::array();
  std::size_t usable = 0;
  for (const LinkOutcome& outcome : result.outcomes) {
    if (outcome.is_bridge) {
      bridges.push_back({outcome.link.k, outcome.link.j});
    } else if (outcome.is_usable) {
      ++usable;
      if (outcome.weight < 0.5) distrusted.push_back(to_json(outcome, trajectory));
    }
  }
  nlohmann::json iterations = nlohmann::json::array();
  for (std::size_t i = 0; i < result.history.size(); ++i) {
    const LumIteration& iteration = result.history[i];
    iterations.push_back({{"number", iteration.number},
                          {"distance_limit_m", iteration.distance_limit_m},
                          {"links", iteration.links},
                          {"usable", iteration.usable},
                          {"bridges", iteration.bridges},
                          {"distrusted", iteration.distrusted},
                          {"median_rms_m", iteration.median_rms_m},
                          {"mean_change_m", iteration.mean_change_m},
                          {"most_change_m", iteration.most_change_m},
                          {"mean_change_rad", iteration.mean_change_rad},
                          {"link_change_m", iteration.link_change_m},
                          {"seconds", result.seconds[i]}});
  }
  return {{"metric", settings.metric == LumMetric::point ? "point" : "plane"},
          {"converged", result.is_converged},
          {"iterations", result.iterations},
          {"links", {{"usable", usable}, {"distrusted", distrusted}, {"bridges", bridges}}},
          {"history", iterations},
          {"cache",
           {{"loaded_scans_limit", settings.loaded_scans},
            {"most_loaded", result.cache.most_loaded},
            {"most_bytes", result.cache.most_bytes},
            {"prepared", result.cache.prepared},
            {"brought_back", result.cache.brought_back},
            {"empty_scans", result.cache.empty}}}};
}

void write_covariances(const std::filesystem::path& csv, const Trajectory& trajectory,
                       const std::vector<Matrix6d>& covariances) {
  OutputFile file(csv);
  file.write("scan,stamp,xx,xy,xz,xa,xb,xc,yy,yz,ya,yb,yc,zz,za,zb,zc,aa,ab,ac,bb,bc,cc\n");
  for (std::size_t i = 0; i < covariances.size(); ++i) {
    std::string line = fmt::format("{},{:.9f}", i, trajectory.stamps_s[i]);
    for (Eigen::Index r = 0; r < 6; ++r)
      for (Eigen::Index c = r; c < 6; ++c) line += fmt::format(",{:.9e}", covariances[i](r, c));
    file.write(line + "\n");
  }
  file.commit();
}

}  // namespace alces::offline
