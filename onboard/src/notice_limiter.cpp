#include "alces_onboard/notice_limiter.h"

#include <algorithm>
#include <cstring>

namespace alces::onboard {

NoticeLimiter::Source& NoticeLimiter::source_of(const Notice& notice) {
  for (Source& source : sources_) {
    if (source.name == nullptr) {
      source.name = notice.source;
      source.severity = notice.severity;
      source.refilled_ns = notice.stamp_ns;
      return source;
    }
    const bool is_it = source.severity == notice.severity && std::strcmp(source.name, notice.source) == 0;
    if (is_it) return source;
  }
  return sources_.back();
}

bool NoticeLimiter::may(const Notice& notice, std::uint64_t& held_back) {
  held_back = 0;
  Source& source = source_of(notice);
  if (notice.stamp_ns < source.refilled_ns) source.refilled_ns = notice.stamp_ns;
  const std::int64_t refills = (notice.stamp_ns - source.refilled_ns) / refill_ns;
  if (source.left == burst) {
    source.refilled_ns = notice.stamp_ns;
  } else if (refills > 0) {
    source.left = static_cast<std::uint32_t>(std::min<std::int64_t>(burst, source.left + refills));
    source.refilled_ns += refills * refill_ns;
  }
  if (source.left == 0) {
    ++source.held_back;
    return false;
  }
  --source.left;
  held_back = source.held_back;
  source.held_back = 0;
  return true;
}

}  // namespace alces::onboard
