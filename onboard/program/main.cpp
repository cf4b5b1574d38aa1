// alcesd: drives the scanner and maps on the vehicle.
#include <CLI/CLI.hpp>

#include "alces_onboard/error.h"
#include "alces_onboard/run.h"

namespace {

constexpr const char* footer = R"(Examples:
  alcesd --config vehicle.toml --dry-run                    check the configuration, print the memory plan
  alcesd --config vehicle.toml --dry-run --dcf motor.dcf    and hold [motor] against the drive's own file
  alcesd --config vehicle.toml --record drive-%t.mcap       map, and record everything; %t is the time of the start
  alcesd --config vehicle.toml --record drive.mcap --no-map record only; `alces replay drive.mcap --out town` maps later

SIGTERM or Ctrl-C stops the lasers and the motor, finishes map and recording, and prints a summary; a second one stops
the motor by quick stop at once; a third one leaves the devices as they are.

Exit status: 0 done, 2 usage, 3 invalid configuration, 4 not enough memory, 5 a device that must be there is not, or a
file that cannot be written, 6 the drive did not confirm that the motor stands: it may turn, 7 the mapper did not come
back from a scan, because a disk does not answer, say: it was left.)";

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Drives the scanner, maps and closes loops while the vehicle moves, and records the drive.",
               "alcesd"};
  app.set_version_flag("--version", "alcesd " ALCES_VERSION);
  app.footer(footer);
  alces::onboard::Options options;
  bool is_without_map = false;
  app.add_option("--config", options.config, "vehicle.toml: what hangs on which wire, and how to map");
  CLI::Option* const dry_run = app.add_flag(
      "--dry-run", options.is_dry_run, "check the configuration and say what would be done; open nothing");
  app.add_option("--dcf", options.dcf, "the drive's EDS or DCF file: does [motor] suit it?")->needs(dry_run);
  app.add_option("--record", options.record, "record to this file, whatever the configuration says");
  app.add_flag("--no-map", is_without_map, "acquire and record only");
  app.add_flag(
      "--reset-motor", options.resets_motor,
      "let the motor of the alcesd that runs begin anew after it was given up; look at the head first");
  try {
    app.parse(argc, argv);
    if (options.config.empty() && !options.resets_motor) throw CLI::RequiredError("--config");
  } catch (const CLI::Success& success) {  // --help, --version
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    std::cerr << "alcesd: " << error.what() << "\nTry 'alcesd --help'.\n";
    return static_cast<int>(alces::onboard::ExitStatus::usage);
  }
  options.maps = !is_without_map;
  return alces::onboard::run_as_program(options, ALCES_VERSION);
}
