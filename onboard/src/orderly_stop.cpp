#include "alces_onboard/orderly_stop.h"

namespace alces::onboard {

const char* to_string(StopStage stage) {
  switch (stage) {
    case StopStage::running:
      return "running";
    case StopStage::stopping_scanner:
      return "stopping lasers and motor";
    case StopStage::finishing_map:
      return "finishing the map";
    case StopStage::finished:
      return "finished";
  }
  return "unknown";
}

void OrderlyStop::enter(StopStage stage, std::int64_t now_ns) {
  stage_ = stage;
  since_ns_ = now_ns;
}

StopStage OrderlyStop::update(std::int64_t now_ns, std::uint64_t requests, bool are_devices_idle) {
  if (requests >= 2 && hurried_ns_ == no_stamp_ns) {
    hurried_ns_ = now_ns;
    pipeline_.abandon_mapping();
    if (stage_ == StopStage::stopping_scanner) pipeline_.stop_scanner();  // again: quick stop
  }
  switch (stage_) {
    case StopStage::running:
      if (requests == 0) break;
      pipeline_.raise({now_ns, Severity::info, "alcesd", "told to stop: lasers and motor first"});
      pipeline_.stop_scanner();
      if (hurried_ns_ != no_stamp_ns) pipeline_.stop_scanner();
      enter(StopStage::stopping_scanner, now_ns);
      break;
    case StopStage::stopping_scanner: {
      const bool is_overdue =
          requests >= 3 || now_ns - since_ns_ >= limits_.scanner_limit_ns ||
          (hurried_ns_ != no_stamp_ns && now_ns - hurried_ns_ >= limits_.hurried_limit_ns);
      const bool is_stopped = pipeline_.has_scanner_ended() && are_devices_idle;
      if (!is_stopped && !is_overdue) break;
      if (!is_stopped) {
        was_scanner_left_ = true;
        pipeline_.raise({now_ns, Severity::error, "alcesd",
                         "lasers and motor did not stop in time and are left as they are"});
      }
      if (!pipeline_.is_motor_confirmed()) {
        const MotorReason reason = MotorReason::stop_not_confirmed;
        pipeline_.raise({now_ns, Severity::error, "alcesd", to_string(reason)});
      }
      pipeline_.end_events();
      enter(StopStage::finishing_map, now_ns);
      break;
    }
    case StopStage::finishing_map:
      finish_map(now_ns, requests);
      break;
    case StopStage::finished:
      break;
  }
  return stage_;
}

void OrderlyStop::finish_map(std::int64_t now_ns, std::uint64_t requests) {
  pipeline_.take_results();
  if (pipeline_.is_mapping_finished()) {
    enter(StopStage::finished, now_ns);
    return;
  }
  const bool is_overdue = requests >= 2 || now_ns - since_ns_ >= limits_.mapping_limit_ns;
  if (abandoned_ns_ == no_stamp_ns && (is_overdue || !pipeline_.are_threads_alive())) {
    abandoned_ns_ = now_ns;
    pipeline_.abandon_mapping();
  }
  const std::int64_t leave_ns = requests >= 3 ? limits_.leave_limit_ns / 10 : limits_.leave_limit_ns;
  if (abandoned_ns_ == no_stamp_ns || now_ns - abandoned_ns_ < leave_ns) return;
  was_mapper_left_ = true;
  pipeline_.raise({now_ns, Severity::error, "alcesd",
                   "the mapper did not come back in time and is left; the map of the drive ends before"});
  enter(StopStage::finished, now_ns);
}

}  // namespace alces::onboard
