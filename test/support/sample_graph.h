// Pose graphs of any size with known truth: a vehicle drives at random through a grid of streets, 1 m a pose,
// and where it comes to a crossing again it may close a loop to its first visit.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "alces_platform/sim/random.h"
#include "offline/optimize/graph/constraint_graph.h"
#include "offline/optimize/graph/planar_pose.h"

namespace alces::test {

struct SampleGraph {
  std::uint32_t poses = 200;
  std::uint32_t loops = 10;  ///< at most: as many as there are second visits
  std::uint64_t seed = 1;
  bool is_planar = false;
  double translation_sigma_m = 0.02;
  double rotation_sigma_rad = 0.002;
  int streets = 8;       ///< in each direction
  int block_poses = 10;  ///< between two crossings
};

/// Vertices lie where odometry puts them.
inline offline::ConstraintGraph sample_graph(const SampleGraph& wish, std::vector<Pose>* truth = nullptr) {
  sim::Random random(wish.seed);
  const auto noise = [&](Pose& pose) {
    Vector6d twist;
    for (int i = 0; i < 6; ++i)
      twist[i] = random.normal() * (i < 3 ? wish.translation_sigma_m : wish.rotation_sigma_rad);
    if (wish.is_planar) twist[2] = twist[3] = twist[4] = 0;
    pose = pose * exp_se3(twist);
  };

  // the way, and the second visits
  std::vector<Pose> map_from_body;
  std::vector<std::uint32_t> first_visit(static_cast<std::size_t>(wish.streets) * std::size_t(wish.streets),
                                         UINT32_MAX);
  struct Visit {
    std::uint32_t earlier;
    std::uint32_t later;
  };
  std::vector<Visit> visits;
  int x = wish.streets / 2;
  int y = wish.streets / 2;
  int heading = 0;  // quarter turns
  constexpr int step_x[] = {1, 0, -1, 0};
  constexpr int step_y[] = {0, 1, 0, -1};
  while (map_from_body.size() < wish.poses) {
    int turn = random.integer(-1, 1);  // never back
    const auto leads_out = [&](int h) {
      const int to_x = x + step_x[h & 3];
      const int to_y = y + step_y[h & 3];
      return to_x < 0 || to_y < 0 || to_x >= wish.streets || to_y >= wish.streets;
    };
    for (int tries = 0; tries < 3 && leads_out(heading + turn); ++tries) turn = turn == 1 ? -1 : turn + 1;
    heading = (heading + turn) & 3;
    const auto crossing =
        static_cast<std::size_t>(y) * std::size_t(wish.streets) + static_cast<std::size_t>(x);
    const auto here = static_cast<std::uint32_t>(map_from_body.size());
    if (first_visit[crossing] == UINT32_MAX) {
      first_visit[crossing] = here;
    } else {
      visits.push_back({first_visit[crossing], here});
    }
    for (int k = 0; k < wish.block_poses && map_from_body.size() < wish.poses; ++k) {
      const double along_m = k;
      const double x_m = x * wish.block_poses + step_x[heading] * along_m;
      const double y_m = y * wish.block_poses + step_y[heading] * along_m;
      Pose pose = offline::planar_pose(x_m, y_m, heading * std::numbers::pi / 2);
      if (!wish.is_planar) pose.translation_m.z() = 3 * std::sin(x_m / 40) + 2 * std::cos(y_m / 30);
      map_from_body.push_back(pose);
    }
    x += step_x[heading];
    y += step_y[heading];
  }

  offline::ConstraintGraph graph;
  graph.is_planar = wish.is_planar;
  const double per_m2 = 1 / (wish.translation_sigma_m * wish.translation_sigma_m);
  const double per_rad2 = 1 / (wish.rotation_sigma_rad * wish.rotation_sigma_rad);
  const auto measure = [&](std::uint32_t from, std::uint32_t to) {
    offline::Constraint c;
    c.from = from;
    c.to = to;
    c.from_from_to = map_from_body[from].inverse() * map_from_body[to];
    noise(c.from_from_to);
    c.information.diagonal() << per_m2, per_m2, per_m2, 4 * per_rad2, 4 * per_rad2, 4 * per_rad2;
    c.planar_information = Eigen::Vector3d(per_m2, per_m2, per_rad2).asDiagonal();
    graph.constraints.push_back(c);
  };
  std::size_t next_visit = 0;
  std::uint64_t taken = 0;
  for (std::uint32_t i = 0; i < wish.poses; ++i) {
    graph.vertices.push_back({.id = i, .map_from_body = map_from_body[i]});
    if (i > 0) {
      measure(i - 1, i);
      graph.vertices[i].map_from_body =
          graph.vertices[i - 1].map_from_body * graph.constraints.back().from_from_to;
    }
    for (; next_visit < visits.size() && visits[next_visit].later == i; ++next_visit) {
      // evenly spread over the visits
      if ((next_visit + 1) * std::uint64_t{wish.loops} / visits.size() == taken) continue;
      ++taken;
      measure(visits[next_visit].earlier, i);
    }
  }
  if (truth != nullptr) *truth = map_from_body;
  return graph;
}

}  // namespace alces::test
