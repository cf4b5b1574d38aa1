#include "settings_conversion.h"

#include "alces_platform/settings/mapper_settings.h"
#include "alces_platform/settings/settings_error.h"
#include "alces_platform/settings/vehicle_settings.h"
#include "offline/io/files/error.h"
#include "offline/io/files/output_file.h"

namespace alces::offline {
namespace {

void write_settings(const std::filesystem::path& out, const std::string& text) {
  OutputFile file(out);
  file.write(text);
  file.commit();
}

}  // namespace

std::string convert_settings(const std::filesystem::path& in, const std::filesystem::path& out) {
  MapperConfig mapper = settings::default_mapper_settings();
  try {
    settings::read_mapper_settings(in, mapper);
    write_settings(out, settings::to_toml(mapper));
    return "a mapper's configuration";
  } catch (const settings::Error&) {
    // A vehicle's has tables that a mapper's does not know.
  }
  try {
    const settings::VehicleSettings vehicle = settings::read_vehicle_settings(in);
    write_settings(out, settings::to_toml(vehicle));
    return "a vehicle's configuration";
  } catch (const settings::Error& error) {
    throw InputError(in, std::string("is no configuration: ") + error.what());
  }
}

}  // namespace alces::offline
