#include "alces_platform/dictionary/motor_check.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <string>

#include "alces_platform/settings/vehicle_settings.h"
#include "support/test_data.h"

using namespace alces;
using Catch::Matchers::Contains;

namespace {

struct Line {
  int type = 7;
  std::string access = "rw";
  bool is_mappable = false;
  std::string value;
};

/// A small drive that has all that the table below asks for: "6041" or "1a00sub1" and its line.
std::map<std::string, Line> small_drive() {
  std::map<std::string, Line> drive{{"1000", {7, "const", false, "0x20192"}},
                                    {"1016sub1", {7, "rw", false, ""}},
                                    {"1017", {6, "rw", false, "0"}},
                                    {"6007", {3, "rw", false, "0"}},
                                    {"6040", {6, "rww", true, ""}},
                                    {"6041", {6, "ro", true, ""}},
                                    {"6060", {2, "rw", true, ""}},
                                    {"6061", {2, "ro", true, ""}},
                                    {"6064", {4, "ro", true, ""}},
                                    {"606c", {4, "ro", true, ""}},
                                    {"6083", {7, "rw", false, ""}},
                                    {"60ff", {4, "rww", true, ""}},
                                    {"6502", {7, "ro", false, "0x25"}}};
  for (const char* pdo : {"1400", "1401", "1800", "1801"}) {
    drive[std::string(pdo) + "sub1"] = {7, "rw", false, ""};
    drive[std::string(pdo) + "sub2"] = {5, "rw", false, "255"};
  }
  for (const char* mapping : {"1600", "1601", "1a00", "1a01"}) {
    drive[std::string(mapping) + "sub0"] = {5, "rw", false, "0"};
    for (int sub = 1; sub <= 4; ++sub)
      drive[std::string(mapping) + "sub" + std::to_string(sub)] = {7, "rw", false, ""};
  }
  return drive;
}

std::string eds_of(const std::map<std::string, Line>& drive) {
  std::string eds;
  for (const auto& [section, line] : drive) {
    eds += "[" + section + "]\nParameterName=P\nDataType=" + std::to_string(line.type) +
           "\nAccessType=" + line.access + "\nPDOMapping=" + (line.is_mappable ? "1" : "0") +
           "\nDefaultValue=" + line.value + "\n";
  }
  return eds;
}

/// From the first line on, so that lines can be told.
const char* const table =
    "[motor]\n"
    "node = 3\n"
    "own_heartbeat_timeout_ms = 1000\n"
    "checks = [{index = 0x1000, mask = 0xFFFF, value = 0x192}]\n"
    "writes = [\n"
    "  {index = 0x6083, bytes = 4, value = 1000},\n"
    "]\n"
    "tpdos = [\n"
    "  {number = 1, transmission_type = 1, entries = [{index = 0x6041, bits = 16}, {index = 0x6064, bits = "
    "32}]},\n"
    "  {number = 2, transmission_type = 1, entries = [{index = 0x606C, bits = 32}]},\n"
    "]\n"
    "rpdos = [{number = 1, transmission_type = 1, entries = [{index = 0x6040, bits = 16}, {index = 0x60FF, "
    "bits = "
    "32}]}]\n"
    "tpdos_to_disable = []\n"
    "rpdos_to_disable = [{number = 2}]\n";

std::vector<MotorFinding> findings(const std::map<std::string, Line>& drive, const std::string& text = table,
                                   const std::string& more_eds = "") {
  const settings::VehicleSettings vehicle = settings::parse_vehicle_settings(text, "vehicle.toml");
  return check_motor(vehicle.scanner.motor, "vehicle.toml", text,
                     ObjectDictionaryFile::parse(eds_of(drive) + more_eds, "drive.eds"), "drive.eds");
}

/// The one finding that there is.
MotorFinding finding(const std::map<std::string, Line>& drive, const std::string& text = table) {
  const std::vector<MotorFinding> all = findings(drive, text);
  for (const MotorFinding& each : all) UNSCOPED_INFO(each.sentence);
  REQUIRE(all.size() == 1);
  return all.front();
}

std::string table_with(const std::string& was, const std::string& is) {
  std::string text = table;
  const std::size_t at = text.find(was);
  REQUIRE(at != std::string::npos);
  return text.replace(at, was.size(), is);
}

}  // namespace

