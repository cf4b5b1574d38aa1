// The motor that turns the head: a CiA 402 drive in profile velocity mode behind CANopen, brought up,
// watched, brought back and stopped in order.
//
//   start: reset ─> boot-up ─> checks, writes, mode, PDOs, heartbeats by SDO ─> NMT start ─> (fault reset) ─>
//          operation enabled ─> mode verified ─> target velocity ─> at speed
//   stop:  target 0 ─> stands ─> shutdown ─> disable voltage ─> no torque, speed 0 ─> NMT pre-operational
//          where PDOs do not run: NMT pre-operational ─> quick stop by SDO ─> no torque, speed 0 read by SDO
//
// Stopped is said only of a drive that answered with a state without torque and speed 0. One that does not is
// asked again and again, also across a cable that is cut and comes back, and in the end the state is
// unconfirmed.
//
// What goes wrong is a failure with a reason: the shaft is stopped (quick stop) and, after a delay that
// doubles, the drive is enabled again (fault, speed) or everything is begun anew (communication). After
// attempt_limit failures in a row the state is failed: the drive is disabled, and stays so whatever comes
// (boot-up, bus), until a person resets it: reset() or, where a permit is asked for, a new permit. A
// node that starts anew in mid-drive is configured and run again at once, which counts as a failure. A node
// that comes late is taken when its boot-up message comes. A bus that is down is waited for, and is nobody's
// failure.
//
// Without a permit (permit.h) the drive is disabled and the state is held; a permit that goes stops the head
// by quick stop.
//
// Sends SYNC (unless another does) and, after each SYNC, the RPDOs; without SYNC the RPDOs every
// control_period_ns. So a lost frame in either direction costs one period. Frames that the port does not take
// are tried again or replaced by the next period's, and counted.
//
// Sources: CiA 301 version 4.2; CiA 402-2 and -3 (IEC 61800-7-201). Works behind a canopen::Master or alone,
// fed with all frames of the bus. Memory: about 7 KiB, most of it the configuration and the SDO steps made
// from it. Every call is O(1) in time.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "alces_drivers/canopen/configurator.h"
#include "alces_drivers/canopen/emcy.h"
#include "alces_drivers/canopen/heartbeat.h"
#include "alces_drivers/canopen/master.h"
#include "alces_drivers/canopen/nmt.h"
#include "alces_drivers/canopen/sdo_client.h"
#include "alces_drivers/canopen/sync.h"
#include "alces_drivers/motor/drive_feedback.h"
#include "alces_drivers/motor/master_loss.h"
#include "alces_drivers/motor/motor_config.h"
#include "alces_drivers/motor/motor_state.h"
#include "alces_drivers/motor/permit.h"
#include "alces_drivers/motor/process_data.h"
#include "alces_drivers/motor/speed_supervisor.h"
#include "alces_drivers/motor/stop_by_sdo.h"
#include "alces_drivers/notice_rate_limiter.h"
#include "alces_drivers/port/can_port.h"
#include "alces_drivers/port/notice_port.h"

