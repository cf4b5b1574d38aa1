// alces optimize: the best poses that a graph's constraints allow.
#include <fmt/core.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "alces_platform/doing.h"
#include "lum_method.h"
#include "offline/io/files/error.h"
#include "offline/io/files/json_text.h"
#include "offline/io/files/stop_signal.h"
#include "offline/io/map_folder/map_health.h"
#include "offline/map/map_and_write.h"
#include "offline/optimize/graph/elch_on_graph.h"
#include "offline/optimize/graph/gauss_newton.h"
#include "offline/optimize/graph/graph_file.h"
#include "offline/optimize/graph/map_graph.h"
#include "offline/program/command.h"
#include "optimize_method.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;

/// "alces: TEXT" on one line of stderr if that is a terminal; the line goes away with the object.
class StatusLine {
 public:
  ~StatusLine() {
    if (is_shown_) fmt::print(stderr, "\r\033[K");
  }
  void operator()(const std::string& text) {
    if (!is_terminal_) return;
    fmt::print(stderr, "\r\033[Kalces: {}", text);
    std::fflush(stderr);
    is_shown_ = true;
  }

 private:
  bool is_terminal_ = isatty(STDERR_FILENO) == 1;
  bool is_shown_ = false;
};

const char* name(GraphStart start) {
  constexpr std::array<const char*, 5> names = {"file", "odometry", "spanning-tree", "chordal", "best"};
  return names.at(static_cast<std::size_t>(start));
}

const char* name(GaussNewtonEnd end) {
  constexpr std::array<const char*, 3> names = {"converged", "iteration limit", "stopped"};
  return names.at(static_cast<std::size_t>(end));
}

OptimizeOutcome run_gauss_newton(const OptimizeTask& task) {
  GaussNewtonResult result;
  {
    StatusLine line;
    result = optimize_gauss_newton(task.graph, task.options.gauss_newton,
                                   {.progress =
                                        [&](const GaussNewtonStep& step) {
                                          line(fmt::format("iteration {}, chi-squared {:.6g}, lambda {:.0e}",
                                                           step.iteration, step.cost, step.lambda));
                                        },
                                    .stop_requested = [&] { return task.stop.received() != 0; }});
  }
  OptimizeOutcome outcome;
  outcome.was_stopped = result.end == GaussNewtonEnd::stopped;
  outcome.details = {{"start", name(result.start)},
                     {"chi_squared_start", result.chi_squared_start},
                     {"robust_cost", result.cost},
                     {"iterations", result.iterations},
                     {"end", name(result.end)},
                     {"factor_numbers", result.factor_numbers},
                     {"distrusted", nlohmann::json::array()}};
  for (const std::uint32_t i : result.distrusted) {
    const Constraint& c = task.graph.constraints[i];
    outcome.details["distrusted"].push_back({{"from", task.graph.vertices[c.from].id},
                                             {"to", task.graph.vertices[c.to].id},
                                             {"chi_squared", chi_squared(task.graph, c)}});
  }
  outcome.sentence = fmt::format("{} iterations from {} (chi-squared {:.6g}), {}", result.iterations,
                                 name(result.start), result.chi_squared_start, name(result.end));
  if (!result.distrusted.empty())
    outcome.sentence += fmt::format("; {} loop edges distrusted", result.distrusted.size());
  return outcome;
}

OptimizeOutcome run_elch(const OptimizeTask& task) {
  ElchResult result;
  {
    Progress progress("closing loops");
    result = close_loops_with_elch(
        task.graph, task.options.elch,
        {.progress = [&](std::size_t done, std::size_t total) { progress(done, total); },
         .stop_requested = [&] { return task.stop.received() != 0; }});
  }
  OptimizeOutcome outcome;
  outcome.was_stopped = result.was_stopped;
  outcome.details = {{"chi_squared_odometry", result.chi_squared_odometry},
                     {"sharing", task.options.elch.rule == CorrectionRule::trails ? "trails" : "paper"},
                     {"loops", result.loops},
                     {"parallel_edges", result.parallel}};
  outcome.sentence =
      fmt::format("{} loops closed, odometry alone {:.6g}", result.loops, result.chi_squared_odometry);
  if (result.chi_squared > result.chi_squared_odometry) {
    outcome.sentence += fmt::format(
        "\nThe loops made it worse: so many of them bend each other. Try --sharing {}, or --with gn.",
        task.options.elch.rule == CorrectionRule::trails ? "paper" : "trails");
  }
  if (result.parallel > 0)
    outcome.sentence += fmt::format("; {} edges beside another left out", result.parallel);
  return outcome;
}

