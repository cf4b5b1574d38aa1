// The CiA 301 part of a simulated node, without its application: NMT slave with boot-up, heartbeat producer
// and consumer, node guarding, SYNC consumer, PDOs, SDO server, EMCY producer, "save" and "load" of
// parameters, and the ways in which a node misbehaves. Deterministic; it reads no clock: every call says what
// time it is, and times run forward.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "alces_drivers/can_frame.h"
#include "alces_platform/sim/motor/object_dictionary.h"
#include "alces_platform/sim/motor/pdo_engine.h"
#include "alces_platform/sim/motor/sdo_server.h"

namespace alces::sim {

enum class NmtState : std::uint8_t { initialising, pre_operational, operational, stopped };

struct CanopenSlaveConfig {
  std::uint8_t node = 1;               ///< 1..127
  std::int64_t boot_ns = 500'000'000;  ///< from power-on or a reset of the node to the boot-up message
  std::int64_t communication_reset_ns = 20'000'000;
  std::int64_t sdo_latency_ns = 1'000'000;  ///< from request to answer
  std::int64_t pdo_latency_ns = 300'000;    ///< from SYNC to the TPDO; its values are those of the SYNC
  std::int64_t cycle_ns = 1'000'000;        ///< how often event-driven TPDOs look for a change
  bool sends_acyclic_pdos = true;           ///< TPDOs of type 0
};

/// What the device does with its objects.
class CanopenApplication {
 public:
  /// Measured values into the dictionary: it is about to be read.
  virtual void refresh(std::int64_t now_ns) = 0;
  /// May this value be written? Type, access, limits and the rules of PDOs are good.
  [[nodiscard]] virtual SdoAbort check_write(std::uint16_t index, std::uint8_t sub, std::int64_t value) = 0;
  virtual void on_written(std::uint16_t index, std::uint8_t sub, std::int64_t value, std::int64_t now_ns) = 0;
  /// The node resets itself: outputs off.
  virtual void on_reset(std::int64_t now_ns) = 0;
  /// Initialisation is over; the dictionary holds its power-on values.
  virtual void on_booted(std::int64_t now_ns) = 0;
  /// A heartbeat that was consumed is gone.
  virtual void on_heartbeat_lost(std::int64_t now_ns) = 0;
  /// When it changes something by itself; INT64_MAX: never. advance() is called then, or later with the time
  /// it is.
  [[nodiscard]] virtual std::int64_t next_change_ns() const = 0;
  virtual void advance(std::int64_t now_ns) = 0;

 protected:
  ~CanopenApplication() = default;
};

class CanopenSlave final : private SdoObjects {
 public:
  struct Counters {
    std::uint64_t frames_ignored = 0;  ///< other nodes', or of a length or kind that means nothing here
    std::uint64_t rpdos = 0;           ///< taken
    std::uint64_t rpdos_too_short = 0;
    std::uint64_t rpdo_values_refused = 0;
    std::uint64_t syncs = 0;
    std::uint64_t sdo_requests = 0;
    std::uint64_t sdo_aborts = 0;
    std::uint64_t frames_sent = 0;
    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("frames_ignored", frames_ignored);
      visit("rpdos", rpdos);
      visit("rpdos_too_short", rpdos_too_short);
      visit("rpdo_values_refused", rpdo_values_refused);
      visit("syncs", syncs);
      visit("sdo_requests", sdo_requests);
      visit("sdo_aborts", sdo_aborts);
      visit("frames_sent", frames_sent);
    }
  };
  /// An SDO access that is refused, whatever the object says.
  struct ForcedAbort {
    std::uint16_t index;
    std::uint8_t sub;
    std::uint32_t code;
    std::uint32_t times;
  };

  CanopenSlave(const CanopenSlaveConfig& config, ObjectDictionary& objects, CanopenApplication& application);

  void power_on(std::int64_t now_ns);
  void power_off(std::int64_t now_ns);
  /// As NMT's reset node does, but by itself (watchdog, brown-out).
  void reset_node(std::int64_t now_ns);

  void on_frame(const CanFrame& frame, std::int64_t now_ns);
  /// The next frame that is on the wire by now, in order; false: none. At most one frame a call.
  [[nodiscard]] bool poll(std::int64_t now_ns, CanFrame& out);
  /// When something happens next by itself; INT64_MAX: never. Polling only at these times loses nothing.
  [[nodiscard]] std::int64_t next_event_ns() const;
  void advance(std::int64_t now_ns);

