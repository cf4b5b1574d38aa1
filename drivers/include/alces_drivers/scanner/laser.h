// The narrow port behind which a laser stands: one more make is one more class.
#pragma once

#include <cstdint>
#include <span>

namespace alces {

enum class LaserState : std::uint8_t { stopped, connecting, configuring, measuring, stopping, failed };
[[nodiscard]] const char* to_string(LaserState state);

class Laser {
 public:
  /// Brings the laser up, until it measures; retried with back-off, for ever, until stop().
  virtual void start(std::int64_t now_ns) = 0;
  /// Ends the stream in order; on_tick() goes on until state() is stopped.
  virtual void stop(std::int64_t now_ns) = 0;

  /// The line or connection came up, or was lost.
  virtual void on_link(bool is_up, std::int64_t now_ns) = 0;
  /// Bytes in the order they came; `stamp_ns`: when the last of them did.
  virtual void on_bytes(std::span<const std::uint8_t> bytes, std::int64_t stamp_ns) = 0;
  /// Time passes: time-outs, retries. At least every 20 ms.
  virtual void on_tick(std::int64_t now_ns) = 0;

  [[nodiscard]] virtual LaserState state() const = 0;
  /// Why it is in this state, for people.
  [[nodiscard]] virtual const char* reason() const = 0;

 protected:
  ~Laser() = default;
};

}  // namespace alces