TEST_CASE("a motor's table that suits its drive gives nothing to find") {
  CHECK(findings(small_drive()).empty());
}

TEST_CASE("an object that the drive does not have is named with the line that asks for it") {
  auto drive = small_drive();
  drive.erase("6083");
  const MotorFinding found = finding(drive);
  CHECK(found.is_error);
  CHECK_THAT(found.sentence,
             Contains("vehicle.toml:6: motor.writes: the drive has no 0x6083:00") && Contains("(drive.eds)"));
}

TEST_CASE("an object that cannot be written is named with the lines of both files") {
  auto drive = small_drive();
  drive["6083"].access = "ro";
  const MotorFinding found = finding(drive);
  CHECK(found.is_error);
  CHECK_THAT(found.sentence, Contains("vehicle.toml:6: motor.writes: 0x6083:00") &&
                                 Contains("cannot be written, it is ro (drive.eds:"));
}

TEST_CASE("an object of another size than is written, or than travels in a PDO, is told with both sizes") {
  auto drive = small_drive();
  drive["6083"].type = 6;
  CHECK_THAT(finding(drive).sentence, Contains("vehicle.toml:6: motor.writes: 0x6083:00") &&
                                          Contains("has 2 bytes, not 4 (drive.eds:"));
  drive = small_drive();
  drive["6064"].type = 3;
  const MotorFinding found = finding(drive);
  CHECK(found.is_error);
  CHECK_THAT(found.sentence, Contains("vehicle.toml:9: motor.tpdos: 0x6064:00") &&
                                 Contains("has 16 bits, not 32 (drive.eds:"));
}

TEST_CASE("what cannot be mapped into a PDO, or not in that direction, is told") {
  auto drive = small_drive();
  drive["6064"].is_mappable = false;
  CHECK_THAT(finding(drive).sentence,
             Contains("vehicle.toml:9: motor.tpdos: 0x6064:00") && Contains("cannot be mapped into a PDO"));
  drive = small_drive();
  drive["60ff"].access = "rwr";
  CHECK_THAT(finding(drive).sentence, Contains("vehicle.toml:12: motor.rpdos: 0x60FF:00") &&
                                          Contains("cannot travel to the drive, it is rwr"));
  drive = small_drive();
  drive["606c"].access = "rww";
  CHECK_THAT(finding(drive).sentence, Contains("vehicle.toml:10: motor.tpdos: 0x606C:00") &&
                                          Contains("cannot travel from the drive, it is rww"));
}

TEST_CASE("a mapping and a transmission type that are fixed are told with the key that leaves them") {
  auto drive = small_drive();
  for (const char* section : {"1a01sub0", "1a01sub1"}) drive[section].access = "const";
  drive["1a01sub1"].value = "0x606C0020";
  std::vector<MotorFinding> found = findings(drive);
  REQUIRE(found.size() == 2);
  CHECK_THAT(found[0].sentence,
             Contains("vehicle.toml:10: motor.tpdos: 0x1A01:00") && Contains("keeps_mapping = true"));
  const std::string keeps = table_with("{number = 2, ", "{number = 2, keeps_mapping = true, ");
  CHECK(findings(drive, keeps).empty());
  drive["1a01sub1"].value = "0x60640020";
  CHECK_THAT(finding(drive, keeps).sentence, Contains("keeps_mapping, but 0x1A01:01") &&
                                                 Contains("is 0x60640020 and not 0x606C0020 (drive.eds:"));
  drive = small_drive();
  drive["1400sub2"].access = "ro";
  CHECK_THAT(finding(drive).sentence, Contains("vehicle.toml:12: motor.rpdos: 0x1400:02") &&
                                          Contains("keeps_transmission_type = true"));
  drive = small_drive();
  drive.erase("1401sub1");
  CHECK_THAT(finding(drive).sentence,
             Contains("vehicle.toml:14: motor.rpdos_to_disable: the drive has no 0x1401:01") &&
                 Contains("need not be disabled"));
}

