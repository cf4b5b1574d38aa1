// The recorded bring-up of a TMCM-1636 (node 1): every frame decodes, and our motor walks that drive's
// answers.
#include <catch2/catch.hpp>
#include <fstream>
#include <map>
#include <string>

#include "alces_drivers/canopen/sdo_message.h"
#include "support/motor_bench.h"
#include "support/test_data.h"

using namespace alces;
using namespace alces::canopen;

namespace {

constexpr const char* trace_file = "can/tmcm1636/candump.txt";

std::vector<CanFrame> read_trace() {
  std::ifstream file(test::test_data(trace_file));
  std::vector<CanFrame> frames;
  for (std::string line; std::getline(file, line);) {
    if (line.find('[') == std::string::npos) continue;
    const auto frame = test::parse_candump(line);
    REQUIRE(frame);
    frames.push_back(*frame);
  }
  return frames;
}

/// The object values that the recorded drive gave and took.
struct TracedDrive {
  std::map<std::pair<std::uint16_t, std::uint8_t>, std::uint32_t> read;
  std::vector<ObjectWrite> written;
};

TracedDrive traced_drive(const std::vector<CanFrame>& trace) {
  TracedDrive drive;
  for (const CanFrame& frame : trace) {
    const auto message = decode_sdo(frame);
    if (!message) continue;
    const std::uint32_t value = load(message->bytes(), 4);
    if (message->kind == SdoKind::upload_response)
      drive.read.insert({{message->object.index, message->object.subindex}, value});
    if (message->kind == SdoKind::download_request) {
      drive.written.push_back({message->object.index, message->object.subindex, message->size, value});
    }
  }
  return drive;
}

}  // namespace

TEST_CASE("every frame of the TMCM-1636 trace is understood") {
  if (!test::has_test_data(trace_file)) return;
  const auto trace = read_trace();
  CHECK(trace.size() == 115);
  std::map<Service, int> count;
  std::optional<SdoMessage> request;
  int answered = 0;
  std::vector<std::uint16_t> emcys;
  for (const CanFrame& frame : trace) {
    const Origin origin = origin_of(frame.id);
    ++count[origin.service];
    switch (origin.service) {
      case Service::nmt:
        CHECK(decode_nmt(frame));
        break;
      case Service::sdo_request:
        request = decode_sdo(frame);
        REQUIRE(request);
        break;
      case Service::sdo_response: {
        const auto answer = decode_sdo(frame);
        REQUIRE(answer);
        REQUIRE(request);
        CHECK(answer->object == request->object);
        CHECK((answer->kind == SdoKind::download_response) == (request->kind == SdoKind::download_request));
        ++answered;
        break;
      }
      case Service::emcy:
        REQUIRE(decode_emcy(frame));
        emcys.push_back(decode_emcy(frame)->code);
        break;
      case Service::heartbeat:
        CHECK(decode_heartbeat(frame) == NmtState::boot_up);
        break;
      case Service::sync:
        CHECK(frame.size == 0);
        break;
      case Service::rpdo:
        CHECK(origin.node == 1);
        break;
      default:
        FAIL("a frame that is not understood: " << frame.id);
    }
  }
  CHECK(count[Service::nmt] == 3);
  CHECK(count[Service::heartbeat] == 1);
  CHECK(count[Service::sdo_request] == answered);
  CHECK(count[Service::sync] == 10);
  CHECK(emcys == std::vector<std::uint16_t>{0x6320, 0x0000});
}

