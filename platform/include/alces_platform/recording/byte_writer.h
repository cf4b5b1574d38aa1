// Little-endian numbers into a span, one after the other. It goes on counting past the end, so that a dry run
// over an empty span says how much room the same calls need.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>

namespace alces {

static_assert(std::endian::native == std::endian::little,
              "recordings are written as the machine stores numbers");

class ByteWriter {
 public:
  explicit ByteWriter(std::span<std::uint8_t> room) : room_(room) {}

  template <typename Number>
  void number(Number value) {
    static_assert(std::is_arithmetic_v<Number>);
    raw(&value, sizeof value);
  }
  void u8(std::uint8_t value) { number(value); }
  void u16(std::uint16_t value) { number(value); }
  void u32(std::uint32_t value) { number(value); }
  void u64(std::uint64_t value) { number(value); }
  void bytes(std::span<const std::uint8_t> bytes) { raw(bytes.data(), bytes.size()); }
  /// MCAP's String: 32-bit length, then the bytes.
  void string(std::string_view text) {
    u32(static_cast<std::uint32_t>(text.size()));
    raw(text.data(), text.size());
  }
  void raw(const void* data, std::size_t size) {
    if (size != 0 && position_ <= room_.size() && size <= room_.size() - position_)
      std::memcpy(room_.data() + position_, data, size);
    position_ += size;
  }

  /// Overwrites what was written before, a length that is known only now.
  template <typename Number>
  void patch(std::size_t position, Number value) {
    if (position + sizeof value <= room_.size()) std::memcpy(room_.data() + position, &value, sizeof value);
  }

  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] bool overflowed() const { return position_ > room_.size(); }
  /// What was written; nothing after an overflow.
  [[nodiscard]] std::span<const std::uint8_t> written() const {
    return overflowed() ? std::span<const std::uint8_t>() : room_.first(position_);
  }

 private:
  std::span<std::uint8_t> room_;
  std::size_t position_ = 0;
};

/// The way back. A read past the end gives zeros and is remembered.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <typename Number>
  [[nodiscard]] Number number() {
    Number value{};
    const std::span<const std::uint8_t> from = bytes(sizeof value);
    if (from.size() == sizeof value) std::memcpy(&value, from.data(), sizeof value);
    return value;
  }
  [[nodiscard]] std::uint8_t u8() { return number<std::uint8_t>(); }
  [[nodiscard]] std::uint16_t u16() { return number<std::uint16_t>(); }
  [[nodiscard]] std::uint32_t u32() { return number<std::uint32_t>(); }
  [[nodiscard]] std::uint64_t u64() { return number<std::uint64_t>(); }
  [[nodiscard]] std::span<const std::uint8_t> bytes(std::uint64_t size) {
    if (size > bytes_.size() - position_) {
      failed_ = true;
      position_ = bytes_.size();
      return {};
    }
    const auto piece = bytes_.subspan(position_, static_cast<std::size_t>(size));
    position_ += piece.size();
    return piece;
  }
  [[nodiscard]] std::string_view string() {
    const std::uint32_t size = u32();
    const std::span<const std::uint8_t> text = bytes(size);
    return {reinterpret_cast<const char*>(text.data()), text.size()};
  }

  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - position_; }
  [[nodiscard]] bool failed() const { return failed_; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t position_ = 0;
  bool failed_ = false;
};

}  // namespace alces
