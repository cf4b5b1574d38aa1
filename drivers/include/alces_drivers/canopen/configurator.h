// Walks a list of objects: each is written, or read and compared, by one SDO transfer after the other.
//
// A COB-ID of an RPDO that the node refuses is written once more with bit 30 the other way round: that bit
// means nothing in an RPDO, and some makers insist on theirs.
#pragma once

#include <cstdint>
#include <span>

#include "alces_drivers/canopen/object.h"
#include "alces_drivers/canopen/sdo_client.h"

namespace alces::canopen {

struct ConfigurationStep {
  enum class Kind : std::uint8_t { write, check };

  Kind kind = Kind::write;
  std::uint8_t size = 0;  ///< of a write
  ObjectAddress object;
  std::uint32_t value = 0;
  std::uint32_t mask = 0xFFFFFFFF;  ///< of a check

  [[nodiscard]] static ConfigurationStep write(const ObjectWrite& write) {
    return {Kind::write, write.size, write.address(), write.value, 0xFFFFFFFF};
  }
  [[nodiscard]] static ConfigurationStep check(const ObjectCheck& check) {
    return {Kind::check, 0, check.address(), check.value, check.mask};
  }
};

class Configurator {
 public:
  enum class Status : std::uint8_t {
    idle,
    busy,
    done,
    transfer_failed,  ///< the SDO client's status says how
    value_differs,    ///< a check found found_value()
  };

  explicit Configurator(SdoClient& sdo) : sdo_(sdo) {}

  /// The steps are the caller's and stay where they are until the end.
  void start(std::span<const ConfigurationStep> steps, std::int64_t now_ns);
  void cancel();
  /// After every call of the SDO client that may have brought its transfer to an end.
  void advance(std::int64_t now_ns);

  [[nodiscard]] Status status() const { return status_; }
  [[nodiscard]] std::size_t steps_done() const { return step_; }
  /// The one under way, or that failed.
  [[nodiscard]] ConfigurationStep step() const {
    return step_ < steps_.size() ? steps_[step_] : ConfigurationStep{};
  }
  [[nodiscard]] std::uint32_t found_value() const { return found_value_; }

 private:
  void begin_step(std::int64_t now_ns);

  SdoClient& sdo_;
  std::span<const ConfigurationStep> steps_;
  std::size_t step_ = 0;
  Status status_ = Status::idle;
  bool is_begun_ = false;           ///< the step's transfer
  std::uint32_t flipped_bits_ = 0;  ///< of the step's value, in its second attempt
  std::uint32_t found_value_ = 0;
};

}  // namespace alces::canopen
