// CiA 301 services, one by one.
#include <catch2/catch.hpp>
#include <cstring>
#include <map>
#include <string>

#include "alces_drivers/canopen/configurator.h"
#include "alces_drivers/canopen/heartbeat.h"
#include "alces_drivers/canopen/master.h"
#include "alces_drivers/canopen/pdo.h"
#include "alces_drivers/canopen/sdo_abort.h"
#include "alces_drivers/canopen/sdo_client.h"
#include "alces_drivers/canopen/sync.h"
#include "support/fake_node.h"

using namespace alces::canopen;
using alces::CanFrame;
using alces::no_stamp_ns;
using alces::ns_per_ms;
using alces::test::FakeCanPort;
using alces::test::FakeNode;

namespace {

CanFrame frame_of(std::uint32_t id, std::initializer_list<std::uint8_t> bytes) {
  CanFrame frame{.id = id, .size = static_cast<std::uint8_t>(bytes.size())};
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  return frame;
}

/// An SDO client and a node that answers it, `rounds` times back and forth.
struct SdoBench {
  FakeCanPort port;
  FakeNode node{1};
  SdoClient sdo{1, {.response_timeout_ns = 100 * ns_per_ms, .retry_limit = 2}, port};
  std::int64_t now_ns = 0;

  void exchange(int rounds = 200) {
    for (int round = 0; round < rounds && sdo.is_busy(); ++round) {
      const auto requests = std::exchange(port.sent, {});
      for (const CanFrame& request : requests) node.on_frame(request, now_ns);
      const auto answers = std::exchange(node.out, {});
      for (const CanFrame& answer : answers) sdo.on_frame(answer, now_ns);
      now_ns += ns_per_ms;
      sdo.on_tick(now_ns);
    }
  }
};

}  // namespace

TEST_CASE("every COB-ID of the predefined set is told apart, and back") {
  for (std::uint8_t node = first_node; node <= last_node; ++node) {
    CHECK(origin_of(emcy_cob_id(node)).service == Service::emcy);
    CHECK(origin_of(sdo_response_cob_id(node)).service == Service::sdo_response);
    CHECK(origin_of(sdo_request_cob_id(node)).service == Service::sdo_request);
    CHECK(origin_of(heartbeat_cob_id(node)).service == Service::heartbeat);
    CHECK(origin_of(heartbeat_cob_id(node)).node == node);
    for (std::uint16_t number = 1; number <= 4; ++number) {
      CHECK(origin_of(tpdo_cob_id(number, node)).service == Service::tpdo);
      CHECK(origin_of(tpdo_cob_id(number, node)).pdo == number);
      CHECK(origin_of(rpdo_cob_id(number, node)).service == Service::rpdo);
      CHECK(origin_of(rpdo_cob_id(number, node)).pdo == number);
      CHECK(origin_of(rpdo_cob_id(number, node)).node == node);
    }
  }
  CHECK(tpdo_cob_id(1, 1) == 0x181);
  CHECK(tpdo_cob_id(4, 127) == 0x4FF);
  CHECK(rpdo_cob_id(1, 1) == 0x201);
  CHECK(rpdo_cob_id(4, 1) == 0x501);
  CHECK(origin_of(0).service == Service::nmt);
  CHECK(origin_of(0x80).service == Service::sync);
  CHECK(origin_of(0x100).service == Service::time_stamp);
  for (const std::uint32_t cob_id :
       {0x001U, 0x07FU, 0x101U, 0x180U, 0x600U, 0x680U, 0x700U, 0x7E5U, 0x801U, 0xFFFFFFFFU}) {
    CHECK(origin_of(cob_id).service == Service::other);
  }
}

