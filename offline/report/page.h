// The page as the build made it of offline/report: an HTML file with its program and style, and marks where a
// report puts what it has to say.
#pragma once

#include <string_view>
#include <vector>

namespace alces::offline {

/// Starts with "<!doctype html>", or with "missing: " and why the build could not make it.
[[nodiscard]] std::string_view report_page();

/// Up to a mark, <!--alces:NAME-->, and its name; the last piece has none.
struct PagePiece {
  std::string_view text;
  std::string_view mark;
};
/// Error when there is no page.
[[nodiscard]] std::vector<PagePiece> page_pieces();

}  // namespace alces::offline
