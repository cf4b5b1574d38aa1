// The keys of [motor]: a drive as data.
#pragma once

#include "alces_drivers/motor/motor_config.h"
#include "quantities.h"

namespace alces::settings {

struct VisitObjectWrite {
  template <typename Row, typename Visitor>
  void operator()(Row& write, Visitor& visit) const {
    visit.need({"index", "bytes", "value"});
    visit.hex("index", write.index, 0xFFFF, "");
    visit.number("subindex", write.subindex, 0, 255, "");
    visit.number("bytes", write.size, 1, 4, "");
    visit.number("value", write.value, -2147483648.0, 4294967295.0, "");  // a negative one: two's complement
    if constexpr (!std::is_const_v<Row>) {
      const auto value = static_cast<std::int32_t>(write.value);
      const std::int64_t span = std::int64_t{1} << (8 * write.size);
      visit.expect(write.value < span || (value < 0 && value >= -span / 2), "value",
                   "value does not fit into that many bytes");
      if (write.size < 4) write.value &= static_cast<std::uint32_t>(span - 1);
    }
  }
};

struct VisitObjectCheck {
  template <typename Row, typename Visitor>
  void operator()(Row& check, Visitor& visit) const {
    visit.need({"index", "value"});
    visit.hex("index", check.index, 0xFFFF, "");
    visit.number("subindex", check.subindex, 0, 255, "");
    if (visit.wants("mask", check.mask != 0xFFFFFFFF)) visit.hex("mask", check.mask, 4294967295.0, "");
    visit.hex("value", check.value, 4294967295.0, "");
  }
};

struct VisitPdoEntry {
  template <typename Row, typename Visitor>
  void operator()(Row& entry, Visitor& visit) const {
    visit.need({"index", "bits"});
    visit.hex("index", entry.index, 0xFFFF, "");
    visit.number("subindex", entry.subindex, 0, 255, "");
    visit.number("bits", entry.bits, 1, 32, "");
  }
};

/// What says which PDO is meant.
struct VisitPdoIdentity {
  template <typename Row, typename Visitor>
  void operator()(Row& pdo, Visitor& visit) const {
    visit.need({"number"});
    visit.number("number", pdo.number, 1, 512, "");
    if (visit.wants("cob_id", pdo.cob_id != 0)) visit.hex("cob_id", pdo.cob_id, 0x7FF, "");
    if (visit.wants("forbids_remote_frames", pdo.forbids_remote_frames))
      visit.flag("forbids_remote_frames", pdo.forbids_remote_frames, "");
  }
};

struct VisitPdo {
  template <typename Row, typename Visitor>
  void operator()(Row& pdo, Visitor& visit) const {
    VisitPdoIdentity{}(pdo, visit);
    visit.need({"transmission_type", "entries"});
    visit.number("transmission_type", pdo.transmission_type, 0, 255, "");
    if (visit.wants("inhibit_time_100us", pdo.inhibit_time_100us != 0))
      visit.number("inhibit_time_100us", pdo.inhibit_time_100us, 0, 65535, "");
    if (visit.wants("keeps_mapping", pdo.keeps_mapping)) visit.flag("keeps_mapping", pdo.keeps_mapping, "");
    if (visit.wants("keeps_transmission_type", pdo.keeps_transmission_type))
      visit.flag("keeps_transmission_type", pdo.keeps_transmission_type, "");
    if (visit.wants("event_timer_ms", pdo.event_timer_ms != 0))
      visit.number("event_timer_ms", pdo.event_timer_ms, 0, 65535, "");
    static_vector(visit, "entries", pdo.entries, VisitPdoEntry{}, "");
  }
};

template <typename Config, typename Visitor>
void visit_motor(Config& motor, Visitor& visit) {
  visit.table(
      "motor",
      "The drive that turns the head: CiA 402 in profile velocity mode. What makes a drive differ is "
      "all here:\n"
      "the objects to check and to write, what travels in which PDO, and speeds in the drive's own "
      "unit (that of\n"
      "0x60FF and 0x606C; its manual says which). These are a Trinamic TMCM-1636's, that speaks rpm, "
      "on the head's\n"
      "axis behind a gear of 60. docs/examples/motor-epos4.toml and motor-ipos.toml hold others.\n"
      "This drive is not known to stop by itself when nobody commands it: wire its STO (docs/safety.md).");
  visit.number("node", motor.node, 1, 127, "the drive's CANopen node");
  if (visit.wants("axis", motor.axis != 0))
    visit.number("axis", motor.axis, 0, 7, "of a node with several: 0x6800 and following are the second's");
  visit.number("target_velocity_units", motor.target_velocity_units, -2147483647.0, 2147483647.0,
               "25 rpm of the head is half a turn in 1.2 s; negative: the other way");
  visit.number("velocity_tolerance_units", motor.velocity_tolerance_units, 0, 2147483647.0, "");
  visit.number("stall_velocity_units", motor.stall_velocity_units, 0, 2147483647.0, "up to this it stands");
  visit.number("ramp_units_per_s", motor.ramp_units_per_s, 0, 1e9,
               "of the target velocity, by us; 0: the drive's profile acceleration does it");
  visit.choice(
      "reset", motor.reset,
      {{"none", MotorReset::none}, {"communication", MotorReset::communication}, {"node", MotorReset::node}},
      "how a bring-up begins: none, communication (0x1000 to 0x1FFF), node (everything)");
  static_vector(
      visit, "checks", motor.checks, VisitObjectCheck{},
      "Objects that must read so, in the bits of `mask` (all when left out): is it the right drive?");
  static_vector(
      visit, "writes", motor.writes, VisitObjectWrite{},
      "Written in this order, before the PDOs. `bytes`: 1 to 4, the object's size. 0x6060 is written "
      "anyway.");
  if (visit.wants("watchdog_writes", motor.watchdog_writes.size() > 0))
    static_vector(visit, "watchdog_writes", motor.watchdog_writes, VisitObjectWrite{},
                  "The maker's own watchdog, by which the drive stops when nobody commands it.");
  static_vector(
      visit, "tpdos", motor.tpdos, VisitPdo{},
      "From the drive. All together they must hold statusword 0x6041, position 0x6064, velocity 0x606C.\n"
      "transmission_type 1: on every SYNC; 254, 255: when it likes, then with event_timer_ms.\n"
      "cob_id: left out for those of the predefined set. forbids_remote_frames: some drives insist.\n"
      "keeps_mapping, keeps_transmission_type: the drive has it fixed; `entries` only say what it is.");
  static_vector(
      visit, "rpdos", motor.rpdos, VisitPdo{},
      "To the drive: controlword 0x6040 and target velocity 0x60FF, and 0x6060 where that is wished.");
  static_vector(visit, "tpdos_to_disable", motor.tpdos_to_disable, VisitPdoIdentity{},
                "Those that the drive would send by itself.");
  static_vector(visit, "rpdos_to_disable", motor.rpdos_to_disable, VisitPdoIdentity{}, "");
  if (visit.wants("writes_mode", !motor.writes_mode))
    visit.flag("writes_mode", motor.writes_mode, "false: 0x6060 is left as it is");
  visit.flag("verifies_mode", motor.verifies_mode, "0x6061 must show profile velocity");
  duration_ms(visit, "sync_period_ms", motor.sync.period_ns, 0, 10000,
              "0: no SYNC; frames then go out every control_period_ms");
  visit.number("sync_counter_overflow", motor.sync.counter_overflow, 0, 240, "0: SYNC without a counter");
  visit.flag("is_sync_producer", motor.is_sync_producer,
             "false: another node makes the SYNC, with the same period");
  duration_ms(visit, "control_period_ms", motor.control_period_ns, 0, 10000, "without SYNC");
  visit.number("own_node", motor.own_node, 1, 127, "this computer's CANopen node");
  duration_ms(visit, "own_heartbeat_period_ms", motor.own_heartbeat_period_ns, 0, 60000, "0: none");
  visit.number(
      "own_heartbeat_timeout_ms", motor.own_heartbeat_timeout_ms, 0, 65535,
      "0x1016:1, the drive watches us; what it does then is its maker's affair: docs/safety.md; 0: none");
  visit.flag("sets_master_loss_reaction", motor.sets_master_loss_reaction,
             "quick stop into 0x6007, where the drive has it");
  visit.number("heartbeat_period_ms", motor.heartbeat_period_ms, 0, 65535,
               "of the drive (0x1017); 0: left as it is");
  duration_ms(visit, "heartbeat_timeout_ms", motor.heartbeat_timeout_ns, 0, 600000, "0: not watched");
  duration_ms(visit, "sdo_answer_timeout_ms", motor.sdo.response_timeout_ns, 1, 60000, "");
  visit.number("sdo_retry_limit", motor.sdo.retry_limit, 0, 255, "transfers after the first");
  duration_ms(visit, "pdo_timeout_ms", motor.pdo_timeout_ns, 0, 600000,
              "without a PDO with the position; 0: not watched");
  duration_s(visit, "boot_timeout_s", motor.boot_timeout_ns, 1e-3, an_hour_s,
             "for the boot-up message after a reset");
  duration_s(visit, "transition_timeout_s", motor.transition_timeout_ns, 1e-3, an_hour_s,
             "for each transition of CiA 402");
  duration_s(visit, "spin_up_timeout_s", motor.spin_up_timeout_ns, 1e-3, an_hour_s, "");
  duration_s(visit, "settle_time_s", motor.settle_time_ns, 0, an_hour_s,
             "within the tolerance for so long: at speed");
  duration_s(visit, "deviation_time_s", motor.deviation_time_ns, 0, an_hour_s,
             "outside for so long: too slow, too fast, stalled");
  duration_s(visit, "stop_timeout_s", motor.stop_timeout_ns, 1e-3, an_hour_s,
             "to stand still: by the ramp, and once more by quick stop");
  duration_s(visit, "stop_confirm_timeout_s", motor.stop_confirm_timeout_ns, 1e-3, an_hour_s,
             "beyond that, for the drive to confirm that it stands without torque");
  visit.number("attempt_limit", motor.attempt_limit, 0, 1e6,
               "failures in a row; with the next one the motor is given up until a person resets it");
  duration_s(visit, "back_off_first_s", motor.back_off.first_ns, 1e-3, an_hour_s,
             "pause after the first failure, doubled with each");
  duration_s(visit, "back_off_maximum_s", motor.back_off.maximum_ns, 1e-3, an_hour_s, "");
  duration_s(visit, "healthy_after_s", motor.healthy_after_ns, 0, an_hour_s,
             "at speed for so long: failures are forgotten");
  visit.retired("failed_retry_s");
  auto& permit = motor.permit;
  visit.choice("permit", permit.source,
               {{"none", PermitSource::none},
                {"gpio", PermitSource::gpio},
                {"can", PermitSource::can},
                {"socket", PermitSource::socket}},
               "who lets the head turn: none (it may always), gpio, can, socket; see docs/safety.md");
  const bool is_line = permit.source == PermitSource::gpio;
  const bool is_can = permit.source == PermitSource::can;
  if (visit.wants("permit_line", is_line))
    visit.number("permit_line", permit.line, 0, 255, "of gpio.lines, from 0; a rising edge gives the permit");
  if (visit.wants("permit_is_active_low", is_line))
    visit.flag("permit_is_active_low", permit.is_active_low, "a falling edge does");
  if (visit.wants("permit_debounce_ms", is_line))
    duration_ms(visit, "permit_debounce_ms", permit.debounce_ns, 0, 10000, "");
  if (visit.wants("permit_cob_id", is_can)) visit.hex("permit_cob_id", permit.cob_id, 0x7FF, "");
  if (visit.wants("permit_byte", is_can))
    visit.number("permit_byte", permit.byte, 0, 7, "given when (data[byte] & mask) == value");
  if (visit.wants("permit_mask", is_can)) visit.hex("permit_mask", permit.mask, 255, "");
  if (visit.wants("permit_value", is_can)) visit.hex("permit_value", permit.value, 255, "");
  if (visit.wants("permit_timeout_ms", is_can || permit.source == PermitSource::socket))
    duration_ms(visit, "permit_timeout_ms", permit.timeout_ns, 1, 60000,
                "without a message the permit is gone");
}

}  // namespace alces::settings