TEST_CASE("NMT frames carry command and node, and what is none is refused") {
  const CanFrame frame = nmt_frame({NmtCommand::reset_communication, 1});
  CHECK(frame == frame_of(0, {0x82, 0x01}));
  REQUIRE(decode_nmt(frame));
  CHECK(decode_nmt(frame)->command == NmtCommand::reset_communication);
  CHECK_FALSE(decode_nmt(frame_of(0, {0x82})));
  CHECK_FALSE(decode_nmt(frame_of(0, {0x83, 0x01})));
  CHECK_FALSE(decode_nmt(frame_of(0, {0x01, 0x80})));
  CHECK_FALSE(decode_nmt(frame_of(1, {0x01, 0x01})));
  CHECK(decode_heartbeat(frame_of(0x701, {0x7F})) == NmtState::pre_operational);
  CHECK(decode_heartbeat(frame_of(0x701, {0x00})) == NmtState::boot_up);
  CHECK_FALSE(decode_heartbeat(frame_of(0x701, {0x06})));
  CHECK_FALSE(decode_heartbeat(frame_of(0x701, {0x05, 0x00})));
  CHECK_FALSE(decode_heartbeat(frame_of(0x701, {})));
}

TEST_CASE("an expedited download carries 1 to 4 bytes as CiA 301 writes them") {
  SdoBench bench;
  const std::uint8_t commands[] = {0x2F, 0x2B, 0x27, 0x23};
  for (std::uint8_t size = 1; size <= 4; ++size) {
    REQUIRE(bench.sdo.download(ObjectWrite{0x6083, 0, size, 0x04030201}, bench.now_ns));
    CHECK(bench.port.sent.back().data[0] == commands[size - 1]);
    CHECK(bench.port.sent.back().data[size == 4 ? 7 : 4 + size] == (size == 4 ? 4 : 0));
    CHECK_FALSE(bench.sdo.upload({0x6041, 0}, bench.now_ns));  // one at a time
    bench.exchange();
    CHECK(bench.sdo.status() == SdoStatus::done);
    CHECK(bench.node.objects.at({0x6083, 0}).size() == size);
  }
}

TEST_CASE("an expedited upload gives the value in its size") {
  SdoBench bench;
  bench.node.set(0x1018, 1, 4, 0x00000286);
  bench.node.set(0x1017, 0, 2, 0x0102);
  REQUIRE(bench.sdo.upload({0x1018, 1}, bench.now_ns));
  bench.exchange();
  CHECK(bench.sdo.status() == SdoStatus::done);
  CHECK(bench.sdo.value() == 0x286);
  REQUIRE(bench.sdo.upload({0x1017, 0}, bench.now_ns));
  bench.exchange();
  CHECK(bench.sdo.bytes().size() == 2);
  CHECK(bench.sdo.value() == 0x0102);
}

TEST_CASE("strings come and go in segments of seven bytes with an alternating toggle bit") {
  for (const std::size_t length : {5U, 7U, 8U, 14U, 15U, 100U, 256U}) {
    SdoBench bench;
    std::vector<std::uint8_t> text(length);
    for (std::size_t byte = 0; byte < length; ++byte) text[byte] = static_cast<std::uint8_t>(byte * 7 + 1);
    bench.node.objects[{device_name_index, 0}] = text;
    REQUIRE(bench.sdo.upload({device_name_index, 0}, bench.now_ns));
    bench.exchange();
    REQUIRE(bench.sdo.status() == SdoStatus::done);
    CHECK(std::vector<std::uint8_t>(bench.sdo.bytes().begin(), bench.sdo.bytes().end()) == text);

    REQUIRE(bench.sdo.download({0x2000, 1}, text, bench.now_ns));
    bench.exchange();
    REQUIRE(bench.sdo.status() == SdoStatus::done);
    CHECK(bench.node.objects.at({0x2000, 1}) == text);
  }
}

TEST_CASE("a toggle bit that does not alternate ends the transfer at once, with 0503 0000h") {
  SdoBench bench;
  SECTION("upload") {
    REQUIRE(bench.sdo.upload({device_name_index, 0}, 0));
    bench.sdo.on_frame(frame_of(0x581, {0x41, 0x08, 0x10, 0, 20, 0, 0, 0}), 0);
    bench.sdo.on_frame(frame_of(0x581, {0x10, 1, 2, 3, 4, 5, 6, 7}), 0);  // the first one has 0
  }
  SECTION("download") {
    const std::vector<std::uint8_t> text(20, 7);
    REQUIRE(bench.sdo.download({0x2000, 1}, text, 0));
    bench.sdo.on_frame(frame_of(0x581, {0x60, 0x00, 0x20, 1, 0, 0, 0, 0}), 0);
    bench.sdo.on_frame(frame_of(0x581, {0x30, 0, 0, 0, 0, 0, 0, 0}), 0);
  }
  CHECK(bench.sdo.status() == SdoStatus::bad_toggle);
  CHECK(bench.sdo.counters().answers_repeated == 1);
  REQUIRE_FALSE(bench.port.sent.empty());
  CHECK(bench.port.sent.back().data[0] == 0x80);
  CHECK(decode_sdo(bench.port.sent.back())->abort_code == 0x05030000);
}

