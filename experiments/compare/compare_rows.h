// The eight rows of the paper's Tables 1 and 2: what closes loops while driving, and what comes afterwards.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace alces::offline {

/// What bends the map when a loop is closed during the drive. `lum` relaxes all scans so far with each other,
/// every time (paper, Figure 3).
enum class OnlineMethod : std::uint8_t { icp, lum, elch, toro, hogman };

/// What is done once with the finished map (paper, Figure 8, below the dashed line).
enum class PostMethod : std::uint8_t { none, lum, toro, hogman };

struct CompareRow {
  std::string_view key;    ///< for --only, and the name of its map folder
  std::string_view title;  ///< as in the paper's tables
  OnlineMethod online;
  PostMethod post;
  std::string_view color;  ///< in all plots, #rrggbb
};

/// In the order of the paper.
[[nodiscard]] std::span<const CompareRow> compare_rows();

/// "elch,elch+lum" to rows in the paper's order, empty: all. UsageError that lists the names.
[[nodiscard]] std::vector<CompareRow> select_rows(std::string_view comma_separated);

}  // namespace alces::offline
