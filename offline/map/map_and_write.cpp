#include "map_and_write.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <utility>

#include "alces_platform/doing.h"
#include "offline/io/files/error.h"
#include "offline/io/files/input_file.h"
#include "offline/io/files/json_text.h"
#include "offline/io/files/stop_signal.h"
#include "offline/io/map_folder/map_health.h"
#include "offline/io/map_folder/run_report.h"
#include "scan_progress.h"
#include "scratch_archive.h"

namespace alces::offline {
namespace {

constexpr std::size_t most_warnings_shown = 10;

void print_warnings(const std::vector<std::string>& warnings) {
  for (std::size_t i = 0; i < std::min(warnings.size(), most_warnings_shown); ++i)
    fmt::print(stderr, "alces: warning: {}\n", warnings[i]);
  if (warnings.size() > most_warnings_shown)
    fmt::print(stderr, "alces: warning: {} more warnings, all are in run.json\n",
               warnings.size() - most_warnings_shown);
}

/// Of a drive without a map, as of a laser alone: what its devices went through is worth knowing all the
/// same.
void print_drive(const nlohmann::json& drive, bool json) {
  if (json) {
    fmt::print("{}\n", json_text(nlohmann::json{{"drive", drive}}));
  } else {
    fmt::print("counters of the drive\n");
    for (const auto& [part, counters] : drive["counters"].items()) {
      for (const auto& [counter, value] : counters.items())
        if (value != 0) fmt::print("  {}.{}: {}\n", part, counter, value.get<std::uint64_t>());
    }
  }
  std::fflush(stdout);
}

/// Whether a map is there that was made to its end.
bool holds_whole_map(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(folder / "run.json", ignored)) return false;
  std::string bytes;
  read_file(folder / "run.json", bytes);
  const nlohmann::json run = nlohmann::json::parse(bytes, nullptr, false);
  return run.is_object() && run.value("complete", nlohmann::json()) == true;
}

}  // namespace

void warn_of_bad_map(const nlohmann::json& report) {
  const auto verdict = report.find("verdict");
  if (verdict != report.end() && *verdict == "bad")
    fmt::print(stderr, "alces: warning: {}\n", verdict_line(report));
}

std::vector<std::string> command_line() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(file, word, '\0');) words.push_back(word);
  return words;
}

void map_and_write(ScanSource& scans, const MapRequest& asked, const std::filesystem::path& out,
                   ProgramFacts program, bool json, const std::function<void(ProgramFacts&)>& describe) {
  const StopSignal stop;
  StagedFolder stage(out);  // can it be written? Nothing changes there before the map is whole.
  MapRequest request = asked;
  request.is_stopped = [&stop] { return stop.received() != 0; };
  std::optional<ScratchArchive> scratch;
  // On the desk a drive is mapped to its end, in the memory that is given: what it has no room for lies
  // beside.
  if (!asked.archive) request.archive = stage.staging().string() + ".archive";
  const Doing making("making the mapper for", out.string());
  MapRun run(scans, request);
  if (!asked.archive) scratch.emplace(*request.archive);  // now it is ours: the run overwrites no other file
  {
    const Doing mapping("mapping", scans.description());
    ScanProgress progress;
    run.run({[&progress](std::size_t done, std::size_t total) { progress(done, total); },
             [&stop] { return stop.received(); }});
  }
  print_warnings(run.warnings());
  if (run.mapper().scan_count() == 0) {
    if (describe) describe(program);
    if (!program.drive.is_null()) print_drive(program.drive, json);
    if (run.problem()) throw Error(*run.problem());
    throw InputError(
        fmt::format("none of the scans could be mapped ({}); nothing is written", scans.description()));
  }
  if (describe) describe(program);
  nlohmann::json report;
  const Doing writing("writing the map", out.string());
  std::filesystem::path written = out;
  try {
    if (run.problem() && holds_whole_map(out)) {  // half a map takes no whole one's place
      if (!written.has_filename()) written = written.parent_path();
      written += ".partial";
      report = write_map_folder(written, run, program);
    } else {
      report = write_map_folder(stage, run, program);
    }
  } catch (const Error&) {
    if (run.problem()) fmt::print(stderr, "alces: {}\n", run.problem()->what());
    throw;
  }
  warn_of_bad_map(report);
  fmt::print("{}", json ? json_text(report) + "\n" : run_summary(run, report));
  const std::uint32_t archived = run.mapper().store_counters().archived_scans;
  if (scratch && archived > 0 && !json)
    fmt::print("  the pool was full after {} scans; the others went to {}, which is removed again\n",
               run.mapper().scan_count() - archived, request.archive->string());
  if (run.problem()) {
    std::fflush(stdout);
    throw Error(
        fmt::format("{} (the {} scans before are in {}{})", run.problem()->what(), run.mapper().scan_count(),
                    written.string(), written == out ? "" : "; the whole map of before stays"),
        run.problem()->exit_status());
  }
}

}  // namespace alces::offline
