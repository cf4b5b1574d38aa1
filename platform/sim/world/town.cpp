#include "alces_platform/sim/world/town.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace alces::sim {

using Eigen::Vector2d;
using Eigen::Vector3f;

namespace {

constexpr double tau = 2 * std::numbers::pi;

float range(Random& random, double low, double high) {
  return static_cast<float>(random.uniform(low, high));
}

}  // namespace

// One side of a block, walked with the block on the left: from `start` to `end` in the plan.
struct Town::Side {
  Vector2d start;
  Vector2d end;
  double house_from_m;  ///< houses stand between these lengths along the side
  double house_to_m;
  double deepest_m;     ///< room for a house
  double half_width_m;  ///< of the street in front
};

double Town::Wave::at(const Vector2d& plan) const {
  return amplitude_m * std::sin(frequency.dot(plan) + phase_rad);
}

Town::Wave Town::wave(Random& random, double length_m, double amplitude_m) const {
  const double direction = random.uniform(0, tau);
  const double turns = std::round(layout_.period_m / length_m * std::cos(direction));
  Wave wave;
  wave.frequency = {tau * turns / layout_.period_m, tau / length_m * std::sin(direction)};
  wave.phase_rad = random.uniform(0, tau);
  wave.amplitude_m = amplitude_m;
  return wave;
}

std::uint64_t Town::key(std::size_t column) const {
  return column < layout_.column_keys.size() ? layout_.column_keys[column] : column;
}

Town::Town(const Layout& layout) : layout_(layout) {
  Random random(mix(layout_.seed, 1));
  const double heading = random.uniform(0.2, 0.5);
  east_ = {std::cos(heading), std::sin(heading)};
  for (const double length : {150.0, 105.0, 80.0}) {
    bend_u_.push_back(wave(random, length, 0.013 * length));
    bend_v_.push_back(wave(random, length, 0.013 * length));
  }
  for (const double length : {260.0, 170.0, 110.0, 60.0, 37.0})
    relief_.push_back(wave(random, length, 0.006 * length));
  for (const double length : {3.1, 2.3, 1.7, 1.1}) relief_.push_back(wave(random, length, 0.005));

  lay_ground();
  for (std::size_t column = 0; column + 1 < layout_.column_lines_m.size(); ++column)
    for (std::size_t row = 0; row + 1 < layout_.row_lines_m.size(); ++row) build_block(column, row);
  scene_.build();
}

Vector2d Town::place(const Vector2d& plan) const {
  Vector2d bent = plan;
  for (const Wave& wave : bend_u_) bent.x() += wave.at(plan);
  for (const Wave& wave : bend_v_) bent.y() += wave.at(plan);
  return {east_.x() * bent.x() - east_.y() * bent.y(), east_.y() * bent.x() + east_.x() * bent.y()};
}

double Town::relief_m(const Vector2d& xy) const {
  const Vector2d turned(east_.x() * xy.x() + east_.y() * xy.y(), east_.x() * xy.y() - east_.y() * xy.x());
  double height = 0;
  for (const Wave& wave : relief_) height += wave.at(turned);
  return height;
}

double Town::street_half_width_m(std::size_t line, bool is_column) const {
  const auto& lines = is_column ? layout_.column_lines_m : layout_.row_lines_m;
  double block = 1e9;  // narrow streets where the blocks are small
  if (line > 0) block = std::min(block, lines[line] - lines[line - 1]);
  if (line + 1 < lines.size()) block = std::min(block, lines[line + 1] - lines[line]);
  Random random(mix(layout_.seed, is_column ? 2 : 3, is_column ? key(line) : line));
  const double wide = random.uniform(5.5, 8.0);
  return block < 30 ? 4.6 : wide;
}