TEST_CASE("a transfer that is cancelled is aborted, so that the node does not wait for its rest") {
  SdoBench bench;
  bench.sdo.cancel();
  CHECK(bench.port.sent.empty());  // there is none
  REQUIRE(bench.sdo.upload({device_name_index, 0}, 0));
  bench.sdo.cancel();
  CHECK(bench.sdo.status() == SdoStatus::idle);
  CHECK(bench.port.sent.back().data[0] == 0x80);
  CHECK(decode_sdo(bench.port.sent.back())->abort_code == sdo_abort_general);
}

TEST_CASE(
    "a PDO whose mapping and transmission type the node has fixed is switched on, and otherwise left alone") {
  PdoConfig pdo;
  pdo.number = 5;
  pdo.cob_id = 0x1C1;
  pdo.keeps_mapping = true;
  pdo.keeps_transmission_type = true;
  pdo.entries = {{0x6841, 0, 16}, {0x6864, 0, 32}};
  const PdoWrites writes = writes_for(pdo, PdoDirection::from_node, 1);
  REQUIRE(writes.size() == 2);
  CHECK(writes[0].index == 0x1804);
  CHECK(writes[0].value == 0x800001C1);
  CHECK(writes[1].value == 0x1C1);
}

TEST_CASE("an object larger than the buffer is aborted by us and said to be too large") {
  SdoBench bench;
  bench.node.objects[{device_name_index, 0}].resize(SdoClient::maximum_bytes + 1);
  REQUIRE(bench.sdo.upload({device_name_index, 0}, bench.now_ns));
  bench.exchange();
  CHECK(bench.sdo.status() == SdoStatus::too_large);
  REQUIRE_FALSE(bench.port.sent.empty());
  CHECK(decode_sdo(bench.port.sent.back())->abort_code == sdo_abort_out_of_memory);

  // Without an announced size, in segments that do not end.
  REQUIRE(bench.sdo.upload({device_name_index, 0}, 0));
  bench.sdo.on_frame(frame_of(0x581, {0x40, 0x08, 0x10, 0, 0, 0, 0, 0}), 0);
  for (int segment = 0; segment < 40 && bench.sdo.is_busy(); ++segment) {
    bench.sdo.on_frame(frame_of(0x581, {static_cast<std::uint8_t>(segment % 2 * 0x10), 1, 2, 3, 4, 5, 6, 7}),
                       0);
  }
  CHECK(bench.sdo.status() == SdoStatus::too_large);
}

TEST_CASE("fewer bytes than announced are no upload") {
  SdoBench bench;
  REQUIRE(bench.sdo.upload({device_name_index, 0}, 0));
  bench.sdo.on_frame(frame_of(0x581, {0x41, 0x08, 0x10, 0, 9, 0, 0, 0}), 0);
  bench.sdo.on_frame(frame_of(0x581, {0x01, 1, 2, 3, 4, 5, 6, 7}), 0);
  CHECK(bench.sdo.status() == SdoStatus::size_mismatch);
}

TEST_CASE("sizes that no transfer can have are refused") {
  SdoBench bench;
  CHECK_FALSE(bench.sdo.download(ObjectWrite{0x6040, 0, 0, 0}, 0));
  CHECK_FALSE(bench.sdo.download(ObjectWrite{0x6040, 0, 5, 0}, 0));
  const std::vector<std::uint8_t> bytes(SdoClient::maximum_bytes + 1);
  CHECK_FALSE(bench.sdo.download({0x2000, 0}, bytes, 0));
  CHECK(bench.port.sent.empty());
}

