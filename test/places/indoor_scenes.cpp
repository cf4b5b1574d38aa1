// Corridors, aisles, halls, car parks.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "places/scene_parts.h"

namespace alces::places {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// A hall with floor and ceiling.
void hall(sim::Scene& scene, const Vector3d& low, const Vector3d& high) {
  walls(scene, low, high);
  slab(scene, low.head<2>(), high.head<2>(), low.z());
  slab(scene, low.head<2>(), high.head<2>(), high.z() + 0.2);
}

}  // namespace

Place make_corridors(std::uint64_t seed) {
  sim::Random random(sim::mix(seed, 2));
  Place place;
  place.step_m = 1.0;
  place.corner_radius_m = 0.7;
  place.reach_m = 40;
  const double width_m = random.uniform(2, 3);
  const double pitch_m = random.uniform(3, 5);
  const double length_m = pitch_m * std::floor(30 / pitch_m);
  constexpr double wall_m = 0.2;
  const double apart_m = width_m + wall_m;
  const double end_m = 2.6;  // of the crossing corridors at both ends
  hall(place.scene, {-end_m, -width_m / 2, 0}, {length_m + end_m, apart_m + width_m / 2, 2.6});
  box(place.scene, {0, width_m / 2, 0}, {length_m, width_m / 2 + wall_m, 2.6});
  const bool alike = random.chance(0.6);
  // Door frames, at the same places in both corridors, on all four walls; or pillars and cupboards here and
  // there.
  const double frame_m = random.uniform(0.08, 0.15);
  for (double x = pitch_m / 2; x < length_m; x += pitch_m) {
    for (const double lane_m : {0.0, apart_m}) {
      for (const double side : {-1.0, 1.0}) {
        if (!alike && random.chance(0.3)) continue;
        const double wall = lane_m + side * width_m / 2;
        for (const double post_m : {x - 0.5, x + 0.5}) {
          box(place.scene, {post_m - 0.06, std::min(wall, wall - side * frame_m), 0},
              {post_m + 0.06, std::max(wall, wall - side * frame_m), 2.1});
        }
        if (!alike && random.chance(0.3)) {
          box(place.scene, {x + 0.7, std::min(wall, wall - side * 0.35), 0},
              {x + 1.5, std::max(wall, wall - side * 0.35), random.uniform(0.8, 2)});
        }
      }
    }
  }
  const Lanes lanes = draw_lanes(random, length_m, apart_m, end_m / 2, width_m / 2 - 0.8);
  place.corners_m = way_along(lanes);
  place.what = fmt::format("{:.1f} m wide, doors {}{}", width_m, alike ? "alike" : "here and there",
                           again(lanes.opposite));
  return place;
}

Place make_aisles(std::uint64_t seed) {
  sim::Random random(sim::mix(seed, 6));
  Place place;
  place.step_m = 1.0;
  place.corner_radius_m = 1;
  const double width_m = random.uniform(2.4, 3.4);
  const double depth_m = random.chance(0.5) ? 1.0 : 2.1;  // one shelf, or two back to back
  const double apart_m = width_m + depth_m;
  constexpr double bay_m = 2.7;
  constexpr double length_m = 9 * bay_m;
  constexpr double level_m = 1.5;
  hall(place.scene, {-5, -apart_m - width_m, 0}, {length_m + 5, 2 * apart_m + width_m, 7});
  const double filled = random.chance(0.5) ? 1.0 : 0.7;
  for (const double lane_m : {-apart_m, 0.0, apart_m}) {
    const double low_m = lane_m + width_m / 2;
    const double high_m = low_m + depth_m;
    for (int bay = 0; bay <= 9; ++bay) {
      for (const double y : {low_m, high_m - 0.1})
        box(place.scene, {bay * bay_m - 0.05, y, 0}, {bay * bay_m + 0.05, y + 0.1, 4.6});
    }
    for (int level = 0; level < 3; ++level) {
      const double z = level * level_m + 0.12;
      if (level > 0) {
        for (const double y : {low_m, high_m - 0.06})
          box(place.scene, {0, y, z - 0.12}, {length_m, y + 0.06, z});
      }
      for (int bay = 0; bay < 9; ++bay) {
        for (int pallet = 0; pallet < 2; ++pallet) {
          if (!random.chance(filled)) continue;
          const double x = bay * bay_m + 0.12 + pallet * 1.27;
          const double back_m = filled < 1 ? random.uniform(0, 0.25) : 0.05;
          const double height_m = filled < 1 ? random.uniform(0.6, 1.2) : 1.1;
          box(place.scene, {x, low_m + back_m, z}, {x + 1.2, high_m - back_m, z + height_m});
        }
      }
    }
  }
  const Lanes lanes = draw_lanes(random, length_m, apart_m, 2, width_m / 2 - 0.9);
  place.corners_m = way_along(lanes);
  place.what = fmt::format("shelves {:.1f} m deep, {}{}", depth_m,
                           filled < 1 ? "filled here and there" : "all full", again(lanes.opposite));
  return place;
}

