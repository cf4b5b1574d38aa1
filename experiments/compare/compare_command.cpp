// alces compare: the paper's experiment on one's own data.
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compare_command.h"
#include "experiment.h"
#include "offline/evaluate/circular_truth.h"
#include "offline/evaluate/evaluation.h"
#include "offline/io/files/byte_size.h"
#include "offline/io/files/error.h"
#include "offline/io/files/json_text.h"
#include "offline/io/files/output_file.h"
#include "offline/io/files/stop_signal.h"
#include "offline/io/scans/scan_source.h"
#include "offline/map/map_and_write.h"
#include "offline/map/mapper_settings.h"
#include "offline/map/memory_plan.h"
#include "offline/program/command.h"
#include "offline/replay/drive_replay.h"
#include "plots.h"
#include "tables.h"

namespace alces::offline {
namespace {

namespace fs = std::filesystem;

#ifndef ALCES_VERSION
#define ALCES_VERSION "0.1.0"
#endif

struct CompareOptions {
  std::string input;
  std::string out;
  std::string truth;
  std::string only;
  std::string odometry;
  std::string front_end = "default";
  std::string config;
  std::string memory = "64MiB";
  std::string pairs;
  std::string align = "none";
  double max_time_difference_s = 0.02;
  std::vector<std::size_t> watch;
  std::uint32_t threads = 0;
  bool consistency = false;
  bool no_plots = false;
  bool json = false;
};

constexpr const char* compare_footer = R"(Examples:
  alces compare drive.mcap --truth drive.truth.tum --out tables    Tables 1 and 2 of the paper, and its figures
  alces compare scans/ --truth truth.tum --out tables --only icp,elch,elch+lum
  alces compare scans/ --out tables                                without ground truth: how consistent the maps are
  alces compare scans/ --truth truth.tum --out tables --watch 344 --watch 556
  alces compare scans/ --truth truth.tum --out tables --front-end paper

Maps the same scans with every strategy of the paper, each into a map folder of its own below OUT:
  icp          scans matched one to the next, no loops
  lum          all scans relaxed with each other whenever an approach to an earlier place ends
  elch         loops closed with LOA                    toro, hogman   the same loops, these optimisers in LOA's place
  elch+lum     ELCH, and LUM once at the end            elch+toro, elch+hogman   LUM's links matched, then optimised

OUT/tables.md, tables.csv and compare.json hold error and run time; OUT/plots the figures (SVG, PNG) with the gnuplot
scripts and data that draw them. Nothing is re-aligned unless --align first lays the first scans upon each other.

Without --truth there are no errors, only consistency: residuals between scans that see the same surfaces at the map's
poses, for the same pairs in every map.

Ctrl-C ends the strategy at work; the finished ones stay and are written.

Exit status: 0 done, 2 usage, 3 unreadable or invalid input, 4 a capacity reached, 5 a device failed or a file cannot be written,
130 Ctrl-C.)";

/// "alces: ELCH & LUM, iteration 7 1200/4223" on one line of a terminal, ten times a second at most.
class StageLine {
 public:
  ~StageLine() { clear(); }
  void clear() {
    if (is_shown_) fmt::print(stderr, "\r\033[K");
    is_shown_ = false;
  }
  void operator()(std::string_view row, std::string_view stage, std::size_t done, std::size_t total) {
    const Clock::time_point now = Clock::now();
    if (!is_terminal_ || now - shown_ < std::chrono::milliseconds(100)) return;
    shown_ = now;
    is_shown_ = true;
    fmt::print(stderr, "\r\033[Kalces: {}, {} {}/{}", row, stage, done, total);
    std::fflush(stderr);
  }

