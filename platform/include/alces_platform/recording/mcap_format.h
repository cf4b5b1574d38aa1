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
  index_page = 0x80,  ///< ours, which other readers pass over: see mcap_writer.h
};

inline constexpr std::size_t record_header_bytes = 1 + 8;
/// channel, sequence, log time, publish time
inline constexpr std::size_t message_header_bytes = 2 + 4 + 8 + 8;
/// start time, end time, size, CRC, compression "", length of the records
inline constexpr std::size_t plain_chunk_header_bytes = 8 + 8 + 8 + 4 + 4 + 8;
inline constexpr std::size_t footer_bytes = 8 + 8 + 4;

}  // namespace alces::mcap
