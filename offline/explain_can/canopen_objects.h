// Names of CANopen objects and their values in words: from a device's EDS or DCF where there is one, else
// from what CiA 301 and CiA 402 define.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "alces_platform/dictionary/object_dictionary_file.h"

namespace alces::offline {

using ObjectBytes = std::span<const std::uint8_t>;

class CanopenObjects {
 public:
  /// `file` may be nullptr and must outlive this.
  explicit CanopenObjects(const ObjectDictionaryFile* file) : file_(file) {}

  /// "0x1018:1 Identity Object: Vendor Id"; an object without sub-indices has no ":0".
  [[nodiscard]] std::string title(std::uint16_t index, std::uint8_t sub) const;
  /// "Statusword", without its number where it has a name.
  [[nodiscard]] std::string name(std::uint16_t index, std::uint8_t sub) const;
  /// CiA 301's number of the type, 0: not known.
  [[nodiscard]] std::uint16_t data_type(std::uint16_t index, std::uint8_t sub) const;
  /// What the bytes mean. `mode`: 0x6061 as last seen, for the statusword's bits that depend on it.
  [[nodiscard]] std::string words(std::uint16_t index, std::uint8_t sub, ObjectBytes bytes,
                                  std::optional<int> mode = std::nullopt) const;

 private:
  const ObjectDictionaryFile* file_;
};

/// Little-endian, sign-extended where the type is signed; at most 8 bytes.
[[nodiscard]] std::int64_t object_number(ObjectBytes bytes, std::uint16_t data_type);

/// The state of CiA 402 in a statusword: "fault"; "no state of CiA 402" for what is none.
[[nodiscard]] const char* drive_state_text(unsigned statusword);
[[nodiscard]] bool is_drive_fault(unsigned statusword);
[[nodiscard]] std::string statusword_text(unsigned statusword, std::optional<int> mode);
[[nodiscard]] std::string controlword_text(unsigned controlword);
[[nodiscard]] std::string error_register_text(unsigned error_register);

}  // namespace alces::offline
