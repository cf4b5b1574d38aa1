#include "alces_platform/recording/crc32.h"

#include <zlib.h>

namespace alces {

void Crc32::add(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return;  // zlib takes a null pointer for "begin anew"
  value_ = static_cast<std::uint32_t>(::crc32_z(value_, bytes.data(), bytes.size()));
}

void Crc32::add_known(std::uint32_t crc, std::size_t size) {
  value_ = static_cast<std::uint32_t>(::crc32_combine(value_, crc, static_cast<z_off_t>(size)));
}

std::uint32_t crc32(std::span<const std::uint8_t> bytes) {
  Crc32 crc;
  crc.add(bytes);
  return crc.value();
}

}  // namespace alces
