// A serial line between the host and one simulated device: bytes take their time on the wire, arrive in
// bundles as a UART hands them over, and are garbled when the two ends do not agree on the rate.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "alces_drivers/port/byte_port.h"
#include "alces_platform/sim/event_queue.h"
#include "alces_platform/sim/fault.h"
#include "alces_platform/sim/random.h"

namespace alces::sim {

/// Where a device's bytes go.
class SerialOutput {
 public:
  /// The first byte leaves at `start_stamp_ns`, or when the bytes before it have left; all at this rate.
  virtual void write(std::span<const std::uint8_t> bytes, std::int64_t start_stamp_ns,
                     std::uint32_t baud) = 0;

 protected:
  ~SerialOutput() = default;
};

class SerialDevice {
 public:
  /// Bytes from the host, at the device's rate; `now_ns`: when the last of them arrived.
  virtual void on_bytes(std::span<const std::uint8_t> bytes, std::int64_t now_ns) = 0;
  /// Called every millisecond: what it has begun to send since the last call.
  virtual void poll(std::int64_t now_ns, SerialOutput& output) = 0;
  /// At which it listens.
  [[nodiscard]] virtual std::uint32_t baud_rate() const = 0;
  /// Faults that happen within the device.
  virtual void on_fault(const Injection& injection) { (void)injection; }

 protected:
  ~SerialDevice() = default;
};

struct SerialSettings {
  std::uint32_t first_baud_rate = 9600;  ///< of the host's end
  std::uint32_t bundle_bytes = 128;      ///< mean size of what the host reads at once; 0.5 to 1.5 times this
  double latency_us = 120;               ///< mean (exponential), from the last byte to the host's time stamp
};

class SerialLine final : public BytePort, private SerialOutput {
 public:
  struct Counters {
    std::uint64_t bytes_to_host = 0;
    std::uint64_t bytes_to_device = 0;
    std::uint64_t bytes_refused = 0;  ///< write() answered false
    std::uint64_t bytes_lost = 0;     ///< by faults, either way
    std::uint64_t bytes_garbled = 0;  ///< arrived wrong, by faults or at the wrong rate
    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("bytes_to_host", bytes_to_host);
      visit("bytes_to_device", bytes_to_device);
      visit("bytes_refused", bytes_refused);
      visit("bytes_lost", bytes_lost);
      visit("bytes_garbled", bytes_garbled);
    }
  };
  static constexpr std::size_t host_queue_bytes = 4096;

  SerialLine(const SerialSettings& settings, std::uint8_t channel, std::uint64_t seed,
             std::int64_t start_stamp_ns, const FaultPlan& faults, EventQueue& events);

  void attach(SerialDevice& device) { device_ = &device; }

  // The host's end.
  [[nodiscard]] bool write(std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] bool set_baud_rate(std::uint32_t baud) override;

  /// Lets time pass: what arrives at the device and at the host up to `now_ns`.
  void step(std::int64_t now_ns);
  /// The next bytes to the host are lost (Fault::laser_half_telegram).
  void lose(std::uint64_t bytes) { to_lose_ += bytes; }
  void on_fault(const Injection& injection) {
    if (device_ != nullptr) device_->on_fault(injection);
  }
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  struct Run {  ///< bytes on their way to the host, one after the other
    std::vector<std::uint8_t> bytes;
    std::size_t next = 0;
    std::int64_t begin_ns = 0;
    double byte_ns = 0;
    [[nodiscard]] std::int64_t end_ns(std::size_t byte) const {
      return begin_ns + static_cast<std::int64_t>(byte_ns * static_cast<double>(byte + 1));
    }
  };
  void write(std::span<const std::uint8_t> bytes, std::int64_t start_stamp_ns,
             std::uint32_t baud) override;  // the device's end
  void set_link(bool is_up, std::int64_t now_ns);
  void step_to_device(std::int64_t now_ns);
  void step_to_host(std::int64_t now_ns);
  void flush(std::int64_t stamp_ns);
  /// What arrives of bytes that are sent at one rate and listened to at another.
  [[nodiscard]] std::vector<std::uint8_t> garbled(std::span<const std::uint8_t> bytes,
                                                  std::uint32_t from_baud, std::uint32_t to_baud);

  SerialSettings settings_;
  std::uint8_t channel_;
  Random random_;
  const FaultPlan& faults_;
  EventQueue& events_;
  SerialDevice* device_ = nullptr;
  bool is_up_ = false;
  bool has_link_ = false;  ///< is_up_ has been told
  std::int64_t now_ns_;

  std::uint32_t host_baud_;
  std::uint32_t next_host_baud_ = 0;  ///< once the queue is empty; 0: none
  std::deque<std::uint8_t> to_device_;
  double to_device_free_ns_ = 0;  ///< when the wire to the device is free

  std::deque<Run> to_host_;
  std::int64_t to_host_free_ns_ = 0;
  std::vector<std::uint8_t> bundle_;
  std::size_t bundle_size_;
  std::int64_t bundle_end_ns_ = 0;
  std::int64_t last_stamp_ns_ = 0;
  std::uint64_t to_lose_ = 0;
  Counters counters_;
};

}  // namespace alces::sim
