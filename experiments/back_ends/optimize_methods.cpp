// optimize --with toro, hogman
#include "optimize_methods.h"

#include <fmt/core.h>

#include "hogman.h"
#include "offline/optimize/optimize_method.h"
#include "offline/program/command.h"
#include "toro.h"

namespace alces::offline {
namespace {

/// TORO and HOG-Man tell the same things.
template <typename Result>
OptimizeOutcome back_end_outcome(const Result& result) {
  OptimizeOutcome outcome;
  outcome.was_stopped = result.stopped;
  outcome.details = {{"iterations", result.iterations}};
  outcome.sentence = fmt::format("{} iterations{}", result.iterations, result.stopped ? ", stopped" : "");
  return outcome;
}

OptimizeOutcome run_toro(const OptimizeTask& task) {
  Progress progress("spreading errors over the tree");
  return back_end_outcome(
      optimize_toro(task.graph, {},
                    {.progress = [&](std::uint32_t done, std::uint32_t total) { progress(done, total); },
                     .stop_requested = [&] { return task.stop.received() != 0; }}));
}

OptimizeOutcome run_hogman(const OptimizeTask& task) {
  Progress progress("optimizing the hierarchy");
  const HogManResult result =
      optimize_hogman(task.graph, {},
                      {.progress = [&](std::uint32_t done, std::uint32_t total) { progress(done, total); },
                       .stop_requested = [&] { return task.stop.received() != 0; }});
  OptimizeOutcome outcome = back_end_outcome(result);
  outcome.details["level_vertices"] = result.level_vertices;
  return outcome;
}

}  // namespace

void add_optimize_methods() {
  add_optimize_method(
      {"toro", "stochastic gradient descent over a tree: good from a poor start, not quite the optimum",
       run_toro});
  add_optimize_method(
      {"hogman", "Gauss-Newton over a hierarchy of graphs first, then the optimum", run_hogman});
}

}  // namespace alces::offline
