// A scan as a match takes it: its tree, and samples of the surfaces that it saw.
#pragma once

#include <catch2/catch.hpp>
#include <cstdint>
#include <vector>

#include "alces/icp.h"
#include "alces/kd_tree.h"
#include "alces/surface.h"
#include "support/in_block.h"

namespace alces::test {

class SampledScan {
 public:
  explicit SampledScan(const std::vector<Point>& points, std::uint32_t sample_capacity = 2048)
      : scratch_(static_cast<std::uint32_t>(points.size())),
        tree_(static_cast<std::uint32_t>(points.size())),
        samples_(sample_capacity) {
    REQUIRE(tree_->build(points, *scratch_));
    SurfaceConfig config;
    config.sample_capacity = sample_capacity;
    samples_.resize(sample_surface(*tree_, config, measure_spacing(*tree_, config.neighbors), samples_));
  }
  [[nodiscard]] IcpScan at(const Pose& side_from_body = Pose{}) const {
    return {&*tree_, samples_, side_from_body};
  }
  [[nodiscard]] const KdTree& tree() const { return *tree_; }
  [[nodiscard]] const std::vector<SurfaceSample>& samples() const { return samples_; }

 private:
  InBlock<KdTreeScratch> scratch_;
  InBlock<KdTree> tree_;
  std::vector<SurfaceSample> samples_;
};

}  // namespace alces::test
