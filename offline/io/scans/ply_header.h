// What stands before the numbers of a PLY file.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "offline/io/files/binary_number.h"

namespace alces::offline {

struct PlyProperty {
  std::string name;
  NumberType type = NumberType::f32;
  std::optional<NumberType> list_count;  ///< of a list: the type of its length
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  [[nodiscard]] bool has_lists() const {
    return std::any_of(properties.begin(), properties.end(),
                       [](const PlyProperty& p) { return p.list_count.has_value(); });
  }
  /// Of one entry: exact without lists, else the least it can be.
  [[nodiscard]] std::size_t bytes() const {
    std::size_t sum = 0;
    for (const PlyProperty& property : properties)
      sum += size_of(property.list_count.value_or(property.type));
    return sum;
  }
};

enum class PlyEncoding { ascii, little_endian, big_endian };

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::ascii;
  std::vector<PlyElement> elements;
  std::size_t end = 0;    ///< where the body starts
  std::size_t lines = 0;  ///< of the header
};

/// `bytes` begin with the header and may hold more. InputError, with the line, when they are no PLY header or
/// end within it.
[[nodiscard]] PlyHeader read_ply_header(const std::filesystem::path& file, std::string_view bytes);

}  // namespace alces::offline