namespace alces {

class Motor final : public canopen::NodeDriver {  // NOLINT(cppcoreguidelines-virtual-class-destructor): final
 public:
  struct Counters {
    std::uint64_t starts = 0;            ///< start() that began something
    std::uint64_t failures = 0;          ///< all kinds
    std::uint64_t failures_final = 0;    ///< times in state failed
    std::uint64_t node_resets = 0;       ///< boot-up messages that we had not asked for
    std::uint64_t drive_faults = 0;      ///< CiA 402 faults that stopped the drive
    std::uint64_t fault_resets = 0;      ///< rising edges of the controlword's bit 7
    std::uint64_t speed_deviations = 0;  ///< that lasted
    std::uint64_t stops_by_sdo = 0;      ///< stops that PDOs could not bring to an end
    std::uint64_t stops_unconfirmed = 0;
    std::uint64_t resets_by_person = 0;
    std::uint64_t holds = 0;           ///< times without a permit
    std::uint64_t emcys = 0;           ///< errors, not their resets
    std::uint64_t emcys_not_told = 0;  ///< the same one again within a second: no notice
    std::uint64_t emcys_malformed = 0;
    std::uint64_t link_downs = 0;
    std::uint64_t clock_steps = 0;  ///< time ran back by more than clock_step_ns
    std::uint64_t nmt_orders = 0;
    std::uint64_t nmt_not_taken = 0;  ///< by the port; sent again
    std::uint64_t rpdos_sent = 0;
    std::uint64_t rpdos_not_taken = 0;            ///< by the port; the next period's replaces them
    std::uint64_t frames_foreign = 0;             ///< of other nodes
    std::uint64_t frames_not_canopen = 0;         ///< extended, remote, FD
    std::uint64_t error_frames = 0;               ///< the kernel's reports
    std::uint64_t pdos_before_configuration = 0;  ///< of a mapping we do not know; ignored
    std::uint64_t heartbeats_not_taken = 0;       ///< our own
    canopen::SdoClient::Counters sdo;
    canopen::HeartbeatConsumer::Counters heartbeat;
    canopen::SyncProducer::Counters sync;
    ProcessData::Counters pdo;
    Permit::Counters permit;

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("motor_starts", starts);
      visit("motor_failures", failures);
      visit("motor_failures_final", failures_final);
      visit("node_resets", node_resets);
      visit("drive_faults", drive_faults);
      visit("fault_resets", fault_resets);
      visit("speed_deviations", speed_deviations);
      visit("stops_by_sdo", stops_by_sdo);
      visit("stops_unconfirmed", stops_unconfirmed);
      visit("resets_by_person", resets_by_person);
      visit("motor_holds", holds);
      visit("emcys", emcys);
      visit("emcys_not_told", emcys_not_told);
      visit("emcys_malformed", emcys_malformed);
      visit("link_downs", link_downs);
      visit("clock_steps", clock_steps);
      visit("nmt_orders", nmt_orders);
      visit("nmt_not_taken", nmt_not_taken);
      visit("rpdos_sent", rpdos_sent);
      visit("rpdos_not_taken", rpdos_not_taken);
      visit("frames_foreign", frames_foreign);
      visit("frames_not_canopen", frames_not_canopen);
      visit("error_frames", error_frames);
      visit("pdos_before_configuration", pdos_before_configuration);
      visit("own_heartbeats_not_taken", heartbeats_not_taken);
      sdo.visit(visit);
      heartbeat.visit(visit);
      sync.visit(visit);
      pdo.visit(visit);
      permit.visit(visit);
    }
  };

  /// The configuration is copied. One that check() refuses makes a motor that start() brings to `failed`.
  Motor(const MotorConfig& config, CanPort& port, NoticePort& notices, DriveFeedbackSink& sink);

  /// Brings the motor up and keeps it up until stop(). Nothing happens when it is under way already.
  void start(std::int64_t now_ns);
  /// Ends it in order; on_tick() and on_frame() go on until has_ended(): at most stop_limit_ns().
  void stop(std::int64_t now_ns);
  /// The same, with the drive's quick stop instead of its ramp.
  void quick_stop(std::int64_t now_ns);

  /// A person lets a motor that was given up begin anew. Not where a permit is asked for: a new one does.
  void reset(std::int64_t now_ns);
  /// The machine was suspended: a permit has to be given anew.
  void on_resumed(std::int64_t now_ns);
  /// The permit's sources beside CAN.
  void on_edge(const GpioEdge& edge, std::int64_t stamp_ns);
  void on_edges_lost(std::uint8_t line, std::int64_t stamp_ns);
  void on_permit(bool is_given, std::int64_t stamp_ns);

  void on_frame(const CanFrame& frame, std::int64_t received_ns) override;
  /// A SYNC of ours left at this time: the time of the positions that follow. Without it SYNC's time is when
  /// it was queued.
  void on_sync_sent(std::int64_t stamp_ns);
  /// The bus came up, or went down (interface down, bus-off). It is taken to be up until told.
  void on_link(bool is_up, std::int64_t now_ns) override;
  /// At least every 20 ms, and by next_sync_ns() for SYNCs in time.
  void on_tick(std::int64_t now_ns) override;

