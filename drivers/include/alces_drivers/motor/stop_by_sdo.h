// Stops a CiA 402 drive without PDOs: quick stop by SDO, disable voltage once the shaft stands, and reads of
// statusword and velocity until the drive has said twice in a row that it has no torque and that its velocity
// is 0. For a drive whose PDOs do not run: never configured, after a reset, after a cut cable.
//
// It goes on for as long as it is asked to; the caller decides when to give up. A transfer that fails is
// followed by the next one. Sources: CiA 402-2 (0x6040, 0x6041), CiA 402-3 (0x606C). O(1) a call, no memory.
#pragma once

#include <cstdint>

#include "alces_drivers/canopen/sdo_client.h"
#include "alces_drivers/motor/cia402.h"
#include "alces_drivers/stamp.h"

namespace alces {

class StopBySdo {
 public:
  struct Config {
    std::int32_t stall_velocity_units = 0;        ///< up to this a quick stop is over
    std::int64_t quick_stop_limit_ns = ns_per_s;  ///< then the voltage is taken away from a shaft that turns
    std::int64_t pause_ns = 10 * ns_per_ms;       ///< between two rounds of write and reads
    std::uint8_t axis = 0;
  };

  StopBySdo(const Config& config, canopen::SdoClient& sdo) : config_(config), sdo_(sdo) {}

  /// From the beginning; a transfer of others is cancelled.
  void begin(std::int64_t now_ns);
  /// The transfer under way is forgotten, and nothing more is sent.
  void cancel();
  /// After every call of the SDO client, and with every tick.
  void advance(std::int64_t now_ns);

  /// The drive has said so twice in a row; nothing more is sent.
  [[nodiscard]] bool is_confirmed() const { return confirmations_ >= confirmations_needed; }
  /// What the drive answered last; unknown: it has not answered since begin().
  [[nodiscard]] cia402::State state() const { return state_; }
  [[nodiscard]] bool has_velocity() const { return has_velocity_; }
  [[nodiscard]] std::int32_t velocity_units() const { return velocity_units_; }

 private:
  static constexpr std::uint8_t confirmations_needed = 2;
  enum class Step : std::uint8_t { command, read_statusword, read_velocity };

  void take_response(std::int64_t now_ns);
  void begin_step(std::int64_t now_ns);
  /// False: this state needs none.
  [[nodiscard]] bool needs_command(std::uint16_t& controlword, std::int64_t now_ns) const;

  Config config_;
  canopen::SdoClient& sdo_;
  bool is_active_ = false;
  bool is_begun_ = false;  ///< the step's transfer
  Step step_ = Step::command;
  std::int64_t quick_stop_since_ns_ = no_stamp_ns;  ///< a command was taken
  std::int64_t due_ns_ = 0;
  cia402::State state_ = cia402::State::unknown;
  bool is_statusword_fresh_ = false;  ///< of this round
  bool has_velocity_ = false;
  std::int32_t velocity_units_ = 0;
  std::uint8_t confirmations_ = 0;
};

}  // namespace alces
