// Places where a loop may be closed wrongly, or rightly: a made-up world and a short way through it. Every
// place has two parts that look alike without being one, or comes back to where it was, or both.
//
// A place is a function of its kind and its seed alone.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "alces_platform/sim/world/scene.h"

namespace alces::places {

enum class Kind : std::uint8_t {
  streets,     ///< two streets of terraced houses, all alike, a row of houses between them
  corridors,   ///< two corridors beside each other, 0.2 m of wall between them
  roundabout,  ///< a circle between houses that repeat from exit to exit
  field,       ///< open ground with few poles, or none
  pass,        ///< a straight street, driven once
  aisles,      ///< aisles between shelves that are filled alike
  pillars,     ///< a hall of pillars on a grid
  floors,      ///< floors of a car park, one above the other, with a ramp
  yards,       ///< two yards alike, and bare ground between them on which odometry alone knows the way
};
inline constexpr Kind all_kinds[] = {Kind::streets, Kind::corridors, Kind::roundabout,
                                     Kind::field,   Kind::pass,      Kind::aisles,
                                     Kind::pillars, Kind::floors,    Kind::yards};
[[nodiscard]] std::string_view name(Kind kind);
[[nodiscard]] std::optional<Kind> kind_named(std::string_view name);

struct Place {
  Kind kind = Kind::streets;
  std::uint64_t seed = 0;
  sim::Scene scene;
  std::vector<Eigen::Vector3d> corners_m;  ///< of the way, on the floor
  double corner_radius_m = 1;
  double step_m = 1;    ///< between scans
  double reach_m = 60;  ///< of the scanner at most: fog, or a small laser
  bool is_outdoors = false;
  std::string what;  ///< what was drawn: "shelves filled alike, the other way"
};

[[nodiscard]] Place make_place(Kind kind, std::uint64_t seed);

}  // namespace alces::places
