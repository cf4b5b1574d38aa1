// alces-scanner-sim: a simulated vehicle on the kernel's wires, for alcesd to drive.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>

#include "alces_platform/linux/event_loop.h"
#include "alces_platform/linux/realtime.h"
#include "alces_platform/settings/settings_error.h"
#include "alces_platform/settings/vehicle_settings.h"
#include "scanner_on_wires.h"

namespace alces::sim {
namespace {

constexpr const char* footer = R"(Examples:
  ip link add vcan0 type vcan && ip link set vcan0 up      (and a chip of gpio-sim; [can], [gpio] and [laser.*] name them)
  alces-scanner-sim --config vehicle.toml --scans 40 &     once around a block
  alcesd --config vehicle.toml --record drive.mcap         a vehicle like any other

Both read the same vehicle.toml: frames go to its CAN interface, edges to its lines of a gpio-sim chip, and links to pseudo
terminals are made where it names the serial lines. The motor drive, the lasers and what errs how much are those of
`alces simulate`. Says on standard output when the wires are there, when the vehicle rolls, and when it stands again; then
goes on standing there, until SIGTERM or Ctrl-C.

Exit status: 0 done, 2 usage, 3 invalid configuration, 5 a wire that is not there or a file that cannot be written.)";

struct Options {
  std::string config;
  std::string truth;
  std::string tap_line;
  std::uint64_t seed = 1;
  std::size_t scans = 924;
  double speed_m_per_s = 0;
  double standstill_s = 6;
  std::uint32_t rings = 0;
  double snow_share = 0;
  std::size_t people = 0;
  int fifo_priority = 0;
};

/// The loop's events and notices, before and after there is a scanner for them.
class Host final : public EventSink, public NoticePort {
 public:
  void on_event(const Event& event) override {
    if (wires != nullptr) wires->on_host_event(event);
  }
  void raise(const Notice& notice) override {
    if (notice.severity != Severity::info)
      fmt::print(stderr, "alces-scanner-sim: {}: {}\n", notice.source, notice.text);
  }
  ScannerOnWires* wires = nullptr;
};

/// The true poses in TUM's form, in the host's time; the map's origin is the vehicle at the start.
class Truth {
 public:
  explicit Truth(const std::string& name) : name_(name) {
    if (name.empty()) return;
    file_.reset(std::fopen(name.c_str(), "w"));
    if (!file_) throw std::runtime_error(name + ": the truth cannot be written");
  }
  void write_until(const ScannerOnWires& wires, const SimulatedRig& rig) {
    if (!file_) return;
    const std::int64_t start_ns = rig.motion().start_stamp_ns();
    if (written_ns_ == 0) written_ns_ = start_ns;
    for (; written_ns_ + interval_ns <= wires.world_ns(); written_ns_ += interval_ns) {
      const Pose pose = rig.map_from_body(written_ns_, start_ns);
      const auto& at = pose.translation_m;
      const auto& turn = pose.rotation;
      fmt::print(file_.get(), "{:.6f} {:.5f} {:.5f} {:.5f} {:.7f} {:.7f} {:.7f} {:.7f}\n",
                 seconds(written_ns_ + wires.latency_ns()), at.x(), at.y(), at.z(), turn.x(), turn.y(),
                 turn.z(), turn.w());
    }
  }
  void close() {
    if (file_ && std::fclose(file_.release()) != 0)
      throw std::runtime_error(name_ + ": the truth cannot be written; is there room on the disk?");
  }

