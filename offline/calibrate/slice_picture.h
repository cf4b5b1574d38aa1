// A cut through the points of a standing vehicle, to see walls that stand double: from above, a layer at the
// head's height and one above it; and from the side, along the head's x axis.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "standing_turns.h"

namespace alces::offline {

struct SlicePictureSettings {
  int size_px = 900;         ///< of each of the two squares
  double reach_m = 8;        ///< from the head to a square's edge
  double thickness_m = 0.4;  ///< of the layers
};

/// Colours tell the views apart: lasers, and halves of a scan plane (`views`: one a ray, from 0). Only the
/// first stand is drawn. OutputError.
void draw_slices(const std::filesystem::path& png, std::span<const StandingRay> rays,
                 std::span<const Eigen::Vector3d> ends_m, std::span<const int> views,
                 const std::string& title, const SlicePictureSettings& settings = {});

}  // namespace alces::offline
