#include "alces_platform/sim/motor/drive_objects.h"

#include <iterator>
#include <limits>
#include <span>

namespace alces::sim {
namespace {

using enum Access;
using enum DataType;

struct Row {
  std::uint16_t index;
  std::uint8_t sub;
  DataType type;
  Access access;
  Mapping mapping;
  std::int64_t default_value;
  const char* text = "";
};

/// What all three have alike; the tables below hold what each has besides.
constexpr Row common_rows[] = {
    {0x1001, 0, unsigned8, read_only, Mapping::none, 0},
    {0x1010, 1, unsigned32, read_write, Mapping::none, 1},
    {0x1011, 1, unsigned32, read_write, Mapping::none, 1},
    {0x1016, 1, unsigned32, read_write, Mapping::none, 0},
    {0x1017, 0, unsigned16, read_write, Mapping::none, 0},
    {0x1018, 0, unsigned8, read_only, Mapping::none, 4},
    {0x1018, 4, unsigned32, read_only, Mapping::none, 1},
    {0x6041, 0, unsigned16, read_only, Mapping::tpdo, 0},
    {0x605B, 0, integer16, read_write, Mapping::none, 0},
    {0x605C, 0, integer16, read_write, Mapping::none, 1},
    {0x605E, 0, integer16, read_write, Mapping::none, 2},
    {0x6064, 0, integer32, read_only, Mapping::tpdo, 0},
    {0x606C, 0, integer32, read_only, Mapping::tpdo, 0},
    {0x60FD, 0, unsigned32, read_only, Mapping::tpdo, 0},
};

constexpr Row tmcm1636_rows[] = {
    {0x1000, 0, unsigned32, constant, Mapping::none, 0x420192},
    {0x1005, 0, unsigned32, read_write, Mapping::none, 0x80},
    {0x1008, 0, visible_string, constant, Mapping::none, 0, "TMCM-1636"},
    {0x1009, 0, visible_string, constant, Mapping::none, 0, "1.0"},
    {0x100A, 0, visible_string, constant, Mapping::none, 0, "1.19"},
    {0x100C, 0, unsigned16, read_write, Mapping::none, 0},
    {0x100D, 0, unsigned8, read_write, Mapping::none, 0},
    {0x1010, 0, unsigned8, read_only, Mapping::none, 4},
    {0x1010, 2, unsigned32, read_write, Mapping::none, 1},
    {0x1010, 3, unsigned32, read_write, Mapping::none, 1},
    {0x1010, 4, unsigned32, read_write, Mapping::none, 1},
    {0x1011, 0, unsigned8, read_only, Mapping::none, 4},
    {0x1011, 2, unsigned32, read_write, Mapping::none, 1},
    {0x1011, 3, unsigned32, read_write, Mapping::none, 1},
    {0x1011, 4, unsigned32, read_write, Mapping::none, 1},
    {0x1015, 0, unsigned16, read_write, Mapping::none, 0},
    {0x1016, 0, unsigned8, read_only, Mapping::none, 1},
    {0x1018, 1, unsigned32, read_only, Mapping::none, 0x286},
    {0x1018, 2, unsigned32, read_only, Mapping::none, 0x664},
    {0x1018, 3, unsigned32, read_only, Mapping::none, 0x10013},
    {0x1029, 0, unsigned8, read_only, Mapping::none, 1},
    {0x1029, 1, unsigned8, read_write, Mapping::none, 0},
    {0x6040, 0, unsigned16, read_write, Mapping::both, 0},
    {0x605A, 0, integer16, read_write, Mapping::none, 2},
    {0x605D, 0, integer16, read_write, Mapping::none, 1},
    {0x6060, 0, integer8, read_write, Mapping::both, 0},
    {0x6061, 0, integer8, read_only, Mapping::tpdo, 0},
    {0x6062, 0, integer32, read_only, Mapping::none, 0},
    {0x6063, 0, integer32, read_only, Mapping::none, 0},
    {0x6065, 0, unsigned32, read_write, Mapping::none, 0},
    {0x6067, 0, unsigned32, read_write, Mapping::none, 0},
    {0x6068, 0, unsigned16, read_write, Mapping::none, 0},
    {0x606A, 0, integer16, read_write, Mapping::none, 0},
    {0x606B, 0, integer32, read_only, Mapping::none, 0},
    {0x6071, 0, integer16, read_write, Mapping::rpdo, 0},
    {0x6072, 0, unsigned16, read_write, Mapping::none, 0},
    {0x6074, 0, integer16, read_only, Mapping::none, 0},
    {0x6077, 0, integer16, read_only, Mapping::tpdo, 0},
    {0x607A, 0, integer32, read_write, Mapping::both, 0},
    {0x607C, 0, integer32, read_write, Mapping::none, 0},
    {0x607D, 0, unsigned8, constant, Mapping::none, 2},
    {0x607D, 1, integer32, read_write, Mapping::none, std::numeric_limits<std::int32_t>::min()},
    {0x607D, 2, integer32, read_write, Mapping::none, std::numeric_limits<std::int32_t>::max()},
    {0x607F, 0, unsigned32, read_write, Mapping::tpdo, 4000},
    {0x6081, 0, unsigned32, read_write, Mapping::tpdo, 4000},
    {0x6083, 0, unsigned32, read_write, Mapping::none, 0},
    {0x6084, 0, unsigned32, read_write, Mapping::none, 0},
    {0x6085, 0, unsigned32, read_write, Mapping::none, 0},
    {0x6098, 0, integer8, read_write, Mapping::none, 0},
    {0x6099, 0, unsigned8, constant, Mapping::none, 2},
    {0x6099, 1, unsigned32, read_write, Mapping::none, 0},
    {0x6099, 2, unsigned32, read_write, Mapping::none, 0},
    {0x609A, 0, unsigned32, read_write, Mapping::none, 0},
    {0x60B0, 0, integer32, read_write, Mapping::none, 0},
    {0x60B1, 0, integer32, read_write, Mapping::none, 0},
    {0x60B2, 0, integer16, read_write, Mapping::none, 0},
    {0x60C2, 0, unsigned8, constant, Mapping::none, 2},
    {0x60C2, 1, unsigned8, read_write, Mapping::none, 0},
    {0x60C2, 2, integer8, read_write, Mapping::none, 0},
    {0x60F2, 0, unsigned16, read_write, Mapping::none, 0},
    {0x60FF, 0, integer32, read_write, Mapping::both, 0},
    {0x6502, 0, unsigned32, read_only, Mapping::none, 0x3A5},
    {0x67FF, 0, unsigned32, read_only, Mapping::none, 0x20192},
};

constexpr Row epos4_rows[] = {
    {0x1000, 0, unsigned32, read_only, Mapping::none, 0x20192},
    {0x1003, 0, unsigned8, read_write, Mapping::none, 0},
    {0x1003, 1, unsigned32, read_only, Mapping::none, 0},
    {0x1003, 2, unsigned32, read_only, Mapping::none, 0},
    {0x1003, 3, unsigned32, read_only, Mapping::none, 0},
    {0x1003, 4, unsigned32, read_only, Mapping::none, 0},
    {0x1003, 5, unsigned32, read_only, Mapping::none, 0},
    {0x1005, 0, unsigned32, constant, Mapping::none, 0x80},
    {0x1008, 0, visible_string, read_only, Mapping::none, 0, "EPOS4"},
    {0x1010, 0, unsigned8, read_only, Mapping::none, 1},
    {0x1011, 0, unsigned8, read_only, Mapping::none, 4},
    {0x1011, 4, unsigned32, read_write, Mapping::none, 1},
    {0x1016, 0, unsigned8, read_only, Mapping::none, 2},
    {0x1016, 2, unsigned32, read_write, Mapping::none, 0},
    {0x1018, 1, unsigned32, read_only, Mapping::none, 0xFB},
    {0x1018, 2, unsigned32, read_only, Mapping::none, 0x65520000},
    {0x1018, 3, unsigned32, read_only, Mapping::none, 0x01700000},
    {0x6007, 0, integer16, read_write, Mapping::none, 3},
    {0x603F, 0, unsigned16, read_only, Mapping::tpdo, 0},
    {0x6040, 0, unsigned16, read_write, Mapping::rpdo, 0},
    {0x605A, 0, integer16, read_write, Mapping::none, 6},
    {0x6060, 0, integer8, read_write, Mapping::rpdo, 1},
    {0x6061, 0, integer8, read_only, Mapping::tpdo, 1},
    {0x6062, 0, integer32, read_only, Mapping::tpdo, 0},
    {0x606B, 0, integer32, read_only, Mapping::tpdo, 0},
    {0x6077, 0, integer16, read_only, Mapping::tpdo, 0},
    {0x607A, 0, integer32, read_write, Mapping::rpdo, 0},
    {0x607F, 0, unsigned32, read_write, Mapping::rpdo, 50000},
    {0x6080, 0, unsigned32, read_write, Mapping::rpdo, 50000},
    {0x6081, 0, unsigned32, read_write, Mapping::rpdo, 1000},
    {0x6083, 0, unsigned32, read_write, Mapping::rpdo, 10000},
    {0x6084, 0, unsigned32, read_write, Mapping::rpdo, 10000},
    {0x6085, 0, unsigned32, read_write, Mapping::rpdo, 10000},
    {0x6086, 0, integer16, read_write, Mapping::rpdo, 0},
    {0x60A8, 0, unsigned32, read_write, Mapping::none, 0x00B50000},
    {0x60A9, 0, unsigned32, read_write, Mapping::none, 0x00B44700},
    {0x60AA, 0, unsigned32, read_write, Mapping::none, 0x00C00300},
    {0x60FF, 0, integer32, read_write, Mapping::rpdo, 0},
    {0x6402, 0, unsigned16, read_write, Mapping::none, 10},
    {0x6502, 0, unsigned32, read_only, Mapping::tpdo, 0x3A5},
};

constexpr Row ipos_rows[] = {
    {0x1000, 0, unsigned32, read_only, Mapping::none, 0x60192},
    {0x1005, 0, unsigned32, read_write, Mapping::none, 0x80},
    {0x1008, 0, visible_string, constant, Mapping::none, 0, "iPOS"},
    {0x1010, 0, unsigned8, read_only, Mapping::none, 1},
    {0x1011, 0, unsigned8, read_only, Mapping::none, 1},
    {0x1016, 0, unsigned8, read_only, Mapping::none, 1},
    {0x1018, 1, unsigned32, read_only, Mapping::none, 0x1A3},
    {0x1018, 2, unsigned32, read_only, Mapping::none, 0},
    {0x1018, 3, unsigned32, read_only, Mapping::none, 0},
    {0x6007, 0, integer16, read_write, Mapping::none, 1},
    {0x603F, 0, unsigned16, read_only, Mapping::tpdo, 0},
    {0x6040, 0, unsigned16, read_write, Mapping::rpdo, 0},
    {0x605A, 0, integer16, read_write, Mapping::none, 2},
    {0x605D, 0, integer16, read_write, Mapping::none, 1},
    {0x6060, 0, integer8, read_write, Mapping::rpdo, 0},
    {0x6061, 0, integer8, read_only, Mapping::tpdo, 0},
    {0x6062, 0, integer32, read_only, Mapping::tpdo, 0},
    {0x6063, 0, integer32, read_only, Mapping::tpdo, 0},
    {0x606B, 0, integer32, read_only, Mapping::tpdo, 0},
    {0x607A, 0, integer32, read_write, Mapping::rpdo, 0},
    {0x6081, 0, unsigned32, read_write, Mapping::rpdo, 0},
    {0x6083, 0, unsigned32, read_write, Mapping::rpdo, 0},
    {0x6085, 0, unsigned32, read_write, Mapping::none, 0},
    {0x60FF, 0, integer32, read_write, Mapping::rpdo, 0},
    {0x6502, 0, unsigned32, read_only, Mapping::tpdo, 0x65},
};

ObjectDictionary from(std::span<const Row> rows) {
  ObjectDictionary objects;
  for (const std::span<const Row> part : {std::span<const Row>(common_rows), rows}) {
    for (const Row& row : part) {
      objects.add(row.index, row.sub,
                  {.type = row.type,
                   .access = row.access,
                   .mapping = row.mapping,
                   .default_value = row.default_value,
                   .text = row.text});
    }
  }
  return objects;
}

struct PdoDefault {
  std::int64_t receive_id;  // the node's number is added
  std::int64_t transmit_id;
  std::int64_t receive_entries[2];  // 0: none
  std::int64_t transmit_entries[2];
};

void add_parameter(ObjectDictionary& objects, std::size_t index, std::size_t sub, DataType type,
                   Access access, std::int64_t value) {
  objects.add(static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(sub),
              {.type = type, .access = access, .default_value = value});
}

void add_mapping(ObjectDictionary& objects, std::size_t index, std::span<const std::int64_t> entries,
                 std::size_t capacity) {
  std::int64_t count = 0;
  for (std::size_t sub = 1; sub <= capacity; ++sub) {
    const std::int64_t entry = sub <= entries.size() ? entries[sub - 1] : 0;
    if (entry != 0) ++count;
    add_parameter(objects, index, sub, unsigned32, read_write, entry);
  }
  add_parameter(objects, index, 0, unsigned8, read_write, count);
}

void add_pdos(ObjectDictionary& objects, std::uint8_t node, std::span<const PdoDefault> pdos,
              std::size_t entries, std::size_t transmit_parameters, std::int64_t inhibit_time) {
  for (std::size_t number = 0; number < pdos.size(); ++number) {
    const PdoDefault& pdo = pdos[number];
    add_parameter(objects, 0x1400 + number, 0, unsigned8, read_only, 2);
    add_parameter(objects, 0x1400 + number, 1, unsigned32, read_write, pdo.receive_id + node);
    add_parameter(objects, 0x1400 + number, 2, unsigned8, read_write, 255);
    add_mapping(objects, 0x1600 + number, pdo.receive_entries, entries);
    add_parameter(objects, 0x1800 + number, 0, unsigned8, read_only,
                  static_cast<std::int64_t>(transmit_parameters));
    add_parameter(objects, 0x1800 + number, 1, unsigned32, read_write, pdo.transmit_id + node);
    add_parameter(objects, 0x1800 + number, 2, unsigned8, read_write, 255);
    add_parameter(objects, 0x1800 + number, 3, unsigned16, read_write, inhibit_time);
    if (transmit_parameters >= 5) {
      add_parameter(objects, 0x1800 + number, 4, unsigned8, read_write, 0);
      add_parameter(objects, 0x1800 + number, 5, unsigned16, read_write, 0);
    }
    add_mapping(objects, 0x1A00 + number, pdo.transmit_entries, entries);
  }
}

}  // namespace

ObjectDictionary tmcm1636_objects(std::uint8_t node) {
  ObjectDictionary objects = from(tmcm1636_rows);
  add_parameter(objects, 0x1014, 0, unsigned32, read_only, 0x80 + node);
  // The EDS gives the TPDOs' COB-IDs without bit 30; the real node answers with it (no remote requests).
  constexpr PdoDefault pdos[] = {
      {0x40000200, 0x40000180, {0x60400010, 0}, {0x60410010, 0}},
      {0x40000300, 0x40000280, {0x60400010, 0x60600008}, {0x60410010, 0x60610008}},
      {0x40000400, 0x40000380, {0x60400010, 0x607A0020}, {0x60410010, 0x60640020}},
      {0x40000500, 0x40000480, {0x60400010, 0x60FF0020}, {0x60410010, 0x606C0020}},
  };
  add_pdos(objects, node, pdos, 3, 5, 0);
  objects.add(0x1802, 2, {.type = unsigned8, .access = read_write, .default_value = 1});
  objects.add(0x1803, 2, {.type = unsigned8, .access = read_write, .default_value = 0xFE});
  return objects;
}

ObjectDictionary epos4_objects(std::uint8_t node) {
  ObjectDictionary objects = from(epos4_rows);
  add_parameter(objects, 0x1014, 0, unsigned32, read_only, 0x80 + node);
  add_parameter(objects, 0x1200, 0, unsigned8, read_only, 2);
  add_parameter(objects, 0x1200, 1, unsigned32, read_only, 0x600 + node);
  add_parameter(objects, 0x1200, 2, unsigned32, read_only, 0x580 + node);
  constexpr PdoDefault pdos[] = {
      {0x200, 0x40000180, {0x60400010, 0}, {0x60410010, 0}},
      {0x300, 0xC0000280, {0x60400010, 0x60600008}, {0x60410010, 0x60610008}},
      {0x400, 0xC0000380, {0x60400010, 0x607A0020}, {0x60410010, 0x60640020}},
      {0x500, 0xC0000480, {0x60400010, 0x60FF0020}, {0x60410010, 0x606C0020}},
  };
  add_pdos(objects, node, pdos, 8, 3, 10);
  for (const std::uint16_t ramp : {std::uint16_t{0x6083}, std::uint16_t{0x6084}, std::uint16_t{0x6085}}) {
    ObjectEntry entry = *objects.find(ramp, 0);
    entry.minimum = 1;
    objects.add(ramp, 0, entry);
  }
  return objects;
}

ObjectDictionary ipos_objects(std::uint8_t node) {
  ObjectDictionary objects = from(ipos_rows);
  add_parameter(objects, 0x1014, 0, unsigned32, read_only, 0x80 + node);
  constexpr PdoDefault pdos[] = {
      {0x200, 0x180, {0x60400010, 0}, {0x60410010, 0}},
      {0x300, 0x280, {0x60400010, 0x60600008}, {0x60410010, 0x60610008}},
      {0x400, 0x80000380, {0x60400010, 0x607A0020}, {0x60410010, 0x60640020}},
      {0x500, 0x80000480, {0x60400010, 0x60FF0020}, {0x60410010, 0x606C0020}},
  };
  add_pdos(objects, node, pdos, 8, 5, 300);
  return objects;
}

}  // namespace alces::sim
