// A motor drive on the simulated CAN bus: a CANopen slave (CiA 301) with CiA 402 profile velocity mode, that
// behaves like a Trinamic TMCM-1636, a maxon EPOS4 or a Technosoft iPOS, and can be made to fail in the ways
// that drives fail. Frames go in with the time they were on the bus; frames come out when they are due. The
// shaft turns in closed form, so that its position can be asked for any time, to the nanosecond: that is the
// ground truth of the scanner's head.
//
//   SimulatedCia402Drive drive({.model = SimulatedCia402Drive::Model::tmcm1636});
//   drive.power_on(0);
//   ...on_frame(request, now_ns); while (drive.poll(now_ns, frame)) bus.send(frame);
//
// Sources: CiA 301 4.2, CiA 402-2, the EDS files of both devices, and a recorded bring-up of a TMCM-1636.
// What is not there: other modes than profile velocity (accepted, but the motor stands still), block SDO,
// remote PDOs, SDO and PDO of more than one master, torque.
#pragma once

#include <array>
#include <cstdint>

#include "alces_platform/sim/motor/canopen_slave.h"
#include "alces_platform/sim/motor/cia402_axis.h"
#include "alces_platform/sim/motor/drive_objects.h"

namespace alces::sim {

class SimulatedCia402Drive final : private CanopenApplication {
 public:
  enum class Model : std::uint8_t { tmcm1636, epos4, ipos };

  struct Config {
    Model model = Model::tmcm1636;
    CanopenSlaveConfig slave = {};  ///< node, latencies, boot time
    Cia402AxisConfig axis = {};     ///< encoder, units, friction
    double motor_turns_per_head_turn = 1;
  };

  enum class Clearing : std::uint8_t {
    by_reset,  ///< the cause is gone: the next fault reset succeeds
    never,     ///< fault resets are answered by the same EMCY, until remove_fault_cause() or power off
  };

  /// Powered off, until power_on().
  explicit SimulatedCia402Drive(const Config& config);
  SimulatedCia402Drive(const SimulatedCia402Drive&) = delete;
  SimulatedCia402Drive& operator=(const SimulatedCia402Drive&) = delete;

  void power_on(std::int64_t now_ns) { slave_.power_on(now_ns); }
  void power_off(std::int64_t now_ns) { slave_.power_off(now_ns); }
  /// It restarts by itself: parameters at power-on values, the shaft coasts, boot-up message after the boot
  /// time.
  void reset(std::int64_t now_ns) { slave_.reset_node(now_ns); }

  /// A frame on the bus; others' frames do no harm. Times never run backwards.
  void on_frame(const CanFrame& frame, std::int64_t now_ns) { slave_.on_frame(frame, now_ns); }
  /// One frame that is on the bus by now; call until it says false.
  [[nodiscard]] bool poll(std::int64_t now_ns, CanFrame& out) { return slave_.poll(now_ns, out); }
  /// When the drive does something next by itself; INT64_MAX: only when asked.
  [[nodiscard]] std::int64_t next_event_ns() const { return slave_.next_event_ns(); }

  /// The motor's shaft, continuous, in counts of 0x6064, 0 at the beginning; for about the last 500 changes
  /// of speed and, as far as is planned, ahead.
  [[nodiscard]] double shaft_counts_at(std::int64_t at_ns) const { return axis_.shaft_counts_at(at_ns); }
  [[nodiscard]] double head_turns_at(std::int64_t at_ns) const;
  [[nodiscard]] double head_turns_per_s_at(std::int64_t at_ns) const;

  [[nodiscard]] Cia402State state() const { return axis_.state(); }
  [[nodiscard]] NmtState nmt_state() const { return slave_.nmt_state(); }
  [[nodiscard]] CanopenSlave::Counters counters() const { return slave_.counters(); }
  /// For tests, and for devices that differ: objects added here are there from now on.
  [[nodiscard]] ObjectDictionary& objects() { return objects_; }

  // Faults. What the bus does to frames (loss, delay, repetition) is the bus's, not the drive's.
  void raise_fault(std::uint16_t code, std::int64_t now_ns, Clearing clearing = Clearing::by_reset);
  void remove_fault_cause() { axis_.remove_cause(); }
  /// The shaft is held: speed 0 though commanded; it accelerates again when let go.
  void set_stalled(bool is_stalled, std::int64_t now_ns);
  /// An EMCY that changes no state: a warning.
  void send_emergency(std::uint16_t code, std::int64_t now_ns);
  void set_absent(bool is_absent) { slave_.set_absent(is_absent); }
  void set_heartbeat_silent(bool is_silent) { slave_.set_heartbeat_silent(is_silent); }
  void set_sdo_silent(bool is_silent) { slave_.set_sdo_silent(is_silent); }
  void set_pdo_silent(bool is_silent) { slave_.set_pdo_silent(is_silent); }
  void set_boot_ns(std::int64_t boot_ns) { slave_.set_boot_ns(boot_ns); }
  void set_sdo_latency_ns(std::int64_t latency_ns) { slave_.set_sdo_latency_ns(latency_ns); }
  void abort_sdo(std::uint16_t index, std::uint8_t sub, std::uint32_t code, std::uint32_t times = 1) {
    slave_.abort_sdo({index, sub, code, times});
  }
  /// Every access is refused with this code; 0: no more.
  void abort_every_sdo(std::uint32_t code) { slave_.abort_every_sdo(code); }

 private:
  void refresh(std::int64_t now_ns) override { axis_.refresh(now_ns); }
  [[nodiscard]] SdoAbort check_write(std::uint16_t index, std::uint8_t sub, std::int64_t value) override;
  void on_written(std::uint16_t index, std::uint8_t sub, std::int64_t value, std::int64_t now_ns) override;
  void on_reset(std::int64_t now_ns) override;
  void on_booted(std::int64_t now_ns) override;
  void on_heartbeat_lost(std::int64_t now_ns) override;
  [[nodiscard]] std::int64_t next_change_ns() const override { return axis_.next_event_ns(); }
  void advance(std::int64_t now_ns) override { axis_.advance(now_ns); }

  void report_fault();

  Config config_;
  ObjectDictionary objects_;
  Cia402Axis axis_;
  CanopenSlave slave_;
  std::uint16_t fault_code_ = 0;
};

}  // namespace alces::sim
