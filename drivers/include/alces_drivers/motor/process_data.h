// The PDOs of a CiA 402 drive in profile velocity mode, both ways: frames to statusword, position and
// velocity, and controlword and target velocity to frames. Knows what a bus does to PDOs: loses, repeats,
// delays and reorders them.
//
// With SYNC a drive in a synchronous transmission type sends each TPDO at most once a SYNC cycle. So a second
// one with the same bytes is the bus's repetition and is dropped; a second one with other bytes means that
// one of the two is a SYNC cycle late: its values count, marked as extra. A frame whose stamp does not follow
// that of the last one is dropped. A state that shows in one cyclic PDO only is taken for a delayed one: a
// change of state counts when it is seen twice.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "alces_drivers/can_frame.h"
#include "alces_drivers/canopen/pdo.h"
#include "alces_drivers/motor/cia402.h"
#include "alces_drivers/motor/drive_feedback.h"
#include "alces_drivers/motor/motor_config.h"

namespace alces {

class ProcessData {
 public:
  struct Counters {
    std::uint64_t received = 0;
    std::uint64_t malformed = 0;       ///< shorter than what is mapped
    std::uint64_t repeated = 0;        ///< dropped
    std::uint64_t stale = 0;           ///< dropped: its stamp is not after that of the last one
    std::uint64_t extra = 0;           ///< a second one in a SYNC cycle, with other bytes
    std::uint64_t missed = 0;          ///< SYNC cycles without one that was due
    std::uint64_t states_ignored = 0;  ///< a state that was seen once only

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("pdos_received", received);
      visit("pdos_malformed", malformed);
      visit("pdos_repeated", repeated);
      visit("pdos_stale", stale);
      visit("pdos_extra", extra);
      visit("pdos_missed", missed);
      visit("drive_states_ignored", states_ignored);
    }
  };

  enum class Outcome : std::uint8_t {
    foreign,   ///< not one of our TPDOs
    dropped,   ///< and counted
    taken,     ///< without a position
    feedback,  ///< with a position: feedback() is to be handed on
  };

  /// A configuration for which check() says ok.
  explicit ProcessData(const MotorConfig& config);

  /// Forgets what came: the node starts anew.
  void reset();
  Outcome on_frame(const CanFrame& frame, std::int64_t stamp_ns);
  void on_sync(std::int64_t stamp_ns);
  /// The last SYNC left at this time. From then on that is SYNC's time, as long as echoes come.
  void on_sync_sent(std::int64_t stamp_ns);
  [[nodiscard]] bool has_echoes() const { return echo_stamp_ns_ != no_stamp_ns; }

  /// no_stamp_ns: none came since reset().
  [[nodiscard]] std::int64_t position_stamp_ns() const { return position_stamp_ns_; }
  [[nodiscard]] std::int64_t velocity_stamp_ns() const { return velocity_stamp_ns_; }
  [[nodiscard]] std::int64_t statusword_stamp_ns() const { return statusword_stamp_ns_; }
  [[nodiscard]] const DriveFeedback& feedback() const { return feedback_; }
  [[nodiscard]] cia402::State state() const { return state_; }

  [[nodiscard]] std::size_t rpdo_count() const { return rpdos_.size(); }
  [[nodiscard]] CanFrame rpdo(std::size_t number, std::uint16_t controlword,
                              std::int32_t target_velocity_units) const;

  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  struct Tpdo {
    std::uint16_t cob_id = 0;
    std::uint8_t bytes = 0;
    std::uint8_t cycles_between = 0;  ///< 0: not bound to every so many SYNCs
    canopen::PdoField statusword;     ///< 0 bits: not there; so the others
    canopen::PdoField position;
    canopen::PdoField velocity;
    std::int64_t last_stamp_ns = no_stamp_ns;
    std::uint32_t cycles_since_last = 0;
    bool came_in_this_cycle = false;
    CanFrame last;
  };
  struct Rpdo {
    std::uint16_t cob_id = 0;
    std::uint8_t bytes = 0;
    canopen::PdoField controlword;
    canopen::PdoField target_velocity;
    canopen::PdoField mode;
  };

  void take_statusword(std::uint16_t statusword, bool is_cyclic);

  StaticVector<Tpdo, MotorConfig::maximum_pdos> tpdos_;
  StaticVector<Rpdo, MotorConfig::maximum_pdos> rpdos_;
  DriveFeedback feedback_;
  std::int64_t position_stamp_ns_ = no_stamp_ns;
  std::int64_t velocity_stamp_ns_ = no_stamp_ns;
  std::int64_t statusword_stamp_ns_ = no_stamp_ns;
  std::int64_t sync_stamp_ns_ = no_stamp_ns;
  std::int64_t echo_stamp_ns_ = no_stamp_ns;
  std::int64_t echo_patience_ns_ = 0;
  cia402::State state_ = cia402::State::unknown;
  cia402::State candidate_ = cia402::State::unknown;
  Counters counters_;
};

}  // namespace alces
