// Two scans registered from a bad start with what the library has: reduction, tree, surface, ICP from coarse
// to fine. Used by the tests and the benchmark of registration on real data.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <span>
#include <vector>

#include "alces/icp.h"
#include "alces/kd_tree.h"
#include "alces/surface.h"
#include "alces/voxel_grid.h"
#include "alces_platform/sim/random.h"
#include "support/in_block.h"

namespace alces::test {

struct RegistrationSettings {
  // Small cells and surroundings: wider plane fits round the edges off and turn the minimum by 0.2 to 0.3
  // deg.
  float cell_size_m = 0.10F;
  SurfaceConfig surface{.sample_capacity = 8192, .neighbors = 10};
  /// One after the other, each from where the one before ended.
  std::vector<IcpConfig> stages = {
      {.maximum_iterations = 60,
       .first_distance_limit_m = 3.0F,
       .last_distance_limit_m = 1.0F,
       .limit_factor = 0.9F,
       .coarse_stride = 1,
       .robust_factor = 0,
       .robust_scale_m = 0.2F},
      {.maximum_iterations = 60,
       .first_distance_limit_m = 1.0F,
       .last_distance_limit_m = 0.3F,
       .translation_epsilon_m = 0.0005F,
       .rotation_epsilon_rad = 0.00005F,
       .coarse_stride = 1},
  };
};

class Registration {
 public:
  Registration(std::span<const Point> target, std::span<const Point> source,
               const RegistrationSettings& settings = {})
      : settings_(settings),
        target_(reduced(target)),
        source_(reduced(source)),
        target_tree_(static_cast<std::uint32_t>(target_.size())),
        source_tree_(static_cast<std::uint32_t>(source_.size())),
        icp_(settings.surface.sample_capacity),
        target_samples_(settings.surface.sample_capacity),
        samples_(settings.surface.sample_capacity) {
    InBlock<KdTreeScratch> target_scratch(static_cast<std::uint32_t>(target_.size()));
    InBlock<KdTreeScratch> source_scratch(static_cast<std::uint32_t>(source_.size()));
    if (!target_tree_->build(target_, *target_scratch) || !source_tree_->build(source_, *source_scratch))
      std::abort();  // sized for these points
    sample(*target_tree_, target_samples_);
    sample(*source_tree_, samples_);
  }

  [[nodiscard]] IcpResult match(const Pose& start) {
    const IcpScan model[1] = {{&*target_tree_, target_samples_, Pose{}}};
    const IcpScan data[1] = {{&*source_tree_, samples_, Pose{}}};
    IcpResult result;
    result.model_from_data = start;
    std::uint32_t iterations = 0;
    for (const IcpConfig& stage : settings_.stages) {
      result = icp_->match(model, data, result.model_from_data, stage);
      iterations += result.iterations;
    }
    result.iterations = iterations;
    return result;
  }

  [[nodiscard]] std::span<const Point> target() const { return target_; }
  [[nodiscard]] std::span<const Point> source() const { return source_; }

 private:
  void sample(const KdTree& tree, std::vector<SurfaceSample>& samples) const {
    const ScanSpacing spacing = measure_spacing(tree, settings_.surface.neighbors);
    samples.resize(sample_surface(tree, settings_.surface, spacing, samples));
  }
  [[nodiscard]] std::vector<Point> reduced(std::span<const Point> points) const {
    VoxelGridConfig config;
    config.cell_size_m = settings_.cell_size_m;
    config.cell_capacity = static_cast<std::uint32_t>(points.size());
    InBlock<VoxelGrid> grid(config);
    std::vector<Point> few(points.size());
    VoxelGridCounts counts;
    (void)grid->reduce(points, few, counts);
    few.resize(counts.kept);
    return few;
  }

  RegistrationSettings settings_;
  std::vector<Point> target_, source_;
  InBlock<KdTree> target_tree_, source_tree_;
  InBlock<Icp> icp_;
  std::vector<SurfaceSample> target_samples_, samples_;
};

/// In any direction up to `most_m`, about any axis up to `most_deg`.
inline Pose random_offset(sim::Random& random, double most_m, double most_deg) {
  const auto direction = [&] {
    const double x = random.normal();
    const double y = random.normal();
    const double z = random.normal();
    return Eigen::Vector3d(x, y, z).normalized();
  };
  Pose offset;
  offset.translation_m = direction() * random.uniform(0, most_m);
  const double angle_rad = random.uniform(0, most_deg) * std::numbers::pi / 180;
  offset.rotation = Eigen::AngleAxisd(angle_rad, direction());
  return offset;
}

}  // namespace alces::test
