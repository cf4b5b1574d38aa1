#include "alces_platform/sim/motor/simulated_cia402_drive.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "alces_drivers/canopen/emcy.h"
#include "alces_drivers/canopen/sdo_abort.h"
#include "support/test_data.h"

using alces::CanFrame;
using namespace alces::sim;

namespace {

constexpr std::int64_t ms = 1'000'000;
constexpr std::int64_t s = 1'000'000'000;

CanFrame data_frame(std::uint32_t id, std::initializer_list<unsigned> bytes) {
  CanFrame frame{.id = id, .size = static_cast<std::uint8_t>(bytes.size())};
  std::ranges::transform(bytes, frame.data.begin(),
                         [](unsigned byte) { return static_cast<std::uint8_t>(byte); });
  return frame;
}

struct Answer {
  unsigned command = 0;
  std::uint32_t value = 0;
};

/// A drive, the time, and everything it said.
class Bench {
 public:
  explicit Bench(SimulatedCia402Drive::Config config = {}) : drive(config), node(config.slave.node) {}

  void run(std::int64_t duration_ns) {
    const std::int64_t end_ns = now_ns + duration_ns;
    while (drive.next_event_ns() <= end_ns) {
      now_ns = std::max(now_ns, drive.next_event_ns());
      collect();
    }
    now_ns = end_ns;
    collect();
  }
  void send(const CanFrame& frame) { drive.on_frame(frame, now_ns); }
  void nmt(unsigned command) { send(data_frame(0, {command, node})); }
  void sync() { send(data_frame(0x80, {})); }

  /// The eight bytes of the answer within 5 ms.
  std::optional<CanFrame> ask(std::initializer_list<unsigned> request) {
    const std::size_t before = said.size();
    send(data_frame(0x600U + node, request));
    run(5 * ms);
    for (std::size_t i = before; i < said.size(); ++i) {
      if (said[i].id == 0x580U + node) return said[i];
    }
    return std::nullopt;
  }
  Answer answer(std::initializer_list<unsigned> request) {
    const auto frame = ask(request);
    if (!frame) return {};
    std::uint32_t value = 0;
    for (unsigned i = 0; i < 4; ++i) value |= std::uint32_t{frame->data[4 + i]} << (8 * i);
    return {frame->data[0], value};
  }
  Answer read(unsigned index, unsigned sub = 0) {
    return answer({0x40, index & 0xFF, index >> 8, sub, 0, 0, 0, 0});
  }
  Answer write(unsigned index, unsigned sub, std::int64_t signed_value, unsigned size) {
    const auto value = static_cast<std::uint32_t>(signed_value);
    return answer({0x23 | (4 - size) << 2, index & 0xFF, index >> 8, sub, value & 0xFF, value >> 8 & 0xFF,
                   value >> 16 & 0xFF, value >> 24});
  }
  unsigned state() { return read(0x6041).value & 0x6F; }

  void boot() {
    drive.power_on(now_ns);
    run(600 * ms);
  }
  void enable(std::int64_t rpm, std::int64_t rpm_per_s = 600) {
    REQUIRE(write(0x6060, 0, 3, 1).command == 0x60);
    REQUIRE(write(0x6083, 0, rpm_per_s, 4).command == 0x60);
    REQUIRE(write(0x6084, 0, rpm_per_s, 4).command == 0x60);
    REQUIRE(write(0x6085, 0, 10 * rpm_per_s, 4).command == 0x60);
    REQUIRE(write(0x60FF, 0, rpm, 4).command == 0x60);
    for (const int word : {0x06, 0x07, 0x0F}) REQUIRE(write(0x6040, 0, word, 2).command == 0x60);
    REQUIRE(drive.state() == Cia402State::operation_enabled);
  }
  [[nodiscard]] std::vector<CanFrame> said_by(std::uint32_t id) const {
    std::vector<CanFrame> frames;
    std::ranges::copy_if(said, std::back_inserter(frames),
                         [&](const CanFrame& frame) { return frame.id == id; });
    return frames;
  }

  SimulatedCia402Drive drive;
  unsigned node;
  std::int64_t now_ns = s;
  std::vector<CanFrame> said;
  std::vector<std::int64_t> said_ns;

