// A byte channel's raw bytes in one file, when they came in another: laser_a.bin and laser_a.times. The
// second has a line for each piece that arrived, "stamp_ns byte_count"; where there is none, the bytes come
// at the line's own pace.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "alces_platform/replay/event_source.h"
#include "alces_platform/replay/line_reader.h"

namespace alces::replay {

struct RawBytesOptions {
  std::uint8_t channel = laser_a_channel;
  bool is_sent = false;
  std::int64_t begin_ns = 0;     ///< without times: of the first byte
  std::uint32_t baud = 500'000;  ///< without times: bits a second, 10 a byte
};

class RawBytesReader final : public EventSource {
 public:
  static constexpr std::size_t largest_piece = std::size_t{64} << 20;
  static constexpr std::int64_t piece_ns = 10'000'000;  ///< without times: as a serial driver hands them on

  /// `times` may be missing. TraceError when `bytes` cannot be opened.
  RawBytesReader(const std::filesystem::path& bytes, const std::filesystem::path& times,
                 RawBytesOptions options);

  [[nodiscard]] bool next(Event& event) override;
  [[nodiscard]] std::string name() const override { return name_; }
  [[nodiscard]] TraceProblems problems() const override { return problems_; }
  [[nodiscard]] std::uint64_t bytes_read() const override { return bytes_read_; }
  [[nodiscard]] bool has_times() const { return times_.has_value(); }

 private:
  /// Stamp and size of the next piece. False: the times are at their end.
  [[nodiscard]] bool next_time(std::int64_t& stamp_ns, std::size_t& size);

  std::ifstream stream_;
  std::string name_;
  RawBytesOptions options_;
  std::optional<LineReader> times_;
  std::vector<std::uint8_t> piece_;
  std::int64_t last_stamp_ns_ = 0;
  std::uint64_t bytes_read_ = 0;
  bool times_ended_ = false;
  TraceProblems problems_;
};

/// One line of the .times file.
void append_time(std::string& text, std::int64_t stamp_ns, std::size_t size);

}  // namespace alces::replay