TEST_CASE("an abort ends the transfer with its code and text") {
  SdoBench bench;
  bench.node.aborts[{0x6060, 0}] = 0x06090030;
  REQUIRE(bench.sdo.download(ObjectWrite{0x6060, 0, 1, 3}, bench.now_ns));
  bench.exchange();
  CHECK(bench.sdo.status() == SdoStatus::aborted);
  CHECK(bench.sdo.abort_code() == 0x06090030);
  CHECK(std::string(sdo_abort_text(0x06090030)) == "the value is not valid");
  CHECK(std::string(sdo_abort_text(0x12345678)).find("does not know") != std::string::npos);
  CHECK(bench.sdo.counters().aborts_received == 1);
}

TEST_CASE("a request without an answer is aborted, repeated as often as allowed, and given up") {
  SdoBench bench;
  bench.node.answers_sdo = false;
  REQUIRE(bench.sdo.upload({0x6041, 0}, 0));
  int requests = 0;
  int aborts = 0;
  std::int64_t now_ns = 0;
  for (; bench.sdo.is_busy() && now_ns < 1000 * ns_per_ms; now_ns += ns_per_ms) bench.sdo.on_tick(now_ns);
  for (const CanFrame& frame : bench.port.sent)
    ++(decode_sdo(frame)->kind == SdoKind::abort ? aborts : requests);
  CHECK(bench.sdo.status() == SdoStatus::timed_out);
  CHECK(requests == 3);
  CHECK(aborts == 3);
  CHECK(now_ns == 301 * ns_per_ms);
  CHECK(bench.sdo.counters().timeouts == 3);
  CHECK(bench.sdo.counters().retries == 2);
}

TEST_CASE("a segment that is lost begins the transfer anew") {
  SdoBench bench;
  std::vector<std::uint8_t> text(30, 0x41);
  bench.node.objects[{device_name_index, 0}] = text;
  REQUIRE(bench.sdo.upload({device_name_index, 0}, bench.now_ns));
  bench.exchange(3);
  REQUIRE(bench.sdo.is_busy());
  bench.port.sent.clear();  // the request for a segment is lost
  bench.exchange();
  CHECK(bench.sdo.status() == SdoStatus::done);
  CHECK(bench.sdo.bytes().size() == 30);
  CHECK(bench.sdo.counters().retries == 1);
}

TEST_CASE(
    "answers that are late, foreign, repeated, unexpected or malformed are counted and change nothing") {
  SdoBench bench;
  bench.sdo.on_frame(frame_of(0x581, {0x60, 0x40, 0x60, 0, 0, 0, 0, 0}), 0);
  CHECK(bench.sdo.counters().answers_late == 1);

  REQUIRE(bench.sdo.upload({0x1008, 0}, 0));
  bench.sdo.on_frame(frame_of(0x581, {0x43, 0x41, 0x60, 0, 1, 0, 0, 0}), 0);  // of another object
  bench.sdo.on_frame(frame_of(0x581, {0x80, 0x41, 0x60, 0, 1, 0, 0, 0}), 0);  // another object's abort
  CHECK(bench.sdo.counters().answers_foreign == 2);
  bench.sdo.on_frame(frame_of(0x581, {0x60, 0x08, 0x10, 0, 0, 0, 0, 0}), 0);  // of a download
  CHECK(bench.sdo.counters().answers_unexpected == 1);
  bench.sdo.on_frame(frame_of(0x581, {0xE0, 0x08, 0x10, 0, 0, 0, 0, 0}), 0);
  bench.sdo.on_frame(frame_of(0x581, {0x43, 0x08, 0x10}), 0);
  CHECK(bench.sdo.counters().answers_malformed == 2);
  CHECK_FALSE(bench.sdo.on_frame(frame_of(0x582, {0x43, 0x08, 0x10, 0, 1, 0, 0, 0}), 0));  // another node's
  REQUIRE(bench.sdo.is_busy());

  bench.sdo.on_frame(frame_of(0x581, {0x41, 0x08, 0x10, 0, 9, 0, 0, 0}), 0);
  const CanFrame first = frame_of(0x581, {0x00, 'A', 'l', 'c', 'e', 's', ' ', 'a'});
  bench.sdo.on_frame(first, 0);
  bench.sdo.on_frame(first, 0);
  CHECK(bench.sdo.counters().answers_repeated == 1);
  bench.sdo.on_frame(frame_of(0x581, {0x1B, 'l', 'c', 0, 0, 0, 0, 0}), 0);
  REQUIRE(bench.sdo.status() == SdoStatus::done);
  CHECK(std::memcmp(bench.sdo.bytes().data(), "Alces alc", 9) == 0);
}