 private:
  void collect() {
    CanFrame frame;
    while (drive.poll(now_ns, frame)) {
      said.push_back(frame);
      said_ns.push_back(now_ns);
    }
  }
};

constexpr auto epos4 = SimulatedCia402Drive::Model::epos4;

std::uint32_t abort_code(SdoAbort code) {
  return static_cast<std::uint32_t>(code);
}

// --- SDO ---

TEST_CASE("the drive answers expedited SDO with the size of the object, a moment after the request") {
  Bench bench;
  bench.boot();
  CHECK(bench.read(0x1000).command == 0x43);
  CHECK(bench.read(0x1000).value == 0x420192);
  CHECK(bench.read(0x1017).command == 0x4B);
  CHECK(bench.read(0x1001).command == 0x4F);
  CHECK(bench.write(0x6083, 0, 1234, 4).command == 0x60);
  CHECK(bench.read(0x6083).value == 1234);
  CHECK(bench.write(0x605A, 0, -1, 2).command == 0x60);
  CHECK(bench.read(0x605A).value == 0xFFFF);

  const std::int64_t asked_ns = bench.now_ns;
  REQUIRE(bench.ask({0x40, 0x00, 0x10, 0, 0, 0, 0, 0}));
  CHECK(bench.said_ns.back() == asked_ns + 1 * ms);
}

TEST_CASE("every refusal has CiA 301's abort code, and the refused value is not taken") {
  Bench bench({.model = epos4});
  bench.boot();
  const auto refused = [&](const Answer& answer, SdoAbort code) {
    INFO(alces::canopen::sdo_abort_text(abort_code(code)));
    CHECK(answer.command == 0x80);
    CHECK(answer.value == abort_code(code));
  };
  refused(bench.read(0x5555), SdoAbort::no_object);
  refused(bench.read(0x1018, 9), SdoAbort::no_subindex);
  refused(bench.write(0x5555, 0, 0, 1), SdoAbort::no_object);
  refused(bench.write(0x1018, 9, 0, 1), SdoAbort::no_subindex);
  refused(bench.write(0x6041, 0, 0, 2), SdoAbort::read_only);
  refused(bench.write(0x1005, 0, 0x80, 4), SdoAbort::read_only);
  refused(bench.write(0x6083, 0, 1, 2), SdoAbort::length);
  refused(bench.write(0x1017, 0, 1, 4), SdoAbort::length);
  refused(bench.write(0x6083, 0, 0, 4), SdoAbort::too_low);
  refused(bench.write(0x6060, 0, 2, 1), SdoAbort::invalid_value);  // velocity mode: not in 0x6502
  refused(bench.write(0x6060, 0, -5, 1), SdoAbort::invalid_value);
  refused(bench.write(0x1003, 0, 1, 1), SdoAbort::invalid_value);
  refused(bench.write(0x1010, 1, 1, 4), SdoAbort::cannot_be_stored);
  refused(bench.answer({0xE0, 0, 0x10, 0, 0, 0, 0, 0}), SdoAbort::command);
  refused(bench.answer({0xC0, 0, 0x10, 0, 0, 0, 0, 0}), SdoAbort::command);  // block download
  refused(bench.answer({0xA0, 0, 0x10, 0, 0, 0, 0, 0}), SdoAbort::command);  // block upload
  refused(bench.answer({0x60, 0, 0, 0, 0, 0, 0, 0}), SdoAbort::command);     // a segment of no transfer
  refused(bench.answer({0x00, 0, 0, 0, 0, 0, 0, 0}), SdoAbort::command);
  CHECK(bench.read(0x6083).value == 10000);
  CHECK(bench.drive.counters().sdo_aborts == 18);
}

TEST_CASE("a string comes in segments with toggling bits, and a wrong toggle ends the transfer") {
  Bench bench;
  bench.boot();
  const auto start = bench.ask({0x40, 0x08, 0x10, 0, 0, 0, 0, 0});
  REQUIRE(start);
  CHECK(start->data[0] == 0x41);
  CHECK(start->data[4] == 9);
  const auto first = bench.ask({0x60, 0, 0, 0, 0, 0, 0, 0});
  REQUIRE(first);
  CHECK(first->data[0] == 0x00);
  const auto second = bench.ask({0x70, 0, 0, 0, 0, 0, 0, 0});
  REQUIRE(second);
  CHECK(second->data[0] == (0x10 | 5 << 1 | 1));
  std::string name(first->data.begin() + 1, first->data.begin() + 8);
  name.append(second->data.begin() + 1, second->data.begin() + 3);
  CHECK(name == "TMCM-1636");

  REQUIRE(bench.ask({0x40, 0x08, 0x10, 0, 0, 0, 0, 0}));
  CHECK(bench.answer({0x70, 0, 0, 0, 0, 0, 0, 0}).value == abort_code(SdoAbort::toggle_bit));
  CHECK(bench.answer({0x60, 0, 0, 0, 0, 0, 0, 0}).value == abort_code(SdoAbort::command));
}

TEST_CASE("a number may be downloaded in segments, the announced length must come") {
  Bench bench;
  bench.boot();
  REQUIRE(bench.answer({0x21, 0x83, 0x60, 0, 4, 0, 0, 0}).command == 0x60);
  CHECK(bench.answer({0x07, 0x78, 0x56, 0x34, 0x12, 0, 0, 0}).command == 0x20);
  CHECK(bench.read(0x6083).value == 0x12345678);
  REQUIRE(bench.answer({0x21, 0x83, 0x60, 0, 4, 0, 0, 0}).command == 0x60);
  CHECK(bench.answer({0x09, 1, 2, 3, 0, 0, 0, 0}).value == abort_code(SdoAbort::length));
  CHECK(bench.read(0x6083).value == 0x12345678);
  REQUIRE(bench.answer({0x21, 0x83, 0x60, 0, 4, 0, 0, 0}).command == 0x60);
  CHECK_FALSE(bench.ask({0x80, 0x83, 0x60, 0, 0, 0, 4, 5}));  // the client's abort is not answered
  CHECK(bench.answer({0x07, 1, 2, 3, 4, 0, 0, 0}).value == abort_code(SdoAbort::command));
}

TEST_CASE("frames that are no requests are counted and do no harm") {
  Bench bench;
  bench.boot();
  const auto before = bench.drive.counters();
  bench.send(data_frame(0x601, {0x40, 0x41, 0x60}));
  bench.send(data_frame(0x602, {0x40, 0x41, 0x60, 0, 0, 0, 0, 0}));
  bench.send(data_frame(0, {0x01}));
  bench.send(data_frame(0, {0x99, 1}));
  bench.send(data_frame(0, {0x01, 2}));
  CanFrame extended = data_frame(0x601, {0x40, 0x41, 0x60, 0, 0, 0, 0, 0});
  extended.is_extended = true;
  bench.send(extended);
  bench.send({.id = 0x4, .size = 8, .is_error = true});
  const std::size_t said = bench.said.size();
  bench.run(100 * ms);
  CHECK(bench.said.size() == said);
  CHECK(bench.drive.nmt_state() == NmtState::pre_operational);
  CHECK(bench.drive.counters().frames_ignored == before.frames_ignored + 7);
}

// --- NMT and heartbeat ---

TEST_CASE("boot-up, heartbeat and the NMT states are CiA 301's") {
  Bench bench;
  bench.drive.power_on(bench.now_ns);
  bench.run(499 * ms);
  CHECK(bench.said.empty());
  bench.run(2 * ms);
  REQUIRE(bench.said.size() == 1);
  CHECK(bench.said[0] == data_frame(0x701, {0}));

  REQUIRE(bench.write(0x1017, 0, 100, 2).command == 0x60);
  bench.said.clear();
  bench.run(250 * ms);
  bench.nmt(0x01);
  bench.run(100 * ms);
  bench.nmt(0x02);
  bench.run(100 * ms);
  std::string states;
  for (const CanFrame& frame : bench.said_by(0x701))
    states += frame.data[0] == 0x7F ? 'p' : frame.data[0] == 5 ? 'o' : 's';
  CHECK(states == "ppos");
  CHECK_FALSE(bench.ask({0x40, 0x00, 0x10, 0, 0, 0, 0, 0}));  // stopped: no SDO
  bench.nmt(0x80);
  CHECK(bench.read(0x1000).value == 0x420192);
}

TEST_CASE("reset communication keeps the drive's parameters, reset node forgets both, save keeps them") {
  Bench bench;
  bench.boot();
  REQUIRE(bench.write(0x6083, 0, 77, 4).command == 0x60);
  REQUIRE(bench.write(0x1017, 0, 50, 2).command == 0x60);
  bench.nmt(0x82);
  bench.run(100 * ms);
  CHECK(bench.read(0x6083).value == 77);
  CHECK(bench.read(0x1017).value == 0);
  bench.nmt(0x81);
  bench.run(600 * ms);
  CHECK(bench.read(0x6083).value == 0);
  REQUIRE(bench.write(0x6083, 0, 78, 4).command == 0x60);
  REQUIRE(bench.write(0x1010, 1, 0x65766173, 4).command == 0x60);
  bench.nmt(0x81);
  bench.run(600 * ms);
  CHECK(bench.read(0x6083).value == 78);
  REQUIRE(bench.write(0x1011, 1, 0x64616F6C, 4).command == 0x60);
  CHECK(bench.read(0x6083).value == 78);
  bench.nmt(0x81);
  bench.run(600 * ms);
  CHECK(bench.read(0x6083).value == 0);
  CHECK(bench.said_by(0x701).size() == 5);  // power-on, and four resets
}

TEST_CASE("node guarding answers with a toggling bit while there is no heartbeat") {
  Bench bench;
  bench.boot();
  bench.said.clear();
  for (int i = 0; i < 3; ++i) bench.send({.id = 0x701, .size = 1, .is_remote = true});
  bench.run(ms);
  const auto states = bench.said_by(0x701);
  REQUIRE(states.size() == 3);
  CHECK(states[0].data[0] == 0x7F);
  CHECK(states[1].data[0] == 0xFF);
  CHECK(states[2].data[0] == 0x7F);
}

TEST_CASE("a heartbeat that the drive consumes and that stays away is an EMCY, and it brakes as told") {
  Bench bench({.model = epos4});
  bench.boot();
  bench.enable(60);
  bench.nmt(0x01);
  REQUIRE(bench.write(0x1016, 1, 0x007F0064, 4).command == 0x60);
  bench.run(s);
  CHECK(bench.said_by(0x81).empty());  // not before the first heartbeat
  for (int i = 0; i < 20; ++i) {
    bench.send(data_frame(0x77F, {5}));
    bench.run(50 * ms);
  }
  CHECK(bench.said_by(0x81).empty());
  bench.run(200 * ms);
  const auto emergencies = bench.said_by(0x81);
  REQUIRE(emergencies.size() == 1);
  CHECK(emergencies[0].data[0] == 0x30);
  CHECK(emergencies[0].data[1] == 0x81);
  CHECK(bench.drive.nmt_state() == NmtState::pre_operational);
  CHECK(bench.drive.state() == Cia402State::quick_stop_active);  // 0x6007 = 3, 0x605A = 6
}

// --- PDO ---

TEST_CASE("PDO parameters change only as CiA 301 allows") {
  Bench bench;
  bench.boot();
  const auto write = [&](unsigned index, unsigned sub, std::int64_t value, unsigned size) {
    const Answer answer = bench.write(index, sub, value, size);
    return answer.command == 0x60 ? 0 : answer.value;
  };
  CHECK(write(0x1A00, 0, 0, 1) == abort_code(SdoAbort::unsupported_access));  // the PDO is on
  CHECK(write(0x1800, 1, 0x40000199, 4) ==
        abort_code(SdoAbort::invalid_value));  // another identifier while on
  REQUIRE(write(0x1800, 1, 0xC0000181, 4) == 0);
  CHECK(write(0x1A00, 1, 0x60640020, 4) == abort_code(SdoAbort::unsupported_access));  // its count is not 0
  REQUIRE(write(0x1A00, 0, 0, 1) == 0);
  CHECK(write(0x1A00, 1, 0x60FE0120, 4) == abort_code(SdoAbort::no_object));
  CHECK(write(0x1A00, 1, 0x60640120, 4) == abort_code(SdoAbort::no_subindex));
  CHECK(write(0x1A00, 1, 0x60830020, 4) == abort_code(SdoAbort::cannot_be_mapped));
  CHECK(write(0x1A00, 1, 0x60640010, 4) == abort_code(SdoAbort::cannot_be_mapped));  // 16 of 32 bits
  REQUIRE(write(0x1A00, 1, 0x60640020, 4) == 0);
  REQUIRE(write(0x1A00, 2, 0x606C0020, 4) == 0);
  REQUIRE(write(0x1A00, 3, 0x60410010, 4) == 0);
  CHECK(write(0x1A00, 0, 3, 1) == abort_code(SdoAbort::pdo_length));
  CHECK(write(0x1A00, 0, 4, 1) == abort_code(SdoAbort::pdo_length));
  REQUIRE(write(0x1A00, 0, 2, 1) == 0);
  CHECK(write(0x1800, 2, 241, 1) == abort_code(SdoAbort::invalid_value));
  REQUIRE(write(0x1800, 2, 1, 1) == 0);
  REQUIRE(write(0x1800, 1, 0x40000181, 4) == 0);
  CHECK(write(0x1600, 1, 0x60410010, 4) == abort_code(SdoAbort::unsupported_access));
  REQUIRE(write(0x1400, 1, 0xC0000201, 4) == 0);
  REQUIRE(write(0x1600, 0, 0, 1) == 0);
  CHECK(write(0x1600, 1, 0x60410010, 4) ==
        abort_code(SdoAbort::cannot_be_mapped));  // the statusword is read-only
}

void map_and_turn(Bench& bench, std::int64_t rpm) {
  bench.boot();
  REQUIRE(bench.write(0x1803, 1, 0xC0000481, 4).command == 0x60);
  for (const unsigned tpdo : {0U, 1U}) {
    REQUIRE(bench.write(0x1800 + tpdo, 1, 0xC0000181 + 0x100 * tpdo, 4).command == 0x60);
    REQUIRE(bench.write(0x1A00 + tpdo, 0, 0, 1).command == 0x60);
  }
  REQUIRE(bench.write(0x1A00, 1, 0x60640020, 4).command == 0x60);
  REQUIRE(bench.write(0x1A00, 2, 0x60410010, 4).command == 0x60);
  REQUIRE(bench.write(0x1A00, 0, 2, 1).command == 0x60);
  REQUIRE(bench.write(0x1800, 2, 3, 1).command == 0x60);
  REQUIRE(bench.write(0x1800, 1, 0x40000181, 4).command == 0x60);
  REQUIRE(bench.write(0x1802, 1, 0xC0000381, 4).command == 0x60);
  bench.enable(rpm);
  bench.nmt(0x01);
  bench.run(s);
  bench.said.clear();
  bench.said_ns.clear();
}

TEST_CASE("a TPDO of type 3 comes at every third SYNC with the position at the SYNC") {
  Bench bench;
  map_and_turn(bench, 60);
  std::vector<double> counts;
  for (int i = 0; i < 9; ++i) {
    bench.sync();
    if (i % 3 == 2) counts.push_back(std::floor(bench.drive.shaft_counts_at(bench.now_ns)));
    bench.run(10 * ms);
  }
  const auto frames = bench.said_by(0x181);
  REQUIRE(frames.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(frames[i].size == 6);
    const double told =
        static_cast<double>(decode_little_endian(frames[i].bytes().first(4), DataType::integer32));
    CHECK(told == counts[i]);
    CHECK((frames[i].data[4] & 0x6F) == 0x27);
  }
  CHECK(bench.drive.counters().syncs == 9);
}

TEST_CASE(
    "event-driven TPDOs come when something changes, not sooner than the inhibit time, and by their timer") {
  Bench bench;
  bench.boot();
  REQUIRE(bench.write(0x1802, 1, 0xC0000381, 4).command == 0x60);
  REQUIRE(bench.write(0x1803, 1, 0xC0000481, 4).command == 0x60);
  REQUIRE(bench.write(0x1801, 1, 0xC0000281, 4).command == 0x60);
  bench.nmt(0x01);
  bench.run(100 * ms);
  CHECK(bench.said_by(0x181).size() == 1);  // once at the start
  bench.run(s);
  CHECK(bench.said_by(0x181).size() == 1);
  REQUIRE(bench.write(0x6040, 0, 6, 2).command == 0x60);
  CHECK(bench.said_by(0x181).size() == 2);
  REQUIRE(bench.write(0x1800, 5, 100, 2).command == 0x60);
  bench.run(1010 * ms);
  CHECK(bench.said_by(0x181).size() == 12);

  REQUIRE(bench.write(0x1800, 5, 0, 2).command == 0x60);
  REQUIRE(bench.write(0x1800, 3, 10000, 2).command == 0x60);  // 1 s
  bench.run(s);
  const std::size_t before = bench.said_by(0x181).size();
  for (const int word : {7, 6, 7, 6}) REQUIRE(bench.write(0x6040, 0, word, 2).command == 0x60);
  bench.run(100 * ms);
  CHECK(bench.said_by(0x181).size() == before + 1);
  bench.run(2 * s);
  CHECK(bench.said_by(0x181).size() == before + 2);  // the last word is told in the end
}

TEST_CASE("synchronous RPDOs wait for the SYNC, others act at once, short ones are refused with an EMCY") {
  Bench bench;
  bench.boot();
  bench.nmt(0x01);
  bench.run(10 * ms);
  bench.send(data_frame(0x201, {0x06, 0x00}));  // type 255
  CHECK(bench.drive.state() == Cia402State::ready_to_switch_on);
  REQUIRE(bench.write(0x1400, 2, 1, 1).command == 0x60);
  bench.send(data_frame(0x201, {0x07, 0x00}));
  bench.run(100 * ms);
  CHECK(bench.drive.state() == Cia402State::ready_to_switch_on);
  bench.sync();
  CHECK(bench.drive.state() == Cia402State::switched_on);

  bench.said.clear();
  bench.send(data_frame(0x201, {0x06}));
  bench.sync();
  bench.run(10 * ms);
  CHECK(bench.drive.state() == Cia402State::switched_on);
  REQUIRE(bench.said_by(0x81).size() == 1);
  CHECK(bench.said_by(0x81)[0].data[0] == 0x10);
  CHECK(bench.said_by(0x81)[0].data[1] == 0x82);
  CHECK(bench.drive.counters().rpdos_too_short == 1);

  bench.nmt(0x80);
  bench.send(data_frame(0x301, {0x06, 0x00, 0x03}));
  CHECK(bench.drive.state() == Cia402State::switched_on);  // pre-operational: no PDOs
}

// --- CiA 402 ---

TEST_CASE("the state machine walks CiA 402's transitions and no others") {
  Bench bench;
  bench.boot();
  REQUIRE(bench.write(0x6060, 0, 3, 1).command == 0x60);
  // what the controlword leads to, from each state
  const auto expect = [&](int word, unsigned state) {
    CAPTURE(word);
    REQUIRE(bench.write(0x6040, 0, word, 2).command == 0x60);
    CHECK(bench.state() == state);
  };
  CHECK((bench.state() & 0x4F) == 0x40);
  for (const int word : {0x00, 0x02, 0x07, 0x0F, 0x80}) expect(word, 0x40);
  expect(0x06, 0x21);
  expect(0x00, 0x40);
  expect(0x06, 0x21);
  expect(0x02, 0x40);
  expect(0x06, 0x21);
  expect(0x0F, 0x27);  // 3 and 4 at once
  expect(0x07, 0x23);
  expect(0x06, 0x21);
  expect(0x07, 0x23);
  expect(0x02, 0x40);
  expect(0x06, 0x21);
  expect(0x07, 0x23);
  expect(0x00, 0x40);
  expect(0x06, 0x21);
  expect(0x07, 0x23);
  expect(0x0F, 0x27);
  expect(0x06, 0x21);
  expect(0x0F, 0x27);
  expect(0x8F, 0x27);  // no fault: the bit does nothing
  expect(0x00, 0x40);
}

TEST_CASE("the shaft follows the ramps exactly, and the counter and speed tell of it") {
  Bench bench;
  bench.boot();
  bench.enable(60, 30);                                 // 1 turn/s after 2 s
  const std::int64_t begin_ns = bench.now_ns - 5 * ms;  // the last write
  bench.run(5 * s);
  const auto turns = [&](double t) { return bench.drive.head_turns_at(begin_ns + std::llround(t * 1e9)); };
  CHECK(turns(0) == Approx(0).margin(1e-9));
  CHECK(turns(1) == Approx(0.25));
  CHECK(turns(2) == Approx(1));
  CHECK(turns(3.5) == Approx(2.5));
  CHECK(bench.read(0x606C).value == 60);
  CHECK((bench.read(0x6041).value & 0x1400) == 0x400);  // target reached, not standing
  const auto told = static_cast<std::int32_t>(bench.read(0x6064).value);
  CHECK(told == Approx(bench.drive.shaft_counts_at(bench.now_ns - 5 * ms)).margin(1.01));

  REQUIRE(bench.write(0x60FF, 0, -30, 4).command == 0x60);  // through standstill
  CHECK((bench.read(0x6041).value & 0x400) == 0);
  bench.run(4 * s);
  CHECK(static_cast<std::int32_t>(bench.read(0x606C).value) == -30);
  CHECK(bench.drive.head_turns_per_s_at(bench.now_ns) == Approx(-0.5));
  REQUIRE(bench.write(0x6040, 0, 0x010F, 2).command == 0x60);  // halt
  bench.run(2 * s);
  CHECK(bench.drive.head_turns_per_s_at(bench.now_ns) == 0);
  CHECK(bench.state() == 0x27);
  CHECK((bench.read(0x6041).value & 0x1400) == 0x1400);
  CHECK(turns(1) == Approx(0.25));  // the past stays
}

TEST_CASE("the position is continuous at any time, whatever is commanded") {
  Bench bench;
  bench.boot();
  bench.enable(600, 6000);
  const std::int64_t begin_ns = bench.now_ns;
  for (const int rpm : {100, -3000, 50, 50, 0, 4000, 9000}) {
    REQUIRE(bench.write(0x60FF, 0, rpm, 4).command == 0x60);
    bench.run(137 * ms);
  }
  CHECK((bench.read(0x6041).value & 0x800) != 0);  // 9000 is beyond 0x607F
  bench.drive.set_stalled(true, bench.now_ns);
  bench.run(100 * ms);
  bench.drive.set_stalled(false, bench.now_ns);
  bench.run(3 * s);
  CHECK(bench.read(0x606C).value == 4000);
  double before = bench.drive.shaft_counts_at(begin_ns);
  double largest = 0;
  for (std::int64_t at_ns = begin_ns; at_ns < bench.now_ns; at_ns += ms / 2) {
    const double here = bench.drive.shaft_counts_at(at_ns);
    largest = std::max(largest, std::abs(here - before));
    before = here;
  }
  CHECK(largest > 1000);
  CHECK(largest < 4000.0 / 60 * 65536 * 0.5e-3 * 1.001);
}

TEST_CASE("the position counter wraps like a 32-bit number, the shaft does not") {
  SimulatedCia402Drive::Config config;
  config.axis.position_at_power_on = 0x7FFFFF00;
  Bench bench(config);
  bench.boot();
  CHECK(bench.read(0x6064).value == 0x7FFFFF00);
  bench.enable(600);
  bench.run(2 * s);
  CHECK(static_cast<std::int32_t>(bench.read(0x6064).value) < 0);
  CHECK(bench.drive.shaft_counts_at(bench.now_ns) > 256);
}

TEST_CASE("quick stop brakes by its option code and stays or is disabled") {
  for (const int option : {0, 1, 2, 5, 6}) {
    CAPTURE(option);
    Bench bench;
    bench.boot();
    bench.enable(600, 600);
    bench.run(2 * s);
    REQUIRE(bench.write(0x605A, 0, option, 2).command == 0x60);
    REQUIRE(bench.write(0x6040, 0, 0x02, 2).command == 0x60);
    CHECK(bench.state() == (option == 0 ? 0x40U : 0x07U));
    bench.run(150 * ms);
    const bool is_quick = option == 2 || option == 6;
    CHECK((bench.drive.head_turns_per_s_at(bench.now_ns) == 0) == is_quick);
    bench.run(2 * s);
    CHECK(bench.drive.head_turns_per_s_at(bench.now_ns) == 0);
    CHECK(bench.state() == (option >= 5 ? 0x07U : 0x40U));
    REQUIRE(bench.write(0x6040, 0, 0x0F, 2).command == 0x60);
    CHECK(bench.state() == (option >= 5 ? 0x27U : 0x40U));
  }
}

TEST_CASE("a fault brakes, reports itself, and needs the rising edge of the reset bit") {
  Bench bench({.model = epos4});
  bench.boot();
  bench.enable(600, 600);
  bench.nmt(0x01);
  bench.run(2 * s);
  bench.said.clear();
  bench.drive.raise_fault(0x2310, bench.now_ns);
  CHECK((bench.read(0x6041).value & 0x4F) == 0x0F);
  bench.run(s);
  CHECK((bench.read(0x6041).value & 0x4F) == 0x08);
  CHECK(bench.drive.head_turns_per_s_at(bench.now_ns) == 0);
  REQUIRE(bench.said_by(0x81).size() == 1);
  CHECK(bench.said_by(0x81)[0] == data_frame(0x81, {0x10, 0x23, 0x03, 0, 0, 0, 0, 0}));
  CHECK(bench.read(0x603F).value == 0x2310);
  CHECK(bench.read(0x1001).value == 0x03);
  CHECK(bench.read(0x1003, 0).value == 1);
  CHECK(bench.read(0x1003, 1).value == 0x2310);

  for (const int word : {0x06, 0x0F, 0x00}) REQUIRE(bench.write(0x6040, 0, word, 2).command == 0x60);
  CHECK((bench.state() & 0x4F) == 0x08);
  REQUIRE(bench.write(0x6040, 0, 0x80, 2).command == 0x60);
  CHECK((bench.state() & 0x4F) == 0x40);
  REQUIRE(bench.said_by(0x81).size() == 2);
  CHECK(bench.said_by(0x81)[1] == data_frame(0x81, {0, 0, 0, 0, 0, 0, 0, 0}));
  CHECK(bench.read(0x603F).value == 0);

  bench.drive.raise_fault(0x3210, bench.now_ns);
  REQUIRE(bench.write(0x6040, 0, 0x80, 2).command == 0x60);  // it was 0x80 before: no edge
  CHECK((bench.state() & 0x4F) == 0x08);
  CHECK(bench.read(0x1003, 2).value == 0x2310);
}

TEST_CASE("a fault for ever comes back at every reset, until its cause is removed") {
  Bench bench;
  bench.boot();
  bench.drive.raise_fault(0x5530, bench.now_ns, SimulatedCia402Drive::Clearing::never);
  for (int i = 0; i < 3; ++i) {
    REQUIRE(bench.write(0x6040, 0, 0x00, 2).command == 0x60);
    REQUIRE(bench.write(0x6040, 0, 0x80, 2).command == 0x60);
    CHECK((bench.state() & 0x4F) == 0x08);
  }
  CHECK(bench.said_by(0x81).size() == 4);
  bench.drive.remove_fault_cause();
  REQUIRE(bench.write(0x6040, 0, 0x00, 2).command == 0x60);
  REQUIRE(bench.write(0x6040, 0, 0x80, 2).command == 0x60);
  CHECK((bench.state() & 0x4F) == 0x40);
}

// --- misbehaviour ---

TEST_CASE("a reset in mid-drive: boot-up message, the shaft coasts, the counter starts again") {
  Bench bench;
  bench.boot();
  bench.enable(600);
  bench.nmt(0x01);
  bench.run(3 * s);
  bench.said.clear();
  const double turns = bench.drive.head_turns_at(bench.now_ns);
  bench.drive.set_boot_ns(2 * s);
  bench.drive.reset(bench.now_ns);
  CHECK_FALSE(bench.ask({0x40, 0x41, 0x60, 0, 0, 0, 0, 0}));
  bench.run(3 * s);
  REQUIRE(bench.said_by(0x701).size() == 1);
  CHECK(bench.said_by(0x701)[0].data[0] == 0);
  CHECK(bench.drive.nmt_state() == NmtState::pre_operational);
  CHECK(bench.drive.head_turns_per_s_at(bench.now_ns) == 0);
  CHECK(bench.drive.head_turns_at(bench.now_ns) > turns + 1);
  CHECK(bench.read(0x6060).value == 0);
  CHECK(static_cast<std::int32_t>(bench.read(0x6064).value) == 0);
}

TEST_CASE("an absent or silent drive says nothing, and comes back") {
  Bench bench;
  bench.boot();
  REQUIRE(bench.write(0x1017, 0, 100, 2).command == 0x60);
  bench.said.clear();
  SECTION("off the bus") {
    bench.drive.set_absent(true);
    CHECK_FALSE(bench.ask({0x40, 0x41, 0x60, 0, 0, 0, 0, 0}));
    bench.run(s);
    CHECK(bench.said.empty());
    bench.drive.set_absent(false);
    bench.run(s);
    CHECK(bench.said_by(0x701).size() == 10);
  }
  SECTION("no heartbeat") {
    bench.drive.set_heartbeat_silent(true);
    bench.run(s);
    CHECK(bench.said.empty());
    CHECK(bench.read(0x1000).value == 0x420192);
  }
  SECTION("no SDO") {
    bench.drive.set_sdo_silent(true);
    CHECK_FALSE(bench.ask({0x40, 0x41, 0x60, 0, 0, 0, 0, 0}));
    bench.run(s);
    CHECK(bench.said_by(0x701).size() == 10);
  }
  SECTION("SDO late") {
    bench.drive.set_sdo_latency_ns(300 * ms);
    CHECK_FALSE(bench.ask({0x40, 0x41, 0x60, 0, 0, 0, 0, 0}));
    bench.run(s);
    CHECK(bench.said_by(0x581).size() == 1);
  }
  SECTION("SDO refused, twice") {
    bench.drive.abort_sdo(0x6083, 0, 0x08000022, 2);
    CHECK(bench.write(0x6083, 0, 5, 4).value == 0x08000022);
    CHECK(bench.read(0x6083).value == 0x08000022);
    CHECK(bench.read(0x6083).value == 0);
  }
  SECTION("no power") {
    bench.drive.power_off(bench.now_ns);
    bench.run(s);
    CHECK(bench.said.empty());
    CHECK(bench.drive.next_event_ns() == INT64_MAX);
    bench.boot();
    CHECK(bench.said_by(0x701).size() == 1);
  }
}

TEST_CASE("a held shaft stands though it is commanded, and accelerates when it is let go") {
  Bench bench;
  bench.boot();
  bench.enable(60);
  bench.run(2 * s);
  bench.drive.set_stalled(true, bench.now_ns);
  bench.run(s);
  CHECK(bench.read(0x606C).value == 0);
  CHECK(bench.read(0x606B).value == 60);
  CHECK((bench.read(0x6041).value & 0x146F) == 0x1027);  // standing, target not reached
  bench.drive.set_stalled(false, bench.now_ns);
  bench.run(2 * s);
  CHECK(bench.read(0x606C).value == 60);
}

TEST_CASE("polling often or seldom gives the same frames") {
  const auto frames = [](std::int64_t step_ns) {
    SimulatedCia402Drive drive(SimulatedCia402Drive::Config{});
    std::vector<CanFrame> said;
    drive.power_on(0);
    const auto until = [&](std::int64_t& now_ns, std::int64_t end_ns) {
      CanFrame frame;
      for (; now_ns <= end_ns; now_ns += step_ns) {
        while (drive.poll(now_ns, frame)) said.push_back(frame);
      }
      now_ns = end_ns;
      while (drive.poll(now_ns, frame)) said.push_back(frame);
    };
    std::int64_t now_ns = 0;
    until(now_ns, s);
    drive.on_frame(data_frame(0x601, {0x2B, 0x17, 0x10, 0, 100, 0, 0, 0}), now_ns);
    drive.on_frame(data_frame(0, {1, 1}), now_ns);
    until(now_ns, 2 * s);
    drive.raise_fault(0x4310, now_ns);
    until(now_ns, 3 * s);
    return said;
  };
  CHECK(frames(ms) == frames(500 * ms));
  CHECK(frames(ms).size() > 20);
}

// --- against the real node ---

TEST_CASE("the recorded requests to a real TMCM-1636 get the answers that it gave") {
  if (!alces::test::has_test_data("can/tmcm1636/candump.txt")) return;
  std::ifstream file(alces::test::test_data("can/tmcm1636/candump.txt"));
  std::vector<CanFrame> trace;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string bus;
    std::string size;
    CanFrame frame;
    words >> bus >> std::hex >> frame.id >> size;
    unsigned byte = 0;
    while (words >> byte) frame.data[frame.size++] = static_cast<std::uint8_t>(byte);
    REQUIRE(frame.size == size[1] - '0');
    trace.push_back(frame);
  }
  REQUIRE(trace.size() == 115);

