#include "alces_platform/sim/world/route.h"

#include <algorithm>
#include <cmath>

#include "alces_platform/sim/random.h"
#include "alces_platform/sim/world/wander.h"

namespace alces::sim {

using Eigen::Vector2d;
using Eigen::Vector3d;

Route::Route(const Tour& tour, const Town& town, std::size_t scans, std::uint64_t seed) {
  const TourLine line(tour, town);
  length_m_ = line.length_m();
  const Wander sideways(mix(seed, 30), 60), heading(mix(seed, 31), 25), pace(mix(seed, 32), 45);
  Random bump(mix(seed, 33));
  double driven_m = 0;
  for (std::size_t scan = 0; scan < scans; ++scan) {
    const double way = line.start_m() + driven_m;
    const Vector2d forward = line.forward(way);
    const double off_m = 0.25 * sideways(driven_m);
    const Vector2d xy = line.at(way).xy_m + off_m * Vector2d(-forward.y(), forward.x());
    const double yaw = std::atan2(forward.y(), forward.x()) + 0.02 * heading(driven_m);

    // The wheels on the ground, and what the suspension and the paving add.
    const Stand stand = stand_on(town, xy, yaw);
    const double rough = bump.chance(0.08) ? 0.02 : 0.005;  // rad
    const double bump_roll = std::clamp(rough * bump.normal(), -0.035, 0.035);
    const double bump_pitch = std::clamp(rough * bump.normal(), -0.035, 0.035);
    const double bump_z = std::abs(0.3 * rough * bump.normal());

    Pose pose;
    pose.rotation = Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) *
                    Eigen::AngleAxisd(stand.pitch_rad + bump_pitch, Vector3d::UnitY()) *
                    Eigen::AngleAxisd(stand.roll_rad + bump_roll, Vector3d::UnitX());
    pose.translation_m = {xy.x(), xy.y(), stand.height_m + bump_z};
    town_from_body_.push_back(pose);
    driven_m += step_m * (1.0 + 0.08 * pace(driven_m));
  }
}

}  // namespace alces::sim
