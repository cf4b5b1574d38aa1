// The verbs of `alces`, one file each: NAME_command.cpp adds its CLI::App and does its work in the callback.
// A new verb is a line in this list and a line in main.cpp.
//
// A callback that returns is exit status 0. It ends in another way by throwing an Error of error.h, which
// knows its exit status; CLI's own parse errors are 2.
#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <string>

namespace alces::offline {

void add_map_command(CLI::App& alces);
void add_evaluate_command(CLI::App& alces);
void add_render_command(CLI::App& alces);
void add_report_command(CLI::App& alces);
void add_info_command(CLI::App& alces);
void add_replay_command(CLI::App& alces);
void add_simulate_command(CLI::App& alces);
void add_explain_can_command(CLI::App& alces);
void add_convert_command(CLI::App& alces);
void add_optimize_command(CLI::App& alces);
void add_calibrate_command(CLI::App& alces);

/// "alces: 37 % label" on one line of stderr if that is a terminal, nothing otherwise; the line goes away
/// with the object. Calls may come from several threads one after the other.
class Progress {
 public:
  explicit Progress(std::string label);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void operator()(std::size_t done, std::size_t total);

 private:
  std::string label_;
  bool is_terminal_;
  int shown_percent_ = -1;
};

}  // namespace alces::offline
