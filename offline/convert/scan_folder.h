// Scans from wherever they come into a folder of PCD files, one a scan, in the body's frame.
#pragma once

#include <functional>

#include "convert_map.h"

namespace alces::offline {

/// Files are called by their stamps, or by their numbers where there are none; odometry.tum has the poses of
/// those that have one. The folder appears when it is whole. InputError, OutputError.
void write_scan_folder(const MapConversion& conversion, MapConversionReport& report,
                       const std::function<void(std::size_t, std::size_t)>& progress);

}  // namespace alces::offline