Place make_pillars(std::uint64_t seed) {
  sim::Random random(sim::mix(seed, 7));
  Place place;
  place.step_m = 1.1;
  place.corner_radius_m = 1.5;
  place.reach_m = random.chance(0.5) ? 15 : 40;  // whether the hall's walls are seen
  const double pitch_m = random.uniform(4.5, 7);
  const double size_m = random.uniform(0.3, 0.7);
  constexpr int columns = 14;
  constexpr int rows = 9;
  const double height_m = random.uniform(2.8, 4);
  hall(place.scene, {-4 * pitch_m, -4 * pitch_m, 0},
       {(columns - 4.0) * pitch_m, (rows - 4.0) * pitch_m, height_m});
  for (int column = 0; column < columns; ++column) {
    for (int row = 0; row < rows; ++row) {
      const Vector2d at((column - 3.5) * pitch_m, (row - 3.5) * pitch_m);
      box(place.scene, {at.x() - size_m / 2, at.y() - size_m / 2, 0},
          {at.x() + size_m / 2, at.y() + size_m / 2, height_m});
    }
  }
  const Lanes lanes = draw_lanes(random, pitch_m * std::floor(26 / pitch_m), pitch_m, 1.5,
                                 std::min(2.0, (pitch_m - size_m) / 2 - 0.6));
  place.corners_m = way_along(lanes);
  place.what = fmt::format("pillars every {:.1f} m, the laser reaches {:.0f} m{}", pitch_m, place.reach_m,
                           again(lanes.opposite));
  return place;
}

Place make_floors(std::uint64_t seed) {
  sim::Random random(sim::mix(seed, 8));
  Place place;
  place.step_m = 1.6;
  place.corner_radius_m = 2.2;
  place.reach_m = 40;
  const double height_m = random.uniform(2.7, 3.2);
  constexpr double length_m = 36;
  constexpr double depth_m = 18;
  constexpr double ramp_begin_m = 7;
  constexpr double ramp_end_m = 29;
  constexpr double ramp_m = 4;  // wide; it lies along the far wall
  const bool with_cars = random.chance(0.4);
  walls(place.scene, {0, 0, -0.2}, {length_m, depth_m, 3 * height_m});
  constexpr double pitch_m = 6;
  for (int floor = 0; floor < 4; ++floor) {
    const double z = floor * height_m;
    if (floor == 0) {
      slab(place.scene, {0, 0}, {length_m, depth_m}, z);
    } else {  // all but the hole above the ramp
      slab(place.scene, {0, 0}, {length_m, depth_m - ramp_m}, z);
      slab(place.scene, {0, depth_m - ramp_m}, {ramp_begin_m, depth_m}, z);
      slab(place.scene, {ramp_end_m, depth_m - ramp_m}, {length_m, depth_m}, z);
    }
    if (floor == 3) break;
    for (double x = pitch_m / 2; x < length_m; x += pitch_m) {
      for (const double y : {4.6, 9.0, depth_m - ramp_m - 0.5})
        box(place.scene, {x - 0.2, y - 0.2, z}, {x + 0.2, y + 0.2, z + height_m - 0.2});
    }
    if (floor < 2) {
      const sim::Frame frame;
      place.scene.add_tapered_box(
          frame,
          {static_cast<float>(ramp_begin_m), static_cast<float>(depth_m - ramp_m), static_cast<float>(z)},
          {static_cast<float>(ramp_end_m), static_cast<float>(depth_m), static_cast<float>(z + height_m)},
          {0, static_cast<float>(ramp_end_m - ramp_begin_m), 0}, 0.4F, sim::Surface::wall);
    }
    if (with_cars) {
      for (double x = 6; x < length_m - 5; x += 6) {
        if (!random.chance(0.3)) continue;
        sim::Random same(sim::mix(seed, static_cast<std::uint64_t>(x)));
        const double length = same.uniform(3.8, 4.6);
        box(place.scene, {x - length / 2, 6, z + 0.2}, {x + length / 2, 7.7, z + 1.4}, 0.3);
      }
    }
  }
  // A lap, then up the ramp, a lap above.
  constexpr double near_m = 2.3;
  constexpr double far_m = depth_m - ramp_m - 2.6;
  const double ramp_y = depth_m - ramp_m / 2;
  const double west_m = 2.6;
  const double east_m = length_m - 2.6;
  const double offset_m = random.uniform(-0.8, 0.8);
  const double z = height_m;
  const bool laps_twice = random.chance(0.6);
  place.corners_m = {{10, near_m, 0}, {east_m, near_m, 0}, {east_m, far_m, 0}, {west_m, far_m, 0}};
  if (laps_twice) {
    place.corners_m.emplace_back(west_m, near_m + offset_m, 0);
    place.corners_m.emplace_back(east_m - 6, near_m + offset_m, 0);
    place.corners_m.emplace_back(east_m - 6, far_m + offset_m, 0);
    place.corners_m.emplace_back(west_m, far_m + offset_m, 0);
  }
  place.corners_m.emplace_back(west_m, ramp_y, 0);
  place.corners_m.emplace_back(ramp_begin_m, ramp_y, 0);
  place.corners_m.emplace_back(ramp_end_m, ramp_y, z);
  place.corners_m.emplace_back(east_m, ramp_y, z);
  place.corners_m.emplace_back(east_m, near_m, z);
  place.corners_m.emplace_back(west_m + 6, near_m, z);
  place.what = fmt::format("{:.1f} m from floor to floor{}", height_m, with_cars ? ", some cars" : "");
  return place;
}

}  // namespace alces::places
