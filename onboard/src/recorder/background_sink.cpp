#include "alces_onboard/recorder/background_sink.h"

#include <chrono>
#include <thread>

#include "alces_platform/linux/clock.h"

namespace alces::onboard {
namespace {

constexpr std::int64_t short_sleep_ns = ns_per_ms;

void sleep(std::int64_t duration_ns) {
  std::this_thread::sleep_for(std::chrono::nanoseconds(duration_ns));
}

}  // namespace

BackgroundSink::BackgroundSink(ByteSink& below, const BackgroundSinkConfig& config)
    : below_(below),
      config_(config),
      memory_(std::make_unique<std::uint8_t[]>(config.ring_bytes)),
      ring_({memory_.get(), config.ring_bytes}) {}

BackgroundSink::~BackgroundSink() {
  if (thread_.is_running()) stop(0);
}

void BackgroundSink::start() {
  is_stopping_ = false;
  gives_up_ = false;
  thread_.start([this] { run(); });
}

bool BackgroundSink::write(std::span<const std::uint8_t> bytes) {
  bool is_taken = ring_.push(bytes);
  while (!is_taken && patience_ns_ > 0 && bytes.size() <= ring_.largest_record()) {
    sleep(short_sleep_ns);
    patience_ns_ -= short_sleep_ns;
    is_taken = ring_.push(bytes);
  }
  if (!is_taken) {
    ++counters_.writes_refused;
    return false;
  }
  ++counters_.writes;
  counters_.bytes += bytes.size();
  bell_.ring();
  return true;
}

bool BackgroundSink::read_back(std::uint64_t position, std::span<std::uint8_t> bytes) {
  for (; !ring_.empty() && patience_ns_ > 0; patience_ns_ -= short_sleep_ns) sleep(short_sleep_ns);
  return ring_.empty() && below_.read_back(position, bytes);
}

void BackgroundSink::run() {
  for (;;) {
    const Bell::Strokes heard = bell_.strokes();
    const bool is_stopping = is_stopping_.load(std::memory_order_acquire);
    std::span<const std::uint8_t> record;
    if (!ring_.front(record)) {
      if (is_stopping) return;
      bell_.wait(heard);
      continue;
    }
    if (below_.write(record)) {
      is_stalled_.store(false, std::memory_order_relaxed);
      ring_.pop();
    } else if (gives_up_.load(std::memory_order_acquire)) {
      bytes_given_up_.fetch_add(record.size(), std::memory_order_relaxed);
      ring_.pop();
    } else {
      if (!is_stalled_.exchange(true)) stalls_.fetch_add(1, std::memory_order_relaxed);
      // In short pieces, so that the end is not kept waiting.
      for (std::int64_t slept_ns = 0;
           slept_ns < config_.retry_ns && !gives_up_.load(std::memory_order_acquire);
           slept_ns += short_sleep_ns) {
        sleep(short_sleep_ns);
      }
    }
  }
}

bool BackgroundSink::stop(std::int64_t limit_ns) {
  if (!thread_.is_running()) return true;
  const std::int64_t deadline_ns = now_ns() + limit_ns;
  while (!ring_.empty() && now_ns() < deadline_ns) sleep(short_sleep_ns);
  gives_up_.store(true, std::memory_order_release);
  is_stopping_.store(true, std::memory_order_release);
  bell_.ring();
  was_left_ = !thread_.join_within(config_.leave_ns);
  return !was_left_ && bytes_given_up_.load() == 0;
}

BackgroundSink::Counters BackgroundSink::counters() const {
  Counters counters = counters_;
  counters.stalls = stalls_.load(std::memory_order_relaxed);
  counters.bytes_given_up = bytes_given_up_.load(std::memory_order_relaxed);
  return counters;
}

}  // namespace alces::onboard
