// What alcesd says while it runs: notices as they come, each with time and severity, and how things are.
//
//   [   12.345] warning: motor: heartbeat lost (1)
//
// Times are seconds since the start. On a terminal the status is one line that is refreshed once a second and
// cut to its width; elsewhere it is a line every ten seconds. Under systemd ($JOURNAL_STREAM) lines carry the
// journal's priority, and no time: it has its own. Nothing here waits or allocates: lines go to a ByteSink,
// and those that it does not take are counted.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "alces_drivers/port/notice_port.h"
#include "alces_drivers/stamp.h"
#include "alces_platform/recording/byte_sink.h"

namespace alces::onboard {

struct ConsoleConfig {
  bool is_terminal = false;
  bool has_journal = false;
  std::uint32_t columns = 0;  ///< of the terminal; 0: not known, nothing is cut
  std::int64_t begin_ns = 0;
  std::int64_t quiet_interval_ns = 10 * ns_per_s;  ///< between status lines where there is no terminal
};

/// As standard error is now.
[[nodiscard]] ConsoleConfig console_config(std::int64_t begin_ns);

class Console final : public NoticePort {
 public:
  Console(const ConsoleConfig& config, ByteSink& out) : config_(config), out_(out) {}

  void raise(const Notice& notice) override;
  /// Once a second.
  void show_status(std::string_view line, std::int64_t now_ns);
  /// The terminal's line ends; what follows starts on a new one.
  void end();

  [[nodiscard]] std::uint64_t lines_lost() const { return lines_lost_; }

 private:
  static constexpr std::size_t line_bytes = 1024;
  void write(std::string_view line);

  ConsoleConfig config_;
  ByteSink& out_;
  bool is_line_open_ = false;
  std::int64_t shown_ns_ = no_stamp_ns;
  std::uint64_t lines_lost_ = 0;
};

/// A descriptor as a ByteSink. What cannot be written because nobody reads any more counts as written.
class DescriptorSink final : public ByteSink {
 public:
  explicit DescriptorSink(int descriptor) : descriptor_(descriptor) {}
  [[nodiscard]] bool write(std::span<const std::uint8_t> bytes) override;

 private:
  int descriptor_;
};

}  // namespace alces::onboard
