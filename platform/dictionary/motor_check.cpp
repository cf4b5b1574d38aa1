#include "alces_platform/dictionary/motor_check.h"

#include <fmt/format.h>

#include <optional>

#include "alces_drivers/canopen/object_text.h"
#include "alces_drivers/motor/cia402.h"
#include "alces_drivers/motor/master_loss.h"
#include "alces_platform/settings/key_line.h"

namespace alces {
namespace {

using canopen::ObjectAddress;
using canopen::PdoDirection;

constexpr std::uint16_t error_behaviour_index = 0x1029;

/// Of CiA 301's basic types; 0: of no fixed size, or not told.
std::uint32_t bits_of(std::uint16_t data_type) {
  switch (data_type) {
    case 0x1:  // BOOLEAN: a bit in a PDO, a byte in an SDO
      return 1;
    case 0x2:
    case 0x5:
      return 8;
    case 0x3:
    case 0x6:
      return 16;
    case 0x10:
    case 0x16:
      return 24;
    case 0x4:
    case 0x7:
    case 0x8:
      return 32;
    case 0x12:
    case 0x18:
      return 40;
    case 0x13:
    case 0x19:
      return 48;
    case 0x14:
    case 0x1A:
      return 56;
    case 0x11:
    case 0x15:
    case 0x1B:
      return 64;
    default:
      return 0;
  }
}

std::uint32_t bytes_of(std::uint16_t data_type) {
  return (bits_of(data_type) + 7) / 8;
}

bool may_be_written(const ObjectDescription& object) {
  return object.access.empty() || object.access == "wo" || object.access.starts_with("rw");
}

bool may_be_read(const ObjectDescription& object) {
  return object.access != "wo";
}

/// Where in the configuration a complaint belongs.
struct Place {
  const char* key = "";
  std::optional<std::size_t> row;  ///< of a list
};

class MotorCheck {
 public:
  MotorCheck(const MotorConfig& motor, const std::filesystem::path& configuration, std::string_view text,
             const ObjectDictionaryFile& dictionary, const std::filesystem::path& dcf)
      : motor_(motor), configuration_(configuration), text_(text), dictionary_(dictionary), dcf_(dcf) {}

  std::vector<MotorFinding> run() {
    check_node();
    for (std::size_t row = 0; row < motor_.checks.size(); ++row) check_identity(row);
    check_writes("writes", motor_.writes);
    check_writes("watchdog_writes", motor_.watchdog_writes);
    check_mode();
    check_pdos("tpdos", motor_.tpdos, PdoDirection::from_node);
    check_pdos("rpdos", motor_.rpdos, PdoDirection::to_node);
    check_disabled("tpdos_to_disable", motor_.tpdos_to_disable, PdoDirection::from_node);
    check_disabled("rpdos_to_disable", motor_.rpdos_to_disable, PdoDirection::to_node);
    if (motor_.heartbeat_period_ms != 0)
      write({"heartbeat_period_ms", {}}, {canopen::heartbeat_producer_index, 0}, 2,
            "heartbeat_period_ms = 0 leaves it as it is");
    // What stops the drive where PDOs do not.
    read({"axis", {}}, {of_axis(cia402::statusword_index, motor_.axis), 0}, 2);
    read({"axis", {}}, {of_axis(cia402::velocity_index, motor_.axis), 0}, 4);
    write({"axis", {}}, {of_axis(cia402::controlword_index, motor_.axis), 0}, 2);
    check_master_loss();
    return std::move(findings_);
  }

 private:
  void find(bool is_error, const Place& place, const std::string& what,
            const ObjectDescription* object = nullptr) {
    const std::size_t line = place.row ? settings::row_line(text_, "motor", place.key, *place.row)
                                       : settings::key_line(text_, "motor", place.key);
    std::string sentence = configuration_.string();
    if (line != 0) sentence += fmt::format(":{}", line);
    sentence += fmt::format(": motor.{}{}: {}", place.key, line == 0 ? " (left out, so as usual)" : "", what);
    sentence += object != nullptr && object->line != 0 ? fmt::format(" ({}:{})", dcf_.string(), object->line)
                                                       : fmt::format(" ({})", dcf_.string());
    findings_.push_back({is_error, std::move(sentence)});
  }

  [[nodiscard]] std::string named(ObjectAddress at) const {
    const ObjectDescription* const object = dictionary_.find(at.index, at.subindex);
    std::string name(dictionary_.name(at.index));
    if (name.empty()) name = canopen::object_text(at.index);
    if (object != nullptr && !object->name.empty() && object->name != name) name += ", " + object->name;
    return fmt::format("0x{:04X}:{:02X} ({})", at.index, at.subindex, name);
  }

