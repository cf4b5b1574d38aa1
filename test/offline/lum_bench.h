// What the tests of the relaxation share: rooms, disturbed poses, links that say what a test wants.
#pragma once

#include <random>
#include <vector>

#include "offline/optimize/lum/optimize_with_lum.h"
#include "room.h"

namespace alces::offline {

inline std::vector<Pose> room_poses(std::size_t count) {
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < count; ++i) poses.push_back(room_from_body(i));
  return poses;
}

/// All but the first, by normal noise.
inline std::vector<Pose> disturbed(std::vector<Pose> poses, double deviation_m, double deviation_rad,
                                   std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    Vector6d noise;
    for (Eigen::Index n = 0; n < 6; ++n) noise[n] = (n < 3 ? deviation_m : deviation_rad) * normal(random);
    poses[i] = poses[i] * exp_se3(noise);
  }
  return poses;
}

inline Trajectory numbered(std::vector<Pose> poses) {
  Trajectory trajectory;
  for (std::size_t i = 0; i < poses.size(); ++i) trajectory.stamps_s.push_back(static_cast<double>(i));
  trajectory.poses = std::move(poses);
  return trajectory;
}

/// Small scans, quick to prepare; a room wants its walls sampled well.
inline LumSettings small_settings() {
  LumSettings settings;
  settings.voxel.cell_capacity = 4096;
  settings.samples = 400;
  settings.link_distance_m = 1.1;
  settings.first_distance_limit_m = 1;
  settings.mean_change_m = 1e-4;
  settings.link_change_m = 1e-5;
  settings.maximum_iterations = 30;
  return settings;
}

inline LumResult relax_room(std::size_t scans, const LumSettings& settings, std::uint32_t seed = 7) {
  RoomSource room(scans);
  LumRequest request;
  request.settings = settings;
  request.scratch_folder = std::filesystem::temp_directory_path();
  return optimize_with_lum(numbered(disturbed(room_poses(scans), 0.08, 0.015, seed)), room, request);
}

inline double worst_distance_m(const std::vector<Pose>& a, const std::vector<Pose>& b) {
  double worst_m = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    worst_m = std::max(worst_m, (a[i].translation_m - b[i].translation_m).norm());
  return worst_m;
}

inline bool same_bits(const std::vector<Pose>& a, const std::vector<Pose>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (a[i].translation_m != b[i].translation_m || a[i].rotation.coeffs() != b[i].rotation.coeffs())
      return false;
  return true;
}

/// Links that ask for the relative poses of `wanted`, as a thousand correspondences each would; without
/// scans.
class WantedLinks : public LinkSumSource {
 public:
  explicit WantedLinks(std::vector<Pose> wanted) : wanted_(std::move(wanted)) {}

  void sum(std::span<const ScanLink> links, std::span<const Pose> map_from_scan, const LinkPass& pass,
           std::span<LinkSums> sums, const Progress&) override {
    for (std::size_t i = 0; i < links.size(); ++i) sums[i] = sum(links[i], map_from_scan, pass.stride);
  }

  /// What a link asks for: the change of j's pose, about its place, that leaves it where k wants it.
  [[nodiscard]] virtual Pose k_from_j(const ScanLink& link) const {
    return wanted_[link.k].inverse() * wanted_[link.j];
  }
  [[nodiscard]] virtual bool sees(const ScanLink&) const { return true; }

  [[nodiscard]] static Matrix6d weights() {
    Vector6d diagonal;
    diagonal << 500, 400, 1000, 9000, 8000, 5000;
    Matrix6d matrix = diagonal.asDiagonal();
    matrix(0, 4) = matrix(4, 0) = 300;
    return matrix;
  }

  /// E at the middle.
  [[nodiscard]] Vector6d offset(const ScanLink& link, std::span<const Pose> map_from_scan) const {
    const Pose& j = map_from_scan[link.j];
    const Pose target = map_from_scan[link.k] * k_from_j(link);
    Vector6d change;
    change << target.translation_m - j.translation_m, log_so3(target.rotation * j.rotation.conjugate());
    return middle_from_change(j, middle_of(j, map_from_scan[link.k])) * change;
  }

 private:
  LinkSums sum(const ScanLink& link, std::span<const Pose> map_from_scan, std::uint32_t stride) const {
    LinkSums sums;
    if (!sees(link)) return sums;
    const double share = 1.0 / stride;
    const Matrix6d mtm = share * weights();
    const Vector6d e = offset(link, map_from_scan);
    const Vector6d mtz = mtm * e;
    std::size_t at = 0;
    for (Eigen::Index r = 0; r < 6; ++r)
      for (Eigen::Index c = r; c < 6; ++c) sums.mtm[at++] = mtm(r, c);
    for (Eigen::Index r = 0; r < 6; ++r) sums.mtz[r] = mtz[r];
    sums.weight = 1000 * share;
    sums.ztz_m2 = e.dot(mtz) + sums.weight * 0.02 * 0.02;
    sums.correspondences = 1000 / stride;
    sums.queries = 1200 / stride;
    return sums;
  }

  std::vector<Pose> wanted_;
};

}  // namespace alces::offline
