// Streets, roundabouts, fields, yards.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "places/scene_parts.h"

namespace alces::places {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// What is in front of a house: where a porch and a bay window stand, as shares of the front.
struct HouseFront {
  double porch = 0.2;
  double bay = 0.6;
  double bay_depth_m = 0.6;
  double height_m = 6;
};

HouseFront draw_front(sim::Random& random) {
  HouseFront front;
  front.porch = random.uniform(0.05, 0.3);
  front.bay = random.uniform(0.45, 0.65);
  front.bay_depth_m = random.uniform(0.3, 0.9);
  front.height_m = random.uniform(4.5, 8);
  return front;
}

/// A house from x = begin to begin + width, with its front at `front_y` and its back `depth` behind; `side`
/// is +1 for a house whose front looks to -y.
void house(sim::Scene& scene, const HouseFront& front, double begin_m, double width_m, double front_m,
           double depth_m, double side) {
  const auto piece = [&](double x0, double x1, double out_m, double z0, double z1) {
    const double y0 = front_m - side * out_m;
    const double y1 = front_m + side * depth_m;
    box(scene, {x0, std::min(y0, y1), z0}, {x1, std::max(y0, y1), z1});
  };
  piece(begin_m, begin_m + width_m, 0, -1, front.height_m);
  const double porch_m = begin_m + front.porch * width_m;
  piece(porch_m, porch_m + 1.2, 0.5, -1, 2.5);
  const double bay_m = begin_m + front.bay * width_m;
  piece(bay_m, bay_m + 0.3 * width_m, front.bay_depth_m, -1, 2.8);
}

/// A row of houses along x.
struct Row {
  double begin_m, end_m, pitch_m, front_m, depth_m, side;
};

void row_alike(sim::Scene& scene, const Row& row, const HouseFront& front) {
  for (double x = row.begin_m; x + row.pitch_m <= row.end_m + 1e-6; x += row.pitch_m)
    house(scene, front, x, row.pitch_m, row.front_m, row.depth_m, row.side);
}

void row_of_all_sorts(sim::Scene& scene, const Row& row, sim::Random& random) {
  for (double x = row.begin_m; x < row.end_m - 4;) {
    const double width_m = random.uniform(5, 9);
    house(scene, draw_front(random), x, width_m, row.front_m + row.side * random.uniform(0, 1.5), row.depth_m,
          row.side);
    x += width_m + (random.chance(0.3) ? random.uniform(1, 2.5) : 0);
  }
}

void park(sim::Scene& scene, double begin_m, double end_m, double y_m, double chance, sim::Random& random) {
  for (double x = begin_m + 3; x < end_m - 3; x += 6.5) {
    if (random.chance(chance)) car(scene, {x + random.uniform(-0.8, 0.8), y_m}, random);
  }
}

}  // namespace

Place make_streets(std::uint64_t seed) {
  sim::Random random(sim::mix(seed, 1));
  Place place;
  place.is_outdoors = true;
  place.step_m = 1.3;
  place.corner_radius_m = 2.5;
  const double pitch_m = random.uniform(5, 7.5);
  const int houses = static_cast<int>(32 / pitch_m);
  const double length_m = pitch_m * houses;
  const double width_m = random.uniform(7, 9);
  const double depth_m = random.uniform(5, 6.5);
  const double apart_m = width_m + depth_m;
  ground(place.scene, {-40, -40}, {length_m + 40, apart_m + 40}, seed, 0.03);
  const HouseFront front = draw_front(random);
  // The row in the middle has fronts on both sides, each half as deep.
  row_alike(place.scene, {0, length_m, pitch_m, width_m / 2, depth_m / 2, 1}, front);
  row_alike(place.scene, {0, length_m, pitch_m, width_m / 2 + depth_m, depth_m / 2, -1}, front);
  row_alike(place.scene, {-pitch_m, length_m + pitch_m, pitch_m, -width_m / 2, depth_m, -1}, front);
  row_alike(place.scene, {-pitch_m, length_m + pitch_m, pitch_m, apart_m + width_m / 2, depth_m, 1}, front);
  const bool with_cars = random.chance(0.5);
  if (with_cars) {
    park(place.scene, 0, length_m, -width_m / 2 + 1.4, 0.3, random);
    park(place.scene, 0, length_m, apart_m + width_m / 2 - 1.4, 0.3, random);
  }
  const Lanes lanes = draw_lanes(random, length_m, apart_m, 4, std::min(2.0, width_m / 2 - 2.6));
  place.corners_m = way_along(lanes);
  place.what = fmt::format("{:.1f} m apart, houses of {:.1f} m{}{}", apart_m, pitch_m,
                           with_cars ? ", parked cars" : "", again(lanes.opposite));
  return place;
}

