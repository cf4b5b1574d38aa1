#include "alces_drivers/lms2xx/telegram.h"

#include <array>
#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>
#include <vector>

#include "alces_drivers/lms2xx/measured_values.h"
#include "alces_platform/sim/random.h"
#include "support/test_data.h"

using namespace alces::lms2xx;
using Bytes = std::vector<std::uint8_t>;
using Kind = TelegramParser::Kind;

namespace {

struct Found {
  Kind kind = Kind::telegram;
  std::uint8_t command = 0;
  Bytes data;
  std::uint64_t end_position = 0;
};

std::vector<Found> parse(TelegramParser& parser, const Bytes& bytes) {
  std::vector<Found> found;
  for (const std::uint8_t byte : bytes) {
    parser.push(byte);
    while (const auto token = parser.next()) {
      const auto& data = token->telegram.data;
      found.push_back(
          {token->kind, token->telegram.command, {data.begin(), data.end()}, token->end_position});
    }
  }
  return found;
}

Bytes telegram(std::uint8_t command, const Bytes& data) {
  Bytes out(maximum_telegram_bytes);
  out.resize(build_telegram(Direction::from_laser, 0, command, data, 0x10, out));
  return out;
}

void append(Bytes& to, const Bytes& from) {
  to.insert(to.end(), from.begin(), from.end());
}

}  // namespace

TEST_CASE("commands have the bytes and checksums that the manual prints") {
  // Stream of all values, as found in the telegram listing: 02 00 02 00 20 24 34 08.
  std::array<std::uint8_t, 16> out{};
  const std::array<std::uint8_t, 1> all_values{0x24};
  REQUIRE(build_telegram(Direction::from_host, 0, 0x20, all_values, 0, out) == 8);
  CHECK(Bytes(out.begin(), out.begin() + 8) == Bytes{0x02, 0x00, 0x02, 0x00, 0x20, 0x24, 0x34, 0x08});
  const std::array<std::uint8_t, 1> rate_38400{0x40};
  REQUIRE(build_telegram(Direction::from_host, 0, 0x20, rate_38400, 0, out) == 8);
  CHECK(Bytes(out.begin(), out.begin() + 8) == Bytes{0x02, 0x00, 0x02, 0x00, 0x20, 0x40, 0x50, 0x08});
}

TEST_CASE("a telegram that is too long, or an output that is too short, is refused") {
  Bytes out(2000);
  CHECK(build_telegram(Direction::from_host, 0, 0x20, Bytes(maximum_length), 0, out) == 0);
  CHECK(build_telegram(Direction::from_host, 0, 0x20, Bytes(maximum_length - 1), 0, out) ==
        maximum_telegram_bytes);
  CHECK(build_telegram(Direction::from_host, 0, 0x20, Bytes(10), 0, std::span(out).first(16)) == 0);
}

TEST_CASE("a telegram is found wherever its bytes are split, with acknowledgements and garbage around it") {
  TelegramParser parser(Direction::from_laser);
  Bytes bytes{0xff, 0x06, 0x00};
  append(bytes, telegram(0xa0, {0}));
  append(bytes, {0x15, 0x77});
  append(bytes, telegram(0xb1, Bytes(150, 0x02)));  // data full of STX
  const auto found = parse(parser, bytes);
  REQUIRE(found.size() == 4);
  CHECK(found[0].kind == Kind::ack);
  CHECK(found[1].command == 0xa0);
  CHECK(found[1].data == Bytes{0});
  CHECK(found[1].end_position == 12);
  CHECK(found[2].kind == Kind::nak);
  CHECK(found[3].data == Bytes(150, 0x02));
  CHECK(found[3].end_position == bytes.size());
  CHECK(parser.counters().bytes_skipped == 3);
  CHECK(parser.counters().crc_errors == 0);
}