OptimizeOutcome run_lum_method(const OptimizeTask& task) {
  if (task.map == nullptr)
    throw UsageError("--with lum matches scans and needs a map folder; a graph file has none");
  LumOutcome lum = run_lum(*task.map, task.options.lum, task.options.out, task.stop);
  OptimizeOutcome outcome;
  outcome.keeps_edges = false;
  outcome.was_stopped = lum.was_stopped;
  outcome.details = lum.details;
  outcome.sentence = lum.sentence;
  if (!lum.is_worker) task.graph = std::move(lum.graph);
  outcome.lum = std::move(lum);
  return outcome;
}

std::vector<OptimizeMethod>& methods() {
  static std::vector<OptimizeMethod> all = {
      {"gn", "Gauss-Newton / Levenberg-Marquardt over all edges at once", run_gauss_newton},
      {"elch", "each loop edge closed in order with LOA", run_elch},
      {"lum", "all scans of a map matched to each other at once", run_lum_method},
  };
  return all;
}

constexpr const char* optimize_footer = R"(Examples:
  alces optimize sphere2500.g2o --out better.g2o             the most likely poses
  alces optimize town --out town2                            a map folder in, a map folder out: points moved along
  alces optimize town --out town2 --robust dcs --json        wrong loops switched off, and named
  alces optimize intel.g2o --with elch --out closed.g2o      what the mapper would have made of these edges
  alces optimize town --out town2 --with lum                 the scans matched again, all to all: the best map
  mpirun -n 4 alces-mpi optimize town --out town2 --with lum the same, on several machines (docs/lum.md)

INPUT is a graph file (g2o or TORO, 2D or 3D; docs/graphs.md) or a map folder, whose graph.g2o is taken. For a graph
file OUT is one too when its name ends in .g2o or .graph (TORO); else it is a folder with graph.g2o and
trajectory.tum. Of a map folder a complete map folder comes out.

--with gn     finds the optimum of chi-squared, as g2o counts it. --start says from where: file, odometry (along the
              chain), spanning-tree, chordal (orientations first), or best, the better of file and chordal.
--with elch   starts from odometry and closes one loop after the other; not the optimum, but what the vehicle does.
              --sharing trails (as the mapper) or paper (its first rule).
              Both: docs/back-ends.md.
--with lum    global relaxation (docs/lum.md): scans near each other are linked and matched, all poses solved for at once,
              again and again until nothing moves. Takes the scans from where 'alces map' found them, or --scans. Links
              that pull against all others are named. Ctrl-C keeps the map so far, --resume goes on.

--robust works on edges between vertices that do not follow each other: huber and cauchy weigh contradictions less,
dcs (dynamic covariance scaling) switches wrong loops off. Ctrl-C keeps the best poses so far.)";

bool has_graph_name(const fs::path& file) {
  return file.extension() == ".g2o" || file.extension() == ".graph";
}

/// Options that only some methods know.
constexpr std::array<std::pair<const char*, const char*>, 5> owners = {{{"--start", "gn"},
                                                                        {"--robust", "gn"},
                                                                        {"--kernel-width", "gn"},
                                                                        {"--iterations", "gn"},
                                                                        {"--sharing", "elch"}}};

