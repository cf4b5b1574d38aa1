// When to try again: soon at first, then ever more seldom.
#pragma once

#include <algorithm>
#include <cstdint>

#include "alces_drivers/stamp.h"

namespace alces {

class RetryDelay {
 public:
  RetryDelay(std::int64_t first_ns, std::int64_t limit_ns) : first_ns_(first_ns), limit_ns_(limit_ns) {}

  [[nodiscard]] bool is_due(std::int64_t now_ns) const { return now_ns >= next_ns_; }
  void failed(std::int64_t now_ns) {
    wait_ns_ = wait_ns_ == 0 ? first_ns_ : std::min(2 * wait_ns_, limit_ns_);
    next_ns_ = now_ns + wait_ns_;
  }
  void reset() {
    wait_ns_ = 0;
    next_ns_ = no_stamp_ns;
  }

 private:
  std::int64_t first_ns_;
  std::int64_t limit_ns_;
  std::int64_t wait_ns_ = 0;
  std::int64_t next_ns_ = no_stamp_ns;
};

/// Lets one notice through in a while, so that a flood on a wire is no flood in the journal.
class RateLimiter {
 public:
  explicit RateLimiter(std::int64_t interval_ns) : interval_ns_(interval_ns) {}

  [[nodiscard]] bool may(std::int64_t now_ns) {
    if (last_ns_ != no_stamp_ns && now_ns - last_ns_ < interval_ns_) return false;
    last_ns_ = now_ns;
    return true;
  }
  void reset() { last_ns_ = no_stamp_ns; }

 private:
  std::int64_t interval_ns_;
  std::int64_t last_ns_ = no_stamp_ns;
};

}  // namespace alces
