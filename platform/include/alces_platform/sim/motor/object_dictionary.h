// The object dictionary of a simulated CANopen node: typed entries with access, limits and defaults, and the
// checks that CiA 301 asks for before a value is read or written. What a value does when it is written is the
// node's business.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace alces::sim {

/// CiA 301's numbers for the types that drives use.
enum class DataType : std::uint8_t {
  boolean = 1,
  integer8 = 2,
  integer16 = 3,
  integer32 = 4,
  unsigned8 = 5,
  unsigned16 = 6,
  unsigned32 = 7,
  visible_string = 9,
};

/// Bytes on the wire; 0 for strings.
[[nodiscard]] std::size_t size_of(DataType type);

enum class Access : std::uint8_t { constant, read_only, write_only, read_write };

/// Where CiA 301 lets an object be mapped.
enum class Mapping : std::uint8_t { none, tpdo, rpdo, both };

/// SDO abort codes (CiA 301); alces_drivers/canopen/sdo_abort.h has their texts. 0: no abort.
enum class SdoAbort : std::uint32_t {
  none = 0,
  toggle_bit = 0x05030000,
  command = 0x05040001,
  unsupported_access = 0x06010000,
  write_only = 0x06010001,
  read_only = 0x06010002,
  no_object = 0x06020000,
  cannot_be_mapped = 0x06040041,
  pdo_length = 0x06040042,
  length = 0x06070010,
  no_subindex = 0x06090011,
  invalid_value = 0x06090030,
  too_high = 0x06090031,
  too_low = 0x06090032,
  general = 0x08000000,
  cannot_be_stored = 0x08000020,
  device_state = 0x08000022,
};

struct ObjectEntry {
  DataType type = DataType::unsigned8;
  Access access = Access::read_only;
  Mapping mapping = Mapping::none;
  std::int64_t value = 0;
  std::int64_t default_value = 0;
  std::int64_t minimum = std::numeric_limits<std::int64_t>::min();  ///< of what may be written
  std::int64_t maximum = std::numeric_limits<std::int64_t>::max();
  std::string text = {};  ///< of strings
};

class ObjectDictionary {
 public:
  /// Sets value to the default; an entry that is there is replaced.
  void add(std::uint16_t index, std::uint8_t sub, ObjectEntry entry);
  void remove(std::uint16_t index);

  [[nodiscard]] bool has_index(std::uint16_t index) const;
  [[nodiscard]] const ObjectEntry* find(std::uint16_t index, std::uint8_t sub) const;

  /// 0 where there is no such entry.
  [[nodiscard]] std::int64_t value(std::uint16_t index, std::uint8_t sub = 0) const;
  /// The node's own doing: no checks; false where there is no such entry.
  bool set(std::uint16_t index, std::uint8_t sub, std::int64_t value);

  /// Little-endian bytes of a value, for an SDO upload.
  [[nodiscard]] SdoAbort read(std::uint16_t index, std::uint8_t sub, std::vector<std::uint8_t>& bytes) const;
  /// Whether an SDO download of these bytes is allowed, and the value they mean. Nothing is written.
  [[nodiscard]] SdoAbort check_write(std::uint16_t index, std::uint8_t sub,
                                     std::span<const std::uint8_t> bytes, std::int64_t& value) const;

  /// Values at power-on, of the indices first..last.
  void restore_defaults(std::uint16_t first, std::uint16_t last);

  using Values = std::map<std::uint32_t, std::int64_t>;
  /// What "save" writes to the non-volatile memory: the values that can be written.
  [[nodiscard]] Values writable_values() const;
  void assign(const Values& values, std::uint16_t first, std::uint16_t last);

  template <class Visitor>
  void visit(Visitor&& visitor) const {
    for (const auto& [key, entry] : entries_) {
      visitor(static_cast<std::uint16_t>(key >> 8), static_cast<std::uint8_t>(key & 0xFF), entry);
    }
  }

 private:
  [[nodiscard]] SdoAbort missing(std::uint16_t index) const;

  std::map<std::uint32_t, ObjectEntry> entries_;  ///< by index << 8 | sub
};

/// The low `size` bytes of a value, least significant first.
void append_little_endian(std::vector<std::uint8_t>& bytes, std::int64_t value, std::size_t size);
/// Sign-extended for the integer types.
[[nodiscard]] std::int64_t decode_little_endian(std::span<const std::uint8_t> bytes, DataType type);

}  // namespace alces::sim
