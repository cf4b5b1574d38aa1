// The simulated CAN bus: frames take their time on the wire, the lowest identifier goes first, and faults
// happen.
//
// On it: the host (this is its CanPort), CANopen nodes (the motor drive), sensors that only send, and on
// request other nodes' traffic. Error frames have the form of Linux' linux/can/error.h.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "alces_drivers/port/can_port.h"
#include "alces_platform/sim/event_queue.h"
#include "alces_platform/sim/fault.h"
#include "alces_platform/sim/random.h"

namespace alces::sim {

/// A CANopen device.
class CanNode {
 public:
  [[nodiscard]] virtual std::uint8_t node_id() const = 0;
  /// Every frame of others on the bus, when its last bit has been sent.
  virtual void on_frame(const CanFrame& frame, std::int64_t now_ns) = 0;
  /// Called every millisecond: appends what it wants to send.
  virtual void poll(std::int64_t now_ns, std::vector<CanFrame>& frames) = 0;
  /// Faults that happen within the device.
  virtual void on_fault(const Injection& injection) { (void)injection; }

 protected:
  ~CanNode() = default;
};

struct CanBusSettings {
  std::uint32_t bit_rate = 500'000;
  std::size_t host_queue_frames = 64;
  double latency_us =
      80;  ///< mean (exponential), from the kernel's time stamp until the host hears of a frame
  bool reports_sent = true;  ///< events of kind can_sent for the host's own frames
  double queue_us = 0;       ///< mean (exponential) that a frame waits in the host before it may compete
  bool echoes_sync = true;   ///< events of kind sync_sent when a SYNC of the host's has left
};

class CanBus final : public CanPort {
 public:
  struct Counters {
    std::uint64_t frames = 0;  ///< on the wire
    std::uint64_t from_host = 0;
    std::uint64_t refused = 0;  ///< send() answered false
    std::uint64_t lost_by_fault = 0;
    std::uint64_t error_frames = 0;
    std::uint64_t busy_us = 0;  ///< of the wire
    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("frames", frames);
      visit("from_host", from_host);
      visit("refused", refused);
      visit("lost_by_fault", lost_by_fault);
      visit("error_frames", error_frames);
      visit("busy_us", busy_us);
    }
  };

  CanBus(const CanBusSettings& settings, std::uint64_t seed, std::int64_t start_stamp_ns,
         const FaultPlan& faults, EventQueue& events);

  void attach(CanNode& node) { nodes_.push_back(&node); }

  /// The host's end. False: queue full or bus-off.
  [[nodiscard]] bool send(const CanFrame& frame) override;
  /// A sensor's frame.
  void send_from_sensor(const CanFrame& frame, std::int64_t ready_stamp_ns);
  /// An EMCY of the first node (Fault::emergency).
  void send_emergency(std::uint16_t error_code);
  void on_fault(const Injection& injection) {
    for (CanNode* node : nodes_) node->on_fault(injection);
  }

  /// Lets time pass: frames whose last bit is sent by `now_ns` have arrived.
  void step(std::int64_t now_ns);
  [[nodiscard]] const Counters& counters() const { return counters_; }
  /// Time on the wire with the usual stuffing, ns.
  [[nodiscard]] std::int64_t duration_ns(const CanFrame& frame) const;

 private:
  static constexpr std::size_t from_host = SIZE_MAX, from_sensor = SIZE_MAX - 1;
  struct Pending {
    CanFrame frame;
    std::int64_t ready_ns = 0;
    std::size_t sender = from_sensor;  ///< or a node's number
    std::uint64_t order = 0;
  };
  void pend(const CanFrame& frame, std::int64_t ready_ns, std::size_t sender);
  void step_state(std::int64_t now_ns);
  void step_traffic(std::int64_t now_ns);
  void transmit(std::int64_t now_ns);
  void arrive(const Pending& sent, std::int64_t end_ns);
  void arrive_at_host(const Pending& sent, std::int64_t end_ns);
  void tell_host(const CanFrame& frame, std::int64_t stamp_ns, EventKind kind = EventKind::can_frame);
  void tell_link(bool is_up, std::int64_t stamp_ns);
  void tell_error(std::uint32_t error_class, std::uint8_t controller, std::int64_t stamp_ns);
  [[nodiscard]] bool strikes(const Injection* injection);  ///< its share of 1000

  CanBusSettings settings_;
  Random random_;
  const FaultPlan& faults_;
  EventQueue& events_;
  std::vector<CanNode*> nodes_;
  std::vector<Pending> pending_;
  std::vector<CanFrame> polled_;
  std::uint64_t order_ = 0;
  std::size_t host_pending_ = 0;
  std::int64_t host_ready_ns_ = INT64_MIN;
  std::int64_t now_ns_;
  std::int64_t free_ns_;
  std::int64_t last_due_ns_ = 0;
  double next_other_ns_ = 0;
  double next_error_ns_ = 0;
  bool is_up_ = false;
  std::optional<Pending> held_;  ///< Fault::pdo_reordered: waits for the next PDO
  Counters counters_;
};

}  // namespace alces::sim