TEST_CASE("a request that the bus does not take goes out later, or is given up with that reason") {
  SdoBench bench;
  bench.port.is_full = true;
  REQUIRE(bench.sdo.download(ObjectWrite{0x6060, 0, 1, 3}, 0));
  bench.sdo.on_tick(50 * ns_per_ms);
  bench.port.is_full = false;
  bench.sdo.on_tick(90 * ns_per_ms);
  CHECK(bench.port.sent.size() == 1);
  bench.sdo.on_tick(150 * ns_per_ms);
  CHECK(bench.sdo.counters().timeouts == 0);  // the time counts from when it left
  bench.now_ns = 160 * ns_per_ms;
  bench.exchange();
  CHECK(bench.sdo.status() == SdoStatus::done);

  bench.port.is_full = true;
  REQUIRE(bench.sdo.upload({0x6041, 0}, 0));
  for (std::int64_t now_ns = 0; now_ns < 1000 * ns_per_ms; now_ns += ns_per_ms) bench.sdo.on_tick(now_ns);
  CHECK(bench.sdo.status() == SdoStatus::not_sent);
}

TEST_CASE("random frames with the server's identifier neither end nor break a client") {
  SdoBench bench;
  std::uint32_t seed = 12345;
  const auto random_byte = [&seed] {
    seed = seed * 1664525U + 1013904223U;
    return static_cast<std::uint8_t>(seed >> 24);
  };
  std::int64_t now_ns = 0;
  for (int round = 0; round < 200000; ++round) {
    if (!bench.sdo.is_busy()) {
      const std::uint8_t choice = random_byte();
      const std::vector<std::uint8_t> bytes(1U + choice);
      REQUIRE((choice % 2 == 0 ? bench.sdo.upload({0x1008, 0}, now_ns)
                               : bench.sdo.download({0x1008, 0}, bytes, now_ns)));
    }
    CanFrame frame{.id = 0x581, .size = static_cast<std::uint8_t>(random_byte() % 9)};
    if (random_byte() < 200) frame.size = 8;
    for (std::uint8_t& byte : frame.data) byte = random_byte();
    if (random_byte() < 128) {
      frame.data[1] = 0x08;
      frame.data[2] = 0x10;
      frame.data[3] = 0;
    }
    bench.sdo.on_frame(frame, now_ns);
    now_ns += ns_per_ms;
    bench.sdo.on_tick(now_ns);
    bench.port.sent.clear();
    REQUIRE(bench.sdo.bytes().size() <= SdoClient::maximum_bytes);
  }
  CHECK(bench.sdo.counters().answers_foreign > 0);
  CHECK(bench.sdo.counters().answers_malformed > 0);
}

TEST_CASE("EMCY messages decode with the text of their code or its class") {
  const auto emcy = decode_emcy(frame_of(0x081, {0x20, 0x63, 0x01, 0x00, 0xFF, 0x00, 0x00, 0x00}));
  REQUIRE(emcy);
  CHECK(emcy->node == 1);
  CHECK(emcy->code == 0x6320);
  CHECK(emcy->error_register == 1);
  CHECK(emcy->manufacturer[1] == 0xFF);
  CHECK(std::string(emcy_text(0x6320)) == "error in a parameter");
  CHECK(std::string(emcy_text(0x6321)) == "error in a parameter");
  CHECK(std::string(emcy_text(0x8130)) == "life guard or heartbeat error");
  CHECK(std::string(emcy_text(0x3212)) == "DC link over-voltage");
  CHECK(std::string(emcy_text(0x4999)) == "temperature");
  CHECK(std::string(emcy_text(0xA000)).find("does not know") != std::string::npos);
  CHECK(std::string(emcy_text(0xFF42)) == "device specific");
  CHECK(std::string(error_register_text(2)) == "voltage");
  CHECK(decode_emcy(emcy_frame(*emcy))->code == 0x6320);
  CHECK_FALSE(decode_emcy(frame_of(0x080, {0, 0, 0, 0, 0, 0, 0, 0})));
  CHECK_FALSE(decode_emcy(frame_of(0x081, {0x20, 0x63})));
  CHECK(decode_emcy(frame_of(0x081, {0, 0, 0, 0, 0, 0, 0, 0}))->is_reset());
}

