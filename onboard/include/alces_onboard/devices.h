// The vehicle's devices, as vehicle.toml names them: made, opened, looked after, closed.
//
//   CAN      motor and odometry         SocketCan     no interface of that name: alcesd cannot start
//   GPIO     encoder                    GpioLines     no such chip or line, line in use: cannot start
//   permit   a socket of ours PermitSocket     no folder for it: cannot start
//   lasers   a serial line or TCP each  SerialPort, TcpConnection     no such file, no such host: cannot
//   start GPS      a serial line              SerialPort    not there: told, and waited for
//
// A CAN interface that is down, a laser that does not answer, whatever is unplugged after the start: the
// device waits for it and says so.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "alces_drivers/scanner/scanner.h"
#include "alces_onboard/status_report.h"
#include "alces_platform/linux/bytes/serial_port.h"
#include "alces_platform/linux/bytes/tcp_connection.h"
#include "alces_platform/linux/can/socket_can.h"
#include "alces_platform/linux/gpio/gpio_lines.h"
#include "alces_platform/linux/permit_socket.h"
#include "alces_platform/settings/vehicle_settings.h"

namespace alces::onboard {

class Devices {
 public:
  /// Makes them; both outlive them.
  Devices(const settings::VehicleSettings& settings, EventLoop& loop);
  Devices(const Devices&) = delete;
  Devices& operator=(const Devices&) = delete;
  ~Devices() = default;

  [[nodiscard]] Scanner::Ports ports();

  /// Error with ExitStatus::device, and a sentence that names the device, when one is not there that must be.
  void open();
  /// Nothing waits to be sent to a laser.
  [[nodiscard]] bool is_idle() const;
  void close();

  [[nodiscard]] BusHealth bus() const;

  /// Calls visit(device, name, value) for every counter of every device.
  template <class Visitor>
  void visit_counters(Visitor&& visit) const {
    const auto visit_of = [&](const char* device, const auto& counters) {
      counters.visit([&](const char* name, std::uint64_t value) { visit(device, name, value); });
    };
    if (can_) {
      visit_of("CAN", can_->bus().counters());
      visit_of("CAN", can_->counters());
      visit_of("CAN", can_->clock_counters());
    }
    if (permit_) visit_of("permit's socket", permit_->counters());
    if (gpio_) visit_of("GPIO", gpio_->counters());
    for (std::size_t i = 0; i < lasers_.size(); ++i) {
      const char* const name = i == 0 ? "laser a's line" : "laser b's line";
      if (lasers_[i].serial) visit_of(name, lasers_[i].serial->counters());
      if (lasers_[i].tcp) visit_of(name, lasers_[i].tcp->counters());
    }
    if (gps_) visit_of("GPS line", gps_->counters());
  }

 private:
  struct LaserDevice {
    std::optional<SerialPort> serial;
    std::optional<TcpConnection> tcp;
  };

  EventLoop& loop_;
  std::string can_name_;
  std::string gps_name_;
  std::optional<SocketCan> can_;
  std::optional<PermitSocket> permit_;
  std::optional<GpioLines> gpio_;
  std::array<LaserDevice, ScannerConfig::maximum_lasers> lasers_;
  std::optional<SerialPort> gps_;
};

}  // namespace alces::onboard
