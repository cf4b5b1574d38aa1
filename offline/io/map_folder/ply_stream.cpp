#include "ply_stream.h"

#include <algorithm>
#include <array>
#include <bit>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "offline/io/files/binary_number.h"
#include "offline/io/files/error.h"
#include "offline/io/scans/ply_header.h"

namespace alces::offline {
namespace {

struct VertexField {
  std::size_t offset = 0;
  NumberType type = NumberType::f32;
};

struct Vertices {
  std::endian order = std::endian::little;
  std::uint64_t count = 0;
  std::size_t bytes = 0;  ///< of one
  std::array<VertexField, 3> xyz;
  std::optional<VertexField> scan;
  std::optional<VertexField> intensity;
};

// Leaves the stream where the vertices begin.
Vertices find_vertices(const std::filesystem::path& file, std::istream& stream) {
  std::string start(std::size_t{64} << 10, '\0');  // far more than a header takes
  stream.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(stream.gcount()));
  stream.clear();
  const PlyHeader header = read_ply_header(file, start);
  stream.seekg(static_cast<std::streamoff>(header.end));

  if (header.encoding == PlyEncoding::ascii) throw InputError(file, "is ascii; a map's PLY file is binary");
  if (header.elements.empty() || header.elements[0].name != "vertex" || header.elements[0].has_lists())
    throw InputError(file, "does not begin with plain vertices; write the map again");
  Vertices vertices;
  vertices.order = header.encoding == PlyEncoding::big_endian ? std::endian::big : std::endian::little;
  vertices.count = header.elements[0].count;
  std::array<bool, 3> found{};
  for (const PlyProperty& property : header.elements[0].properties) {
    const std::size_t axis = property.name.size() == 1 ? std::string_view("xyz").find(property.name) : 3;
    if (axis < 3) {
      vertices.xyz.at(axis) = {vertices.bytes, property.type};
      found.at(axis) = true;
    }
    if (property.name == "scan") vertices.scan = VertexField{vertices.bytes, property.type};
    if (property.name == "intensity" && property.type == NumberType::u8)
      vertices.intensity = VertexField{vertices.bytes, property.type};
    vertices.bytes += size_of(property.type);
  }
  if (!found[0] || !found[1] || !found[2]) throw InputError(file, "its vertices have no x, y and z");
  return vertices;
}

std::ifstream open_ply(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(file, "cannot be opened for reading");
  return stream;
}

/// Calls take(bytes of a piece, points in it).
template <typename Take>
void stream_pieces(const std::filesystem::path& file, std::istream& stream, const Vertices& vertices,
                   const Take& take) {
  constexpr std::uint64_t piece = 65536;
  std::vector<char> bytes(static_cast<std::size_t>(std::min(piece, vertices.count)) * vertices.bytes);
  for (std::uint64_t begin = 0; begin < vertices.count; begin += piece) {
    const auto count = static_cast<std::size_t>(std::min(piece, vertices.count - begin));
    const std::size_t size = count * vertices.bytes;
    stream.read(bytes.data(), static_cast<std::streamsize>(size));
    if (static_cast<std::size_t>(stream.gcount()) != size) {
      throw InputError(file,
                       "ends before its " + std::to_string(vertices.count) + " vertices; write it again");
    }
    take(bytes.data(), count);
  }
}

void read_points(const Vertices& vertices, const char* bytes, std::vector<Point>& points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const char* vertex = bytes + i * vertices.bytes;
    const auto axis = [&](std::size_t a) {
      return static_cast<float>(
          load_number(vertex + vertices.xyz.at(a).offset, vertices.xyz.at(a).type, vertices.order));
    };
    points[i] = {axis(0), axis(1), axis(2)};
  }
}

}  // namespace

std::uint64_t stream_ply(const std::filesystem::path& file,
                         const std::function<void(std::span<const Point>)>& take) {
  return stream_ply_pieces(file, [&take](const PlyPiece& piece) { take(piece.points); });
}

std::uint64_t stream_ply_scans(
    const std::filesystem::path& file,
    const std::function<void(std::span<const Point>, std::span<const std::uint32_t>)>& take) {
  return stream_ply_pieces(file, [&](const PlyPiece& piece) {
    if (piece.scans.empty())
      throw InputError(file, "its points do not say which scan they come from; map the scans again");
    take(piece.points, piece.scans);
  });
}

std::uint64_t stream_ply_pieces(const std::filesystem::path& file,
                                const std::function<void(const PlyPiece&)>& take) {
  std::ifstream stream = open_ply(file);
  const Vertices vertices = find_vertices(file, stream);
  std::vector<Point> points;
  std::vector<std::uint32_t> scans;
  std::vector<std::uint8_t> intensity;
  stream_pieces(file, stream, vertices, [&](const char* bytes, std::size_t count) {
    points.resize(count);
    read_points(vertices, bytes, points);
    scans.resize(vertices.scan ? count : 0);
    for (std::size_t i = 0; i < scans.size(); ++i) {
      const char* at = bytes + i * vertices.bytes + vertices.scan->offset;
      scans[i] = static_cast<std::uint32_t>(
          std::clamp(load_number(at, vertices.scan->type, vertices.order), 0.0, 4294967295.0));
    }
    intensity.resize(vertices.intensity ? count : 0);
    for (std::size_t i = 0; i < intensity.size(); ++i)
      intensity[i] = static_cast<std::uint8_t>(bytes[i * vertices.bytes + vertices.intensity->offset]);
    take({points, scans, intensity});
  });
  return vertices.count;
}

bool ply_has_intensity(const std::filesystem::path& file) {
  std::ifstream stream = open_ply(file);
  return find_vertices(file, stream).intensity.has_value();
}

std::uint64_t ply_vertex_count(const std::filesystem::path& file) {
  std::ifstream stream = open_ply(file);
  return find_vertices(file, stream).count;
}

}  // namespace alces::offline
