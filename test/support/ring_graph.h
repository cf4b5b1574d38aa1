// A pose graph with known truth: a drive round and round a ring, odometry with noise, and loops to where the
// vehicle was some laps ago. Vertices start where the odometry says; the first one is true.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "alces_platform/sim/random.h"
#include "offline/optimize/graph/constraint_graph.h"

namespace alces::test {

struct RingSettings {
  std::uint32_t poses = 200;
  std::uint32_t poses_a_lap = 50;
  std::uint32_t loops = 20;  ///< at random places; the last pose closes one in any case
  bool is_planar = false;
  double translation_sigma_m = 0.02;
  double rotation_sigma_rad = 0.01;
  std::uint64_t seed = 1;
};

struct RingGraph {
  offline::ConstraintGraph graph;
  std::vector<Pose> truth;
};

inline RingGraph ring_graph(const RingSettings& settings) {
  sim::Random random(settings.seed);
  RingGraph ring;
  ring.graph.is_planar = settings.is_planar;
  const auto truth = [&](std::uint32_t i) {
    const double angle_rad = 2 * std::numbers::pi * i / settings.poses_a_lap;
    const double radius_m = settings.poses_a_lap / (2 * std::numbers::pi);  // a metre a pose
    Pose pose;
    pose.rotation = Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ());
    pose.translation_m = {radius_m * std::sin(angle_rad), radius_m * (1 - std::cos(angle_rad)), 0};
    if (settings.is_planar) return pose;
    pose.translation_m.z() = std::sin(3 * angle_rad);  // up and down hill
    pose.rotation = pose.rotation * Eigen::AngleAxisd(0.2 * std::sin(angle_rad), Eigen::Vector3d::UnitX());
    return pose;
  };
  const auto measure = [&](std::uint32_t from, std::uint32_t to) {
    offline::Constraint constraint;
    constraint.from = from;
    constraint.to = to;
    Vector6d noise = Vector6d::Zero();
    for (int i : {0, 1, 5}) noise[i] = random.normal();
    if (!settings.is_planar)
      for (int i : {2, 3, 4}) noise[i] = random.normal();
    noise.head<3>() *= settings.translation_sigma_m;
    noise.tail<3>() *= settings.rotation_sigma_rad;
    constraint.from_from_to = ring.truth[from].inverse() * ring.truth[to];
    constraint.from_from_to.translation_m += noise.head<3>();
    constraint.from_from_to.rotation =
        (constraint.from_from_to.rotation * exp_so3(noise.tail<3>())).normalized();
    const double along = 1 / (settings.translation_sigma_m * settings.translation_sigma_m);
    const double around = 1 / (settings.rotation_sigma_rad * settings.rotation_sigma_rad);
    constraint.information.diagonal() << along, along, along, 4 * around, 4 * around, 4 * around;
    constraint.planar_information.diagonal() << along, along, around;
    ring.graph.constraints.push_back(constraint);
  };

  const std::uint32_t first_of_second_lap = settings.poses_a_lap;
  for (std::uint32_t i = 0; i < settings.poses; ++i) ring.truth.push_back(truth(i));
  std::vector<std::uint32_t> closers;
  for (std::uint32_t i = 1; i < settings.loops; ++i)
    closers.push_back(static_cast<std::uint32_t>(
        random.integer(static_cast<int>(first_of_second_lap), static_cast<int>(settings.poses) - 1)));
  closers.push_back(settings.poses - 1);
  std::sort(closers.begin(), closers.end());
  std::size_t next = 0;
  for (std::uint32_t i = 0; i < settings.poses; ++i) {
    offline::ConstraintVertex vertex;
    vertex.id = i;
    vertex.map_from_body = ring.truth[0];
    if (i > 0) {
      measure(i - 1, i);
      vertex.map_from_body =
          ring.graph.vertices[i - 1].map_from_body * ring.graph.constraints.back().from_from_to;
    }
    ring.graph.vertices.push_back(vertex);
    for (; next < closers.size() && closers[next] == i; ++next) {
      const int laps_so_far = static_cast<int>(i / settings.poses_a_lap);
      measure(i - static_cast<std::uint32_t>(random.integer(1, laps_so_far)) * settings.poses_a_lap, i);
    }
  }
  return ring;
}

inline double mean_error_m(const offline::ConstraintGraph& graph, const std::vector<Pose>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    sum += (graph.vertices[i].map_from_body.translation_m - truth[i].translation_m).norm();
  return sum / static_cast<double>(truth.size());
}

}  // namespace alces::test