  /// EMCY with these manufacturer's bytes, into the error history (0x1003) and the error register (0x1001),
  /// in pre-operational and operational; 0x0000 clears.
  void send_emergency(std::uint16_t code, std::uint8_t error_register,
                      const std::array<std::uint8_t, 5>& manufacturer);

  [[nodiscard]] NmtState nmt_state() const { return nmt_state_; }
  [[nodiscard]] bool is_powered() const { return is_powered_; }
  [[nodiscard]] Counters counters() const;

  // Misbehaviour.
  void set_absent(bool is_absent) { is_absent_ = is_absent; }  ///< off the bus: hears and says nothing
  void set_heartbeat_silent(bool is_silent) { heartbeat_is_silent_ = is_silent; }
  void set_sdo_silent(bool is_silent) { sdo_is_silent_ = is_silent; }
  void set_pdo_silent(bool is_silent) { pdo_is_silent_ = is_silent; }
  void set_boot_ns(std::int64_t boot_ns) { config_.boot_ns = boot_ns; }
  void set_sdo_latency_ns(std::int64_t latency_ns) { config_.sdo_latency_ns = latency_ns; }
  void abort_sdo(const ForcedAbort& forced) { forced_aborts_.push_back(forced); }
  /// Every access is refused with this code; 0: no more.
  void abort_every_sdo(std::uint32_t code) { abort_of_all_ = code; }

 private:
  static constexpr std::int64_t never_ns = INT64_MAX;
  struct Due {
    std::int64_t at_ns;
    std::uint64_t order;
    CanFrame frame;
  };

  [[nodiscard]] SdoAbort read_object(std::uint16_t index, std::uint8_t sub,
                                     std::vector<std::uint8_t>& bytes) override;
  [[nodiscard]] SdoAbort write_object(std::uint16_t index, std::uint8_t sub,
                                      std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] SdoAbort write_value(std::uint16_t index, std::uint8_t sub, std::int64_t value);
  [[nodiscard]] SdoAbort save_or_load(std::uint16_t index, std::int64_t signature);
  [[nodiscard]] std::optional<SdoAbort> forced_abort(std::uint16_t index, std::uint8_t sub);
  void restore(std::uint16_t first, std::uint16_t last);
  void initialise(std::int64_t duration_ns);
  void boot();
  void enter(NmtState state);
  void on_nmt(std::uint8_t command);
  void on_sync();
  void on_sdo(const CanFrame& frame);
  void on_guarding();
  void on_foreign_heartbeat(std::uint8_t node);
  void heartbeat_lost();
  void apply(const std::vector<PdoEngine::Value>& values);
  void send(const CanFrame& frame, std::int64_t latency_ns);
  void send_byte(std::uint32_t id, std::uint8_t byte);
  void send_pdos(const std::vector<CanFrame>& frames, std::int64_t latency_ns);
  [[nodiscard]] std::int64_t next_internal_ns() const;
  [[nodiscard]] std::int64_t heartbeat_period_ns() const;
  [[nodiscard]] std::uint8_t heartbeat_byte() const;

  CanopenSlaveConfig config_;
  ObjectDictionary* objects_;
  CanopenApplication* application_;
  PdoEngine pdos_;
  SdoServer sdo_;
  ObjectDictionary::Values saved_;
  std::vector<ForcedAbort> forced_aborts_;
  std::uint32_t abort_of_all_ = 0;
  std::vector<Due> outbox_;
  Counters counters_;
  std::uint64_t order_ = 0;
  std::int64_t now_ns_ = 0;
  std::int64_t boot_due_ns_ = never_ns;
  std::int64_t heartbeat_due_ns_ = never_ns;
  std::int64_t consumer_due_ns_ = never_ns;
  std::int64_t cycle_due_ns_ = never_ns;
  NmtState nmt_state_ = NmtState::initialising;
  bool is_powered_ = false;
  bool boots_application_ = false;
  bool loads_defaults_ = false;
  bool guarding_toggle_ = false;
  bool is_absent_ = false;
  bool heartbeat_is_silent_ = false;
  bool sdo_is_silent_ = false;
  bool pdo_is_silent_ = false;
};

}  // namespace alces::sim