  /// no_stamp_ns: no SYNC of ours is due.
  [[nodiscard]] std::int64_t next_sync_ns() const {
    std::int64_t due_ns = sync_.due_ns();
    shift_stamp(due_ns, -ahead_ns_);
    return due_ns;
  }
  /// What it listens to: for canopen::Master::add().
  [[nodiscard]] std::span<const std::uint16_t> cob_ids() const { return cob_ids_.span(); }

  /// How long a stop takes at the most: ramp, quick stop, transitions, then the same by SDO.
  [[nodiscard]] static std::int64_t stop_limit_ns(const MotorConfig& config) {
    return 3 * config.stop_timeout_ns + config.transition_timeout_ns + config.stop_confirm_timeout_ns;
  }
  /// Nothing is sent any more: stopped, or unconfirmed.
  [[nodiscard]] bool has_ended() const {
    return state_ == MotorState::stopped || state_ == MotorState::unconfirmed;
  }

  [[nodiscard]] MotorState state() const { return state_; }
  [[nodiscard]] MotorReason reason_code() const { return reason_; }
  /// Why it is in this state, for people.
  [[nodiscard]] const char* reason() const { return to_string(reason_); }
  /// More about the reason: the meaning of an abort or error code, of a bad configuration; "" where there is
  /// none.
  [[nodiscard]] const char* detail() const { return detail_; }
  /// A fresh PDO says that the shaft moves.
  [[nodiscard]] bool is_turning() const;
  /// What the drive says of itself; unknown without PDOs.
  [[nodiscard]] cia402::State drive_state() const { return process_data_.state(); }
  /// The last that it said, by PDO, or by SDO while it was stopped that way; it may be old.
  [[nodiscard]] cia402::State last_drive_state() const {
    const bool is_by_sdo = stop_by_sdo_.state() != cia402::State::unknown;
    return is_by_sdo ? stop_by_sdo_.state() : process_data_.state();
  }
  /// What the drive does when nobody commands it; unknown until it was asked.
  [[nodiscard]] MasterLossReaction master_loss_reaction() const { return master_loss_.reaction(); }
  [[nodiscard]] std::uint32_t failures_in_a_row() const { return attempts_; }
  [[nodiscard]] Counters counters() const;

 private:
  enum class Recovery : std::uint8_t { enable_again, begin_anew };
  enum class StopPhase : std::uint8_t { ramp_down, quick, disable, by_sdo };

  // motor.cpp: events in, frames and notices out
  void enter(MotorState state, MotorReason reason, const char* detail = "");
  void tell(Severity severity, const char* text) { tell(severity, text, 0, false); }
  void tell(Severity severity, const char* text, std::int64_t value, bool has_value = true);
  void tell_hexadecimal(const char* text, std::int64_t value);
  void order(canopen::NmtCommand command);
  void send_pending_order();
  void on_sync_cycle(std::int64_t now_ns);
  [[nodiscard]] std::uint16_t next_controlword();
  [[nodiscard]] std::uint16_t quick_stop_controlword() const;
  void ramp(std::int64_t now_ns);
  void watch_echoes();
  void hand_on_feedback();
  void on_emcy(const CanFrame& frame);
  void on_heartbeat(canopen::HeartbeatEvent event);
  void on_drive(std::int64_t stamp_ns);
  void step();
  [[nodiscard]] bool is_standing() const;
  [[nodiscard]] bool are_pdos_late() const;
  [[nodiscard]] bool is_velocity_fresh() const;
  [[nodiscard]] bool is_driving() const;

  // motor_bring_up.cpp
  void build_steps();
  void begin_anew();
  void begin_configuring();
  void begin_cycle();
  void on_sdo();
  void configuration_failed();
  void begin_enabling();
  void step_enabling();
  void begin_ramping();
  void on_mode_read();
  void find_out_master_loss();
  void on_error_code_read();
  void step_ramping();
  void step_running();
  [[nodiscard]] bool is_drive_well();

  // motor_recovery.cpp
  void on_boot_up();
  void on_node_state();
  void fail(MotorReason reason, Recovery recovery, const char* detail = "");
  void begin_stop(StopPhase phase, MotorReason reason);
  void step_stopping();
  void begin_stop_phase(StopPhase phase);
  void step_recovering();
  void step_failed();

