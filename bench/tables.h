// What the benchmarks print with: time, medians, Markdown tables.
#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstddef>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace alces::bench {

class Stopwatch {
 public:
  [[nodiscard]] double ms() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin_).count();
  }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

class Samples {
 public:
  void add(double value) { values_.push_back(value); }
  [[nodiscard]] std::size_t size() const { return values_.size(); }
  /// All 0 without values.
  [[nodiscard]] double median() const;
  [[nodiscard]] double mean() const;
  [[nodiscard]] double worst() const;

 private:
  std::vector<double> values_;
};

/// The result of a computation is used, says this to the compiler.
template <typename T>
void keep(const T& value) {
  asm volatile("" : : "r"(&value) : "memory");
}

/// Title and circumstances: processor, load average at the start.
void print_heading(std::string_view title);
void print_row(std::initializer_list<std::string> cells);
/// A row of column names and the line below it.
void print_header(std::initializer_list<std::string> names);
/// A line that is written over, on a terminal.
void print_progress(std::size_t done, std::size_t total);

/// main() with what every benchmark needs of it: options, errors as sentences.
int run(int argc, char** argv, CLI::App& app, const std::function<void()>& body);

}  // namespace alces::bench
