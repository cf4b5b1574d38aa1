#include "command.h"

#include <fmt/core.h>
#include <unistd.h>

#include <utility>

namespace alces::offline {

Progress::Progress(std::string label) : label_(std::move(label)), is_terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (shown_percent_ >= 0) fmt::print(stderr, "\r\033[K");
}

void Progress::operator()(std::size_t done, std::size_t total) {
  if (!is_terminal_ || total == 0) return;
  const int percent = static_cast<int>(100 * done / total);
  if (percent == shown_percent_) return;
  shown_percent_ = percent;
  fmt::print(stderr, "\r\033[Kalces: {:3} % {}", percent, label_);
  std::fflush(stderr);
}

}  // namespace alces::offline
