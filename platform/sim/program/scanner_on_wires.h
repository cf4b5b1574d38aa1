// The simulated vehicle with its scanner (alces_platform/sim/simulated_scanner.h) on the kernel's wires, in
// real time: frames on a CAN interface, edges on lines of gpio-sim, bytes on pseudo terminals. To a program
// on the same machine it is a vehicle.
//
// The world's clock is CLOCK_MONOTONIC. It goes on in steps of a millisecond, and everything that it sends
// leaves `latency_ns` after its simulated time, so that the spacing of edges, frames and bytes is that of the
// world and not that of the steps: to the host, the whole world is late by that much, and nothing in it
// against anything else. What the host sends is in the world with the next step. Truth is written in the
// host's time.
//
// Where the machine is too slow the world falls behind and catches up: figures() says how late things left.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "alces_platform/linux/can/socket_can.h"
#include "alces_platform/linux/event_loop.h"
#include "alces_platform/settings/vehicle_settings.h"
#include "alces_platform/sim/event_queue.h"
#include "alces_platform/sim/simulated_scanner.h"
#include "gpio_sim_line.h"
#include "pseudo_terminal.h"

namespace alces::sim {

struct ScannerOnWiresSettings {
  SimulatedScannerSettings scanner;  ///< start stamps are set to the present
  /// Which wires: interface, chip and lines, the links to the serial lines, which node, what is there at all.
  settings::VehicleSettings vehicle;
  /// One more line of the chip with the index pulse, for gpiomon: a line has one reader. Empty: none.
  std::string tap_line;
  std::int64_t latency_ns = 3'000'000;
};

class ScannerOnWires final : public EventSource, private EventSink {
 public:
  struct Figures {
    std::uint64_t frames_to_host = 0;
    std::uint64_t frames_from_host = 0;
    std::uint64_t frames_refused = 0;  ///< by the interface, or by the world's bus, which takes time for them
    std::uint64_t edges = 0;
    std::uint64_t late = 0;  ///< left more than a millisecond late
    std::int64_t worst_late_ns = 0;
  };

  /// std::runtime_error: a sentence, when a wire is not there.
  ScannerOnWires(const ScannerOnWiresSettings& settings, EventLoop& loop);
  ScannerOnWires(const ScannerOnWires&) = delete;
  ScannerOnWires& operator=(const ScannerOnWires&) = delete;
  ~ScannerOnWires();

  /// The loop's events come here: what the host sends on the bus.
  void on_host_event(const Event& event);

  [[nodiscard]] SimulatedScanner& scanner() { return *scanner_; }
  /// How far the world is.
  [[nodiscard]] std::int64_t world_ns() const { return world_ns_; }
  [[nodiscard]] std::int64_t latency_ns() const { return settings_.latency_ns; }
  [[nodiscard]] const Figures& figures() const { return figures_; }
  /// Of the three byte channels; those that are not wired have counted nothing.
  [[nodiscard]] const PseudoTerminal& line(std::uint8_t channel) const { return lines_.at(channel); }

 private:
  /// Takes what leaves the world, when its time has come.
  class Outlet final : public EventSink {
   public:
    explicit Outlet(ScannerOnWires& wires) : wires_(wires) {}
    void on_event(const Event& event) override { wires_.emit(event); }

   private:
    ScannerOnWires& wires_;
  };

  void open_wires();
  void on_event(const Event& event) override;  // of the world
  void emit(const Event& event);
  void step(std::int64_t now_ns);
  void take_bytes();
  void wake_next();

  void on_ready(std::uint32_t token, std::uint32_t epoll_events) override;
  void on_tick(std::int64_t) override {}
  void flush(std::int64_t) override {}

  ScannerOnWiresSettings settings_;
  EventLoop& loop_;
  std::unique_ptr<SimulatedScanner> scanner_;
  SocketCan can_;
  std::vector<GpioSimLine> gpio_;  ///< by HeadEncoderSettings' numbers; not open: not wired
  GpioSimLine tap_;
  std::array<PseudoTerminal, byte_channel_count> lines_;
  std::array<std::uint32_t, byte_channel_count> baud_rates_{};
  FileDescriptor timer_;
  EventLoop::Watch timer_watch_;
  Outlet outlet_{*this};
  EventQueue leaving_;
  std::int64_t leaving_ns_ = 0;  ///< due time of what is leaving
  std::int64_t world_ns_ = 0;
  Figures figures_;
};

}  // namespace alces::sim
