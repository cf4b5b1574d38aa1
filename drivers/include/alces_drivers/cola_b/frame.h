// Frames of SICK's CoLa B ("Telegram listing", SICK 8014631, section 2.1), on TCP:
//
//   02 02 02 02 | length (4, big-endian) | payload | XOR of the payload's bytes
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace alces::cola_b {

inline constexpr std::size_t frame_overhead_bytes = 9;
/// An LMS 5xx telegram with one channel of 1141 ranges has 2.4 KB; with five echoes it would have 11.6 KB.
inline constexpr std::size_t maximum_payload_bytes = 16384;

/// Writes a frame into `out` and answers its size; 0: it does not fit.
[[nodiscard]] std::size_t build_frame(std::span<const std::uint8_t> payload, std::span<std::uint8_t> out);

/// Finds frames in a stream of bytes that may be split anywhere and hold anything. A frame with a bad length,
/// payload (it begins with "s") or checksum gives back all of its bytes but the first. So that a stream of
/// false headers costs no more time than there is, at most `work_limit_bytes` are summed and moved between
/// two calls of allow_work(): then whatever comes is skipped until the next one. 16 KiB.
class FrameParser {
 public:
  /// A frame is summed once and moved once or twice: this is 20 of the longest. About 0.2 ms of a desk PC.
  static constexpr std::size_t work_limit_bytes = std::size_t{1} << 20;

  struct Counters {
    std::uint64_t frames = 0;
    std::uint64_t checksum_errors = 0;
    std::uint64_t bad_lengths = 0;  ///< none, or longer than maximum_payload_bytes
    std::uint64_t bytes_skipped = 0;
    std::uint64_t overloads = 0;  ///< times that the work was too much
    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("frames", frames);
      visit("checksum_errors", checksum_errors);
      visit("bad_lengths", bad_lengths);
      visit("bytes_skipped", bytes_skipped);
      visit("overloads", overloads);
    }
  };

  /// Takes as many bytes as there is room for, at least one once next() answered nothing, and answers how
  /// many.
  [[nodiscard]] std::size_t push(std::span<const std::uint8_t> bytes);
  /// The next payload: the parser's, valid until the next push().
  [[nodiscard]] std::optional<std::span<const std::uint8_t>> next();
  /// Time has passed (a tick).
  void allow_work() { work_bytes_ = 0; }
  /// The connection was lost: pending bytes are skipped.
  void discard();
  /// Bytes that are taken but not part of a frame handed out.
  [[nodiscard]] std::size_t pending_bytes() const { return end_ - begin_; }
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  void skip(std::size_t count);
  /// False: too much since the last allow_work(); what is pending is skipped.
  [[nodiscard]] bool may_work(std::size_t bytes);

  std::array<std::uint8_t, maximum_payload_bytes + frame_overhead_bytes> bytes_{};
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::size_t work_bytes_ = 0;
  Counters counters_;
};

}  // namespace alces::cola_b
