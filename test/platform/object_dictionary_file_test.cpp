#include "alces_platform/dictionary/object_dictionary_file.h"

#include <catch2/catch.hpp>

#include "support/test_data.h"

namespace alces {
namespace {

ObjectDictionaryFile parsed(std::string_view text) {
  return ObjectDictionaryFile::parse(text, "drive.dcf");
}

std::string complaint(std::string_view text) {
  try {
    static_cast<void>(parsed(text));
  } catch (const DictionaryError& error) {
    return error.what();
  }
  return "no complaint";
}

TEST_CASE("numbers are decimal, hexadecimal, octal, negative, or sums with $NODEID") {
  CHECK(object_value("10", 5) == 10);
  CHECK(object_value("0x1F", 5) == 31);
  CHECK(object_value("0X1f", 5) == 31);
  CHECK(object_value("010", 5) == 8);
  CHECK(object_value("0", 5) == 0);
  CHECK(object_value("09", 5) == 9);
  CHECK(object_value("-100000", 5) == -100000);
  CHECK(object_value("$NODEID+0x180", 5) == 0x185);
  CHECK(object_value("0x180+$NodeId", 5) == 0x185);
  CHECK(object_value(" $NODEID + 0x40000180 ", 1) == 0x40000181);
  CHECK(object_value("3221226497", 1) == 0xC0000401);
  CHECK_FALSE(object_value("", 5));
  CHECK_FALSE(object_value("0x", 5));
  CHECK_FALSE(object_value("12 34", 5));
  CHECK_FALSE(object_value("EPOS4", 5));
  CHECK_FALSE(object_value("1+", 5));
  CHECK_FALSE(object_value("99999999999999999999", 5));
}

TEST_CASE("objects, sub-indices, the node and its names are read, whatever the case and the line ends") {
  const auto file = parsed(
      "\xEF\xBB\xBF; a comment\r\n[DeviceInfo]\r\nVendorName=Someone\r\nPRODUCTNAME = Drive 7\r\n"
      "[1000]\r\nParameterName=Device "
      "Type\r\nObjectType=0x07\r\nDataType=0x0007\r\nAccessType=RO\r\nDefaultValue=0x20192\r\n"
      "[1a00]\nSubNumber=2\nParameterName=Mapping\n\n# another\n"
      "[1A00Sub1]\nparametername=Entry "
      "1\ndatatype=7\naccesstype=rww\ndefaultvalue=$NODEID+0x100\nParameterValue=0x60410010\n"
      "pdomapping=1\n[DEVICECOMMISSIONING]\nNodeID=0x0A\n");
  CHECK(file.vendor() == "Someone");
  CHECK(file.product() == "Drive 7");
  CHECK(file.node() == 10);
  CHECK(file.size() == 2);
  CHECK(file.warnings().empty());
  REQUIRE(file.find(0x1000, 0) != nullptr);
  CHECK(file.find(0x1000, 0)->access == "ro");
  CHECK(file.name(0x1A00) == "Mapping");
  REQUIRE(file.find(0x1A00, 1) != nullptr);
  CHECK(file.find(0x1A00, 1)->name == "Entry 1");
  CHECK(file.find(0x1A00, 1)->is_pdo_mappable);
  CHECK(file.value(0x1A00, 1, 3) == 0x60410010);  // the ParameterValue goes first
  CHECK(file.value(0x1000, 0, 3) == 0x20192);
  CHECK(file.find(0x1A00, 0) == nullptr);
  CHECK_FALSE(file.value(0x1A00, 9, 3));
}

TEST_CASE("a compact list of sub-indices is unfolded, with its names and values") {
  const auto file = parsed(
      "[1003]\nParameterName=Error field\nCompactSubObj=3\nDataType=0x7\nAccessType=ro\nDefaultValue=5\n"
      "[1003Name]\nNrOfEntries=1\n2=The second\n[1003Value]\nNrOfEntries=1\n3=0x77\n");
  CHECK(file.size() == 4);
  CHECK(file.value(0x1003, 0, 1) == 3);
  CHECK(file.find(0x1003, 1)->name == "Error field1");
  CHECK(file.find(0x1003, 2)->name == "The second");
  CHECK(file.value(0x1003, 2, 1) == 5);
  CHECK(file.value(0x1003, 3, 1) == 0x77);
  CHECK(file.find(0x1003, 4) == nullptr);
}

TEST_CASE("what is odd but harmless is a warning that names the line") {
  const auto file = parsed(
      "[1000]\nParameterName=A\nDataType=7\nDefaultValue=about "
      "ten\n[1001]\nParameterName=B\n[1000]\nDataType=7\n"
      "DefaultValue=2\n");
  REQUIRE(file.warnings().size() == 3);
  CHECK_THAT(file.warnings()[0], Catch::StartsWith("drive.dcf:1: [1000]") && Catch::Contains("about ten"));
  CHECK_THAT(file.warnings()[1], Catch::StartsWith("drive.dcf:5: [1001]"));
  CHECK_THAT(file.warnings()[2], Catch::StartsWith("drive.dcf:7: [1000]") && Catch::Contains("twice"));
  CHECK(file.value(0x1000, 0, 1) == 2);
}

TEST_CASE("remarks behind values and stray lines among them are no values") {
  const auto file = parsed(
      "made by hand\n[1000]\nParameterName=Kind ; of device\nDataType=0x0007  ; a remark\nand more\n"
      "DefaultValue=$NODEID+0x180\t; another\nAccessType=; none\n");
  CHECK(file.value(0x1000, 0, 5) == 0x185);
  CHECK(file.find(0x1000, 0)->data_type == 7);
  CHECK(file.name(0x1000) == "Kind");
  CHECK(file.find(0x1000, 0)->access.empty());
  REQUIRE(file.warnings().size() == 2);
  CHECK_THAT(file.warnings()[0], Catch::StartsWith("drive.dcf:1:") && Catch::Contains("passed over"));
  CHECK_THAT(file.warnings()[1], Catch::StartsWith("drive.dcf:5: [1000]"));
}

TEST_CASE("lines as long as CiA 306 allows, and indented ones, are read whole") {
  const std::string name(241, 'n');
  const auto file = parsed("[1000]\nParameterName=" + name +
                           "\n  DataType=0x0007\n\tDefaultValue=5\n  [1001]\nDataType=5\nDefaultValue=6\n");
  CHECK(file.warnings().empty());
  CHECK(file.name(0x1000) == name);
  REQUIRE(file.find(0x1000, 0) != nullptr);
  CHECK(file.find(0x1000, 0)->data_type == 7);
  CHECK(file.value(0x1000, 0, 1) == 5);
  CHECK(file.value(0x1001, 0, 1) == 6);
}

TEST_CASE("what is no EDS is refused with the line") {
  CHECK_THAT(complaint("[FileInfo]\nFileName=a\nthis is prose\n"),
             Catch::Contains("drive.dcf:3:") && Catch::Contains("EDS"));
  CHECK_THAT(complaint("a=b\n"), Catch::Contains("drive.dcf:1:"));
  CHECK_THAT(complaint("[1000\nDataType=7\n"), Catch::Contains("drive.dcf:1:") && Catch::Contains("']'"));
  CHECK_THAT(complaint("[1000]\n\nDataType=seven\n"),
             Catch::Contains("drive.dcf:3:") && Catch::Contains("seven"));
  CHECK_THAT(complaint("[1000]\nDataType=0x12345\n"), Catch::Contains("drive.dcf:2:"));
  CHECK_THAT(complaint("[1018subZ]\nDataType=7\n"), Catch::Contains("drive.dcf:1:"));
  CHECK_THAT(complaint("[1003]\nDataType=7\nCompactSubObj=255\n"), Catch::Contains("drive.dcf:3:"));
  CHECK_THAT(complaint("[1000]\nDataType=7\n[DeviceCommissioning]\nNodeID=200\n"),
             Catch::Contains("drive.dcf:4:"));
  CHECK_THAT(complaint("[FileInfo]\nFileName=a\n"), Catch::Contains("no object"));
  CHECK_THAT(complaint(""), Catch::Contains("no object"));
  CHECK_THAT(complaint(std::string_view("[10\0 00]", 8)), Catch::Contains("byte 3"));
}

TEST_CASE("the files of real drives are read without a warning") {
  struct Expectation {
    const char* name;
    const char* product;
    std::optional<std::uint8_t> node;
    std::size_t objects;
  };
  for (const Expectation& expected :
       {Expectation{"can/tmcm1636/TMCM-1636-CANopen.dcf", "TMCM-1636", 1, 150},
        Expectation{"can/eds/MaxonEPOS4_cern.eds", "EPOS4", std::nullopt, 300},
        Expectation{"can/eds/epos4_50_15_can_node1.dcf", "EPOS4", 1, 300},
        Expectation{"can/eds/ros2_canopen_cia402_slave.eds", "", std::nullopt, 100}}) {
    CAPTURE(expected.name);
    if (!test::has_test_data(expected.name)) return;
    const auto file = ObjectDictionaryFile::read(test::test_data(expected.name));
    for (const std::string& warning : file.warnings()) CHECK(warning.empty());
    CHECK_THAT(file.product(), Catch::Contains(expected.product));
    CHECK(file.node() == expected.node);
    CHECK(file.size() > expected.objects);
    REQUIRE(file.find(0x6041, 0) != nullptr);
    CHECK(file.find(0x6041, 0)->data_type == 6);
    CHECK(file.find(0x6041, 0)->access == "ro");
    CHECK(file.value(0x1400, 1, 1).value_or(0) % 0x800 == 0x201);
  }
}

}  // namespace
}  // namespace alces