// Heights on the grid: relief, with footways and blocks a curb's height above the roadways.
void Town::lay_ground() {
  const auto& columns = layout_.column_lines_m;
  const auto& rows = layout_.row_lines_m;
  Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  struct Stretch {
    Vector2d centre;
    double half_width;
  };
  std::vector<Stretch> road;
  const auto pave = [&](const Vector2d& from, const Vector2d& to, double half_width) {
    const int steps = static_cast<int>((to - from).norm() / 0.5) + 1;
    for (int step = 0; step <= steps; ++step) {
      const Vector2d xy = place(from + (to - from) * step / steps);
      low = low.cwiseMin(xy);
      high = high.cwiseMax(xy);
      road.push_back({xy, half_width - footway_m});
    }
  };
  for (std::size_t line = 0; line < columns.size(); ++line)
    pave({columns[line], rows.front()}, {columns[line], rows.back()}, street_half_width_m(line, true));
  for (std::size_t line = 0; line < rows.size(); ++line)
    pave({columns.front(), rows[line]}, {columns.back(), rows[line]}, street_half_width_m(line, false));

  low.array() -= 12;
  high.array() += 12;
  constexpr double cell = static_cast<double>(Ground::cell_m);
  const int width = static_cast<int>((high.x() - low.x()) / cell) + 2;
  const int height = static_cast<int>((high.y() - low.y()) / cell) + 2;
  std::vector<bool> is_road(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), false);
  for (const Stretch& stretch : road) {
    const int reach = static_cast<int>(stretch.half_width / cell) + 1;
    const int column = static_cast<int>((stretch.centre.x() - low.x()) / cell);
    const int row = static_cast<int>((stretch.centre.y() - low.y()) / cell);
    for (int r = std::max(0, row - reach); r < std::min(height, row + reach + 1); ++r) {
      for (int c = std::max(0, column - reach); c < std::min(width, column + reach + 1); ++c) {
        const Vector2d from_axis = low + Vector2d(c, r) * cell - stretch.centre;
        if (from_axis.squaredNorm() < stretch.half_width * stretch.half_width)
          is_road[static_cast<std::size_t>(r) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(c)] = true;
      }
    }
  }
  scene_.ground = Ground(low, high, [&](double x, double y) {
    const int c = static_cast<int>(std::lround((x - low.x()) / cell));
    const int r = static_cast<int>(std::lround((y - low.y()) / cell));
    const bool paved =
        c >= 0 && r >= 0 && c < width && r < height &&
        is_road[static_cast<std::size_t>(r) * static_cast<std::size_t>(width) + static_cast<std::size_t>(c)];
    return relief_m({x, y}) + (paved ? 0.0 : curb_m);
  });
}

Frame Town::frame(const Vector2d& xy, const Vector2d& forward) const {
  Frame frame;
  frame.origin = {static_cast<float>(xy.x()), static_cast<float>(xy.y()), static_cast<float>(height_m(xy))};
  frame.forward = forward.normalized().cast<float>();
  return frame;
}

void Town::build_block(std::size_t column, std::size_t row) {
  const double left = layout_.column_lines_m[column] + street_half_width_m(column, true);
  const double right = layout_.column_lines_m[column + 1] - street_half_width_m(column + 1, true);
  const double bottom = layout_.row_lines_m[row] + street_half_width_m(row, false);
  const double top = layout_.row_lines_m[row + 1] - street_half_width_m(row + 1, false);
  const std::uint64_t seed = mix(layout_.seed, 100 + key(column), row);
  if (right - left < 4 || top - bottom < 4) return;

  if (right - left < 22 || top - bottom < 22) {  // a small block: one house, with furniture around it
    Random random(mix(seed, 9));
    const Vector2d corner = place({left, bottom});
    const Vector2d along = place({right, bottom}) - corner;
    const double depth = (place({left, top}) - corner).norm();
    build_house(frame(corner, along), static_cast<float>(along.norm()), static_cast<float>(depth), random,
                false);
    return;
  }

  const double deepest = std::min(12.0, 0.5 * std::min(right - left, top - bottom) - 2);
  const double corner = deepest + 0.5;
  const Vector2d corners[4] = {{left, bottom}, {right, bottom}, {right, top}, {left, top}};
  const double half_widths[4] = {street_half_width_m(row, false), street_half_width_m(column + 1, true),
                                 street_half_width_m(row + 1, false), street_half_width_m(column, true)};
  for (std::size_t index = 0; index < 4; ++index) {
    Side side;
    side.start = corners[index];
    side.end = corners[(index + 1) % 4];
    const double length = (side.end - side.start).norm();
    const bool corner_houses = index % 2 == 0;  // the other two sides leave the corners to these
    side.house_from_m = corner_houses ? 0 : corner;
    side.house_to_m = corner_houses ? length : length - corner;
    side.deepest_m = deepest;
    side.half_width_m = half_widths[index];
    build_side(side, mix(seed, index));
  }
  Random random(mix(seed, 8));  // trees in the yard
  for (int tree = random.integer(1, 5); tree > 0; --tree) {
    const Vector2d plan{random.uniform(left + deepest, right - deepest),
                        random.uniform(bottom + deepest, top - deepest)};
    build_tree(frame(place(plan), east_), random);
  }
}

