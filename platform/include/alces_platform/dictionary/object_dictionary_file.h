// EDS and DCF files: the object dictionary of a CANopen device, as CiA 306 writes it. An EDS describes a type
// of device, a DCF one device as it was configured (its node number, and ParameterValues beside the
// DefaultValues).
//
// Read: [FileInfo]'s and [DeviceInfo]'s names, [DeviceComissioning]'s NodeID (spelt with one m or two), the
// objects [1018], [1018sub1], ..., CompactSubObj with its [1018Name] and [1018Value] lists, $NODEID in
// values, comments, CRLF, any case. Passed over: what else a section says (ObjFlags, limits, lists of
// supported objects, modules, dummies, CompactPDO). What is odd but harmless (a value that is no number, an
// object twice, an object without a type) becomes a warning; what is no EDS at all, a DictionaryError that
// names the line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace alces {

/// A file that cannot be read or is no EDS: one sentence with file, line and remedy.
class DictionaryError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct ObjectDescription {
  std::string name;  ///< ParameterName; of a sub-index its own name alone
  std::uint16_t data_type =
      0;               ///< CiA 301's number: 1 BOOLEAN ... 7 UNSIGNED32, 9 VISIBLE_STRING; 0: not told
  std::string access;  ///< ro, rw, wo, rwr, rww, const; lower case
  bool is_pdo_mappable = false;
  std::string default_value;  ///< as written, perhaps with $NODEID; empty: none
  std::string parameter_value;
  std::size_t line = 0;  ///< of the section that describes it, from 1
};

class ObjectDictionaryFile {
 public:
  /// DictionaryError.
  [[nodiscard]] static ObjectDictionaryFile read(const std::filesystem::path& file);
  /// `file` is for messages only.
  [[nodiscard]] static ObjectDictionaryFile parse(std::string_view text, const std::filesystem::path& file);

  /// An object without sub-indices is sub-index 0; nullptr: not in the file.
  [[nodiscard]] const ObjectDescription* find(std::uint16_t index, std::uint8_t sub) const;
  /// The name of the whole object, "" where the file has none.
  [[nodiscard]] std::string_view name(std::uint16_t index) const;
  /// ParameterValue, else DefaultValue, with this number for $NODEID; nothing where there is none or it is no
  /// number.
  [[nodiscard]] std::optional<std::int64_t> value(std::uint16_t index, std::uint8_t sub,
                                                  std::uint8_t node) const;

  [[nodiscard]] std::optional<std::uint8_t> node() const { return node_; }
  [[nodiscard]] const std::string& vendor() const { return vendor_; }
  [[nodiscard]] const std::string& product() const { return product_; }
  [[nodiscard]] std::size_t size() const { return objects_.size(); }
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  friend class ObjectDictionaryFileParser;

  std::map<std::uint32_t, ObjectDescription> objects_;  ///< by index << 8 | sub
  std::map<std::uint16_t, std::string> names_;          ///< of objects with sub-indices
  std::optional<std::uint8_t> node_;
  std::string vendor_;
  std::string product_;
  std::vector<std::string> warnings_;
};

/// A number as CiA 306 writes it: 10, 0x0A, 012 (octal), -10, and sums with $NODEID. Nothing when it is
/// something else.
[[nodiscard]] std::optional<std::int64_t> object_value(std::string_view text, std::uint8_t node);

}  // namespace alces
