#include "alces/start_search.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "alces/portable_math.h"
#include "geometry/float_transform.h"

namespace alces {
namespace {

constexpr float level = 0.8F;  // cosine of a normal to the upright: above, ground or ceiling
constexpr std::uint8_t hit = 2;
constexpr std::uint8_t beside = 1;  // of a cell next to one that is filled

// The ground around a scanner, in an upright frame about it.
struct Ground {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double height_m = 0;
  std::uint32_t samples = 0;
};

Ground ground_of(std::span<const IcpScan> scans, const Pose& upright_from_side) {
  constexpr float near_m = 15;  // what lies farther away may be another street's
  Ground ground;
  for (const IcpScan& scan : scans) {
    const FloatTransform upright_from_body(upright_from_side * scan.side_from_body);
    for (const SurfaceSample& sample : scan.samples) {
      const Point normal = upright_from_body.rotate({sample.normal[0], sample.normal[1], sample.normal[2]});
      if (normal.z < level) continue;  // a ceiling's looks down
      const Point p = upright_from_body * scan.tree->point(sample.index);
      if (p.x * p.x + p.y * p.y > near_m * near_m) continue;
      ground.normal += as_vector(normal);
      ground.height_m += static_cast<double>(p.z);
      ++ground.samples;
    }
  }
  if (ground.samples == 0) return ground;
  ground.normal.normalize();
  ground.height_m /= ground.samples;
  return ground;
}

// Where the scanner stands over the same ground again, its height and tilt are those over that ground,
// whatever the map has drifted to: moves the guess there.
Pose stand_on_ground(std::span<const IcpScan> model, std::span<const IcpScan> data, const Pose& guess,
                     const Eigen::Quaterniond& level_from_model) {
  constexpr std::uint32_t enough = 30;  // samples
  Pose level_from_model_pose;
  level_from_model_pose.rotation = level_from_model;
  const Ground seen = ground_of(model, level_from_model_pose);
  Pose level_from_data;
  level_from_data.rotation = level_from_model * guess.rotation;
  const Ground stood_on = ground_of(data, level_from_data);
  if (seen.samples < enough || stood_on.samples < enough) return guess;
  const Eigen::Vector3d axis = stood_on.normal.cross(seen.normal);  // small: its length is the angle's sine
  level_from_data.rotation = (exp_so3(axis) * level_from_data.rotation).normalized();
  const Ground upright = ground_of(data, level_from_data);
  Pose moved;
  moved.rotation = (level_from_model.conjugate() * level_from_data.rotation).normalized();
  Eigen::Vector3d place_m = level_from_model * guess.translation_m;
  if (upright.samples >= enough) place_m.z() = seen.height_m - upright.height_m;
  moved.translation_m = level_from_model.conjugate() * place_m;
  return moved;
}

}  // namespace

void StartSearch::fill(std::span<const IcpScan> model, const Eigen::Quaterniond& level_from_model,
                       float cell_m) {
  std::ranges::fill(cells_, std::uint8_t{0});
  for (const IcpScan& scan : model) {
    Pose level_pose;
    level_pose.rotation = level_from_model;
    const FloatTransform level_from_body(level_pose * scan.side_from_body);
    for (const SurfaceSample& sample : scan.samples) {
      const Point normal = level_from_body.rotate({sample.normal[0], sample.normal[1], sample.normal[2]});
      if (std::abs(normal.z) > level) continue;
      const Point p = level_from_body * scan.tree->point(sample.index);
      const auto x = static_cast<std::int32_t>(std::floor(p.x / cell_m)) + grid_size / 2;
      const auto y = static_cast<std::int32_t>(std::floor(p.y / cell_m)) + grid_size / 2;
      if (x < 1 || y < 1 || x >= grid_size - 1 || y >= grid_size - 1) continue;
      for (std::int32_t dy = -1; dy <= 1; ++dy) {
        for (std::int32_t dx = -1; dx <= 1; ++dx) {
          std::uint8_t& cell = cells_[static_cast<std::size_t>((y + dy) * grid_size + x + dx)];
          cell = std::max(cell, dx == 0 && dy == 0 ? hit : beside);
        }
      }
    }
  }
}

std::uint32_t StartSearch::find(std::span<const IcpScan> model, std::span<const IcpScan> data,
                                const Pose& predicted, const Eigen::Quaterniond& level_from_model,
                                float turn_rad, const StartSearchConfig& config, std::span<Start> starts) {
  const Pose guess = stand_on_ground(model, data, predicted, level_from_model);
  fill(model, level_from_model, config.cell_m);

  // The data's points, upright, about the guessed place.
  Pose turned_guess = guess;
  turned_guess.rotation = level_from_model * guess.rotation;
  turned_guess.translation_m.setZero();
  const auto visit_upright = [&](auto&& visit) {
    for (const IcpScan& scan : data) {
      const FloatTransform level_from_body(turned_guess * scan.side_from_body);
      for (const SurfaceSample& sample : scan.samples) {
        const Point normal = level_from_body.rotate({sample.normal[0], sample.normal[1], sample.normal[2]});
        if (std::abs(normal.z) <= level) visit(level_from_body * scan.tree->point(sample.index));
      }
    }
  };
  std::uint32_t offered = 0;
  visit_upright([&offered](const Point&) { ++offered; });
  const std::uint32_t wanted = std::min(offered, most_points);
  std::uint32_t number = 0;
  std::uint32_t count = 0;
  visit_upright([&](const Point& point) {
    const bool is_kept = (number + 1) * wanted / offered != number * wanted / offered;
    ++number;
    if (is_kept) points_[count++] = point;
  });
  if (count == 0) return 0;

  const Eigen::Vector3d place_m = level_from_model * guess.translation_m;
  const auto reach = static_cast<std::int32_t>(config.reach_m / config.cell_m);
  const auto steps = static_cast<std::int32_t>(std::ceil(turn_rad / config.turn_step_rad));
  const std::int32_t turns = std::min<std::int32_t>(2 * steps + 1, most_turns);
  std::array<std::int32_t, most_points> cell_x;
  std::array<std::int32_t, most_points> cell_y;
  for (std::int32_t turn = 0; turn < turns; ++turn) {
    const double angle_rad =
        static_cast<double>(turn - turns / 2) * static_cast<double>(config.turn_step_rad);
    const portable::SineCosine angle = portable::sine_cosine(angle_rad);
    const auto sine = static_cast<float>(angle.sine);
    const auto cosine = static_cast<float>(angle.cosine);
    for (std::uint32_t i = 0; i < count; ++i) {
      const Point& p = points_[i];
      cell_x[i] = static_cast<std::int32_t>(std::floor(
                      (cosine * p.x - sine * p.y + static_cast<float>(place_m.x())) / config.cell_m)) +
                  grid_size / 2;
      cell_y[i] = static_cast<std::int32_t>(std::floor(
                      (sine * p.x + cosine * p.y + static_cast<float>(place_m.y())) / config.cell_m)) +
                  grid_size / 2;
    }
    Candidate best{-1, 0, 0};
    for (std::int32_t dy = -reach; dy <= reach; ++dy) {
      for (std::int32_t dx = -reach; dx <= reach; ++dx) {
        std::int32_t score = 0;
        for (std::uint32_t i = 0; i < count; ++i) {
          const std::int32_t x = cell_x[i] + dx;
          const std::int32_t y = cell_y[i] + dy;
          const bool is_inside = static_cast<std::uint32_t>(x) < static_cast<std::uint32_t>(grid_size) &&
                                 static_cast<std::uint32_t>(y) < static_cast<std::uint32_t>(grid_size);
          if (is_inside) score += cells_[static_cast<std::size_t>(y * grid_size + x)];
        }
        // Of equal places the nearer one.
        const bool is_nearer = dx * dx + dy * dy < best.x * best.x + best.y * best.y;
        if (score > best.score || (score == best.score && is_nearer)) best = {score, dx, dy};
      }
    }
    best_[static_cast<std::size_t>(turn)] = best;
  }

  // The best turns; what is within two steps of a better one is the same place.
  std::uint32_t found = 0;
  while (found < starts.size()) {
    std::int32_t best = -1;
    for (std::int32_t turn = 0; turn < turns; ++turn) {
      if (best_[static_cast<std::size_t>(turn)].score <= 0) continue;
      if (best < 0 ||
          best_[static_cast<std::size_t>(turn)].score > best_[static_cast<std::size_t>(best)].score)
        best = turn;
    }
    if (best < 0) break;
    const Candidate chosen = best_[static_cast<std::size_t>(best)];
    const double angle_rad =
        static_cast<double>(best - turns / 2) * static_cast<double>(config.turn_step_rad);
    Start& start = starts[found++];
    start.share = static_cast<float>(chosen.score) / static_cast<float>(hit * count);
    const Eigen::Quaterniond model_from_level = level_from_model.conjugate();
    const Eigen::Vector3d shift_m(static_cast<double>(config.cell_m) * chosen.x,
                                  static_cast<double>(config.cell_m) * chosen.y, 0);
    start.model_from_data.rotation =
        (model_from_level * exp_so3({0, 0, angle_rad}) * level_from_model * guess.rotation).normalized();
    start.model_from_data.translation_m = guess.translation_m + model_from_level * shift_m;
    for (std::int32_t near = best - 2; near <= best + 2; ++near) {
      if (near >= 0 && near < turns) best_[static_cast<std::size_t>(near)].score = 0;
    }
  }
  return found;
}

}  // namespace alces
