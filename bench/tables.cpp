#include "tables.h"

#include <fmt/core.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <fstream>
#include <numeric>

namespace alces::bench {
namespace {

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown processor";
}

}  // namespace

double Samples::median() const {
  if (values_.empty()) return 0;
  std::vector<double> values = values_;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double Samples::mean() const {
  if (values_.empty()) return 0;
  return std::accumulate(values_.begin(), values_.end(), 0.0) / static_cast<double>(values_.size());
}

double Samples::worst() const {
  return values_.empty() ? 0 : *std::max_element(values_.begin(), values_.end());
}

void print_heading(std::string_view title) {
  double load[1] = {0};
  if (getloadavg(load, 1) != 1) load[0] = std::nan("");
  fmt::print("### {}\n\n{}, one thread; load average at the start {:.1f} on {} cores.\n\n", title,
             processor(), load[0], sysconf(_SC_NPROCESSORS_ONLN));
}

void print_row(std::initializer_list<std::string> cells) {
  for (const std::string& cell : cells) fmt::print("| {} ", cell);
  fmt::print("|\n");
  std::fflush(stdout);
}

void print_header(std::initializer_list<std::string> names) {
  print_row(names);
  for (std::size_t i = 0; i < names.size(); ++i) fmt::print("|---");
  fmt::print("|\n");
}

void print_progress(std::size_t done, std::size_t total) {
  if (isatty(STDERR_FILENO) == 0) return;
  if (done < total) {
    fmt::print(stderr, "\r{} of {} ", done, total);
  } else {
    fmt::print(stderr, "\r\033[K");
  }
}

int run(int argc, char** argv, CLI::App& app, const std::function<void()>& body) {
  try {
    app.parse(argc, argv);
    body();
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", argv[0], error.what());
    return 3;
  }
  return 0;
}

}  // namespace alces::bench
