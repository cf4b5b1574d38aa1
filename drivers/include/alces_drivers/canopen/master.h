// Several nodes on one bus: hands each frame to those who want its COB-ID, and sends SYNC for all of them.
//
//   Master master(config, port);
//   master.add(motor, motor.cob_ids());    // once, before the first event
//   master.on_frame(frame, stamp_ns);      // and on_link(), on_tick()
//
// A frame costs one bit test when nobody wants it, and a walk over the subscriptions otherwise.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "alces_drivers/can_frame.h"
#include "alces_drivers/canopen/cob_id.h"
#include "alces_drivers/canopen/heartbeat.h"
#include "alces_drivers/canopen/nmt.h"
#include "alces_drivers/canopen/sync.h"
#include "alces_drivers/port/can_port.h"
#include "alces_drivers/static_vector.h"

namespace alces::canopen {

/// What speaks to one node.
class NodeDriver {
 public:
  virtual void on_frame(const CanFrame& frame, std::int64_t stamp_ns) = 0;
  virtual void on_link(bool is_up, std::int64_t now_ns) = 0;
  virtual void on_tick(std::int64_t now_ns) = 0;

 protected:
  ~NodeDriver() = default;
};

struct MasterConfig {
  SyncConfig sync{.period_ns = 0,
                  .counter_overflow = 0};  ///< period 0: the nodes' drivers, or nobody, make it
  std::uint8_t own_node = last_node;
  std::int64_t own_heartbeat_period_ns = 0;  ///< 0: none
};

class Master {
 public:
  static constexpr std::size_t maximum_drivers = 16;
  static constexpr std::size_t maximum_subscriptions = 128;

  struct Counters {
    std::uint64_t frames = 0;
    std::uint64_t frames_routed = 0;
    std::uint64_t frames_unclaimed = 0;      ///< nobody here speaks with that node
    std::uint64_t frames_not_canopen = 0;    ///< extended, remote, FD
    std::uint64_t error_frames = 0;          ///< the kernel's reports
    std::uint64_t nmt_not_taken = 0;         ///< by the port
    std::uint64_t heartbeats_not_taken = 0;  ///< our own
    SyncProducer::Counters sync;

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("can_frames", frames);
      visit("can_frames_routed", frames_routed);
      visit("can_frames_unclaimed", frames_unclaimed);
      visit("can_frames_not_canopen", frames_not_canopen);
      visit("can_error_frames", error_frames);
      visit("nmt_not_taken", nmt_not_taken);
      visit("own_heartbeats_not_taken", heartbeats_not_taken);
      sync.visit(visit);
    }
  };

  Master(const MasterConfig& config, CanPort& port);

  /// False, and nothing changes: no room for the driver or for its subscriptions, or an identifier above
  /// 0x7FF.
  [[nodiscard]] bool add(NodeDriver& driver, std::span<const std::uint16_t> cob_ids);

  void on_frame(const CanFrame& frame, std::int64_t stamp_ns);
  void on_link(bool is_up, std::int64_t now_ns);
  void on_tick(std::int64_t now_ns);

  /// To one node or, with node 0, to all. False: the port did not take it.
  [[nodiscard]] bool order(NmtOrder order);

  /// no_stamp_ns: no SYNC of ours is due.
  [[nodiscard]] std::int64_t next_sync_ns() const { return sync_.due_ns(); }
  [[nodiscard]] Counters counters() const;

 private:
  struct Subscription {
    std::uint16_t cob_id = 0;
    std::uint16_t driver = 0;
  };

  /// True: somebody wanted it.
  bool hand_on(const CanFrame& frame, std::int64_t stamp_ns);

  MasterConfig config_;
  CanPort& port_;
  SyncProducer sync_;
  HeartbeatProducer heartbeat_;
  bool is_link_up_ = true;
  StaticVector<NodeDriver*, maximum_drivers> drivers_;
  StaticVector<Subscription, maximum_subscriptions> subscriptions_;
  std::array<std::uint64_t, 32> wanted_{};  ///< one bit a COB-ID
  Counters counters_;
};

}  // namespace alces::canopen
