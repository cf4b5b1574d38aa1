#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "alces_onboard/plan.h"
#include "alces_onboard/recorder/recording_name.h"
#include "alces_onboard/run_lock.h"
#include "onboard/vehicle_bench.h"

using namespace alces;
using namespace alces::onboard;
using Catch::Matchers::Contains;

namespace {

class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "alcesd_test_XXXXXX").string();
    REQUIRE(::mkdtemp(name.data()) != nullptr);
    path_ = name;
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] std::filesystem::path write(const std::string& name, const std::string& content) const {
    std::ofstream(path_ / name) << content;
    return path_ / name;
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

struct Outcome {
  int status = -1;
  std::string output;  ///< both streams
};

Outcome run(const std::string& command) {
  Outcome outcome;
  std::FILE* const pipe = ::popen((command + " 2>&1").c_str(), "r");
  REQUIRE(pipe != nullptr);
  std::array<char, 4096> buffer{};
  while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe))
    outcome.output.append(buffer.data(), count);
  const int status = ::pclose(pipe);
  if (WIFEXITED(status)) outcome.status = WEXITSTATUS(status);
  return outcome;
}

Outcome alcesd(const std::string& arguments) {
  return run(std::string(ALCESD_PROGRAM) + " " + arguments);
}

}  // namespace

TEST_CASE("alcesd --dry-run says what memory is taken, what fits and what would be opened") {
  const Folder folder;
  settings::VehicleSettings vehicle = settings::default_vehicle_settings();
  vehicle.memory_bytes = std::size_t{48} << 20;
  const auto file = folder.write("vehicle.toml", settings::to_toml(vehicle));
  const Outcome outcome = alcesd("--config " + file.string() + " --dry-run --record drive-%t.mcap");
  INFO(outcome.output);
  CHECK(outcome.status == 0);
  CHECK_THAT(outcome.output, Contains("vehicle.toml is in order") && Contains("48.0 MiB allowed") &&
                                 Contains("poses and edges") && Contains("pool of stored scans") &&
                                 Contains("cache") && Contains("scan slots") && Contains("scanner") &&
                                 Contains("recorder") && Contains("in all"));
  CHECK_THAT(outcome.output, Contains("can0") && Contains("gpiochip0, line 17") &&
                                 Contains("/dev/ttyUSB0, LMS 2xx") && Contains("/dev/ttyUSB2, 9600 baud") &&
                                 Contains("drive-%t.mcap"));
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);  // nothing was made
}

TEST_CASE("alcesd --dry-run says who lets the head turn and what stops it") {
  const Folder folder;
  settings::VehicleSettings vehicle = settings::default_vehicle_settings();
  const auto dry_run = [&] {
    return alcesd("--dry-run --config " + folder.write("vehicle.toml", settings::to_toml(vehicle)).string())
        .output;
  };
  CHECK_THAT(dry_run(), Contains("nobody is asked") && Contains("at most 25 s after the signal") &&
                            !Contains("warning: turns on when alcesd is killed"));
  vehicle.scanner.motor.permit.source = PermitSource::socket;
  vehicle.scanner.motor.own_heartbeat_timeout_ms = 0;
  CHECK_THAT(dry_run(), Contains("a permit by datagrams to /run/alces/permit") &&
                            Contains("warning: turns on when alcesd is killed or the cable is cut"));
}

TEST_CASE("the plan takes no more than is allowed, and fills in what the configuration leaves open") {
  settings::VehicleSettings vehicle = settings::default_vehicle_settings();
  Options options;
  options.config = "vehicle.toml";
  for (const std::size_t mib : {32U, 64U, 256U}) {
    vehicle.memory_bytes = mib << 20;
    const Plan without = make_plan(vehicle, options);
    CHECK(without.memory.mapper_bytes <= vehicle.memory_bytes);
    CHECK(without.memory.mapper_bytes > vehicle.memory_bytes / 10 * 9);
    CHECK(without.map.pool_bytes >= settings::largest_stored_scan(without.pipeline.mapping.mapper));
    vehicle.archive = "/tmp/archive";
    const Plan with = make_plan(vehicle, options);
    vehicle.archive.clear();
    CHECK(with.memory.mapper_bytes <= vehicle.memory_bytes);
    CHECK(with.pipeline.mapping.mapper.scan_capacity > without.pipeline.mapping.mapper.scan_capacity);
  }
  options.maps = false;
  CHECK(make_plan(vehicle, options).memory.mapper_bytes == 0);
}

