// The links' sums shared out over a group of processes, each with its own scans and cores.
//
// Rank 0 sends poses and links, every rank sums an equal stretch of the links, rank 0 puts the stretches
// together in the order of the links. A link's sums do not depend on who computes them, so the poses are
// those of one process bit for bit (same build, same processor). Scans are read where they lie: every rank
// opens the source itself and loads what its stretch needs. A rank that fails (a scan that cannot be read)
// says so instead of its sums; rank 0 throws that.
#pragma once

#include "link_sum_source.h"
#include "process_group.h"

namespace alces::offline {

/// Rank 0's side. Its end releases the others from serve_link_sums().
class SharedLinkSums final : public LinkSumSource {
 public:
  /// All three outlive it.
  SharedLinkSums(ProcessGroup& group, LinkSumSource& own) : group_(group), own_(own) {}
  ~SharedLinkSums() override;

  void sum(std::span<const ScanLink> links, std::span<const Pose> map_from_scan, const LinkPass& pass,
           std::span<LinkSums> sums, const Progress& progress) override;

 private:
  ProcessGroup& group_;
  LinkSumSource& own_;
};

/// The other ranks' side: sums what rank 0 asks for until it is released.
void serve_link_sums(ProcessGroup& group, LinkSumSource& own);

/// The same for a rank that could not even begin: answers with `problem`.
void refuse_link_sums(ProcessGroup& group, const std::string& problem);

}  // namespace alces::offline
