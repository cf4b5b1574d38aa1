// What a vehicle's values must have in common, beyond the range of each.
#pragma once

#include "alces_platform/settings/vehicle_settings.h"

namespace alces::settings {

class TomlReader;

/// Error, with the line of the key or table where the file has it. What the drivers refuse is said in their
/// words.
void check_vehicle(const VehicleSettings& vehicle, const TomlReader& reader);

}  // namespace alces::settings
