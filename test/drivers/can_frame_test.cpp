#include "alces_drivers/can_frame.h"

#include <catch2/catch.hpp>

using alces::CanFrame;

TEST_CASE("a remote frame asks for a length and carries no bytes") {
  CanFrame frame{.id = 0x123, .size = 4, .is_remote = true};
  CHECK(frame.bytes().empty());
  frame.is_remote = false;
  CHECK(frame.bytes().size() == 4);
}

TEST_CASE("only classical data frames with 11-bit identifiers are CANopen's") {
  CHECK(CanFrame{.id = 0x581, .size = 8}.is_classical_data());
  CHECK_FALSE(CanFrame{.id = 0x581, .size = 8, .is_extended = true}.is_classical_data());
  CHECK_FALSE(CanFrame{.id = 0x581, .size = 12, .is_fd = true}.is_classical_data());
  CHECK_FALSE(CanFrame{.id = 0x4, .size = 8, .is_error = true}.is_classical_data());
  CHECK_FALSE(CanFrame{.id = 0x581, .size = 0, .is_remote = true}.is_classical_data());
}
