// How alcesd ends: lasers and motor stopped, the map finished, the recording whole; and each step bounded, so
// that it does end.
//
//   asked once    the scanner stops its devices (at most scanner_limit_ns), then the mapper works off the
//                 scans that wait and closes a last loop (at most mapping_limit_ns; then they are left)
//   asked again   the motor's quick stop, without waiting for the lasers; the scanner has hurried_limit_ns
//                 more; scans that wait are left
//   a third time  the devices are left as they are, and what is known of the motor is said
//
// The scan in the mapper's hands is finished, if that takes no longer than leave_limit_ns (a tenth of it
// after a third request). A mapper that does not come back by then hangs in a disk that does not answer, and
// is left.
#pragma once

#include <cstdint>

#include "alces_drivers/stamp.h"
#include "alces_onboard/pipeline.h"

namespace alces::onboard {

struct StopLimits {
  std::int64_t scanner_limit_ns = 30 * ns_per_s;  ///< above Scanner::stop_limit_ns(), which ends by itself
  std::int64_t mapping_limit_ns = 25 * ns_per_s;
  std::int64_t leave_limit_ns = 5 * ns_per_s;
  std::int64_t hurried_limit_ns = 5 * ns_per_s;
};

enum class StopStage : std::uint8_t { running, stopping_scanner, finishing_map, finished };
[[nodiscard]] const char* to_string(StopStage stage);

class OrderlyStop {
 public:
  OrderlyStop(Pipeline& pipeline, const StopLimits& limits) : pipeline_(pipeline), limits_(limits) {}

  /// After each round of the event loop. `requests`: how often it was asked to stop; `are_devices_idle`:
  /// nothing waits to be sent. Once it answers finished, the recording is to be finished.
  StopStage update(std::int64_t now_ns, std::uint64_t requests, bool are_devices_idle);

  [[nodiscard]] StopStage stage() const { return stage_; }
  /// The devices did not stop in time.
  [[nodiscard]] bool was_scanner_left() const { return was_scanner_left_; }
  /// The mapper did not come back in time.
  [[nodiscard]] bool was_mapper_left() const { return was_mapper_left_; }
  /// The drive confirmed that the motor stands without torque; false until it has.
  [[nodiscard]] bool is_motor_confirmed() const { return pipeline_.is_motor_confirmed(); }

 private:
  void enter(StopStage stage, std::int64_t now_ns);
  void finish_map(std::int64_t now_ns, std::uint64_t requests);

  Pipeline& pipeline_;
  StopLimits limits_;
  StopStage stage_ = StopStage::running;
  std::int64_t since_ns_ = 0;
  std::int64_t hurried_ns_ = no_stamp_ns;
  std::int64_t abandoned_ns_ = no_stamp_ns;
  bool was_scanner_left_ = false;
  bool was_mapper_left_ = false;
};

}  // namespace alces::onboard