  // motor_permit.cpp: disabled, for want of a permit or for good
  void obey_permit();
  void hold(MotorReason reason);
  void step_held();
  void keep_disabled_by_sdo();
  void tell_disabled();
  [[nodiscard]] bool is_stop_seen() const;
  void step_stop_by_sdo();
  void finish_stop(bool is_confirmed);
  void leave_cycle();

  static constexpr std::size_t maximum_steps =
      MotorConfig::maximum_checks + MotorConfig::maximum_writes + MotorConfig::maximum_watchdog_writes + 3 +
      2 * MotorConfig::maximum_pdos * (canopen::PdoConfig::maximum_writes + 1);

  MotorConfig config_;
  MotorConfigStatus config_status_;
  CanPort& port_;
  enum class NoticeKind : std::uint8_t { drive_warns, count };

  NoticePort& notices_;
  NoticeRateLimiter<NoticeKind> notice_limiter_;  ///< what the drive itself may say again and again
  DriveFeedbackSink& sink_;
  canopen::SdoClient sdo_;
  canopen::Configurator configurator_;
  StopBySdo stop_by_sdo_;
  MasterLoss master_loss_;
  canopen::HeartbeatConsumer heartbeat_;
  canopen::HeartbeatProducer own_heartbeat_;
  canopen::SyncProducer sync_;
  ProcessData process_data_;
  SpeedSupervisor speed_;
  Permit permit_;
  StaticVector<canopen::ConfigurationStep, maximum_steps> steps_;
  StaticVector<std::uint16_t, MotorConfig::maximum_pdos + 5> cob_ids_;

  MotorState state_ = MotorState::stopped;
  MotorReason reason_ = MotorReason::not_started;
  const char* detail_ = "";
  std::int64_t now_ns_ = 0;         ///< the latest time we were told; it never goes back
  std::int64_t ahead_ns_ = 0;       ///< of all times in here against those outside: the sum of steps back
  std::uint32_t ticks_behind_ = 0;  ///< in a row
  std::int64_t state_since_ns_ = 0;
  std::int64_t due_ns_ = no_stamp_ns;  ///< of recovering and failed: when to try again; no_stamp_ns: never
  bool is_link_up_ = true;
  bool is_configured_ = false;  ///< the PDOs are ours
  bool is_cyclic_ = false;      ///< RPDOs (and SYNC) go out
  bool is_node_heard_ = false;  ///< in this bring-up, by boot-up message, heartbeat or SDO
  bool has_booted_ = false;     ///< in this bring-up
  Recovery recovery_ = Recovery::begin_anew;
  std::uint32_t attempts_ = 0;  ///< failures in a row
  std::optional<canopen::NmtCommand> pending_order_;

  // The cycle.
  std::int64_t cyclic_since_ns_ = no_stamp_ns;
  std::int64_t last_cycle_ns_ = no_stamp_ns;
  double commanded_velocity_units_ = 0;
  std::uint16_t beats_without_echo_ = 0;
  bool is_echo_told_ = false;
  bool is_master_loss_told_ = false;  ///< since start()

  // Enabling and faults.
  cia402::State seen_state_ = cia402::State::unknown;
  std::int64_t seen_state_since_ns_ = 0;
  std::uint8_t reset_cycles_ = 0;  ///< of controlword 0 before the rising edge
  bool was_fault_reset_ = false;   ///< in this enabling
  std::uint8_t enable_cycles_ =
      0;  ///< of controlword "enable operation" in a row, while the drive is enabled
  bool is_reading_mode_ = false;
  bool is_reading_error_code_ = false;
  StopPhase stop_phase_ = StopPhase::ramp_down;
  std::int64_t stop_phase_since_ns_ = 0;
  std::uint64_t permits_seen_ = 0;  ///< edges of the permit that were acted upon
  bool is_disabled_told_ = false;   ///< of held and failed: the drive said so
  std::uint8_t still_cycles_ = 0;   ///< PDOs in a row that showed no torque and speed 0, in this phase

  std::uint16_t last_emcy_code_ = 0;  ///< 0: none, or reset
  std::int64_t last_emcy_told_ns_ = no_stamp_ns;
  std::uint16_t told_emcy_code_ = 0;
  bool is_warning_told_ = false;
  Counters counters_;
};

}  // namespace alces