TEST_CASE("memory that is too small is a configuration error that says how much is needed") {
  const Folder folder;
  settings::VehicleSettings vehicle = settings::default_vehicle_settings();
  vehicle.memory_bytes = std::size_t{1} << 20;
  const auto file = folder.write("vehicle.toml", settings::to_toml(vehicle));
  const Outcome outcome = alcesd("--dry-run --config " + file.string());
  CHECK(outcome.status == 3);
  CHECK_THAT(outcome.output,
             Contains("vehicle.toml: 1.0 MiB of memory are not enough for one scan of up to") &&
                 Contains("give at least ") && Contains(" KiB\n"));
}

TEST_CASE("memory that the machine does not have ends alcesd with a sentence that says what it was for") {
  if (std::string(ALCESD_PROGRAM).find("asan") != std::string::npos)
    return;  // it takes terabytes of addresses
  const Folder folder;
  settings::VehicleSettings vehicle = settings::default_vehicle_settings();
  vehicle.memory_bytes = std::size_t{3} << 30;
  const auto file = folder.write("vehicle.toml", settings::to_toml(vehicle));
  const Outcome outcome = run("ulimit -v 2000000; exec " + std::string(ALCESD_PROGRAM) + " --config " +
                              file.string() + " --record " + (folder.path() / "drive.mcap").string());
  CHECK(outcome.status == 4);
  CHECK_THAT(outcome.output,
             Contains("alcesd: the machine has not the memory that is configured (taking the mapper's"));
  CHECK_FALSE(std::filesystem::exists(folder.path() / "drive.mcap"));
}

TEST_CASE("alcesd --dry-run --dcf holds the motor's table against the drive's own file") {
  const Folder folder;
  const auto config = folder.write("vehicle.toml", settings::default_vehicle_settings().text);
  const auto eds = folder.write("drive.eds", "[1000]\nParameterName=A\nDataType=7\nAccessType=ro\n");
  const std::string dry_run = "--config " + config.string() + " --dry-run --dcf ";
  const Outcome lacking = alcesd(dry_run + eds.string());
  CHECK(lacking.status == 3);
  CHECK_THAT(lacking.output, Contains("vehicle.toml:") &&
                                 Contains("motor.tpdos: the drive has no 0x6041:00") &&
                                 Contains("drive.eds)"));
  const Outcome absent = alcesd(dry_run + (folder.path() / "absent.eds").string());
  CHECK(absent.status == 3);
  CHECK_THAT(absent.output, Contains("absent.eds: is no file"));
  CHECK(alcesd("--config " + config.string() + " --dcf " + eds.string()).status == 2);
}

TEST_CASE("wrong usage and wrong configurations have their exit statuses and name file and line") {
  const Folder folder;
  CHECK(alcesd("").status == 2);
  CHECK(alcesd("--config x --frobnicate").status == 2);
  CHECK(alcesd("--version").status == 0);
  CHECK(alcesd("--help").status == 0);
  const Outcome absent = alcesd("--dry-run --config " + (folder.path() / "absent.toml").string());
  CHECK(absent.status == 3);
  CHECK_THAT(absent.output, Contains("absent.toml"));
  const auto wrong = folder.write("wrong.toml", "# a comment\n[no_such_table]\nx = 1\n");
  const Outcome unknown = alcesd("--dry-run --config " + wrong.string());
  CHECK(unknown.status == 3);
  CHECK_THAT(unknown.output, Contains("wrong.toml:2"));
  CHECK(std::count(unknown.output.begin(), unknown.output.end(), '\n') == 1);
}

