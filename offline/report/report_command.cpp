// alces report: a map as a page to send to somebody.
#include <fmt/core.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "offline/io/files/byte_size.h"
#include "offline/io/files/error.h"
#include "offline/io/files/json_text.h"
#include "offline/program/command.h"
#include "report.h"

namespace alces::offline {
namespace {

struct ReportOptions {
  std::string map_folder;
  std::string html;
  std::string title;
  std::string limit;
  std::string comparison;
  bool full = false;
  bool json = false;
};

constexpr const char* report_footer = R"(Examples:
  alces report town --out town.html                      the page; open it in any browser, without a network
  alces report town --out town.html --full               every point, to the millimetre, however large
  alces report town --out town.html --limit 8MB          small enough for a mail
  alces report town --out town.html --compare tables/    with the tables and plots of 'alces compare'

One HTML file with everything in it: the map as a 3D point cloud to turn and zoom, the drive before and after loops were
closed, each loop with its overlap before and after, refused loops and why, what every scan took and how well it matched,
memory and time against the plan, and, of a replay, faults and counters on a time line. Where the points do not all fit
the limit, an even choice of them is taken, and the page says so.

Exit status: 0 done, 2 usage, 3 unreadable or invalid input, 4 no room within the limit, 5 a device failed or a file cannot be written,
or this program was built without the page.)";

/// "alces: packing the points" on one line of a terminal.
class Stages {
 public:
  ~Stages() {
    if (is_terminal_) fmt::print(stderr, "\r\033[K");
  }
  void operator()(const char* stage) const {
    if (!is_terminal_) return;
    fmt::print(stderr, "\r\033[Kalces: {} ...", stage);
    std::fflush(stderr);
  }

 private:
  bool is_terminal_ = isatty(STDERR_FILENO) == 1;
};

void report(const ReportOptions& options) {
  const std::string extension = std::filesystem::path(options.html).extension().string();
  if (!extension.empty() && extension != ".html" && extension != ".htm") {
    throw UsageError(fmt::format(
        "--out {}: an HTML page is written; give it a name that ends in .html (a browser prints it as PDF)",
        options.html));
  }
  ReportSettings settings;
  settings.title = options.title;
  settings.full = options.full;
  if (!options.comparison.empty()) settings.comparison = options.comparison;
  if (!options.limit.empty()) {
    const auto limit = parse_byte_size(options.limit);
    if (!limit) throw UsageError(fmt::format("--limit {}: write a size as 8MB or 64MiB", options.limit));
    if (options.full) throw UsageError("--full and --limit exclude each other");
    settings.limit_bytes = *limit;
  }
  ReportSummary summary;
  {
    const Stages stages;
    summary =
        write_report(options.map_folder, options.html, settings, [&stages](const char* s) { stages(s); });
  }
  if (options.json) {
    const nlohmann::json json = {{"out", options.html},
                                 {"file_bytes", summary.file_bytes},
                                 {"points", summary.points},
                                 {"points_shown", summary.points_shown},
                                 {"not_finite", summary.not_finite},
                                 {"far_off", summary.far_off},
                                 {"loops_closed", summary.loops_closed},
                                 {"loops_refused", summary.loops_refused}};
    fmt::print("{}\n", json_text(json));
    return;
  }
  fmt::print("{}: {:.1f} MB, {} of {} points{}; {} loops closed, {} refused\n", options.html,
             static_cast<double>(summary.file_bytes) * 1e-6, summary.points_shown, summary.points,
             summary.points_shown < summary.points && !options.full ? " (all of them: --full)" : "",
             summary.loops_closed, summary.loops_refused);
  if (summary.not_finite + summary.far_off > 0)
    fmt::print(
        stderr,
        "alces: warning: {} points that are not finite and {} more than 2 km off the drive are left out\n",
        summary.not_finite, summary.far_off);
}

}  // namespace

void add_report_command(CLI::App& alces) {
  auto options = std::make_shared<ReportOptions>();
  CLI::App* verb = alces.add_subcommand("report", "A page of a map to send to somebody: one HTML file.");
  verb->footer(report_footer);
  verb->add_option("OUT", options->map_folder, "a map folder")->required();
  verb->add_option("--out", options->html, "the HTML file to write")->required();
  verb->add_option("--title", options->title, "above the page; the map folder's name unless given");
  verb->add_flag("--full", options->full, "every point, to the millimetre");
  verb->add_option("--limit", options->limit, "the file is to be no larger")->default_str("25MB");
  verb->add_option("--compare", options->comparison,
                   "a folder of tables (.csv) and pictures (.png, .svg) to show");
  verb->add_flag("--json", options->json, "for machines");
  verb->callback([options] { report(*options); });
}

}  // namespace alces::offline
