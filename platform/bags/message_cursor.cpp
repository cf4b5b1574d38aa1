#include "alces_platform/bags/message_cursor.h"

namespace alces::bags {

std::span<const std::uint8_t> MessageCursor::byte_sequence() {
  if (is_cdr_) return cdr_.byte_sequence();
  const std::uint32_t size = plain_.u32();
  return plain_.bytes(size);
}

std::uint32_t MessageCursor::count(std::size_t least_bytes) {
  if (is_cdr_) return cdr_.count(least_bytes);
  const std::uint32_t count = plain_.u32();
  if (count <= plain_.left() / least_bytes) return count;
  static_cast<void>(plain_.bytes(UINT64_MAX));  // from here on it has failed
  return 0;
}

std::int64_t MessageCursor::time_ns() {
  if (is_cdr_) return cdr_.time();
  constexpr std::int64_t ns_a_second = 1'000'000'000;
  const std::int64_t whole_s = plain_.u32();
  return whole_s * ns_a_second + plain_.u32();
}

std::string MessageCursor::frame() {
  std::string_view name = string();
  while (name.starts_with('/')) name.remove_prefix(1);
  return std::string(name);
}

Header MessageCursor::header() {
  if (!is_cdr_) static_cast<void>(plain_.u32());  // seq
  Header header;
  header.stamp_ns = time_ns();
  header.frame = frame();
  return header;
}

Pose MessageCursor::pose() {
  Pose pose;
  for (int axis = 0; axis < 3; ++axis) pose.translation_m[axis] = number<double>();
  for (int i = 0; i < 4; ++i) pose.rotation.coeffs()[i] = number<double>();  // x, y, z, w
  return pose;
}

}  // namespace alces::bags