void Town::build_side(const Side& side, std::uint64_t seed) {
  Random random(seed);
  const Vector2d along = (side.end - side.start).normalized();
  const Vector2d out(along.y(), -along.x());
  const double length = (side.end - side.start).norm();
  const auto at = [&](double along_m, double out_m) {
    return place(side.start + along * along_m + out * out_m);
  };
  const auto frame_at = [&](double along_m, double out_m) {
    return frame(at(along_m, out_m), at(along_m + 0.5, out_m) - at(along_m - 0.5, out_m));
  };

  // Houses and gaps. A street is either a closed row or has gardens; now and then one long plain wall.
  const double gap_share = random.chance(0.4) ? 0.08 : 0.3;
  for (double from = side.house_from_m; from < side.house_to_m - 4;) {
    const bool plain = random.chance(0.07);
    double width = plain ? random.uniform(18, 32) : random.uniform(7, 16);
    if (side.house_to_m - from - width < 7) width = side.house_to_m - from;
    width = std::min(width, side.house_to_m - from);
    double setback = random.uniform(0, 1.2);
    if (!random.chance(0.5)) setback *= 0.15;
    const Vector2d left = at(from, -setback);
    const Vector2d right = at(from + width, -setback);
    const Frame front = frame(left, right - left);
    const auto front_m = static_cast<float>((right - left).norm());
    if (!plain && random.chance(gap_share)) {
      build_garden(front, front_m, random);
    } else {
      build_house(front, front_m - 0.04F, static_cast<float>(random.uniform(0.75, 1.0) * side.deepest_m),
                  random, plain);
    }
    from += width;
  }

  // Furniture of the footway and cars at the curb.
  Random furniture(mix(seed, 1));
  const double curb = footway_m;
  if (furniture.chance(0.5))
    for (double from = furniture.uniform(2, 8); from < length - 1; from += furniture.uniform(8, 14))
      if (furniture.chance(0.85)) build_tree(frame_at(from, curb - 0.5), furniture);
  for (double from = furniture.uniform(1, 12); from < length; from += furniture.uniform(17, 26)) {
    const Frame lamp = frame_at(from, curb - 0.35);
    scene_.add(Pole{lamp.origin - Vector3f(0, 0, 0.3F), 0.07F, 5.6F, 0.4F});
    scene_.add_box(lamp, {-0.12F, -1.0F, 5.1F}, {0.12F, 0.1F, 5.25F}, 0.4F);
  }
  for (double from = furniture.uniform(0, 6); from < length; from += furniture.uniform(4, 15)) {
    const Frame spot = frame_at(from, furniture.uniform(0.3, curb - 0.3));
    switch (furniture.integer(0, 4)) {
      case 0:  // a sign
        scene_.add(Pole{spot.origin - Vector3f(0, 0, 0.2F), 0.035F, 2.9F, 0.4F});
        scene_.add_box(spot.at(Vector3f::Zero(), range(furniture, 0, 3)), {-0.3F, -0.02F, 2.0F},
                       {0.3F, 0.02F, 2.6F}, 0.8F);
        break;
      case 1:  // a bin or a junction box
        scene_.add_tapered_box(spot, {-0.35F, -0.3F, -0.3F}, {0.35F, 0.3F, range(furniture, 0.8, 1.4)},
                               {0.04F, 0.04F, 0.06F}, 0.5F, Surface::wall);
        break;
      case 2:  // a bench
        scene_.add_box(spot, {-0.8F, -0.22F, 0.38F}, {0.8F, 0.22F, 0.46F}, 0.4F);
        scene_.add_box(spot, {-0.8F, 0.2F, 0.3F}, {0.8F, 0.26F, 0.9F}, 0.4F);
        break;
      default:  // bollards
        for (int post = 0; post < 3; ++post)
          scene_.add(Pole{spot.out({1.6F * static_cast<float>(post), 0, -0.3F}), 0.06F, 1.25F, 0.4F});
    }
  }
  const double roadway = side.half_width_m - footway_m;
  if (roadway > 3.2) {
    const double parked = furniture.uniform(0.15, 0.6);
    for (double from = 4; from < length - 4; from += furniture.uniform(5.2, 6.5))
      if (furniture.chance(parked)) {
        const Frame spot = frame_at(from, curb + 0.95 + furniture.uniform(0, 0.15));
        const float skew = range(furniture, -0.04, 0.04);
        build_car(spot.at(Vector3f::Zero(), furniture.chance(0.5) ? skew + 3.1416F : skew), furniture);
      }
  }
}

