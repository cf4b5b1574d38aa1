// The numbers of the MCAP container, major version 0 (https://mcap.dev/spec). Every record is one byte of
// opcode, 64 bits of length, content; all little endian.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace alces::mcap {

inline constexpr std::array<std::uint8_t, 8> magic = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

enum class Opcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  attachment = 0x09,
  attachment_index = 0x0a,
  statistics = 0x0b,
  metadata = 0x0c,
  metadata_index = 0x0d,
  summary_offset = 0x0e,
  data_end = 0x0f,
  // From 0x80 on opcodes are an application's own: readers that do not know one pass over it.
  index_page = 0x80,  ///< a part of the chunk index: see mcap_writer.h
  /// CRC (32 bits) of what follows, then the file's first bytes once more, from its magic to its last
  /// channel.
  head_copy = 0x81,
};

inline constexpr std::size_t record_header_bytes = 1 + 8;
/// channel, sequence, log time, publish time
inline constexpr std::size_t message_header_bytes = 2 + 4 + 8 + 8;
/// start time, end time, size, CRC, compression "", length of the records
inline constexpr std::size_t plain_chunk_header_bytes = 8 + 8 + 8 + 4 + 4 + 8;
/// record header, CRC
inline constexpr std::size_t head_copy_prefix_bytes = record_header_bytes + 4;
inline constexpr std::size_t footer_bytes = 8 + 8 + 4;

}  // namespace alces::mcap
