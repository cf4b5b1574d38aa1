// What the places are built of, and the ways that are driven through them.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alces_platform/sim/random.h"
#include "places/place.h"

namespace alces::places {

/// An upright box along the axes.
void box(sim::Scene& scene, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
         double reflectivity = 0.5);
/// A floor, or a ceiling seen from below: a slab whose top is at `top_m`.
void slab(sim::Scene& scene, const Eigen::Vector2d& low, const Eigen::Vector2d& high, double top_m,
          double thickness_m = 0.2);
/// Four walls of a hall, outside of the box [low, high].
void walls(sim::Scene& scene, const Eigen::Vector3d& low, const Eigen::Vector3d& high);
/// A parked car at a place, along x.
void car(sim::Scene& scene, const Eigen::Vector2d& centre, sim::Random& random);
/// Ground that is nearly even.
void ground(sim::Scene& scene, const Eigen::Vector2d& low, const Eigen::Vector2d& high, std::uint64_t seed,
            double relief_m);

/// Two lanes along x, side by side: along the first, back along the second. Then along a part of the first
/// again, or, `opposite`, about and along a part of the second, `offset_m` beside the first time.
struct Lanes {
  double begin_m = 0;  ///< x
  double end_m = 0;
  double first_m = 0;  ///< y
  double second_m = 0;
  double around_m = 2;  ///< how far beyond the ends the ways from lane to lane are
  double again = 0.6;   ///< share of the lane that is driven again
  double offset_m = 0;  ///< to the side
  bool opposite = false;
};
/// `most_aside_m`: of the offset, which is drawn, and so is the direction.
[[nodiscard]] Lanes draw_lanes(sim::Random& random, double end_m, double second_m, double around_m,
                               double most_aside_m);
[[nodiscard]] std::vector<Eigen::Vector3d> way_along(const Lanes& lanes);
/// Behind what a place is: ", again the other way" or ", again the same way".
[[nodiscard]] const char* again(bool opposite);

Place make_streets(std::uint64_t seed);
Place make_corridors(std::uint64_t seed);
Place make_roundabout(std::uint64_t seed);
Place make_field(std::uint64_t seed);
Place make_pass(std::uint64_t seed);
Place make_aisles(std::uint64_t seed);
Place make_pillars(std::uint64_t seed);
Place make_floors(std::uint64_t seed);
Place make_yards(std::uint64_t seed);

}  // namespace alces::places
