#include "map_health.h"

#include <fmt/format.h>

#include <cstdint>
#include <numbers>

namespace alces::offline {
namespace {

constexpr std::size_t chance = 2;  // loops that mean nothing yet, as in judge_map()

using Json = nlohmann::json;

const Json& member(const Json& object, const char* name) {
  static const Json nothing;
  if (!object.is_object()) return nothing;
  const auto found = object.find(name);
  return found == object.end() ? nothing : *found;
}

std::string scan_list(const Json& scans) {
  std::string list;
  if (!scans.is_array()) return list;
  for (const Json& scan : scans) {
    if (scan.is_number_integer())
      list += fmt::format("{}{}", list.empty() ? "" : ", ", scan.get<std::int64_t>());
  }
  return list;
}

}  // namespace

Json health_json(const MapHealth& health, const std::vector<std::size_t>& numbers) {
  Json weakest = Json::array();
  for (std::uint32_t i = 0; i < health.weakest_count; ++i)
    weakest.push_back(numbers.at(health.weakest.at(i)));
  return {{"doubt", to_string(health.doubt)},
          {"scans", health.scans},
          {"length_m", health.length_m},
          {"expected_error_m", health.expected_error_m},
          {"parts", health.parts},
          {"steps_found", health.found},
          {"steps_on_odometry", health.on_odometry},
          {"steps_against_odometry", health.against_odometry},
          {"steps_weak", health.weak},
          {"odometry_scale", health.odometry_scale},
          {"tilt_deg", health.tilt_rad * 180 / std::numbers::pi},
          {"loops_closed", health.closed},
          {"revisits", health.revisits},
          {"loops_unmatched", health.unmatched},
          {"loops_implausible", health.implausible},
          {"weakest_scans", std::move(weakest)}};
}

std::string verdict_line(const Json& run) {
  const Json& verdict = member(run, "verdict");
  if (!verdict.is_string()) return {};
  std::string line = "verdict: " + verdict.get<std::string>();
  const Json& health = member(run, "health");
  const Json& doubt = member(health, "doubt");
  if (doubt.is_string()) line += ": " + doubt.get<std::string>();
  if (verdict == "good") {
    // Loops that hold a map do not keep what lies between and beyond them from bending.
    const Json& tilt = member(health, "tilt_deg");
    if (tilt.is_number() && tilt.get<double>() > steepest_rad * 180 / std::numbers::pi)
      line +=
          fmt::format("; but heights may be bent: it tilts by {:.0f} deg, and vehicles with wheels do not",
                      tilt.get<double>());
    return line;
  }
  if (const Json& parts = member(health, "parts"); parts.is_number_integer() && parts.get<std::int64_t>() > 1)
    line += fmt::format("; {} parts", parts.get<std::int64_t>());
  const Json& weakest = member(health, "weakest_scans");
  if (const std::string scans = scan_list(weakest); !scans.empty())
    line += fmt::format("; look at {} {}", weakest.size() == 1 ? "scan" : "scans", scans);
  return line;
}

void add_optimization(Json& run, const Json& optimize, std::size_t loops) {
  // Of a map that is optimised once more the drive's verdict counts, not that of the first time.
  const Json before = member(run, "optimize");
  const Json& drive_verdict = member(before, "drive_verdict");
  const Json& drive_doubt = member(before, "drive_doubt");
  Json verdict = drive_verdict.is_string() ? drive_verdict : member(run, "verdict");
  Json doubt = drive_doubt.is_string() ? drive_doubt : member(member(run, "health"), "doubt");
  run["optimize"] = optimize;
  run["optimize"]["drive_verdict"] = verdict;
  run["optimize"]["drive_doubt"] = doubt;
  const Json& edges = member(optimize, "distrusted");
  const std::size_t distrusted = edges.is_array() ? edges.size() : 0;
  const bool contradict = distrusted > chance && 10 * distrusted > loops;
  if (contradict) {
    const std::string why = fmt::format("{} of {} loops contradict the others", distrusted, loops);
    doubt = verdict.is_string() && verdict != "good" && doubt.is_string()
                ? doubt.get<std::string>() + "; and " + why
                : why;
    verdict = verdict == "doubtful" || verdict == "bad" ? "bad" : "doubtful";
  }
  if (!verdict.is_string()) return;  // a map from before there were verdicts
  run["verdict"] = std::move(verdict);
  if (!member(run, "health").is_object()) run["health"] = Json::object();
  if (doubt.is_string()) run["health"]["doubt"] = std::move(doubt);
  run["health"]["loops_distrusted"] = distrusted;
}

}  // namespace alces::offline