TEST_CASE("a heartbeat consumer tells boot-up, reset, loss and return apart") {
  HeartbeatConsumer heartbeat(5);
  const auto beat = [&](NmtState state, std::int64_t ms) {
    return heartbeat.on_frame(heartbeat_frame(5, state), ms * ns_per_ms);
  };
  CHECK(beat(NmtState::boot_up, 0) == HeartbeatEvent::boot_up);
  CHECK(beat(NmtState::boot_up, 1) == HeartbeatEvent::none);  // the bus said it twice
  CHECK(beat(NmtState::pre_operational, 100) == HeartbeatEvent::state_changed);
  heartbeat.watch(250 * ns_per_ms, 100 * ns_per_ms);
  CHECK(beat(NmtState::operational, 200) == HeartbeatEvent::state_changed);
  CHECK(beat(NmtState::operational, 300) == HeartbeatEvent::none);
  CHECK(heartbeat.on_frame(heartbeat_frame(6, NmtState::boot_up), 301 * ns_per_ms) == HeartbeatEvent::none);
  CHECK(heartbeat.on_tick(550 * ns_per_ms) == HeartbeatEvent::none);
  CHECK(heartbeat.on_tick(551 * ns_per_ms) == HeartbeatEvent::lost);
  CHECK(heartbeat.on_tick(900 * ns_per_ms) == HeartbeatEvent::none);  // once
  CHECK(beat(NmtState::operational, 1000) == HeartbeatEvent::found);
  CHECK(beat(NmtState::boot_up, 1100) == HeartbeatEvent::reset_detected);
  CHECK(heartbeat.on_frame(frame_of(0x705, {0x33}), 1200 * ns_per_ms) == HeartbeatEvent::none);
  CHECK(heartbeat.counters().malformed == 1);
  CHECK(heartbeat.counters().resets_detected == 1);
  CHECK(heartbeat.counters().boot_ups_repeated == 1);
  CHECK(heartbeat.counters().losses == 1);
}

TEST_CASE("our own heartbeat begins with a boot-up message and waits for a bus that takes it") {
  FakeCanPort port;
  HeartbeatProducer producer(127, 100 * ns_per_ms);
  port.is_full = true;
  producer.on_tick(0, port);
  CHECK(producer.not_taken_count() == 1);
  port.is_full = false;
  for (std::int64_t ms = 1; ms <= 350; ++ms) producer.on_tick(ms * ns_per_ms, port);
  REQUIRE(port.sent.size() == 4);
  CHECK(port.sent[0] == frame_of(0x77F, {0x00}));
  CHECK(port.sent[1] == frame_of(0x77F, {0x05}));
}

TEST_CASE("SYNC keeps its beat after late ticks and counts from 1 to its overflow") {
  FakeCanPort port;
  SyncProducer sync({.period_ns = 10 * ns_per_ms, .counter_overflow = 3});
  CHECK_FALSE(sync.on_tick(0, port));
  sync.start(0);
  CHECK(sync.on_tick(0, port));
  CHECK_FALSE(sync.on_tick(9 * ns_per_ms, port));
  CHECK(sync.on_tick(12 * ns_per_ms, port));
  CHECK(sync.due_ns() == 20 * ns_per_ms);
  CHECK(sync.on_tick(57 * ns_per_ms, port));  // SYNC cycles at 20, 30, 40 and 50 are over
  CHECK(sync.counters().skipped == 3);
  CHECK(sync.due_ns() == 60 * ns_per_ms);
  port.is_full = true;
  CHECK_FALSE(sync.on_tick(60 * ns_per_ms, port));
  CHECK(sync.counters().not_taken == 1);
  port.is_full = false;
  CHECK(sync.on_tick(70 * ns_per_ms, port));
  REQUIRE(port.sent.size() == 4);
  CHECK(port.sent[0] == frame_of(0x080, {1}));
  CHECK(port.sent[2] == frame_of(0x080, {3}));
  CHECK(port.sent[3] == frame_of(0x080, {1}));  // the one not taken had no number
  sync.stop();
  CHECK_FALSE(sync.on_tick(200 * ns_per_ms, port));

  SyncProducer plain({.period_ns = 10 * ns_per_ms});
  plain.start(0);
  CHECK(plain.on_tick(0, port));
  CHECK(port.sent.back() == frame_of(0x080, {}));
}

