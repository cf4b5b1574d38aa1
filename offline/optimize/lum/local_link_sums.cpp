#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>

#include "alces_platform/parallel.h"
#include "link_sum_source.h"

namespace alces::offline {

std::vector<std::vector<std::size_t>> batch_links(std::span<const ScanLink> links, std::size_t capacity) {
  const std::size_t group = std::max<std::size_t>(1, capacity / 2);
  std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> batches;
  for (std::size_t i = 0; i < links.size(); ++i)
    batches[{links[i].j / group, links[i].k / group}].push_back(i);
  std::vector<std::vector<std::size_t>> in_order;
  in_order.reserve(batches.size());
  for (auto& [groups, members] : batches) in_order.push_back(std::move(members));
  return in_order;
}

std::vector<std::uint32_t> scans_of(std::span<const ScanLink> links, std::span<const std::size_t> batch) {
  std::vector<std::uint32_t> scans;
  for (const std::size_t i : batch) {
    scans.push_back(links[i].j);
    scans.push_back(links[i].k);
  }
  std::sort(scans.begin(), scans.end());
  scans.erase(std::unique(scans.begin(), scans.end()), scans.end());
  return scans;
}

void LocalLinkSums::sum(std::span<const ScanLink> links, std::span<const Pose> map_from_scan,
                        const LinkPass& pass, std::span<LinkSums> sums, const Progress& progress) {
  std::vector<std::vector<std::size_t>> batches;
  if (cache_.size() <= cache_.capacity()) {
    batches.emplace_back(links.size());
    for (std::size_t i = 0; i < links.size(); ++i) batches.front()[i] = i;
  } else {
    batches = batch_links(links, cache_.capacity());
  }
  tbb::task_arena arena(settings_.threads == 0 ? tbb::task_arena::automatic
                                               : static_cast<int>(settings_.threads));
  std::mutex reporting;
  std::size_t done = 0;
  arena.execute([&] {
    for (const std::vector<std::size_t>& batch : batches) {
      cache_.load(scans_of(links, batch));
      for_each_index(batch.size(), [&](std::size_t at) {
        const std::size_t i = batch[at];
        const ScanLink& link = links[i];
        sums[i] = sum_link(cache_.at(link.j), map_from_scan[link.j], cache_.at(link.k), map_from_scan[link.k],
                           pass, settings_);
        if (!progress) return;
        const std::lock_guard lock(reporting);
        progress(++done, links.size());
      });
    }
  });
}

}  // namespace alces::offline
