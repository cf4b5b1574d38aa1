// What a configuration comes to before anything is opened: all numbers filled in, all memory counted.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "alces_onboard/pipeline.h"
#include "alces_onboard/recorder/background_sink.h"
#include "alces_platform/settings/memory_plan.h"
#include "alces_platform/settings/vehicle_settings.h"

namespace alces::onboard {

/// What the command line adds to vehicle.toml.
struct Options {
  std::filesystem::path config;
  std::optional<std::string> record;  ///< instead of the configuration's
  bool is_dry_run = false;
  std::filesystem::path dcf;  ///< of the drive, for a dry run to hold [motor] against; empty: none
  bool maps = true;
  bool resets_motor = false;  ///< of the alcesd that runs; nothing else is done
};

struct Plan {
  PipelineConfig pipeline;   ///< recording.configuration refers to the settings' text
  settings::MemoryPlan map;  ///< of the mapper's block
  PipelineMemory memory;
  BackgroundSinkConfig file;  ///< between the recorder and its file
  std::size_t archive_index_bytes = 0;
  std::size_t page_bytes = 0;
  std::string recording;  ///< as configured, with its %t; empty: nothing is recorded

  [[nodiscard]] std::size_t total_bytes() const {
    return memory.total_bytes() + archive_index_bytes + page_bytes +
           (recording.empty() ? 0 : file.ring_bytes);
  }
};

/// Error (configuration) when the memory is too small for anything useful, or a value cannot be. `settings`
/// outlives the plan.
[[nodiscard]] Plan make_plan(const settings::VehicleSettings& settings, const Options& options);

/// What speaks against [motor] in the drive's own file `options.dcf`, and is no error: sentences with file
/// and line. Error (configuration) with every reason why a bring-up would fail, and where the file is no EDS.
[[nodiscard]] std::vector<std::string> check_drive(const settings::VehicleSettings& settings,
                                                   const Options& options);

/// For people: the memory, what fits, what would be opened.
[[nodiscard]] std::string describe(const Plan& plan, const settings::VehicleSettings& settings,
                                   const Options& options);

}  // namespace alces::onboard