void optimize(const CLI::App& verb, const OptimizeOptions& options) {
  for (const auto& [option, owner] : owners) {
    if (verb.count(option) > 0 && options.with != owner)
      throw UsageError(
          fmt::format("{} belongs to --with {}, {} has no use for it", option, owner, options.with));
  }
  if (options.with != "lum") {
    for (const std::string& option : lum_option_names()) {
      if (verb.count(option.c_str()) > 0)
        throw UsageError(fmt::format("{} belongs to --with lum, {} has no use for it", option, options.with));
    }
  }
  std::error_code ignored;
  std::optional<MapGraph> map;
  ConstraintGraph graph;
  const Doing optimizing("optimizing", options.input);
  if (fs::is_directory(options.input, ignored)) {
    if (has_graph_name(options.out))
      throw UsageError(fmt::format("{}: of a map folder a map folder comes out; name a folder", options.out));
    map = read_map_graph(options.input);
    graph = map->graph;
  } else {
    GraphFile file = read_graph(options.input);
    graph = std::move(file.graph);
    if (!file.has_poses)
      fmt::print(stderr, "alces: {}: has edges and no poses; they start along the edges\n", options.input);
  }

  const double before = chi_squared(graph);
  const StopSignal stop;
  const auto begin = std::chrono::steady_clock::now();
  OptimizeOutcome outcome;
  for (const OptimizeMethod& method : methods()) {
    if (options.with == method.name)
      outcome = method.run({.graph = graph, .map = map ? &*map : nullptr, .options = options, .stop = stop});
  }
  if (outcome.lum && outcome.lum->is_worker) return;  // rank 0 writes
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double after = chi_squared(graph);

  nlohmann::json report = {{"command_line", command_line()},
                           {"input", options.input},
                           {"out", options.out},
                           {"with", options.with},
                           {"vertices", graph.vertices.size()},
                           {"constraints", graph.constraints.size()},
                           {"planar", graph.is_planar},
                           {"chi_squared_before", before},
                           {"chi_squared", after},
                           {"complete", !outcome.was_stopped},
                           {"seconds", seconds}};
  report.update(outcome.details);
  if (!outcome.keeps_edges) report.erase("chi_squared_before");
  if (map) {
    const nlohmann::json run = write_map_graph(options.out, *map, graph, report, [&](const fs::path& folder) {
      if (outcome.lum) write_covariances(*outcome.lum, *map, folder);
    });
    for (const char* key : {"verdict", "health"})
      if (run.contains(key)) report[key] = run[key];
  } else if (has_graph_name(options.out)) {
    write_graph(options.out, graph,
                fs::path(options.out).extension() == ".g2o" ? GraphFormat::g2o : GraphFormat::toro);
  } else {
    write_graph_folder(options.out, graph);
  }
  if (outcome.lum) finish_lum(*outcome.lum, options.out);
  warn_of_bad_map(report);
  if (options.json) {
    fmt::print("{}\n", json_text(report));
  } else if (!outcome.keeps_edges) {
    fmt::print("{}: {} scans in {:.2f} s, {}\n", options.out, graph.vertices.size(), seconds,
               outcome.sentence);
  } else {
    fmt::print("{}: {} {}vertices, {} edges, chi-squared {:.6g} -> {:.6g} in {:.2f} s\n{}\n", options.out,
               graph.vertices.size(), graph.is_planar ? "planar " : "", graph.constraints.size(), before,
               after, seconds, outcome.sentence);
  }
  if (const std::string line = verdict_line(report); !line.empty() && !options.json)
    fmt::print("  {}\n", line);
  if (outcome.was_stopped) {
    std::fflush(stdout);
    throw Error(fmt::format("stopped; the best poses so far are in {}", options.out), 128 + stop.received());
  }
}

}  // namespace

void add_optimize_method(const OptimizeMethod& method) {
  methods().push_back(method);
}

void add_optimize_command(CLI::App& alces) {
  auto options = std::make_shared<OptimizeOptions>();
  CLI::App* verb = alces.add_subcommand("optimize", "The best poses that a pose graph's constraints allow.");
  verb->footer(optimize_footer);
  verb->add_option("INPUT", options->input, "a pose graph (g2o, TORO) or a map folder")->required();
  verb->add_option("--out", options->out, "the graph file (.g2o, .graph) or folder to write")->required();
  std::vector<std::string> names;
  std::string description = "how:";
  for (const OptimizeMethod& method : methods()) {
    names.emplace_back(method.name);
    description += fmt::format(" {} ({})", method.name, method.what);
  }
  verb->add_option("--with", options->with, description)->check(CLI::IsMember(names))->capture_default_str();
  verb->add_option("--start", options->gauss_newton.start, "where gn begins")
      ->transform(CLI::CheckedTransformer(
                      std::map<std::string, GraphStart>{{"file", GraphStart::file},
                                                        {"odometry", GraphStart::odometry},
                                                        {"spanning-tree", GraphStart::spanning_tree},
                                                        {"chordal", GraphStart::chordal},
                                                        {"best", GraphStart::best}})
                      .description("{file|odometry|spanning-tree|chordal|best}"))
      ->default_str("best");
  verb->add_option("--robust", options->gauss_newton.kernel, "what gn does about contradicting loops")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, RobustKernel>{{"none", RobustKernel::none},
                                                                      {"huber", RobustKernel::huber},
                                                                      {"cauchy", RobustKernel::cauchy},
                                                                      {"dcs", RobustKernel::dcs}})
              .description("{none|huber|cauchy|dcs}"))
      ->default_str("none");
  verb->add_option("--kernel-width", options->gauss_newton.kernel_width,
                   "standard deviations at which --robust sets in")
      ->check(CLI::Range(1e-3, 1e6))
      ->capture_default_str();
  verb->add_option("--iterations", options->gauss_newton.most_iterations, "gn's, at most")
      ->check(CLI::Range(0, 1000000))
      ->capture_default_str();
  add_lum_options(*verb, options->lum);
  verb->add_option("--sharing", options->elch.rule, "how elch shares a loop's offset out")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, CorrectionRule>{{"trails", CorrectionRule::trails},
                                                                        {"paper", CorrectionRule::paper}})
              .description("{trails|paper}"))
      ->default_str("trails");
  verb->add_flag("--json", options->json, "for machines");
  verb->callback([options, verb] { optimize(*verb, *options); });
}

}  // namespace alces::offline
