#include "alces_drivers/cola_b/frame.h"

#include <algorithm>

namespace alces::cola_b {
namespace {

constexpr std::uint8_t stx = 0x02;
constexpr std::size_t header_bytes = 8;
constexpr std::uint8_t first_letter = 's';  // of every command: sRA, sAN, sSN, sFA, ...

std::uint8_t checksum(std::span<const std::uint8_t> payload) {
  unsigned sum = 0;
  for (const std::uint8_t byte : payload) sum ^= byte;
  return static_cast<std::uint8_t>(sum);
}

}  // namespace

std::size_t build_frame(std::span<const std::uint8_t> payload, std::span<std::uint8_t> out) {
  const std::size_t size = payload.size() + frame_overhead_bytes;
  if (payload.empty() || payload.size() > maximum_payload_bytes || out.size() < size) return 0;
  std::fill_n(out.begin(), 4, stx);
  for (std::size_t i = 0; i < 4; ++i)
    out[4 + i] = static_cast<std::uint8_t>(payload.size() >> (24 - 8 * i) & 0xffU);
  std::copy(payload.begin(), payload.end(), out.begin() + header_bytes);
  out[size - 1] = checksum(payload);
  return size;
}

bool FrameParser::may_work(std::size_t bytes) {
  if (work_bytes_ > work_limit_bytes) return false;
  work_bytes_ += bytes;
  if (work_bytes_ <= work_limit_bytes) return true;
  ++counters_.overloads;
  discard();
  return false;
}

std::size_t FrameParser::push(std::span<const std::uint8_t> bytes) {
  const bool is_full = bytes.size() > bytes_.size() - end_;
  if (work_bytes_ > work_limit_bytes || (is_full && begin_ > 0 && !may_work(end_ - begin_))) {
    counters_.bytes_skipped += bytes.size();
    return bytes.size();
  }
  if (is_full && begin_ > 0) {
    std::copy(bytes_.begin() + static_cast<std::ptrdiff_t>(begin_),
              bytes_.begin() + static_cast<std::ptrdiff_t>(end_), bytes_.begin());
    end_ -= begin_;
    begin_ = 0;
  }
  const std::size_t count = std::min(bytes.size(), bytes_.size() - end_);
  std::copy_n(bytes.begin(), count, bytes_.begin() + static_cast<std::ptrdiff_t>(end_));
  end_ += count;
  return count;
}

void FrameParser::skip(std::size_t count) {
  begin_ += count;
  counters_.bytes_skipped += count;
}

std::optional<std::span<const std::uint8_t>> FrameParser::next() {
  while (pending_bytes() > 0) {
    const std::span<const std::uint8_t> rest(bytes_.data() + begin_, pending_bytes());
    std::size_t starts = 0;
    while (starts < std::min<std::size_t>(4, rest.size()) && rest[starts] == stx) ++starts;
    if (starts < 4) {
      if (starts == rest.size()) return std::nullopt;
      skip(starts + 1);  // the byte that is no STX begins nothing either
      continue;
    }
    if (rest.size() < header_bytes) return std::nullopt;
    const std::size_t length = static_cast<std::size_t>(rest[4]) << 24 |
                               static_cast<std::size_t>(rest[5]) << 16 |
                               static_cast<std::size_t>(rest[6]) << 8 | rest[7];
    if (length == 0 || length > maximum_payload_bytes) {
      ++counters_.bad_lengths;
      skip(1);
      continue;
    }
    const std::size_t size = length + frame_overhead_bytes;
    if (rest.size() > header_bytes && rest[header_bytes] != first_letter) {
      skip(1);
      continue;
    }
    if (rest.size() < size) return std::nullopt;
    const std::span<const std::uint8_t> payload = rest.subspan(header_bytes, length);
    if (!may_work(size)) return std::nullopt;
    if (checksum(payload) != rest[size - 1]) {
      ++counters_.checksum_errors;
      skip(1);
      continue;
    }
    begin_ += size;
    ++counters_.frames;
    return payload;
  }
  return std::nullopt;
}

void FrameParser::discard() {
  skip(pending_bytes());
  begin_ = 0;
  end_ = 0;
}

}  // namespace alces::cola_b
