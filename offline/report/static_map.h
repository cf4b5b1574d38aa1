// The map from above as inline SVG: what is on paper, and on the screen until the page's program runs or
// where it cannot.
#pragma once

#include <cstddef>
#include <string>

#include "report_map.h"

namespace alces::offline {

/// Points as a transparent PNG inside (so that it stands on light and dark ground), coloured by height, as
/// dark as they are many; the drive, its loops, a scale and a caption as lines and text in the colours of the
/// page's style (classes map-...). At most `width_px` pixels a side.
[[nodiscard]] std::string static_map_svg(const ReportMap& map, int width_px = 1200);

}  // namespace alces::offline
