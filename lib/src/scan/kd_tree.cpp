#include "alces/kd_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <utility>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace alces {
namespace {

// Four lanes at a time: one SSE or NEON register, plain code elsewhere.
typedef float Lanes __attribute__((vector_size(16)));
constexpr std::uint32_t lane_count = 4;

inline Lanes load(const float* lanes) {
  Lanes value;
  std::memcpy(&value, lanes, sizeof(value));
  return value;
}

inline Lanes all(float value) {
  return Lanes{value, value, value, value};
}
inline Lanes smaller(Lanes a, Lanes b) {
  return a < b ? a : b;
}
inline Lanes larger(Lanes a, Lanes b) {
  return a > b ? a : b;
}

// Bit i is set where a[i] < b[i].
inline std::uint32_t less_mask(Lanes a, Lanes b) {
#ifdef __SSE2__
  return static_cast<std::uint32_t>(_mm_movemask_ps(_mm_cmplt_ps(a, b)));
#else
  std::uint32_t mask = 0;
  for (std::uint32_t i = 0; i < lane_count; ++i) mask |= static_cast<std::uint32_t>(a[i] < b[i]) << i;
  return mask;
#endif
}

inline float smallest(Lanes a) {
  return std::min(std::min(a[0], a[1]), std::min(a[2], a[3]));
}

template <typename Item>
std::uint32_t widest_axis(std::span<const Item> items) {
  Lanes low = load(items[0].xyz);
  Lanes high = low;
  for (const Item& item : items) {
    const Lanes p = load(item.xyz);  // the fourth lane, the input index, is not looked at
    low = smaller(p, low);
    high = larger(p, high);
  }
  const Lanes extent = high - low;
  std::uint32_t axis = extent[1] > extent[0] ? 1 : 0;
  if (extent[2] > extent[axis]) axis = 2;
  return axis;
}

}  // namespace

bool KdTree::build(std::span<const Point> points, KdTreeScratch& scratch) {
  size_ = 0;
  if (points.size() > scratch.items_.size() || points.size() > leaves_.size() * leaf_size) return false;
  const auto count = static_cast<std::uint32_t>(points.size());
  const std::span<KdTreeScratch::Item> items = scratch.items_.first(count);
  for (std::uint32_t i = 0; i < count; ++i) items[i] = {{points[i].x, points[i].y, points[i].z}, i};

  struct Range {
    std::uint32_t first_leaf, leaf_count;
  };
  std::array<Range, 32> stack;  // halving 2^20 leaves takes 20
  std::size_t depth = 0;
  if (count > 0) stack[depth++] = {0, leaf_count(count)};
  while (depth > 0) {
    const Range range = stack[--depth];
    if (range.leaf_count == 1) continue;
    // the largest power of two below: so that aligned runs of 4^k leaves are subtrees
    const std::uint32_t left_leaves = std::bit_floor(range.leaf_count - 1);
    const std::uint32_t begin = range.first_leaf * leaf_size;
    const std::uint32_t end = std::min(count, (range.first_leaf + range.leaf_count) * leaf_size);
    const std::uint32_t middle = (range.first_leaf + left_leaves) * leaf_size;
    const std::uint32_t axis =
        widest_axis(std::span<const KdTreeScratch::Item>(items.subspan(begin, end - begin)));
    std::nth_element(items.data() + begin, items.data() + middle, items.data() + end,
                     [axis](const auto& a, const auto& b) { return a.xyz[axis] < b.xyz[axis]; });
    stack[depth++] = {range.first_leaf + left_leaves, range.leaf_count - left_leaves};
    stack[depth++] = {range.first_leaf, left_leaves};
  }

  for (std::uint32_t i = 0; i < leaf_count(count) * leaf_size; ++i) {
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      leaves_[i / leaf_size].xyz[axis][i % leaf_size] =
          i < count ? items[i].xyz[axis] : std::numeric_limits<float>::infinity();
    }
  }
  size_ = count;
  bound_boxes();
  return true;
}

bool KdTree::restore(std::span<const Point> points_in_tree_order) {
  size_ = 0;
  if (points_in_tree_order.size() > leaves_.size() * leaf_size) return false;
  const auto count = static_cast<std::uint32_t>(points_in_tree_order.size());
  for (std::uint32_t i = 0; i < leaf_count(count) * leaf_size; ++i) {
    constexpr float inf = std::numeric_limits<float>::infinity();
    const Point p = i < count ? points_in_tree_order[i] : Point{inf, inf, inf};
    Leaf& leaf = leaves_[i / leaf_size];
    leaf.xyz[0][i % leaf_size] = p.x;
    leaf.xyz[1][i % leaf_size] = p.y;
    leaf.xyz[2][i % leaf_size] = p.z;
  }
  size_ = count;
  bound_boxes();
  return true;
}

