#include "alces/kd_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "alces_platform/sim/random.h"
#include "support/in_block.h"
#include "support/plain_nearest.h"

using namespace alces;
using alces::sim::Random;
using alces::test::InBlock;
using alces::test::plain_nearest;
using alces::test::plain_squared_m2;

namespace {

constexpr float inf = std::numeric_limits<float>::infinity();

struct Tree {
  explicit Tree(const std::vector<Point>& points)
      : scratch(static_cast<std::uint32_t>(points.size())), tree(static_cast<std::uint32_t>(points.size())) {
    is_built = tree->build(points, *scratch);
  }
  InBlock<KdTreeScratch> scratch;
  InBlock<KdTree> tree;
  bool is_built = false;
};

float number(Random& random, double low, double high) {
  return static_cast<float>(random.uniform(low, high));
}

Point in_box(Random& random, double reach_m) {
  return {number(random, -reach_m, reach_m), number(random, -reach_m, reach_m),
          number(random, -reach_m, reach_m)};
}

struct NamedSet {
  std::string name;
  std::vector<Point> points;
};

std::vector<NamedSet> sets_of(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<NamedSet> sets = {{"random", {}},    {"planar", {}},    {"oblique plane", {}},
                                {"collinear", {}}, {"duplicate", {}}, {"clustered", {}},
                                {"far away", {}},  {"lattice", {}}};
  for (std::size_t i = 0; i < count; ++i) {
    const Point p = in_box(random, 10);
    sets[0].points.push_back(p);
    sets[1].points.push_back({p.x, p.y, 2});
    sets[2].points.push_back({p.x, p.y, 0.3F * p.x - 0.7F * p.y});
    sets[3].points.push_back({p.x, 2 * p.x, -p.x});
    sets[4].points.push_back(i % 3 == 0 ? Point{1, 1, 1} : Point{-2, 0.5F, 3});
    const auto cluster = static_cast<float>(i % 5);
    sets[5].points.push_back({5 * cluster + 0.001F * p.x, 0.001F * p.y, cluster + 0.001F * p.z});
    sets[6].points.push_back({1e4F + p.x, -1e4F + p.y, 1e4F + p.z});
    sets[7].points.push_back(
        {static_cast<float>(i % 7), static_cast<float>(i / 7 % 7), static_cast<float>(i / 49)});
  }
  return sets;
}

std::vector<Point> queries_for(const std::vector<Point>& points, std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<Point> queries = {{0, 0, 0}, {1e4F, 1e4F, 1e4F}, {-0.0F, 3, 1e-30F}};
  for (std::size_t i = 0; i < count && !points.empty(); ++i) {
    const Point& near = points[static_cast<std::size_t>(random.next() % points.size())];
    const float off = std::array{0.0F, 1e-3F, 0.3F, 5.0F}[i % 4];
    const Point way = in_box(random, 1);
    queries.push_back({near.x + off * way.x, near.y + off * way.y, near.z + off * way.z});
  }
  return queries;
}

bool same_bits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

// How many answers differ from brute force.
std::size_t wrong_answers(const KdTree& tree, const std::vector<Point>& points,
                          const std::vector<Point>& queries) {
  std::size_t wrong = 0;
  for (const Point& query : queries) {
    for (const float radius_m2 : {inf, 4.0F, 0.01F}) {
      const std::vector<float> expected = plain_nearest(points, query, radius_m2, 12);
      const Neighbor nearest = tree.nearest(query, radius_m2);
      if (expected.empty()) {
        if (nearest.index != Neighbor::none || nearest.squared_m2 != inf) ++wrong;
      } else if (!same_bits(nearest.squared_m2, expected[0]) || nearest.index >= tree.size() ||
                 !same_bits(plain_squared_m2(tree.point(nearest.index), query), expected[0])) {
        ++wrong;
      }
      std::array<Neighbor, 12> found;
      const std::uint32_t count = tree.nearest(query, radius_m2, found);
      if (count != expected.size()) {
        ++wrong;
        continue;
      }
      std::set<std::uint32_t> indices;
      for (std::uint32_t i = 0; i < count; ++i) {
        indices.insert(found[i].index);
        if (!same_bits(found[i].squared_m2, expected[i]) || found[i].index >= tree.size() ||
            !same_bits(plain_squared_m2(tree.point(found[i].index), query), expected[i])) {
          ++wrong;
        }
      }
      if (indices.size() != count) ++wrong;
    }
  }
  return wrong;
}

}  // namespace

TEST_CASE("nearest neighbours are those of brute force, to the last bit, on sets of every shape and size") {
  for (const std::size_t count :
       {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{15}, std::size_t{16}, std::size_t{17},
        std::size_t{31}, std::size_t{33}, std::size_t{63}, std::size_t{64}, std::size_t{65}, std::size_t{80},
        std::size_t{255}, std::size_t{257}, std::size_t{1024}, std::size_t{1025}, std::size_t{3000}}) {
    for (const NamedSet& set : sets_of(count, 100 + count)) {
      const Tree tree(set.points);
      REQUIRE(tree.is_built);
      REQUIRE(tree.tree->size() == count);
      CAPTURE(set.name, count);
      CHECK(wrong_answers(*tree.tree, set.points, queries_for(set.points, 60, count)) == 0);
    }
  }
}

