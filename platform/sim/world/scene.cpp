#include "alces_platform/sim/world/scene.h"

#include <algorithm>
#include <cmath>

#include "alces_platform/sim/random.h"

namespace alces::sim {

using Eigen::Vector3f;

Frame Frame::at(const Vector3f& local, float heading_rad) const {
  Frame frame;
  frame.origin = out(local);
  const Vector3f x = turn_out({std::cos(heading_rad), std::sin(heading_rad), 0});
  frame.forward = x.head<2>();
  return frame;
}

void Scene::add_body(Kind kind, std::size_t index, const Box& box) {
  Body body;
  body.kind = kind;
  body.index = static_cast<std::uint32_t>(index);
  body.box = box;
  bodies_.push_back(body);
}

void Scene::add_box(const Frame& frame, const Vector3f& low, const Vector3f& high, float reflectivity,
                    Surface surface) {
  add_tapered_box(frame, low, high, Vector3f::Zero(), reflectivity, surface);
}

void Scene::add_tapered_box(const Frame& frame, const Vector3f& low, const Vector3f& high,
                            const Vector3f& inset, float reflectivity, Surface surface) {
  Convex convex;
  convex.reflectivity = reflectivity;
  convex.surface = surface;
  const float height = high.z() - low.z();
  const Vector3f local[6] = {{height, 0, inset.x()},
                             {-height, 0, inset.y()},
                             {0, height, inset.z()},
                             {0, -height, inset.z()},
                             {0, 0, 1},
                             {0, 0, -1}};
  const Vector3f on[6] = {{high.x(), 0, low.z()}, {low.x(), 0, low.z()}, {0, high.y(), low.z()},
                          {0, low.y(), low.z()},  {0, 0, high.z()},      {0, 0, low.z()}};
  for (int face = 0; face < 6; ++face) {
    convex.normals[face] = frame.turn_out(local[face].normalized());
    convex.offsets[face] = convex.normals[face].dot(frame.out(on[face]));
  }
  Box box;
  for (const float x : {low.x(), high.x()})
    for (const float y : {low.y(), high.y()})
      for (const float z : {low.z(), high.z()}) box.include(frame.out({x, y, z}));
  convexes_.push_back(convex);
  add_body(Kind::convex, convexes_.size() - 1, box);
}

void Scene::add(const Facade& facade) {
  Box box;
  for (const float x : {0.0F, facade.width})
    for (const float y : {0.0F, facade.depth})
      for (const float z : {facade.bottom, facade.height}) box.include(facade.frame.out({x, y, z}));
  facades_.push_back(facade);
  add_body(Kind::facade, facades_.size() - 1, box);
}

void Scene::add(const Thicket& thicket) {
  Box box;
  for (const float x : {-1.0F, 1.0F})
    for (const float y : {-1.0F, 1.0F})
      for (const float z : {-1.0F, 1.0F})
        box.include(thicket.frame.out(Vector3f(x, y, z).cwiseProduct(thicket.half)));
  thickets_.push_back(thicket);
  add_body(Kind::thicket, thickets_.size() - 1, box);
}

void Scene::add(const Pole& pole) {
  Box box;
  box.include(pole.foot - Vector3f(pole.radius, pole.radius, 0));
  box.include(pole.foot + Vector3f(pole.radius, pole.radius, pole.height));
  poles_.push_back(pole);
  add_body(Kind::pole, poles_.size() - 1, box);
}

void Scene::build() {
  nodes_.clear();
  if (bodies_.size() >= 2) build_node(0, static_cast<std::uint32_t>(bodies_.size()));
}

// Splits bodies [first, first + count), count >= 2, by the surface area heuristic over 16 bins of each axis.
std::uint32_t Scene::build_node(std::uint32_t first, std::uint32_t count) {
  constexpr int bins = 16;
  const auto centre = [](const Body& body, int axis) {
    return 0.5F * (body.box.low[axis] + body.box.high[axis]);
  };
  const auto begin = bodies_.begin() + first;
  const auto end = begin + count;
  Box centres;
  for (auto body = begin; body != end; ++body)
    centres.include(Vector3f(centre(*body, 0), centre(*body, 1), centre(*body, 2)));

  float best_cost = std::numeric_limits<float>::max();
  int best_axis = -1;
  int best_bin = 0;
  const auto bin_of = [&](const Body& body, int axis) {
    const float size = centres.high[axis] - centres.low[axis];
    return std::min(bins - 1, static_cast<int>((centre(body, axis) - centres.low[axis]) / size * bins));
  };
  for (int axis = 0; axis < 3; ++axis) {
    if (centres.high[axis] - centres.low[axis] < 1e-5F) continue;
    Box box[bins];
    int in_bin[bins] = {};
    for (auto body = begin; body != end; ++body) {
      const int bin = bin_of(*body, axis);
      box[bin].include(body->box);
      ++in_bin[bin];
    }
    Box left;
    int left_count = 0;
    for (int cut = 1; cut < bins; ++cut) {
      left.include(box[cut - 1]);
      left_count += in_bin[cut - 1];
      Box right;
      int right_count = 0;
      for (int bin = cut; bin < bins; ++bin) {
        right.include(box[bin]);
        right_count += in_bin[bin];
      }
      if (left_count == 0 || right_count == 0) continue;
      const float cost = left.half_area() * static_cast<float>(left_count) +
                         right.half_area() * static_cast<float>(right_count);
      if (cost < best_cost) {
        best_cost = cost;
        best_axis = axis;
        best_bin = cut;
      }
    }
  }
  std::uint32_t split = first + count / 2;
  if (best_axis >= 0) {
    const auto middle =
        std::partition(begin, end, [&](const Body& body) { return bin_of(body, best_axis) < best_bin; });
    split = first + static_cast<std::uint32_t>(middle - begin);
  }

  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  const std::uint32_t starts[2] = {first, split};
  const std::uint32_t counts[2] = {split - first, first + count - split};
  for (int side = 0; side < 2; ++side) {
    Box box;
    for (std::uint32_t body = starts[side]; body < starts[side] + counts[side]; ++body)
      box.include(bodies_[body].box);
    const bool leaf = counts[side] <= 2;
    const std::uint32_t child = leaf ? starts[side] : build_node(starts[side], counts[side]);
    Node& node = nodes_[index];
    for (int axis = 0; axis < 3; ++axis) {
      node.low[side][axis] = box.low[axis];
      node.high[side][axis] = box.high[axis];
    }
    node.child[side] = child;
    node.count[side] = leaf ? counts[side] : 0;
  }
  return index;
}

namespace {

bool meets_facade(const Facade& facade, const Vector3f& world_origin, const Vector3f& world_direction,
                  Hit& nearest) {
  const Vector3f d = facade.frame.turn_in(world_direction);
  if (d.y() <= 1e-6F) return false;
  const Vector3f o = facade.frame.in(world_origin);
  const float t = -o.y() / d.y();
  if (t <= 0 || t >= nearest.range_m) return false;
  const float x = o.x() + t * d.x();
  const float z = o.z() + t * d.z();
  if (x < 0 || x > facade.width || z < facade.bottom || z > facade.height) return false;
  Hit hit;
  hit.range_m = t;
  hit.cos_incidence = d.y();
  hit.reflectivity = facade.reflectivity;
  hit.surface = Surface::wall;

  float x0 = 0, x1 = 0, z0 = 0, z1 = 0;
  bool opening = false;
  bool door = false;
  if (facade.door_x >= 0 && x > facade.door_x && x < facade.door_x + 1.1F && z < 2.15F) {
    opening = door = true;
    x0 = facade.door_x;
    x1 = x0 + 1.1F;
    z0 = facade.bottom;
    z1 = 2.15F;
  } else if (facade.columns > 0 && facade.rows > 0) {
    const int column = static_cast<int>(std::floor((x - facade.first_x) / facade.pitch_x));
    const int row = static_cast<int>(std::floor((z - facade.first_z) / facade.pitch_z));
    if (column >= 0 && column < facade.columns && row >= 0 && row < facade.rows) {
      x0 = facade.first_x + static_cast<float>(column) * facade.pitch_x;
      x1 = x0 + facade.window_width;
      z0 = facade.first_z + static_cast<float>(row) * facade.pitch_z;
      z1 = z0 + facade.window_height;
      const bool beside_door =
          facade.door_x < 0 || row > 0 || x1 < facade.door_x || x0 > facade.door_x + 1.1F;
      opening = x < x1 && z < z1 && beside_door;
    }
  }
  if (opening) {
    const float at_glass = (facade.depth - o.y()) / d.y();
    const float at_side = d.x() > 0 ? (x1 - o.x()) / d.x() : d.x() < 0 ? (x0 - o.x()) / d.x() : at_glass;
    const float at_lintel = d.z() > 0 ? (z1 - o.z()) / d.z() : d.z() < 0 ? (z0 - o.z()) / d.z() : at_glass;
    hit.range_m = std::min(at_glass, std::min(at_side, at_lintel));
    if (hit.range_m >= at_glass) {
      hit.surface = door ? Surface::wall : Surface::glass;
    } else {
      hit.cos_incidence = at_side < at_lintel ? std::abs(d.x()) : std::abs(d.z());
    }
    if (hit.range_m >= nearest.range_m) return false;
  }
  nearest = hit;
  return true;
}

bool meets_thicket(const Thicket& thicket, const Vector3f& world_origin, const Vector3f& world_direction,
                   Hit& nearest) {
  const Vector3f d = thicket.frame.turn_in(world_direction);
  const Vector3f o = thicket.frame.in(world_origin);
  float enter = 0;
  float leave = nearest.range_m;
  if (thicket.ellipsoid) {
    const Vector3f sd = d.cwiseQuotient(thicket.half);
    const Vector3f so = o.cwiseQuotient(thicket.half);
    const float a = sd.squaredNorm();
    const float b = sd.dot(so);
    const float root = b * b - a * (so.squaredNorm() - 1.0F);
    if (root <= 0) return false;
    enter = std::max(enter, (-b - std::sqrt(root)) / a);
    leave = std::min(leave, (-b + std::sqrt(root)) / a);
  } else {
    for (int axis = 0; axis < 3; ++axis) {
      const float safe = std::abs(d[axis]) < 1e-9F ? 1e-9F : d[axis];
      const float one = (-thicket.half[axis] - o[axis]) / safe;
      const float other = (thicket.half[axis] - o[axis]) / safe;
      enter = std::max(enter, std::min(one, other));
      leave = std::min(leave, std::max(one, other));
    }
  }
  const float inverse_cell = 1.0F / thicket.cell_m;
  const auto threshold = static_cast<std::uint32_t>(static_cast<double>(thicket.share) * 4294967295.0);
  for (float t = enter + 0.01F; t < leave; t += thicket.cell_m) {
    const Vector3f p = (o + t * d) * inverse_cell;
    const auto cell = [](float value) {
      return static_cast<std::uint64_t>(static_cast<int>(std::floor(value)) + 4096);
    };
    const std::uint64_t key = (cell(p.x()) << 32) ^ (cell(p.y()) << 16) ^ cell(p.z());
    const std::uint64_t hash = mix(thicket.seed ^ key);
    if (static_cast<std::uint32_t>(hash) > threshold) continue;
    // The leaf is somewhere in the cell, at the same depth for every ray that comes this way.
    const float leaf = t + thicket.cell_m * static_cast<float>(hash >> 40) * 0x1p-24F * 0.5F;
    if (leaf >= leave) return false;
    nearest.range_m = leaf;
    nearest.cos_incidence = 0.7F;
    nearest.reflectivity = thicket.reflectivity;
    nearest.surface = Surface::leaf;
    return true;
  }
  return false;
}

}  // namespace

bool meets(const Pole& pole, const Vector3f& origin, const Vector3f& direction, Hit& nearest) {
  const Vector3f o = origin - pole.foot;
  const float a = direction.head<2>().squaredNorm();
  if (a < 1e-9F) return false;
  const float b = direction.head<2>().dot(o.head<2>());
  const float root = b * b - a * (o.head<2>().squaredNorm() - pole.radius * pole.radius);
  if (root <= 0) return false;
  const float t = (-b - std::sqrt(root)) / a;
  if (t <= 0 || t >= nearest.range_m) return false;
  const float z = o.z() + t * direction.z();
  if (z < 0 || z > pole.height) return false;
  nearest.range_m = t;
  nearest.cos_incidence = std::sqrt(root) / pole.radius / std::max(std::sqrt(a), 1e-6F) * a;
  nearest.reflectivity = pole.reflectivity;
  nearest.surface = Surface::wall;
  return true;
}

bool Scene::meets(const Body& body, const Vector3f& origin, const Vector3f& direction, Hit& nearest) const {
  switch (body.kind) {
    case Kind::facade:
      return meets_facade(facades_[body.index], origin, direction, nearest);
    case Kind::thicket:
      return meets_thicket(thickets_[body.index], origin, direction, nearest);
    case Kind::pole:
      return sim::meets(poles_[body.index], origin, direction, nearest);
    case Kind::convex:
      break;
  }
  const Convex& convex = convexes_[body.index];
  float enter = -std::numeric_limits<float>::max();
  float leave = nearest.range_m;
  float cos_incidence = 1;
  for (int face = 0; face < 6; ++face) {
    const float speed = convex.normals[face].dot(direction);
    const float distance = convex.offsets[face] - convex.normals[face].dot(origin);
    if (std::abs(speed) < 1e-9F) {
      if (distance < 0) return false;
      continue;
    }
    const float t = distance / speed;
    if (speed < 0) {
      if (t > enter) {
        enter = t;
        cos_incidence = -speed;
      }
    } else {
      leave = std::min(leave, t);
    }
    if (enter > leave) return false;
  }
  if (enter <= 0) return false;
  nearest.range_m = enter;
  nearest.cos_incidence = cos_incidence;
  nearest.reflectivity = convex.reflectivity;
  nearest.surface = convex.surface;
  return true;
}

Hit Scene::cast(const Vector3f& origin, const Vector3f& direction, float limit_m) const {
  Hit nearest;
  nearest.range_m = ground.cast(origin, direction, limit_m);
  if (nearest.range_m < limit_m) {
    nearest.surface = Surface::ground;
    nearest.cos_incidence = std::max(0.02F, -direction.z());
    nearest.reflectivity = 0.25F;
  }
  if (nodes_.empty()) return nearest;

  const float d[3] = {direction.x(), direction.y(), direction.z()};
  float inverse[3];
  for (int axis = 0; axis < 3; ++axis) inverse[axis] = 1.0F / (std::abs(d[axis]) < 1e-9F ? 1e-9F : d[axis]);
  const auto entry = [&](const Node& node, int side) {
    float enter = 0;
    float leave = nearest.range_m;
    for (int axis = 0; axis < 3; ++axis) {
      const float one = (node.low[side][axis] - origin[axis]) * inverse[axis];
      const float other = (node.high[side][axis] - origin[axis]) * inverse[axis];
      enter = std::max(enter, std::min(one, other));
      leave = std::min(leave, std::max(one, other));
    }
    return enter <= leave ? enter : std::numeric_limits<float>::max();
  };

  struct Open {
    std::uint32_t node;
    float enter;
  };
  Open stack[64];
  int depth = 0;
  stack[depth++] = {0, 0};
  while (depth > 0) {
    const Open open = stack[--depth];
    if (open.enter >= nearest.range_m) continue;
    const Node& node = nodes_[open.node];
    const float enters[2] = {entry(node, 0), entry(node, 1)};
    const int near = enters[0] <= enters[1] ? 0 : 1;
    // The far child first onto the stack; leaves are tested at once, the near one first.
    for (const int side : {near, 1 - near}) {
      if (node.count[side] == 0 || enters[side] >= nearest.range_m) continue;
      for (std::uint32_t body = node.child[side]; body < node.child[side] + node.count[side]; ++body)
        meets(bodies_[body], origin, direction, nearest);
    }
    for (const int side : {1 - near, near})
      if (node.count[side] == 0 && enters[side] < nearest.range_m && depth < 64)
        stack[depth++] = {node.child[side], enters[side]};
  }
  return nearest;
}

}  // namespace alces::sim
