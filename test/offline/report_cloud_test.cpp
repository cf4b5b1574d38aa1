// What a report's page gets of the points: levels of detail, rounding, size.
#include <zlib.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <tuple>

#include "offline/report/cloud_encoding.h"
#include "offline/report/packed_bytes.h"

namespace alces::offline {
namespace {

/// Walls and ground of a block of houses, 200 m by 120 m, seen by `scans` scans.
std::vector<CloudPoint> street(std::size_t count, std::uint32_t scans) {
  std::mt19937 random(7);
  const auto uniform = [&random](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  std::vector<CloudPoint> points(count);
  for (CloudPoint& point : points) {
    const double x = uniform(-40, 160);
    const double y = uniform(-60, 60);
    const bool is_wall = uniform(0, 1) < 0.5;
    const double wall_y = 20 * std::round(y / 20) + uniform(-0.02, 0.02);
    point.position = {static_cast<float>(x), static_cast<float>(is_wall ? wall_y : y),
                      static_cast<float>(is_wall ? uniform(0, 12) : uniform(-0.03, 0.03))};
    point.intensity = static_cast<std::uint8_t>(random() >> 24);
    point.scan = std::min(static_cast<std::uint32_t>((x + 40) / 200 * scans), scans - 1);
  }
  return points;
}

std::vector<std::uint8_t> from_base64(std::string_view text) {
  std::vector<std::uint8_t> bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    const std::uint32_t digit = c >= 'a'   ? static_cast<std::uint32_t>(c - 'a' + 26)
                                : c >= 'A' ? static_cast<std::uint32_t>(c - 'A')
                                : c >= '0' ? static_cast<std::uint32_t>(c - '0' + 52)
                                : c == '+' ? 62U
                                           : 63U;
    bits = bits << 6 | digit;
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<std::uint8_t>(bits >> count & 0xFF));
  }
  return bytes;
}

std::vector<std::uint8_t> inflated(std::string_view text, std::size_t size) {
  const std::vector<std::uint8_t> packed = from_base64(text);
  std::vector<std::uint8_t> bytes(size);
  uLongf length = size;
  REQUIRE(uncompress(bytes.data(), &length, packed.data(), packed.size()) == Z_OK);
  REQUIRE(length == size);
  return bytes;
}

struct Decoded {
  Eigen::Vector3d position_m;
  std::uint32_t scan = 0;
  double step_m = 0;
  std::uint8_t intensity = 0;
};

/// As cloud_encoding.h describes it, plainly.
std::vector<Decoded> decode(const CloudOctree& tree, const EncodedCloud& cloud) {
  std::vector<Decoded> points;
  std::size_t next_node = 0;
  for (const EncodedChunk& chunk : cloud.chunks) {
    const std::vector<std::uint8_t> bytes =
        inflated(chunk.text, (cloud.has_intensity ? 9 : 8) * chunk.points);
    std::size_t at = 0;
    for (std::size_t n = 0; n < chunk.nodes; ++n, ++next_node) {
      const CloudNode& node = cloud.nodes.at(next_node);
      const double step_m = step_m_of(tree.side_m_of(node.level), cloud.step_m);
      std::array<std::uint16_t, 4> values{};
      for (std::size_t i = 0; i < node.count; ++i, ++at) {
        for (std::size_t k = 0; k < 4; ++k) {
          const int coded = bytes[2 * k * chunk.points + at] | bytes[(2 * k + 1) * chunk.points + at] << 8;
          const int difference = (coded >> 1) ^ -(coded & 1);
          values.at(k) = static_cast<std::uint16_t>(values.at(k) + difference);
        }
        const Eigen::Vector3d steps(values[0], values[1], values[2]);
        const std::uint8_t intensity = cloud.has_intensity ? bytes[8 * chunk.points + at] : std::uint8_t{0};
        points.push_back({tree.origin_m_of(node) + step_m * steps, values[3], step_m, intensity});
      }
    }
    REQUIRE(at == chunk.points);
  }
  REQUIRE(next_node == cloud.nodes.size());
  return points;
}

std::uint64_t cell_key(const CloudOctree& tree, const CloudNode& node, const Point& point) {
  const Eigen::Vector3d at =
      (Eigen::Vector3f(point.x, point.y, point.z).cast<double>() - tree.origin_m_of(node)) *
      (CloudOctree::cells_a_side / tree.side_m_of(node.level));
  const auto cell = [&](Eigen::Index axis) {
    return static_cast<std::uint64_t>(std::floor(at(axis) + 1e-9));
  };
  return cell(0) | cell(1) << 20 | cell(2) << 40;
}

}  // namespace

