#include "lum_method.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "offline/io/bags/own_recording.h"
#include "offline/io/files/error.h"
#include "offline/io/scans/spooled_scan_source.h"
#include "offline/optimize/lum/map_deskew.h"
#include "offline/program/bag_options.h"
#include "offline/program/command.h"
#include "offline/replay/drive_replay.h"
#include "processes.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;

/// "[####......] iteration 7  1200/4223 links  change 12.3 mm  20 s left", ten times a second at most.
class LumBar {
 public:
  ~LumBar() {
    if (is_shown_) fmt::print(stderr, "\r\033[K");
  }
  void links(std::uint32_t iteration, std::size_t done, std::size_t total) {
    const Clock::time_point now = Clock::now();
    if (!is_terminal_ || total == 0 || (now - shown_ < std::chrono::milliseconds(100) && done < total))
      return;
    shown_ = now;
    is_shown_ = true;
    constexpr std::size_t width = 20;
    const std::size_t filled = std::min(width, width * done / total);
    fmt::print(stderr, "\r\033[K[{}{}] iteration {}  {}/{} links{}", std::string(filled, '#'),
               std::string(width - filled, '.'), iteration, done, total, tail_);
    std::fflush(stderr);
  }
  void iterated(const LumIteration& iteration, std::optional<double> left_s) {
    tail_ = fmt::format("  change {:.1f} mm", 1000 * iteration.mean_change_m);
    if (left_s)
      tail_ += *left_s < 120 ? fmt::format("  {:.0f} s left", *left_s)
                             : fmt::format("  {:.0f} min left", *left_s / 60);
  }

 private:
  using Clock = std::chrono::steady_clock;
  bool is_terminal_ = isatty(STDERR_FILENO) == 1;
  bool is_shown_ = false;
  Clock::time_point shown_;
  std::string tail_;
};

LumSettings settings_of(const LumOptions& options) {
  LumSettings settings = options.settings;
  if (options.metric == "point") {
    const LumSettings paper = paper_lum();
    settings.metric = paper.metric;
    settings.robust_share = paper.robust_share;
    settings.variance_floor_m = paper.variance_floor_m;
  }
  return settings;
}

/// Its mapper took the motion out of some scan.
bool was_deskewed(const nlohmann::json& report) {
  if (!report.is_object() || !report.contains("deskew") || !report["deskew"].is_object()) return false;
  const nlohmann::json& deskew = report["deskew"];
  return deskew.value("by_odometry", 0) > 0 || deskew.value("by_velocity", 0) > 0;
}

/// The scans of the map, any of them at any time. A drive is replayed as it was for the map.
std::unique_ptr<ScanSource> open_scans_of(const MapGraph& map, const LumOptions& options,
                                          const fs::path& scratch) {
  const std::vector<fs::path> paths =
      options.scans.empty() ? source_of_map(map.folder, map.report) : options.scans;
  const nlohmann::json::json_pointer replay("/source/replay");
  const bool was_replayed = map.report.is_object() && map.report.contains(replay);
  const bool is_bag = !was_replayed && is_ros_bag(paths.front());
  if (!was_replayed && (is_bag || paths.front().extension() != ".mcap")) {
    ScanSourceOptions reading;  // as for the map
    const nlohmann::json::json_pointer place("/source/reading");
    if (map.report.is_object() && map.report.contains(place)) {
      reading.scale = map.report[place].value("scale", 1.0);
      reading.format = map.report[place].value("format", "");
      reading.scan_interval_s = map.report[place].value("scan_interval_s", 0.0);
      reading.bag = bag_topics_from(map.report[place]);
    }
    std::unique_ptr<ScanSource> scans = open_scans(paths, reading);
    if (is_bag) {
      Progress progress("reading the bag");
      scans = std::make_unique<SpooledScanSource>(*scans, scratch, std::ref(progress));
    }
    if (!was_deskewed(map.report)) return scans;
    const std::vector<std::size_t> index = scans_of_trajectory(map.trajectory, *scans);
    return std::make_unique<MapDeskewedSource>(std::move(scans), map.trajectory, index);
  }
  DriveReplayOptions drive_options;
  if (was_replayed) {
    const nlohmann::json& how = map.report[replay];
    const std::string config = how.value("config", "");
    if (!config.empty()) drive_options.config = config;
    drive_options.deskew = how.value("deskew", true);
    drive_options.maps_dropped_scans = how.value("all_scans", false);
  }
  DriveReplay drive(paths.front(), drive_options);
  Progress progress("replaying the drive");
  return std::make_unique<SpooledScanSource>(drive, scratch, std::ref(progress));
}

constexpr const char* checkpoint_name = "lum.checkpoint";

}  // namespace

const std::vector<std::string>& lum_option_names() {
  static const std::vector<std::string> names = {
      "--scans",        "--lum-metric", "--lum-iterations", "--lum-change",  "--link-distance",
      "--loaded-scans", "--threads",    "--resume",         "--covariances", "--no-switches"};
  return names;
}