void Town::build_house(const Frame& front, float width, float depth, Random& random, bool plain) {
  if (width < 3 || depth < 3) return;
  constexpr float below = -3.0F;
  const float wall = 0.3F;  // windows are let into this thickness
  const float storey = range(random, 2.8, 3.5);
  const int storeys = plain ? random.integer(1, 2) : random.integer(1, 4);
  const float height = storey * static_cast<float>(storeys) + range(random, 0.3, 1.2);
  const float reflectivity = range(random, 0.35, 0.8);
  const float footing = range(random, 0.2, 0.7);

  const Frame walls[4] = {front, front.at({width, 0, 0}, 1.5707963F), front.at({width, depth, 0}, 3.1415927F),
                          front.at({0, depth, 0}, -1.5707963F)};
  for (int index = 0; index < 4; ++index) {
    Facade facade;
    facade.frame = walls[index];
    facade.width = index % 2 == 0 ? width : depth;
    facade.bottom = below;
    facade.height = height;
    facade.reflectivity = reflectivity;
    const bool gable_wall = index % 2 == 1 && random.chance(0.4);
    if (!plain && !gable_wall) {
      facade.depth = range(random, 0.1, 0.28);
      facade.pitch_x = range(random, 1.9, 3.0);
      facade.columns = std::max(1, static_cast<int>((facade.width - 0.8F) / facade.pitch_x));
      facade.window_width = facade.pitch_x * range(random, 0.35, 0.62);
      facade.first_x = 0.5F * (facade.width - static_cast<float>(facade.columns - 1) * facade.pitch_x -
                               facade.window_width);
      facade.rows = storeys;
      facade.pitch_z = storey;
      facade.first_z = footing + 0.8F;
      facade.window_height = range(random, 1.1, 1.8);
      if (index == 0) facade.door_x = range(random, 0.4, static_cast<double>(width) - 1.6);
    }
    scene_.add(facade);
    // The corner's post, up to the roof; on some houses it stands out as a pilaster.
    const float out = random.chance(0.2) ? 0.12F : 0.0F;
    scene_.add_box(walls[index], {-out, -out, below}, {0.35F, 0.35F, height}, reflectivity);
    if (facade.door_x >= 0)
      scene_.add_box(walls[index], {facade.door_x - 0.2F, -0.8F, below}, {facade.door_x + 1.3F, 0, 0.17F},
                     0.4F);
  }
  scene_.add_box(front, {wall, wall, below}, {width - wall, depth - wall, height}, reflectivity);

  // What stands out of the front.
  if (!plain) {
    if (random.chance(0.45)) {
      const float bay = range(random, 1.8, 2.8);
      const float x = range(random, 0.3, std::max(0.4, static_cast<double>(width - bay) - 0.3));
      const float from = random.chance(0.5) ? below : storey * 0.9F;
      const float out = range(random, 0.3, 0.9);
      scene_.add_box(front, {x, -out, from}, {x + bay, 0.1F, height - range(random, 0, 1)}, reflectivity);
    }
    for (int level = 1; level < storeys; ++level) {
      if (!random.chance(0.25)) continue;
      const float x = range(random, 0.3, std::max(0.4, static_cast<double>(width) - 3.0));
      const float z = storey * static_cast<float>(level);
      scene_.add_box(front, {x, -1.1F, z - 0.15F}, {x + 2.6F, 0, z}, 0.5F);
      scene_.add_box(front, {x, -1.1F, z}, {x + 2.6F, -1.05F, z + 0.95F}, 0.5F);
    }
    if (random.chance(0.35))  // a canopy or awning over the ground floor
      scene_.add_tapered_box(front, {0.5F, range(random, -1.3, -0.5), storey - 0.3F},
                             {width - 0.5F, 0, storey - 0.05F}, {0, 0, 0.1F}, 0.5F, Surface::wall);
    scene_.add(Pole{front.out({0.2F, -0.07F, 0}), 0.05F, height, 0.4F});
    if (random.chance(0.3))  // a string course
      scene_.add_box(front, {0, -0.1F, storey}, {width, 0, storey + 0.2F}, reflectivity);
  }

  // Roofs: flat with a parapet or a set-back storey, gable along or across the street, hip.
  const float eaves = range(random, 0.15, 0.6);
  const float rise = std::min(0.5F * depth, range(random, 2, 4.5));
  switch (plain ? 0 : random.integer(0, 4)) {
    case 0:
      scene_.add_box(front, {-0.05F, -0.05F, height},
                     {width + 0.05F, 0.25F, height + range(random, 0.3, 0.9)}, reflectivity);
      if (random.chance(0.6)) {
        const float back = range(random, 1, 2.5);
        scene_.add_box(front, {0.1F * width, back, height}, {0.85F * width, depth - 1, height + 2.6F},
                       reflectivity);
      }
      break;
    case 1:
      scene_.add_tapered_box(front, {0, -eaves, height}, {width, depth + eaves, height + rise},
                             {0, 0, 0.5F * depth + eaves}, 0.3F, Surface::wall);
      break;
    case 2:
      scene_.add_tapered_box(front, {-0.02F, -eaves, height}, {width + 0.02F, depth, height + rise},
                             {0.5F * width, 0.5F * width, 0}, 0.3F, Surface::wall);
      break;
    default:
      scene_.add_tapered_box(front, {0, -eaves, height}, {width, depth + eaves, height + rise},
                             {0.2F * width, 0.2F * width, 0.4F * depth}, 0.3F, Surface::wall);
      for (int dormer = random.integer(0, 2); dormer > 0; --dormer) {
        const float x = range(random, 1, std::max(1.1, static_cast<double>(width) - 2.5));
        scene_.add_box(front, {x, 0.5F, height}, {x + 1.5F, 0.5F * depth, height + 1.6F}, reflectivity);
      }
  }
  const float x = range(random, 0.3, std::max(0.4, static_cast<double>(width) - 1));
  scene_.add_box(front, {x, 0.4F * depth, height}, {x + 0.6F, 0.4F * depth + 0.6F, height + rise + 0.8F},
                 0.4F);
}

