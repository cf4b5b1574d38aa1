// What people configure: vehicle.toml, map.toml.
#include <string>

#include "../memory_file.h"
#include "alces_drivers/scanner/scanner.h"
#include "alces_platform/settings/mapper_settings.h"
#include "alces_platform/settings/memory_plan.h"
#include "alces_platform/settings/settings_error.h"
#include "alces_platform/settings/vehicle_settings.h"

namespace alces::fuzz {
namespace {

/// What was read is what a scanner and a mapper take, and comes back when it is written.
ALCES_FUZZ_TARGET(vehicle_toml) {
  try {
    const settings::VehicleSettings vehicle =
        settings::parse_vehicle_settings(std::string(as_text(bytes)), "vehicle.toml");
    require(validate(vehicle.scanner) == nullptr, "what is read has no problem");
    (void)Scanner::memory_required(vehicle.scanner);
    (void)settings::scans_that_fit(vehicle.mapper, vehicle.memory_bytes, !vehicle.archive.empty());
    const std::string written = settings::to_toml(vehicle);
    const settings::VehicleSettings again = settings::parse_vehicle_settings(written, "again.toml");
    require(settings::to_toml(again) == written, "settings come back as they were written");
  } catch (const settings::Error&) {
  }
}

ALCES_FUZZ_TARGET(map_toml) {
  const MemoryFile file(bytes);
  MapperConfig config = settings::default_mapper_settings();
  try {
    settings::read_mapper_settings(file.path(), config);
  } catch (const settings::Error&) {
    return;
  }
  (void)Mapper::memory_required(config);
  const std::string written = settings::to_toml(config);
  const MemoryFile again({reinterpret_cast<const std::uint8_t*>(written.data()), written.size()});
  MapperConfig second = settings::default_mapper_settings();
  settings::read_mapper_settings(again.path(), second);
  require(settings::to_toml(second) == written, "settings come back as they were written");
}

}  // namespace
}  // namespace alces::fuzz
