#include "ply_stream.h"

#include <algorithm>
#include <array>
#include <bit>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "alces_offline/binary_number.h"
#include "alces_offline/error.h"

namespace alces::offline {
namespace {

struct Field {
  std::size_t offset = 0;
  NumberType type = NumberType::f32;
};

struct Header {
  std::endian order = std::endian::little;
  std::uint64_t vertices = 0;
  std::size_t vertex_bytes = 0;
  std::array<std::optional<Field>, 3> xyz;
};

std::optional<NumberType> number_type(const std::string& name) {
  if (name == "char" || name == "int8") return NumberType::i8;
  if (name == "uchar" || name == "uint8") return NumberType::u8;
  if (name == "short" || name == "int16") return NumberType::i16;
  if (name == "ushort" || name == "uint16") return NumberType::u16;
  if (name == "int" || name == "int32") return NumberType::i32;
  if (name == "uint" || name == "uint32") return NumberType::u32;
  if (name == "float" || name == "float32") return NumberType::f32;
  if (name == "double" || name == "float64") return NumberType::f64;
  return std::nullopt;
}

Header read_header(const std::filesystem::path& file, std::istream& stream) {
  Header header;
  std::string line;
  std::size_t line_number = 0;
  std::size_t elements = 0;
  const auto fail = [&](const std::string& sentence) { throw InputError(file, line_number, sentence); };
  while (std::getline(stream, line)) {
    if (++line_number > 1000) fail("no end_header in 1000 lines; is this a PLY file?");
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line_number == 1 && line != "ply") fail("does not begin with \"ply\"");
    std::istringstream words(line);
    std::string word;
    std::string type;
    std::string name;
    words >> word;
    if (word == "end_header") {
      if (!header.xyz[0] || !header.xyz[1] || !header.xyz[2]) fail("the vertices have no x, y and z");
      return header;
    }
    if (word == "format") {
      words >> type;
      if (type == "binary_big_endian") {
        header.order = std::endian::big;
      } else if (type != "binary_little_endian") {
        fail("format " + type + " is not supported for maps, only binary");
      }
    } else if (word == "element") {
      ++elements;
      words >> name;
      if (elements == 1 && (name != "vertex" || !(words >> header.vertices)))
        fail("the first element is no vertex");
    } else if (word == "property" && elements == 1) {
      words >> type >> name;
      const auto number = number_type(type);
      if (!number) fail("a vertex property of type " + type + " is not supported");
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (name == std::string(1, static_cast<char>('x' + axis)))
          header.xyz[axis] = Field{header.vertex_bytes, *number};
      }
      header.vertex_bytes += size_of(*number);
    }
  }
  fail("ends within its header");
  return header;
}

}  // namespace

std::uint64_t stream_ply(const std::filesystem::path& file,
                         const std::function<void(std::span<const Point>)>& take) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(file, "cannot be opened for reading");
  const Header header = read_header(file, stream);
  constexpr std::uint64_t piece = 65536;
  std::vector<char> bytes(static_cast<std::size_t>(std::min(piece, header.vertices)) * header.vertex_bytes);
  std::vector<Point> points;
  for (std::uint64_t begin = 0; begin < header.vertices; begin += piece) {
    const auto count = static_cast<std::size_t>(std::min(piece, header.vertices - begin));
    const std::size_t size = count * header.vertex_bytes;
    stream.read(bytes.data(), static_cast<std::streamsize>(size));
    if (static_cast<std::size_t>(stream.gcount()) != size) {
      throw InputError(file,
                       "ends before its " + std::to_string(header.vertices) + " vertices; write it again");
    }
    points.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const char* vertex = bytes.data() + i * header.vertex_bytes;
      const auto axis = [&](std::size_t a) {
        return static_cast<float>(
            load_number(vertex + header.xyz[a]->offset, header.xyz[a]->type, header.order));
      };
      points[i] = {axis(0), axis(1), axis(2)};
    }
    take(points);
  }
  return header.vertices;
}

}  // namespace alces::offline