TEST_CASE("a PDO is set up in the order that nodes insist on") {
  PdoConfig pdo;
  pdo.number = 1;
  pdo.forbids_remote_frames = true;
  pdo.transmission_type = 1;
  pdo.event_timer_ms = 100;
  pdo.entries = {{0x6041, 0, 16}, {0x6064, 0, 32}};
  REQUIRE(is_valid(pdo, PdoDirection::from_node, 1));
  const PdoWrites writes = writes_for(pdo, PdoDirection::from_node, 1);
  const std::vector<ObjectWrite> expected = {
      {0x1800, 1, 4, 0xC0000181}, {0x1A00, 0, 1, 0}, {0x1A00, 1, 4, 0x60410010}, {0x1A00, 2, 4, 0x60640020},
      {0x1A00, 0, 1, 2},          {0x1800, 2, 1, 1}, {0x1800, 5, 2, 100},        {0x1800, 1, 4, 0x40000181}};
  CHECK(std::vector<ObjectWrite>(writes.begin(), writes.end()) == expected);

  pdo.entries = {{1, 0, 8}, {2, 0, 8}, {3, 0, 8}, {4, 0, 8}, {5, 0, 8}, {6, 0, 8}, {7, 0, 8}, {8, 0, 8}};
  pdo.inhibit_time_100us = 5;
  CHECK(writes_for(pdo, PdoDirection::to_node, 1).size() == PdoConfig::maximum_writes);
}

TEST_CASE("PDOs that cannot be are not valid") {
  PdoConfig pdo;
  CHECK_FALSE(is_valid(pdo, PdoDirection::from_node, 1));  // nothing mapped
  pdo.entries = {{0x6041, 0, 16}, {0x6064, 0, 32}, {0x606C, 0, 32}};
  CHECK_FALSE(is_valid(pdo, PdoDirection::from_node, 1));  // 80 bits
  pdo.entries = {{0x6041, 0, 16}, {0x6064, 0, 32}};
  CHECK(is_valid(pdo, PdoDirection::from_node, 1));
  pdo.number = 5;
  CHECK_FALSE(is_valid(pdo, PdoDirection::from_node, 1));  // no predefined identifier
  pdo.cob_id = 0x1F0;
  CHECK(is_valid(pdo, PdoDirection::from_node, 1));
  for (const std::uint32_t cob_id : {0x080U, 0x180U, 0x581U, 0x601U, 0x701U, 0x7FFU}) {
    pdo.cob_id = static_cast<std::uint16_t>(cob_id);
    CHECK_FALSE(is_valid(pdo, PdoDirection::from_node, 1));
  }
  pdo.cob_id = 0x1F0;
  pdo.number = 513;
  CHECK_FALSE(is_valid(pdo, PdoDirection::from_node, 1));
}

TEST_CASE("fields are read and written at any bit, signed where they are") {
  PdoConfig pdo;
  pdo.entries = {{0x6061, 0, 8}, {0x2000, 1, 3}, {0x6064, 0, 32}, {0x2000, 2, 5}, {0x6041, 0, 16}};
  CanFrame frame{.id = 0x181, .size = 8};
  const PdoField odd = *field_of(pdo, {0x2000, 1});
  const PdoField position = *field_of(pdo, {0x6064, 0});
  const PdoField last = *field_of(pdo, {0x2000, 2});
  const PdoField status = *field_of(pdo, {0x6041, 0});
  CHECK(position.first_bit == 11);
  write_field(frame, odd, 5);
  write_field(frame, position, static_cast<std::uint32_t>(-123456789));
  write_field(frame, last, 0x1F);
  write_field(frame, status, 0x0637);
  CHECK(read_field(frame, odd) == 5);
  CHECK(read_signed_field(frame, odd) == -3);
  CHECK(read_signed_field(frame, position) == -123456789);
  CHECK(read_field(frame, last) == 0x1F);
  CHECK(read_field(frame, status) == 0x0637);
  CHECK_FALSE(field_of(pdo, {0x606C, 0}));
  frame.size = 3;
  CHECK(read_field(frame, status) == 0);  // beyond the end
}