void Town::build_garden(const Frame& front, float width, Random& random) {
  const float open = random.chance(0.5) ? std::min(3.0F, 0.4F * width) : 0;  // a gateway on the left
  const float length = width - open;
  switch (random.integer(0, 3)) {
    case 0:
    case 1: {
      Thicket hedge;
      hedge.half = {0.5F * length, range(random, 0.3, 0.5), range(random, 0.8, 1.2)};
      hedge.frame = front.at({open + 0.5F * length, 0.5F, hedge.half.z() - 0.3F});
      hedge.ellipsoid = false;
      hedge.cell_m = 0.07F;
      hedge.share = 0.4F;
      hedge.seed = random.next();
      scene_.add(hedge);
      break;
    }
    case 2: {
      Thicket fence;
      fence.half = {0.5F * length, 0.03F, 0.75F};
      fence.frame = front.at({open + 0.5F * length, 0.2F, 0.6F});
      fence.ellipsoid = false;
      fence.cell_m = 0.06F;
      fence.share = 0.5F;
      fence.seed = random.next();
      scene_.add(fence);
      for (float x = open; x <= width; x += 2.2F)
        scene_.add(Pole{front.out({x, 0.2F, -1.0F}), 0.06F, 2.5F, 0.4F});
      break;
    }
    default:
      scene_.add_box(front, {open, 0.0F, -2.0F}, {width, 0.25F, range(random, 1.0, 2.1)}, 0.5F);
  }
  for (int tree = random.integer(0, 2); tree > 0; --tree)
    build_tree(front.at({range(random, 1, static_cast<double>(width) - 1), range(random, 2.5, 9), 0}),
               random);
  for (int bush = random.integer(1, 4); bush > 0; --bush) {
    Thicket thicket;
    const float radius = range(random, 0.4, 1.1);
    thicket.half = {radius, radius * range(random, 0.8, 1.2), radius};
    thicket.frame =
        front.at({range(random, 1, static_cast<double>(width) - 1), range(random, 1.5, 8), 0.6F * radius});
    thicket.cell_m = 0.08F;
    thicket.share = 0.2F;
    thicket.seed = random.next();
    scene_.add(thicket);
  }
  if (random.chance(0.6)) {
    const float turn = range(random, -0.3, 0.3);
    const Frame shed = front.at({range(random, 1, 3), range(random, 5, 8), 0}, turn);
    scene_.add_box(shed, {0, 0, -2}, {3.2F, 2.4F, 2.2F}, 0.4F);
    scene_.add_tapered_box(shed, {-0.2F, -0.2F, 2.2F}, {3.4F, 2.6F, 3.0F}, {0, 0, 1.4F}, 0.3F, Surface::wall);
  }
}