 private:
  using Clock = std::chrono::steady_clock;
  bool is_terminal_ = isatty(STDERR_FILENO) == 1;
  bool is_shown_ = false;
  Clock::time_point shown_;
};

struct Input {
  std::unique_ptr<ScanSource> scans;
  MapRequest map;
};

bool is_drive(const fs::path& input) {
  std::error_code ignored;
  return input.extension() == ".mcap" || fs::exists(input / "vehicle.toml", ignored);
}

Input open_input(const CompareOptions& options) {
  Input input;
  if (is_drive(options.input)) {
    if (!options.odometry.empty()) throw UsageError("--odometry: a drive has odometry of its own");
    auto drive = std::make_unique<DriveReplay>(options.input, DriveReplayOptions{});
    input.map.config = drive->settings().mapper;
    input.map.config.scan_capacity = 0;
    input.map.config.pool_bytes = 0;
    if (options.front_end == "paper") input.map.config = default_settings(FrontEnd::paper);
    input.scans = std::move(drive);
  } else {
    input.map.config = default_settings(options.front_end == "paper" ? FrontEnd::paper : FrontEnd::standard);
    ScanSourceOptions source_options;
    choose_odometry(options.odometry, source_options);
    input.scans = open_scans(options.input, source_options);
  }
  if (!options.config.empty()) read_settings(options.config, input.map.config);
  const auto memory = parse_byte_size(options.memory);
  if (!memory) throw UsageError(fmt::format("--memory {}: write a size as 64MiB", options.memory));
  input.map.memory_bytes = *memory;
  MapperConfig sized = input.map.config;  // by the same table for all rows
  sized.scan_capacity = static_cast<std::uint32_t>(std::max<std::size_t>(input.scans->size(), 1));
  fit_cell_capacity(sized, *memory, *input.scans);
  input.map.config.voxel.cell_capacity = sized.voxel.cell_capacity;
  return input;
}

std::vector<std::size_t> watched_scans(const std::vector<std::size_t>& numbers, const ScanSource& scans) {
  std::vector<std::size_t> places;
  for (const std::size_t number : numbers) {
    std::size_t place = 0;
    while (place < scans.size() && scans.number(place) != number) ++place;
    if (place == scans.size())
      throw UsageError(
          fmt::format("--watch {}: there is no scan of this number ({})", number, scans.description()));
    places.push_back(place);
  }
  return places;
}

std::string line_of(const RowResult& row) {
  std::string text =
      fmt::format("{:<15}{:>4} loops {:>9.2f} s", row.row.title, row.loops_closed, row.times.total_s);
  if (row.error)
    text += fmt::format("   {:.3f} m, x and y {:.3f} m, rotation {:.3f} deg", row.error->translation_m.mean,
                        row.error->translation_xy_m.mean, row.error->quaternion_angle_deg.mean);
  return text;
}

void compare(const CompareOptions& options) {
  const std::vector<CompareRow> rows = select_rows(options.only);
  Input input = open_input(options);
  make_folder(options.out);
  { const OutputFile trial(fs::path(options.out) / "compare.json"); }  // never committed: can it be written?

  const StopSignal stop;
  StageLine line;
  SpooledScanSource scans(*input.scans, options.out, [&](std::size_t done, std::size_t total) {
    line("reading", "scans", done, total);
    if (stop.received() != 0)
      throw Error("interrupted while the scans were read; nothing is written", 128 + stop.received());
  });
  if (scans.size() < 2)
    throw InputError(options.input,
                     fmt::format("has {} scans; two are the least to compare with", scans.size()));

  ExperimentRequest request;
  request.map = input.map;
  request.lum.threads = options.threads;
  request.lum.voxel = request.map.config.voxel;
  request.rows = rows;
  request.out = options.out;
  if (!options.truth.empty())
    request.truth =
        read_scan_truth(options.truth, scans, options.align == "first" ? Alignment::first : Alignment::none,
                        options.max_time_difference_s);
  std::optional<std::string> circular;
  if (request.truth) circular = why_circular(*input.scans, options.truth, request.truth->truth_from_body);
  if (circular) fmt::print(stderr, "alces: warning: {}\n", *circular);
  request.watched = watched_scans(options.watch, scans);
  request.measures_consistency = options.consistency || options.truth.empty();
  if (!options.pairs.empty()) request.revisits = read_pairs(options.pairs, scans.size());
  request.program = {ALCES_VERSION, command_line(), options.front_end, {}, {}};
  request.program.source = {{"paths", {fs::absolute(options.input).lexically_normal().string()}}};

  const ExperimentResult result =
      run_experiment(scans, request,
                     {.progress = [&](std::string_view row, std::string_view stage, std::size_t done,
                                      std::size_t total) { line(row, stage, done, total); },
                      .finished =
                          [&](const RowResult& row) {
                            line.clear();
                            if (!options.json) fmt::print(stderr, "{}\n", line_of(row));
                          },
                      .stop_signal = [&] { return stop.received(); }});
  line.clear();
  for (const std::string& warning : result.warnings) fmt::print(stderr, "alces: warning: {}\n", warning);

  const ExperimentFacts facts{scans.description(),       options.truth, options.front_end,
                              to_json(input.map.config), ALCES_VERSION, command_line(),
                              circular.value_or("")};
  if (!result.rows.empty()) {
    write_tables(options.out, result, facts);
    fmt::print("{}", options.json ? json_text(experiment_json(result, facts)) + "\n"
                                  : markdown_tables(result, facts));
    std::fflush(stdout);
    if (!options.no_plots) {
      const PlotReport plots = write_plots(options.out, result, request);
      for (const std::string& sentence : plots.left_out) fmt::print(stderr, "alces: {}\n", sentence);
      if (!plots.problem.empty()) fmt::print(stderr, "alces: warning: {}\n", plots.problem);
    }
  }
  if (result.problem)
    throw Error(fmt::format("{} ({} of {} rows are finished, and whole in {})", result.problem->what(),
                            result.rows.size(), rows.size(), options.out),
                result.problem->exit_status());
}

}  // namespace

