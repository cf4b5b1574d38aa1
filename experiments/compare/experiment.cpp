#include "experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "drive_observer.h"
#include "offline/io/files/error.h"
#include "offline/io/files/output_file.h"
#include "online_row.h"
#include "post_row.h"

namespace alces::offline {
namespace {

// Whose poses say where the drive came by again: the first of these that is there.
constexpr std::array<std::string_view, 8> best_first = {"elch+lum", "elch",        "lum",       "hogman",
                                                        "toro",     "elch+hogman", "elch+toro", "icp"};

/// Pairs of places in the source, of scans that every row has.
std::vector<PairGroup> pair_groups(const std::vector<RowResult>& rows, const ExperimentRequest& request,
                                   std::size_t scan_count) {
  std::vector<std::size_t> has(scan_count);
  for (const RowResult& row : rows)
    for (const std::size_t scan : row.source_index) ++has[scan];
  std::vector<PairGroup> groups = neighbour_pairs(scan_count);
  PairGroup revisits{"revisits", {}};
  if (request.revisits) {
    revisits.pairs = *request.revisits;
  } else {
    for (const std::string_view key : best_first) {
      const auto row =
          std::find_if(rows.begin(), rows.end(), [&](const RowResult& each) { return each.row.key == key; });
      if (row == rows.end()) continue;
      for (const auto& [a, b] : find_revisits(row->trajectory.poses).pairs)
        revisits.pairs.emplace_back(static_cast<std::uint32_t>(row->source_index[a]),
                                    static_cast<std::uint32_t>(row->source_index[b]));
      break;
    }
  }
  groups.push_back(std::move(revisits));
  for (PairGroup& group : groups)
    group.pairs.erase(std::remove_if(group.pairs.begin(), group.pairs.end(),
                                     [&](const ScanPair& pair) {
                                       return has[pair.first] < rows.size() || has[pair.second] < rows.size();
                                     }),
                      group.pairs.end());
  return groups;
}

void measure(std::vector<RowResult>& rows, SpooledScanSource& scans, const ExperimentRequest& request,
             const ExperimentCallbacks& callbacks) {
  const std::vector<PairGroup> groups = pair_groups(rows, request, scans.size());
  for (RowResult& row : rows) {
    if (callbacks.stop_signal)
      if (const int signal = callbacks.stop_signal(); signal != 0) throw interrupted(row.row, signal);
    std::vector<Pose> map_from_scan(scans.size());
    for (std::size_t i = 0; i < row.source_index.size(); ++i)
      map_from_scan[row.source_index[i]] = row.trajectory.poses[i];
    RowConsistency consistency;
    consistency.groups =
        measure_consistency(scans, map_from_scan, groups, {}, [&](std::size_t done, std::size_t total) {
          if (callbacks.progress) callbacks.progress(row.row.title, "residuals between scans", done, total);
        });
    consistency.entropy =
        measure_map_entropy(scans, map_from_scan, {}, [&](std::size_t done, std::size_t total) {
          if (callbacks.progress) callbacks.progress(row.row.title, "map entropy", done, total);
        });
    row.consistency = std::move(consistency);
  }
}

void finish_row(RowResult& row, const ExperimentRequest& request) {
  if (!request.truth) return;
  TruthError against = error_against(*request.truth, row.trajectory.poses, row.source_index);
  row.error = std::move(against.error);
  row.error_scans = std::move(against.poses);
}

}  // namespace

ExperimentResult run_experiment(SpooledScanSource& scans, const ExperimentRequest& wanted,
                                const ExperimentCallbacks& callbacks) {
  ExperimentRequest request = wanted;
  if (request.truth && request.watched.empty()) request.watched = scans_to_watch(*request.truth);
  ExperimentResult result;
  result.warnings = scans.warnings();
  if (request.truth && request.truth->known < scans.size())
    result.warnings.push_back(
        fmt::format("{} of {} scans have no ground truth and do not count in the errors",
                    scans.size() - request.truth->known, scans.size()));
  std::optional<RowResult> elch;  // what post-processing starts from
  SharedLinks links;
  try {
    for (const CompareRow& row : request.rows) {
      std::optional<RowResult> done;
      if (row.post == PostMethod::none) {
        done = run_online_row(row, scans, request, callbacks);
        if (row.online == OnlineMethod::elch) elch = done;
      } else {
        if (!elch) {
          const CompareRow base = select_rows("elch").front();
          elch = run_online_row(base, scans, request, callbacks);
        }
        done = run_post_row(row, *elch, scans, request, callbacks, links);
      }
      finish_row(*done, request);
      if (row.post == PostMethod::none)  // the others' are those of ELCH
        for (const std::string& warning : done->warnings)
          result.warnings.push_back(fmt::format("{}: {}", row.title, warning));
      if (callbacks.finished) callbacks.finished(*done);
      result.rows.push_back(std::move(*done));
    }
    if (request.measures_consistency && !result.rows.empty()) measure(result.rows, scans, request, callbacks);
  } catch (const Error& error) {
    result.problem = error;
  }
  return result;
}

}  // namespace alces::offline