TEST_CASE("a good telegram behind a broken or cut-off one is not lost") {
  TelegramParser parser(Direction::from_laser);
  Bytes broken = telegram(0xb0, Bytes(100, 0x11));
  broken[50] = 0x12;
  append(broken, telegram(0xa0, {0}));
  auto found = parse(parser, broken);
  REQUIRE(found.size() == 1);
  CHECK(found[0].command == 0xa0);
  CHECK(parser.counters().crc_errors == 1);

  Bytes cut = telegram(0xb0, Bytes(100, 0x11));
  cut.resize(60);
  for (int i = 0; i < 6; ++i) append(cut, telegram(0xa0, {7}));
  found = parse(parser, cut);
  CHECK(found.size() == 6);
}

TEST_CASE("a begun telegram that never ends is given up on request") {
  TelegramParser parser(Direction::from_laser);
  Bytes bytes{0x02, 0x80, 0x20, 0x03};  // says 800 bytes follow
  append(bytes, telegram(0xa0, {0}));
  CHECK(parse(parser, bytes).empty());
  parser.resynchronise();
  const auto token = parser.next();
  REQUIRE(token);
  CHECK(token->telegram.command == 0xa0);
  CHECK(parser.pending_bytes() == 0);
  CHECK(parser.counters().truncated == 1);
}

TEST_CASE("random bytes never make a telegram longer than is legal, and the parser comes back") {
  alces::sim::Random random(3);
  TelegramParser parser(Direction::from_laser);
  for (int round = 0; round < 300; ++round) {
    Bytes bytes;
    for (int i = random.integer(0, 3000); i > 0; --i) {
      // STX, the address and small lengths come often.
      bytes.push_back(random.chance(0.3)   ? static_cast<std::uint8_t>(random.integer(0, 3))
                      : random.chance(0.2) ? std::uint8_t{0x80}
                                           : static_cast<std::uint8_t>(random.integer(0, 255)));
    }
    parser.allow_work();
    for (const auto& found : parse(parser, bytes)) CHECK(found.data.size() <= maximum_length);
    for (int i = 0; i < 4; ++i)
      append(bytes, telegram(0xb0, Bytes(400, static_cast<std::uint8_t>(round | 0x20))));
    bytes.erase(bytes.begin(), bytes.end() - 4 * 408);
    parser.allow_work();
    const auto found = parse(parser, bytes);
    CHECK(std::any_of(found.begin(), found.end(), [](const Found& f) { return f.data.size() == 400; }));
  }
}

