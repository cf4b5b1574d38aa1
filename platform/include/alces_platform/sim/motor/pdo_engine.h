// The PDOs of a simulated CANopen node (CiA 301): four (or more) RPDOs and TPDOs whose parameters are the
// objects 0x1400, 0x1600, 0x1800, 0x1A00 and following of the dictionary, with the rules for changing them:
//   - a COB-ID's identifier may change only while bit 31 (PDO off) is set before or after;
//   - mapping entries change only while the PDO is off and its count of entries is 0;
//   - the count is taken when every entry exists, may be mapped and all fit into 8 bytes.
// Transmission types: 0 (at SYNC, when changed), 1..240 (at every n-th SYNC), 254/255 (when changed, event
// timer, inhibit time), for RPDOs 0..240 (taken at the next SYNC) and 254/255 (at once). 252/253 (remote
// requests) never transmit.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "alces_drivers/can_frame.h"
#include "alces_platform/sim/motor/object_dictionary.h"

namespace alces::sim {

class PdoEngine {
 public:
  struct Value {
    std::uint16_t index;
    std::uint8_t sub;
    std::int64_t value;
  };
  enum class Received : std::uint8_t { not_a_pdo, taken, too_short };

  explicit PdoEngine(const ObjectDictionary& objects) : objects_(&objects) {}

  /// Some firmware never sends PDOs of type 0: the TMCM-1636 of our trace.
  void send_acyclic(bool sends) { sends_acyclic_ = sends; }

  /// The rules above, for a value whose type, access and limits are good. none for other objects.
  [[nodiscard]] SdoAbort check_write(std::uint16_t index, std::uint8_t sub, std::int64_t value) const;

  /// The node became operational, or its communication was reset: counters and stored PDOs are forgotten.
  void restart(std::int64_t now_ns);

  /// Values that a received frame writes: at once, or at the next SYNC.
  [[nodiscard]] Received on_frame(const CanFrame& frame, std::vector<Value>& written);
  void take_at_sync(std::vector<Value>& written);
  /// What is transmitted at a SYNC; the dictionary holds the values of this moment.
  void send_at_sync(std::int64_t now_ns, std::vector<CanFrame>& frames);

  /// True while a TPDO of type 254/255 is on: send_events() wants to be called every cycle.
  [[nodiscard]] bool has_events() const;
  void send_events(std::int64_t now_ns, std::vector<CanFrame>& frames);

 private:
  static constexpr std::size_t pdo_count = 8;
  struct Transmit {
    std::optional<CanFrame> last;
    std::int64_t last_ns = 0;
    unsigned syncs = 0;
  };

  [[nodiscard]] SdoAbort check_entry(std::uint32_t entry, bool is_transmit) const;
  [[nodiscard]] SdoAbort check_count(std::uint16_t mapping, std::int64_t count, bool is_transmit) const;
  [[nodiscard]] bool is_on(std::uint16_t communication) const;
  [[nodiscard]] CanFrame gather(std::uint16_t number) const;
  /// False when the frame is shorter than its mapping.
  [[nodiscard]] bool scatter(std::uint16_t number, const CanFrame& frame, std::vector<Value>& written) const;

  const ObjectDictionary* objects_;
  bool sends_acyclic_ = true;
  Transmit transmit_[pdo_count];
  std::optional<CanFrame> waiting_[pdo_count];  ///< synchronous RPDOs
};

}  // namespace alces::sim
