// The layout of LAS files (ASPRS LAS 1.4 R15): what writer and reader share.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace alces::offline::las {

inline constexpr double step_m = 1e-4;
inline constexpr std::uint16_t header_bytes = 375;      ///< of version 1.4
inline constexpr std::uint16_t header_bytes_1_0 = 227;  ///< the shortest: versions 1.0 to 1.2
inline constexpr std::uint16_t record_bytes_6 = 30;
inline constexpr std::uint16_t global_encoding_wkt = 1U << 4;

/// Least bytes of a record of each point format.
inline constexpr std::array<std::uint16_t, 11> record_bytes = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
/// Where the GPS time begins in records of each point format; 0: there is none.
inline constexpr std::array<std::uint16_t, 11> gps_time_at = {0, 20, 0, 20, 20, 20, 22, 22, 22, 22, 22};
inline constexpr std::size_t intensity_at = 12;  ///< of every format
/// Set in the format byte by LASzip.
inline constexpr std::uint8_t compressed_flag = 0x80;

/// Where fields begin.
inline constexpr std::size_t version_minor_at = 25;
inline constexpr std::size_t header_size_at = 94;
inline constexpr std::size_t points_at = 96;
inline constexpr std::size_t format_at = 104;
inline constexpr std::size_t record_size_at = 105;
inline constexpr std::size_t legacy_count_at = 107;
inline constexpr std::size_t scale_at = 131;
inline constexpr std::size_t offset_at = 155;
inline constexpr std::size_t bounds_at = 179;  ///< max x, min x, max y, min y, max z, min z
inline constexpr std::size_t count_at = 247;   ///< version 1.4

}  // namespace alces::offline::las