void KdTree::bound_boxes() {
  constexpr float inf = std::numeric_limits<float>::infinity();
  levels_ = 0;
  std::uint32_t begin = 0;
  std::uint32_t children = leaf_count(size_);
  while (children > 1) {
    const std::uint32_t parents = (children + arity - 1) / arity;
    for (std::uint32_t i = 0; i < parents * arity; ++i) {
      Node& node = nodes_[begin + i / arity];
      for (std::uint32_t axis = 0; axis < 3; ++axis) {
        float low = inf;
        float high = -inf;
        if (i < children && levels_ == 0) {
          const float* const lanes = leaves_[i].xyz[axis];
          if ((i + 1) * leaf_size <= size_) {
            Lanes least = load(lanes);
            Lanes most = least;
            for (std::uint32_t lane = lane_count; lane < leaf_size; lane += lane_count) {
              least = smaller(load(lanes + lane), least);
              most = larger(load(lanes + lane), most);
            }
            low = smallest(least);
            high = -smallest(-most);
          } else {  // the last leaf's empty lanes hold +Inf
            for (std::uint32_t lane = 0; lane < size_ - i * leaf_size; ++lane) {
              low = std::min(low, lanes[lane]);
              high = std::max(high, lanes[lane]);
            }
          }
        } else if (i < children) {
          const Node& child = nodes_[level_begin_[levels_ - 1] + i];
          low = smallest(load(child.low[axis]));
          high = -smallest(-load(child.high[axis]));
        }
        node.low[axis][i % arity] = low;
        node.high[axis][i % arity] = high;
      }
    }
    level_begin_[levels_++] = begin;
    begin += parents;
    children = parents;
  }
}

// Visits leaves, nearest box first where it matters. `visit(leaf_index)` measures a leaf and returns the
// squared radius from then on. Rounding is monotonic and boxes are measured in the same order of operations
// as points, so that no point is ever nearer than the box around it: the search is exact. Returns, if
// keeps_bound, the squared distance of the nearest box that was left out.
template <bool keeps_bound, typename Visit>
inline float KdTree::search(const Point& query, float radius_m2, Visit&& visit) const {
  float left_out_m2 = std::numeric_limits<float>::infinity();
  if (size_ == 0) return left_out_m2;
  if (levels_ == 0) {
    visit(0U);
    return left_out_m2;
  }
  Lanes children_left_out_m2 = all(left_out_m2);
  struct Pending {
    float box_m2;
    std::uint32_t level;  // of the node; 0: a leaf
    std::uint32_t index;
  };
  std::array<Pending, maximum_levels * arity> stack;
  std::size_t depth = 0;
  Pending at{0, levels_, 0};
  const Lanes qx = all(query.x);
  const Lanes qy = all(query.y);
  const Lanes qz = all(query.z);
  const Lanes zero = all(0);
  for (;;) {
    if (at.level == 0) {
      radius_m2 = visit(at.index);
    } else {
      const Node& node = nodes_[level_begin_[at.level - 1] + at.index];
      const Lanes dx = larger(larger(load(node.low[0]) - qx, qx - load(node.high[0])), zero);
      const Lanes dy = larger(larger(load(node.low[1]) - qy, qy - load(node.high[1])), zero);
      const Lanes dz = larger(larger(load(node.low[2]) - qz, qz - load(node.high[2])), zero);
      const Lanes box_m2 = dx * dx + dy * dy + dz * dz;
      if constexpr (keeps_bound) {
        const Lanes left_out = box_m2 < all(radius_m2) ? all(std::numeric_limits<float>::infinity()) : box_m2;
        children_left_out_m2 = smaller(left_out, children_left_out_m2);
      }
      std::uint32_t within = less_mask(box_m2, all(radius_m2));
      if (within != 0) {
        float child_m2[lane_count];
        std::memcpy(child_m2, &box_m2, sizeof(child_m2));
        const auto first = static_cast<std::uint32_t>(std::countr_zero(within));
        Pending nearest{child_m2[first], at.level - 1, at.index * arity + first};
        for (within &= within - 1; within != 0; within &= within - 1) {
          const auto child = static_cast<std::uint32_t>(std::countr_zero(within));
          Pending other{child_m2[child], at.level - 1, at.index * arity + child};
          if (other.box_m2 < nearest.box_m2) std::swap(other, nearest);
          stack[depth++] = other;
        }
        at = nearest;
        continue;
      }
    }
    for (;;) {
      if (depth == 0)
        return keeps_bound ? std::min(left_out_m2, smallest(children_left_out_m2)) : left_out_m2;
      at = stack[--depth];
      if (at.box_m2 < radius_m2) break;
      if constexpr (keeps_bound) left_out_m2 = std::min(left_out_m2, at.box_m2);
    }
  }
}

