#include "cloud_encoding.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "alces_platform/parallel.h"
#include "even_choice.h"
#include "packed_bytes.h"

namespace alces::offline {
namespace {

constexpr std::size_t planes = 8;                           ///< without that of the intensity
constexpr std::size_t chunk_points = std::size_t{1} << 17;  // a megabyte inflated: a browser stays responsive
constexpr double most_steps = 65535;

struct Level {
  std::vector<CloudNode> nodes;
  std::vector<EncodedChunk> chunks;
  std::size_t text_bytes = 0;
};

std::uint16_t zigzag(std::uint16_t value, std::uint16_t before) {
  const auto difference = static_cast<std::int16_t>(static_cast<std::uint16_t>(value - before));
  return static_cast<std::uint16_t>(difference * 2 ^ difference >> 15);
}

struct Form {
  double step_m = 0;
  std::uint32_t scans_a_number = 1;
  bool has_intensity = false;
};

/// The points of `node`, or `fraction` of them, appended to the planes of a chunk of `total` points.
void encode_node(const CloudOctree& tree, const CloudNode& node, std::span<const CloudPoint> points,
                 const Form& form, std::span<std::uint8_t> bytes, std::size_t total, std::size_t at) {
  std::vector<CloudPoint> ordered(points.begin(), points.end());
  std::stable_sort(ordered.begin(), ordered.end(),
                   [](const CloudPoint& a, const CloudPoint& b) { return a.scan < b.scan; });
  const Eigen::Vector3d origin_m = tree.origin_m_of(node);
  const double step = step_m_of(tree.side_m_of(node.level), form.step_m);
  std::array<std::uint16_t, 4> before{};
  for (const CloudPoint& point : ordered) {
    const auto steps = [&](float coordinate_m, double from_m) {
      const double rounded = std::round((static_cast<double>(coordinate_m) - from_m) / step);
      return static_cast<std::uint16_t>(std::clamp(rounded, 0.0, most_steps));
    };
    const std::array<std::uint16_t, 4> values = {
        steps(point.position.x, origin_m.x()), steps(point.position.y, origin_m.y()),
        steps(point.position.z, origin_m.z()), static_cast<std::uint16_t>(point.scan / form.scans_a_number)};
    for (std::size_t k = 0; k < values.size(); ++k) {
      const std::uint16_t coded = zigzag(values.at(k), before.at(k));
      bytes[2 * k * total + at] = static_cast<std::uint8_t>(coded & 0xFF);
      bytes[(2 * k + 1) * total + at] = static_cast<std::uint8_t>(coded >> 8);
    }
    if (form.has_intensity) bytes[planes * total + at] = point.intensity;
    before = values;
    ++at;
  }
}

Level encode_level(const CloudOctree& tree, std::span<const CloudNode> nodes, const Form& form,
                   double fraction) {
  struct Job {
    std::size_t first_node = 0;  // of level.nodes
    std::size_t node_count = 0;
    std::size_t points = 0;
  };
  Level level;
  std::vector<std::vector<CloudPoint>> thinned;  // of level.nodes; empty: all of the node's
  std::vector<Job> jobs;
  for (const CloudNode& node : nodes) {
    CloudNode kept = node;
    if (fraction < 1) {
      std::vector<CloudPoint> some;
      for (std::size_t i = node.first; i < node.first + node.count; ++i)
        if (is_chosen(i, fraction)) some.push_back(tree.points[i]);
      if (some.empty()) continue;
      kept.count = some.size();
      thinned.push_back(std::move(some));
    }
    if (jobs.empty() || jobs.back().points + kept.count > chunk_points)
      jobs.push_back({level.nodes.size(), 0, 0});
    ++jobs.back().node_count;
    jobs.back().points += kept.count;
    level.nodes.push_back(kept);
  }
  level.chunks.resize(jobs.size());
  for_each_index(jobs.size(), [&](std::size_t j) {
    const Job& job = jobs[j];
    std::vector<std::uint8_t> bytes((form.has_intensity ? planes + 1 : planes) * job.points);
    std::size_t at = 0;
    for (std::size_t n = job.first_node; n < job.first_node + job.node_count; ++n) {
      const CloudNode& node = level.nodes[n];
      const std::span<const CloudPoint> points = fraction < 1
                                                     ? std::span<const CloudPoint>(thinned[n])
                                                     : std::span(tree.points).subspan(node.first, node.count);
      encode_node(tree, node, points, form, bytes, job.points, at);
      at += node.count;
    }
    level.chunks[j] = {job.node_count, job.points, base64(deflate_bytes(bytes))};
  });
  for (const EncodedChunk& chunk : level.chunks) level.text_bytes += chunk.text.size();
  return level;
}

}  // namespace

double step_m_of(double node_side_m, double step_m) {
  return std::max(step_m, node_side_m / most_steps);
}

EncodedCloud encode_cloud(const CloudOctree& tree, std::size_t scan_count, double step_m,
                          std::size_t budget_bytes, bool has_intensity) {
  EncodedCloud cloud;
  cloud.step_m = step_m;
  cloud.scans_a_number = static_cast<std::uint32_t>((scan_count + 65535) / 65536);
  cloud.scans_a_number = std::max(cloud.scans_a_number, 1U);
  cloud.has_intensity = has_intensity;
  const Form form{step_m, cloud.scans_a_number, has_intensity};
  const auto append = [&cloud](Level level) {
    for (CloudNode& node : level.nodes) {
      node.first = cloud.points;
      cloud.points += node.count;
      cloud.nodes.push_back(node);
    }
    std::move(level.chunks.begin(), level.chunks.end(), std::back_inserter(cloud.chunks));
    cloud.text_bytes += level.text_bytes;
  };
  for (std::size_t begin = 0; begin < tree.nodes.size();) {
    std::size_t end = begin;
    while (end < tree.nodes.size() && tree.nodes[end].level == tree.nodes[begin].level) ++end;
    const std::span<const CloudNode> nodes = std::span(tree.nodes).subspan(begin, end - begin);
    begin = end;
    const std::size_t left_bytes = budget_bytes - cloud.text_bytes;
    Level level = encode_level(tree, nodes, form, 1);
    if (level.text_bytes <= left_bytes) {
      append(std::move(level));
      continue;
    }
    // Fewer points deflate a little worse each: a second and third try are smaller.
    double fraction = 0.97 * static_cast<double>(left_bytes) / static_cast<double>(level.text_bytes);
    for (; fraction > 0.001; fraction *= 0.93) {
      level = encode_level(tree, nodes, form, fraction);
      if (level.text_bytes > left_bytes) continue;
      append(std::move(level));
      break;
    }
    break;
  }
  return cloud;
}

}  // namespace alces::offline
