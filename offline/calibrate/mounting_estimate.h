// How the lasers sit on the head, from full turns of a head that stands: the mounting is right when a surface
// that is seen twice is seen in one place.
//
// A surface is seen twice by two lasers, and by the two halves of a scan plane of more than half a turn. To
// every patch (flat_patches.h) a shape is fitted, a plane that may be bent like a quadric: one through the
// points of all views, and one through those of each view. What is minimised over the mounting is by how much
// the one fits worse than the many. The shapes are eliminated (Schur complement), so that the covariance
// knows of them. That a surface is flat is not assumed: streets are cambered, walls lean, and a mounting that
// makes them flat would be wrong (in the simulated town by 1.8 deg). Where floor and walls ARE flat, in a
// hall, `surfaces_are_flat` minimises the distances from planes instead, and what is wrong with all views
// alike shows, too. Gauss-Newton with Cauchy weights; patches are found anew with a tolerance that shrinks,
// so that walls that stand 10 cm apart come together. At the end the patches are kept and the iteration runs
// dry.
//
// What cannot be seen:
//   - a shift of all lasers along the axis, and a turn of all of them about it, are the same as the head
//   standing higher or turned: z and yaw of the first laser keep what is configured;
//   - what the scene does not hold: a number whose standard deviation would be above the limits keeps its
//   configured value, the worst first, and the rest is estimated with it. Of two lasers of half a turn each,
//   back to back, only the difference shows: then the first laser keeps its values, and the second is
//   brought into line with it.
// The standard deviations are those of independent noise, of at most `points_a_patch` points a patch: a wall
// is not better known because it was measured more often. Errors of all ranges alike are not in them.
//
// A weak prior (0.1 m, 5 deg about the configured values) keeps the iteration at home; its pull on a value
// known to 1 cm is 1 %.
//
// Time: about 5 s for 150,000 rays; memory: 200 bytes a ray. The same rays give the same numbers to the bit.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "alces_drivers/assembler/scan_assembler.h"
#include "mounting.h"
#include "standing_turns.h"

namespace alces::offline {

struct MountingSettings {
  bool surfaces_are_flat = false;     ///< floor and walls of a hall
  double largest_sigma_m = 0.01;      ///< a position less certain than this is not estimated
  double largest_sigma_rad = 0.0044;  ///< an angle: 0.25 deg
  double last_tolerance_m = 0.04;     ///< of a flat patch: noise of the laser, and of walls
  double points_a_patch = 200;        ///< more do not add weight
  std::size_t most_rays = 200000;     ///< every n-th is taken where there are more
  std::size_t least_patches = 12;
};

enum class Fate : std::uint8_t {
  estimated,
  same_as_head,  ///< cannot be told from z or yaw of the head
  undetermined,  ///< the scene does not hold it
};

struct MountingParameter {
  std::size_t laser = 0;
  MountingKey key = key_x;
  double configured = 0;  ///< m, rad
  double estimated = 0;   ///< as configured, where it was not
  double sigma = 0;       ///< of an undetermined one: what it would have been
  Fate fate = Fate::estimated;
};

/// How flat the patches are, and how far apart their views.
struct ViewAgreement {
  double rms_m = 0;         ///< of the points from their planes, with robust weights
  double median_gap_m = 0;  ///< between the views of a patch that was seen twice
  double rms_gap_m = 0;
};

struct MountingEstimate {
  std::vector<Mounting> lasers;
  std::vector<MountingParameter> parameters;  ///< six a laser
  ViewAgreement before;                       ///< of the same patches
  ViewAgreement after;
  std::size_t rays = 0;
  std::size_t patches = 0;
  std::size_t patches_seen_twice = 0;
  std::size_t iterations = 0;
  bool has_converged = false;
};

/// Which half of the scan plane a ray belongs to: 0 ahead of the axis, as seen along the laser's x, or 1.
[[nodiscard]] int half_of_plane(const Mounting& laser, double ray_angle_rad);

/// `progress` is told iterations done and an upper bound of them; may be empty. InputError when there are too
/// few flat patches, or a laser's scan plane lies across the axis.
[[nodiscard]] MountingEstimate estimate_mounting(
    std::span<const StandingRay> rays, std::span<const Mounting> configured,
    const MountingSettings& settings = {},
    const std::function<void(std::size_t, std::size_t)>& progress = {});

}  // namespace alces::offline