  SimulatedCia402Drive::Config config;
  config.axis.position_at_power_on = -278240704;  // 0xEF6A6240
  Bench bench(config);
  bench.boot();
  // As it was found: in a fault, the last controlword with halt and fault reset.
  REQUIRE(bench.write(0x6040, 0, 0x0180, 2).command == 0x60);
  bench.drive.raise_fault(0x6320, bench.now_ns);
  bench.run(s);
  bench.said.clear();

  int same_bytes = 0;
  int syncs = 0;
  std::size_t heard = 0;  // of what the node said
  for (std::size_t i = 0; i < trace.size(); ++i) {
    CAPTURE(i, trace[i].id);
    const std::uint32_t id = trace[i].id;
    const bool is_nodes = id == 0x701 || id == 0x581 || id == 0x081;
    if (!is_nodes) {
      if (id == 0x080 && syncs++ == 0)
        bench.drive.raise_fault(0x6320, bench.now_ns);  // what it found wrong is its own
      bench.send(trace[i]);
      bench.run(30 * ms);
      continue;
    }
    REQUIRE(heard < bench.said.size());
    const CanFrame& said = bench.said[heard++];
    CHECK(said.id == id);
    CHECK(said.size == trace[i].size);
    CHECK(said.data[0] ==
          trace[i].data[0]);  // the command specifier with its length; the NMT state; the code
    if (said == trace[i]) ++same_bytes;
  }
  CHECK(heard == bench.said.size());
  CHECK(heard == 51);
  CHECK(same_bytes == 51);
  CHECK(bench.drive.nmt_state() == NmtState::stopped);
  CHECK(bench.drive.state() == Cia402State::switch_on_disabled);
}

