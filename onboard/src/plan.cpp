#include "alces_onboard/plan.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>

#include "alces_onboard/error.h"
#include "alces_platform/dictionary/motor_check.h"
#include "alces_platform/settings/byte_size.h"
#include "alces_platform/settings/key_line.h"

namespace alces::onboard {
namespace {

using settings::format_byte_size;
using settings::VehicleSettings;

/// Half of it is the largest write: a chunk with its index.
constexpr std::size_t file_ring_bytes = std::size_t{8} << 20;
/// LimitRTPRIO= of packaging/alcesd/alcesd.service.
constexpr std::uint64_t unit_priority_limit = 50;
constexpr std::size_t archive_index_bytes_per_scan = 24;

std::size_t stored_bytes(const MapperConfig& mapper, std::size_t points) {
  const auto count = static_cast<std::uint32_t>(points);
  return StoredScanLayout::record_bytes(count, std::min(count, mapper.surface.sample_capacity),
                                        Mapper::stored_channels(mapper));
}

std::string line(const char* what, std::size_t bytes, const std::string& remark) {
  return fmt::format("  {:<26}{:>10}   {}\n", what, format_byte_size(bytes), remark);
}

std::string laser_line(const VehicleSettings& settings, std::size_t i) {
  const settings::LaserLine& at = settings.laser_lines[i];
  const bool is_lms2xx = settings.scanner.laser_makes[i] == LaserMake::lms2xx;
  return fmt::format("  {:<10}{}, {}\n", i == 0 ? "laser a" : "laser b",
                     at.is_tcp ? fmt::format("{}:{}", at.host, at.port) : at.device,
                     is_lms2xx
                         ? fmt::format("LMS 2xx, to measure at {} baud", settings.scanner.lms2xx[i].baud)
                         : std::string("CoLa-B"));
}

/// What people beside the head have to know.
std::string head_lines(const VehicleSettings& settings) {
  const MotorConfig& motor = settings.scanner.motor;
  std::string text = "\nThe head\n";
  switch (motor.permit.source) {
    case PermitSource::none:
      text += "  turns as soon as alcesd runs: nobody is asked (permit = \"none\")\n";
      break;
    case PermitSource::gpio:
      text +=
          fmt::format("  turns with a permit by GPIO line {}\n",
                      motor.permit.line < settings.gpio_lines.size() ? settings.gpio_lines[motor.permit.line]
                                                                     : std::string("?"));
      break;
    case PermitSource::can:
      text += fmt::format("  turns with a permit by CAN messages 0x{:X}\n", motor.permit.cob_id);
      break;
    case PermitSource::socket:
      text += fmt::format("  turns with a permit by datagrams to {}\n", settings.permit_socket);
      break;
  }
  text += fmt::format(
      "  stands, and the drive has said so, at most {:.0f} s after the signal; else exit status 6\n",
      seconds(Scanner::stop_limit_ns(settings.scanner)));
  if (motor.watchdog_writes.size() == 0 && motor.own_heartbeat_timeout_ms == 0) {
    text +=
        "  warning: turns on when alcesd is killed or the cable is cut: the drive is not told to watch this "
        "computer\n           (own_heartbeat_timeout_ms, watchdog_writes); cut its torque by hardware "
        "(STO)\n";
  } else {
    text +=
        "  when alcesd is killed or the cable is cut the drive has to stop by itself; whether it does is "
        "found\n"
        "  out at the start, and said. Cut its torque by hardware (STO) all the same: docs/safety.md\n";
  }
  return text;
}

std::string join(const std::vector<std::string>& words) {
  std::string joined;
  for (const std::string& word : words) joined += (joined.empty() ? "" : ", ") + word;
  return joined;
}

/// What this machine cannot do, whatever the configuration says.
void check_machine(const VehicleSettings& settings, const Options& options) {
  const auto refuse = [&](const char* key, const std::string& sentence) {
    const std::size_t line = settings::key_line(settings.text, "program", key);
    throw Error(ExitStatus::configuration,
                line != 0 ? fmt::format("{}:{}: {}", options.config.string(), line, sentence)
                          : fmt::format("{}: {}", options.config.string(), sentence));
  };
  const long processors = ::sysconf(_SC_NPROCESSORS_CONF);
  if (settings.processor >= 0 && settings.processor >= processors)
    refuse("processor", fmt::format("program.processor is {}, but this machine has {}, counted from 0",
                                    settings.processor, processors));
  struct rlimit limit {};
  const bool is_known = ::getrlimit(RLIMIT_RTPRIO, &limit) == 0;
  const bool is_unlimited = ::geteuid() == 0 || (is_known && limit.rlim_cur == RLIM_INFINITY);
  const auto granted = std::max<std::uint64_t>(unit_priority_limit, is_known ? limit.rlim_cur : 0);
  if (!is_unlimited && static_cast<std::uint64_t>(settings.fifo_priority) > granted)
    refuse("fifo_priority",
           fmt::format("program.fifo_priority is {}, but no more than {} is granted (LimitRTPRIO= "
                       "of alcesd.service, ulimit -r)",
                       settings.fifo_priority, granted));
}

}  // namespace

Plan make_plan(const VehicleSettings& settings, const Options& options) {
  check_machine(settings, options);
  if (const char* const wrong = validate(settings.scanner); wrong != nullptr)
    throw Error(ExitStatus::configuration, fmt::format("{}: {}", options.config.string(), wrong));
  if (settings.scan_slots == 0)
    throw Error(ExitStatus::configuration,
                fmt::format("{}: scan_slots must be at least 1", options.config.string()));
  Plan plan;
  plan.recording = options.record.value_or(settings.recording);
  plan.file.ring_bytes = file_ring_bytes;

  PipelineConfig& pipeline = plan.pipeline;
  pipeline.scanner = settings.scanner;
  pipeline.maps = options.maps;
  pipeline.maps_incomplete_scans = settings.maps_incomplete_scans;
  pipeline.mapping_timeout_ns = settings.mapping_timeout_ns;
  pipeline.records = !plan.recording.empty();
  pipeline.recording.configuration = settings.text;
  pipeline.recording_limit_bytes = settings.recording_limit_bytes;
  pipeline.mapping.scan_slots = settings.scan_slots;
  MapperConfig& mapper = pipeline.mapping.mapper;
  mapper = settings.mapper;
  if (options.maps) {
    const bool has_archive = !settings.archive.empty();
    if (mapper.scan_capacity == 0)
      mapper.scan_capacity = settings::scans_that_fit(mapper, settings.memory_bytes, has_archive);
    MapperConfig least = mapper;
    least.scan_capacity = std::max(least.scan_capacity, 1U);
    const std::size_t pool_for_one =
        mapper.pool_bytes == 0 && !has_archive ? settings::largest_stored_scan(mapper) : 0;
    const std::size_t least_bytes = settings::least_memory(least) + pool_for_one;
    if (mapper.scan_capacity == 0 || least_bytes > settings.memory_bytes) {
      const std::string scans =
          least.scan_capacity == 1 ? "one scan" : fmt::format("{} scans", least.scan_capacity);
      throw Error(
          ExitStatus::configuration,
          fmt::format("{}: {} of memory are not enough for {} of up to {} points; give at least {} KiB",
                      options.config.string(), format_byte_size(settings.memory_bytes), scans,
                      mapper.voxel.cell_capacity, (least_bytes + 1023) / 1024));
    }
    plan.map = settings::plan_memory(mapper, settings.memory_bytes);
    if (has_archive) plan.archive_index_bytes = archive_index_bytes_per_scan * mapper.scan_capacity;
  }
  plan.memory = Pipeline::memory_required(pipeline);
  if (!settings.page.path.empty()) plan.page_bytes = sizeof(alces_page);
  return plan;
}

std::vector<std::string> check_drive(const VehicleSettings& settings, const Options& options) {
  if (!settings.scanner.has_motor)
    throw Error(ExitStatus::configuration,
                fmt::format("{}: scanner.has_motor is false: there is no [motor] to hold against {}",
                            options.config.string(), options.dcf.string()));
  std::vector<std::string> warnings;
  std::string errors;
  try {
    const ObjectDictionaryFile dictionary = ObjectDictionaryFile::read(options.dcf);
    warnings = dictionary.warnings();
    for (const MotorFinding& finding :
         check_motor(settings.scanner.motor, options.config, settings.text, dictionary, options.dcf)) {
      if (finding.is_error) {
        errors += (errors.empty() ? "" : "\nalcesd: ") + finding.sentence;
      } else {
        warnings.push_back(finding.sentence);
      }
    }
  } catch (const DictionaryError& error) {
    errors = error.what();
  }
  if (!errors.empty()) throw Error(ExitStatus::configuration, errors);
  return warnings;
}

std::string describe(const Plan& plan, const VehicleSettings& settings, const Options& options) {
  const PipelineConfig& pipeline = plan.pipeline;
  const MapperConfig& mapper = pipeline.mapping.mapper;
  const std::size_t points_per_scan = pipeline.scanner.assembler.capacity.points_per_scan;
  std::string text =
      fmt::format("{} is in order.\n\nMemory, all of it taken at the start\n", options.config.string());
  if (pipeline.maps) {
    text += line("mapper", plan.memory.mapper_bytes,
                 fmt::format("of {} allowed", format_byte_size(plan.map.limit_bytes)));
    text += line("  poses and edges", plan.map.scans_bytes,
                 fmt::format("{} scans of {} B, {} loops", mapper.scan_capacity, plan.map.scan_bytes,
                             mapper.loop_capacity));
    text += line("  pool of stored scans", plan.map.pool_bytes,
                 settings.archive.empty() ? "no archive" : "then the archive");
    text +=
        line("  cache", plan.map.cache_bytes, fmt::format("{} scans unpacked at a time", mapper.cache_slots));
    text += line("  working memory", plan.map.working_bytes, "");
    text += line(
        "scan slots and results", plan.memory.beside_mapper_bytes,
        fmt::format("{} scans of up to {} points may wait", pipeline.mapping.scan_slots, points_per_scan));
    if (plan.archive_index_bytes > 0)
      text += line("archive's index", plan.archive_index_bytes, settings.archive);
  }
  text += line("scanner", plan.memory.scanner_bytes,
               fmt::format("{} laser{}", pipeline.scanner.assembler.laser_count,
                           pipeline.scanner.assembler.laser_count == 1 ? "" : "s"));
  if (pipeline.records) {
    text += line("recorder", plan.memory.recorder_bytes, "");
    text += line("buffer before the file", plan.file.ring_bytes, "");
  }
  if (plan.page_bytes > 0) text += line("shared page", plan.page_bytes, "");
  text += line("in all", plan.total_bytes(), "");

  if (pipeline.maps) {
    const std::size_t fullest = stored_bytes(mapper, mapper.voxel.cell_capacity);
    constexpr std::size_t usual_points = 8000;
    text += fmt::format(
        "\nRoom for\n  {} scans in the map; the pool holds {} of {} points, or {} of {}{}\n",
        mapper.scan_capacity, std::min<std::size_t>(mapper.scan_capacity, plan.map.pool_bytes / fullest),
        mapper.voxel.cell_capacity,
        std::min<std::size_t>(mapper.scan_capacity, plan.map.pool_bytes / stored_bytes(mapper, usual_points)),
        usual_points,
        settings.archive.empty() ? ", then the map is full" : ", further ones go to the archive");
  } else {
    text += "\nNothing is mapped (--no-map).\n";
  }

  text += "\nOpens\n";
  if (settings.scanner.has_motor || settings.scanner.has_odometry)
    text += fmt::format("  {:<10}{}\n", "CAN", settings.can_interface);
  if (!settings.gpio_lines.empty())
    text += fmt::format("  {:<10}{}, line {}\n", "GPIO", settings.gpio_chip, join(settings.gpio_lines));
  for (std::size_t i = 0; i < settings.scanner.assembler.laser_count; ++i) text += laser_line(settings, i);
  if (settings.scanner.has_gps && !settings.gps_device.empty())
    text += fmt::format("  {:<10}{}, {} baud\n", "GPS", settings.gps_device, settings.gps_baud);
  if (pipeline.maps && !settings.archive.empty())
    text += fmt::format("  {:<10}{}\n", "archive", settings.archive);
  if (pipeline.records) {
    text += fmt::format("  {:<10}{}{}{}\n", "recording", plan.recording,
                        settings.recording_limit_bytes == 0
                            ? std::string()
                            : ", up to " + format_byte_size(settings.recording_limit_bytes),
                        settings.recording_reserve_bytes == 0
                            ? std::string()
                            : fmt::format(", leaves {} of its disk free (at most a twentieth)",
                                          format_byte_size(settings.recording_reserve_bytes)));
  } else {
    text += "  nothing to record to: give --record FILE\n";
  }
  if (plan.page_bytes > 0)
    text += fmt::format("  {:<10}{}, mode {}{}\n", "page", settings.page.path, settings.page.mode,
                        settings.page.group.empty() ? "" : ", for the group " + settings.page.group);
  if (settings.scanner.has_motor) text += head_lines(settings);
  if (settings.fifo_priority > 0 || settings.processor >= 0 || settings.locks_memory) {
    text += "\nAsks for\n";
    if (settings.fifo_priority > 0)
      text += fmt::format("  SCHED_FIFO, priority {}, for the acquisition thread\n", settings.fifo_priority);
    if (settings.processor >= 0)
      text += fmt::format("  processor {} for the acquisition thread\n", settings.processor);
    if (settings.locks_memory) text += "  all memory locked\n";
  }
  return text;
}

}  // namespace alces::onboard