TEST_CASE("what the machine or the drive cannot do is refused with file and line") {
  const Folder folder;
  const auto refused = [&](const std::string& keys) {
    const auto file = folder.write("vehicle.toml", keys);
    const Outcome outcome = alcesd("--dry-run --config " + file.string());
    CHECK(outcome.status == 3);
    CHECK(std::count(outcome.output.begin(), outcome.output.end(), '\n') == 1);
    return outcome.output;
  };
  CHECK_THAT(refused("[program]\nscan_slots = 2\nprocessor = 1000\n"),
             Contains("vehicle.toml:3: program.processor is 1000, but this machine has "));
  CHECK_THAT(
      refused("[motor]\nheartbeat_period_ms = 500\nheartbeat_timeout_ms = 350\n"),
      Contains("vehicle.toml:3: motor.heartbeat_timeout_ms is 350, but a heartbeat comes every 500 ms"));
  CHECK_THAT(
      refused("[motor]\nown_heartbeat_timeout_ms = 100\n"),
      Contains(
          "vehicle.toml:2: motor.own_heartbeat_timeout_ms is 100, but our heartbeat goes out every 100"));
  CHECK_THAT(
      refused("[motor]\n\nown_heartbeat_timeout_ms = 100\nown_heartbeat_period_ms = 0\n"),
      Contains("vehicle.toml:3: motor.own_heartbeat_timeout_ms is 100, but own_heartbeat_period_ms is 0"));
  CHECK_THAT(refused("[motor]\nsync_period_ms = 0.5\n"),
             Contains("vehicle.toml:2: motor.sync_period_ms is below 1 ms"));
  CHECK_THAT(refused("[motor]\npermit = \"gpio\"\npermit_line = 7\n"),
             Contains("vehicle.toml:3: motor.permit_line is 7, but gpio.lines has 1 entries"));
  if (::geteuid() != 0)
    CHECK_THAT(refused("[program]\nfifo_priority = 90\n"),
               Contains("vehicle.toml:2: program.fifo_priority is 90, but no more than "));
}

TEST_CASE("a recording that cannot be written stops alcesd before anything is opened") {
  const Folder folder;
  const auto file = folder.write("vehicle.toml", settings::default_vehicle_settings().text);
  const Outcome outcome =
      alcesd("--config " + file.string() + " --record " + (folder.path() / "absent" / "drive.mcap").string());
  CHECK(outcome.status == 5);
  CHECK_THAT(outcome.output, Contains("drive.mcap: the recording cannot be written"));
}

TEST_CASE("a CAN interface that is not there stops alcesd with a sentence, and leaves no empty recording") {
  const Folder folder;
  settings::VehicleSettings vehicle = settings::default_vehicle_settings();
  vehicle.can_interface = "nosuchcan9";
  const auto file = folder.write("vehicle.toml", settings::to_toml(vehicle));
  const Outcome outcome =
      alcesd("--config " + file.string() + " --record " + (folder.path() / "drive.mcap").string());
  INFO(outcome.output);
  CHECK(outcome.status == 5);
  CHECK_THAT(outcome.output, Contains("alcesd: ") && Contains("CAN"));
  CHECK_FALSE(std::filesystem::exists(folder.path() / "drive.mcap"));
}

TEST_CASE(
    "alcesd waits for devices that do not answer, on SIGTERM its recording is whole, and a drive that never "
    "answered is no drive that stands: exit status 6") {
  if (!std::filesystem::exists("/sys/class/net/vcan0")) {
    WARN("skipped: there is no interface vcan0");
    return;
  }
  const Folder folder;
  settings::VehicleSettings vehicle = settings::default_vehicle_settings();
  vehicle.can_interface = "vcan0";
  vehicle.scanner.motor.stop_timeout_ns = vehicle.scanner.motor.stop_confirm_timeout_ns = ns_per_s;
  vehicle.scanner.has_gps = false;
  vehicle.gps_device.clear();
  vehicle.gpio_lines.clear();
  vehicle.scanner.encoder.index_line = EncoderConfig::no_line;
  vehicle.scanner.assembler.laser_count = 1;
  vehicle.scanner.laser_makes[0] = LaserMake::cola_b;
  vehicle.laser_lines[0] = {.is_tcp = true, .device = "", .host = "127.0.0.1", .port = 9};
  const auto file = folder.write("vehicle.toml", settings::to_toml(vehicle));
  const auto drive = folder.path() / "drive.mcap";
  const std::string command = "timeout --preserve-status -s TERM 2 " + std::string(ALCESD_PROGRAM) +
                              " --config " + file.string() + " --record " + drive.string();
  const Outcome outcome = run(command);
  INFO(outcome.output);
  CHECK(outcome.status == 6);
  CHECK_THAT(outcome.output, Contains("told to stop") && Contains("0 scans") && Contains("drive.mcap"));
  CHECK_THAT(outcome.output, Contains("alcesd: THE HEAD MAY TURN: the drive did not confirm"));
  FileSource source(drive.c_str());
  const RecordingSummary summary = summarise_recording(source);
  CHECK(summary.is_whole);
  CHECK(summary.has_configuration);
  CHECK(summary.messages > 100);  // ticks
}

