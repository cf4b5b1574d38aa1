#include "scanner_on_wires.h"

#include <sys/epoll.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "alces_platform/linux/clock.h"

namespace alces::sim {
namespace {

constexpr std::int64_t step_ns = ns_per_ms;
/// Steps in one go: so long the loop hears nothing else.
constexpr int steps_at_once = 20;
constexpr std::int64_t tolerable_ns = ns_per_ms;

SocketCanConfig can_config(const settings::VehicleSettings& vehicle) {
  SocketCanConfig config;
  config.interface_name = vehicle.can_interface.c_str();
  return config;
}

}  // namespace

ScannerOnWires::ScannerOnWires(const ScannerOnWiresSettings& settings, EventLoop& loop)
    : settings_(settings), loop_(loop), can_(loop, can_config(settings_.vehicle)) {
  open_wires();
  SimulatedScannerSettings& simulated = settings_.scanner;
  // The kernel queues more than a controller does, and its queue is no part of the world.
  simulated.rig.can.host_queue_frames = 4096;
  simulated.rig.can.reports_sent = false;
  // Building the town takes a while; the world begins when it is there.
  simulated.rig.motion.seed = simulated.rig.seed;
  auto town = std::make_shared<const Town>(make_tour(simulated.rig.motion).layout);
  world_ns_ = now_ns();
  simulated.rig.motion.start_stamp_ns = world_ns_;
  scanner_ = std::make_unique<SimulatedScanner>(simulated, std::move(town));

  timer_ = FileDescriptor(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
  if (timer_) timer_watch_ = loop_.watch(timer_.number(), EPOLLIN, *this, 0);
  if (!timer_watch_ || !loop_.attach(*this))
    throw std::runtime_error("the event loop has no room for the simulated scanner");
  wake_next();
}

ScannerOnWires::~ScannerOnWires() {
  loop_.unwatch(timer_watch_);
  loop_.detach(*this);
}

void ScannerOnWires::open_wires() {
  const settings::VehicleSettings& vehicle = settings_.vehicle;
  if (!can_.open() && can_.error()[0] != '\0') throw std::runtime_error(can_.error());

  const EncoderConfig& encoder = vehicle.scanner.encoder;
  gpio_.resize(3);
  const std::array<std::uint8_t, 3> lines{encoder.index_line, encoder.a_line, encoder.b_line};
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i] == EncoderConfig::no_line || lines[i] >= vehicle.gpio_lines.size()) continue;
    if (!gpio_[i].open(vehicle.gpio_chip, vehicle.gpio_lines[lines[i]]))
      throw std::runtime_error(gpio_[i].error());
  }

  if (!settings_.tap_line.empty() && !tap_.open(vehicle.gpio_chip, settings_.tap_line))
    throw std::runtime_error(tap_.error());

  const auto link = [this](std::uint8_t channel, const std::string& path) {
    if (!lines_[channel].open(path)) throw std::runtime_error(lines_[channel].error());
  };
  for (std::uint8_t laser = 0; laser < vehicle.scanner.assembler.laser_count; ++laser) {
    const settings::LaserLine& line = vehicle.laser_lines.at(laser);
    if (line.is_tcp || vehicle.scanner.laser_makes.at(laser) != LaserMake::lms2xx)
      throw std::runtime_error("only SICK LMS 2xx on serial lines can be simulated");
    link(static_cast<std::uint8_t>(laser_a_channel + laser), line.device);
  }
  if (vehicle.scanner.has_gps && !vehicle.gps_device.empty()) link(gps_channel, vehicle.gps_device);
}

void ScannerOnWires::on_host_event(const Event& event) {
  // An FD frame would be a form error to this bus' controllers; the kernel's error frames are on no bus.
  if (event.kind != EventKind::can_frame || event.frame.is_error || event.frame.is_fd) return;
  ++figures_.frames_from_host;
  if (!scanner_ || !scanner_->rig().can_port().send(event.frame)) ++figures_.frames_refused;
}

void ScannerOnWires::on_event(const Event& event) {
  const bool leaves =
      event.kind == EventKind::can_frame || event.kind == EventKind::edge || event.kind == EventKind::bytes;
  if (!leaves) return;
  leaving_.push(event.stamp_ns + settings_.latency_ns, event, {event.bytes.begin(), event.bytes.end()});
}

void ScannerOnWires::emit(const Event& event) {
  const std::int64_t late_ns = now_ns() - leaving_ns_;
  figures_.worst_late_ns = std::max(figures_.worst_late_ns, late_ns);
  if (late_ns > tolerable_ns) ++figures_.late;
  if (event.kind == EventKind::can_frame) {
    if (event.frame.is_error) return;
    ++figures_.frames_to_host;
    if (!can_.send(event.frame)) ++figures_.frames_refused;
  } else if (event.kind == EventKind::edge) {
    if (!gpio_[event.edge.line].is_open()) return;
    ++figures_.edges;
    gpio_[event.edge.line].set(event.edge.is_rising);
    if (event.edge.line == HeadEncoderSettings::index_line && tap_.is_open()) tap_.set(event.edge.is_rising);
  } else if (lines_[event.channel].is_open()) {
    lines_[event.channel].write(event.bytes);
  }
}

void ScannerOnWires::take_bytes() {
  std::array<std::uint8_t, 256> room{};
  for (std::uint8_t channel = 0; channel < byte_channel_count; ++channel) {
    PseudoTerminal& line = lines_[channel];
    if (!line.is_open()) continue;
    BytePort& port = scanner_->rig().byte_port(channel);
    if (const std::uint32_t baud = line.baud_rate(); baud != baud_rates_[channel]) {
      baud_rates_[channel] = baud;
      (void)port.set_baud_rate(baud);
    }
    while (true) {
      const auto bytes = line.read(room);
      if (bytes.empty()) break;
      (void)port.write(bytes);
      if (bytes.size() < room.size()) break;
    }
  }
}

void ScannerOnWires::step(std::int64_t now_ns) {
  take_bytes();
  for (int steps = 0; steps < steps_at_once && world_ns_ + step_ns <= now_ns; ++steps) {
    world_ns_ += step_ns;
    scanner_->rig().advance_to(world_ns_, *this);
  }
}

void ScannerOnWires::wake_next() {
  const std::int64_t next_ns = std::min(world_ns_ + step_ns, leaving_.next_due_ns());
  itimerspec once{};
  once.it_value.tv_sec = static_cast<std::time_t>(next_ns / ns_per_s);
  once.it_value.tv_nsec = static_cast<decltype(once.it_value.tv_nsec)>(next_ns % ns_per_s);
  timerfd_settime(timer_.number(), TFD_TIMER_ABSTIME, &once, nullptr);
}

void ScannerOnWires::on_ready(std::uint32_t, std::uint32_t) {
  std::uint64_t times = 0;
  if (::read(timer_.number(), &times, sizeof times) < 0) return;
  step(now_ns());
  leaving_.deliver(now_ns(), leaving_ns_, outlet_);
  wake_next();
}

}  // namespace alces::sim
