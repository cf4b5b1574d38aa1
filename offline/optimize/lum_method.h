// `alces optimize --with lum`: its options, its bar, its words.
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "offline/io/files/stop_signal.h"
#include "offline/optimize/graph/map_graph.h"
#include "offline/optimize/lum/optimize_with_lum.h"

namespace alces::offline {

struct LumOptions {
  LumSettings settings;
  std::string metric = "plane";
  std::vector<std::filesystem::path> scans;
  bool resume = false;
};

/// Names of the options, for those who refuse them with other methods.
[[nodiscard]] const std::vector<std::string>& lum_option_names();
void add_lum_options(CLI::App& verb, LumOptions& options);

struct LumOutcome {
  bool is_worker = false;
  bool was_stopped = false;
  ConstraintGraph graph;  ///< relaxed poses, and the links as constraints
  nlohmann::json details;
  std::string sentence;
  std::vector<Matrix6d> covariances;
};

/// Relaxes the map; keeps a checkpoint in `out` until it is done.
[[nodiscard]] LumOutcome run_lum(const MapGraph& map, const LumOptions& options,
                                 const std::filesystem::path& out, const StopSignal& stop);

/// covariances.csv beside the other files of the map, where it was asked for.
void write_covariances(const LumOutcome& outcome, const MapGraph& map, const std::filesystem::path& folder);

/// Once OUT is written: no checkpoint any more where nothing is left to do.
void finish_lum(const LumOutcome& outcome, const std::filesystem::path& out);

}  // namespace alces::offline
