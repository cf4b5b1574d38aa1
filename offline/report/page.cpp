#include "page.h"

#include <fmt/format.h>

#include <string>

#include "offline/io/files/error.h"
#include "report.h"

// The page lies in the program itself: one file that works wherever it is copied, and never a page of another
// version. The assembler reads the bytes, so that the compiler need not.
__asm__(
    ".section .rodata\n"
    ".balign 16\n"
    "alces_report_page_begin:\n"
    ".incbin \"" ALCES_REPORT_PAGE
    "\"\n"
    "alces_report_page_end:\n"
    ".byte 0\n"
    ".previous\n");

extern "C" {
// NOLINTBEGIN(modernize-avoid-c-arrays): the linker's symbols, whose addresses are what counts
extern const char alces_report_page_begin[];
extern const char alces_report_page_end[];
// NOLINTEND(modernize-avoid-c-arrays)
}

namespace alces::offline {

std::string_view report_page() {
  return {alces_report_page_begin, static_cast<std::size_t>(alces_report_page_end - alces_report_page_begin)};
}

std::string page_problem() {
  constexpr std::string_view missing = "missing: ";
  const std::string_view page = report_page();
  if (page.substr(0, missing.size()) != missing) return "";
  std::string_view why = page.substr(missing.size());
  while (!why.empty() && why.back() == '\n') why.remove_suffix(1);
  return fmt::format(
      "this alces was built without the page of its reports: {}; install Node.js and npm (Debian: nodejs "
      "npm), "
      "see that npm reaches its registry, and build again",
      why);
}

std::vector<PagePiece> page_pieces() {
  if (const std::string problem = page_problem(); !problem.empty()) throw Error(problem, 5);
  constexpr std::string_view mark_begin = "<!--alces:";
  constexpr std::string_view mark_end = "-->";
  std::string_view rest = report_page();
  std::vector<PagePiece> pieces;
  for (std::size_t at = rest.find(mark_begin); at != std::string_view::npos; at = rest.find(mark_begin)) {
    const std::size_t name = at + mark_begin.size();
    const std::size_t end = rest.find(mark_end, name);
    if (end == std::string_view::npos) break;
    pieces.push_back({rest.substr(0, at), rest.substr(name, end - name)});
    rest.remove_prefix(end + mark_end.size());
  }
  pieces.push_back({rest, {}});
  return pieces;
}

}  // namespace alces::offline