  /// Null, and told: the drive does not have it.
  const ObjectDescription* object_for(const Place& place, ObjectAddress at, const char* remedy = "") {
    const ObjectDescription* const object = dictionary_.find(at.index, at.subindex);
    if (object == nullptr)
      find(true, place,
           fmt::format("the drive has no {}{}{}", named(at), *remedy != '\0' ? "; " : "", remedy));
    return object;
  }

  void read(const Place& place, ObjectAddress at, std::uint32_t bytes) {
    const ObjectDescription* const object = object_for(place, at);
    if (object == nullptr) return;
    if (!may_be_read(*object)) find(true, place, named(at) + " cannot be read", object);
    check_size(place, at, bytes, *object);
  }

  void write(const Place& place, ObjectAddress at, std::uint32_t bytes, const char* remedy = "") {
    const ObjectDescription* const object = object_for(place, at, remedy);
    if (object == nullptr) return;
    if (!may_be_written(*object)) {
      find(true, place,
           fmt::format("{} cannot be written, it is {}{}{}", named(at), object->access,
                       *remedy != '\0' ? "; " : "", remedy),
           object);
    }
    check_size(place, at, bytes, *object);
  }

  void check_size(const Place& place, ObjectAddress at, std::uint32_t bytes,
                  const ObjectDescription& object) {
    const std::uint32_t own = bytes_of(object.data_type);
    if (bytes != 0 && own != 0 && own != bytes)
      find(true, place, fmt::format("{} has {} bytes, not {}", named(at), own, bytes), &object);
  }

  void check_node() {
    if (dictionary_.node() && *dictionary_.node() != motor_.node)
      find(true, {"node", {}},
           fmt::format("is {}, but the file describes node {}", motor_.node, *dictionary_.node()));
  }

  void check_identity(std::size_t row) {
    const canopen::ObjectCheck& check = *(motor_.checks.begin() + row);
    const Place place{"checks", row};
    read(place, check.address(), 0);
    const std::optional<std::int64_t> value = dictionary_.value(check.index, check.subindex, motor_.node);
    if (!value || *value == 0) return;  // serial numbers and the like are 0 in files of a type
    const auto bits = static_cast<std::uint32_t>(*value);
    if ((bits & check.mask) != (check.value & check.mask))
      find(false, place,
           fmt::format("{} is asked to be 0x{:X}, but is 0x{:X} in the file: is it of this drive?",
                       named(check.address()), check.value & check.mask, bits & check.mask),
           dictionary_.find(check.index, check.subindex));
  }

  template <class Writes>
  void check_writes(const char* key, const Writes& writes) {
    std::size_t row = 0;
    for (const canopen::ObjectWrite& object : writes) write({key, row++}, object.address(), object.size);
  }

  void check_mode() {
    const Place place{"writes_mode", {}};
    if (motor_.writes_mode)
      write(place, {of_axis(cia402::mode_index, motor_.axis), 0}, 1,
            "writes_mode = false leaves it as it is");
    if (motor_.verifies_mode)
      read({"verifies_mode", {}}, {of_axis(cia402::mode_display_index, motor_.axis), 0}, 1);
    const ObjectAddress modes{of_axis(cia402::supported_modes_index, motor_.axis), 0};
    const std::optional<std::int64_t> supported = dictionary_.value(modes.index, modes.subindex, motor_.node);
    constexpr std::int64_t profile_velocity = 1 << 2;
    if (supported && *supported != 0 && (*supported & profile_velocity) == 0)
      find(true, place,
           fmt::format("the drive has no profile velocity mode: {} is 0x{:X}, without bit 2", named(modes),
                       *supported),
           dictionary_.find(modes.index, modes.subindex));
  }

  template <class Pdos>
  void check_pdos(const char* key, const Pdos& pdos, PdoDirection direction) {
    std::size_t row = 0;
    for (const canopen::PdoConfig& pdo : pdos) {
      const Place place{key, row++};
      for (const canopen::ObjectWrite& object : canopen::writes_for(pdo, direction, motor_.node))
        check_pdo_write(place, object);
      if (pdo.keeps_mapping) check_kept_mapping(place, pdo, direction);
      for (const canopen::PdoEntry& entry : pdo.entries) check_entry(place, entry, direction);
    }
  }

  /// The same object is written more than once: told once.
  void check_pdo_write(const Place& place, const canopen::ObjectWrite& object) {
    const bool is_mapping = (object.index & 0x0200) != 0;  // 0x1600 and 0x1A00; 0x1400 and 0x1800 are not
    const bool comes_again =
        (is_mapping && object.subindex == 0 && object.value != 0) ||
        (!is_mapping && object.subindex == 1 && (object.value & canopen::pdo_is_disabled) == 0);
    if (comes_again) return;
    const char* remedy = "";
    if (is_mapping) remedy = "a mapping that is fixed: keeps_mapping = true";
    if (!is_mapping && object.subindex == 2) remedy = "fixed: keeps_transmission_type = true";
    write(place, object.address(), object.size, remedy);
  }