void add_lum_options(CLI::App& verb, LumOptions& options) {
  LumSettings& settings = options.settings;
  verb.add_option("--scans", options.scans, "lum: the scans of the map, where run.json does not know them");
  verb.add_option("--lum-metric", options.metric,
                  "lum: residuals along normals (plane), or whole (point, the paper)")
      ->check(CLI::IsMember({"plane", "point"}))
      ->capture_default_str();
  verb.add_option("--lum-iterations", settings.maximum_iterations, "lum: at most")->capture_default_str();
  verb.add_option("--lum-change", settings.link_change_m,
                  "lum: ends when linked scans move less against each other, m in the mean")
      ->capture_default_str();
  verb.add_option("--link-distance", settings.link_distance_m, "lum: scans so near are linked, m")
      ->capture_default_str();
  verb.add_option("--loaded-scans", settings.loaded_scans, "lum: in memory at once, some 0.2 MB each")
      ->capture_default_str();
  verb.add_option("--threads", settings.threads, "lum: 0: one a core")->capture_default_str();
  verb.add_flag("--resume", options.resume, "lum: go on where a run into the same OUT was stopped");
  verb.add_flag("--covariances", settings.covariances, "lum: write covariances.csv, of all poses");
  verb.add_flag("!--no-switches", settings.switches_links,
                "lum: trust links that pull against all others, too");
}

LumOutcome run_lum(const MapGraph& map, const LumOptions& options, const fs::path& out,
                   const StopSignal& stop) {
  ProcessGroup& group = processes();
  LumRequest request;
  request.settings = settings_of(options);
  // Beside OUT, thus on the disk that has room for a map; of OUT's folders those that are there.
  request.scratch_folder = fs::absolute(out / "").lexically_normal().parent_path().parent_path();
  std::error_code ignored;
  while (!fs::exists(request.scratch_folder, ignored) && request.scratch_folder.has_relative_path())
    request.scratch_folder = request.scratch_folder.parent_path();
  request.checkpoint = out / checkpoint_name;
  request.resume = options.resume;
  request.group = &group;
  std::unique_ptr<ScanSource> scans;
  try {
    check(request.settings);
    if (fs::equivalent(out, map.folder, ignored))
      throw UsageError(out.string() + ": is the map itself; write the better one to a folder of its own");
    if (request.resume && group.rank() == 0 && !fs::exists(*request.checkpoint))
      throw InputError(*request.checkpoint,
                       "is not there: nothing was stopped in this folder; start without --resume");
    scans = open_scans_of(map, options, request.scratch_folder);
  } catch (const Error& error) {
    refuse_to_help(group, error.what());
    if (group.rank() == 0) throw;
    LumOutcome outcome;
    outcome.is_worker = true;
    return outcome;
  }
  LumResult result;
  {
    LumBar bar;
    result = optimize_with_lum(
        map.trajectory, *scans, request,
        {.progress = [&](std::uint32_t i, std::size_t done, std::size_t total) { bar.links(i, done, total); },
         .iterated = [&](const LumIteration& i, std::optional<double> left_s) { bar.iterated(i, left_s); },
         .stop_requested = [&] { return stop.received() != 0; }});
  }
  LumOutcome outcome;
  outcome.is_worker = result.is_worker;
  if (outcome.is_worker) return outcome;
  outcome.was_stopped = result.was_stopped;
  outcome.graph = std::move(result.link_graph);
  outcome.covariances = std::move(result.covariances);
  outcome.details = lum_report(result, request.settings, map.trajectory);
  outcome.details["ranks"] = group.size();
  const nlohmann::json& links = outcome.details["links"];
  outcome.sentence = fmt::format("{} iterations, {}; {} links", result.iterations,
                                 result.is_converged  ? "converged"
                                 : result.was_stopped ? "stopped (go on with --resume)"
                                                      : "at the limit of iterations",
                                 links["usable"].get<std::size_t>());
  if (!result.history.empty())
    outcome.sentence +=
        fmt::format("; in the last, linked scans moved by {:.2f} mm against each other, all by {:.2f} mm",
                    1000 * result.history.back().link_change_m, 1000 * result.history.back().mean_change_m);
  for (const nlohmann::json& bridge : links["bridges"])
    outcome.sentence +=
        fmt::format("\n  nothing links scan {} to those before it: it keeps its place behind scan {}",
                    bridge[1].get<std::uint32_t>(), bridge[0].get<std::uint32_t>());
  for (const nlohmann::json& link : links["distrusted"])
    outcome.sentence +=
        fmt::format("\n  distrusted: scans {} and {} pull by {:.0f} mm against the others (overlap {:.0f} %)",
                    link["earlier_scan"].get<std::uint32_t>(), link["scan"].get<std::uint32_t>(),
                    1000 * link["pull_m"].get<double>(), 100 * link["overlap"].get<double>());
  if (result.cache.empty > 0)
    outcome.sentence += fmt::format("\n  {} scans without a usable point", result.cache.empty);
  return outcome;
}

void write_covariances(const LumOutcome& outcome, const MapGraph& map, const fs::path& folder) {
  if (!outcome.covariances.empty())
    write_covariances(folder / "covariances.csv", map.trajectory, outcome.covariances);
}

void finish_lum(const LumOutcome& outcome, const fs::path& out) {
  std::error_code ignored;
  if (!outcome.was_stopped) fs::remove(out / checkpoint_name, ignored);
}

}  // namespace alces::offline
