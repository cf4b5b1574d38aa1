// The sums of all links at given poses: the expensive half of an iteration, here or shared out.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "link_sums.h"
#include "scan_cache.h"

namespace alces::offline {

class LinkSumSource {
 public:
  using Progress = std::function<void(std::size_t links_done, std::size_t links_total)>;

  LinkSumSource() = default;
  LinkSumSource(const LinkSumSource&) = delete;
  LinkSumSource& operator=(const LinkSumSource&) = delete;
  virtual ~LinkSumSource() = default;

  /// sums[i] of links[i]. `links` are ascending. Progress may come from any thread, one call at a time.
  virtual void sum(std::span<const ScanLink> links, std::span<const Pose> map_from_scan, const LinkPass& pass,
                   std::span<LinkSums> sums, const Progress& progress) = 0;
};

/// On this machine's cores. Each link is summed by one thread in a fixed order, so the number of threads does
/// not show. Where the cache does not hold all scans, they are taken in groups of half its size, and the
/// links between two groups at a time: each group is loaded once for every group that it has links with.
class LocalLinkSums final : public LinkSumSource {
 public:
  LocalLinkSums(ScanCache& cache, const LumSettings& settings) : cache_(cache), settings_(settings) {}
  void sum(std::span<const ScanLink> links, std::span<const Pose> map_from_scan, const LinkPass& pass,
           std::span<LinkSums> sums, const Progress& progress) override;

 private:
  ScanCache& cache_;
  LumSettings settings_;
};

/// The links' places in batches of which each needs at most `capacity` scans; capacity is at least 2.
[[nodiscard]] std::vector<std::vector<std::size_t>> batch_links(std::span<const ScanLink> links,
                                                                std::size_t capacity);
/// The scans at the ends of a batch's links, each once, in order.
[[nodiscard]] std::vector<std::uint32_t> scans_of(std::span<const ScanLink> links,
                                                  std::span<const std::size_t> batch);

}  // namespace alces::offline
