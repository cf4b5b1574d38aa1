#include "alces_platform/recording/cdr.h"

#include <algorithm>
#include <array>

#include "alces_drivers/stamp.h"

namespace alces {
namespace {

constexpr std::size_t header_bytes = 4;

constexpr std::size_t padding(std::size_t position, std::size_t size) {
  return (size - (position - header_bytes) % size) % size;
}

}  // namespace

void CdrWriter::align(std::size_t size) {
  static constexpr std::array<std::uint8_t, 8> zeros{};
  out_.raw(zeros.data(), padding(out_.position(), size));
}

void CdrWriter::string(std::string_view text) {
  number(static_cast<std::uint32_t>(text.size() + 1));
  out_.raw(text.data(), text.size());
  out_.u8(0);
}

void CdrWriter::byte_sequence(std::span<const std::uint8_t> bytes) {
  number(static_cast<std::uint32_t>(bytes.size()));
  out_.bytes(bytes);
}

void CdrWriter::time(std::int64_t stamp_ns) {
  const std::int64_t positive_ns = std::max<std::int64_t>(stamp_ns, 0);
  number(static_cast<std::int32_t>(std::min<std::int64_t>(positive_ns / ns_per_s, INT32_MAX)));
  number(static_cast<std::uint32_t>(positive_ns % ns_per_s));
}

void CdrWriter::header(std::int64_t stamp_ns, std::string_view frame_id) {
  time(stamp_ns);
  string(frame_id);
}

void CdrWriter::pose(const Pose& pose) {
  number(pose.translation_m.x());
  number(pose.translation_m.y());
  number(pose.translation_m.z());
  number(pose.rotation.x());
  number(pose.rotation.y());
  number(pose.rotation.z());
  number(pose.rotation.w());
}

std::size_t CdrWriter::count_later() {
  number(std::uint32_t{0});
  return out_.position() - sizeof(std::uint32_t);
}

// The other two bytes are options, for the middleware.
CdrReader::CdrReader(std::span<const std::uint8_t> bytes)
    : in_(bytes), failed_((in_.u32() & 0xffffU) != 0x0100) {}

void CdrReader::align(std::size_t size) {
  static_cast<void>(in_.bytes(padding(std::max(in_.position(), header_bytes), size)));
}

std::string_view CdrReader::string() {
  const auto size = number<std::uint32_t>();
  const std::span<const std::uint8_t> text = in_.bytes(size);
  if (text.empty() || text.back() != 0) {  // even an empty string has its 0
    failed_ = true;
    return {};
  }
  return {reinterpret_cast<const char*>(text.data()), text.size() - 1};
}

std::span<const std::uint8_t> CdrReader::byte_sequence() {
  const auto size = number<std::uint32_t>();
  return in_.bytes(size);
}

std::uint32_t CdrReader::count(std::size_t least_bytes) {
  const auto count = number<std::uint32_t>();
  if (count <= in_.left() / std::max<std::size_t>(least_bytes, 1)) return count;
  failed_ = true;
  return 0;
}

std::int64_t CdrReader::time() {
  const auto whole_s = number<std::int32_t>();
  const auto rest_ns = number<std::uint32_t>();
  return std::int64_t{whole_s} * ns_per_s + rest_ns;
}

std::int64_t CdrReader::header() {
  const std::int64_t stamp_ns = time();
  static_cast<void>(string());
  return stamp_ns;
}

Pose CdrReader::pose() {
  Pose pose;
  for (int axis = 0; axis < 3; ++axis) pose.translation_m[axis] = number<double>();
  for (int i = 0; i < 4; ++i) pose.rotation.coeffs()[i] = number<double>();  // x, y, z, w
  return pose;
}

}  // namespace alces
