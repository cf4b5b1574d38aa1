#include "alces_onboard/devices.h"

#include <vector>

#include "alces_onboard/error.h"
#include "alces_platform/linux/clock.h"

namespace alces::onboard {
namespace {

/// An LMS 2xx wants a pause after each byte at the rate that it has when it is switched on.
constexpr std::int64_t lms2xx_byte_gap_ns = 55 * ns_per_us;
constexpr std::uint32_t lms2xx_power_up_baud = 9600;

std::string sentence(const char* error, const char* otherwise) {
  return error[0] != '\0' ? error : otherwise;
}

}  // namespace

Devices::Devices(const settings::VehicleSettings& settings, EventLoop& loop)
    : loop_(loop), can_name_(settings.can_interface), gps_name_(settings.gps_device) {
  const ScannerConfig& scanner = settings.scanner;
  if (scanner.has_motor || scanner.has_odometry) {
    SocketCanConfig config;
    config.interface_name = can_name_.c_str();
    can_.emplace(loop, config);
  }
  if (scanner.has_motor && scanner.motor.permit.source == PermitSource::socket)
    permit_.emplace(loop, settings.permit_socket.c_str());
  if (!settings.gpio_lines.empty()) {
    std::vector<GpioLine> lines;
    for (const std::string& name : settings.gpio_lines) {
      GpioLine line;
      line.line = name.c_str();
      lines.push_back(line);
    }
    GpioConfig config;
    config.chip = settings.gpio_chip.c_str();
    config.lines = lines;
    config.consumer = "alcesd";
    gpio_.emplace(loop, config);
  }
  for (std::uint32_t i = 0; i < scanner.assembler.laser_count; ++i) {
    const settings::LaserLine& line = settings.laser_lines[i];
    const auto channel = static_cast<std::uint8_t>(laser_a_channel + i);
    if (line.is_tcp) {
      TcpConnectionConfig config;
      config.host = line.host.c_str();
      config.port = line.port;
      config.channel = channel;
      lasers_[i].tcp.emplace(loop, config);
    } else {
      SerialPortConfig config;
      config.path = line.device.c_str();
      config.channel = channel;
      config.baud = lms2xx_power_up_baud;  // the driver finds the right one
      config.byte_gap_ns = lms2xx_byte_gap_ns;
      config.byte_gap_baud = lms2xx_power_up_baud;
      lasers_[i].serial.emplace(loop, config);
    }
  }
  if (scanner.has_gps && !settings.gps_device.empty()) {
    SerialPortConfig config;
    config.path = gps_name_.c_str();
    config.channel = gps_channel;
    config.baud = settings.gps_baud;
    gps_.emplace(loop, config);
  }
}

Scanner::Ports Devices::ports() {
  Scanner::Ports ports;
  if (can_) ports.can = &*can_;
  for (std::size_t i = 0; i < lasers_.size(); ++i) {
    if (lasers_[i].serial) ports.lasers[i] = &*lasers_[i].serial;
    if (lasers_[i].tcp) ports.lasers[i] = &*lasers_[i].tcp;
  }
  return ports;
}

void Devices::open() {
  // A bus that is there and down has no error(): it is waited for.
  if (can_ && !can_->open() && can_->error()[0] != '\0') throw Error(ExitStatus::device, can_->error());
  if (permit_ && !permit_->open()) throw Error(ExitStatus::device, permit_->error());
  if (gpio_ && !gpio_->open())
    throw Error(ExitStatus::device, sentence(gpio_->error(), "the GPIO lines cannot be opened"));
  for (LaserDevice& laser : lasers_) {
    if (laser.serial && !laser.serial->open())
      throw Error(ExitStatus::device,
                  sentence(laser.serial->error(), "a laser's serial line cannot be opened"));
    if (laser.tcp && !laser.tcp->open())
      throw Error(ExitStatus::device, sentence(laser.tcp->error(), "a laser cannot be connected to"));
  }
  if (gps_ && !gps_->open())
    loop_.raise(now_ns(), Severity::warning, "gps",
                "its serial line is not there; going on without, until it is");
}

bool Devices::is_idle() const {
  for (const LaserDevice& laser : lasers_) {
    if (laser.serial && laser.serial->is_open() && !laser.serial->is_idle()) return false;
    if (laser.tcp && laser.tcp->is_up() && !laser.tcp->is_idle()) return false;
  }
  return true;
}

void Devices::close() {
  if (can_) can_->close();
  if (permit_) permit_->close();
  if (gpio_) gpio_->close();
  for (LaserDevice& laser : lasers_) {
    if (laser.serial) laser.serial->close();
    if (laser.tcp) laser.tcp->close();
  }
  if (gps_) gps_->close();
}

BusHealth Devices::bus() const {
  if (!can_) return {};
  const CanBus::Counters& bus = can_->bus().counters();
  const SocketCan::Counters& socket = can_->counters();
  return {can_name_.c_str(), to_string(can_->bus().state()), bus.frames,
          bus.error_frames + socket.receive_overflows + socket.send_refused};
}

}  // namespace alces::onboard
