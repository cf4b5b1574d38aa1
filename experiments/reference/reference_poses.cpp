#include "reference_poses.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "alces/arena.h"
#include "offline/io/files/output_file.h"
#include "offline/optimize/lum/prepared_scan.h"
#include "surface_agreement.h"

namespace alces::offline {
namespace {

constexpr std::uint32_t correspondence_capacity = 4096;
constexpr double still_moving_m = 0.01;
constexpr double enough_curvature_ratio = 0.01;  // a street with few walls across it has 0.05

ReferenceVerdict judge(const IcpResult& match, double last_moved_m, const ReferenceSettings& settings) {
  if (match.verdict == IcpVerdict::too_few_correspondences) return ReferenceVerdict::too_few;
  if (match.overlap < settings.minimum_overlap) return ReferenceVerdict::low_overlap;
  if (match.rms_m > settings.maximum_rms_m) return ReferenceVerdict::large_rms;
  if (match.verdict == IcpVerdict::degenerate) return ReferenceVerdict::undetermined;
  if (match.verdict == IcpVerdict::iteration_limit && last_moved_m > still_moving_m)
    return ReferenceVerdict::not_converged;
  return ReferenceVerdict::trusted;
}

class Matcher {
 public:
  explicit Matcher(const ReferenceSettings& settings)
      : settings_(settings),
        preparation_(lum_settings(settings)),
        block_(icp_bytes()),
        arena_(block_.bytes()),
        icp_(arena_, correspondence_capacity),
        trace_(settings.match.maximum_iterations) {}

  ReferencePose match(std::span<const Point> points, const Pose& start, const ReferenceMap& map) {
    ReferencePose pose;
    pose.map_from_body = start;
    const PreparedScan scan = preparation_.prepare(points);
    if (scan.size() == 0) {
      pose.verdict = ReferenceVerdict::empty_scan;
      return pose;
    }
    const IcpScan model{&map.tree(), {}, {}};
    const IcpScan data{&scan.tree(), scan.samples(), {}};
    const IcpResult match = icp_.match({&model, 1}, {&data, 1}, start, settings_.match, nullptr, trace_);
    const double last_moved_m = match.iterations > 0 ? trace_[match.iterations - 1].moved_m : 0;
    pose.verdict = judge(match, last_moved_m, settings_);
    pose.map_from_body = match.model_from_data;
    if (pose.verdict == ReferenceVerdict::trusted &&
        surface_agreement(scan, match.model_from_data, map.tree(),
                          static_cast<double>(settings_.match.last_distance_limit_m))
                .least_curvature_ratio < enough_curvature_ratio)
      pose.verdict = ReferenceVerdict::undetermined;
    pose.overlap = match.overlap;
    pose.rms_m = match.rms_m;
    pose.correspondences = match.correspondences;
    pose.moved_m = (match.model_from_data.translation_m - start.translation_m).norm();
    pose.turned_rad = angle_between_rad(match.model_from_data.rotation, start.rotation);
    return pose;
  }

 private:
  static LumSettings lum_settings(const ReferenceSettings& settings) {
    LumSettings lum;
    lum.voxel = settings.voxel;
    lum.samples = settings.samples;
    return lum;
  }
  static std::size_t icp_bytes() {
    Arena counting;
    const Icp planned(counting, correspondence_capacity);
    return counting.used_bytes();
  }

  ReferenceSettings settings_;
  ScanPreparation preparation_;
  settings::MemoryBlock block_;
  Arena arena_;
  Icp icp_;
  std::vector<IcpIteration> trace_;
};

std::filesystem::path quality_file(std::filesystem::path tum) {
  return tum.replace_extension(".quality.csv");
}

}  // namespace

const char* to_string(ReferenceVerdict verdict) {
  constexpr std::array<const char*, 8> texts = {"trusted",
                                                "the start trajectory has no pose for it",
                                                "it has no usable point",
                                                "hardly anything of it is in the map",
                                                "too little of it is in the map",
                                                "it does not lie closely on the map",
                                                "the map leaves a direction open",
                                                "the match did not come to rest"};
  return texts.at(static_cast<std::size_t>(verdict));
}

ReferenceRun find_reference_poses(ScanSource& scans, std::span<const std::optional<Pose>> start,
                                  const ReferenceMap& map, const ReferenceSettings& settings,
                                  const std::function<void(std::size_t, std::size_t)>& progress,
                                  const std::function<bool()>& stop_requested) {
  Matcher matcher(settings);
  ReferenceRun run;
  std::optional<Pose> last_trusted;
  Pose last_start;  // of that scan
  ScanPoints scan;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (stop_requested && stop_requested()) {
      run.was_stopped = true;
      break;
    }
    if (!scans.read(i, scan)) break;
    ReferencePose pose;
    if (start[i]) {
      pose = matcher.match(scan.points,
                           last_trusted ? *last_trusted * last_start.inverse() * *start[i] : *start[i], map);
      if (pose.verdict == ReferenceVerdict::trusted) {
        last_trusted = pose.map_from_body;
        last_start = *start[i];
      }
    }
    run.poses.push_back(pose);
    if (progress) progress(i + 1, scans.size());
  }
  return run;
}

void write_reference_poses(const std::filesystem::path& tum, const ScanSource& scans, const ReferenceRun& run,
                           bool writes_all) {
  OutputFile poses(tum);
  OutputFile quality(quality_file(tum));
  poses.write("# stamp x_m y_m z_m qx qy qz qw, in the frame of the reference map\n");
  quality.write("scan,stamp,trusted,reason,overlap,rms_m,correspondences,moved_m,turned_deg\n");
  bool has_time = true;
  for (std::size_t i = 0; i < scans.size(); ++i) has_time &= scans.stamp_s(i).has_value();
  for (std::size_t i = 0; i < run.poses.size(); ++i) {
    const ReferencePose& pose = run.poses[i];
    const bool is_trusted = pose.verdict == ReferenceVerdict::trusted;
    const std::string stamp =
        has_time ? fmt::format("{:.9f}", *scans.stamp_s(i)) : fmt::format("{}", scans.number(i));
    const Eigen::Vector3d& t = pose.map_from_body.translation_m;
    const Eigen::Quaterniond& q = pose.map_from_body.rotation;
    if (is_trusted || writes_all)
      poses.write(fmt::format("{} {:.7f} {:.7f} {:.7f} {:.12f} {:.12f} {:.12f} {:.12f}\n", stamp, t.x(),
                              t.y(), t.z(), q.x(), q.y(), q.z(), q.w()));
    if (!is_trusted)
      poses.write(fmt::format("# {} is not trustworthy: {} (overlap {:.0f} %, rms {:.3f} m)\n", scans.name(i),
                              to_string(pose.verdict), 100 * pose.overlap, pose.rms_m));
    quality.write(fmt::format("{},{},{},{},{:.4f},{:.4f},{},{:.4f},{:.4f}\n", scans.number(i), stamp,
                              is_trusted ? 1 : 0, to_string(pose.verdict), pose.overlap, pose.rms_m,
                              pose.correspondences, pose.moved_m, pose.turned_rad * 180 / std::numbers::pi));
  }
  quality.commit();
  poses.commit();
}

}  // namespace alces::offline
