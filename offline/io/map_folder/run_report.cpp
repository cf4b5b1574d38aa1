#include "run_report.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <numbers>

#include "map_health.h"
#include "offline/evaluate/evaluation.h"
#include "offline/io/files/byte_size.h"
#include "offline/map/mapper_settings.h"

namespace alces::offline {
namespace {

using Json = nlohmann::json;

/// Median, worst and sum of one stage over the scans, in ms and s.
template <typename Stage>
Json stage(const std::vector<MappedScan>& scans, Stage stage_ns) {
  std::vector<double> ms;
  double total_ms = 0;
  double worst_ms = 0;
  for (const MappedScan& scan : scans) {
    ms.push_back(static_cast<double>(stage_ns(scan.times)) * 1e-6);
    total_ms += ms.back();
    worst_ms = std::max(worst_ms, ms.back());
  }
  return {{"median_ms", median(ms)}, {"worst_ms", worst_ms}, {"total_s", total_ms * 1e-3}};
}

/// Of the scans that closed or refused a loop.
Json loop_stage(const std::vector<MappedScan>& scans) {
  std::vector<MappedScan> with_loop;
  std::copy_if(scans.begin(), scans.end(), std::back_inserter(with_loop),
               [](const MappedScan& scan) { return scan.times.loop_match_ns > 0; });
  Json json;
  json["match"] = stage(with_loop, [](const StageTimes& t) { return t.loop_match_ns; });
  json["share_out"] = stage(with_loop, [](const StageTimes& t) { return t.loop_share_ns; });
  return json;
}

Json pose_numbers(const Pose& pose) {
  const Eigen::Vector3d& t = pose.translation_m;
  const Eigen::Quaterniond& q = pose.rotation;
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

Json loops(const MapRun& run) {
  Json list = Json::array();
  for (std::size_t i = 0; i < run.mapper().loops().size(); ++i) {
    const LoopReport& loop = run.mapper().loops()[i];
    const bool accepted = loop.verdict == LoopVerdict::closed;
    Json json = {{"first", loop.first},
                 {"last", loop.last},
                 {"first_scan", run.source().number(run.mapped()[loop.first].source_index)},
                 {"last_scan", run.source().number(run.mapped()[loop.last].source_index)},
                 {"accepted", accepted},
                 {"reason", to_string(loop.verdict)},
                 {"distance_m", loop.distance_m},
                 {"overlap", loop.overlap},
                 {"rms_m", loop.rms_m},
                 {"wall_fit", loop.wall_fit},
                 {"fit", loop.fit},
                 {"usual_fit", loop.usual_fit},
                 {"expected_m", loop.expected_m},
                 {"mahalanobis2", loop.mahalanobis2},
                 {"correction_m", loop.correction_m},
                 {"correction_deg", loop.correction_rad * 180 / std::numbers::pi},
                 {"iterations", loop.iterations},
                 {"first_from_last_before", pose_numbers(run.first_from_last_before()[i])},
                 {"share_out_ms", static_cast<double>(loop.share_ns) * 1e-6}};
    list.push_back(std::move(json));
  }
  return list;
}

Json memory(const MapRun& run) {
  const MemoryPlan& plan = run.memory();
  const ScanStore::Counters& store = run.mapper().store_counters();
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return {{"limit_bytes", plan.limit_bytes},
          {"block_bytes", plan.block_bytes},
          {"pool_bytes", plan.pool_bytes},
          {"pool_used_bytes", store.pool_bytes},
          {"scans_bytes", plan.scans_bytes},
          {"scan_bytes", plan.scan_bytes},
          {"cache_bytes", plan.cache_bytes},
          {"cache_slot_bytes", plan.cache_slot_bytes},
          {"working_bytes", plan.working_bytes},
          {"archive_bytes", store.archive_bytes},
          {"process_peak_bytes", static_cast<std::uint64_t>(usage.ru_maxrss) * 1024}};
}

Json counters(const MapRun& run) {
  const Mapper::Counters& mapper = run.mapper().counters();
  const ScanStore::Counters& store = run.mapper().store_counters();
  return {{"points_in", mapper.points_in},
          {"points_not_finite", mapper.points_not_finite},
          {"points_too_near", mapper.points_too_near},
          {"points_too_far", mapper.points_too_far},
          {"points_without_cell", mapper.points_without_cell},
          {"points_stored", store.points},
          {"scans_refused", mapper.scans_refused},
          {"scans_predicted", mapper.scans_predicted},
          {"archive_failures", run.archive_failures()},
          {"scans_thinned", run.thinned_scans()},
          {"coarsest_cell_m", run.coarsest_cell_m()},
          {"scans_archived", store.archived_scans},
          {"slot_hits", store.slot_hits},
          {"slot_misses", store.slot_misses},
          {"loops_offered", mapper.loops_offered},
          {"loops_closed", mapper.loops_closed},
          {"loops_not_listed", mapper.loops_not_listed},
          {"loops_not_relaxed", mapper.loops_not_relaxed},
          {"gps_not_finite", mapper.gps_not_finite}};
}

/// Which poses the map was started from, and enough of them to know them again in another file: an evaluation
/// against these is none.
Json odometry(const MapRun& run) {
  const std::optional<OdometryOrigin> origin = run.source().odometry_origin();
  if (!origin) return nullptr;
  Json json = {{"path", std::filesystem::absolute(origin->path).lexically_normal().string()},
               {"digest", origin->digest},
               {"paired_by", origin->paired_by},
               {"sample", Json::array()}};
  constexpr std::size_t samples = 16;
  const std::size_t count = run.mapped().size();
  for (std::size_t i = 0; i < std::min(samples, count); ++i) {
    const std::size_t row = i * (count - 1) / std::max<std::size_t>(1, std::min(samples, count) - 1);
    const std::optional<Pose> pose = run.source().odometry(run.mapped()[row].source_index);
    if (pose) json["sample"].push_back({{"row", row}, {"pose", pose_numbers(*pose)}});
  }
  return json;
}

}  // namespace

Json run_report(const MapRun& run, const ProgramFacts& program,
                const std::map<std::string, double>& write_s) {
  Json json;
  json["program"] = {{"name", "alces"}, {"version", program.version}, {"command_line", program.command_line}};
  json["source"] = {{"description", run.source().description()}, {"scans", run.source().size()}};
  json["source"].update(program.source);
  json["source"]["odometry"] = odometry(run);
  json["origin_m"] = run.source().origin_m();
  json["source"]["channels"] = run.source().channels();
  json["deskew"] = run.deskew().json();
  json["front_end"] = program.front_end;
  json["loop_optimizer"] = run.loop_back_end();
  json["settings"] = to_json(run.mapper().config());
  json["complete"] = !run.problem().has_value();
  json["stopped_by"] = run.problem() ? Json(run.problem()->what()) : Json();
  json["scans"] = run.mapper().scan_count();
  json["length_m"] = run.length_m();
  const MapHealth health = run.mapper().health();
  std::vector<std::size_t> numbers;
  for (const MappedScan& scan : run.mapped()) numbers.push_back(run.source().number(scan.source_index));
  json["verdict"] = to_string(health.verdict);
  json["health"] = health_json(health, numbers);
  json["loops"] = loops(run);
  const std::vector<MappedScan>& scans = run.mapped();
  std::vector<double> kept;
  for (const MappedScan& scan : scans) kept.push_back(scan.kept_points);
  json["points_a_scan"] = {{"median", median(kept)}, {"max", statistics(kept).max}};
  const Json loop_times = loop_stage(scans);
  json["times"] = {
      {"front_end", stage(scans, [](const StageTimes& t) { return t.reduce_ns + t.store_ns + t.match_ns; })},
      {"reduce", stage(scans, [](const StageTimes& t) { return t.reduce_ns; })},
      {"store", stage(scans, [](const StageTimes& t) { return t.store_ns; })},
      {"match", stage(scans, [](const StageTimes& t) { return t.match_ns; })},
      {"detect", stage(scans, [](const StageTimes& t) { return t.detect_ns; })},
      {"loop_match", loop_times["match"]},
      {"loop_share_out", loop_times["share_out"]},
      {"mapping_s", run.mapping_s()},
      {"read_wait_s", run.read_wait_s()},
      {"write_s", write_s},
      {"run_s", run.wall_s()}};
  json["memory"] = memory(run);
  json["counters"] = counters(run);
  Json refused = Json::array();
  for (const RefusedScan& scan : run.refused())
    refused.push_back({{"scan", run.source().number(scan.source_index)},
                       {"name", run.source().name(scan.source_index)},
                       {"reason", to_string(scan.reason)}});
  json["refused_scans"] = std::move(refused);
  Json thinned = Json::array();
  for (const MappedScan& scan : scans) {
    if (!scan.is_thinned) continue;
    thinned.push_back({{"scan", run.source().number(scan.source_index)}, {"cell_m", scan.cell_size_m}});
  }
  json["thinned_scans"] = std::move(thinned);
  json["warnings"] = run.warnings();
  if (!program.drive.is_null()) json["drive"] = program.drive;
  return json;
}

std::string run_summary(const MapRun& run, const Json& report) {
  std::string lines;
  const auto line = [&lines](const std::string& text_of_line) { lines += text_of_line + "\n"; };
  const Mapper::Counters& counters = run.mapper().counters();
  const double run_s = run.wall_s();
  line(fmt::format("{} of {} scans mapped, {:.1f} m, in {:.2f} s ({:.0f} scans a second)",
                   run.mapper().scan_count(), run.source().size(), run.length_m(), run_s,
                   static_cast<double>(run.mapper().scan_count()) / std::max(run_s, 1e-9)));
  line(run.source().description());
  for (const std::string& clause : {run.source().channels(), run.deskew().text()})
    if (!clause.empty()) line(clause);
  line(fmt::format("loops: {} closed, {} refused", counters.loops_closed,
                   counters.loops_offered - counters.loops_closed));
  for (const LoopReport& loop : run.mapper().loops()) {
    if (loop.verdict == LoopVerdict::closed) continue;
    line(fmt::format(
        "  {} with {} {} (distance {:.1f} m, overlap {:.0f} %, rms {:.3f} m, correction {:.2f} m)",
        run.name_in_source(loop.last), run.name_in_source(loop.first), to_string(loop.verdict),
        loop.distance_m, 100 * loop.overlap, loop.rms_m, loop.correction_m));
  }
  const Json& times = report["times"];
  const auto stage_line = [&](const char* title, const Json& stage_times) {
    line(fmt::format("  {:<22}{:>8.2f} ms median {:>8.2f} ms worst {:>8.2f} s in all", title,
                     stage_times["median_ms"].get<double>(), stage_times["worst_ms"].get<double>(),
                     stage_times["total_s"].get<double>()));
  };
  line("times");
  stage_line("front end, a scan", times["front_end"]);
  stage_line("  downsampling", times["reduce"]);
  stage_line("  tree and surface", times["store"]);
  stage_line("  matching", times["match"]);
  stage_line("loop matching, a loop", times["loop_match"]);
  stage_line("  sharing out", times["loop_share_out"]);
  double written_s = 0;
  for (const auto& [file, seconds] : times["write_s"].items()) written_s += seconds.get<double>();
  line(fmt::format("  waited {:.2f} s for the scans to be read; {:.2f} s to write the map", run.read_wait_s(),
                   written_s));
  const MemoryPlan& plan = run.memory();
  const ScanStore::Counters& store = run.mapper().store_counters();
  line(fmt::format("memory: one block of {} (pool {}, {} scans {}, cache {}, working {})",
                   format_byte_size(plan.block_bytes), format_byte_size(plan.pool_bytes),
                   run.mapper().config().scan_capacity, format_byte_size(plan.scans_bytes),
                   format_byte_size(plan.cache_bytes), format_byte_size(plan.working_bytes)));
  line(fmt::format("  {} of the pool used, {} in {} archived scans", format_byte_size(store.pool_bytes),
                   format_byte_size(store.archive_bytes), store.archived_scans));
  line("  " + verdict_line(report));
  return lines;
}

}  // namespace alces::offline
