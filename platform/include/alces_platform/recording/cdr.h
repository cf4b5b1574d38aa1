// ROS 2's message encoding: CDR, little endian, XCDR version 1 (OMG Common Data Representation, as DDS
// carries it). Four bytes of header (00 01 00 00), then the fields in order, each number aligned to its own
// size counted from behind the header; strings are a 32-bit length that counts the closing 0, then the bytes;
// sequences a 32-bit count, then the elements.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "alces/pose.h"
#include "alces_platform/recording/byte_writer.h"

namespace alces {

class CdrWriter {
 public:
  explicit CdrWriter(std::span<std::uint8_t> room) : out_(room) { out_.u32(0x00000100); }

  template <typename Number>
  void number(Number value) {
    align(sizeof value);
    out_.number(value);
  }
  void boolean(bool value) { out_.u8(value ? 1 : 0); }
  void string(std::string_view text);
  /// uint8[<=n] and uint8[]
  void byte_sequence(std::span<const std::uint8_t> bytes);
  /// uint8[n]
  void byte_array(std::span<const std::uint8_t> bytes) { out_.bytes(bytes); }

  /// builtin_interfaces/Time. Seconds that do not fit 32 bits are written as the largest (2038); the exact
  /// nanoseconds are the MCAP message's publish_time.
  void time(std::int64_t stamp_ns);
  /// std_msgs/Header
  void header(std::int64_t stamp_ns, std::string_view frame_id);
  /// geometry_msgs/Pose
  void pose(const Pose& pose);

  /// A sequence whose count is known only afterwards: keep the place, then count().
  [[nodiscard]] std::size_t count_later();
  void count(std::size_t place, std::uint32_t count) { out_.patch(place, count); }

  [[nodiscard]] bool overflowed() const { return out_.overflowed(); }
  [[nodiscard]] std::size_t size() const { return out_.position(); }

 private:
  void align(std::size_t size);
  ByteWriter out_;
};

/// The way back. A read past the end gives zeros and is remembered; so does another encapsulation.
class CdrReader {
 public:
  explicit CdrReader(std::span<const std::uint8_t> bytes);

  template <typename Number>
  [[nodiscard]] Number number() {
    align(sizeof(Number));
    return in_.number<Number>();
  }
  [[nodiscard]] bool boolean() { return in_.u8() != 0; }
  [[nodiscard]] std::string_view string();
  [[nodiscard]] std::span<const std::uint8_t> byte_sequence();
  [[nodiscard]] std::span<const std::uint8_t> byte_array(std::size_t size) { return in_.bytes(size); }
  /// The count of a sequence whose elements take at least `least_bytes` each: 0 and failed when they cannot
  /// be there.
  [[nodiscard]] std::uint32_t count(std::size_t least_bytes);
  [[nodiscard]] std::int64_t time();
  /// Its time; the frame's name is passed over.
  [[nodiscard]] std::int64_t header();
  [[nodiscard]] Pose pose();

  [[nodiscard]] bool failed() const { return failed_ || in_.failed(); }

 private:
  void align(std::size_t size);
  ByteReader in_;
  bool failed_ = false;
};

}  // namespace alces