TEST_CASE("our PDO set-up writes the objects that the recorded master wrote") {
  if (!test::has_test_data(trace_file)) return;
  const auto trace = read_trace();
  const TracedDrive drive = traced_drive(trace);
  PdoConfig control;
  control.forbids_remote_frames = true;  // as the drive's own 0x1400:1 says
  control.transmission_type = 1;
  control.entries = {{0x6040, 0, 16}, {0x60FF, 0, 32}};
  REQUIRE((drive.read.at({0x1400, 1}) & pdo_forbids_remote_frames) != 0);
  PdoConfig position;
  position.number = 3;
  position.forbids_remote_frames = true;
  position.transmission_type = 0;
  position.entries = {{0x6064, 0, 32}};
  for (const PdoWrites& writes :
       {writes_for(control, PdoDirection::to_node, 1), writes_for(position, PdoDirection::from_node, 1)}) {
    for (const ObjectWrite& write : writes) {
      INFO(write.index << " " << int{write.subindex} << " " << write.value);
      CHECK(std::find(drive.written.begin(), drive.written.end(), write) != drive.written.end());
    }
  }
}

TEST_CASE(
    "against the recorded drive's answers the motor walks out of its fault and on to operation enabled") {
  if (!test::has_test_data(trace_file)) return;
  const auto trace = read_trace();
  const TracedDrive traced = traced_drive(trace);
  MotorConfig config = test::motor_config();
  config.heartbeat_period_ms = 0;           // the recorded master switched it off
  config.checks = {{0x6502, 0, 0x4, 0x4}};  // profile velocity, in the value of the trace
  config.rpdos[0].forbids_remote_frames = true;
  test::MotorBench bench(config);
  for (const auto& [object, value] : traced.read) {
    const bool is_ours = object.first < 0x1400 || object.first >= 0x1C00;
    if (is_ours) bench.node.set(object.first, object.second, 4, value);
  }
  bench.node.position_counts = static_cast<std::int32_t>(traced.read.at({0x6064, 0}));
  const std::uint16_t statusword = static_cast<std::uint16_t>(traced.read.at({0x6041, 0}));
  bench.node.drive = cia402::state_of(statusword);
  REQUIRE(bench.node.drive == cia402::State::fault);  // 0x0618
  const bool is_at_speed = bench.spin_up();
  INFO(bench.motor.reason() << ": " << bench.motor.detail());
  REQUIRE(is_at_speed);
  // The trace: fault, a rising edge of bit 7 in the controlword, EMCY "error reset". Ours does the same and
  // goes on.
  CHECK(bench.node.walked ==
        std::vector<cia402::State>{cia402::State::switch_on_disabled, cia402::State::ready_to_switch_on,
                                   cia402::State::switched_on, cia402::State::operation_enabled});
  std::vector<std::uint16_t> controlwords;
  for (const CanFrame& frame : bench.from_motor) {
    if (frame.id != 0x201) continue;
    const auto word = static_cast<std::uint16_t>(load(frame.bytes(), 2));
    if (controlwords.empty() || controlwords.back() != word) controlwords.push_back(word);
  }
  CHECK(controlwords == std::vector<std::uint16_t>{0x00, 0x80, 0x06, 0x07, 0x0F});
  CHECK(bench.feedback.feedback.front().position_counts ==
        static_cast<std::int32_t>(traced.read.at({0x6064, 0})));
}

TEST_CASE("the recorded answers, byte for byte, satisfy an SDO client that asks the recorded questions") {
  if (!test::has_test_data(trace_file)) return;
  const auto trace = read_trace();
  test::FakeCanPort port;
  SdoClient sdo(1, {}, port);
  int transfers = 0;
  for (const CanFrame& frame : trace) {
    const auto message = decode_sdo(frame);
    if (message && message->kind == SdoKind::download_request) {
      REQUIRE(sdo.download(message->object, message->bytes(), 0));
    } else if (message && message->kind == SdoKind::upload_request) {
      REQUIRE(sdo.upload(message->object, 0));
    }
    if (frame.id == sdo_request_cob_id(1)) {
      REQUIRE(port.sent.back() == frame);  // the same bytes as that master's
      ++transfers;
    }
    if (sdo.on_frame(frame, 0)) REQUIRE(sdo.status() == SdoStatus::done);
  }
  CHECK(transfers == 48);
}