  void check_kept_mapping(const Place& place, const canopen::PdoConfig& pdo, PdoDirection direction) {
    const auto index = static_cast<std::uint16_t>(
        (direction == PdoDirection::from_node ? canopen::tpdo_mapping_index : canopen::rpdo_mapping_index) +
        pdo.number - 1);
    std::uint8_t subindex = 0;
    for (const canopen::PdoEntry& entry : pdo.entries) {
      const std::optional<std::int64_t> is = dictionary_.value(index, ++subindex, motor_.node);
      if (is && static_cast<std::uint32_t>(*is) != entry.mapping())
        find(true, place,
             fmt::format("keeps_mapping, but {} is 0x{:08X} and not 0x{:08X}", named({index, subindex}),
                         static_cast<std::uint32_t>(*is), entry.mapping()),
             dictionary_.find(index, subindex));
    }
  }

  void check_entry(const Place& place, const canopen::PdoEntry& entry, PdoDirection direction) {
    const ObjectAddress at{entry.index, entry.subindex};
    const ObjectDescription* const object = object_for(place, at);
    if (object == nullptr) return;
    const bool is_to_node = direction == PdoDirection::to_node;
    if (!object->is_pdo_mappable) {
      find(true, place, named(at) + " cannot be mapped into a PDO", object);
    } else if (is_to_node ? !may_be_written(*object) || object->access == "rwr"
                          : !may_be_read(*object) || object->access == "rww") {
      find(true, place,
           fmt::format("{} cannot travel {} the drive, it is {}", named(at), is_to_node ? "to" : "from",
                       object->access),
           object);
    }
    const std::uint32_t bits = bits_of(object->data_type);
    if (bits != 0 && bits != entry.bits)
      find(true, place, fmt::format("{} has {} bits, not {}", named(at), bits, entry.bits), object);
  }

  template <class Pdos>
  void check_disabled(const char* key, const Pdos& pdos, PdoDirection direction) {
    std::size_t row = 0;
    for (const canopen::PdoConfig& pdo : pdos) {
      const canopen::ObjectWrite object = canopen::write_that_disables(pdo, direction, motor_.node);
      write({key, row++}, object.address(), object.size, "a PDO that is not there need not be disabled");
    }
  }

  void check_master_loss() {
    const Place watched{"own_heartbeat_timeout_ms", {}};
    const bool has_watchdog = motor_.watchdog_writes.size() > 0;
    if (motor_.own_heartbeat_timeout_ms != 0)
      write(watched, {canopen::heartbeat_consumer_index, 1}, 4, "the drive cannot watch this computer");
    if (has_watchdog) return;  // what it does is its maker's affair
    if (motor_.own_heartbeat_timeout_ms == 0) {
      find(false, watched, fmt::format("is 0: {}", to_string(MasterLossReaction::none)));
      return;
    }
    const ObjectAddress option{of_axis(cia402::abort_connection_option_index, motor_.axis), 0};
    const ObjectDescription* const object = dictionary_.find(option.index, option.subindex);
    const Place place{"sets_master_loss_reaction", {}};
    const bool has_nmt_state = dictionary_.find(error_behaviour_index, 1) != nullptr;
    if (object == nullptr) {
      find(false, place,
           fmt::format("the drive has no {}{}: {}", named(option),
                       has_nmt_state ? ", only 0x1029, whose NMT state stops no shaft" : "",
                       to_string(MasterLossReaction::none)));
      return;
    }
    if (motor_.sets_master_loss_reaction && may_be_written(*object)) return;
    const std::int64_t code = dictionary_.value(option.index, option.subindex, motor_.node).value_or(0);
    if (code < 1 || code > 3)
      find(false, place,
           fmt::format("{} is {} and {}: {}", named(option), code,
                       motor_.sets_master_loss_reaction ? "cannot be written" : "is left so",
                       to_string(MasterLossReaction::none)),
           object);
  }

  const MotorConfig& motor_;
  const std::filesystem::path& configuration_;
  std::string_view text_;
  const ObjectDictionaryFile& dictionary_;
  const std::filesystem::path& dcf_;
  std::vector<MotorFinding> findings_;
};

}  // namespace

std::vector<MotorFinding> check_motor(const MotorConfig& motor, const std::filesystem::path& configuration,
                                      std::string_view text, const ObjectDictionaryFile& dictionary,
                                      const std::filesystem::path& dcf) {
  return MotorCheck(motor, configuration, text, dictionary, dcf).run();
}

}  // namespace alces
