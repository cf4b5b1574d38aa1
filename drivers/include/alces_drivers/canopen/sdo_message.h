// One frame of the service data protocol, taken apart. CiA 301 version 4.2, 7.2.4.3. Expedited and segmented
// transfers; block transfers are recognised and not taken further apart.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "alces_drivers/can_frame.h"
#include "alces_drivers/canopen/object.h"

namespace alces::canopen {

enum class SdoKind : std::uint8_t {
  download_request,
  download_response,
  download_segment_request,
  download_segment_response,
  upload_request,
  upload_response,
  upload_segment_request,
  upload_segment_response,
  abort,
  block,  ///< of a block transfer
};
[[nodiscard]] const char* to_string(SdoKind kind);

struct SdoMessage {
  SdoKind kind = SdoKind::abort;
  ObjectAddress object;  ///< 0 in segments, which do not name it
  bool is_expedited = false;
  bool has_total = false;         ///< of segmented transfers: total_bytes is given
  std::uint32_t total_bytes = 0;  ///< of the whole transfer
  bool has_exact_size = true;     ///< false: expedited without size; 4 bytes are there, fewer may be meant
  bool toggle = false;            ///< of segments and their answers
  bool is_last = false;           ///< of segments that carry data
  std::uint8_t size = 0;          ///< bytes of data in this frame
  std::array<std::uint8_t, 7> data{};
  std::uint32_t abort_code = 0;

  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return {data.data(), size}; }
};

/// Nothing: not an SDO frame of the predefined set, not 8 bytes, or a command specifier that CiA 301 does not
/// know.
[[nodiscard]] std::optional<SdoMessage> decode_sdo(const CanFrame& frame);

[[nodiscard]] CanFrame sdo_download_request(
    std::uint8_t node, ObjectAddress object,
    std::span<const std::uint8_t> bytes);  ///< expedited up to 4 bytes
[[nodiscard]] CanFrame sdo_download_segment(std::uint8_t node, std::span<const std::uint8_t> bytes,
                                            bool toggle,
                                            bool is_last);  ///< at most 7 bytes
[[nodiscard]] CanFrame sdo_upload_request(std::uint8_t node, ObjectAddress object);
[[nodiscard]] CanFrame sdo_upload_segment_request(std::uint8_t node, bool toggle);
[[nodiscard]] CanFrame sdo_abort_request(std::uint8_t node, ObjectAddress object, std::uint32_t abort_code);

}  // namespace alces::canopen
