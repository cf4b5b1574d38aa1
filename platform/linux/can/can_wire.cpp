#include "alces_platform/linux/can/can_wire.h"

#include <linux/can/error.h>

#include <algorithm>
#include <cstring>

namespace alces {
namespace {

/// The lengths an FD frame can have: 0 to 8, 12, 16, 20, 24, 32, 48, 64.
bool is_fd_length(std::uint8_t size) {
  if (size <= 24) return size <= 8 || size % 4 == 0;
  return size == 32 || size == 48 || size == 64;
}

}  // namespace

std::optional<CanFrame> from_wire(std::span<const std::uint8_t> datagram) {
  static_assert(offsetof(can_frame, data) == offsetof(canfd_frame, data));
  if (datagram.size() != CAN_MTU && datagram.size() != CANFD_MTU) return std::nullopt;
  canfd_frame wire{};
  std::memcpy(&wire, datagram.data(), datagram.size());
  CanFrame frame;
  frame.is_fd = datagram.size() == CANFD_MTU;
  if (wire.len > (frame.is_fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN)) return std::nullopt;
  frame.is_error = (wire.can_id & CAN_ERR_FLAG) != 0;
  frame.is_extended = !frame.is_error && (wire.can_id & CAN_EFF_FLAG) != 0;
  frame.is_remote = !frame.is_error && !frame.is_fd && (wire.can_id & CAN_RTR_FLAG) != 0;
  frame.id = wire.can_id & (frame.is_error || frame.is_extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.size = wire.len;
  if (frame.is_fd) {
    frame.is_bit_rate_switched = (wire.flags & CANFD_BRS) != 0;
    frame.is_error_state_indicated = (wire.flags & CANFD_ESI) != 0;
  }
  if (!frame.is_remote) std::copy_n(wire.data, wire.len, frame.data.begin());
  return frame;
}

std::size_t to_wire(const CanFrame& frame, canfd_frame& wire) {
  wire = {};
  if (frame.is_error || frame.id > (frame.is_extended ? CAN_EFF_MASK : CAN_SFF_MASK)) return 0;
  if (frame.is_fd ? frame.is_remote || !is_fd_length(frame.size) : frame.size > CAN_MAX_DLEN) return 0;
  wire.can_id = frame.id | (frame.is_extended ? CAN_EFF_FLAG : 0U) | (frame.is_remote ? CAN_RTR_FLAG : 0U);
  wire.len = frame.size;
  if (frame.is_fd) {
    wire.flags = static_cast<std::uint8_t>((frame.is_bit_rate_switched ? CANFD_BRS : 0) |
                                           (frame.is_error_state_indicated ? CANFD_ESI : 0));
  }
  const auto bytes = frame.bytes();
  std::ranges::copy(bytes, wire.data);
  return frame.is_fd ? CANFD_MTU : CAN_MTU;
}

CanErrorReport read_error_frame(const CanFrame& frame) {
  const auto has = [&](std::uint32_t error_class) { return (frame.id & error_class) != 0; };
  const auto byte = [&](std::size_t index) -> std::uint8_t {
    return index < frame.size ? frame.data[index] : std::uint8_t{0};
  };
  CanErrorReport report;
  report.is_bus_off = has(CAN_ERR_BUSOFF);
  report.is_restarted = has(CAN_ERR_RESTARTED);
  report.has_no_acknowledge = has(CAN_ERR_ACK) || (has(CAN_ERR_PROT) && byte(3) == CAN_ERR_PROT_LOC_ACK);
  report.is_bus_error = has(CAN_ERR_BUSERROR) || has(CAN_ERR_PROT);
  report.has_lost_arbitration = has(CAN_ERR_LOSTARB);
  report.is_transceiver_fault = has(CAN_ERR_TRX) && byte(4) != CAN_ERR_TRX_UNSPEC;
  report.has_lost_sent = has(CAN_ERR_TX_TIMEOUT);
  if (has(CAN_ERR_CRTL)) {
    const std::uint8_t controller = byte(1);
    report.has_lost_received = (controller & CAN_ERR_CRTL_RX_OVERFLOW) != 0;
    report.has_lost_sent = report.has_lost_sent || (controller & CAN_ERR_CRTL_TX_OVERFLOW) != 0;
    report.is_error_warning = (controller & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) != 0;
    report.is_error_passive = (controller & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0;
    report.is_error_active = (controller & CAN_ERR_CRTL_ACTIVE) != 0;
  }
  // Drivers older than CAN_ERR_CNT (Linux 5.20) fill the counters without saying so; 0 and 0 says nothing
  // then.
  if (has(CAN_ERR_CNT) || (has(CAN_ERR_CRTL) && (byte(6) != 0 || byte(7) != 0))) {
    report.transmit_error_count = byte(6);
    report.receive_error_count = byte(7);
  }
  return report;
}

}  // namespace alces
