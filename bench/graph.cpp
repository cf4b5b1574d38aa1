// Pose graphs at scale: reading, Gauss-Newton, and ELCH with what LOA takes a loop, on drives through a grid
// of streets; then LOA beside the optimisers at the same number of loops and any number of poses, on laps of
// a ring. LOA's cost is to grow linearly with the poses; graph.gp draws it.
#include <fmt/core.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "alces/loop_optimizer.h"
#include "experiments/back_ends/hogman.h"
#include "experiments/back_ends/toro.h"
#include "offline/optimize/graph/elch_on_graph.h"
#include "offline/optimize/graph/gauss_newton.h"
#include "offline/optimize/graph/graph_file.h"
#include "support.h"
#include "support/in_block.h"
#include "support/ring_graph.h"
#include "support/sample_graph.h"

namespace {

using namespace alces;
using namespace alces::bench;
using namespace alces::offline;

// Of the process, without the time that others had the processor.
double cpu_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// LOA alone, prepared and run for its four costs, as when the drive's last pose closes a loop to its first.
double loa_ms(const ConstraintGraph& graph) {
  const PoseGraph::Capacity capacity{.vertices = static_cast<std::uint32_t>(graph.vertices.size()),
                                     .edges = static_cast<std::uint32_t>(graph.constraints.size())};
  test::InBlock<PoseGraph> poses(capacity);
  test::InBlock<LoopOptimizer> optimizer(capacity);
  const auto check = [](Status status) {
    if (status != Status::ok) throw std::runtime_error(to_string(status));
  };
  for (const ConstraintVertex& vertex : graph.vertices) check(poses->add_vertex(vertex.map_from_body));
  for (const Constraint& c : graph.constraints)
    check(poses->add_edge(
        {.from = c.from, .to = c.to, .closes_loop = false, .variance = {}, .from_from_to = c.from_from_to}));
  std::vector<double> weights(graph.vertices.size());
  Samples ms;
  for (int run = 0; run < 21; ++run) {
    const double begin = cpu_s();
    check(optimizer->prepare(*poses, 0, capacity.vertices - 1));
    for (const LoopCost cost : {LoopCost::x, LoopCost::y, LoopCost::z, LoopCost::rotation})
      check(optimizer->weights(cost, weights));
    ms.add(1e3 * (cpu_s() - begin));
  }
  return ms.median();
}

template <typename Optimize>
double optimizing_s(ConstraintGraph graph, const Optimize& optimize) {
  const double begin = cpu_s();
  optimize(graph);
  return cpu_s() - begin;
}

/// Twenty laps of a ring, as many loops at every size.
void compare_on_rings(const std::vector<std::uint32_t>& sizes, std::uint32_t loops, std::uint64_t seed,
                      bool only_loa, const std::string& data) {
  std::ofstream file;
  if (!data.empty()) {
    file.open(data);
    if (!file) throw std::runtime_error(data + " cannot be written");
    file << "# processor time; poses loa_ms gn_s toro_s hogman_s\n";
  }
  fmt::print("\n| poses | loops | LOA, four costs: ms | ns a pose |{}\n|---|---|---|---|{}\n",
             only_loa ? "" : " gn: s | TORO: s | HOG-Man: s |", only_loa ? "" : "---|---|---|");
  for (const std::uint32_t poses : sizes) {
    const ConstraintGraph graph = test::ring_graph({.poses = poses,
                                                    .poses_a_lap = poses / 20,
                                                    .loops = loops,
                                                    .rotation_sigma_rad = 0.001,
                                                    .seed = seed})
                                      .graph;
    const double one_ms = loa_ms(graph);
    double gn_s = 0;
    double toro_s = 0;
    double hogman_s = 0;
    if (!only_loa) {
      gn_s = optimizing_s(graph, [](ConstraintGraph& g) { (void)optimize_gauss_newton(g); });
      toro_s = optimizing_s(graph, [](ConstraintGraph& g) { (void)optimize_toro(g); });
      hogman_s = optimizing_s(graph, [](ConstraintGraph& g) { (void)optimize_hogman(g); });
    }
    fmt::print("| {} | {} | {:.2f} | {:.0f} |", poses, loops, one_ms, 1e6 * one_ms / poses);
    if (!only_loa) fmt::print(" {:.2f} | {:.2f} | {:.2f} |", gn_s, toro_s, hogman_s);
    fmt::print("\n");
    std::fflush(stdout);
    file << fmt::format("{} {:.4f} {:.3f} {:.3f} {:.3f}\n", poses, one_ms, gn_s, toro_s, hogman_s)
         << std::flush;
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Pose graphs at scale: reading, gn, ELCH."};
  std::vector<std::uint32_t> sizes = {12500, 25000, 50000, 100000};
  std::uint32_t loops = 1000;
  std::uint64_t seed = 1;
  bool is_planar = false;
  bool only_rings = false;
  bool only_loa = false;
  std::string write;
  std::string data;
  app.add_option("--poses", sizes, "sizes of the graphs");
  app.add_option("--loops", loops, "loop edges of each")->capture_default_str();
  app.add_option("--seed", seed, "of drive and noise")->capture_default_str();
  app.add_flag("--planar", is_planar, "SE(2) instead of SE(3)");
  app.add_option("--write", write, "write the first graph to this g2o file and measure nothing");
  app.add_flag("--only-rings", only_rings, "LOA beside the optimisers, and nothing else");
  app.add_flag("--only-loa", only_loa, "LOA without the optimisers");
  app.add_option("--data", data, "write the figures of the rings to this file, for graph.gp");
  CLI11_PARSE(app, argc, argv);

  const auto make = [&](std::uint32_t poses) {
    return test::sample_graph({.poses = poses,
                               .loops = loops,
                               .seed = seed,
                               .is_planar = is_planar,
                               .rotation_sigma_rad = 0.001,
                               .streets = 24,
                               .block_poses = 20});
  };
  if (!write.empty()) {
    write_graph(write, make(sizes.front()), GraphFormat::g2o);
    return 0;
  }
  if (only_rings || only_loa) {
    compare_on_rings(sizes, loops, seed, only_loa, data);
    return 0;
  }
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "alces_bench_graph.g2o";
  fmt::print(
      "| poses | loops | read | gn: chi-squared | iterations | s | ELCH: chi-squared | s | ms a loop | "
      "LOA alone, ms | ns a pose |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const std::uint32_t poses : sizes) {
    write_graph(file, make(poses), GraphFormat::g2o);
    double begin = cpu_s();
    ConstraintGraph graph = read_graph(file).graph;
    const double read_s = cpu_s() - begin;
    ConstraintGraph bent = graph;

    begin = cpu_s();
    const GaussNewtonResult gn = optimize_gauss_newton(graph);
    const double gn_s = cpu_s() - begin;
    begin = cpu_s();
    const ElchResult elch = close_loops_with_elch(bent);
    const double elch_s = cpu_s() - begin;
    const double one_ms = loa_ms(graph);
    fmt::print("| {} | {} | {:.2f} | {:.1f} | {} | {:.2f} | {:.1f} | {:.2f} | {:.2f} | {:.2f} | {:.1f} |\n",
               poses, elch.loops, read_s, gn.chi_squared, gn.iterations, gn_s, elch.chi_squared, elch_s,
               1e3 * elch_s / static_cast<double>(elch.loops), one_ms, 1e6 * one_ms / poses);
    std::fflush(stdout);
  }
  std::filesystem::remove(file);
  compare_on_rings(sizes, loops, seed, false, data);
}
