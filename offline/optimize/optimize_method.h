// What `alces optimize --with` chooses from.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "lum_method.h"
#include "offline/io/files/stop_signal.h"
#include "offline/optimize/graph/elch_on_graph.h"
#include "offline/optimize/graph/gauss_newton.h"
#include "offline/optimize/graph/map_graph.h"

namespace alces::offline {

struct OptimizeOptions {
  std::string input;
  std::string out;
  std::string with = "gn";
  GaussNewtonSettings gauss_newton;
  ElchSettings elch;
  LumOptions lum;
  bool json = false;
};

/// What a method works on, and how it speaks meanwhile.
struct OptimizeTask {
  ConstraintGraph& graph;
  const MapGraph* map;  ///< nullptr: a graph file, there are no scans
  const OptimizeOptions& options;
  const StopSignal& stop;
};

/// What it says afterwards; its own figures under its own names.
struct OptimizeOutcome {
  nlohmann::json details = nlohmann::json::object();
  std::string sentence;
  bool was_stopped = false;
  bool keeps_edges = true;        ///< chi-squared before and after are of the same edges
  std::optional<LumOutcome> lum;  ///< of which something is left to write
};

/// A choice of --with.
struct OptimizeMethod {
  const char* name;
  const char* what;
  OptimizeOutcome (*run)(const OptimizeTask& task);
};

/// Offers one more; before the command line is built, by one thread.
void add_optimize_method(const OptimizeMethod& method);

}  // namespace alces::offline
