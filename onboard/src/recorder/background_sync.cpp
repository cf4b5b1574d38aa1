#include "alces_onboard/recorder/background_sync.h"

#include <cerrno>
#include <chrono>
#include <utility>

#include "alces_platform/linux/clock.h"

namespace alces::onboard {

struct BackgroundSync::State {
  Sync folder;
  Sync file;
  std::mutex mutex;  ///< of the three below; never held while a sync runs
  std::condition_variable changed;
  bool is_stopping = false;
  bool has_ended = false;

  std::atomic<std::int64_t> begun_ns{no_stamp_ns};  ///< of the sync that runs; no_stamp_ns: none does
  std::atomic<std::uint64_t> syncs{0};
  std::atomic<std::uint64_t> failures{0};
  std::atomic<int> error_number{0};

  void sync(const Sync& what) {
    begun_ns.store(now_ns(), std::memory_order_relaxed);
    const int failed = what();
    if (failed != 0) {
      error_number.store(failed, std::memory_order_relaxed);
      failures.fetch_add(1, std::memory_order_relaxed);
    }
    syncs.fetch_add(1, std::memory_order_relaxed);
    begun_ns.store(no_stamp_ns, std::memory_order_release);
  }
};

BackgroundSync::BackgroundSync(const BackgroundSyncConfig& config)
    : config_(config), state_(std::make_shared<State>()) {}

BackgroundSync::~BackgroundSync() {
  if (thread_.joinable()) stop(0);
}

void BackgroundSync::start(Sync folder, Sync file) {
  state_->folder = std::move(folder);
  state_->file = std::move(file);
  thread_ = std::thread([state = state_, config = config_] { run(state, config); });
}

void BackgroundSync::run(const std::shared_ptr<State>& state, const BackgroundSyncConfig& config) {
  state->sync(state->folder);
  std::unique_lock lock(state->mutex);
  for (;;) {
    const bool is_last = state->changed.wait_for(lock, std::chrono::nanoseconds(config.period_ns),
                                                 [&] { return state->is_stopping; });
    lock.unlock();
    state->sync(state->file);
    lock.lock();
    if (is_last) break;
  }
  state->has_ended = true;
  state->changed.notify_all();
}

std::optional<Notice> BackgroundSync::news(std::int64_t now_ns) {
  const std::int64_t begun_ns = state_->begun_ns.load(std::memory_order_acquire);
  const std::uint64_t failures = state_->failures.load(std::memory_order_relaxed);
  const std::uint64_t syncs = state_->syncs.load(std::memory_order_relaxed);
  if (failures != failures_seen_) {
    failures_seen_ = failures;
    syncs_at_failure_ = syncs;
    if (is_failure_told_) return std::nullopt;
    is_failure_told_ = true;
    return Notice{now_ns,
                  Severity::error,
                  "recording",
                  "the disk did not take a part of it, which may be missing after a power loss; errno",
                  state_->error_number.load(std::memory_order_relaxed),
                  true};
  }
  const bool is_slow = begun_ns != no_stamp_ns && now_ns - begun_ns > config_.patience_ns;
  if (is_slow && !is_slow_told_) {
    is_slow_told_ = true;
    return Notice{now_ns,
                  Severity::warning,
                  "recording",
                  "the disk does not confirm what was written, a power loss takes it; seconds so far",
                  (now_ns - begun_ns) / ns_per_s,
                  true};
  }
  const bool is_over = (is_slow_told_ && !is_slow) || (is_failure_told_ && syncs > syncs_at_failure_ + 1);
  if (!is_over) return std::nullopt;
  is_slow_told_ = false;
  is_failure_told_ = false;
  return Notice{now_ns, Severity::info, "recording", "the disk confirms what is written again"};
}

bool BackgroundSync::stop(std::int64_t limit_ns) {
  if (!thread_.joinable()) return true;
  std::unique_lock lock(state_->mutex);
  state_->is_stopping = true;
  state_->changed.notify_all();
  const bool has_ended =
      state_->changed.wait_for(lock, std::chrono::nanoseconds(limit_ns), [&] { return state_->has_ended; });
  lock.unlock();
  if (has_ended) {
    thread_.join();
  } else {
    thread_.detach();
    state_->error_number.store(ETIMEDOUT, std::memory_order_relaxed);
  }
  return has_ended && state_->failures.load(std::memory_order_relaxed) == 0;
}

int BackgroundSync::error_number() const {
  return state_->error_number.load(std::memory_order_relaxed);
}

BackgroundSync::Counters BackgroundSync::counters() const {
  return {state_->syncs.load(std::memory_order_relaxed), state_->failures.load(std::memory_order_relaxed)};
}

}  // namespace alces::onboard
