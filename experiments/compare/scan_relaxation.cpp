#include "scan_relaxation.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

namespace alces::offline {
namespace {

using Clock = std::chrono::steady_clock;

double wall_seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

class TimedLinkSums final : public LinkSumSource {
 public:
  explicit TimedLinkSums(LinkSumSource& sums) : sums_(sums) {}
  void sum(std::span<const ScanLink> links, std::span<const Pose> map_from_scan, const LinkPass& pass,
           std::span<LinkSums> sums, const Progress& progress) override {
    const Clock::time_point begin = Clock::now();
    sums_.sum(links, map_from_scan, pass, sums, progress);
    seconds_ += wall_seconds_since(begin);
  }
  [[nodiscard]] double seconds() const { return seconds_; }

 private:
  LinkSumSource& sums_;
  double seconds_ = 0;
};

}  // namespace

ScanRelaxationResult relax_scans(std::span<const Pose> map_from_scan, ScanCache& cache,
                                 const LumSettings& settings, const ScanRelaxationCallbacks& callbacks) {
  const Clock::time_point begin = Clock::now();
  LocalLinkSums local(cache, settings);
  TimedLinkSums sums(local);
  Relaxation relaxation({map_from_scan.begin(), map_from_scan.end()}, settings, sums);
  ScanRelaxationResult result;
  while (!relaxation.is_done()) {
    if (callbacks.stop_requested && callbacks.stop_requested()) {
      result.was_stopped = true;
      break;
    }
    const std::uint32_t number = relaxation.state().iterations + 1;
    relaxation.iterate([&](std::size_t done, std::size_t total) {
      if (callbacks.progress) callbacks.progress(number, done, total);
    });
    if (callbacks.iterated) callbacks.iterated(relaxation.state().map_from_scan);
  }
  result.map_from_scan = relaxation.state().map_from_scan;
  result.iterations = relaxation.state().iterations;
  result.is_converged = relaxation.state().is_converged;
  result.times.front_end_s = sums.seconds();
  result.times.back_end_s = wall_seconds_since(begin) - sums.seconds();
  result.link_graph = relaxation.link_graph();
  return result;
}

LumRelaxation::LumRelaxation(ScanSource& scans, const LumSettings& settings,
                             std::filesystem::path scratch_folder,
                             std::function<std::vector<std::size_t>(std::size_t)> source_index,
                             ScanRelaxationCallbacks callbacks)
    : scans_(scans),
      settings_(settings),
      scratch_folder_(std::move(scratch_folder)),
      source_index_(std::move(source_index)),
      callbacks_(std::move(callbacks)) {}

LumRelaxation::~LumRelaxation() = default;

bool LumRelaxation::relax(const PoseGraph& /*graph*/, std::span<Pose> map_from_body) {
  const Clock::time_point begin = Clock::now();
  try {
    const std::vector<std::size_t> index = source_index_(map_from_body.size());
    if (!cache_ || !std::equal(index.begin(), index.end(), cached_.begin())) {
      // With all that may still come, so that it stays the same cache as long as no scan is refused.
      cached_ = index;
      for (std::size_t i = index.back() + 1; i < scans_.size(); ++i) cached_.push_back(i);
      cache_ = std::make_unique<ScanCache>(scans_, cached_, settings_, scratch_folder_);
    }
    const ScanRelaxationResult result = relax_scans(map_from_body, *cache_, settings_, callbacks_);
    if (result.was_stopped) {
      problem_ = "it was stopped";
      return false;
    }
    std::copy(result.map_from_scan.begin(), result.map_from_scan.end(), map_from_body.begin());
    iterations_ += result.iterations;
    ++relaxations_;
    times_.back_end_s += result.times.back_end_s;
    times_.front_end_s += wall_seconds_since(begin) - result.times.back_end_s;
    return true;
  } catch (const std::exception& error) {
    problem_ = error.what();
    return false;
  }
}

}  // namespace alces::offline
