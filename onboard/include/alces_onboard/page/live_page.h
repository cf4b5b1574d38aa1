// What alcesd says on its shared page (alces/page.h): from two threads, each with sections of its own. No
// call waits, locks, allocates or asks the system for anything: each is a few hundred stores.
#pragma once

#include <cstdint>

#include "alces/mapper.h"
#include "alces/page.h"
#include "alces_drivers/odometry/odometry.h"
#include "alces_onboard/status_report.h"

namespace alces::onboard {

/// Where the mapper has put a scan.
struct MapPose {
  std::int64_t stamp_ns = 0;  ///< the scan's reference time
  Pose map_from_body;
  bool has_odometry = false;
  Pose odometry_from_body;  ///< at that time
  Mapper::PoseUncertainty spread;
};

class LivePage {
 public:
  /// An empty page, which outlives this.
  explicit LivePage(alces_page& page) : page_(page) {}
  LivePage(const LivePage&) = delete;
  LivePage& operator=(const LivePage&) = delete;

  // The acquisition thread's.
  /// At every tick, and whenever there may be a new node; `odometry` null: the vehicle has none.
  void publish_odometry(const Odometry* odometry, const OdometryErrors& errors, std::int64_t now_ns);
  void publish_status(const StatusReport& report, std::int64_t now_ns);

  // The mapping thread's.
  /// The loop's event before its pose: who sees the map jump can find out why.
  void publish_loop(const LoopReport& loop, std::int64_t stamp_ns, std::int64_t now_ns);
  void publish_pose(const MapPose& pose, std::int64_t now_ns);

 private:
  void publish_node(const OdometryState& state);

  alces_page& page_;
  std::uint64_t nodes_seen_ = 0;  ///< of the odometry's
  alces_page_odometry odometry_{};
  alces_page_map map_{};
};

}  // namespace alces::onboard
