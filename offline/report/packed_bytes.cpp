#include "packed_bytes.h"

#include <zlib.h>

#include <new>

namespace alces::offline {

std::string deflate_bytes(std::span<const std::uint8_t> bytes, int level) {
  uLongf size = compressBound(bytes.size());
  std::string deflated(size, '\0');
  // Z_BUF_ERROR cannot be: the bound is kept.
  if (compress2(reinterpret_cast<Bytef*>(deflated.data()), &size, bytes.data(), bytes.size(), level) != Z_OK)
    throw std::bad_alloc();
  deflated.resize(size);
  return deflated;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve(base64_size(bytes.size()));
  const auto byte = [&](std::size_t i) {
    return i < bytes.size() ? static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[i])) : 0U;
  };
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::uint32_t three = byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2);
    text += digits[three >> 18];
    text += digits[three >> 12 & 63];
    text += i + 1 < bytes.size() ? digits[three >> 6 & 63] : '=';
    text += i + 2 < bytes.size() ? digits[three & 63] : '=';
  }
  return text;
}

}  // namespace alces::offline
