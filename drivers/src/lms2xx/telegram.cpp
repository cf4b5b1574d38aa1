#include "alces_drivers/lms2xx/telegram.h"

#include <algorithm>

namespace alces::lms2xx {

std::uint16_t crc16(std::span<const std::uint8_t> bytes) {
  constexpr unsigned polynomial = 0x8005;
  unsigned crc = 0;
  unsigned previous = 0;
  for (const unsigned byte : bytes) {
    const bool carry = (crc & 0x8000U) != 0;
    crc = (crc << 1) & 0xffffU;
    if (carry) crc ^= polynomial;
    crc ^= byte | (previous << 8);
    previous = byte;
  }
  return static_cast<std::uint16_t>(crc);
}

std::size_t build_telegram(Direction direction, std::uint8_t address, std::uint8_t command,
                           std::span<const std::uint8_t> data, std::uint8_t status,
                           std::span<std::uint8_t> out) {
  const bool has_status = direction == Direction::from_laser;
  const std::size_t length = 1 + data.size() + (has_status ? 1 : 0);
  if (length > maximum_length || out.size() < length + frame_bytes) return 0;
  std::size_t size = 0;
  out[size++] = stx_byte;
  out[size++] = static_cast<std::uint8_t>(has_status ? (address | from_laser_bit) : address);
  out[size++] = static_cast<std::uint8_t>(length & 0xff);
  out[size++] = static_cast<std::uint8_t>(length >> 8);
  out[size++] = command;
  for (const std::uint8_t byte : data) out[size++] = byte;
  if (has_status) out[size++] = status;
  const std::uint16_t crc = crc16(out.first(size));
  out[size++] = static_cast<std::uint8_t>(crc & 0xff);
  out[size++] = static_cast<std::uint8_t>(crc >> 8);
  return size;
}

void TelegramParser::push(std::uint8_t byte) {
  if (work_bytes_ > work_limit_bytes) {
    ++position_;
    ++counters_.bytes_skipped;
    return;
  }
  if (end_ == bytes_.size()) {
    if (begin_ == 0) {  // next() was not called: cannot be a telegram
      ++begin_;
      ++counters_.bytes_skipped;
    }
    std::copy(bytes_.begin() + static_cast<std::ptrdiff_t>(begin_), bytes_.end(), bytes_.begin());
    end_ -= begin_;
    begin_ = 0;
  }
  bytes_[end_++] = byte;
  ++position_;
}

bool TelegramParser::is_expected(std::uint8_t address) const {
  return ((address & from_laser_bit) != 0) == (direction_ == Direction::from_laser);
}

std::optional<TelegramParser::Token> TelegramParser::next() {
  while (pending_bytes() >= needed_bytes_ && pending_bytes() > 0) {
    const std::span<const std::uint8_t> rest(bytes_.data() + begin_, pending_bytes());
    needed_bytes_ = 1;
    if (rest[0] == ack_byte || rest[0] == nak_byte) {
      ++begin_;
      return Token{rest[0] == ack_byte ? Kind::ack : Kind::nak, {}, position_ - pending_bytes()};
    }
    if (rest[0] != stx_byte) {
      ++begin_;
      ++counters_.bytes_skipped;
      continue;
    }
    if (rest.size() < 4) {
      if (rest.size() >= 2 && !is_expected(rest[1])) {
        ++counters_.bad_headers;
        ++counters_.bytes_skipped;
        ++begin_;
        continue;
      }
      needed_bytes_ = rest.size() + 1;
      return std::nullopt;
    }
    const std::size_t length = rest[2] + 256U * rest[3];
    const std::size_t least_length = direction_ == Direction::from_laser ? 2 : 1;
    if (!is_expected(rest[1]) || length < least_length || length > maximum_length) {
      ++counters_.bad_headers;
      ++counters_.bytes_skipped;
      ++begin_;
      continue;
    }
    const std::size_t size = length + frame_bytes;
    if (rest.size() < size) {
      needed_bytes_ = size;
      return std::nullopt;
    }
    work_bytes_ += size;
    if (work_bytes_ > work_limit_bytes) {
      ++counters_.overloads;
      discard();
      return std::nullopt;
    }
    if (crc16(rest.first(size - 2)) != rest[size - 2] + 256U * rest[size - 1]) {
      ++counters_.crc_errors;
      ++counters_.bytes_skipped;
      ++begin_;
      continue;
    }
    begin_ += size;
    ++counters_.telegrams;
    Telegram telegram{rest[1], rest[4], rest.subspan(5, length - 1), 0, size};
    if (direction_ == Direction::from_laser) {
      telegram.status = telegram.data.back();
      telegram.data = telegram.data.first(telegram.data.size() - 1);
    }
    return Token{Kind::telegram, telegram, position_ - pending_bytes()};
  }
  return std::nullopt;
}

void TelegramParser::resynchronise() {
  if (pending_bytes() == 0) return;
  ++counters_.truncated;
  ++counters_.bytes_skipped;
  ++begin_;
  needed_bytes_ = 1;
}

void TelegramParser::discard() {
  counters_.bytes_skipped += pending_bytes();
  begin_ = end_;
  needed_bytes_ = 1;
}

}  // namespace alces::lms2xx
