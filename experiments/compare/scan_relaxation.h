// LUM as the experiment needs it: step by step, its time split between front and back end, and in LOA's
// place.
//
// Front end: links, correspondences and their sums. Back end: the equations and their solution. The paper
// splits Table 2 there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "offline/optimize/graph/loop_back_end.h"
#include "offline/optimize/lum/relaxation.h"
#include "offline/optimize/lum/scan_cache.h"

namespace alces::offline {

struct StageSplit {
  double front_end_s = 0;
  double back_end_s = 0;
};

struct ScanRelaxationCallbacks {
  std::function<void(std::uint32_t iteration, std::size_t links_done, std::size_t links_total)> progress;
  std::function<void(std::span<const Pose> map_from_scan)> iterated;  ///< after each iteration
  std::function<bool()> stop_requested;
};

struct ScanRelaxationResult {
  std::vector<Pose> map_from_scan;
  ConstraintGraph link_graph;
  StageSplit times;
  std::uint32_t iterations = 0;
  bool is_converged = false;
  bool was_stopped = false;
};

/// Relaxes all poses until they rest (relaxation.h). A pose for every scan of the cache, or for the first so
/// many.
[[nodiscard]] ScanRelaxationResult relax_scans(std::span<const Pose> map_from_scan, ScanCache& cache,
                                               const LumSettings& settings,
                                               const ScanRelaxationCallbacks& callbacks = {});

/// The paper's LUM strategy: whenever the mapper has closed a loop, all scans so far are relaxed. The loop's
/// own match decides only that it is done; links are found by distance, as in post-processing.
class LumRelaxation final : public GraphRelaxation {
 public:
  /// `source_index(n)`: the source's scan of each of the map's n scans. `scans` outlives it.
  LumRelaxation(ScanSource& scans, const LumSettings& settings, std::filesystem::path scratch_folder,
                std::function<std::vector<std::size_t>(std::size_t)> source_index,
                ScanRelaxationCallbacks callbacks);
  ~LumRelaxation() override;

  bool relax(const PoseGraph& graph, std::span<Pose> map_from_body) override;

  [[nodiscard]] const StageSplit& times() const { return times_; }
  [[nodiscard]] std::uint32_t iterations() const { return iterations_; }
  [[nodiscard]] std::uint32_t relaxations() const { return relaxations_; }

 private:
  ScanSource& scans_;
  LumSettings settings_;
  std::filesystem::path scratch_folder_;
  std::function<std::vector<std::size_t>(std::size_t)> source_index_;
  ScanRelaxationCallbacks callbacks_;
  std::unique_ptr<ScanCache> cache_;
  std::vector<std::size_t> cached_;  // the source's scan of each of the cache's
  StageSplit times_;
  std::uint32_t iterations_ = 0;
  std::uint32_t relaxations_ = 0;
};

}  // namespace alces::offline
