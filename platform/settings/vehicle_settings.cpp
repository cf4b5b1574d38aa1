#include "alces_platform/settings/vehicle_settings.h"

#include "alces_platform/settings/mapper_settings.h"
#include "text_file.h"
#include "toml_reader.h"
#include "toml_writer.h"
#include "vehicle_check.h"
#include "vehicle_keys.h"

namespace alces::settings {
namespace {

constexpr const char* preamble =
    "A vehicle: what hangs on which wire, how it is mounted, how the program runs, and how it maps.\n"
    "\n"
    "These are all keys, with the values that hold where a file leaves a key or a table out: those of the\n"
    "simulated vehicle. Lists and signals are different: a table that is there names all of its own, and "
    "those\n"
    "that it leaves out are empty. Frames are those of ROS REP 103: right-handed, x ahead, y to the left, z "
    "up.\n"
    "Units stand in the keys' names.";

}  // namespace

VehicleSettings parse_vehicle_settings(const std::string& text, const std::string& name) {
  const toml::table root = parse_toml(text, name);
  VehicleSettings vehicle = default_vehicle_settings();
  TomlReader reader(root, name, "docs/examples/vehicle.toml");
  visit_vehicle(vehicle, reader);
  reader.refuse_unknown();
  // The fullest scan of a drive to come is not known.
  if (vehicle.mapper.voxel.cell_capacity == 0) vehicle.mapper.voxel.cell_capacity = usual_cell_capacity;
  check_vehicle(vehicle, reader);
  vehicle.text = text;
  return vehicle;
}

VehicleSettings read_vehicle_settings(const std::filesystem::path& file) {
  return parse_vehicle_settings(text_of(file), file.string());
}

std::string to_toml(const VehicleSettings& settings) {
  TomlWriter writer;
  writer.remark(preamble);
  visit_vehicle(settings, writer);
  return writer.document;
}

}  // namespace alces::settings
