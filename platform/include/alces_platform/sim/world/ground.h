// The town's ground: heights on a square grid, bilinear in between, and where a ray meets it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

namespace alces::sim {

class Ground {
 public:
  static constexpr float cell_m = 0.25F;

  Ground() = default;
  /// Fills the box [low, high] with `height_m(x, y)`.
  Ground(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
         const std::function<double(double, double)>& height_m);

  /// Outside of the grid: the height of its nearest cell.
  [[nodiscard]] float height_m(float x, float y) const;

  /// Range along the unit `direction` at which the ray goes under the ground, or `limit_m` if it does not
  /// before.
  [[nodiscard]] float cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                           float limit_m) const;

 private:
  static constexpr int cells_per_tile = 16;
  [[nodiscard]] std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  Eigen::Vector2f low_ = Eigen::Vector2f::Zero();
  int columns_ = 0;  ///< of height samples
  int rows_ = 0;
  int tile_columns_ = 0;
  int tile_rows_ = 0;
  float top_m_ = 0;
  std::vector<float> heights_;
  std::vector<float> tile_tops_;  ///< highest sample of each tile, its border included
};

}  // namespace alces::sim
