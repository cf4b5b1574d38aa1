// Outlines of buildings as a land registry has them, and walls extruded from them (paper, section 4.1 and
// Figure 9: "the 2D map is extrapolated to 3D by vertical 3D points").
//
// Two forms, told apart by their content; metres, in the frame of the airborne cloud:
//   text     "building HEIGHT_M [BASE_M]", then a corner "x y" a line; # comments. The outline closes itself.
//   GeoJSON  Polygon and MultiPolygon, alone, as Feature or FeatureCollection, courtyards included;
//            properties "height" and, if not 0, "base", the z where the walls begin.
// Coordinates are to be within 100 km of the origin: subtract a round offset from those of a national grid,
// for outlines and cloud alike (3D points are floats: 8 mm there, 1 mm at 10 km).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "alces/point.h"

namespace alces::offline {

struct Building {
  std::vector<std::vector<Eigen::Vector2d>> rings;  ///< the outline first, then courtyards; not closed
  double base_m = 0;
  double height_m = 0;
};

/// InputError naming the line or the feature. `default_height_m` where a GeoJSON feature has none.
[[nodiscard]] std::vector<Building> read_building_outlines(const std::filesystem::path& file,
                                                           std::optional<double> default_height_m = {});

/// Points on all walls, no farther than `spacing_m` apart along and upwards. CapacityError beyond 2^24
/// points, which a KdTree holds.
[[nodiscard]] std::vector<Point> extrude_walls(std::span<const Building> buildings, double spacing_m);

}  // namespace alces::offline
