// A room of flat walls, scanned by lasers on a turning head that stands: rays as a calibration sees them.
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "offline/calibrate/mounting.h"
#include "offline/calibrate/standing_turns.h"

namespace alces::offline {

struct RoomScan {
  /// Walls as planes n x = d about the head; a box 11 m by 8 m, 3.2 m high, turned by 0.3 rad, a corner cut.
  std::vector<std::pair<Eigen::Vector3d, double>> walls = room_walls();
  std::vector<Mounting> lasers;
  double noise_m = 0.01;
  double farthest_m = 40;
  int turns = 1;
  int profiles_a_turn = 90;
  double first_ray_rad = -std::numbers::pi / 2;
  int rays = 181;
  double ray_step_rad = std::numbers::pi / 180;
  unsigned seed = 1;

  static std::vector<std::pair<Eigen::Vector3d, double>> room_walls() {
    std::vector<std::pair<Eigen::Vector3d, double>> walls;
    const auto wall = [&walls](double heading_rad, double distance_m) {
      walls.emplace_back(Eigen::Vector3d(std::cos(heading_rad), std::sin(heading_rad), 0), distance_m);
    };
    wall(0.3, 7.1);
    wall(0.3 + std::numbers::pi / 2, 3.1);
    wall(0.3 + std::numbers::pi, 3.9);
    wall(0.3 - std::numbers::pi / 2, 4.9);
    wall(1.1, 5.8);
    walls.emplace_back(-Eigen::Vector3d::UnitZ(), 1.0);
    walls.emplace_back(Eigen::Vector3d::UnitZ(), 2.2);
    return walls;
  }

  [[nodiscard]] std::vector<StandingRay> scan() const {
    std::vector<StandingRay> all;
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, noise_m);
    for (int profile = 0; profile < turns * profiles_a_turn; ++profile) {
      for (std::size_t laser = 0; laser < lasers.size(); ++laser) {
        for (int ray = 0; ray < rays; ++ray) {
          StandingRay shot;
          shot.laser = static_cast<std::uint8_t>(laser);
          shot.head_angle_rad =
              0.7 + 2 * std::numbers::pi / profiles_a_turn * (profile + static_cast<double>(ray) / rays / 2);
          shot.ray_angle_rad = static_cast<float>(first_ray_rad + ray * ray_step_rad);
          shot.range_m = 1;
          const Pose turned{
              Eigen::Quaterniond(Eigen::AngleAxisd(shot.head_angle_rad, Eigen::Vector3d::UnitZ())),
              Eigen::Vector3d::Zero()};
          const Pose head0_from_laser = turned * pose_of(lasers[laser]);
          const double angle = static_cast<double>(shot.ray_angle_rad);
          const Eigen::Vector3d along =
              head0_from_laser.rotation * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
          double range_m = 1e9;
          for (const auto& [normal, distance_m] : walls) {
            const double slope = normal.dot(along);
            if (slope < 1e-6) continue;
            range_m = std::min(range_m, (distance_m - normal.dot(head0_from_laser.translation_m)) / slope);
          }
          if (range_m < 0.2 || range_m > farthest_m) continue;
          shot.range_m = static_cast<float>(range_m + noise(random));
          all.push_back(shot);
        }
      }
    }
    return all;
  }
};

inline constexpr double deg = std::numbers::pi / 180;

/// As docs/examples/vehicle.toml has it: back to back.
inline std::vector<Mounting> two_lasers() {
  return {{0.08, 0, 0, 90 * deg, 0, 0}, {-0.08, 0, 0, 90 * deg, 0, 180 * deg}};
}

}  // namespace alces::offline
