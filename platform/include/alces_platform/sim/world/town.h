// A small procedural town: streets on an irregular, slightly bent grid, blocks of houses, gardens, trees,
// parked cars, on ground with relief. Everything follows from the layout and the seed.
//
// Plan coordinates (u, v) are those of the undistorted street grid; `place` bends them into the town frame
// (x, y), m.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "alces_platform/sim/random.h"
#include "alces_platform/sim/world/scene.h"

namespace alces::sim {

/// Where the streets run in the plan, and what makes one block differ from another.
struct Layout {
  std::uint64_t seed = 1;
  std::vector<double> column_lines_m;  ///< u of the streets that run along v
  std::vector<double> row_lines_m;     ///< v of the streets that run along u
  /// Block columns with the same key are built alike (column c lies between lines c and c + 1; one key more
  /// for the last line). Empty: all different.
  std::vector<std::uint64_t> column_keys;
  double period_m = 400;  ///< bends and relief repeat after this distance along u
};

class Town {
 public:
  explicit Town(const Layout& layout);

  /// From the plan to the town frame.
  [[nodiscard]] Eigen::Vector2d place(const Eigen::Vector2d& plan_m) const;
  /// Height of the ground, curbs included.
  [[nodiscard]] double height_m(const Eigen::Vector2d& xy_m) const {
    return static_cast<double>(
        scene_.ground.height_m(static_cast<float>(xy_m.x()), static_cast<float>(xy_m.y())));
  }
  /// Direction of the plan's u axis in the town frame.
  [[nodiscard]] const Eigen::Vector2d& east() const { return east_; }
  [[nodiscard]] const Scene& scene() const { return scene_; }

 private:
  struct Wave {
    Eigen::Vector2d frequency;
    double phase_rad;
    double amplitude_m;
    [[nodiscard]] double at(const Eigen::Vector2d& plan) const;
  };
  struct Side;  // one side of a block

  [[nodiscard]] Wave wave(Random& random, double length_m, double amplitude_m) const;
  [[nodiscard]] std::uint64_t key(std::size_t column) const;
  [[nodiscard]] double street_half_width_m(std::size_t line, bool is_column) const;
  [[nodiscard]] double relief_m(const Eigen::Vector2d& xy) const;
  [[nodiscard]] Frame frame(const Eigen::Vector2d& xy, const Eigen::Vector2d& forward) const;

  void lay_ground();
  void build_block(std::size_t column, std::size_t row);
  void build_side(const Side& side, std::uint64_t seed);
  void build_house(const Frame& front, float width, float depth, Random& random, bool plain);
  void build_garden(const Frame& front, float width, Random& random);
  void build_tree(const Frame& foot, Random& random);
  void build_car(const Frame& centre, Random& random);

  Layout layout_;
  Eigen::Vector2d east_;  ///< the plan's u axis in the town frame
  std::vector<Wave> bend_u_, bend_v_, relief_;
  Scene scene_;
};

/// Width of a footway beside the roadway, and the height of its curb.
constexpr double footway_m = 2.4;
constexpr double curb_m = 0.12;

}  // namespace alces::sim
