// A ByteSink that never makes its caller wait: what is written goes into a bounded ring, and a thread of its
// own hands it on to the sink below (a file, the terminal), which may take its time.
//
// One write is one write below, in order and whole, so a file that ends behind a whole chunk goes on doing
// so. When the ring is full write() answers false: the caller keeps its bytes or gives them up (a
// RecordingWriter does the one and then the other). When the sink below refuses (disk full) the same bytes
// are tried again every `retry_ns`, and meanwhile the ring fills.
//
// One thread writes. After start() nothing is allocated.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include "alces_drivers/stamp.h"
#include "alces_onboard/bell.h"
#include "alces_onboard/leavable_thread.h"
#include "alces_onboard/recorder/record_ring.h"
#include "alces_platform/recording/byte_sink.h"

namespace alces::onboard {

struct BackgroundSinkConfig {
  std::size_t ring_bytes = std::size_t{8} << 20;  ///< largest write: half of it, less 16 bytes
  std::int64_t retry_ns = 200 * ns_per_ms;
  std::int64_t leave_ns = 2 * ns_per_s;  ///< that stop() waits for a thread that hangs
};

class BackgroundSink final : public ByteSink {
 public:
  struct Counters {
    std::uint64_t writes = 0;
    std::uint64_t bytes = 0;
    std::uint64_t writes_refused = 0;  ///< the ring was full
    std::uint64_t stalls = 0;          ///< times the sink below began to refuse
    std::uint64_t bytes_given_up = 0;  ///< at the end, because it still did

    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("writes", writes);
      visit("bytes", bytes);
      visit("writes_refused", writes_refused);
      visit("stalls", stalls);
      visit("bytes_given_up", bytes_given_up);
    }
  };

  /// `below` outlives it and is used by its thread alone between start() and stop(), but for read_back().
  BackgroundSink(ByteSink& below, const BackgroundSinkConfig& config);
  BackgroundSink(const BackgroundSink&) = delete;
  BackgroundSink& operator=(const BackgroundSink&) = delete;
  ~BackgroundSink();

  /// std::system_error when the system has no more threads.
  void start();

  [[nodiscard]] bool write(std::span<const std::uint8_t> bytes) override;
  /// Waits until all is handed on, as long as write() may wait for room.
  [[nodiscard]] bool read_back(std::uint64_t position, std::span<std::uint8_t> bytes) override;

  /// From now on write() waits for room and read_back() for what is written, up to this long in all: for the
  /// end of a file, when nobody is kept waiting any more.
  void let_writes_wait(std::int64_t limit_ns) { patience_ns_ = limit_ns; }

  /// Waits until all is handed on, at most `limit_ns`, and ends the thread. False: not all was; what is left
  /// is counted and given up. A thread that hangs in the sink below gets `leave_ns` more, and is left then.
  bool stop(std::int64_t limit_ns);
  /// stop() left its thread: it still uses the ring and the sink below.
  [[nodiscard]] bool was_left() const { return was_left_; }

  /// The sink below refuses at the moment.
  [[nodiscard]] bool is_stalled() const { return is_stalled_.load(std::memory_order_relaxed); }
  /// After stop() all of them; before, as they are just now.
  [[nodiscard]] Counters counters() const;

 private:
  void run();

  ByteSink& below_;
  BackgroundSinkConfig config_;
  std::unique_ptr<std::uint8_t[]> memory_;
  RecordRing ring_;
  Bell bell_;
  LeavableThread thread_;
  bool was_left_ = false;
  std::atomic<bool> is_stopping_{false};
  std::atomic<bool> gives_up_{false};
  std::atomic<bool> is_stalled_{false};
  std::atomic<std::uint64_t> stalls_{0};
  std::atomic<std::uint64_t> bytes_given_up_{0};
  std::int64_t patience_ns_ = 0;
  Counters counters_;  ///< the writing thread's part
};

}  // namespace alces::onboard
