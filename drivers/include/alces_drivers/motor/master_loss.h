// What does the drive do when nobody commands it any more: program killed, computer without power, cable cut?
// Found out by SDO while the drive is brought up, and set where the drive lets it be set:
//
//   0x1016:1  consumer heartbeat time: does it watch us at all?
//   0x6007    abort connection option code (CiA 402): 0 nothing, 1 fault, 2 disable voltage, 3 quick stop
//   0x1029:1  error behaviour (CiA 301): the NMT state that follows; that alone stops no shaft
//
// A maker's own watchdog is objects of `watchdog_writes`; nothing here can tell what it does. Transfers use
// an SDO client that others use, too: pause() gives it free, and the transfer under way is begun again.
// O(1) a call.
#pragma once

#include <cstdint>

#include "alces_drivers/canopen/sdo_client.h"

namespace alces {

enum class MasterLossReaction : std::uint8_t {
  unknown,          ///< not asked yet, or it did not answer
  none,             ///< the shaft turns on
  fault,            ///< fault reaction (0x605E), then fault
  disable_voltage,  ///< the shaft coasts
  quick_stop,       ///< quick stop (0x605A, 0x6085)
  by_maker,         ///< a watchdog of the maker's was configured
};
/// A sentence for people; static storage.
[[nodiscard]] const char* to_string(MasterLossReaction reaction);
/// Somebody has to think of the hardware: the shaft is not known to stop by itself.
[[nodiscard]] constexpr bool is_unsafe(MasterLossReaction reaction) {
  return reaction == MasterLossReaction::unknown || reaction == MasterLossReaction::none;
}

class MasterLoss {
 public:
  struct Config {
    bool is_watched = false;  ///< own_heartbeat_timeout_ms was written to 0x1016:1
    bool has_makers_watchdog = false;
    bool sets_reaction = true;  ///< quick stop into 0x6007; or disable voltage, or fault, if it refuses
    std::uint8_t axis = 0;
  };

  MasterLoss(const Config& config, canopen::SdoClient& sdo) : config_(config), sdo_(sdo) {}

  void begin();
  /// Somebody else needs the client.
  void pause();
  /// After every call of the SDO client, and with every tick, while nobody else uses it.
  void advance(std::int64_t now_ns);

  [[nodiscard]] bool is_done() const { return step_ == Step::done; }
  [[nodiscard]] MasterLossReaction reaction() const { return reaction_; }

 private:
  enum class Step : std::uint8_t { read_consumer, read_option, write_option, done };

  void take_response();
  void finish(MasterLossReaction reaction);

  Config config_;
  canopen::SdoClient& sdo_;
  Step step_ = Step::done;
  bool is_begun_ = false;
  std::uint16_t wanted_option_ = 0;
  MasterLossReaction reaction_ = MasterLossReaction::unknown;
};

}  // namespace alces
