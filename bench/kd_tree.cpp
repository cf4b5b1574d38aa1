// Our k-d tree beside nanoflann's (leaf size 10, float): building, the nearest neighbour, the ten nearest, on
// the reduced scans of a drive. Queries are the points of the next scan, placed by odometry.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>
#include <span>
#include <stdexcept>

#include "alces/kd_tree.h"
#include "support.h"
#include "support/in_block.h"

#pragma GCC diagnostic ignored "-Wnull-dereference"  // GCC 12 inside std::vector::resize of nanoflann

namespace {

using namespace alces;
using namespace alces::bench;

constexpr std::uint32_t many = 10;

/// nanoflann's view of the points; the names are its.
struct Cloud {
  std::span<const Point> points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t index, std::size_t axis) const {
    const Point& point = points[index];
    return axis == 0 ? point.x : axis == 1 ? point.y : point.z;
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using Peer =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>, Cloud, 3, std::uint32_t>;

struct Times {
  Samples build_ms;
  Samples one_us;  ///< a query
  Samples many_us;
};

struct Answers {
  std::vector<float> one_m2;   ///< infinity: none within the radius
  std::vector<float> many_m2;  ///< `many` a query, infinity beyond the last
};

void clear(Answers& answers, std::size_t queries) {
  answers.one_m2.assign(queries, std::numeric_limits<float>::infinity());
  answers.many_m2.assign(queries * many, std::numeric_limits<float>::infinity());
}

double us_each(const Stopwatch& watch, std::size_t queries) {
  return watch.ms() * 1000 / static_cast<double>(queries);
}

void measure_ours(KdTree& tree, KdTreeScratch& scratch, std::span<const Point> points,
                  std::span<const Point> queries, float radius_m2, Times& times, Answers& answers) {
  clear(answers, queries.size());
  const Stopwatch build;
  if (!tree.build(points, scratch)) throw std::runtime_error("a scan is larger than the tree's capacity");
  times.build_ms.add(build.ms());
  const Stopwatch one;
  for (std::size_t i = 0; i < queries.size(); ++i)
    answers.one_m2[i] = tree.nearest(queries[i], radius_m2).squared_m2;
  times.one_us.add(us_each(one, queries.size()));
  const Stopwatch several;
  std::array<Neighbor, many> neighbors;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const std::uint32_t found = tree.nearest(queries[i], radius_m2, neighbors);
    for (std::uint32_t n = 0; n < found; ++n) answers.many_m2[i * many + n] = neighbors[n].squared_m2;
  }
  times.many_us.add(us_each(several, queries.size()));
}

void measure_peer(std::span<const Point> points, std::span<const Point> queries, float radius_m2,
                  Times& times, Answers& answers) {
  clear(answers, queries.size());
  const Stopwatch build;
  const Cloud cloud{points};
  const Peer tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  times.build_ms.add(build.ms());
  const nanoflann::SearchParams exact;
  const auto ask = [&](const Point& query, std::size_t k, std::uint32_t* indices, float* squared_m2) {
    // a result set that starts at the radius prunes as ours does
    nanoflann::KNNResultSet<float, std::uint32_t> result(k);
    result.init(indices, squared_m2);
    squared_m2[k - 1] = radius_m2;
    const float xyz[3] = {query.x, query.y, query.z};
    tree.findNeighbors(result, xyz, exact);
    return result.size();
  };
  std::array<std::uint32_t, many> indices{};
  std::array<float, many> squared_m2{};
  const Stopwatch one;
  for (std::size_t i = 0; i < queries.size(); ++i)
    if (ask(queries[i], 1, indices.data(), squared_m2.data()) == 1) answers.one_m2[i] = squared_m2[0];
  times.one_us.add(us_each(one, queries.size()));
  const Stopwatch several;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const std::size_t found = ask(queries[i], many, indices.data(), squared_m2.data());
    std::copy_n(squared_m2.begin(), found, answers.many_m2.begin() + static_cast<std::ptrdiff_t>(i * many));
  }
  times.many_us.add(us_each(several, queries.size()));
}

/// Squared distances that differ by more than float's last digits.
std::size_t differing(std::span<const float> a, std::span<const float> b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const bool same = a[i] == b[i] || std::abs(a[i] - b[i]) <= 4e-7F * std::max(a[i], b[i]);
    if (!same) ++count;
  }
  return count;
}

