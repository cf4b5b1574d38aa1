#include "tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "offline/io/files/json_text.h"
#include "offline/io/files/output_file.h"
#include "offline/io/map_folder/statistics_json.h"

namespace alces::offline {
namespace {

using Json = nlohmann::json;

std::string plus_minus(const Statistics& statistics, int digits) {
  return fmt::format("{:.{}f} ± {:.{}f}", statistics.mean, digits, statistics.standard_deviation, digits);
}

bool has_errors(const ExperimentResult& result) {
  return std::any_of(result.rows.begin(), result.rows.end(),
                     [](const RowResult& row) { return row.error.has_value(); });
}

bool has_consistency(const ExperimentResult& result) {
  return std::any_of(result.rows.begin(), result.rows.end(),
                     [](const RowResult& row) { return row.consistency.has_value(); });
}

std::string error_table(const ExperimentResult& result) {
  std::string text =
      "## Error against ground truth (the paper's Table 1)\n\n"
      "Mean and standard deviation over the scans.\n\n"
      "| strategy | translation [m] | x and y only [m] | rotation [deg] | angle [deg] | worst [m] | loops |\n"
      "|---|---|---|---|---|---|---|\n";
  for (const RowResult& row : result.rows) {
    if (!row.error) continue;
    text += fmt::format(
        "| {} | {} | {} | {} | {} | {:.2f} | {} |\n", row.row.title, plus_minus(row.error->translation_m, 3),
        plus_minus(row.error->translation_xy_m, 3), plus_minus(row.error->quaternion_angle_deg, 3),
        plus_minus(row.error->rotation_deg, 3), row.error->translation_m.max, row.loops_closed);
  }
  return text +
         "\n*rotation* is the paper's figure, arccos |q . q_ref| of the quaternions; *angle* is the angle of "
         "rotation between the two orientations, twice that. *worst*: of the translation.\n";
}

std::string centimetres(const std::optional<double>& m) {
  return m ? fmt::format("{:.2f}", 100 * *m) : "-";
}

std::string consistency_table(const ExperimentResult& result) {
  std::string text =
      "## Consistency (no ground truth: this is not an error)\n\n"
      "How well scans agree that see the same surfaces: the median distance along the surface's normal, over "
      "the points of a pair of scans, then over the pairs. A map may be consistent and bent all the same.\n\n"
      "| strategy |";
  std::string rule = "|---|";
  const auto first = std::find_if(result.rows.begin(), result.rows.end(),
                                  [](const RowResult& row) { return row.consistency.has_value(); });
  for (const GroupConsistency& group : first->consistency->groups) {
    text += fmt::format(" {} [cm] |", group.name);
    rule += "---|";
  }
  text +=
      " pairs without overlap | map entropy | plane variance [cm2] | loops |\n" + rule + "---|---|---|---|\n";
  for (const RowResult& row : result.rows) {
    if (!row.consistency) continue;
    text += fmt::format("| {} |", row.row.title);
    std::size_t pairs = 0;
    std::size_t without = 0;
    for (const GroupConsistency& group : row.consistency->groups) {
      text += fmt::format(" {} |", centimetres(group.median_m));
      pairs += group.pairs.size();
      without += group.without_overlap;
    }
    text += fmt::format(" {} of {} | {:.3f} | {:.2f} | {} |\n", without, pairs,
                        row.consistency->entropy.mean_entropy,
                        row.consistency->entropy.mean_plane_variance_m2 * 1e4, row.loops_closed);
  }
  return text +
         "\n*map entropy* (nats) and *plane variance* are means over the map's points: how crisp surfaces "
         "are, lower "
         "is better. A map that tears a loop open can be crisp: read them beside the revisits.\n";
}

std::string seconds_cell(double s) {
  if (s == 0) return "";
  return s < 0.1 ? fmt::format("{:.6f}", s) : fmt::format("{:.2f}", s);
}

std::string time_table(const ExperimentResult& result) {
  std::string text =
      "## Run time [s] (the paper's Table 2)\n\n"
      "| strategy | ICP | online front end | online back end | post front end | post back end | total |\n"
      "|---|---|---|---|---|---|---|\n";
  for (const RowResult& row : result.rows) {
    const RowTimes& times = row.times;
    text +=
        fmt::format("| {} | {} | {} | {} | {} | {} | {:.2f} |\n", row.row.title, seconds_cell(times.icp_s),
                    seconds_cell(times.online_front_end_s), seconds_cell(times.online_back_end_s),
                    seconds_cell(times.post_front_end_s), seconds_cell(times.post_back_end_s), times.total_s);
  }
  return text +
         "\n*ICP*: downsampling, indexing and matching each scan. *Online front end*: detecting loops and "
         "matching them; of LUM also the links' correspondences. *Online back end*: LOA with sharing out, or "
         "what stands in its place. *Post front end*: links and their matches. *Post back end*: equations "
         "and "
         "their solution. *total*: by the clock, with reading the scans; maps written not counted. Online "
         "work "
         "is done by one core (LUM: all), post-processing by all.\n";
}

Json to_json(const RowResult& row) {
  Json json = {{"key", row.row.key},
               {"title", row.row.title},
               {"map_folder", row.row.key},
               {"color", row.row.color},
               {"scans", row.scans},
               {"loops_closed", row.loops_closed},
               {"loops_refused", row.loops_refused},
               {"iterations", row.iterations},
               {"converged", row.is_converged},
               {"times_s",
                {{"icp", row.times.icp_s},
                 {"online_front_end", row.times.online_front_end_s},
                 {"online_back_end", row.times.online_back_end_s},
                 {"post_front_end", row.times.post_front_end_s},
                 {"post_back_end", row.times.post_back_end_s},
                 {"total", row.times.total_s}}}};
  if (row.error)
    json["error"] = {{"translation_m", to_json(row.error->translation_m)},
                     {"translation_xy_m", to_json(row.error->translation_xy_m)},
                     {"rotation_arccos_q_qref_deg", to_json(row.error->quaternion_angle_deg)},
                     {"rotation_deg", to_json(row.error->rotation_deg)}};
  if (row.consistency) {
    Json groups = Json::array();
    for (const GroupConsistency& group : row.consistency->groups)
      groups.push_back({{"name", group.name},
                        {"pairs", group.pairs.size()},
                        {"without_overlap", group.without_overlap},
                        {"median_m", group.median_m ? Json(*group.median_m) : Json()}});
    const MapEntropy& entropy = row.consistency->entropy;
    json["consistency"] = {{"groups", std::move(groups)},
                           {"map_entropy",
                            {{"points", entropy.points},
                             {"measured", entropy.measured},
                             {"mean_entropy", entropy.mean_entropy},
                             {"mean_plane_variance_m2", entropy.mean_plane_variance_m2}}}};
  }
  return json;
}

void write_table(const std::filesystem::path& path, const std::string& text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace

std::string markdown_tables(const ExperimentResult& result, const ExperimentFacts& facts) {
  std::string text = fmt::format("# Comparison of {}\n\n", facts.source);
  if (facts.truth.empty())
    text += "No ground truth was given.\n\n";
  else
    text += fmt::format("Ground truth: {}.\n\n", facts.truth);
  if (!facts.circular.empty()) text += fmt::format("**No measure of accuracy:** {}.\n\n", facts.circular);
  if (has_errors(result)) text += error_table(result) + "\n";
  if (has_consistency(result)) text += consistency_table(result) + "\n";
  text += time_table(result);
  for (const std::string& warning : result.warnings) text += fmt::format("\nNote: {}.\n", warning);
  if (result.problem) text += fmt::format("\nNot finished: {}.\n", result.problem->what());
  return text;
}

std::string csv_table(const ExperimentResult& result) {
  std::string text =
      "strategy,scans,loops_closed,loops_refused,translation_mean_m,translation_sd_m,xy_mean_m,xy_sd_m,"
      "rotation_mean_deg,rotation_sd_deg,next_cm,five_apart_cm,revisits_cm,map_entropy,plane_variance_cm2,"
      "icp_s,online_front_end_s,"
      "online_back_end_s,post_front_end_s,post_back_end_s,total_s\n";
  for (const RowResult& row : result.rows) {
    text += fmt::format("{},{},{},{}", row.row.title, row.scans, row.loops_closed, row.loops_refused);
    if (row.error) {
      for (const Statistics* statistics :
           {&row.error->translation_m, &row.error->translation_xy_m, &row.error->quaternion_angle_deg})
        text += fmt::format(",{:.6f},{:.6f}", statistics->mean, statistics->standard_deviation);
    } else {
      text += ",,,,,,";
    }
    for (std::size_t i = 0; i < 3; ++i) {
      text += ',';
      if (row.consistency && i < row.consistency->groups.size() && row.consistency->groups[i].median_m)
        text += centimetres(row.consistency->groups[i].median_m);
    }
    text += row.consistency ? fmt::format(",{:.6f},{:.6f}", row.consistency->entropy.mean_entropy,
                                          row.consistency->entropy.mean_plane_variance_m2 * 1e4)
                            : std::string(",,");
    const RowTimes& times = row.times;
    for (const double s : {times.icp_s, times.online_front_end_s, times.online_back_end_s,
                           times.post_front_end_s, times.post_back_end_s, times.total_s})
      text += fmt::format(",{:.6f}", s);
    text += "\n";
  }
  return text;
}

Json experiment_json(const ExperimentResult& result, const ExperimentFacts& facts) {
  Json json = {
      {"program", {{"name", "alces"}, {"version", facts.version}, {"command_line", facts.command_line}}},
      {"source", facts.source},
      {"truth", facts.truth.empty() ? Json() : Json(facts.truth)},
      {"truth_was_odometry", !facts.circular.empty()},
      {"front_end", facts.front_end},
      {"settings", facts.settings},
      {"complete", !result.problem.has_value()},
      {"stopped_by", result.problem ? Json(result.problem->what()) : Json()},
      {"warnings", result.warnings},
      {"rows", Json::array()}};
  for (const RowResult& row : result.rows) json["rows"].push_back(to_json(row));
  return json;
}

void write_tables(const std::filesystem::path& out, const ExperimentResult& result,
                  const ExperimentFacts& facts) {
  write_table(out / "tables.md", markdown_tables(result, facts));
  write_table(out / "tables.csv", csv_table(result));
  write_table(out / "compare.json", json_text(experiment_json(result, facts)) + "\n");
}

}  // namespace alces::offline