TEST_CASE("alcesd --reset-motor reaches the process that holds the lock, and says when there is none") {
  const Folder folder;
  const std::string reset = "XDG_RUNTIME_DIR= RUNTIME_DIRECTORY=" + folder.path().string() + " " +
                            ALCESD_PROGRAM + " --reset-motor";
  const Outcome none = run(reset);
  CHECK(none.status == 5);
  CHECK_THAT(none.output, Contains("no alcesd runs here"));

  int ready[2];
  REQUIRE(::pipe(ready) == 0);
  const pid_t running = ::fork();
  REQUIRE(running >= 0);
  if (running == 0) {  // what alcesd does at its start
    sigset_t reset_signal;
    sigemptyset(&reset_signal);
    sigaddset(&reset_signal, SIGUSR1);
    sigprocmask(SIG_BLOCK, &reset_signal, nullptr);
    ::setenv("RUNTIME_DIRECTORY", folder.path().c_str(), 1);
    RunLock lock;
    const bool is_alone = lock.take();
    if (::write(ready[1], "x", 1) != 1) ::_exit(3);
    const timespec limit{30, 0};
    const bool was_told = sigtimedwait(&reset_signal, nullptr, &limit) == SIGUSR1;
    ::_exit(is_alone && was_told ? 0 : 1);
  }
  char byte = 0;
  REQUIRE(::read(ready[0], &byte, 1) == 1);
  const Outcome outcome = run(reset);
  INFO(outcome.output);
  CHECK(outcome.status == 0);
  CHECK_THAT(outcome.output, Contains("was told to reset its motor"));
  int status = -1;
  REQUIRE(::waitpid(running, &status, 0) == running);
  CHECK((WIFEXITED(status) && WEXITSTATUS(status) == 0));
  ::close(ready[0]);
  ::close(ready[1]);
  CHECK(run(reset).status == 5);  // a lock's file that is left behind is no alcesd
}

TEST_CASE("a recording's name takes the time, and never that of a drive that is there") {
  CHECK(expand_recording_name("drive-%t.mcap", 1'000'000'000 * ns_per_s) == "drive-20010909T014640Z.mcap");
  CHECK(expand_recording_name("100%%-%x-%", 0) == "100%-%x-%");
  const Folder folder;
  CHECK(unused_name(folder.path() / "a.mcap") == folder.path() / "a.mcap");
  (void)folder.write("a.mcap", "x");
  (void)folder.write("a-2.mcap", "x");
  CHECK(unused_name(folder.path() / "a.mcap") == folder.path() / "a-3.mcap");
}

TEST_CASE(
    "alcesd --dry-run says what page there would be, and makes none, and refuses modes that "
    "let others write") {
  const Folder folder;
  settings::VehicleSettings vehicle = settings::default_vehicle_settings();
  vehicle.page.path = (folder.path() / "page").string();
  vehicle.page.group = "robot";
  const Outcome outcome =
      alcesd("--dry-run --config " + folder.write("vehicle.toml", settings::to_toml(vehicle)).string());
  CHECK(outcome.status == 0);
  CHECK_THAT(outcome.output, Contains("shared page") && Contains("/page, mode 0640, for the group robot"));
  CHECK_FALSE(std::filesystem::exists(vehicle.page.path));
  const auto wrong = folder.write("wrong.toml", "[page]\npath = \"/run/page\"\nmode = \"0666\"\n");
  const Outcome refused = alcesd("--dry-run --config " + wrong.string());
  CHECK(refused.status == 3);
  CHECK_THAT(refused.output, Contains("wrong.toml:3: page.mode is one of"));
}