TEST_CASE(
    "false headers cost a bounded amount of work until time passes, and good telegrams pass after that") {
  TelegramParser parser(Direction::from_laser);
  Bytes flood;
  for (int i = 0; i < 100'000; ++i) append(flood, {0x02, 0x80, 0x2C, 0x03});  // 812 bytes are promised
  CHECK(parse(parser, flood).empty());
  CHECK(parser.counters().overloads == 1);
  CHECK(parser.counters().crc_errors <= TelegramParser::work_limit_bytes / maximum_length);
  CHECK(parser.counters().bytes_skipped == flood.size());
  CHECK(parser.position() == flood.size());
  CHECK(parse(parser, telegram(0xa0, {0})).empty());
  parser.allow_work();
  const auto found = parse(parser, telegram(0xa0, {0}));
  REQUIRE(found.size() == 1);
  CHECK(found[0].end_position == parser.position());
}

TEST_CASE("a recorded telegram of an LMS 200 decodes to 361 ranges in millimetres") {
  if (!alces::test::has_test_data("sick/lms200_one_scan_telegram.bin")) return;
  std::ifstream file(alces::test::test_data("sick/lms200_one_scan_telegram.bin"), std::ios::binary);
  const Bytes bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  REQUIRE(bytes.size() == 732);
  CHECK(crc16(std::span(bytes).first(730)) == 0x4764);
  TelegramParser parser(Direction::from_laser);
  const auto found = parse(parser, bytes);
  REQUIRE(found.size() == 1);
  CHECK(found[0].command == 0xb0);
  const auto values = split_measured_values(found[0].data);
  REQUIRE(values);
  CHECK(values->count == 361);
  CHECK(values->unit == Unit::mm);
  CHECK_FALSE(values->is_partial);
  CHECK_FALSE(values->turn_index);
  RayCounters counters;
  std::vector<float> ranges_m;
  for (std::size_t i = 0; i < values->count; ++i) {
    const auto word = static_cast<std::uint16_t>(values->words[2 * i] | values->words[2 * i + 1] << 8);
    ranges_m.push_back(range_m(word, MeasuringMode::fields_a_b_dazzle, values->unit, counters));
  }
  CHECK(ranges_m.front() == Approx(2.251));
  CHECK(std::all_of(ranges_m.begin(), ranges_m.end(),
                    [](float range) { return range >= 0 && range < 8.183F; }));
}

TEST_CASE("how many bits of a word are the range follows the measuring mode, codes are no ranges") {
  RayCounters counters;
  CHECK(range_m(0x6123, MeasuringMode::fields_a_b_dazzle, Unit::cm, counters) ==
        Approx(2.91));                                                                     // 13 bits: 0x123
  CHECK(range_m(0x6123, MeasuringMode::fields_a_b, Unit::mm, counters) == Approx(8.483));  // 14 bits: 0x2123
  CHECK(range_m(0xe123, MeasuringMode::field_a, Unit::mm, counters) == Approx(24.867));    // 15 bits: 0x6123
  CHECK(range_m(0x1ff6, MeasuringMode::fields_a_b_dazzle, Unit::cm, counters) ==
        Approx(81.82));  // the last range
  const auto code = [&](std::uint16_t word, MeasuringMode mode) {
    CHECK(range_m(word, mode, Unit::cm, counters) == 0);
  };
  code(0x1ff7, MeasuringMode::fields_a_b_dazzle);
  code(0x3ff7, MeasuringMode::fields_a_b);
  code(0x7ff7, MeasuringMode::no_flags);
  CHECK(counters.beyond_reach == 3);
  code(0x1ffa, MeasuringMode::reflector_8_levels);
  CHECK(counters.channel_error == 1);
  code(0x1ffb, MeasuringMode::reflector_8_levels);
  CHECK(counters.too_weak == 1);
  code(0x1ffd, MeasuringMode::reflector_8_levels);
  CHECK(counters.overflow == 1);
  code(0x1ffe, MeasuringMode::reflector_8_levels);
  code(0x8123, MeasuringMode::fields_a_b_dazzle);  // the dazzle flag
  CHECK(counters.dazzled == 2);
  code(0x1fff, MeasuringMode::reflector_8_levels);
  code(0x1ff8, MeasuringMode::reflector_8_levels);
  code(0, MeasuringMode::no_flags);
  CHECK(counters.not_valid == 3);
}

TEST_CASE("measured values whose count does not fit their bytes are refused") {
  CHECK_FALSE(split_measured_values({}));
  const Bytes one{0x01};
  CHECK_FALSE(split_measured_values(one));
  CHECK_FALSE(split_measured_values(Bytes{0x02, 0x00, 0x01, 0x00}));     // two values promised, one there
  CHECK_FALSE(split_measured_values(Bytes{0x01, 0x00, 1, 0, 2, 3, 4}));  // three bytes too many
  CHECK_FALSE(split_measured_values(Bytes{0x01, 0x80, 1, 0}));           // a reserved unit
  const Bytes with_index{0x01, 0x70, 1, 0, 200, 9};                      // partial scan at + 0.5 deg, mm
  const auto values = split_measured_values(with_index);
  REQUIRE(values);
  CHECK(values->is_partial);
  CHECK(values->quarter_deg == 2);
  CHECK(values->unit == Unit::mm);
  CHECK(values->turn_index == std::uint8_t{200});
  CHECK(values->telegram_index == std::uint8_t{9});
}