Place make_pass(std::uint64_t seed) {
  sim::Random random(sim::mix(seed, 5));
  Place place;
  place.is_outdoors = true;
  place.step_m = 0.57;
  const double length_m = 40;
  const double width_m = random.uniform(9, 16);
  ground(place.scene, {-80, -40}, {length_m + 80, 40}, seed, 0.03);
  const bool alike = random.chance(0.5);
  const double pitch_m = random.uniform(4.5, 7);
  const HouseFront front = draw_front(random);
  for (const double side : {-1.0, 1.0}) {
    const Row row{-60, length_m + 60, pitch_m, side * width_m / 2, 5, side};
    if (alike) {
      row_alike(place.scene, row, front);
    } else {
      row_of_all_sorts(place.scene, row, random);
    }
    if (!alike || random.chance(0.5))
      park(place.scene, -30, length_m + 30, side * (width_m / 2 - 1.4), 0.25, random);
  }
  place.corners_m = {{0, 0, 0}, {length_m, 0, 0}};
  place.what = alike ? fmt::format("houses alike, {:.1f} m each", pitch_m) : "houses of all sorts";
  return place;
}

Place make_roundabout(std::uint64_t seed) {
  sim::Random random(sim::mix(seed, 3));
  Place place;
  place.is_outdoors = true;
  place.step_m = 0.9;
  const int exits = random.integer(3, 8);
  const double drive_m = random.uniform(6, 8.5);
  const double houses_m = drive_m + random.uniform(5, 8);
  ground(place.scene, {-70, -70}, {70, 70}, seed, 0.02);
  place.scene.add(sim::Pole{{0, 0, -0.5F}, 0.15F, static_cast<float>(random.uniform(1, 5)), 0.4F});
  const double island_m = drive_m - 2.5;
  const int sides = 16;  // of the island's curb
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    const auto half = static_cast<float>(island_m * std::tan(std::numbers::pi / sides));
    sim::Frame frame;
    frame.forward = {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))};
    const auto out = static_cast<float>(island_m);
    place.scene.add_box(frame, {out - 0.3F, -half, -0.5F}, {out, half, 0.15F}, 0.4F);
  }
  const double sector = 2 * std::numbers::pi / exits;
  const double odd = random.chance(0.5) ? 0.0 : 0.2;  // share of the sectors that are not like the others
  const double height_m = random.uniform(4, 9);
  for (int i = 0; i < exits; ++i) {
    const double angle = (i + 0.5) * sector;
    sim::Frame frame;
    frame.forward = {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))};
    const double half =
        std::max(2.0, houses_m * std::tan(sector / 2) - 4.5);  // an exit of some 8 m between them
    const double own_m = houses_m + (random.chance(odd) ? random.uniform(0.5, 2) : 0.0);
    const auto f = [](double value) { return static_cast<float>(value); };
    place.scene.add_box(frame, {f(own_m), f(-half), -1}, {f(own_m + 8), f(half), f(height_m)}, 0.5F);
    place.scene.add_box(frame, {f(own_m - 0.6), f(-0.5 * half), -1}, {f(own_m + 1), f(-0.1 * half), 2.5F},
                        0.5F);
    // Beside the exits: long walls outward, so that the streets go on.
    place.scene.add_box(frame, {f(own_m + 8), f(-half), -1}, {f(own_m + 40), f(-half + 0.3), 2.0F}, 0.5F);
    place.scene.add_box(frame, {f(own_m + 8), f(half - 0.3), -1}, {f(own_m + 40), f(half), 2.0F}, 0.5F);
  }
  place.corners_m.emplace_back(-drive_m - 10, -1.5, 0);
  const double laps = 1.5;
  const double beside_m = random.uniform(-1.2, 1.2);  // the second lap
  for (double lap = 0; lap <= laps; lap += 1.0 / 48) {
    const double angle = -std::numbers::pi + 2 * std::numbers::pi * lap;
    const double radius_m = drive_m + (lap > 1 ? beside_m * std::min(1.0, (lap - 1) * 8) : 0.0);
    place.corners_m.emplace_back(radius_m * std::cos(angle), radius_m * std::sin(angle), 0);
  }
  place.corner_radius_m = 0.8;
  place.what =
      fmt::format("{} exits, {:.1f} m from the middle{}", exits, drive_m, odd > 0 ? ", not quite alike" : "");
  return place;
}

