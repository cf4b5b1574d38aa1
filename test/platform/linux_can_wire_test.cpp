#include "alces_platform/linux/can/can_wire.h"

#include <linux/can/error.h>

#include <catch2/catch.hpp>
#include <cstring>
#include <vector>

using alces::CanErrorReport;
using alces::CanFrame;
using alces::from_wire;
using alces::read_error_frame;
using alces::to_wire;

namespace {

template <class Wire>
std::vector<std::uint8_t> datagram(const Wire& wire) {
  std::vector<std::uint8_t> bytes(sizeof wire);
  std::memcpy(bytes.data(), &wire, sizeof wire);
  return bytes;
}

CanFrame error_frame(std::uint32_t classes, std::vector<std::uint8_t> data) {
  can_frame wire{};
  wire.can_id = classes | CAN_ERR_FLAG;
  wire.len = CAN_ERR_DLC;
  std::copy(data.begin(), data.end(), wire.data);
  const auto frame = from_wire(datagram(wire));
  REQUIRE(frame);
  REQUIRE(frame->is_error);
  return *frame;
}

}  // namespace

TEST_CASE("frames of every kind come through the kernel's structs as they were") {
  std::vector<CanFrame> frames;
  frames.push_back({.id = 0x181, .size = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}});
  frames.push_back({.id = 0x7ff, .size = 0});
  frames.push_back({.id = 0x1fffffff, .size = 2, .is_extended = true, .data = {0xca, 0xfe}});
  frames.push_back({.id = 0x123, .size = 4, .is_remote = true});
  frames.push_back({.id = 0x123, .size = 12, .is_fd = true, .is_bit_rate_switched = true, .data = {9, 8, 7}});
  frames.push_back(
      {.id = 0x1abcdef0, .size = 64, .is_extended = true, .is_fd = true, .is_error_state_indicated = true});
  for (CanFrame& frame : frames) {
    canfd_frame wire;
    const std::size_t size = to_wire(frame, wire);
    CHECK(size == (frame.is_fd ? CANFD_MTU : CAN_MTU));
    const auto back = from_wire({reinterpret_cast<const std::uint8_t*>(&wire), size});
    REQUIRE(back);
    CHECK(*back == frame);
  }
}

TEST_CASE("datagrams of another size, or that state more data than fits, are no frames") {
  for (std::size_t size = 0; size < 100; ++size) {
    const std::vector<std::uint8_t> zeros(size, 0);
    CHECK(from_wire(zeros).has_value() == (size == CAN_MTU || size == CANFD_MTU));
  }
  can_frame classical{};
  classical.len = 9;
  CHECK_FALSE(from_wire(datagram(classical)));
  canfd_frame fd{};
  fd.len = 65;
  CHECK_FALSE(from_wire(datagram(fd)));
}

TEST_CASE("frames that no bus can carry are not sent") {
  canfd_frame wire;
  CHECK(to_wire({.id = 0x800}, wire) == 0);
  CHECK(to_wire({.id = 0x20000000, .is_extended = true}, wire) == 0);
  CHECK(to_wire({.id = 1, .size = 9}, wire) == 0);
  CHECK(to_wire({.id = 1, .size = 9, .is_fd = true}, wire) == 0);
  CHECK(to_wire({.id = 1, .size = 65, .is_fd = true}, wire) == 0);
  CHECK(to_wire({.id = 1, .size = 0, .is_remote = true, .is_fd = true}, wire) == 0);
  CHECK(to_wire({.id = 4, .size = 8, .is_error = true}, wire) == 0);
  for (const int size : {0, 8, 12, 16, 20, 24, 32, 48, 64}) {
    CHECK(to_wire({.id = 1, .size = static_cast<std::uint8_t>(size), .is_fd = true}, wire) == CANFD_MTU);
  }
}

TEST_CASE("error frames say what they say in linux/can/error.h") {
  const CanErrorReport off = read_error_frame(error_frame(CAN_ERR_BUSOFF, {}));
  CHECK(off.is_bus_off);
  CHECK_FALSE(off.is_restarted);
  CHECK_FALSE(off.transmit_error_count);

  CHECK(read_error_frame(error_frame(CAN_ERR_RESTARTED, {})).is_restarted);
  CHECK(read_error_frame(error_frame(CAN_ERR_CRTL, {0, CAN_ERR_CRTL_TX_PASSIVE})).is_error_passive);
  CHECK(read_error_frame(error_frame(CAN_ERR_CRTL, {0, CAN_ERR_CRTL_RX_PASSIVE})).is_error_passive);
  CHECK(read_error_frame(error_frame(CAN_ERR_CRTL, {0, CAN_ERR_CRTL_RX_WARNING})).is_error_warning);
  CHECK(read_error_frame(error_frame(CAN_ERR_CRTL, {0, CAN_ERR_CRTL_ACTIVE})).is_error_active);
  CHECK(read_error_frame(error_frame(CAN_ERR_CRTL, {0, CAN_ERR_CRTL_RX_OVERFLOW})).has_lost_received);
  CHECK(read_error_frame(error_frame(CAN_ERR_CRTL, {0, CAN_ERR_CRTL_TX_OVERFLOW})).has_lost_sent);
  CHECK(read_error_frame(error_frame(CAN_ERR_TX_TIMEOUT, {})).has_lost_sent);
  CHECK(read_error_frame(error_frame(CAN_ERR_LOSTARB, {5})).has_lost_arbitration);
  CHECK(read_error_frame(error_frame(CAN_ERR_ACK, {})).has_no_acknowledge);
  CHECK(read_error_frame(error_frame(CAN_ERR_PROT | CAN_ERR_BUSERROR, {0, 0, 0, CAN_ERR_PROT_LOC_ACK}))
            .has_no_acknowledge);
  CHECK(read_error_frame(error_frame(CAN_ERR_PROT, {0, 0, CAN_ERR_PROT_STUFF})).is_bus_error);
  CHECK(read_error_frame(error_frame(CAN_ERR_TRX, {0, 0, 0, 0, CAN_ERR_TRX_CANH_NO_WIRE}))
            .is_transceiver_fault);
  CHECK_FALSE(read_error_frame(error_frame(CAN_ERR_TRX, {})).is_transceiver_fault);

  const CanErrorReport counted = read_error_frame(error_frame(CAN_ERR_CNT, {0, 0, 0, 0, 0, 0, 130, 7}));
  CHECK(counted.transmit_error_count == 130);
  CHECK(counted.receive_error_count == 7);
}

TEST_CASE("a short error frame is read as far as it goes") {
  CanFrame frame{.id = CAN_ERR_CRTL | CAN_ERR_CNT, .size = 1, .is_error = true};
  frame.data.fill(0xff);
  const CanErrorReport report = read_error_frame(frame);
  CHECK_FALSE(report.is_error_passive);
  CHECK(report.transmit_error_count == 0);
}