template <bool keeps_bound>
inline Neighbor KdTree::find_nearest(const Point& query, float radius_m2, std::uint32_t hint,
                                     float& others_m2) const {
  float nearest_other_m2 = std::numeric_limits<float>::infinity();  // among the points that were measured
  Neighbor best{Neighbor::none, radius_m2};
  if (hint < size_) {
    const Point p = point(hint);
    const float dx = p.x - query.x;
    const float dy = p.y - query.y;
    const float dz = p.z - query.z;
    const float squared_m2 = dx * dx + dy * dy + dz * dz;
    if (squared_m2 < best.squared_m2) best = {hint, squared_m2};
  }
  const Lanes qx = all(query.x);
  const Lanes qy = all(query.y);
  const Lanes qz = all(query.z);
  const float left_out_m2 = search<keeps_bound>(query, best.squared_m2, [&](std::uint32_t leaf_index) {
    const Leaf& leaf = leaves_[leaf_index];
    Lanes squared[leaf_size / lane_count];
    for (std::uint32_t part = 0; part < leaf_size / lane_count; ++part) {
      const Lanes dx = load(&leaf.xyz[0][lane_count * part]) - qx;
      const Lanes dy = load(&leaf.xyz[1][lane_count * part]) - qy;
      const Lanes dz = load(&leaf.xyz[2][lane_count * part]) - qz;
      squared[part] = dx * dx + dy * dy + dz * dz;
    }
    const Lanes least = smaller(smaller(squared[0], squared[1]), smaller(squared[2], squared[3]));
    const float lowest = smallest(least);
    if (lowest < best.squared_m2) {
      if (keeps_bound && best.index != Neighbor::none)
        nearest_other_m2 = std::min(nearest_other_m2, best.squared_m2);
      best.squared_m2 = lowest;
      std::uint32_t lane = 0;
      while (squared[lane / lane_count][lane % lane_count] != lowest) ++lane;
      best.index = leaf_index * leaf_size + lane;
    }
    if constexpr (keeps_bound) {
      if (best.index / leaf_size == leaf_index) {
        const std::uint32_t lane = best.index % leaf_size;
        squared[lane / lane_count][lane % lane_count] = std::numeric_limits<float>::infinity();
      }
      const float other_m2 =
          smallest(smaller(smaller(squared[0], squared[1]), smaller(squared[2], squared[3])));
      nearest_other_m2 = std::min(nearest_other_m2, other_m2);
    }
    return best.squared_m2;
  });
  if constexpr (keeps_bound) others_m2 = std::min(nearest_other_m2, left_out_m2);
  if (best.index == Neighbor::none) return {};
  return best;
}

Neighbor KdTree::nearest(const Point& query, float radius_m2, std::uint32_t hint) const {
  float others_m2 = 0;
  return find_nearest<false>(query, radius_m2, hint, others_m2);
}

Neighbor KdTree::nearest(const Point& query, float radius_m2, std::uint32_t hint, float& others_m2) const {
  return find_nearest<true>(query, radius_m2, hint, others_m2);
}

std::uint32_t KdTree::nearest(const Point& query, float radius_m2, std::span<Neighbor> neighbors) const {
  const auto wanted = static_cast<std::uint32_t>(std::min<std::size_t>(neighbors.size(), maximum_neighbors));
  if (wanted == 0) return 0;
  std::uint32_t found = 0;
  float limit_m2 = radius_m2;
  const Lanes qx = all(query.x);
  const Lanes qy = all(query.y);
  const Lanes qz = all(query.z);
  search<false>(query, radius_m2, [&](std::uint32_t leaf_index) {
    const Leaf& leaf = leaves_[leaf_index];
    for (std::uint32_t part = 0; part < leaf_size / lane_count; ++part) {
      const Lanes dx = load(&leaf.xyz[0][lane_count * part]) - qx;
      const Lanes dy = load(&leaf.xyz[1][lane_count * part]) - qy;
      const Lanes dz = load(&leaf.xyz[2][lane_count * part]) - qz;
      const Lanes squared = dx * dx + dy * dy + dz * dz;
      for (std::uint32_t near = less_mask(squared, all(limit_m2)); near != 0; near &= near - 1) {
        const auto lane = static_cast<std::uint32_t>(std::countr_zero(near));
        const float squared_m2 = squared[lane];
        if (!(squared_m2 < limit_m2)) continue;  // the limit fell since
        std::uint32_t at = found < wanted ? found++ : wanted - 1;
        for (; at > 0 && neighbors[at - 1].squared_m2 > squared_m2; --at) neighbors[at] = neighbors[at - 1];
        neighbors[at] = {leaf_index * leaf_size + part * lane_count + lane, squared_m2};
        if (found == wanted) limit_m2 = neighbors[wanted - 1].squared_m2;
      }
    }
    return limit_m2;
  });
  return found;
}

}  // namespace alces