TEST_CASE("a tree holds the points it was built from, and says where each stood") {
  for (const NamedSet& set : sets_of(777, 5)) {
    const Tree tree(set.points);
    std::set<std::uint32_t> inputs;
    std::size_t wrong = 0;
    for (std::uint32_t i = 0; i < tree.tree->size(); ++i) {
      const std::uint32_t input = tree.scratch->input_of(i);
      inputs.insert(input);
      const Point p = tree.tree->point(i);
      if (input >= 777 || std::memcmp(&p, &set.points[input], sizeof p) != 0) ++wrong;
    }
    CAPTURE(set.name);
    CHECK(wrong == 0);
    CHECK(inputs.size() == 777);
  }
}

TEST_CASE("neighbours lie nearer than the radius, not at it") {
  const std::vector<Point> points = {{1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  const Tree tree(points);
  std::array<Neighbor, 8> found;
  CHECK(tree.tree->nearest({0, 0, 0}, 1).index == Neighbor::none);
  CHECK(tree.tree->nearest({0, 0, 0}, std::nextafter(1.0F, 2.0F)).squared_m2 == 1);
  CHECK(tree.tree->nearest({0, 0, 0}, 4, found) == 1);
  CHECK(tree.tree->nearest({0, 0, 0}, 9.5F, found) == 3);
  CHECK(found[2].squared_m2 == 9);
  CHECK(tree.tree->nearest({1, 0, 0}, 0).index == Neighbor::none);
  CHECK(tree.tree->nearest({1, 0, 0}, 0, found) == 0);
  CHECK(tree.tree->nearest({1, 0, 0}, -1).index == Neighbor::none);
}

TEST_CASE("a query that is no number finds nothing") {
  const std::vector<Point> points = sets_of(500, 6)[0].points;
  const Tree tree(points);
  std::array<Neighbor, 8> found;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Point& query : {Point{nan, 0, 0}, Point{0, nan, nan}, Point{inf, 0, 0}, Point{1e30F, 0, 0}}) {
    CHECK(tree.tree->nearest(query, inf).index == Neighbor::none);
    CHECK(tree.tree->nearest(query, inf, found) == 0);
  }
  CHECK(tree.tree->nearest({0, 0, 0}, nan).index == Neighbor::none);
}

TEST_CASE("a point of the tree finds itself first") {
  const std::vector<Point> points = sets_of(400, 7)[0].points;
  const Tree tree(points);
  std::array<Neighbor, 10> found;
  std::size_t wrong = 0;
  for (std::uint32_t i = 0; i < tree.tree->size(); ++i) {
    if (tree.tree->nearest(tree.tree->point(i), 1e3F, found) != 10) ++wrong;
    if (found[0].index != i || found[0].squared_m2 != 0) ++wrong;
  }
  CHECK(wrong == 0);
}

TEST_CASE("no more neighbours are given than asked for, nor than the tree has") {
  const std::vector<Point> points = sets_of(100, 8)[0].points;
  const Tree tree(points);
  std::array<Neighbor, 64> found;
  CHECK(tree.tree->nearest({0, 0, 0}, inf, std::span(found).first(0)) == 0);
  CHECK(tree.tree->nearest({0, 0, 0}, inf, std::span(found).first(1)) == 1);
  CHECK(tree.tree->nearest({0, 0, 0}, inf, found) == KdTree::maximum_neighbors);
  const Tree small({{1, 2, 3}, {4, 5, 6}});
  CHECK(small.tree->nearest({0, 0, 0}, inf, found) == 2);
}

TEST_CASE("a hint, good, bad or none at all, never changes the distance") {
  for (const NamedSet& set : sets_of(600, 9)) {
    const Tree tree(set.points);
    Random random(3);
    std::size_t wrong = 0;
    for (const Point& query : queries_for(set.points, 200, 10)) {
      for (const float radius_m2 : {inf, 1.0F, 1e-4F}) {
        const Neighbor plain = tree.tree->nearest(query, radius_m2);
        for (const std::uint32_t hint : {static_cast<std::uint32_t>(random.next() % 600), plain.index, 0U,
                                         599U, 600U, Neighbor::none - 1, 0x80000000U}) {
          const Neighbor hinted = tree.tree->nearest(query, radius_m2, hint);
          if (!same_bits(hinted.squared_m2, plain.squared_m2)) ++wrong;
          if ((hinted.index == Neighbor::none) != (plain.index == Neighbor::none)) ++wrong;
        }
      }
    }
    CAPTURE(set.name);
    CHECK(wrong == 0);
  }
}

TEST_CASE("no other point is nearer than a search says, and what it says is of use") {
  for (const std::size_t count :
       {std::size_t{1}, std::size_t{2}, std::size_t{16}, std::size_t{17}, std::size_t{600}}) {
    for (const NamedSet& set : sets_of(count, 17 + count)) {
      const Tree tree(set.points);
      Random random(18);
      std::size_t wrong = 0;
      std::size_t asked = 0;
      std::size_t kept_half = 0;  // of the way to the second nearest
      for (const Point& query : queries_for(set.points, 200, 19)) {
        for (const float radius_m2 : {inf, 1.0F, 1e-4F}) {
          const Neighbor plain = tree.tree->nearest(query, radius_m2);
          for (const std::uint32_t hint :
               {Neighbor::none, plain.index, static_cast<std::uint32_t>(random.next() % count)}) {
            float others_m2 = -1;
            const Neighbor nearest = tree.tree->nearest(query, radius_m2, hint, others_m2);
            if (!same_bits(nearest.squared_m2, plain.squared_m2)) ++wrong;
            float second_m2 = inf;
            for (std::uint32_t i = 0; i < count; ++i) {
              if (i == nearest.index) continue;
              second_m2 = std::min(second_m2, plain_squared_m2(tree.tree->point(i), query));
            }
            const bool is_found = nearest.index != Neighbor::none;
            if (!(others_m2 <= second_m2)) ++wrong;
            if (!(others_m2 >= (is_found ? nearest.squared_m2 : std::min(radius_m2, second_m2)))) ++wrong;
            if (!is_found || second_m2 == inf) continue;
            ++asked;
            const float nearest_m = std::sqrt(nearest.squared_m2);
            if (2 * (std::sqrt(others_m2) - nearest_m) >= std::sqrt(second_m2) - nearest_m) ++kept_half;
          }
        }
      }
      CAPTURE(set.name, count, asked, kept_half);
      CHECK(wrong == 0);
      CHECK(2 * kept_half >= asked);
    }
  }
}

TEST_CASE("a tree restored from its own order gives the same answers, index for index") {
  for (const std::size_t count :
       {std::size_t{0}, std::size_t{1}, std::size_t{16}, std::size_t{17}, std::size_t{1000}}) {
    for (const NamedSet& set : sets_of(count, 11)) {
      const Tree built(set.points);
      std::vector<Point> in_order;
      for (std::uint32_t i = 0; i < built.tree->size(); ++i) in_order.push_back(built.tree->point(i));
      InBlock<KdTree> restored(static_cast<std::uint32_t>(count));
      REQUIRE(restored->restore(in_order));
      REQUIRE(restored->size() == count);
      std::size_t wrong = 0;
      for (const Point& query : queries_for(set.points, 100, 12)) {
        const Neighbor a = built.tree->nearest(query, 3.0F);
        const Neighbor b = restored->nearest(query, 3.0F);
        if (a.index != b.index || !same_bits(a.squared_m2, b.squared_m2)) ++wrong;
        std::array<Neighbor, 10> many_a;
        std::array<Neighbor, 10> many_b;
        const std::uint32_t found = built.tree->nearest(query, 3.0F, many_a);
        if (restored->nearest(query, 3.0F, many_b) != found) ++wrong;
        for (std::uint32_t i = 0; i < found; ++i) {
          if (many_a[i].index != many_b[i].index) ++wrong;
        }
      }
      CAPTURE(set.name, count);
      CHECK(wrong == 0);
    }
  }
}

TEST_CASE("more points than fit are refused, and the tree is empty then") {
  const std::vector<Point> points = sets_of(100, 13)[0].points;
  InBlock<KdTreeScratch> scratch(64U);
  InBlock<KdTree> tree(64U);
  REQUIRE(tree->build(std::span(points).first(64), *scratch));
  CHECK_FALSE(tree->build(std::span(points).first(65), *scratch));
  CHECK(tree->size() == 0);
  CHECK(tree->nearest({0, 0, 0}, inf).index == Neighbor::none);
  REQUIRE(tree->restore(std::span(points).first(64)));
  CHECK_FALSE(tree->restore(std::span(points).first(65)));
  CHECK(tree->size() == 0);

  InBlock<KdTreeScratch> small_scratch(10U);
  CHECK_FALSE(tree->build(std::span(points).first(11), *small_scratch));
  CHECK(tree->build(std::span(points).first(10), *small_scratch));
  CHECK(tree->size() == 10);

  KdTree nothing;
  CHECK_FALSE(nothing.build(points, *scratch));
  CHECK(nothing.build({}, *scratch));
  CHECK(nothing.nearest({0, 0, 0}, inf).index == Neighbor::none);
}

TEST_CASE("a tree built anew forgets its earlier points") {
  const std::vector<Point> many = sets_of(500, 14)[0].points;
  const std::vector<Point> few = {{100, 100, 100}, {101, 100, 100}};
  InBlock<KdTreeScratch> scratch(500U);
  InBlock<KdTree> tree(500U);
  REQUIRE(tree->build(many, *scratch));
  REQUIRE(tree->build(few, *scratch));
  CHECK(tree->nearest(many[7], inf).squared_m2 == plain_nearest(few, many[7], inf, 1)[0]);
  REQUIRE(tree->build(many, *scratch));
  CHECK(wrong_answers(*tree, many, queries_for(many, 50, 15)) == 0);
}
