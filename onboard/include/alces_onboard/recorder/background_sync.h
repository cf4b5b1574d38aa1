// Puts a recording on the disk once a second, and its folder once, so that a power loss takes the last
// seconds alone. Syncing may take seconds: it has a thread of its own, for which neither the thread that
// acquires nor the one that writes waits.
//
// A sync that fails is told: Linux forgets the data it could not write, so that later syncs succeed and a
// part is missing all the same. After start() nothing is allocated.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "alces_drivers/port/notice_port.h"
#include "alces_drivers/stamp.h"

namespace alces::onboard {

struct BackgroundSyncConfig {
  std::int64_t period_ns = ns_per_s;         ///< from the end of one sync to the begin of the next
  std::int64_t patience_ns = 10 * ns_per_s;  ///< a sync that takes longer is told
};

class BackgroundSync {
 public:
  struct Counters {
    std::uint64_t syncs = 0;
    std::uint64_t syncs_failed = 0;

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("syncs", syncs);
      visit("syncs_failed", syncs_failed);
    }
  };
  /// Waits until it is on the disk. 0, or errno.
  using Sync = std::function<int()>;

  explicit BackgroundSync(const BackgroundSyncConfig& config = {});
  BackgroundSync(const BackgroundSync&) = delete;
  BackgroundSync& operator=(const BackgroundSync&) = delete;
  ~BackgroundSync();

  /// Calls `folder` once and `file` every period, in its thread. std::system_error when the system has no
  /// more threads.
  void start(Sync folder, Sync file);

  /// What is to be told since the last call: syncs fail, or one does not come back, or they succeed again.
  /// Waits for nothing.
  [[nodiscard]] std::optional<Notice> news(std::int64_t now_ns);

  /// Syncs once more, waits for it at most `limit_ns`, and ends the thread. False: it is not known that all
  /// is on the disk, because a sync failed, now or before, or this one did not come back. Then the thread is
  /// left in it, and `file` must not refer to anything that ends before the process does.
  bool stop(std::int64_t limit_ns);

  /// errno of the last sync that failed; 0: none did. ETIMEDOUT: stop() did not wait any longer.
  [[nodiscard]] int error_number() const;
  [[nodiscard]] Counters counters() const;

 private:
  struct State;
  static void run(const std::shared_ptr<State>& state, const BackgroundSyncConfig& config);

  BackgroundSyncConfig config_;
  std::shared_ptr<State> state_;  ///< the thread's as well, which may outlive this
  std::thread thread_;
  bool is_slow_told_ = false;
  bool is_failure_told_ = false;
  std::uint64_t failures_seen_ = 0;
  std::uint64_t syncs_at_failure_ = 0;
};

}  // namespace alces::onboard
