// candump's text in all its forms, and what is no frame.
#include "alces_platform/replay/candump.h"

#include <catch2/catch.hpp>
#include <random>

#include "support/test_data.h"
#include "trace_bench.h"

namespace alces::replay {
namespace {

Event one(const TraceBench& bench, std::string_view line) {
  INFO(line);
  CandumpReader reader(bench.write("one.log", line));
  Event event;
  const bool is_there = reader.next(event);
  CHECK(is_there);
  CHECK(reader.problems().count == 0);
  Event none;
  CHECK_FALSE(reader.next(none));
  return event;
}

std::vector<std::int64_t> stamps_us(const TraceBench& bench, std::string_view text,
                                    CandumpOptions options = {}) {
  CandumpReader reader(bench.write("stamps.log", text), options);
  std::vector<std::int64_t> stamps;
  for (const sample::OwnedEvent& owned : all_events(reader)) stamps.push_back(owned.event.stamp_ns / 1000);
  CHECK(reader.problems().count == 0);
  return stamps;
}

TEST_CASE("a line of candump -l is a frame") {
  const TraceBench bench;
  const Event event = one(bench, "(1436509052.249713) can0 181#2104FFFF00000000\n");
  CHECK(event.kind == EventKind::can_frame);
  CHECK(event.stamp_ns == 1'436'509'052'249'713'000);
  CHECK(event.channel == 0);
  CHECK(event.frame.id == 0x181);
  CHECK(event.frame.is_classical_data());
  CHECK(event.frame.size == 8);
  CHECK(event.frame.data[3] == 0xff);
}

TEST_CASE("all kinds of frames in candump's log form") {
  const TraceBench bench;
  CHECK(one(bench, "(1.5) can0 123#").frame.size == 0);
  CHECK(one(bench, "(1.5) can0 123#R").frame.is_remote);
  const CanFrame remote = one(bench, "(1.5) can0 123#R4").frame;
  CHECK(remote.is_remote);
  CHECK(remote.size == 4);
  const CanFrame extended = one(bench, "(1.5) can0 12345678#11.22.33").frame;
  CHECK(extended.is_extended);
  CHECK(extended.id == 0x12345678);
  CHECK(extended.size == 3);
  const CanFrame error = one(bench, "(1.5) can0 20000004#000C000000000000").frame;
  CHECK(error.is_error);
  CHECK_FALSE(error.is_extended);
  CHECK(error.id == 4);
  CHECK(error.data[1] == 0x0c);
  const CanFrame fd = one(bench, std::string("(1.5) can0 123##3").append(128, 'A')).frame;
  CHECK(fd.is_fd);
  CHECK(fd.is_bit_rate_switched);
  CHECK(fd.is_error_state_indicated);
  CHECK(fd.size == 64);
  CHECK(fd.data[63] == 0xaa);
  CHECK(one(bench, "(1.5) can0 123##0").frame.size == 0);
  CHECK(one(bench, "(1.5) can0 123#1122334455667788_B").frame.size == 8);
  CHECK(one(bench, "(1.5) can0 123#11 T").kind == EventKind::can_sent);
  CHECK(one(bench, "(1.5) can0 123#11 R").kind == EventKind::can_frame);
  CHECK(one(bench, "(1436509052.249713123)   can0 123#11\r\n").stamp_ns == 1'436'509'052'249'713'123);
}

TEST_CASE("candump's screen text, with and without everything it can show") {
  const TraceBench bench;
  for (const char* line : {
           "  can0  181   [4]  21 04 FF 00",
           " (1436509052.249713)  can0  181   [4]  21 04 FF 00",
           " (2015-07-10 06:17:32.249713)  can0  181   [4]  21 04 FF 00",
           "  can0  181   [4]  21 04 FF 00               '!...'",
           "  can0  RX - -  181   [4]  21 04 FF 00",
           "  can0       181   [4]  21 04 FF 00",
           "  can0  181   [4]  00`FF`04`21",
           "  can0  181   [4]  00`FF`04`21               `...!`",
           "  can0  181   [4]  00100001 00000100 11111111 00000000",
           "  can0  181   [4]  00000000`11111111`00000100`00100001",
           " \033[1m\033[34m can0\033[0m  181   [4]  21 04 FF 00",
       }) {
    const Event event = one(bench, line);
    CHECK(event.kind == EventKind::can_frame);
    CHECK(event.frame.id == 0x181);
    REQUIRE(event.frame.size == 4);
    CHECK(event.frame.data[0] == 0x21);
    CHECK(event.frame.data[1] == 0x04);
    CHECK(event.frame.data[2] == 0xff);
    CHECK(event.frame.data[3] == 0x00);
    CHECK_FALSE(event.frame.is_fd);
  }
  CHECK(one(bench, " (2015-07-10 06:17:32.249713)  can0  181   [0]").stamp_ns == 1'436'509'052'249'713'000);
  CHECK(one(bench, "  can0  TX - -  181   [0]").kind == EventKind::can_sent);
  const CanFrame fd = one(bench, "  can0  RX B E  12345678  [12]  00 01 02 03 04 05 06 07 08 09 0A 0B").frame;
  CHECK(fd.is_fd);
  CHECK(fd.is_extended);
  CHECK(fd.size == 12);
  CHECK(fd.data[11] == 0x0b);
  CHECK(fd.is_bit_rate_switched);
  CHECK(fd.is_error_state_indicated);
  const CanFrame small_fd = one(bench, "  can0  123  [08]  00 01 02 03 04 05 06 07").frame;
  CHECK(small_fd.is_fd);
  const CanFrame remote = one(bench, "  can0  123   [3]  remote request").frame;
  CHECK(remote.is_remote);
  CHECK(remote.size == 3);
  CHECK(one(bench, "  can0  123   [0]  remote request").frame.is_remote);
  const CanFrame error = one(bench, "  can0  20000088   [8]  00 00 80 19 00 00 00 00   ERRORFRAME").frame;
  CHECK(error.is_error);
  CHECK(error.id == 0x88);
  CHECK(error.data[3] == 0x19);
  CHECK(one(bench, "  can0  123   {B}  00 01 02 03 04 05 06 07").frame.size == 8);
}

TEST_CASE("time stamps: absolute, from zero, differences, none") {
  const TraceBench bench;
  CHECK(stamps_us(bench, " (0000000100.000001)  can0  1FF   [0]\n (0000000099.5)  can0  1FF   [0]\n") ==
        std::vector<std::int64_t>{100'000'001, 99'500'000});
  const char* from_zero =
      " (000.000000)  can0  1FF   [0]\n (000.010000)  can0  1FF   [0]\n (000.030000)  can0  1FF   [0]\n";
  CHECK(stamps_us(bench, from_zero) == std::vector<std::int64_t>{0, 10'000, 30'000});
  const char* differences =
      " (000.000000)  can0  1FF   [0]\n (000.010000)  can0  1FF   [0]\n (000.003000)  can0  1FF   [0]\n";
  CHECK(stamps_us(bench, differences) == std::vector<std::int64_t>{0, 10'000, 13'000});
  CandumpOptions options;
  options.stamps = CandumpOptions::Stamps::differences;
  CHECK(stamps_us(bench, from_zero, options) == std::vector<std::int64_t>{0, 10'000, 40'000});
  options.stamps = CandumpOptions::Stamps::as_written;
  CHECK(stamps_us(bench, differences, options) == std::vector<std::int64_t>{0, 10'000, 3'000});
  options = {};
  options.pace_ns = 500'000;
  CHECK(stamps_us(bench, "  can0  1FF   [0]\n  can0  1FF   [0]\n  can0  1FF   [0]\n", options) ==
        std::vector<std::int64_t>{0, 500, 1000});
}

TEST_CASE("a smaller stamp long after the start still makes the stamps what the beginning said") {
  const TraceBench bench;
  std::string text;
  for (int i = 0; i < 100; ++i) text += " (001.0000" + std::to_string(10 + i % 90) + ")  can0  1FF   [0]\n";
  const std::vector<std::int64_t> stamps = stamps_us(bench, text);
  REQUIRE(stamps.size() == 100);
  CHECK(stamps[63] == 1'000'073);
  CHECK(stamps[90] == 1'000'010);
}

TEST_CASE("interfaces become buses by their number, by what is free, or as configured") {
  const TraceBench bench;
  const auto file = bench.write(
      "buses.log", "(1.0) can1 1FF#\n(1.0) can0 1FF#\n(1.0) vcan0 1FF#\n(1.0) slcan10 1FF#\n(1.0) x 1FF#\n");
  CandumpReader reader(file);
  std::vector<int> buses;
  for (const sample::OwnedEvent& owned : all_events(reader)) buses.push_back(owned.event.channel);
  CHECK(buses == std::vector<int>{1, 0, 2, 3});
  CHECK(reader.problems().count == 1);
  CandumpOptions options;
  options.interfaces = {"vcan0", "can1"};
  CandumpReader configured(file, options);
  buses.clear();
  for (const sample::OwnedEvent& owned : all_events(configured)) buses.push_back(owned.event.channel);
  CHECK(buses == std::vector<int>{1, 0});
  CHECK(configured.problems().count == 3);
}

TEST_CASE("lines that are no frames are passed over, counted, and named with their number") {
  const TraceBench bench;
  const std::vector<std::string> bad = {
      "(1.0) can0 12#11",
      "(1.0) can0 1234#11",
      "(1.0) can0 800#11",
      "(1.0) can0 123#1",
      "(1.0) can0 123#GG",
      "(1.0) can0 123#112233445566778899",
      "(1.0) can0 123##",
      "(1.0) can0 123#R9",
      "(1.0) can0",
      "(1.0)",
      "(abc) can0 123#11",
      "(1.0 can0 123#11",
      "(99999999999999999999.0) can0 123#11",
      "  can0  123   [9]  00 01 02 03 04 05 06 07 08",
      "  can0  123   [2]  00",
      "  can0  123   [2]  00 1",
      "  can0  123   [-1]",
      "  can0  123   [2]  00 XX",
      "  can0  123  [65]",
      "can0 FFFFFFFF   [0]",
      "hello",
      std::string("(1.0) can0 123##0").append(130, '0'),
  };
  std::string text = "(1.0) can0 123#11\n";
  for (const std::string& line : bad) text += line + "\n";
  text += "DROPCOUNT: dropped 5 CAN frames on 'can0' socket (total drops 5)\n";
  text += "\n\tcontroller-problem{rx-error-warning}\n# a remark\n(1.1) can0 123#22\n(1.2) can0 123#2";
  CandumpReader reader(bench.write("bad.log", text));
  const auto events = all_events(reader);
  CHECK(events.size() == 2);
  CHECK(reader.problems().count == bad.size() + 2);  // the DROPCOUNT, and the last line, cut off
  CHECK(reader.problems().sentences.size() == TraceProblems::most_sentences);
  CHECK_THAT(reader.problems().sentences[0],
             Catch::Contains("bad.log:2: ") && Catch::Contains("'(1.0) can0 12#11'"));
}

TEST_CASE("random bytes are no frames and do no harm") {
  const TraceBench bench;
  std::mt19937 random(7);
  std::string text;
  for (int i = 0; i < 200'000; ++i) text += static_cast<char>(random() >> 13);
  CandumpReader reader(bench.write("noise.log", text));
  CHECK(all_events(reader).empty());
  CHECK(reader.problems().count > 10);
}

TEST_CASE(
    "every frame that a bus can carry comes back from candump's text as it was, its stamp in whole "
    "microseconds") {
  const TraceBench bench;
  std::string text;
  std::vector<Event> written;
  for (std::uint32_t i = 0; i < 400; ++i) {
    const Event event = sample::event_at(i).event;
    if (event.kind != EventKind::can_frame && event.kind != EventKind::can_sent) continue;
    append_candump(text, event, "can" + std::to_string(event.channel));
    written.push_back(event);
  }
  CandumpReader reader(bench.write("all.log", text));
  const auto read = all_events(reader);
  CHECK(reader.problems().count == 0);
  REQUIRE(read.size() == written.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    Event expected = written[i];
    expected.stamp_ns = expected.stamp_ns / 1000 * 1000;
    CHECK(sample::same(read[i].event, expected));
  }
}

TEST_CASE("the real trace of a TMCM-1636 reads as its 115 frames, the last of them without a line end") {
  if (!test::has_test_data("can/tmcm1636/candump.txt")) return;
  CandumpReader reader(test::test_data("can/tmcm1636/candump.txt"));
  const auto events = all_events(reader);
  CHECK(reader.problems().count == 0);
  REQUIRE(events.size() == 115);
  CHECK(events[0].event.frame.id == 0);
  CHECK(events[0].event.frame.data[0] == 0x82);
  CHECK(events[1].event.frame.id == 0x701);
  CHECK(events[114].event.stamp_ns == 114'000'000);
}

}  // namespace
}  // namespace alces::replay