TEST_CASE("the simulated dictionaries are those of the EDS files") {
  struct File {
    const char* name;
    ObjectDictionary objects;
    std::size_t least;
  };
  const File files[] = {{"can/tmcm1636/TMCM-1636-CANopen.dcf", tmcm1636_objects(1), 146},
                        {"can/eds/MaxonEPOS4_cern.eds", epos4_objects(1), 100}};
  for (const File& item : files) {
    CAPTURE(item.name);
    if (!alces::test::has_test_data(item.name)) return;
    std::ifstream file(alces::test::test_data(item.name));
    std::map<std::string, std::map<std::string, std::string>> sections;
    std::string section;
    for (std::string line; std::getline(file, line);) {
      if (!line.empty() && line.back() == '\r') line.pop_back();
      const std::size_t equals = line.find('=');
      if (line.starts_with("[")) {
        section = line.substr(1, line.find(']') - 1);
      } else if (equals != std::string::npos) {
        sections[section][line.substr(0, equals)] = line.substr(equals + 1);
      }
    }
    std::size_t compared = 0;
    item.objects.visit([&](std::uint16_t index, std::uint8_t sub, const ObjectEntry& entry) {
      std::ostringstream name;
      name << std::hex << std::uppercase << index;
      if (!sections.contains(name.str())) FAIL_CHECK("the file has no object " << name.str());
      if (!sections[name.str()].contains("DataType")) name << "sub" << unsigned{sub};
      CAPTURE(name.str());
      REQUIRE(sections.contains(name.str()));
      auto& of_file = sections[name.str()];
      CHECK(std::stoi(of_file["DataType"], nullptr, 0) == static_cast<int>(entry.type));
      const std::string access = of_file["AccessType"];
      const Access expected = access == "const" ? Access::constant
                              : access == "ro"  ? Access::read_only
                                                : Access::read_write;
      CHECK(entry.access == expected);
      const bool is_mappable = of_file["PDOMapping"] == "1";
      const Mapping mapping = !is_mappable      ? Mapping::none
                              : access == "rww" ? Mapping::rpdo
                              : access == "rw"  ? Mapping::both
                                                : Mapping::tpdo;
      CHECK(entry.mapping == mapping);
      const std::string value = of_file["DefaultValue"];
      if (!value.empty() && value.find("NODEID") == std::string::npos &&
          entry.type != DataType::visible_string) {
        const auto parsed = static_cast<std::uint32_t>(std::stoll(value, nullptr, 0));
        CHECK(static_cast<std::uint32_t>(entry.default_value) == parsed);
      }
      ++compared;
    });
    CHECK(compared >= item.least);
  }
}

}  // namespace
