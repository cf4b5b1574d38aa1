#include "online_row.h"

#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <memory>
#include <optional>
#include <system_error>

#include "drive_observer.h"
#include "offline/io/files/error.h"
#include "offline/io/files/json_text.h"
#include "offline/io/files/output_file.h"
#include "offline/io/map_folder/map_folder.h"
#include "scan_relaxation.h"

namespace alces::offline {
namespace {

constexpr double s_per_ns = 1e-9;

const char* back_end_of(OnlineMethod method) {
  switch (method) {
    case OnlineMethod::icp:
      return "none";
    case OnlineMethod::toro:
      return "toro";
    case OnlineMethod::hogman:
      return "hogman";
    case OnlineMethod::lum:
    case OnlineMethod::elch:
      break;
  }
  return "elch";
}

/// The file goes away with the object.
class Scratch {
 public:
  explicit Scratch(std::filesystem::path file) : file_(std::move(file)) {}
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
  }

 private:
  std::filesystem::path file_;
};

RowTimes times_of(const MapRun& run, const LumRelaxation* relaxation) {
  std::uint64_t icp_ns = 0;
  std::uint64_t loop_ns = 0;
  std::uint64_t share_ns = 0;
  for (const MappedScan& scan : run.mapped()) {
    icp_ns += scan.times.reduce_ns + scan.times.store_ns + scan.times.match_ns;
    loop_ns += scan.times.detect_ns + scan.times.loop_match_ns;
    share_ns += scan.times.loop_share_ns;
  }
  RowTimes times;
  times.icp_s = static_cast<double>(icp_ns) * s_per_ns;
  times.online_front_end_s = static_cast<double>(loop_ns) * s_per_ns;
  times.online_back_end_s = static_cast<double>(share_ns) * s_per_ns;
  if (relaxation != nullptr) {
    times.online_front_end_s += relaxation->times().front_end_s;
    times.online_back_end_s = relaxation->times().back_end_s;
  }
  times.total_s = run.wall_s();
  return times;
}

std::size_t scan_being_added(const MapRun& run) {
  std::size_t next = 0;
  if (!run.mapped().empty()) next = run.mapped().back().source_index + 1;
  if (!run.refused().empty()) next = std::max(next, run.refused().back().source_index + 1);
  return next;
}

void write_report(const std::filesystem::path& folder, const nlohmann::json& report) {
  OutputFile file(folder / "run.json");
  file.write(json_text(report) + "\n");
  file.commit();
}

}  // namespace

Error interrupted(const CompareRow& row, int signal) {
  return Error(fmt::format("{} in the row {}", signal == SIGINT ? "interrupted" : "told to stop", row.key),
               128 + signal);
}

RowResult run_online_row(const CompareRow& row, SpooledScanSource& scans, const ExperimentRequest& request,
                         const ExperimentCallbacks& callbacks) {
  const auto stop_signal = [&] { return callbacks.stop_signal ? callbacks.stop_signal() : 0; };
  std::vector<std::size_t> source_index;
  std::optional<DriveObserver> observer;
  if (request.truth) observer.emplace(*request.truth, request.watched);

  MapRequest map = request.map;
  map.loop_back_end = back_end_of(row.online);
  map.archive = request.out / fmt::format(".{}.archive", row.key);
  const Scratch scratch(*map.archive);
  std::optional<LumRelaxation> relaxation;
  std::unique_ptr<MapRun> run;
  // The relaxation asks for it as long as the drive lasts.
  const auto index_so_far = [&](std::size_t count) {
    std::vector<std::size_t> index;
    for (const MappedScan& scan : run->mapped()) index.push_back(scan.source_index);
    if (index.size() < count) index.push_back(scan_being_added(*run));
    return index;
  };
  if (row.online == OnlineMethod::lum) {
    map.config.trigger.repeat_after_scans = 0;
    relaxation.emplace(scans, request.lum, request.out, index_so_far,
                       ScanRelaxationCallbacks{
                           .progress =
                               [&](std::uint32_t iteration, std::size_t done, std::size_t total) {
                                 if (callbacks.progress)
                                   callbacks.progress(row.title,
                                                      fmt::format("scan {}, relaxation {}, iteration {}",
                                                                  run->mapped().size(),
                                                                  relaxation->relaxations() + 1, iteration),
                                                      done, total);
                               },
                           .iterated =
                               [&](std::span<const Pose> poses) {
                                 if (observer) observer->relaxed(poses, index_so_far(poses.size()));
                               },
                           .stop_requested = [&] { return stop_signal() != 0; }});
    map.relaxation = &*relaxation;
  }
  run = std::make_unique<MapRun>(scans, map);
  const auto observe = [&] {
    for (std::size_t i = source_index.size(); i < run->mapped().size(); ++i)
      source_index.push_back(run->mapped()[i].source_index);
    if (observer)
      observer->scanned(run->mapper().graph().poses(), source_index, run->mapper().counters().loops_closed);
  };
  run->run({[&](std::size_t done, std::size_t total) {
              observe();
              if (callbacks.progress) callbacks.progress(row.title, "scans", done, total);
            },
            stop_signal});
  if (const int signal = stop_signal(); signal != 0) throw interrupted(row, signal);
  if (run->problem()) throw Error(*run->problem());
  if (run->mapper().scan_count() < 2)
    throw InputError(fmt::format("only {} of {} scans could be mapped ({})", run->mapper().scan_count(),
                                 scans.size(), scans.description()));
  observe();  // finish() may have closed a last loop

  RowResult result;
  result.row = row;
  result.scans = run->mapper().scan_count();
  result.loops_closed = run->mapper().counters().loops_closed;
  result.loops_refused = run->mapper().counters().loops_offered - result.loops_closed;
  if (relaxation) result.iterations = relaxation->iterations();
  result.times = times_of(*run, relaxation ? &*relaxation : nullptr);
  result.trajectory = run->trajectory();
  result.source_index = std::move(source_index);
  const std::vector<std::string> of_source = scans.warnings();
  for (const std::string& warning : run->warnings())
    if (std::find(of_source.begin(), of_source.end(), warning) == of_source.end())
      result.warnings.push_back(warning);
  if (observer) {
    result.drive = observer->drive();
    result.watched = observer->watched();
  }
  const std::filesystem::path folder = request.out / row.key;
  nlohmann::json report = write_map_folder(folder, *run, request.program);
  if (row.online == OnlineMethod::lum) {
    report["loop_optimizer"] = "lum";
    report["lum"] = {{"relaxations", relaxation->relaxations()}, {"iterations", relaxation->iterations()}};
    write_report(folder, report);
  }
  return result;
}

}  // namespace alces::offline
