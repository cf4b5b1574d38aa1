#include "circular_truth.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <system_error>
#include <vector>

#include "alces_platform/bags/bag_reader.h"
#include "offline/io/files/input_file.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// The odometry that run.json names; null where it names none.
Json odometry_of_map(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::is_regular_file(folder / "run.json", ignored)) return nullptr;
  std::string bytes;
  read_file(folder / "run.json", bytes);
  const Json run = Json::parse(bytes, nullptr, false);
  const Json::json_pointer place("/source/odometry");
  return run.is_object() && run.contains(place) ? run[place] : Json();
}

std::string digest_of(const fs::path& file) {
  std::string bytes;
  read_file(file, bytes);
  ContentDigest digest;
  digest.add(bytes);
  return digest.text();
}

/// Poses of the same scans.
struct PosePairs {
  std::vector<Pose> odometry;
  std::vector<Pose> truth;
};

/// Whether they are the same up to one common motion.
bool are_same(const PosePairs& pairs) {
  constexpr std::size_t least = 3;
  constexpr double same_m = 1e-3;
  constexpr double same_rad = 0.05 * std::numbers::pi / 180;
  constexpr double least_way_m = 0.1;  // who stands still has the same poses in every file
  if (pairs.odometry.size() < least) return false;
  double way_m = 0;
  for (std::size_t i = 1; i < pairs.odometry.size(); ++i) {
    const Pose a = pairs.odometry[0].inverse() * pairs.odometry[i];
    const Pose b = pairs.truth[0].inverse() * pairs.truth[i];
    way_m = std::max(way_m, a.translation_m.norm());
    if ((a.translation_m - b.translation_m).norm() > same_m ||
        angle_between_rad(a.rotation, b.rotation) > same_rad)
      return false;
  }
  return way_m >= least_way_m;
}

PosePairs pairs_of(const Json& sample, const Trajectory& truth, const Association& association) {
  std::map<std::size_t, std::size_t> truth_of_row;
  for (const Association::Pair& pair : association.pairs) truth_of_row.emplace(pair.estimate, pair.truth);
  PosePairs pairs;
  for (const Json& each : sample) {
    const auto found = truth_of_row.find(each.at("row").get<std::size_t>());
    if (found == truth_of_row.end()) continue;
    const auto n = each.at("pose").get<std::vector<double>>();
    if (n.size() != 7) continue;
    Pose pose;
    pose.translation_m = {n[0], n[1], n[2]};
    pose.rotation = Eigen::Quaterniond(n[6], n[3], n[4], n[5]).normalized();
    pairs.odometry.push_back(pose);
    pairs.truth.push_back(truth.poses.at(found->second));
  }
  return pairs;
}

std::optional<std::string> compare(const OdometryOrigin& odometry, const fs::path& truth,
                                   const PosePairs& pairs) {
  std::error_code ignored;
  const char* what = nullptr;
  if (fs::equivalent(odometry.path, truth, ignored)) {
    what = "is the file";
  } else if (fs::is_regular_file(truth, ignored) && !bags::is_bag(truth) &&
             digest_of(truth) == odometry.digest) {
    what = "has the content of the file";
  } else if (are_same(pairs)) {
    what = "has the poses of the file";
  }
  if (what == nullptr) return std::nullopt;
  return fmt::format(
      "the truth {} {} that was taken as odometry ({}): the figures say how far mapping left its "
      "start, not how near it came to the truth; map with --odometry none",
      truth.string(), what, odometry.path.string());
}

}  // namespace

std::optional<std::string> why_circular(const fs::path& map_or_trajectory, const fs::path& truth_path,
                                        const Trajectory& truth, const Association& association) {
  std::error_code ignored;
  if (fs::equivalent(map_or_trajectory, truth_path, ignored))
    return fmt::format("{} is compared with itself", truth_path.string());
  const Json odometry = odometry_of_map(map_or_trajectory);
  if (!odometry.is_object()) return std::nullopt;
  try {
    return compare({odometry.at("path").get<std::string>(), odometry.at("digest").get<std::string>(), {}},
                   truth_path, pairs_of(odometry.at("sample"), truth, association));
  } catch (const Json::exception&) {
    return std::nullopt;  // of a run.json that others changed
  }
}

std::optional<std::string> why_circular(const ScanSource& scans, const fs::path& truth_path,
                                        std::span<const std::optional<Pose>> truth_from_body) {
  const std::optional<OdometryOrigin> origin = scans.odometry_origin();
  if (!origin) return std::nullopt;
  PosePairs pairs;
  for (std::size_t i = 0; i < truth_from_body.size(); ++i) {
    const std::optional<Pose> odometry = scans.odometry(i);
    if (!odometry || !truth_from_body[i]) continue;
    pairs.odometry.push_back(*odometry);
    pairs.truth.push_back(*truth_from_body[i]);
  }
  return compare(*origin, truth_path, pairs);
}

}  // namespace alces::offline