void measure(const Drive& drive, std::size_t pairs, float cell_size_m, float radius_m) {
  print_heading("k-d tree: alces and nanoflann");
  constexpr std::uint32_t capacity = 1U << 18;
  test::InBlock<KdTree> tree(capacity);
  test::InBlock<KdTreeScratch> scratch(capacity);
  Times ours, peer;
  Samples points_a_scan, found;
  std::size_t wrong = 0, answers_compared = 0;
  std::vector<Point> raw;
  Answers our_answers, peer_answers;
  const std::size_t stride = std::max<std::size_t>(1, (drive.size - 1) / std::max<std::size_t>(1, pairs));
  for (std::size_t i = 0; i + 1 < drive.size; i += stride) {
    print_progress(i, drive.size - 1);
    drive.points(i, raw);
    const std::vector<Point> model = reduced(raw, cell_size_m);
    drive.points(i + 1, raw);
    std::vector<Point> queries = reduced(raw, cell_size_m);
    const Pose placed = drive.odometry[i].inverse() * drive.odometry[i + 1];
    for (Point& point : queries) {
      const Eigen::Vector3f at =
          (placed * Eigen::Vector3d(Eigen::Vector3f(point.x, point.y, point.z).cast<double>())).cast<float>();
      point = {at.x(), at.y(), at.z()};
    }
    if (model.empty() || queries.empty()) continue;
    points_a_scan.add(static_cast<double>(model.size()));
    const float radius_m2 = radius_m * radius_m;
    const bool first = points_a_scan.size() % 2 == 0;  // neither always finds the cache warm
    if (first) measure_ours(*tree, *scratch, model, queries, radius_m2, ours, our_answers);
    measure_peer(model, queries, radius_m2, peer, peer_answers);
    if (!first) measure_ours(*tree, *scratch, model, queries, radius_m2, ours, our_answers);
    wrong += differing(our_answers.one_m2, peer_answers.one_m2) +
             differing(our_answers.many_m2, peer_answers.many_m2);
    answers_compared += our_answers.one_m2.size() + our_answers.many_m2.size();
    const auto within = std::count_if(our_answers.one_m2.begin(), our_answers.one_m2.end(),
                                      [](float m2) { return m2 < 1e9F; });
    found.add(100.0 * static_cast<double>(within) / static_cast<double>(queries.size()));
  }
  print_progress(1, 1);
  fmt::print(
      "{}; {} pairs of neighbouring scans, {:.0f} points a scan (median) in cells of {} m; {:.0f} % of "
      "the queries find one within {} m.\n\n",
      drive.name, points_a_scan.size(), points_a_scan.median(), cell_size_m, found.median(), radius_m);
  print_header({"median (worst)", "alces", "nanoflann", "nanoflann / alces"});
  const auto row = [](const char* name, const Samples& a, const Samples& b) {
    print_row({name, fmt::format("{:.3f} ({:.3f})", a.median(), a.worst()),
               fmt::format("{:.3f} ({:.3f})", b.median(), b.worst()),
               fmt::format("{:.2f}", b.median() / a.median())});
  };
  row("build, ms", ours.build_ms, peer.build_ms);
  row("nearest, us a query", ours.one_us, peer.one_us);
  row("10 nearest, us a query", ours.many_us, peer.many_us);
  fmt::print("\nDistances compared: {}, differing: {}.\n\n", answers_compared, wrong);
  if (wrong != 0) throw std::runtime_error("the two trees disagree");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Our k-d tree beside nanoflann's on neighbouring scans of a drive");
  DriveOptions options;
  std::size_t pairs = 100;
  float cell_size_m = 0.10F;
  float radius_m = 1.0F;
  options.add_to(app);
  app.add_option("--pairs", pairs, "About so many, spread over the drive")->capture_default_str();
  app.add_option("--voxel", cell_size_m, "Edge of a reduction cell, m")->capture_default_str();
  app.add_option("--radius", radius_m, "Of the queries, m")->capture_default_str();
  return run(argc, argv, app, [&] { measure(options.open(), pairs, cell_size_m, radius_m); });
}
