#include "offline/explain_can/explain_can.h"

#include <sys/wait.h>

#include <array>
#include <catch2/catch.hpp>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>

#include "offline/explain_can/candump_lines.h"
#include "support/test_data.h"
#include "temporary_folder.h"

namespace alces::offline {
namespace {

CanFrame frame(std::string_view log_text) {
  const TemporaryFolder folder;
  CanFrame result;
  read_candump(folder.write("one.log", "(1.5) can0 " + std::string(log_text) + "\n"),
               [&](const CandumpLine& line) { result = line.frame; });
  return result;
}

std::string words(CanExplainer& bus, std::string_view log_text) {
  return bus.explain(frame(log_text)).text;
}

std::vector<CandumpLine> lines_of(const std::filesystem::path& file) {
  std::vector<CandumpLine> lines;
  read_candump(file, [&](const CandumpLine& line) { lines.push_back(line); });
  return lines;
}

std::string complaint(const std::string& text) {
  const TemporaryFolder folder;
  try {
    const CandumpRead read = read_candump(folder.write("bad.txt", text), [](const CandumpLine&) {});
    if (read.passed_over.count > 0) return read.passed_over.sentences.front();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no complaint";
}

std::shared_ptr<const ObjectDictionaryFile> dictionary(std::string_view text) {
  return std::make_shared<const ObjectDictionaryFile>(ObjectDictionaryFile::parse(text, "drive.dcf"));
}

// --- candump's text ---

TEST_CASE("candump's forms tell the same frame") {
  const TemporaryFolder folder;
  const auto lines =
      lines_of(folder.write("forms.txt",
                            "(1436509052.249713) can0 181#2104FFFF\n"
                            "# a comment\n\n"
                            "  can0  181   [4]  21 04 FF FF\r\n"
                            " (000.000123)  can0  181   [4]  21 04 FF FF\n"
                            " (2015-07-10 05:37:32.249713)  can0  181   [4]  21 04 FF FF   '!...'\n"
                            "  can0  RX - -  181   [4]  21 04 ff ff\n"
                            "(1.0) can0 181#2104FFFF R\n"));
  REQUIRE(lines.size() == 6);
  for (const CandumpLine& line : lines) {
    CHECK(line.channel == "can0");
    CHECK(candump_text(line.frame) == "181#2104FFFF");
  }
  CHECK(lines[0].stamp_s == Approx(1436509052.249713).epsilon(1e-15));
  CHECK_FALSE(lines[1].stamp_s);
  CHECK(lines[1].line == 4);
  CHECK(lines[2].stamp_s == Approx(0.000123));
  CHECK(*lines[3].stamp_s == Approx(1436506652.249713).epsilon(1e-15));
}

TEST_CASE("remote, FD, extended and error frames are read") {
  CHECK(frame("123#R").is_remote);
  CHECK(frame("123#R4").size == 4);
  CHECK(frame("12345678#00").is_extended);
  const CanFrame fd = frame("123##3DEADBEEF0011223344556677");
  CHECK(fd.is_fd);
  CHECK(fd.size == 12);
  CHECK(fd.is_bit_rate_switched);
  CHECK(fd.is_error_state_indicated);
  const CanFrame error = frame("20000004#0004000000000000");
  CHECK(error.is_error);
  CHECK(error.id == 4);
  CHECK_FALSE(error.is_extended);
  for (const char* text : {"123#R", "123#R4", "12345678#00", "123##3DEADBEEF0011223344556677",
                           "20000004#0004000000000000", "080#", "7FF#1122334455667788"}) {
    CHECK(candump_text(frame(text)) == text);
  }
  const TemporaryFolder folder;
  const auto lines = lines_of(folder.write("screen.txt",
                                           "  can0  20000004   [8]  00 04 00 00 00 00 00 00   ERRORFRAME\n"
                                           "\tcontroller-problem{rx-error-warning}\n"
                                           "  can0  123   [4]  remote request\n"
                                           "  can0  123  [12]  00 01 02 03 04 05 06 07 08 09 0A 0B\n"));
  REQUIRE(lines.size() == 3);
  CHECK(lines[0].frame.is_error);
  CHECK(lines[1].frame.is_remote);
  CHECK(lines[2].frame.is_fd);
}

TEST_CASE("a line that is no frame is passed over and told with its number") {
  CHECK_THAT(complaint(""), Catch::Contains("no CAN frame"));
  CHECK_THAT(complaint("\n# nothing\n"), Catch::Contains("no CAN frame"));
  const std::string good = "can0 181 [1] 00\n";
  for (const char* bad : {"can0",
                          "can0 181",
                          "can0 181 [8] 00 11",
                          "can0 181 [2] 00 1G",
                          "can0 181 [2] 00 111",
                          "can0 181 [1] 00 11",
                          "can0 1G1 [0]",
                          "can0 18 [0]",
                          "can0 FFF [0]",
                          "can0 181 [9] 00 00 00 00 00 00 00 00 00",
                          "can0 181 8 00",
                          "can0 181 [99] 00",
                          "(1.0 can0 181#00",
                          "(x) can0 181#00",
                          "(1) can0 181#0",
                          "(1) can0 181#0G",
                          "(1) can0 181#001122334455667788",
                          "(1) can0 181##",
                          "(1) can0 181#R9",
                          "(2015-13 1:2:3) can0 181#00",
                          "hello world"}) {
    CAPTURE(bad);
    CHECK_THAT(complaint(good + bad), Catch::Contains("bad.txt:2: "));
  }
}

// --- frames in words ---

TEST_CASE("NMT, SYNC, TIME, EMCY, LSS and what is none of CANopen's") {
  CanExplainer bus;
  CHECK(words(bus, "000#0105") == "NMT to node 5: start");
  CHECK(words(bus, "000#8100") == "NMT to all nodes: reset node");
  CHECK(bus.explain(frame("000#99")).is_abnormal);
  CHECK(bus.explain(frame("000#9901")).is_abnormal);
  CHECK(words(bus, "080#") == "SYNC");
  CHECK(words(bus, "080#07") == "SYNC, counter 7");
  CHECK(words(bus, "100#E8030000B606") == "TIME: 1988-09-14 00:00:01.000");
  CHECK(words(bus, "100#00000000FFFF") == "TIME: 2163-06-06 00:00:00.000");
  CHECK(bus.explain(frame("100#00")).is_abnormal);
  CHECK(words(bus, "085#1023030000000000") ==
        "EMCY of node 5: 0x2310, continuous over-current at the output; error register 0x03 (generic error, "
        "current)");
  CHECK(bus.explain(frame("085#1023")).is_abnormal);
  CHECK_FALSE(bus.explain(frame("085#0000000000000000")).is_abnormal);
  CHECK(words(bus, "7E5#0401") == "LSS request: switch state global");
  const CanExplanation unknown = bus.explain(frame("6FF#0102"));
  CHECK(unknown.meaning == CanFrameMeaning::unknown);
  CHECK(unknown.text == "identifier 0x6FF is none of CANopen's: 01 02");
  CHECK(bus.explain(frame("12345678#00")).meaning == CanFrameMeaning::not_canopen);
  CHECK(bus.explain(frame("123##000")).meaning == CanFrameMeaning::not_canopen);
  CHECK(words(bus, "705#R1") == "node guarding: asks node 5 for its state");
  CHECK(words(bus, "285#R8") == "asks node 5 for TPDO2");
}

TEST_CASE("the kernel's error frames say what happened on the bus") {
  CanExplainer bus;
  CHECK(words(bus, "20000040#0000000000000000") == "bus error: bus off: the controller has left the bus");
  CHECK(words(bus, "20000004#0020000000008000") ==
        "bus error: controller: error-passive by transmit errors; 128 transmit errors, 0 receive errors "
        "counted");
  CHECK(words(bus, "2000008C#0004000400000000")
            .find("controller: error warning level reached by receive errors; "
                  "protocol violation: unspecified (SRR bit)") != std::string::npos);
  CHECK(words(bus, "20000020#0000000000000000").find("no acknowledgement") != std::string::npos);
  CHECK(bus.explain(frame("20000100#0000000000000000")).meaning == CanFrameMeaning::bus_error);
}

TEST_CASE("heartbeats follow the state, and a restart that nobody ordered stands out") {
  CanExplainer bus;
  CHECK(words(bus, "703#00") == "boot-up of node 3");
  CHECK(words(bus, "703#7F") == "heartbeat of node 3: pre-operational");
  CHECK(words(bus, "000#0103") == "NMT to node 3: start");
  CHECK_FALSE(bus.explain(frame("703#05")).is_abnormal);
  const CanExplanation restart = bus.explain(frame("703#00"));
  CHECK(restart.is_abnormal);
  CHECK(restart.meaning == CanFrameMeaning::boot_up);
  CHECK(restart.text == "boot-up of node 3: it restarted without being told to");
  static_cast<void>(bus.explain(frame("000#8100")));
  CHECK_FALSE(bus.explain(frame("703#00")).is_abnormal);
  CHECK(words(bus, "703#04") == "heartbeat of node 3: stopped, though it should be pre-operational");
  CHECK(bus.explain(frame("703#33")).is_abnormal);
  CHECK(bus.explain(frame("703#0505")).is_abnormal);
}

TEST_CASE("SDO requests and answers are paired, refusals and strays stand out") {
  CanExplainer bus;
  CHECK(words(bus, "601#4041600000000000") == "SDO to node 1: read 0x6041 statusword");
  CHECK(words(bus, "581#4B41600027060000") ==
        "SDO of node 1: 0x6041 statusword = 0x0627 (operation enabled; remote, target reached)");
  CHECK(words(bus, "601#2B40600006000000") == "SDO to node 1: write 0x6040 controlword = 0x0006 (shutdown)");
  const CanExplanation refused = bus.explain(frame("581#8040600022000008"));
  CHECK(refused.is_abnormal);
  CHECK(refused.text ==
        "SDO of node 1: aborts 0x6040 controlword: 0x08000022, the data cannot be transferred or stored in "
        "the present device state");
  CHECK(words(bus, "581#6040600000000000") ==
        "SDO of node 1: 0x6040 controlword written (no request was seen)");
  static_cast<void>(bus.explain(frame("601#4000100000000000")));
  CHECK(words(bus, "601#4018100100000000") ==
        "SDO to node 1: read 0x1018:1 vendor id (the node has not answered: read 0x1000 device type)");
  CHECK(words(bus, "581#4300100092010200") ==
        "SDO of node 1: 0x1000 device type = 0x00020192 (device profile 402) (but asked was: read 0x1018:1 "
        "vendor id)");
  CHECK(bus.open_matters().empty());
  static_cast<void>(bus.explain(frame("602#4000100000000000")));
  REQUIRE(bus.open_matters().size() == 1);
  CHECK(bus.open_matters()[0] == "node 2 has not answered: read 0x1000 device type");
  CHECK(bus.explain(frame("601#40")).is_abnormal);
  CHECK(bus.explain(frame("601#E000000000000000")).is_abnormal);
  CHECK(bus.explain(frame("583#0011223344556677")).is_abnormal);
}

TEST_CASE("segments are put together, blocks are followed") {
  CanExplainer bus;
  CHECK(words(bus, "601#4008100000000000") == "SDO to node 1: read 0x1008 device name");
  CHECK(words(bus, "581#4108100009000000") == "SDO of node 1: 0x1008 device name comes in segments, 9 bytes");
  CHECK(words(bus, "601#6000000000000000") == "SDO to node 1: next segment of 0x1008 device name");
  CHECK(words(bus, "581#00544D434D2D3136") ==
        "SDO of node 1: read of 0x1008 device name: segment of 7 bytes, 7 so far");
  CHECK(words(bus, "601#7000000000000000") == "SDO to node 1: next segment of 0x1008 device name");
  CHECK(words(bus, "581#1B33360000000000") ==
        "SDO of node 1: read of 0x1008 device name: segment of 2 bytes, 9 so far, the last: "
        "0x1008 device name = \"TMCM-1636\"");
  CHECK(bus.explain(frame("601#6000000000000000")).is_abnormal);

  CHECK(words(bus, "601#2183600004000000") ==
        "SDO to node 1: write 0x60"
        "83 profile acceleration in segments, 4 bytes");
  CHECK_FALSE(bus.explain(frame("581#6083600000000000")).is_abnormal);
  CHECK_FALSE(bus.explain(frame("601#07E8030000000000")).is_abnormal);
  CHECK(words(bus, "581#2000000000000000") ==
        "SDO of node 1: segment of 0x6083 profile acceleration taken: 0x6083 profile acceleration written: "
        "1000 (0x000003E8)");

  CHECK(words(bus, "601#C250100010000000") == "SDO to node 1: write 0x1050 unknown object in blocks");
  CHECK(words(bus, "581#A05010007F000000") ==
        "SDO of node 1: 0x1050 unknown object may be written in blocks of 127 segments");
  CHECK(words(bus, "601#0141424344454647") ==
        "SDO to node 1: write of 0x1050 unknown object: segment 1 of the block");
  CHECK(words(bus, "601#8241424344454647") ==
        "SDO to node 1: write of 0x1050 unknown object: segment 2 of the block, the last");
  CHECK(words(bus, "581#A2027F0000000000") ==
        "SDO of node 1: write of 0x1050 unknown object: 2 segments taken");
  CHECK(words(bus, "601#C100000000000000") ==
        "SDO to node 1: write of 0x1050 unknown object: end of the block transfer");
  CHECK(words(bus, "581#A100000000000000") == "SDO of node 1: 0x1050 unknown object written in blocks");
  CHECK(bus.open_matters().empty());
}

constexpr const char* small_dcf =
    "[1800sub1]\nDataType=7\nDefaultValue=$NODEID+0x180\n[1a00sub0]\nDataType=5\nDefaultValue=2\n"
    "[1a00sub1]\nDataType=7\nDefaultValue=0x60410010\n[1a00sub2]\nDataType=7\nDefaultValue=0x21000110\n"
    "[2100]\nParameterName=Oven\nSubNumber=2\n[2100sub1]\nParameterName=Heat\nDataType=3\n"
    "[1801sub1]\nDataType=7\nDefaultValue=$NODEID+0x80000280\n[1a01sub0]\nDataType=5\nDefaultValue=1\n"
    "[1a01sub1]\nDataType=7\nDefaultValue=0x60640020\n";

TEST_CASE("PDOs are decoded by the DCF's mapping, and by what the trace sets up") {
  CanExplainer bus(dictionary(small_dcf), 4);
  CHECK(words(bus, "184#4006FFFF") ==
        "TPDO1 of node 4: statusword 0x0640 (switch on disabled; remote, target reached), Oven: Heat -1");
  CHECK(words(bus, "284#01000000") ==
        "TPDO2 of node 4: position actual value 1 (this PDO is off, says the DCF)");
  const CanExplanation short_one = bus.explain(frame("184#4006"));
  CHECK(short_one.is_abnormal);
  CHECK_THAT(short_one.text,
             Catch::EndsWith("Oven: Heat is missing: the frame is too short for its mapping"));
  CHECK(words(bus, "284#0100") ==
        "TPDO2 of node 4: position actual value is missing: the frame is too short for its mapping (this PDO "
        "is off, says the "
        "DCF)");
  CHECK_THAT(words(bus, "184#40060000AA"), Catch::EndsWith(", AA not mapped"));
  CHECK(words(bus, "185#4006") == "TPDO1 of node 5: mapping not known, 40 06");
  CHECK(words(bus, "204#0F00") == "RPDO1 to node 4: mapping not known, 0F 00");

  // TPDO1 moves to 0x1F0 and tells the speed; a write that is refused changes nothing
  for (const char* text :
       {"604#2F001A0000000000", "584#60001A0000000000", "604#23001A0120006C60", "584#60001A0100000000",
        "604#2F001A0001000000", "584#60001A0000000000", "604#23001801F0010000", "584#6000180100000000",
        "604#2F001A0003000000", "584#80001A0042000406"}) {
    static_cast<void>(bus.explain(frame(text)));
  }
  CHECK(words(bus, "1F0#D2FFFFFF") == "TPDO1 of node 4: velocity actual value -46");
  static_cast<void>(bus.explain(frame("000#8204")));
  CHECK_THAT(words(bus, "184#40060000"), Catch::Contains("Oven: Heat 0"));  // as at power-on
}

TEST_CASE("a PDO that moved is known without a DCF, whichever its number") {
  CanExplainer bus;
  for (const char* text : {"604#23021A0120006460", "584#60021A0100000000", "604#2F021A0001000000",
                           "584#60021A0000000000", "604#23021801F1010000", "584#6002180100000000"}) {
    CHECK_FALSE(bus.explain(frame(text)).is_abnormal);
  }
  CHECK(words(bus, "1F1#FEFFFFFF") == "TPDO3 of node 4: position actual value -2");
  CHECK(words(bus, "1F2#00") == "TPDO1 of node 114: mapping not known, 00");
}

TEST_CASE("a fault told by a statusword stands out once") {
  CanExplainer bus(dictionary(small_dcf), 4);
  CHECK_FALSE(bus.explain(frame("184#37060000")).is_abnormal);
  CHECK(bus.explain(frame("184#18060000")).is_abnormal);
  CHECK_FALSE(bus.explain(frame("184#18060000")).is_abnormal);
  CHECK_FALSE(bus.explain(frame("184#50060000")).is_abnormal);
  CHECK(bus.explain(frame("184#1F060000")).is_abnormal);
}

TEST_CASE("frames of every identifier, length and content are explained without harm") {
  CanExplainer bus(dictionary(small_dcf));
  std::uint32_t noise = 1;
  std::size_t characters = 0;
  for (int i = 0; i < 40000; ++i) {
    const auto next = [&] { return noise = noise * 1664525 + 1013904223; };
    CanFrame any{.id = next() >> 21, .size = static_cast<std::uint8_t>((next() >> 16) % 9)};
    for (std::uint8_t& byte : any.data) byte = static_cast<std::uint8_t>(next() >> 24);
    any.is_remote = next() >> 28 == 0;
    any.is_error = next() >> 28 == 0;
    if (next() >> 31 == 0) any.id = (next() >> 31 == 0 ? 0x580 : 0x600) + any.id % 4;
    const CanExplanation explanation = bus.explain(any);
    REQUIRE_FALSE(explanation.text.empty());
    characters += explanation.text.size();
  }
  CHECK(characters > 40000);
}

TEST_CASE("every frame of the recorded bring-up of a TMCM-1636 is explained") {
  if (!test::has_test_data("can/tmcm1636/candump.txt")) return;
  const auto trace = test::test_data("can/tmcm1636/candump.txt");
  const auto dcf = test::test_data("can/tmcm1636/TMCM-1636-CANopen.dcf");
  CanExplainer bus(std::make_shared<const ObjectDictionaryFile>(ObjectDictionaryFile::read(dcf)));
  std::map<CanFrameMeaning, int> counts;
  std::map<std::size_t, std::string> texts;
  int abnormal = 0;
  for (const CandumpLine& line : lines_of(trace)) {
    const CanExplanation explanation = bus.explain(line.frame);
    ++counts[explanation.meaning];
    abnormal += explanation.is_abnormal ? 1 : 0;
    texts[line.line] = explanation.text;
    CHECK_FALSE(explanation.text.empty());
    CHECK_THAT(explanation.text, !Catch::Contains("unknown") && !Catch::Contains("not known") &&
                                     !Catch::Contains("not mapped"));
  }
  CHECK(counts == std::map<CanFrameMeaning, int>{{CanFrameMeaning::nmt, 3},
                                                 {CanFrameMeaning::sync, 10},
                                                 {CanFrameMeaning::emergency, 2},
                                                 {CanFrameMeaning::rpdo, 3},
                                                 {CanFrameMeaning::sdo_request, 48},
                                                 {CanFrameMeaning::sdo_response, 48},
                                                 {CanFrameMeaning::boot_up, 1}});
  CHECK(abnormal == 2);  // it was found in a fault, and reported 0x6320
  CHECK(bus.open_matters().empty());
  CHECK(texts[1] == "NMT to node 1: reset communication");
  CHECK(texts[2] == "boot-up of node 1");
  CHECK(texts[14] ==
        "SDO of node 1: 0x6041 statusword = 0x0618 (fault; voltage enabled, remote, target reached)");
  CHECK(texts[11] == "SDO to node 1: write 0x1A00:1 TPDO1 mapped object 1 = 0x6041 statusword, 16 bits");
  CHECK(texts[100] ==
        "RPDO3 to node 1: controlword 0x0100 (disable voltage; halt), target position 0 (this PDO is off, "
        "says the DCF)");
  CHECK(texts[102] ==
        "EMCY of node 1: 0x6320, error in a parameter; error register 0x01 (generic error); manufacturer's "
        "bytes 00 FF "
        "00 00 00");
  CHECK(texts[109] == "RPDO4 to node 1: mode of operation 0 (no mode)");
  CHECK(texts[115] == "NMT to node 1: stop");
}

// --- the program ---

struct Outcome {
  int status = 0;
  std::string out;
  std::string err;
};

Outcome run(const TemporaryFolder& folder, const std::string& arguments) {
  const std::string command = "cd '" + folder.path().string() + "' && '" ALCES_PROGRAM "' explain-can " +
                              arguments + " >stdout.txt 2>stderr.txt </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(folder / "stdout.txt"),
          content_of(folder / "stderr.txt")};
}

TEST_CASE("explain-can prints a line a frame and a summary, for people and for machines") {
  const TemporaryFolder folder;
  folder.write("trace.log",
               "(1.000000) can0 704#00\n(1.100000) can0 184#18060100\n(1.200000) can0 6FF#00\n(1.300000) "
               "can0 604#4000100000000000\n");
  folder.write("drive.eds", small_dcf);
  const Outcome people = run(folder, "trace.log --dcf drive.eds");
  CHECK(people.status == 0);
  CHECK(people.err.empty());
  CHECK_THAT(people.out, Catch::StartsWith("1.000000  704#00                 boot-up of node 4\n") &&
                             Catch::Contains("! TPDO1 of node 4: statusword 0x0618 (fault") &&
                             Catch::Contains("4 frames: 1 TPDO, 1 SDO request, 1 boot-up, 1 unknown") &&
                             Catch::Contains("unknown identifier 0x6FF: 1 frames") &&
                             Catch::Contains("at the end: node 4 has not answered: read 0x1000 device type"));
  const Outcome machine = run(folder, "trace.log --dcf drive.eds --node 9 --json");
  CHECK(machine.status == 0);
  std::istringstream lines(machine.out);
  std::vector<nlohmann::json> objects;
  for (std::string line; std::getline(lines, line);) objects.push_back(nlohmann::json::parse(line));
  REQUIRE(objects.size() == 5);
  CHECK(objects[1]["kind"] == "TPDO");
  CHECK(objects[1]["node"] == 4);
  CHECK(objects[1]["stamp_s"] == 1.1);
  CHECK(objects[1]["text"] == "TPDO1 of node 4: mapping not known, 18 06 01 00");  // the EDS is node 9's
  CHECK(objects[4]["summary"]["frames"] == 4);
}

TEST_CASE("explain-can prints a repeated emergency once, counts it, and prints it again after a while") {
  const TemporaryFolder folder;
  std::string trace;
  const auto add = [&trace](double stamp_s, const std::string& frame) {
    std::array<char, 64> line{};
    std::snprintf(line.data(), line.size(), "(%.6f) can0 %s\n", stamp_s, frame.c_str());
    trace += line.data();
  };
  for (int i = 0; i < 2000; ++i) {  // two that take turns, among others' frames
    add(1000 + 0.001 * i, i % 2 == 0 ? "081#3081110000000000" : "081#1032110000000000");
    add(1000.0005 + 0.001 * i, "701#05");
  }
  add(1100, "081#3081110000000000");
  folder.write("flood.log", trace);
  const Outcome outcome = run(folder, "flood.log");
  INFO(outcome.err);
  REQUIRE(outcome.status == 0);
  const std::string listed = outcome.out.substr(0, outcome.out.find("4001 frames:"));
  const auto count = [](const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
  };
  CHECK(count(listed, "EMCY of node 1: 0x8130") == 2);
  CHECK(count(listed, "EMCY of node 1: 0x3210") == 1);
  CHECK(count(listed, "heartbeat of node 1") == 2000);
  CHECK_THAT(listed, Catch::Contains("(and 999 times since it was printed last)"));
  CHECK_THAT(outcome.out, Catch::Contains("worth a look (2001 frames):") &&
                              Catch::Contains("(1001 times, the last in line 4001)") &&
                              Catch::Contains("(1000 times, the last in line 3999)"));
}

TEST_CASE("explain-can says in one sentence what it cannot read") {
  const TemporaryFolder folder;
  folder.write("good.txt", "can0 181 [0]\n");
  folder.write("empty.txt", "");
  folder.write("cut.txt", "can0 181 [2] 00 11\ncan0 181 [8] 00 1");
  folder.write("prose.dcf", "Dear Sir,\n");
  folder.write("empty.dcf", "");
  const auto expect = [&](const char* arguments, int status, const char* part) {
    const Outcome outcome = run(folder, arguments);
    INFO(arguments << ": " << outcome.err);
    CHECK(outcome.status == status);
    CHECK_THAT(outcome.err, Catch::StartsWith("alces: ") && Catch::Contains(part));
  };
  expect("nowhere.txt", 3, "nowhere.txt");
  expect("empty.txt", 3, "empty.txt");
  expect("cut.txt", 0, "cut.txt:2:");  // passed over and told
  expect("good.txt --dcf nowhere.dcf", 3, "nowhere.dcf");
  expect("good.txt --dcf prose.dcf", 3, "prose.dcf:1:");
  expect("good.txt --dcf empty.dcf", 3, "empty.dcf");
  expect("good.txt --node 3", 2, "--dcf");
  expect("good.txt --dcf prose.dcf --node 200", 2, "--node");
  expect("", 2, "TRACE");
}

}  // namespace
}  // namespace alces::offline
