// can-utils' text: what candump writes with -l or -L, and what it shows on the screen.
//
//   (1436509052.249713) can0 181#2104FFFF00000000 R        -l, and with -x the direction
//   (1436509052.249713)  can0  181   [8]  21 04 FF FF 00 00 00 00   '!.......'      on the screen: -t a, -a
//     can0  RX - -  181   [8]  21 04 ...                   without time stamps, -x
//
// Understood: time stamps absolute, with date, from zero, as differences, and none; 11 and 29 bits; remote
// frames (R, R4, "remote request"); FD (## and two-digit lengths); error frames (bit 29 of the id); swapped
// (-S) and binary (-i) bytes; colours; lengths above 8 of classical frames (_9 to _F, {9}: the length is 8).
// Not: CAN XL. Source: can-utils, candump.c and lib.c, 2011 to 2024.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "alces_platform/replay/event_source.h"
#include "alces_platform/replay/line_reader.h"

namespace alces::replay {

struct CandumpOptions {
  /// Differences and times from zero look alike; `automatic` takes them for differences when one of the first
  /// 64 is smaller than the one before.
  enum class Stamps : std::uint8_t { automatic, as_written, differences };

  Stamps stamps = Stamps::automatic;
  std::int64_t pace_ns = 1'000'000;  ///< from line to line where there are no time stamps
  /// The interface of each bus. Empty: can1 is bus 1, slcan0 bus 0; other names take the free ones in their
  /// order.
  std::vector<std::string> interfaces;
};

class CandumpReader final : public EventSource {
 public:
  /// TraceError when the file cannot be opened.
  explicit CandumpReader(const std::filesystem::path& file, CandumpOptions options = {});

  [[nodiscard]] bool next(Event& event) override;
  [[nodiscard]] std::string name() const override { return lines_.name(); }
  [[nodiscard]] TraceProblems problems() const override { return problems_; }
  [[nodiscard]] std::uint64_t bytes_read() const override { return lines_.bytes_read(); }

  /// Is this a line that the reader takes for a frame? Its frame and direction are in `event` then.
  [[nodiscard]] static bool is_frame(std::string_view line, Event& event);

 private:
  struct Read {
    Event event;
    bool has_stamp = false;
    bool may_be_difference = false;
  };
  [[nodiscard]] bool read(Read& read);
  void read_ahead();
  [[nodiscard]] int bus_of(std::string_view interface);

  LineReader lines_;
  CandumpOptions options_;
  std::array<std::string, 4> interfaces_;
  std::deque<Read> ahead_;
  bool looked_ahead_ = false;
  bool are_differences_ = false;
  std::int64_t last_stamp_ns_ = 0;
  bool is_first_ = true;
  TraceProblems problems_;
};

/// One frame as candump -l -x writes it, with the line's end. Its six decimals cut the stamp to whole
/// microseconds: canplayer and log2asc take no more. Frames that no bus carries (a remote frame with data,
/// classical with more than 8 bytes) do not come back as they were.
void append_candump(std::string& text, const Event& event, std::string_view interface);

}  // namespace alces::replay
