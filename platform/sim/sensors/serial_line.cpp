#include "alces_platform/sim/sensors/serial_line.h"

#include <algorithm>
#include <cmath>

namespace alces::sim {
namespace {

constexpr double bits_per_byte = 10;  // start, eight, stop
/// The host's UART hands over what it has after a pause of so many bytes' time.
constexpr double pause_bytes = 4;

double byte_ns(std::uint32_t baud) {
  return bits_per_byte * 1e9 / static_cast<double>(baud);
}

/// Clocks within 3 % of each other still read each other's ten bits.
bool agree(std::uint32_t a, std::uint32_t b) {
  const auto larger = static_cast<double>(std::max(a, b));
  return larger - static_cast<double>(std::min(a, b)) <= 0.03 * larger;
}

}  // namespace

SerialLine::SerialLine(const SerialSettings& settings, std::uint8_t channel, std::uint64_t seed,
                       std::int64_t start_stamp_ns, const FaultPlan& faults, EventQueue& events)
    : settings_(settings),
      channel_(channel),
      random_(mix(seed, 100, channel)),
      faults_(faults),
      events_(events),
      now_ns_(start_stamp_ns),
      host_baud_(settings.first_baud_rate),
      bundle_size_(std::max<std::uint32_t>(1, settings.bundle_bytes)) {}

bool SerialLine::write(std::span<const std::uint8_t> bytes) {
  if (!is_up_ || to_device_.size() + bytes.size() > host_queue_bytes) {
    counters_.bytes_refused += bytes.size();
    return false;
  }
  if (to_device_.empty()) to_device_free_ns_ = std::max(to_device_free_ns_, static_cast<double>(now_ns_));
  to_device_.insert(to_device_.end(), bytes.begin(), bytes.end());
  return true;
}

bool SerialLine::set_baud_rate(std::uint32_t baud) {
  if (baud < 50 || baud > 4'000'000) return false;
  if (to_device_.empty()) host_baud_ = baud;
  next_host_baud_ = to_device_.empty() ? 0 : baud;
  return true;
}

std::vector<std::uint8_t> SerialLine::garbled(std::span<const std::uint8_t> bytes, std::uint32_t from_baud,
                                              std::uint32_t to_baud) {
  const double ratio = std::clamp(static_cast<double>(to_baud) / static_cast<double>(from_baud), 0.1, 2.0);
  const auto count = static_cast<std::size_t>(static_cast<double>(bytes.size()) * ratio + random_.uniform());
  std::vector<std::uint8_t> wrong(count);
  for (std::uint8_t& byte : wrong) byte = static_cast<std::uint8_t>(random_.next());
  counters_.bytes_garbled += bytes.size();
  return wrong;
}

void SerialLine::write(std::span<const std::uint8_t> bytes, std::int64_t start_stamp_ns, std::uint32_t baud) {
  if (bytes.empty()) return;
  Run run;
  run.begin_ns = std::max(start_stamp_ns, to_host_free_ns_);
  run.byte_ns = byte_ns(baud);
  to_host_free_ns_ = run.end_ns(bytes.size() - 1);
  if (!is_up_) {
    counters_.bytes_lost += bytes.size();
    return;
  }
  if (!agree(baud, host_baud_)) {
    run.bytes = garbled(bytes, baud, host_baud_);
    to_host_.push_back(std::move(run));
    return;
  }
  const Injection* garbage = faults_.active(Fault::laser_garbage, channel_, start_stamp_ns);
  const Injection* flips = faults_.active(Fault::laser_crc_errors, channel_, start_stamp_ns);
  const double strewn =
      garbage == nullptr ? 0 : static_cast<double>(number_or(*garbage, 2000)) * run.byte_ns * 1e-9;
  const double flipped = flips == nullptr ? 0 : static_cast<double>(number_or(*flips, 500)) * 1e-6;
  for (std::uint8_t byte : bytes) {
    if (to_lose_ > 0) {
      --to_lose_;
      ++counters_.bytes_lost;
      continue;
    }
    if (strewn > 0 && random_.chance(strewn)) {
      run.bytes.push_back(static_cast<std::uint8_t>(random_.next()));
      ++counters_.bytes_garbled;
    }
    if (flipped > 0 && random_.chance(flipped)) {
      byte = static_cast<std::uint8_t>(byte ^ (1U << random_.integer(0, 7)));
      ++counters_.bytes_garbled;
    }
    run.bytes.push_back(byte);
  }
  if (run.bytes.empty()) return;
  to_host_free_ns_ = std::max(to_host_free_ns_, run.end_ns(run.bytes.size() - 1));
  to_host_.push_back(std::move(run));
}

void SerialLine::set_link(bool is_up, std::int64_t now_ns) {
  has_link_ = true;
  is_up_ = is_up;
  if (!is_up) {
    counters_.bytes_lost += to_device_.size() + bundle_.size();
    for (const Run& run : to_host_) counters_.bytes_lost += run.bytes.size() - run.next;
    to_device_.clear();
    to_host_.clear();
    bundle_.clear();
  }
  Event event;
  event.stamp_ns = now_ns;
  event.kind = EventKind::byte_link;
  event.channel = channel_;
  event.is_up = is_up;
  last_stamp_ns_ = std::max(last_stamp_ns_, now_ns);
  events_.push(now_ns, event);
}

void SerialLine::step_to_device(std::int64_t now_ns) {
  std::vector<std::uint8_t> arrived;
  const double each_ns = byte_ns(host_baud_);
  while (!to_device_.empty() && to_device_free_ns_ + each_ns <= static_cast<double>(now_ns)) {
    to_device_free_ns_ += each_ns;
    arrived.push_back(to_device_.front());
    to_device_.pop_front();
  }
  const std::uint32_t sent_at = host_baud_;
  if (to_device_.empty() && next_host_baud_ != 0) {
    host_baud_ = next_host_baud_;
    next_host_baud_ = 0;
  }
  if (arrived.empty()) return;
  counters_.bytes_to_device += arrived.size();
  if (!agree(sent_at, device_->baud_rate())) arrived = garbled(arrived, sent_at, device_->baud_rate());
  if (!arrived.empty()) device_->on_bytes(arrived, static_cast<std::int64_t>(to_device_free_ns_));
}

void SerialLine::flush(std::int64_t stamp_ns) {
  if (bundle_.empty()) return;
  double late_us = 20 - settings_.latency_us * std::log(1 - random_.uniform());
  if (random_.chance(0.002)) late_us += 2000;  // something else had the processor
  last_stamp_ns_ = std::max(last_stamp_ns_, stamp_ns + static_cast<std::int64_t>(late_us * 1e3));
  Event event;
  event.stamp_ns = last_stamp_ns_;
  event.kind = EventKind::bytes;
  event.channel = channel_;
  counters_.bytes_to_host += bundle_.size();
  events_.push(last_stamp_ns_, event, std::move(bundle_));
  bundle_.clear();
  const double mean = std::max<std::uint32_t>(1, settings_.bundle_bytes);
  bundle_size_ = static_cast<std::size_t>(std::max(1.0, mean * random_.uniform(0.5, 1.5)));
}

void SerialLine::step_to_host(std::int64_t now_ns) {
  const auto pause_ns = static_cast<std::int64_t>(pause_bytes * byte_ns(host_baud_));
  while (!to_host_.empty()) {
    Run& run = to_host_.front();
    if (run.next == run.bytes.size()) {
      to_host_.pop_front();
      continue;
    }
    const std::int64_t end_ns = run.end_ns(run.next);
    if (end_ns > now_ns) break;
    if (!bundle_.empty() && end_ns > bundle_end_ns_ + pause_ns) flush(bundle_end_ns_ + pause_ns);
    bundle_.push_back(run.bytes[run.next++]);
    bundle_end_ns_ = end_ns;
    if (bundle_.size() >= bundle_size_) flush(end_ns);
  }
  if (!bundle_.empty() && now_ns >= bundle_end_ns_ + pause_ns) flush(bundle_end_ns_ + pause_ns);
}

void SerialLine::step(std::int64_t now_ns) {
  if (device_ == nullptr) return;
  const bool is_plugged = faults_.active(Fault::laser_unplugged, channel_, now_ns) == nullptr;
  if (!has_link_ || is_plugged != is_up_) set_link(is_plugged, now_ns);
  if (to_host_.empty() && is_up_) {
    if (const Injection* garbage = faults_.active(Fault::laser_garbage, channel_, now_ns)) {
      const double seconds = static_cast<double>(now_ns - now_ns_) * 1e-9;
      const auto count =
          static_cast<int>(static_cast<double>(number_or(*garbage, 2000)) * seconds + random_.uniform());
      Run run;
      run.begin_ns = std::max(now_ns_, to_host_free_ns_);
      run.byte_ns = byte_ns(host_baud_);
      for (int i = 0; i < count; ++i) run.bytes.push_back(static_cast<std::uint8_t>(random_.next()));
      counters_.bytes_garbled += run.bytes.size();
      if (count > 0) {
        to_host_free_ns_ = run.end_ns(run.bytes.size() - 1);
        to_host_.push_back(std::move(run));
      }
    }
  }
  step_to_device(now_ns);
  device_->poll(now_ns, *this);
  step_to_host(now_ns);
  now_ns_ = now_ns;
}

}  // namespace alces::sim