TEST_CASE("an octree holds every point once, in the node that it lies in") {
  const std::vector<CloudPoint> points = street(40'000, 30);
  const CloudOctree tree = build_cloud_octree(points);
  const auto sorted = [](std::vector<CloudPoint> some) {
    std::sort(some.begin(), some.end(), [](const CloudPoint& a, const CloudPoint& b) {
      return std::tie(a.position.x, a.position.y, a.position.z) <
             std::tie(b.position.x, b.position.y, b.position.z);
    });
    return some;
  };
  const std::vector<CloudPoint> in = sorted(points);
  const std::vector<CloudPoint> out = sorted(tree.points);
  REQUIRE(in.size() == out.size());
  for (std::size_t i = 0; i < in.size(); ++i) {
    REQUIRE(in[i].position.x == out[i].position.x);
    REQUIRE(in[i].scan == out[i].scan);
  }
  std::size_t next = 0;
  std::uint32_t level = 0;
  for (const CloudNode& node : tree.nodes) {
    REQUIRE(node.first == next);
    REQUIRE(node.level >= level);
    level = node.level;
    next += node.count;
    const Eigen::Vector3d low = tree.origin_m_of(node);
    const double side_m = tree.side_m_of(node.level);
    for (std::size_t i = node.first; i < node.first + node.count; ++i) {
      const Point& p = tree.points[i].position;
      const Eigen::Vector3d inside = Eigen::Vector3f(p.x, p.y, p.z).cast<double>() - low;
      REQUIRE(inside.minCoeff() >= -1e-4);
      REQUIRE(inside.maxCoeff() <= side_m + 1e-4);
    }
  }
  CHECK(next == tree.points.size());
  CHECK(level >= 2);
}

TEST_CASE("the first level takes at most one point a cell of its grid, and one from every occupied cell") {
  const std::vector<CloudPoint> points = street(40'000, 30);
  const CloudOctree tree = build_cloud_octree(points, 0.01, 1);  // no node joins its parent
  const CloudNode& root = tree.nodes.front();
  REQUIRE(root.level == 0);
  std::set<std::uint64_t> taken;
  for (std::size_t i = 0; i < root.count; ++i)
    REQUIRE(taken.insert(cell_key(tree, root, tree.points[i].position)).second);
  std::set<std::uint64_t> occupied;
  for (const CloudPoint& point : points) occupied.insert(cell_key(tree, root, point.position));
  // a point on the very border of two cells may be counted to the other one here
  CHECK(std::abs(static_cast<double>(taken.size()) - static_cast<double>(occupied.size())) <= 3);
}

TEST_CASE("decoded points are within half a step an axis, and keep their scans and intensities") {
  const CloudOctree tree = build_cloud_octree(street(60'000, 900));
  for (const double step_m : {0.001, 0.005}) {
    constexpr std::size_t no_limit = std::numeric_limits<std::size_t>::max();
    const EncodedCloud cloud = encode_cloud(tree, 900, step_m, no_limit, true);
    REQUIRE(cloud.points == tree.points.size());
    const std::vector<Decoded> decoded = decode(tree, cloud);
    REQUIRE(decoded.size() == tree.points.size());
    // Within a node the order is that of the scans: sorted in the same way they pair up.
    double worst_steps = 0;
    std::size_t begin = 0;
    for (const CloudNode& node : cloud.nodes) {
      std::vector<CloudPoint> original(tree.points.begin() + static_cast<std::ptrdiff_t>(begin),
                                       tree.points.begin() + static_cast<std::ptrdiff_t>(begin + node.count));
      std::stable_sort(original.begin(), original.end(),
                       [](const CloudPoint& a, const CloudPoint& b) { return a.scan < b.scan; });
      for (std::size_t i = 0; i < node.count; ++i) {
        const Decoded& d = decoded[begin + i];
        const Point& p = original[i].position;
        REQUIRE(d.scan == original[i].scan);
        REQUIRE(d.intensity == original[i].intensity);
        const Eigen::Vector3d error = d.position_m - Eigen::Vector3f(p.x, p.y, p.z).cast<double>();
        worst_steps = std::max(worst_steps, error.cwiseAbs().maxCoeff() / d.step_m);
        REQUIRE(d.step_m <= std::max(step_m, tree.side_m / 65535));
      }
      begin += node.count;
    }
    CHECK(worst_steps <= 0.5 + 1e-3);
    CHECK(worst_steps > 0.3);
  }
}

TEST_CASE("the budget of bytes is kept, nearly used up, and the coarse levels stay whole") {
  const CloudOctree tree = build_cloud_octree(street(200'000, 100));
  const EncodedCloud all = encode_cloud(tree, 100, 0.005);
  const std::size_t budget = all.text_bytes / 3;
  const EncodedCloud some = encode_cloud(tree, 100, 0.005, budget);
  CHECK(some.text_bytes <= budget);
  CHECK(some.text_bytes > budget * 85 / 100);
  CHECK(some.points < all.points);
  REQUIRE(some.nodes.front().level == 0);
  CHECK(some.nodes.front().count == all.nodes.front().count);
  CHECK(decode(tree, some).size() == some.points);
}

TEST_CASE("encoding the same cloud twice gives the same bytes") {
  const EncodedCloud a = encode_cloud(build_cloud_octree(street(50'000, 100)), 100, 0.005, 100'000);
  const EncodedCloud b = encode_cloud(build_cloud_octree(street(50'000, 100)), 100, 0.005, 100'000);
  REQUIRE(a.chunks.size() == b.chunks.size());
  for (std::size_t i = 0; i < a.chunks.size(); ++i) REQUIRE(a.chunks[i].text == b.chunks[i].text);
}

TEST_CASE("clouds of one point, of equal points and of none are clouds") {
  CHECK(build_cloud_octree({}).nodes.empty());
  CHECK(encode_cloud(CloudOctree{}, 1, 0.005).points == 0);
  for (const std::size_t count : {std::size_t{1}, std::size_t{5000}}) {
    const CloudOctree tree = build_cloud_octree(std::vector<CloudPoint>(count, {{1, 2, 3}, 0}));
    const std::vector<Decoded> decoded = decode(tree, encode_cloud(tree, 1, 0.005));
    REQUIRE(decoded.size() == count);
    CHECK((decoded.back().position_m - Eigen::Vector3d(1, 2, 3)).norm() < 0.005);
  }
}

TEST_CASE("more scans than 16 bits count share numbers") {
  std::vector<CloudPoint> points = street(20'000, 1);
  for (std::size_t i = 0; i < points.size(); ++i) points[i].scan = static_cast<std::uint32_t>(i * 10);
  const CloudOctree tree = build_cloud_octree(points);
  const EncodedCloud cloud = encode_cloud(tree, 200'000, 0.005);
  CHECK(cloud.scans_a_number == 4);
  std::uint32_t largest = 0;
  for (const Decoded& point : decode(tree, cloud)) largest = std::max(largest, point.scan);
  CHECK(largest == 199'990 / 4);
}

TEST_CASE("base64 is RFC 4648's") {
  CHECK(base64("").empty());
  CHECK(base64("f") == "Zg==");
  CHECK(base64("fo") == "Zm8=");
  CHECK(base64("foobar") == "Zm9vYmFy");
  CHECK(base64(std::string("\xFF\xEF\x00", 3)) == "/+8A");
}

}  // namespace alces::offline
