#include "alces_drivers/odometry/can_signal.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "alces_platform/sim/random.h"

using namespace alces;

namespace {

using Bytes = std::array<std::uint8_t, 8>;

/// Bit by bit, as DBC's numbering says it.
std::uint64_t plain_extract(const CanSignal& signal, std::span<const std::uint8_t> bytes) {
  std::uint64_t bits = 0;
  int bit = signal.start_bit;
  for (int i = 0; i < signal.length; ++i) {
    const std::uint64_t one = (bytes[static_cast<std::size_t>(bit / 8)] >> (bit % 8)) & 1U;
    if (signal.order == ByteOrder::intel) {
      bits |= one << i;
      ++bit;
    } else {
      bits = bits << 1 | one;
      bit = bit % 8 == 0 ? bit + 15 : bit - 1;
    }
  }
  return bits;
}

CanSignal signal(std::uint16_t start, std::uint8_t length, ByteOrder order,
                 RawType type = RawType::unsigned_integer, double factor = 1, double offset = 0) {
  return {
      .start_bit = start, .length = length, .order = order, .type = type, .factor = factor, .offset = offset};
}

double value_in(const CanSignal& what, const Bytes& bytes) {
  const SignalValue value = extract(what, bytes);
  REQUIRE(value.status == SignalStatus::ok);
  return value.value;
}

}  // namespace

// The example of cantools' documentation (motohawk.dbc): C0 06 E0 is 250.55 K, 3.2 m, enabled.
TEST_CASE("Motorola signals that straddle bytes are read as cantools reads them") {
  const CanSignal temperature = signal(0, 12, ByteOrder::motorola, RawType::signed_integer, 0.01, 250);
  const CanSignal radius = signal(6, 6, ByteOrder::motorola, RawType::unsigned_integer, 0.1);
  const CanSignal enable = signal(7, 1, ByteOrder::motorola);
  const Bytes bytes{0xC0, 0x06, 0xE0};
  CHECK(value_in(temperature, bytes) == Approx(250.55).epsilon(1e-12));
  CHECK(value_in(radius, bytes) == Approx(3.2).epsilon(1e-12));
  CHECK(value_in(enable, bytes) == 1);
  CHECK(value_in(temperature, {0x01, 0x00, 0x20}) == Approx(229.53).epsilon(1e-12));

  Bytes written{};
  CHECK(insert(temperature, 250.55, written) == SignalStatus::ok);
  CHECK(insert(radius, 3.2, written) == SignalStatus::ok);
  CHECK(insert(enable, 1, written) == SignalStatus::ok);
  CHECK(written == bytes);
}

TEST_CASE("Intel signals start at their least significant bit and grow through the bytes") {
  CHECK(value_in(signal(8, 16, ByteOrder::intel), {0, 0x34, 0x12}) == 0x1234);
  CHECK(value_in(signal(4, 12, ByteOrder::intel), {0xA0, 0xBC}) == 0xBCA);
  CHECK(value_in(signal(4, 12, ByteOrder::intel, RawType::signed_integer), {0xF0, 0xFF}) == -1);
  CHECK(value_in(signal(0, 16, ByteOrder::intel, RawType::signed_integer, 0.1, -5), {0x18, 0xFC}) ==
        Approx(-105).epsilon(1e-12));
}

TEST_CASE("a Motorola number that fills whole bytes is big-endian") {
  CHECK(value_in(signal(7, 16, ByteOrder::motorola), {0x12, 0x34}) == 0x1234);
  CHECK(value_in(signal(39, 16, ByteOrder::motorola), {0, 0, 0, 0, 0xAB, 0xCD}) == 0xABCD);
}

