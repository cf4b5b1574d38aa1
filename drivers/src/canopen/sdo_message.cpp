#include "alces_drivers/canopen/sdo_message.h"

#include <algorithm>

#include "alces_drivers/canopen/bytes.h"
#include "alces_drivers/canopen/cob_id.h"

namespace alces::canopen {
namespace {

constexpr std::uint8_t toggle_bit = 0x10;

CanFrame request(std::uint8_t node, std::uint8_t command) {
  CanFrame frame{.id = sdo_request_cob_id(node), .size = 8};
  frame.data[0] = command;
  return frame;
}

CanFrame request(std::uint8_t node, std::uint8_t command, ObjectAddress object) {
  CanFrame frame = request(node, command);
  store(object.index, std::span(frame.data).subspan(1), 2);
  frame.data[3] = object.subindex;
  return frame;
}

/// The object, and the data or their number, of a download request or an upload answer.
void read_initiate(std::span<const std::uint8_t, 8> bytes, SdoMessage& message) {
  const std::uint8_t command = bytes[0];
  const bool has_size = (command & 0x01) != 0;
  message.is_expedited = (command & 0x02) != 0;
  if (message.is_expedited) {
    message.has_exact_size = has_size;
    message.size = has_size ? static_cast<std::uint8_t>(4 - ((command >> 2) & 0x03)) : std::uint8_t{4};
    std::copy_n(bytes.begin() + 4, message.size, message.data.begin());
  } else if (has_size) {
    message.has_total = true;
    message.total_bytes = load(bytes.subspan<4, 4>(), 4);
  }
}

void read_segment(std::span<const std::uint8_t, 8> bytes, SdoMessage& message) {
  message.size = static_cast<std::uint8_t>(7 - ((bytes[0] >> 1) & 0x07));
  message.is_last = (bytes[0] & 0x01) != 0;
  std::copy_n(bytes.begin() + 1, message.size, message.data.begin());
}

}  // namespace

const char* to_string(SdoKind kind) {
  switch (kind) {
    case SdoKind::download_request:
      return "write";
    case SdoKind::download_response:
      return "written";
    case SdoKind::download_segment_request:
      return "write segment";
    case SdoKind::download_segment_response:
      return "segment written";
    case SdoKind::upload_request:
      return "read";
    case SdoKind::upload_response:
      return "value";
    case SdoKind::upload_segment_request:
      return "read segment";
    case SdoKind::upload_segment_response:
      return "segment";
    case SdoKind::abort:
      return "abort";
    case SdoKind::block:
      return "block transfer";
  }
  return "unknown";
}

std::optional<SdoMessage> decode_sdo(const CanFrame& frame) {
  if (!frame.is_classical_data() || frame.size != 8) return std::nullopt;
  const Service service = origin_of(frame.id).service;
  if (service != Service::sdo_request && service != Service::sdo_response) return std::nullopt;
  const bool is_response = service == Service::sdo_response;
  const std::span<const std::uint8_t, 8> bytes(frame.data.data(), 8);

  SdoMessage message;
  message.toggle = (bytes[0] & toggle_bit) != 0;
  bool has_object = true;
  switch (bytes[0] >> 5) {  // the command specifier
    case 0:
      message.kind = is_response ? SdoKind::upload_segment_response : SdoKind::download_segment_request;
      read_segment(bytes, message);
      has_object = false;
      break;
    case 1:
      message.kind = is_response ? SdoKind::download_segment_response : SdoKind::download_request;
      if (is_response) {
        has_object = false;
      } else {
        read_initiate(bytes, message);
      }
      break;
    case 2:
      message.kind = is_response ? SdoKind::upload_response : SdoKind::upload_request;
      if (is_response) read_initiate(bytes, message);
      break;
    case 3:
      message.kind = is_response ? SdoKind::download_response : SdoKind::upload_segment_request;
      has_object = is_response;
      break;
    case 4:
      message.kind = SdoKind::abort;
      message.abort_code = load(bytes.subspan<4, 4>(), 4);
      break;
    case 5:
    case 6:
      message.kind = SdoKind::block;
      has_object = false;
      break;
    default:
      return std::nullopt;
  }
  if (has_object) {
    message.object = {static_cast<std::uint16_t>(load(bytes.subspan<1, 2>(), 2)), bytes[3]};
    message.toggle = false;
  }
  return message;
}

CanFrame sdo_download_request(std::uint8_t node, ObjectAddress object, std::span<const std::uint8_t> bytes) {
  if (bytes.empty() || bytes.size() > 4) {
    CanFrame frame = request(node, 0x21, object);
    store(static_cast<std::uint32_t>(bytes.size()), std::span(frame.data).subspan(4), 4);
    return frame;
  }
  CanFrame frame = request(node, static_cast<std::uint8_t>(0x23 | ((4 - bytes.size()) << 2)), object);
  std::ranges::copy(bytes, frame.data.begin() + 4);
  return frame;
}

CanFrame sdo_download_segment(std::uint8_t node, std::span<const std::uint8_t> bytes, bool toggle,
                              bool is_last) {
  const std::size_t size = std::min<std::size_t>(bytes.size(), 7);
  CanFrame frame = request(
      node, static_cast<std::uint8_t>((toggle ? toggle_bit : 0) | ((7 - size) << 1) | (is_last ? 1 : 0)));
  std::copy_n(bytes.begin(), size, frame.data.begin() + 1);
  return frame;
}

CanFrame sdo_upload_request(std::uint8_t node, ObjectAddress object) {
  return request(node, 0x40, object);
}

CanFrame sdo_upload_segment_request(std::uint8_t node, bool toggle) {
  return request(node, static_cast<std::uint8_t>(0x60 | (toggle ? toggle_bit : 0)));
}

CanFrame sdo_abort_request(std::uint8_t node, ObjectAddress object, std::uint32_t abort_code) {
  CanFrame frame = request(node, 0x80, object);
  store(abort_code, std::span(frame.data).subspan(4), 4);
  return frame;
}

}  // namespace alces::canopen
