// LOA (its preparation and the four runs of one closed loop) and sharing out, on drives with loops in loops.
// Peer: the paper's algorithm on a Boost graph, as 3DTK and PCL run it.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "alces/loop_correction.h"
#include "alces/loop_optimizer.h"
#include "alces/pose_graph.h"
#include "alces_platform/sim/random.h"
#include "support.h"
#include "support/in_block.h"
#ifdef ALCES_HAS_BOOST
#include "peers/boost_loop_optimizer.h"
#endif

namespace {

using namespace alces;
using namespace alces::bench;

constexpr LoopCost costs[] = {LoopCost::x, LoopCost::y, LoopCost::z, LoopCost::rotation};

struct Size {
  std::uint32_t scans;
  std::uint32_t loops;
};

/// A drive along a wavy line, with loop edges between random scans at least 20 apart. The loop to close is
/// that from near the first scan to the last one; it has no edge yet.
class Network {
 public:
  Network(const Size& size, std::uint64_t seed)
      : graph(PoseGraph::Capacity{size.scans, size.scans + size.loops}) {
    sim::Random random(seed);
    const auto check = [](Status status) {
      if (status != Status::ok) throw std::runtime_error(to_string(status));
    };
    const auto variance = [&] {
      const auto draw = [&](double typical) { return typical * std::exp(random.normal()); };
      return EdgeVariance{draw(1e-4), draw(1e-4), draw(1e-4), draw(1e-6)};
    };
    Pose pose;
    const auto add_edge = [&](std::uint32_t from, std::uint32_t to, bool closes_loop) {
      Edge edge;
      edge.from = from;
      edge.to = to;
      edge.closes_loop = closes_loop;
      edge.variance = variance();
      edge.from_from_to = graph->poses()[from].inverse() * graph->poses()[to];
      check(graph->add_edge(edge));
    };
    for (std::uint32_t i = 0; i < size.scans; ++i) {
      if (i > 0) {
        Vector6d step;
        step << 1.3, 0, 0, 0, 0, 0.1 * random.normal();
        pose = pose * exp_se3(step);
      }
      check(graph->add_vertex(pose));
      if (i > 0) add_edge(i - 1, i, false);
    }
    constexpr int gap = 20;
    const int last_scan = static_cast<int>(size.scans) - 1;
    for (std::uint32_t loop = 0; loop < size.loops; ++loop) {
      const int first = random.integer(0, last_scan - gap);
      const int last = random.integer(first + gap, last_scan);
      add_edge(static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last), true);
    }
    f = 2;
    l = size.scans - 1;
    Vector6d offset;
    offset << 1.0, -0.5, 0.2, 0.01, -0.005, 0.03;
    map_from_l = graph->poses()[l] * exp_se3(offset);
  }

  test::InBlock<PoseGraph> graph;
  std::uint32_t f = 0;
  std::uint32_t l = 0;
  Pose map_from_l;
};

struct LoaTimes {
  Samples all_ms, prepare_ms, run_ms, peer_ms;
  double largest_difference = 0;
};

void check(Status status) {
  if (status != Status::ok) throw std::runtime_error(to_string(status));
}

LoaTimes measure_loa(const Size& size, const Network& network, std::size_t repeats,
                     std::uint32_t most_peer_scans) {
  LoaTimes times;
  test::InBlock<LoopOptimizer> optimizer(PoseGraph::Capacity{size.scans, size.scans + size.loops});
  std::vector<std::vector<double>> weights(4, std::vector<double>(size.scans));
  for (std::size_t repeat = 0; repeat < repeats; ++repeat) {
    const Stopwatch all;
    check(optimizer->prepare(*network.graph, network.f, network.l));
    const double prepared_ms = all.ms();
    for (std::size_t i = 0; i < 4; ++i) check(optimizer->weights(costs[i], weights[i]));
    const double done_ms = all.ms();
    times.prepare_ms.add(prepared_ms);
    times.run_ms.add((done_ms - prepared_ms) / 4);
    times.all_ms.add(done_ms);
  }
#ifdef ALCES_HAS_BOOST
  if (size.scans > most_peer_scans) return times;
  const std::size_t peer_repeats = size.loops > 20 ? 1 : 20;
  for (std::size_t repeat = 0; repeat < peer_repeats; ++repeat) {
    const Stopwatch watch;
    for (std::size_t i = 0; i < 4; ++i) {
      std::vector<BoostLoopOptimizer::Edge> edges;
      for (const Edge& edge : network.graph->edges()) {
        const EdgeVariance& v = edge.variance;
        const std::span<const Pose> poses = std::as_const(*network.graph).poses();
        const Eigen::Vector3d along_f_m2 =
            translation_covariance(v, poses[network.f].rotation.conjugate() * poses[edge.to].rotation)
                .diagonal();
        const double by_cost[] = {along_f_m2.x(), along_f_m2.y(), along_f_m2.z(), v.rotation_rad2};
        edges.push_back({edge.from, edge.to, by_cost[i]});
      }
      const std::vector<double> theirs = BoostLoopOptimizer::weights(size.scans, edges, network.f, network.l);
      for (std::size_t v = 0; v < theirs.size(); ++v)
        times.largest_difference = std::max(times.largest_difference, std::abs(theirs[v] - weights[i][v]));
    }
    times.peer_ms.add(watch.ms());
  }
#else
  (void)most_peer_scans;
#endif
  return times;
}

