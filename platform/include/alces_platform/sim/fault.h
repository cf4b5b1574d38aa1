// What can go wrong on the simulated vehicle, and when.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace alces::sim {

/// `argument` is 0 unless said otherwise; 0 means the default in brackets. "While": lasts for the injection's
/// duration; "once": happens at its time. Of lasers: the argument's lowest byte is the laser's number.
enum class Fault : std::uint8_t {
  // The motor drive. Those marked (drive) are handed to CanNode::on_fault; the others happen on the wire.
  node_absent,     ///< while: no frame to or from it
  late_boot_up,    ///< (drive) while: it is silent, then boots up
  node_reset,      ///< (drive) once: power-cycled; boot-up message in mid-drive
  heartbeat_lost,  ///< while: its heartbeats do not come through
  emergency,       ///< once: an EMCY frame; argument: error code [0x8110, CAN overrun]
  sdo_abort,       ///< (drive) while: every SDO is aborted; argument: abort code [0x08000000, general error]
  sdo_silence,     ///< while: SDO answers do not come through
  drive_fault_once,      ///< (drive) once: CiA 402 fault that a reset clears; argument: error code [0x3210]
  drive_fault_for_ever,  ///< (drive) once: CiA 402 fault that comes back after every reset; argument: error
                         ///< code
  // The CAN bus.
  bus_off,              ///< while: our controller is bus-off; then restarted
  error_passive_flood,  ///< while: error frames; argument: a second [1000]
  pdo_lost,             ///< while: TPDOs of the drive do not arrive; argument: how many of 1000 [1000]
  pdo_duplicated,       ///< while: they arrive twice; argument: of 1000 [1000]
  pdo_delayed,          ///< while: they arrive late; argument: us [15000]
  pdo_reordered,        ///< while: every second one arrives after the next one
  bus_load,  ///< while: traffic of other nodes, of higher and of lower priority; argument: percent [90]
  // GPIO lines.
  index_missing,   ///< while: no index pulse
  index_extra,     ///< while: pulses that mean nothing; argument: ms between them [700]
  index_bouncing,  ///< while: every index edge is followed by 2 to 6 more within 300 us
  ab_swapped,      ///< while: A's edges come on B's line and the other way round
  edges_lost,      ///< while: the kernel's buffer is full; edges are missing
  // Lasers.
  laser_garbage,        ///< while: random bytes are strewn in; argument >> 8: bytes a second [2000]
  laser_crc_errors,     ///< while: one bit in so many is flipped; argument >> 8: of 1,000,000 bytes [500]
  laser_wrong_baud,     ///< (laser) once: it speaks at another rate; argument >> 8: baud [9600]
  laser_half_telegram,  ///< once: the next so many bytes are lost; argument >> 8: bytes [366]
  laser_unplugged,      ///< while: the line is down, then up again
  laser_reset,          ///< (laser) once: power-cycled
  // Odometry and GPS.
  odometry_frozen,  ///< while: the same frames again and again; argument 1: only their counters go on;
                    ///< 2: the wheels say that they stand (speeds 0, ways as they were), gyro and counters go
                    ///< on; 3: gyro says so, too
  odometry_silent,  ///< while: no frames
  odometry_jump,    ///< once: one absurd speed; argument: mm/s [30000]
  gps_absurd,       ///< while: a position that is not where it is; argument: m [1000000]
  gps_silent,       ///< while: no sentences
};
inline constexpr std::uint8_t fault_count = static_cast<std::uint8_t>(Fault::gps_silent) + 1;
[[nodiscard]] const char* to_string(Fault fault);
/// The same as one word, for command lines: "late_boot_up".
[[nodiscard]] const char* name(Fault fault);

inline constexpr std::int64_t for_ever_ns = INT64_MAX / 4;

struct Injection {
  Fault fault = Fault::node_absent;
  std::int64_t at_ns = 0;
  std::int64_t duration_ns = 0;  ///< of a "while"; for_ever_ns
  std::int64_t argument = 0;
};

/// All injections of a run.
class FaultPlan {
 public:
  void add(const Injection& injection) { entries_.push_back({injection, false}); }

  /// The injection of this fault that lasts at this time, if one does (at_ns <= stamp_ns < at_ns +
  /// duration_ns).
  [[nodiscard]] const Injection* active(Fault fault, std::int64_t stamp_ns) const;
  /// The same for faults of one laser.
  [[nodiscard]] const Injection* active(Fault fault, std::uint8_t laser, std::int64_t stamp_ns) const;
  /// The next injection that has begun at this time and has not been taken yet.
  [[nodiscard]] std::optional<Injection> take(std::int64_t stamp_ns);

 private:
  struct Entry {
    Injection injection;
    bool is_taken = false;
  };
  std::vector<Entry> entries_;
};

/// The argument, or the fault's default.
[[nodiscard]] constexpr std::int64_t argument_or(const Injection& injection, std::int64_t default_argument) {
  return injection.argument == 0 ? default_argument : injection.argument;
}
/// Faults of lasers: which one, and the number above its byte.
[[nodiscard]] constexpr std::uint8_t laser_of(const Injection& injection) {
  return static_cast<std::uint8_t>(injection.argument & 0xff);
}
[[nodiscard]] constexpr std::int64_t number_or(const Injection& injection, std::int64_t default_number) {
  return (injection.argument >> 8) == 0 ? default_number : injection.argument >> 8;
}

}  // namespace alces::sim