TEST_CASE("signals of 64 bits and of one bit work at both ends") {
  const Bytes bytes{0x01, 0x23, 0x45, 0x67, 0x89, 0xAB, 0xCD, 0xEF};
  CHECK(extract_bits(signal(7, 64, ByteOrder::motorola), bytes) == 0x0123456789ABCDEFU);
  CHECK(extract_bits(signal(0, 64, ByteOrder::intel), bytes) == 0xEFCDAB8967452301U);
  CHECK(value_in(signal(0, 64, ByteOrder::intel, RawType::signed_integer),
                 {0xFE, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}) == -2);
  CHECK(value_in(signal(63, 1, ByteOrder::intel), bytes) == 1);
  CHECK(value_in(signal(0, 1, ByteOrder::motorola, RawType::signed_integer), bytes) == -1);

  Bytes written{};
  CHECK(insert(signal(0, 64, ByteOrder::intel, RawType::signed_integer), -9223372036854775808.0, written) ==
        SignalStatus::ok);
  CHECK(written == Bytes{0, 0, 0, 0, 0, 0, 0, 0x80});
  CHECK(insert(signal(0, 64, ByteOrder::intel), 18446744073709549568.0, written) == SignalStatus::ok);
  CHECK(written == Bytes{0, 0xF8, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF});
  CHECK(insert(signal(0, 64, ByteOrder::intel), 18446744073709551616.0, written) ==
        SignalStatus::does_not_fit);
}

TEST_CASE("every layout reads as bit by bit, and writing changes its own bits alone") {
  sim::Random random(3);
  for (int round = 0; round < 20000; ++round) {
    std::array<std::uint8_t, 64> bytes{};
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.next());
    const bool is_intel = random.chance(0.5);
    const CanSignal layout = signal(static_cast<std::uint16_t>(random.integer(0, 520)),
                                    static_cast<std::uint8_t>(random.integer(0, 66)),
                                    is_intel ? ByteOrder::intel : ByteOrder::motorola);
    if (!is_valid(layout)) {
      CHECK(extract(layout, bytes).status == SignalStatus::bad_signal);
      continue;
    }
    REQUIRE(extract_bits(layout, bytes) == plain_extract(layout, bytes));
    auto written = bytes;
    const std::uint64_t mask =
        layout.length == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << layout.length) - 1;
    const std::uint64_t other = random.next() & mask;
    insert_bits(layout, other, written);
    REQUIRE(extract_bits(layout, written) == other);
    insert_bits(layout, plain_extract(layout, bytes), written);
    REQUIRE(written == bytes);
    // One byte fewer than needed is too short; as many as needed are enough.
    const std::uint32_t needed = bytes_needed(layout);
    REQUIRE(extract(layout, std::span(bytes).first(needed - 1)).status == SignalStatus::frame_too_short);
    REQUIRE(extract(layout, std::span(bytes).first(needed)).status == SignalStatus::ok);
  }
}

TEST_CASE("IEEE floats are read and written, and what is no number is refused") {
  const CanSignal single = signal(0, 32, ByteOrder::intel, RawType::float_ieee);
  CHECK(value_in(single, {0x00, 0x00, 0xC0, 0x3F}) == 1.5);
  CHECK(extract(single, Bytes{0, 0, 0xC0, 0x7F}).status == SignalStatus::out_of_limits);  // NaN
  const CanSignal twice = signal(7, 64, ByteOrder::motorola, RawType::float_ieee);
  Bytes bytes{};
  CHECK(insert(twice, -0.1, bytes) == SignalStatus::ok);
  CHECK(value_in(twice, bytes) == -0.1);
  CHECK(insert(single, 1e300, bytes) == SignalStatus::does_not_fit);
  CHECK_FALSE(is_valid(signal(0, 16, ByteOrder::intel, RawType::float_ieee)));
}

TEST_CASE("values outside the limits or the bits are refused and nothing is written") {
  CanSignal limited = signal(0, 16, ByteOrder::intel, RawType::signed_integer, 0.01);
  limited.minimum = -10;
  limited.maximum = 10;
  Bytes bytes{0xAA, 0xBB};
  const Bytes before = bytes;
  CHECK(insert(limited, 10.1, bytes) == SignalStatus::out_of_limits);
  CHECK(insert(limited, std::numeric_limits<double>::quiet_NaN(), bytes) == SignalStatus::out_of_limits);
  CHECK(insert(signal(0, 8, ByteOrder::intel), 256, bytes) == SignalStatus::does_not_fit);
  CHECK(insert(signal(0, 8, ByteOrder::intel), -0.6, bytes) == SignalStatus::does_not_fit);
  CHECK(insert(signal(0, 8, ByteOrder::intel, RawType::signed_integer), 128, bytes) ==
        SignalStatus::does_not_fit);
  CHECK(bytes == before);
  CHECK(extract(limited, Bytes{0xE8, 0x03}).status == SignalStatus::ok);             // 10.00
  CHECK(extract(limited, Bytes{0xE9, 0x03}).status == SignalStatus::out_of_limits);  // 10.01
}