TEST_CASE("a configurator stops at the object that is refused or has another value") {
  SdoBench bench;
  Configurator configurator(bench.sdo);
  const auto run = [&](std::span<const ConfigurationStep> steps) {
    configurator.start(steps, bench.now_ns);
    for (int round = 0; round < 100 && configurator.status() == Configurator::Status::busy; ++round) {
      bench.exchange(1);
      configurator.advance(bench.now_ns);
    }
  };
  const ConfigurationStep steps[] = {ConfigurationStep::check({0x1000, 0, 0xFFFF, 0x0192}),
                                     ConfigurationStep::write({0x6083, 0, 4, 5000}),
                                     ConfigurationStep::write({0x6060, 0, 1, 3})};
  run(steps);
  CHECK(configurator.status() == Configurator::Status::done);
  CHECK(configurator.steps_done() == 3);

  bench.node.aborts[{0x6083, 0}] = 0x06010002;
  run(steps);
  CHECK(configurator.status() == Configurator::Status::transfer_failed);
  CHECK(configurator.step().object == ObjectAddress{0x6083, 0});

  bench.node.set(0x1000, 0, 4, 0x00020191);
  run(steps);
  CHECK(configurator.status() == Configurator::Status::value_differs);
  CHECK(configurator.found_value() == 0x00020191);

  run({});
  CHECK(configurator.status() == Configurator::Status::done);
}

namespace {

struct CountingDriver final : NodeDriver {
  std::vector<std::uint32_t> ids;
  int ticks = 0;
  bool is_up = true;
  void on_frame(const CanFrame& frame, std::int64_t) override { ids.push_back(frame.id); }
  void on_link(bool up, std::int64_t) override { is_up = up; }
  void on_tick(std::int64_t) override { ++ticks; }
};

}  // namespace

TEST_CASE("a master hands each frame to those that want it, and its SYNC to all who listen to that") {
  FakeCanPort port;
  Master master({.sync = {.period_ns = 10 * ns_per_ms}}, port);
  CountingDriver first;
  CountingDriver second;
  REQUIRE(master.add(first, std::vector<std::uint16_t>{0x181, 0x701, 0x080}));
  REQUIRE(master.add(second, std::vector<std::uint16_t>{0x182, 0x080}));
  CHECK_FALSE(master.add(second, std::vector<std::uint16_t>{0x800}));
  CHECK_FALSE(master.add(second, std::vector<std::uint16_t>(Master::maximum_subscriptions)));

  master.on_frame(frame_of(0x181, {1}), 0);
  master.on_frame(frame_of(0x182, {1}), 0);
  master.on_frame(frame_of(0x183, {1}), 0);
  CanFrame extended = frame_of(0x181, {1});
  extended.is_extended = true;
  master.on_frame(extended, 0);
  CanFrame error = frame_of(0x004, {});
  error.is_error = true;
  master.on_frame(error, 0);
  CanFrame absurd = frame_of(0xFFFFFFFF, {1});
  master.on_frame(absurd, 0);
  CHECK(first.ids == std::vector<std::uint32_t>{0x181});
  CHECK(second.ids == std::vector<std::uint32_t>{0x182});
  CHECK(master.counters().frames == 6);
  CHECK(master.counters().frames_routed == 2);
  CHECK(master.counters().frames_unclaimed == 1);
  CHECK(master.counters().frames_not_canopen == 2);
  CHECK(master.counters().error_frames == 1);

  master.on_tick(0);
  CHECK(port.sent.back().id == 0x080);
  CHECK(first.ids.back() == 0x080);
  CHECK(second.ids.back() == 0x080);
  master.on_link(false, 0);
  CHECK_FALSE(first.is_up);
  const std::size_t before = port.sent.size();
  master.on_tick(50 * ns_per_ms);
  CHECK(port.sent.size() == before);
  CHECK(second.ticks == 2);
  port.is_full = true;
  CHECK_FALSE(master.order({NmtCommand::stop, all_nodes}));
  CHECK(master.counters().nmt_not_taken == 1);
  CHECK(master.counters().sync.sent == 1);
  port.is_full = false;
  REQUIRE(master.order({NmtCommand::stop, all_nodes}));
  CHECK(port.sent.back() == frame_of(0, {2, 0}));
}
