#include "ply_header.h"

#include <fmt/format.h>

#include <charconv>
#include <utility>

#include "offline/io/files/error.h"
#include "offline/io/files/text_numbers.h"

namespace alces::offline {
namespace {

std::optional<NumberType> number_type(std::string_view name) {
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

}  // namespace

PlyHeader read_ply_header(const std::filesystem::path& file, std::string_view bytes) {
  PlyHeader header;
  const auto fail = [&](const std::string& what) { throw InputError(file, header.lines, what); };
  bool format_seen = false;
  while (true) {
    if (header.end >= bytes.size()) fail("the header ends without end_header; this is no whole PLY file");
    const std::size_t stop = std::min(bytes.find('\n', header.end), bytes.size());
    const std::vector<std::string_view> words = split_words(bytes.substr(header.end, stop - header.end));
    header.end = std::min(stop + 1, bytes.size());
    ++header.lines;
    const std::string_view key = words.empty() ? std::string_view() : words[0];
    if (header.lines == 1) {
      if (key != "ply") fail("a PLY file starts with the line \"ply\", this one does not");
    } else if (key == "end_header") {
      break;
    } else if (key == "format") {
      const std::string_view name = words.size() > 1 ? words[1] : std::string_view();
      format_seen = true;
      if (name == "ascii") {
        header.encoding = PlyEncoding::ascii;
      } else if (name == "binary_little_endian") {
        header.encoding = PlyEncoding::little_endian;
      } else if (name == "binary_big_endian") {
        header.encoding = PlyEncoding::big_endian;
      } else {
        fail("the format is unknown; ascii, binary_little_endian and binary_big_endian are read");
      }
    } else if (key == "element") {
      PlyElement element;
      bool whole = words.size() == 3;
      if (whole) {
        const char* const end = words[2].data() + words[2].size();
        const auto [at, error] = std::from_chars(words[2].data(), end, element.count);
        whole = error == std::errc{} && at == end;
        element.name = words[1];
      }
      if (!whole) fail("\"element NAME COUNT\" is needed here");
      header.elements.push_back(std::move(element));
    } else if (key == "property") {
      const bool list = words.size() == 5 && words[1] == "list";
      const std::optional<NumberType> type =
          list ? number_type(words[3]) : (words.size() == 3 ? number_type(words[1]) : std::nullopt);
      PlyProperty property{std::string(words.back()), type.value_or(NumberType::f32), std::nullopt};
      if (list) property.list_count = number_type(words[2]);
      if (!type || (list && !property.list_count) || header.elements.empty()) {
        fail("\"property TYPE NAME\" or \"property list TYPE TYPE NAME\" is needed here, with PLY's types");
      }
      header.elements.back().properties.push_back(std::move(property));
    } else if (!key.empty() && key != "comment" && key != "obj_info") {
      fail(fmt::format("\"{}\" is no entry of a PLY header", key.substr(0, 40)));
    }
  }
  if (!format_seen) fail("the header has no format line");
  return header;
}

}  // namespace alces::offline