 private:
  static constexpr std::int64_t interval_ns = 5 * ns_per_ms;  ///< 6 mm at 1.1 m/s
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string name_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::int64_t written_ns_ = 0;
};

void say(const std::string& sentence) {
  fmt::print("{}\n", sentence);
  std::fflush(stdout);  // a script waits for it
}

void print_summary(ScannerOnWires& wires) {
  const ScannerOnWires::Figures& figures = wires.figures();
  SimulatedScanner& scanner = wires.scanner();
  say(fmt::format("head: {:.2f} rpm; motor: {}", 60 * scanner.drive().head_turns_per_s_at(wires.world_ns()),
                  to_string(scanner.drive().state())));
  say(fmt::format("CAN: {} frames to the host, {} from it, {} refused; GPIO: {} edges",
                  figures.frames_to_host, figures.frames_from_host, figures.frames_refused, figures.edges));
  for (std::uint8_t channel = 0; channel < byte_channel_count; ++channel) {
    const PseudoTerminal::Counters& line = wires.line(channel).counters();
    if (!wires.line(channel).is_open()) continue;
    say(fmt::format("{}: {} bytes to the host, {} from it, {} lost", wires.line(channel).link(),
                    line.bytes_sent, line.bytes_received, line.bytes_lost));
  }
  say(fmt::format("{} of them left late, by {:.1f} ms at worst", figures.late,
                  static_cast<double>(figures.worst_late_ns) * 1e-6));
}

void run(const Options& options) {
  ScannerOnWiresSettings settings;
  settings.vehicle = settings::read_vehicle_settings(options.config);
  RigSettings& rig = settings.scanner.rig;
  rig.seed = options.seed;
  rig.motion.scans = options.scans;
  rig.motion.standstill_s = options.standstill_s;
  if (options.speed_m_per_s > 0) rig.motion.mean_speed_m_per_s = options.speed_m_per_s;
  rig.rings.count = options.rings;
  rig.range_errors.snow_share = options.snow_share;
  rig.crowd.people = options.people;
  rig.lasers = static_cast<std::uint8_t>(settings.vehicle.scanner.assembler.laser_count);
  rig.has_gps = settings.vehicle.scanner.has_gps;
  rig.field_of_view_rad = settings.vehicle.scanner.lms2xx[0].field_of_view_deg * std::numbers::pi / 180;
  rig.gps.baud_rate = settings.vehicle.gps_baud;
  const EncoderConfig& encoder = settings.vehicle.scanner.encoder;
  if (encoder.shape == AngleShape::quadrature)
    rig.encoder.quadrature_lines = static_cast<std::uint32_t>(encoder.quadrature_counts_per_turn / 4);
  settings.tap_line = options.tap_line;
  // One sweep at a time: a batch would hold up everything else on its way.
  rig.sweeps_cast_ahead = 1;
  rig.is_parallel = false;
  settings.scanner.drive.slave.node = settings.vehicle.scanner.motor.node;

  Truth truth(options.truth);
  Host host;
  EventLoop loop(host, host);
  if (!loop.open({})) throw std::runtime_error(loop.error());
  ScannerOnWires wires(settings, loop);
  if (options.fifo_priority > 0) {
    if (const Message refused = set_fifo_priority(options.fifo_priority); !refused.empty())
      fmt::print(stderr, "alces-scanner-sim: {}\n", refused.text());
  }
  host.wires = &wires;
  const SimulatedRig& world = wires.scanner().rig();
  say(fmt::format("ready: {}, a drive of {:.0f} s begins in {:.0f} s", settings.vehicle.can_interface,
                  seconds(world.motion().stop_stamp_ns() - world.motion().roll_stamp_ns()),
                  seconds(world.motion().roll_stamp_ns() - world.motion().start_stamp_ns())));
  bool has_rolled = false;
  bool has_stopped = false;
  while (loop.stop_requests() == 0) {
    loop.run_once();
    truth.write_until(wires, world);
    if (!has_rolled && wires.world_ns() >= world.motion().roll_stamp_ns()) {
      has_rolled = true;
      say("rolls");
    }
    if (!has_stopped && wires.world_ns() >= world.motion().stop_stamp_ns()) {
      has_stopped = true;
      say(fmt::format("stands again, after {:.0f} m", world.motion().way_m(wires.world_ns())));
    }
  }
  print_summary(wires);
  truth.close();
}

int complain(int status, const std::string& sentence) {
  fmt::print(stderr, "alces-scanner-sim: {}\n", sentence);
  return status;
}

}  // namespace
}  // namespace alces::sim

int main(int argc, char** argv) {
  using namespace alces::sim;
  CLI::App app{"A simulated vehicle with its scanner, on CAN, GPIO and serial lines of this machine.",
               "alces-scanner-sim"};
  app.set_version_flag("--version", "alces-scanner-sim " ALCES_VERSION);
  app.footer(footer);
  Options options;
  app.add_option("--config", options.config, "vehicle.toml: which wires, and what hangs on them")->required();
  app.add_option("--truth", options.truth, "write the true poses to this file (TUM), for alces evaluate");
  app.add_option("--tap", options.tap_line,
                 "one more line of the chip that gets the index pulse, for gpiomon: a line has one reader");
  app.add_option("--seed", options.seed, "another seed is another town, drive and noise")
      ->capture_default_str();
  app.add_option("--scans", options.scans, "how long the drive is, in scans of 1.2 s")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_option("--speed", options.speed_m_per_s, "mean speed of the vehicle in m/s; 0: about 1.1")
      ->check(CLI::Range(0.0, 5.0))
      ->capture_default_str();
  app.add_option("--standstill", options.standstill_s, "seconds until it rolls")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
  app.add_option("--rings", options.rings, "as of alces simulate: so many rays a sweep; 0: all")
      ->check(CLI::Range(0, 31))
      ->capture_default_str();
  app.add_option("--snow", options.snow_share, "share of the rays that meet a snowflake")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--crowd", options.people, "so many people walk around the vehicle")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app.add_option("--fifo-priority", options.fifo_priority,
                 "SCHED_FIFO: the outside world waits for no processor; 0: it does")
      ->check(CLI::Range(0, 99))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
    run(options);
  } catch (const CLI::Success& success) {  // --help, --version
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    return complain(2, std::string(error.what()) + "\nTry 'alces-scanner-sim --help'.");
  } catch (const alces::settings::Error& error) {
    return complain(3, error.what());
  } catch (const std::exception& error) {
    return complain(5, error.what());
  }
  return 0;
}