void measure_sharing(const Size& size, std::size_t repeats, std::uint64_t seed) {
  Network network(size, seed);
  const std::vector<Pose> before(network.graph->poses().begin(), network.graph->poses().end());
  test::InBlock<LoopCorrection> sharing(PoseGraph::Capacity{size.scans, size.scans + size.loops});
  for (const CorrectionRule rule : {CorrectionRule::trails, CorrectionRule::paper}) {
    Samples prepare_ms, share_ms, all_ms;
    for (std::size_t repeat = 0; repeat < repeats; ++repeat) {
      std::copy(before.begin(), before.end(), network.graph->poses().begin());
      const Stopwatch watch;
      check(sharing->prepare(*network.graph, network.f, network.l));
      const double prepared_ms = watch.ms();
      check(sharing->share(*network.graph, network.map_from_l, rule));
      const double done_ms = watch.ms();
      prepare_ms.add(prepared_ms);
      share_ms.add(done_ms - prepared_ms);
      all_ms.add(done_ms);
    }
    print_row({fmt::format("{} / {}", size.scans, size.loops),
               rule == CorrectionRule::trails ? "trails" : "paper",
               fmt::format("{:.4f}", prepare_ms.median()), fmt::format("{:.4f}", share_ms.median()),
               fmt::format("{:.4f} ({:.4f})", all_ms.median(), all_ms.worst())});
  }
}

void measure(std::size_t repeats, std::uint64_t seed, std::uint32_t most_peer_scans) {
  print_heading("LOA: four runs for one loop");
  constexpr Size sizes[] = {{469, 8}, {469, 150}, {924, 6}, {10000, 100}, {100000, 1000}};
  print_header({"scans / loops", "alces, ms: median (worst)", "of it prepare", "one run",
                "us a thousand scans", "Boost graph, ms", "Boost / alces", "largest difference of a weight"});
  for (const Size& size : sizes) {
    const Network network(size, seed);
    const std::size_t times_here = std::max<std::size_t>(5, repeats * 469 / size.scans);
    const LoaTimes times = measure_loa(size, network, times_here, most_peer_scans);
    const bool has_peer = times.peer_ms.size() > 0;
    print_row({fmt::format("{} / {}", size.scans, size.loops),
               fmt::format("{:.4f} ({:.4f})", times.all_ms.median(), times.all_ms.worst()),
               fmt::format("{:.4f}", times.prepare_ms.median()), fmt::format("{:.4f}", times.run_ms.median()),
               fmt::format("{:.1f}", times.all_ms.median() * 1e6 / size.scans),
               has_peer ? fmt::format("{:.3f}", times.peer_ms.median()) : "-",
               has_peer ? fmt::format("{:.1f}", times.peer_ms.median() / times.all_ms.median()) : "-",
               has_peer ? fmt::format("{:.1e}", times.largest_difference) : "-"});
  }
  fmt::print("\n### LOA with sharing out, one loop\n\n");
  print_header(
      {"scans / loops", "rule", "prepare, ms", "runs and sharing, ms", "together, ms: median (worst)"});
  for (const Size& size : {Size{469, 8}, Size{469, 150}, Size{924, 6}}) measure_sharing(size, repeats, seed);
  fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("LOA and sharing out beside the same on a Boost graph");
  std::size_t repeats = 500;
  std::uint64_t seed = 1;
  std::uint32_t most_peer_scans = 1000;
  app.add_option("--repeats", repeats, "Of the small graphs")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--seed", seed, "Of the graphs")->capture_default_str();
  app.add_option("--peer-scans", most_peer_scans, "The peer runs on graphs up to this size")
      ->capture_default_str();
  return run(argc, argv, app, [&] { measure(repeats, seed, most_peer_scans); });
}