TEST_CASE("a drive without profile velocity mode, another node and another device are told") {
  auto drive = small_drive();
  drive["6502"].value = "0x21";
  CHECK_THAT(finding(drive).sentence,
             Contains("no profile velocity mode") && Contains("0x21, without bit 2"));
  const std::vector<MotorFinding> other = findings(small_drive(), table, "[DeviceComissioning]\nNodeID=9\n");
  REQUIRE(other.size() == 1);
  CHECK_THAT(other[0].sentence, Contains("vehicle.toml:2: motor.node: is 3, but the file describes node 9"));
  drive = small_drive();
  drive["1000"].value = "0x20191";
  const MotorFinding found = finding(drive);
  CHECK_FALSE(found.is_error);
  CHECK_THAT(found.sentence, Contains("vehicle.toml:4: motor.checks: 0x1000:00") &&
                                 Contains("asked to be 0x192, but is 0x191 in the file"));
}

TEST_CASE("a drive that would turn on without its master is a warning, as at every start") {
  const std::string turns_on = to_string(MasterLossReaction::none);
  auto drive = small_drive();
  drive.erase("6007");
  MotorFinding found = finding(drive);
  CHECK_FALSE(found.is_error);
  CHECK_THAT(found.sentence, Contains("the drive has no 0x6007:00") && Contains(turns_on));
  drive["1029sub1"] = {5, "rw", false, "0"};
  CHECK_THAT(finding(drive).sentence, Contains("only 0x1029, whose NMT state stops no shaft"));

  drive = small_drive();
  drive["6007"].access = "ro";
  found = finding(drive);
  CHECK_FALSE(found.is_error);
  CHECK_THAT(found.sentence,
             Contains("0x6007:00") && Contains("is 0 and cannot be written") && Contains(turns_on));
  drive["6007"].value = "2";
  CHECK(findings(drive).empty());

  drive = small_drive();
  drive.erase("1016sub1");
  found = finding(drive);
  CHECK(found.is_error);
  CHECK_THAT(found.sentence,
             Contains("vehicle.toml:3: motor.own_heartbeat_timeout_ms: the drive has no 0x1016:01") &&
                 Contains("cannot watch this computer"));
  found = finding(drive, table_with("own_heartbeat_timeout_ms = 1000", "own_heartbeat_timeout_ms = 0"));
  CHECK_FALSE(found.is_error);
  CHECK_THAT(found.sentence,
             Contains("vehicle.toml:3: motor.own_heartbeat_timeout_ms: is 0") && Contains(turns_on));
  CHECK(findings(drive, table_with("own_heartbeat_timeout_ms = 1000",
                                   "own_heartbeat_timeout_ms = 0\n"
                                   "watchdog_writes = [{index = 0x6083, bytes = 4, value = 1}]"))
            .empty());
}

TEST_CASE("the shipped table suits the file of the drive that it is for, but for its reaction") {
  if (!test::has_test_data("can/tmcm1636/TMCM-1636-CANopen.dcf")) return;
  const settings::VehicleSettings vehicle = settings::default_vehicle_settings();
  const auto dcf = test::test_data("can/tmcm1636/TMCM-1636-CANopen.dcf");
  bool warns = false;
  for (const MotorFinding& each : check_motor(vehicle.scanner.motor, "vehicle.toml", vehicle.text,
                                              ObjectDictionaryFile::read(dcf), dcf)) {
    INFO(each.sentence);
    CHECK_FALSE(each.is_error);
    warns = warns || each.sentence.find("the drive has no 0x6007:00") != std::string::npos;
  }
  CHECK(warns);
}
