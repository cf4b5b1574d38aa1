// A picture of a map: seen from above and obliquely, with the drive and its loops drawn over it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "offline/io/map_folder/trajectory.h"

namespace alces::offline {

struct RenderSettings {
  enum class View { top, oblique, both };
  View view = View::both;
  /// The longer side of the view from above, in pixels, and the height or width of the other beside it;
  /// margins come on top. 200 to 8192.
  int size_px = 1600;
  /// Drawn dashed beside the map's own, as it stands.
  std::optional<Trajectory> compare;
  std::string compare_name;
};

struct RenderReport {
  int width_px = 0;
  int height_px = 0;
  std::uint64_t points = 0;      ///< read from map.ply
  std::uint64_t not_finite = 0;  ///< of these, skipped
  std::uint64_t outside = 0;  ///< beyond the frame: it holds the trajectory and the middle 99 % of the points
  std::size_t loops_accepted = 0;
  std::size_t loops_refused = 0;
};

/// Reads trajectory.tum, map.ply (binary, streamed twice) and the "loops" of run.json from the map folder;
/// the last two may be missing, then there is less to see. Writes a PNG. About 0.1 s a million points; memory
/// is some 30 bytes a pixel and does not grow with the map. Throws InputError for files that are not what
/// they should be, OutputError.
RenderReport render_map(const std::filesystem::path& map_folder, const std::filesystem::path& png,
                        const RenderSettings& settings = {});

}  // namespace alces::offline
