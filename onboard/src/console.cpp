#include "alces_onboard/console.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>

namespace alces::onboard {
namespace {

constexpr std::string_view clear_line = "\r\033[K";

/// syslog's, as sd-daemon(3) has it.
const char* priority(Severity severity) {
  switch (severity) {
    case Severity::info:
      return "<6>";
    case Severity::warning:
      return "<4>";
    case Severity::error:
      return "<3>";
  }
  return "";
}

}  // namespace

ConsoleConfig console_config(std::int64_t begin_ns) {
  ConsoleConfig config;
  config.begin_ns = begin_ns;
  config.is_terminal = isatty(STDERR_FILENO) == 1;
  config.has_journal = !config.is_terminal && std::getenv("JOURNAL_STREAM") != nullptr;
  winsize size{};
  if (config.is_terminal && ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0) config.columns = size.ws_col;
  return config;
}

void Console::write(std::string_view line) {
  if (!out_.write({reinterpret_cast<const std::uint8_t*>(line.data()), line.size()})) ++lines_lost_;
}

void Console::raise(const Notice& notice) {
  std::array<char, 32> when{};
  if (config_.has_journal) {
    std::snprintf(when.data(), when.size(), "%s", priority(notice.severity));
  } else {
    std::snprintf(when.data(), when.size(), "[%9.3f] ", seconds(notice.stamp_ns - config_.begin_ns));
  }
  std::array<char, 32> value{};
  if (notice.has_value)
    std::snprintf(value.data(), value.size(), notice.is_hexadecimal ? " (0x%" PRIX64 ")" : " (%" PRId64 ")",
                  notice.value);
  std::array<char, line_bytes> line{};
  const int count =
      std::snprintf(line.data(), line.size(), "%s%s%s: %s: %s%s\n", is_line_open_ ? clear_line.data() : "",
                    when.data(), to_string(notice.severity), notice.source, notice.text, value.data());
  is_line_open_ = false;
  if (count > 0) write({line.data(), std::min(static_cast<std::size_t>(count), line.size() - 1)});
}

void Console::show_status(std::string_view text, std::int64_t now_ns) {
  std::array<char, line_bytes> line{};
  int count = 0;
  if (config_.is_terminal) {
    if (config_.columns > 1) text = text.substr(0, config_.columns - 1);
    count = std::snprintf(line.data(), line.size(), "%s%.*s", clear_line.data(),
                          static_cast<int>(text.size()), text.data());
    is_line_open_ = true;
  } else {
    if (shown_ns_ != no_stamp_ns && now_ns - shown_ns_ < config_.quiet_interval_ns) return;
    shown_ns_ = now_ns;
    if (config_.has_journal) {
      count =
          std::snprintf(line.data(), line.size(), "<6>%.*s\n", static_cast<int>(text.size()), text.data());
    } else {
      count = std::snprintf(line.data(), line.size(), "[%9.3f] %.*s\n", seconds(now_ns - config_.begin_ns),
                            static_cast<int>(text.size()), text.data());
    }
  }
  if (count > 0) write({line.data(), std::min(static_cast<std::size_t>(count), line.size() - 1)});
}

void Console::end() {
  if (is_line_open_) write("\n");
  is_line_open_ = false;
}

bool DescriptorSink::write(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    } else if (written < 0 && errno != EINTR && errno != EAGAIN) {
      return true;
    } else if (written < 0 && errno == EAGAIN) {
      return false;
    }
  }
  return true;
}

}  // namespace alces::onboard
