// What the benchmarks share: where scans come from, time, medians, Markdown tables.
#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "alces/point.h"
#include "alces/pose.h"
#include "alces_platform/sim/drive.h"

namespace alces::bench {

/// A real folder, or the town when none is named.
struct Drive {
  std::size_t size = 0;
  std::function<void(std::size_t, std::vector<Point>&)> points;
  std::vector<Pose> odometry;
  std::vector<Pose> truth;  ///< empty: none is known
  std::string name;
};

class DriveOptions {
 public:
  void add_to(CLI::App& app);
  [[nodiscard]] Drive open() const;

 private:
  std::string folder_;
  std::size_t scans_ = 924;
  std::uint64_t seed_ = 1;
  std::size_t returned_points_ = 35000;
};

/// Thinned out to a point a cell, as the mapper does it.
[[nodiscard]] std::vector<Point> reduced(const std::vector<Point>& points, float cell_size_m);

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
