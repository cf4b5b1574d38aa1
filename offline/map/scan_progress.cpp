#include "scan_progress.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>

namespace alces::offline {

ScanProgress::ScanProgress()
    : is_terminal_(isatty(STDERR_FILENO) == 1), begin_(Clock::now()), shown_(begin_) {}

ScanProgress::~ScanProgress() {
  if (is_shown_) fmt::print(stderr, "\r\033[K");
}

void ScanProgress::operator()(std::size_t done, std::size_t total) {
  const Clock::time_point now = Clock::now();
  if (!is_terminal_ || total == 0 || done == 0) return;
  if (now - shown_ < std::chrono::milliseconds(100) && done < total) return;
  shown_ = now;
  is_shown_ = true;
  constexpr std::size_t width = 30;
  const std::size_t filled = std::min(width, width * done / total);
  const double elapsed_s = std::chrono::duration<double>(now - begin_).count();
  const double rate = static_cast<double>(done) / std::max(elapsed_s, 1e-6);
  const auto left_s = static_cast<long>(static_cast<double>(total - std::min(done, total)) / rate + 0.5);
  const std::string left =
      left_s < 120 ? fmt::format("{} s", left_s) : fmt::format("{} min", (left_s + 30) / 60);
  fmt::print(stderr, "\r\033[K[{}{}] {}/{} scans  {:.0f} a second  {} left", std::string(filled, '#'),
             std::string(width - filled, '.'), done, total, rate, left);
  std::fflush(stderr);
}

}  // namespace alces::offline
