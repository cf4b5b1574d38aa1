// A recorded drive, through the same drivers as on the vehicle, as a source of scans: what `alces replay`
// maps.
//
// The recording may be our own (MCAP), a folder of traces of other programs, or one such file; the vehicle's
// configuration is the recording's, unless another is given. The same recording gives the same scans to the
// bit. Scans that the vehicle dropped because its mapper was busy are left out here too, so that the map is
// the vehicle's; and incomplete ones, unless the configuration wants them.
//
// Goes through the events twice: once to see how long the drive is and which scans were dropped. One scan in
// memory.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "alces_drivers/assembler/scan.h"
#include "alces_drivers/port/notice_port.h"
#include "alces_drivers/scanner/scanner.h"
#include "alces_platform/replay/player.h"
#include "alces_platform/replay/trace_folder.h"
#include "alces_platform/settings/vehicle_settings.h"
#include "offline/io/scans/scan_source.h"
#include "offline/map/memory_plan.h"

namespace alces::offline {

struct DriveReplayOptions {
  std::optional<std::filesystem::path> config;        ///< instead of the recording's own
  std::optional<settings::VehicleSettings> settings;  ///< instead of both
  bool deskew = true;                                 ///< false: as if the vehicle had stood during each scan
  bool maps_dropped_scans = false;                    ///< those, too, that the vehicle dropped
  PlacedProfileSink* profiles = nullptr;  ///< is told of all profiles that go into scans; may be null
  double speed = 0;                       ///< 1: as it was recorded; 0: as fast as possible
};

class DriveReplay final : public ScanSource, private ScanSink, private NoticePort {
 public:
  /// InputError.
  DriveReplay(const std::filesystem::path& drive, const DriveReplayOptions& options);
  ~DriveReplay() override;

  [[nodiscard]] const settings::VehicleSettings& settings() const { return settings_; }
  /// Counters of all parts, notices, and what was left out, for run.json; after the last read().
  [[nodiscard]] nlohmann::json report() const;
  /// How the counters grew, for counters.csv: a line about every 200th part of the drive, `time_s` since its
  /// begin and a column for every counter that is not 0 at the end. After the last read().
  [[nodiscard]] std::string counters_csv() const;
  [[nodiscard]] const Scanner& scanner() const { return *scanner_; }

  [[nodiscard]] std::size_t size() const override { return size_; }
  bool read(std::size_t index, ScanPoints& scan) override;
  [[nodiscard]] std::string name(std::size_t index) const override;
  [[nodiscard]] std::size_t number(std::size_t index) const override;
  [[nodiscard]] std::optional<Pose> odometry(std::size_t index) const override;
  [[nodiscard]] std::optional<double> stamp_s(std::size_t index) const override;
  [[nodiscard]] std::string description() const override;
  [[nodiscard]] std::vector<std::string> warnings() const override;

 private:
  /// What stays of a scan once its points are gone.
  struct Passed {
    std::uint32_t number = 0;
    std::int64_t reference_stamp_ns = 0;
    std::optional<Pose> odometry_from_body;
  };
  class Wires;

  void survey(const std::filesystem::path& drive, const replay::TraceOptions& reading);
  void on_scan(const Scan& scan) override;
  void raise(const Notice& notice) override;
  [[nodiscard]] Passed passed(std::size_t index) const;
  void sample_counters(std::int64_t stamp_ns);

  DriveReplayOptions options_;
  settings::VehicleSettings settings_;
  std::unique_ptr<Wires> wires_;
  std::optional<MemoryBlock> block_;
  Scanner* scanner_ = nullptr;
  replay::Traces traces_;
  std::unique_ptr<replay::SteadyReplayClock> clock_;

  std::set<std::uint32_t> dropped_;  ///< numbers of scans that the vehicle dropped
  std::int64_t begin_ns_ = 0;
  std::int64_t end_ns_ = 0;
  std::uint64_t events_ = 0;
  std::atomic<std::size_t> size_ = 0;
  bool is_over_ = false;
  std::int64_t paced_from_ns_ = 0;
  std::int64_t first_event_ns_ = no_stamp_ns;

  mutable std::mutex mutex_;  ///< of what other threads may ask for while read() runs
  std::vector<Passed> passed_;
  std::vector<ScanPoints> ready_;  ///< assembled, not yet read: one event may complete several
  std::size_t first_ready_ = 0;
  std::uint64_t incomplete_ = 0;
  bool is_without_can_ = false;
  std::uint64_t dropped_again_ = 0;
  struct SaidNotice {
    std::int64_t first_stamp_ns = 0;
    std::int64_t last_stamp_ns = 0;
    Severity severity = Severity::info;
    std::uint64_t times = 0;
    std::vector<std::int64_t> stamps_ns;  ///< the first ones
    bool has_value = false;
    std::int64_t value = 0;  ///< of the last one
  };
  struct CounterSample {
    std::int64_t stamp_ns = 0;
    std::vector<std::uint64_t> values;  ///< in the order of visit_counters()
  };
  std::vector<CounterSample> counter_samples_;
  std::int64_t next_sample_ns_ = 0;
  std::map<std::pair<std::string, std::string>, SaidNotice> notices_;
  std::uint64_t notice_count_ = 0;
};

}  // namespace alces::offline
