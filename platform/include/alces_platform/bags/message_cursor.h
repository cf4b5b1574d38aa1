// One message's fields in turn, whether ROS 2 (CDR, little endian) or ROS 1 laid them out. A read past the
// end gives zeros and is remembered; counts are believed only as far as there are bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "alces/pose.h"
#include "alces_platform/bags/bag_reader.h"
#include "alces_platform/recording/byte_writer.h"
#include "alces_platform/recording/cdr.h"

namespace alces::bags {

/// std_msgs/Header
struct Header {
  std::int64_t stamp_ns = 0;
  std::string frame;  ///< without the slash that ROS 1 had before it
};

class MessageCursor {
 public:
  MessageCursor(Encoding encoding, std::span<const std::uint8_t> bytes)
      : is_cdr_(encoding == Encoding::cdr),
        cdr_(is_cdr_ ? bytes : std::span<const std::uint8_t>()),
        plain_(is_cdr_ ? std::span<const std::uint8_t>() : bytes) {}

  template <typename Number>
  [[nodiscard]] Number number() {
    return is_cdr_ ? cdr_.number<Number>() : plain_.number<Number>();
  }
  [[nodiscard]] bool boolean() { return number<std::uint8_t>() != 0; }
  [[nodiscard]] std::string_view string() { return is_cdr_ ? cdr_.string() : plain_.string(); }
  /// uint8[]
  [[nodiscard]] std::span<const std::uint8_t> byte_sequence();
  /// uint8[size]
  [[nodiscard]] std::span<const std::uint8_t> byte_array(std::size_t size) {
    return is_cdr_ ? cdr_.byte_array(size) : plain_.bytes(size);
  }
  /// Of a sequence whose elements take at least `least_bytes` each: 0 and failed when they cannot be there.
  [[nodiscard]] std::uint32_t count(std::size_t least_bytes);
  void pass_over_doubles(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) static_cast<void>(number<double>());
  }

  [[nodiscard]] std::int64_t time_ns();
  [[nodiscard]] Header header();
  [[nodiscard]] std::string frame();
  /// geometry_msgs/Pose; as it is there, its quaternion may be none.
  [[nodiscard]] Pose pose();

  [[nodiscard]] bool failed() const { return is_cdr_ ? cdr_.failed() : plain_.failed(); }

 private:
  bool is_cdr_;
  CdrReader cdr_;
  ByteReader plain_;
};

}  // namespace alces::bags
