// alces: the companion on the desk. Builds the command line, runs one verb, turns what went wrong into one
// sentence on stderr and an exit status.
#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <vector>

#include "alces_platform/doing.h"
#include "command.h"
#include "extension.h"
#include "nearest.h"
#include "offline/io/files/error.h"
#include "offline/optimize/processes.h"

namespace alces::offline {
namespace {

#ifndef ALCES_VERSION
#define ALCES_VERSION "0.1.0"
#endif

constexpr const char* program_footer = R"(Examples:
  alces info scans/                                  what is in there?
  alces map scans/ --out town                        scans -> a consistent map in the folder town/
  alces replay drive.mcap --out town                 a recorded drive -> the same
  alces simulate --scans 60 --out drive.mcap         a drive to try it with, and its ground truth
  alces evaluate town --truth truth.tum              error against ground truth, as in the paper's Table 1
  alces evaluate town --consistency scans/           how well the visits of a place agree, without ground truth
  alces render town --out town.png                   a picture to look at
  alces optimize town --out town2                    the best poses that its graph allows
  alces report town --out town.html                  a page to send to a colleague
  alces calibrate standing.mcap --out mounting.toml  how the lasers and the head are mounted, from full turns at rest

'alces VERB --help' explains a verb. Frames are REP 103's (x forward, y left, z up), units are SI.

Exit status: 0 done, 2 usage, 3 unreadable or invalid input, 4 a capacity reached, 5 a device failed or a file cannot be written.)";

enum ExitStatus : int { done = 0, defect = 1, usage = 2, capacity = 4, output = 5 };

constexpr const char* unwritten_answer = "standard output cannot be written; the answer is not whole";

int complain(int status, const std::string& sentence) {
  // not fmt::print, which throws when standard error cannot be written either
  if (processes().rank() == 0) std::fprintf(stderr, "alces: %s\n", sentence.c_str());
  return status;
}

/// Without the heap: there may be none left to say it with.
int complain_of_memory() noexcept {
  if (processes().rank() != 0) return capacity;
  const char* const doing = Doing::what();
  std::fputs("alces: the machine has not enough memory", stderr);
  if (*doing != '\0') {
    std::fputs(" (", stderr);
    std::fputs(doing, stderr);
    std::fputs(")", stderr);
  }
  std::fputs("; nothing was replaced. Close other programs, or give less: --memory, fewer scans\n", stderr);
  return capacity;
}

int hint(const CLI::App& alces) {
  if (processes().rank() > 0) return usage;
  const auto verbs = alces.get_subcommands();
  fmt::print(stderr, "Try 'alces {}--help'.\n", verbs.empty() ? "" : verbs.front()->get_name() + " ");
  return usage;
}

std::vector<std::string> verb_names(CLI::App& alces) {
  std::vector<std::string> names;
  for (const CLI::App* verb : alces.get_subcommands({})) names.push_back(verb->get_name());
  return names;
}

/// What CLI says of a word that it does not know, and what that word was probably meant to be.
std::string complaint(CLI::App& alces, const CLI::ParseError& error, int argc, char** argv) {
  const std::vector<std::string> names = verb_names(alces);
  const std::string first = argc > 1 ? argv[1] : "";
  if (!first.empty() && first[0] != '-' && std::find(names.begin(), names.end(), first) == names.end()) {
    const std::string nearest = nearest_word(first, names);
    return fmt::format("there is no verb {}{}", first,
                       nearest.empty() ? "" : "; did you mean " + nearest + "?");
  }
  std::string sentence = error.what();
  const auto verbs = alces.get_subcommands();
  if (verbs.empty() || error.get_exit_code() != static_cast<int>(CLI::ExitCodes::ExtrasError))
    return sentence;
  std::vector<std::string> options;
  for (const CLI::Option* option : verbs.front()->get_options())
    for (const std::string& name : option->get_lnames()) options.push_back("--" + name);
  for (const std::string& word : verbs.front()->remaining()) {
    const std::string given = word.substr(0, word.find('='));
    if (!given.starts_with("--")) continue;
    if (const std::string nearest = nearest_word(given, options); !nearest.empty())
      return fmt::format("{} has no option {}; did you mean {}?", verbs.front()->get_name(), given, nearest);
  }
  return sentence;
}

int run(int argc, char** argv) {
  CLI::App alces{"Loop-closing 6D SLAM: maps from 3D laser scans, and what to do with them on the desk.",
                 "alces"};
  alces.set_version_flag("--version", "alces " ALCES_VERSION);
  alces.footer(program_footer);
  alces.require_subcommand(1);

  add_map_command(alces);
  add_evaluate_command(alces);
  add_render_command(alces);
  add_report_command(alces);
  add_info_command(alces);
  add_replay_command(alces);
  add_simulate_command(alces);
  add_explain_can_command(alces);
  add_convert_command(alces);
  add_optimize_command(alces);
  add_calibrate_command(alces);
  for (const Extension add_verbs : extensions()) add_verbs(alces);

  const Doing verb(argc > 1 ? argv[1] : "", argc > 2 ? argv[2] : "");
  try {
    alces.parse(argc, argv);
    // what went to a full disk is not said
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) return complain(output, unwritten_answer);
    return done;
  } catch (const CLI::Success& success) {  // --help, --version
    return alces.exit(success);
  } catch (const CLI::ParseError& error) {
    complain(usage, complaint(alces, error, argc, argv));
    return hint(alces);
  } catch (const UsageError& error) {
    complain(usage, error.what());
    return hint(alces);
  } catch (const Error& error) {
    return complain(error.exit_status(), error.what());
  } catch (const std::bad_alloc&) {
    return complain_of_memory();
  } catch (const std::filesystem::filesystem_error& error) {
    return complain(output, fmt::format("{}: {}", error.path1().string(), error.code().message()));
  } catch (const std::exception& error) {
    if (std::ferror(stdout) != 0 || std::ferror(stderr) != 0) return complain(output, unwritten_answer);
    return complain(defect, fmt::format("{} (a defect of alces; please report it)", error.what()));
  }
}

}  // namespace
}  // namespace alces::offline

int main(int argc, char** argv) {
  alces::offline::join_processes(&argc, &argv);
  const int status = alces::offline::run(argc, argv);
  alces::offline::leave_processes(status);
  return status;
}
