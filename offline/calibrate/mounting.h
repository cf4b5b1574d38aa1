// Where a laser sits on the head as the six numbers of the configuration, and where its rays then end.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "alces/pose.h"
#include "standing_turns.h"

namespace alces::offline {

/// x_m, y_m, z_m, roll_deg, pitch_deg, yaw_deg of [laser_a], [laser_b] and [head], here in m and rad:
/// rotations about the parent's fixed axes, first roll about x, then pitch about y, then yaw about z.
enum MountingKey : std::size_t { key_x, key_y, key_z, key_roll, key_pitch, key_yaw, mounting_keys };
using Mounting = std::array<double, mounting_keys>;

[[nodiscard]] Mounting mounting_of(const Pose& parent_from_child);
[[nodiscard]] Pose pose_of(const Mounting& mounting);
/// "x_m", "roll_deg": the key in the file;
[[nodiscard]] const char* name(MountingKey key);
[[nodiscard]] bool is_angle(MountingKey key);

/// Where the rays end in the frame of the head at angle 0, of a vehicle that stands.
[[nodiscard]] std::vector<Eigen::Vector3d> ray_ends_m(std::span<const StandingRay> rays,
                                                      std::span<const Mounting> lasers);

}  // namespace alces::offline