void Town::build_tree(const Frame& foot, Random& random) {
  const float size = range(random, 0.7, 1.25);
  const float trunk = range(random, 2.2, 3.4) * size;
  Pole pole;
  pole.foot = foot.origin - Vector3f(0, 0, 0.5F);
  pole.radius = range(random, 0.1, 0.24) * size;
  pole.height = trunk + 1.5F;
  pole.reflectivity = 0.3F;
  scene_.add(pole);
  for (int part = 0; part < 2; ++part) {  // a crown of two lumps
    Thicket crown;
    const float radius = range(random, 1.3, 2.1) * size;
    crown.half = {radius, radius * range(random, 0.8, 1.2), radius * range(random, 0.8, 1.3)};
    const float turn = range(random, 0, 3);
    crown.frame = foot.at({range(random, -0.6, 0.6), range(random, -0.6, 0.6),
                           trunk + 0.7F * crown.half.z() + 0.8F * static_cast<float>(part)},
                          turn);
    crown.cell_m = 0.14F;
    crown.share = range(random, 0.06, 0.16);
    crown.seed = random.next();
    scene_.add(crown);
  }
}

void Town::build_car(const Frame& centre, Random& random) {
  const float length = range(random, 1.9, 2.35);  // half of it
  const float width = range(random, 0.8, 0.92);
  const float waist = range(random, 0.8, 1.0);
  const float reflectivity = range(random, 0.2, 0.7);
  if (random.chance(0.15)) {  // a van
    scene_.add_tapered_box(centre, {-length - 0.3F, -width - 0.05F, 0.22F},
                           {length + 0.3F, width + 0.05F, 2.1F}, {1.0F, 0.05F, 0.1F}, reflectivity,
                           Surface::paint);
  } else {
    scene_.add_tapered_box(centre, {-length, -width, 0.22F}, {length, width, waist}, {0.15F, 0.1F, 0.06F},
                           reflectivity, Surface::paint);
    scene_.add_tapered_box(centre, {-0.8F * length, -width + 0.05F, waist},
                           {0.5F * length, width - 0.05F, waist + 0.55F}, {0.55F, 0.5F, 0.2F}, reflectivity,
                           Surface::glass);
  }
  for (const float x : {-0.6F * length, 0.62F * length})
    scene_.add_box(centre, {x - 0.3F, -width + 0.02F, -0.1F}, {x + 0.3F, width - 0.02F, 0.5F}, 0.1F);
}

}  // namespace alces::sim