void add_compare_command(CLI::App& alces) {
  auto options = std::make_shared<CompareOptions>();
  CLI::App* verb = alces.add_subcommand(
      "compare", "The paper's experiment: ICP, LUM, ELCH, TORO, HOG-Man on the same scans.");
  verb->footer(compare_footer);
  verb->add_option("SCANS|DRIVE", options->input, "a folder of scans, or a recorded drive")->required();
  verb->add_option("--out", options->out, "the folder for maps, tables and plots")->required();
  CLI::Option* truth =
      verb->add_option("--truth", options->truth, "the true trajectory: TUM, KITTI, 3DTK, 4x4");
  verb->add_option("--only", options->only, "these rows, separated by commas");
  verb->add_option("--odometry", options->odometry, "rough poses instead of those beside the scans");
  verb->add_option("--front-end", options->front_end, "how scans are matched")
      ->check(CLI::IsMember({"default", "paper"}))
      ->capture_default_str();
  verb->add_option("--config", options->config,
                   "a TOML file with the numbers that differ (alces map --print-config)");
  verb->add_option("--memory", options->memory, "for the mapper; what does not fit goes to a file in OUT")
      ->capture_default_str();
  verb->add_option("--align", options->align,
                   "lay the first scans upon each other (first), or nothing (none)")
      ->check(CLI::IsMember({"none", "first"}))
      ->capture_default_str()
      ->needs(truth);
  verb->add_option("--max-time-difference", options->max_time_difference_s, "s, for poses to belong together")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->needs(truth);
  verb->add_option("--watch", options->watch,
                   "numbers of scans whose convergence is plotted; not given: three")
      ->needs(truth);
  verb->add_flag("--consistency", options->consistency, "measure it with ground truth, too");
  verb->add_option("--pairs", options->pairs,
                   "revisits as JSON [[a, b], ...] instead of those found in the poses");
  verb->add_option("--threads", options->threads, "of the relaxation; 0: one a core")->capture_default_str();
  verb->add_flag("--no-plots", options->no_plots, "tables only");
  verb->add_flag("--json", options->json, "print compare.json instead of tables for people");
  verb->callback([options] { compare(*options); });
}

}  // namespace alces::offline
