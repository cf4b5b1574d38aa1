#include "compare_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>

#include "offline/io/files/error.h"

namespace alces::offline {
namespace {

// Okabe and Ito's colours, which people with colour-blind eyes tell apart; darker where they stand for
// something that goes on from a lighter one.
constexpr std::array<CompareRow, 8> all_rows{{
    {"icp", "ICP", OnlineMethod::icp, PostMethod::none, "#999999"},
    {"lum", "LUM", OnlineMethod::lum, PostMethod::none, "#e69f00"},
    {"elch", "ELCH", OnlineMethod::elch, PostMethod::none, "#0072b2"},
    {"toro", "TORO", OnlineMethod::toro, PostMethod::none, "#009e73"},
    {"hogman", "HOG-Man", OnlineMethod::hogman, PostMethod::none, "#cc79a7"},
    {"elch+lum", "ELCH & LUM", OnlineMethod::elch, PostMethod::lum, "#d55e00"},
    {"elch+toro", "ELCH & TORO", OnlineMethod::elch, PostMethod::toro, "#56b4e9"},
    {"elch+hogman", "ELCH & HOG-Man", OnlineMethod::elch, PostMethod::hogman, "#882255"},
}};

}  // namespace

std::span<const CompareRow> compare_rows() {
  return all_rows;
}

std::vector<CompareRow> select_rows(std::string_view comma_separated) {
  if (comma_separated.empty()) return {all_rows.begin(), all_rows.end()};
  std::array<bool, all_rows.size()> is_selected{};
  while (true) {
    const std::size_t comma = comma_separated.find(',');
    const std::string_view key = comma_separated.substr(0, comma);
    const auto* const row = std::find_if(all_rows.begin(), all_rows.end(),
                                         [&](const CompareRow& each) { return each.key == key; });
    if (row == all_rows.end()) {
      std::string known;
      for (const CompareRow& each : all_rows)
        known += fmt::format("{}{}", known.empty() ? "" : ", ", each.key);
      throw UsageError(fmt::format("--only {}: there is no such row; rows are {}", key, known));
    }
    is_selected.at(static_cast<std::size_t>(row - all_rows.begin())) = true;
    if (comma == std::string_view::npos) break;
    comma_separated.remove_prefix(comma + 1);
  }
  std::vector<CompareRow> selected;
  for (std::size_t i = 0; i < all_rows.size(); ++i)
    if (is_selected.at(i)) selected.push_back(all_rows.at(i));
  return selected;
}

}  // namespace alces::offline
