#include "places/scene_parts.h"

#include <algorithm>
#include <cmath>

#include "alces_platform/sim/world/wander.h"

namespace alces::places {

using Eigen::Vector2d;
using Eigen::Vector3d;

void box(sim::Scene& scene, const Vector3d& low, const Vector3d& high, double reflectivity) {
  scene.add_box({}, low.cast<float>(), high.cast<float>(), static_cast<float>(reflectivity));
}

void slab(sim::Scene& scene, const Vector2d& low, const Vector2d& high, double top_m, double thickness_m) {
  box(scene, {low.x(), low.y(), top_m - thickness_m}, {high.x(), high.y(), top_m}, 0.4);
}

void walls(sim::Scene& scene, const Vector3d& low, const Vector3d& high) {
  constexpr double thickness_m = 0.3;
  const double w = low.x() - thickness_m;
  const double e = high.x() + thickness_m;
  box(scene, {w, low.y() - thickness_m, low.z()}, {e, low.y(), high.z()});
  box(scene, {w, high.y(), low.z()}, {e, high.y() + thickness_m, high.z()});
  box(scene, {w, low.y(), low.z()}, {low.x(), high.y(), high.z()});
  box(scene, {high.x(), low.y(), low.z()}, {e, high.y(), high.z()});
}

void car(sim::Scene& scene, const Vector2d& centre, sim::Random& random) {
  const double length = random.uniform(3.6, 4.8);
  const double height = random.uniform(1.4, 1.7);
  const Vector3d half(length / 2, 0.85, 0);
  const Vector3d at(centre.x(), centre.y(), 0.25);
  box(scene, at - half, at + half + Vector3d(0, 0, 0.6), 0.3);
  const Vector3d cabin(length / 4, 0.75, 0);
  box(scene, at - cabin + Vector3d(0, 0, 0.6), at + cabin + Vector3d(0, 0, height - 0.25), 0.2);
}

void ground(sim::Scene& scene, const Vector2d& low, const Vector2d& high, std::uint64_t seed,
            double relief_m) {
  const sim::Wander along(sim::mix(seed, 70), 25);
  const sim::Wander across(sim::mix(seed, 71), 18);
  scene.ground =
      sim::Ground(low, high, [&](double x, double y) { return relief_m * (along(x) + across(y)); });
}

Lanes draw_lanes(sim::Random& random, double end_m, double second_m, double around_m, double most_aside_m) {
  Lanes lanes;
  lanes.end_m = end_m;
  lanes.second_m = second_m;
  lanes.around_m = around_m;
  lanes.offset_m = random.uniform(-1, 1) * most_aside_m;
  lanes.opposite = random.chance(0.4);
  return lanes;
}

const char* again(bool opposite) {
  return opposite ? ", again the other way" : ", again the same way";
}

std::vector<Vector3d> way_along(const Lanes& lanes) {
  const double west = lanes.begin_m - lanes.around_m;
  const double east = lanes.end_m + lanes.around_m;
  const double again_m = lanes.again * (lanes.end_m - lanes.begin_m);
  std::vector<Vector3d> way{
      {lanes.begin_m, lanes.first_m, 0}, {east, lanes.first_m, 0}, {east, lanes.second_m, 0}};
  if (lanes.opposite) {
    way.emplace_back(lanes.begin_m, lanes.second_m, 0);
    way.emplace_back(lanes.begin_m, lanes.second_m + lanes.offset_m, 0);
    way.emplace_back(lanes.begin_m + again_m, lanes.second_m + lanes.offset_m, 0);
  } else {
    way.emplace_back(west, lanes.second_m, 0);
    way.emplace_back(west, lanes.first_m + lanes.offset_m, 0);
    way.emplace_back(lanes.begin_m + again_m, lanes.first_m + lanes.offset_m, 0);
  }
  return way;
}

}  // namespace alces::places
