// Telegrams of the SICK LMS 2xx serial interface ("Telegrams for operating/configuring the LMS 2xx", SICK
// 8007954, chapters 2 and 3): STX, address, length, command, data, [status], CRC. All numbers little-endian.
//
//   02 | address | length (2) | command | data ... | status (from the laser only) | CRC (2)
//
// `length` counts command, data and status. The host writes the laser's address; the laser answers with 0x80
// added. Every telegram that reached the laser whole is acknowledged with the single byte ACK, every broken
// one with NAK.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace alces::lms2xx {

inline constexpr std::uint8_t stx_byte = 0x02;
inline constexpr std::uint8_t ack_byte = 0x06;
inline constexpr std::uint8_t nak_byte = 0x15;
inline constexpr std::uint8_t from_laser_bit = 0x80;  ///< in the address
inline constexpr std::uint8_t reply_bit = 0x80;       ///< in the command: 0x20 is answered by 0xA0

inline constexpr std::size_t maximum_length = 812;  ///< of command, data and status
inline constexpr std::size_t frame_bytes = 6;       ///< STX, address, length, CRC
inline constexpr std::size_t maximum_telegram_bytes = maximum_length + frame_bytes;

/// SICK's CRC-16 over everything before the CRC: polynomial 0x8005, each step mixing in two successive bytes.
[[nodiscard]] std::uint16_t crc16(std::span<const std::uint8_t> bytes);

/// Who sent it: only the laser's telegrams end in a status byte.
enum class Direction : std::uint8_t { from_laser, from_host };

struct Telegram {
  std::uint8_t address = 0;
  std::uint8_t command = 0;
  std::span<const std::uint8_t> data;  ///< without command and status
  std::uint8_t status = 0;             ///< 0 in a telegram from the host
  std::size_t wire_bytes = 0;          ///< the whole of it
};

/// Writes a telegram into `out` and answers its size; 0: it does not fit (out too small, data too long).
[[nodiscard]] std::size_t build_telegram(Direction direction, std::uint8_t address, std::uint8_t command,
                                         std::span<const std::uint8_t> data, std::uint8_t status,
                                         std::span<std::uint8_t> out);

/// Finds telegrams and acknowledgements in a stream of bytes that may be split anywhere and hold anything. A
/// telegram with a bad header or checksum gives back all of its bytes but the first, so that a good one
/// inside it, or begun before it ended, is found. So that a stream of false headers costs no more time than
/// there is, at most work_limit_bytes are summed between two calls of allow_work(): then all is skipped until
/// the next one.
class TelegramParser {
 public:
  /// Of 700 telegrams: nine seconds of a laser at 75 a second. About 0.5 ms of a desk PC.
  static constexpr std::size_t work_limit_bytes = std::size_t{256} << 10;

  enum class Kind : std::uint8_t { telegram, ack, nak };
  struct Token {
    Kind kind = Kind::telegram;
    Telegram telegram;               ///< its data are the parser's, valid until the next push()
    std::uint64_t end_position = 0;  ///< bytes pushed up to and with its last one
  };
  struct Counters {
    std::uint64_t telegrams = 0;
    std::uint64_t crc_errors = 0;
    std::uint64_t bad_headers = 0;    ///< STX, but an address or length that cannot be
    std::uint64_t bytes_skipped = 0;  ///< that belong to no telegram
    std::uint64_t truncated = 0;      ///< telegrams given up by resynchronise()
    std::uint64_t overloads = 0;      ///< times that the work was too much
    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("telegrams", telegrams);
      visit("crc_errors", crc_errors);
      visit("bad_headers", bad_headers);
      visit("bytes_skipped", bytes_skipped);
      visit("truncated_telegrams", truncated);
      visit("overloads", overloads);
    }
  };

  explicit TelegramParser(Direction direction) : direction_(direction) {}

  /// To be followed by next() until it answers nothing.
  void push(std::uint8_t byte);
  [[nodiscard]] std::optional<Token> next();

  /// The rest of a begun telegram will not come: its first byte is skipped, the others are looked through
  /// again by next(). Does nothing when there is none.
  void resynchronise();
  /// Time has passed (a tick).
  void allow_work() { work_bytes_ = 0; }
  /// All pending bytes are skipped: the line's rate changed.
  void discard();
  /// Bytes of a begun telegram.
  [[nodiscard]] std::size_t pending_bytes() const { return end_ - begin_; }
  /// Bytes pushed so far.
  [[nodiscard]] std::uint64_t position() const { return position_; }
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  [[nodiscard]] bool is_expected(std::uint8_t address) const;

  Direction direction_;
  std::array<std::uint8_t, 1024> bytes_{};
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::size_t needed_bytes_ = 1;  ///< pending bytes below which next() need not look
  std::uint64_t position_ = 0;
  std::size_t work_bytes_ = 0;
  Counters counters_;
};

}  // namespace alces::lms2xx