Place make_field(std::uint64_t seed) {
  constexpr int pole_counts[] = {0, 60, 10, 30, 4, 45, 20};
  sim::Random random(sim::mix(seed, 4));
  Place place;
  place.is_outdoors = true;
  place.step_m = 1.3;
  place.corner_radius_m = 2;
  const int poles = pole_counts[seed % std::size(pole_counts)];
  ground(place.scene, {-50, -50}, {80, 70}, seed, random.uniform(0, 0.08));
  constexpr double width_m = 24;
  constexpr double depth_m = 14;
  for (int i = 0; i < poles;) {
    const Vector2d at(random.uniform(-25, width_m + 25), random.uniform(-25, depth_m + 25));
    const bool in_the_way = at.x() > -4 && at.x() < width_m + 4 && at.y() > -4 && at.y() < depth_m + 4 &&
                            !(at.x() > 4 && at.x() < width_m - 4 && at.y() > 4 && at.y() < depth_m - 4);
    if (in_the_way) continue;
    place.scene.add(sim::Pole{{static_cast<float>(at.x()), static_cast<float>(at.y()), -1},
                              static_cast<float>(random.uniform(0.05, 0.15)),
                              static_cast<float>(random.uniform(2.5, 7)),
                              0.5F});
    ++i;
  }
  const bool opposite = random.chance(0.4);
  const double offset_m = random.uniform(-2, 2);
  place.corners_m = {{0, 0, 0}, {width_m, 0, 0}, {width_m, depth_m, 0}, {0, depth_m, 0}};
  if (opposite) {
    place.corners_m.emplace_back(0, depth_m + offset_m, 0);
    place.corners_m.emplace_back(width_m, depth_m + offset_m, 0);
  } else {
    place.corners_m.emplace_back(offset_m, offset_m, 0);
    place.corners_m.emplace_back(width_m + offset_m, offset_m, 0);
  }
  place.what = fmt::format("{} poles{}", poles, again(opposite));
  return place;
}

Place make_yards(std::uint64_t seed) {
  sim::Random random(sim::mix(seed, 9));
  Place place;
  place.is_outdoors = true;
  place.step_m = 1.5;
  place.corner_radius_m = 2;
  place.reach_m = 18;
  const bool is_back = random.chance(0.5);  // the way ends in the yard where it began
  const double apart_m = random.uniform(15, 22);
  ground(place.scene, {-60, -90}, {90, 50}, seed, 0.02);
  const std::uint64_t furniture = random.next();
  constexpr double half_m = 6;
  const std::vector<double> yards{0.0, apart_m};
  for (const double x : yards) {
    sim::Random alike(furniture);
    box(place.scene, {x - half_m - 0.3, half_m, -1}, {x + half_m + 0.3, half_m + 0.3, 3});
    for (const double side : {-1.0, 1.0}) {
      const double wall_m = x + side * half_m;
      box(place.scene, {std::min(wall_m, wall_m + side * 0.3), -half_m, -1},
          {std::max(wall_m, wall_m + side * 0.3), half_m, 3});
    }
    for (int i = 0; i < 6; ++i) {
      const double side = i % 2 == 0 ? -1 : 1;
      const Vector2d at(x + side * alike.uniform(3.8, 5.2), alike.uniform(-5, 5));
      const double size_m = alike.uniform(0.3, 0.7);
      const double height_m = alike.uniform(0.6, 2.5);
      box(place.scene, {at.x() - size_m, at.y() - size_m, -1}, {at.x() + size_m, at.y() + size_m, height_m});
    }
  }
  const double out_m = -36;
  const double aside_m = is_back ? apart_m + 8 : apart_m;
  place.corners_m = {{0, 2, 0}, {0, out_m, 0}, {aside_m, out_m, 0}};
  if (is_back) {
    const double offset_m = random.uniform(-1.5, 1.5);
    place.corners_m.emplace_back(aside_m, out_m + 6, 0);
    place.corners_m.emplace_back(offset_m, out_m + 8, 0);
    place.corners_m.emplace_back(offset_m, 2, 0);
  } else {
    place.corners_m.emplace_back(apart_m, 2, 0);
  }
  place.what =
      fmt::format("{:.1f} m apart{}", apart_m, is_back ? ", back into the first" : ", into the second");
  return place;
}

}  // namespace alces::places
