// The points of a PLY map in pieces: any number of them in 1 MiB.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>

#include "alces/point.h"

namespace alces::offline {

/// Calls `take` with pieces of up to 65536 points, in file order, NaN included, and returns their number. The
/// file is binary with vertex as its first element, as PlyMapWriter writes it; InputError otherwise.
std::uint64_t stream_ply(const std::filesystem::path& file,
                         const std::function<void(std::span<const Point>)>& take);

/// The same with the number of the scan that each point comes from, the property "scan"; InputError where the
/// file has none.
std::uint64_t stream_ply_scans(
    const std::filesystem::path& file,
    const std::function<void(std::span<const Point>, std::span<const std::uint32_t>)>& take);

/// Points with what else the file has of them; an empty span: it has not.
struct PlyPiece {
  std::span<const Point> points;
  std::span<const std::uint32_t> scans;     ///< property "scan"
  std::span<const std::uint8_t> intensity;  ///< property "intensity", of bytes
};
std::uint64_t stream_ply_pieces(const std::filesystem::path& file,
                                const std::function<void(const PlyPiece&)>& take);

/// Whether its vertices have a property "intensity" of bytes; InputError.
[[nodiscard]] bool ply_has_intensity(const std::filesystem::path& file);

/// As the header says it; InputError.
[[nodiscard]] std::uint64_t ply_vertex_count(const std::filesystem::path& file);

}  // namespace alces::offline
