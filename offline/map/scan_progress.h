// A bar for work that goes scan by scan.
#pragma once

#include <chrono>
#include <cstddef>

namespace alces::offline {

/// "[#####.....] 231/469 scans  76 a second  3 s left" on one line of stderr if that is a terminal, nothing
/// otherwise; ten times a second at most. The line goes away with the object.
class ScanProgress {
 public:
  ScanProgress();
  ~ScanProgress();
  ScanProgress(const ScanProgress&) = delete;
  ScanProgress& operator=(const ScanProgress&) = delete;

  void operator()(std::size_t done, std::size_t total);

 private:
  using Clock = std::chrono::steady_clock;
  bool is_terminal_;
  bool is_shown_ = false;
  Clock::time_point begin_;
  Clock::time_point shown_;
};

}  // namespace alces::offline
