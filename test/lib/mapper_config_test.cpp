// Which configurations a mapper takes.
#include <catch2/catch.hpp>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <type_traits>
#include <utility>

#include "alces/mapper.h"
#include "support/in_block.h"
#include "support/mapper_bench.h"

using namespace alces;
using namespace alces::test;

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// What check() says of a configuration, and create() with it.
Status status_of(const MapperConfig& config) {
  const Status status = Mapper::validate(config);
  const Block too_small(64);
  Status created = Status::ok;
  CHECK(Mapper::create(too_small.bytes(), config, created) == nullptr);
  CHECK(created == (status == Status::ok ? Status::block_too_small : status));
  return status;
}

template <typename Change>
Status with(Change change) {
  MapperConfig config = small_config();
  change(config);
  return status_of(config);
}

/// Of a number that part_of(config) has: whether each value is refused, whatever else it may be.
template <typename Part, typename Number>
void check_refused(Part part_of, Number number, std::initializer_list<double> values) {
  using Value = std::remove_reference_t<decltype(part_of(std::declval<MapperConfig&>()).*number)>;
  for (const double value : values) {
    CAPTURE(value);
    CHECK(with([&](MapperConfig& c) { part_of(c).*number = static_cast<Value>(value); }) ==
          Status::bad_config);
  }
}

}  // namespace

TEST_CASE("the two front ends' settings, and settings at the ends of their ranges, are taken") {
  CHECK(status_of(MapperConfig::standard()) == Status::ok);
  CHECK(status_of(MapperConfig::paper()) == Status::ok);
  CHECK(status_of(small_config()) == Status::ok);
  CHECK(with([](MapperConfig& c) {
          c.loop_capacity = 0;
          c.pool_bytes = 0;
          c.scans_around_first = c.scans_before_last = 0;
          c.cache_slots = c.model_scans + 1;
          c.voxel.minimum_range_m = 0;
          c.scan_match.minimum_correspondences = c.surface.neighbors = 3;
          c.scan_match.limit_factor = 1;
          c.scan_match.translation_epsilon_m = c.scan_match.rotation_epsilon_rad = 0;
          c.scan_match.robust_factor = c.scan_match.robust_scale_m = 0;
          c.scan_match.rough_weight = c.scan_match.degenerate_ratio = 0;
          c.loop_search.shift_steps = 0;
          c.start_search.reach_m = c.pair_reach = 0;
          c.start_search.gain = c.start_search.gain_against_odometry = 0;
          c.start_search.iterations = 1;
          c.detector.minimum_gap_m = 0;
          c.step_verification = {0, 0, 0, 0, 0};
          c.loop_search.sure_overlap = c.loop_search.shift_gain = 0;
          c.loop_search.candidates = c.loop_search.iterations = 1;
          c.loop_verification = {0, 0, 0, 0, 0, 0, 0};
          c.edge_uncertainty.unconverged_factor = 1;
          c.trigger.hysteresis_m = 0;
        }) == Status::ok);
  CHECK(with([](MapperConfig& c) {
          c.surface.neighbors = KdTree::maximum_neighbors;
          c.loop_search.shift_steps = Icp::maximum_shift_steps;
          c.loop_match.rough_weight = c.loop_match.degenerate_ratio = 1;
          c.loop_verification.minimum_overlap = c.loop_verification.minimum_wall_fit = 1;
          c.loop_verification.maximum_mahalanobis2 = 1e12;
        }) == Status::ok);
}

TEST_CASE("capacities that make no sense are refused") {
  CHECK(with([](MapperConfig& c) { c.scan_capacity = 0; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.scan_capacity = UINT32_MAX; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.loop_capacity = UINT32_MAX; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.cache_slots = 0; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.cache_slots = c.model_scans; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.cache_slots = 7; }) == Status::bad_config);  // a loop looks at 8
  CHECK(with([](MapperConfig& c) { c.cache_slots = 8; }) == Status::ok);
  CHECK(with([](MapperConfig& c) { c.model_scans = 0; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.model_scans = 17, c.cache_slots = 40; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.scans_around_first = 8, c.cache_slots = 40; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.scans_before_last = 40, c.cache_slots = 100; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.scans_around_first = UINT32_MAX; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.correspondence_capacity = 0; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.voxel.cell_capacity = 0; }) == Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.voxel.cell_capacity = KdTree::maximum_points + 1; }) ==
        Status::bad_config);
  CHECK(with([](MapperConfig& c) { c.surface.sample_capacity = 0; }) == Status::bad_config);
}

TEST_CASE("settings of the reduction and of the surface that make no sense are refused") {
  const auto voxel = [](MapperConfig& c) -> VoxelGridConfig& { return c.voxel; };
  check_refused(voxel, &VoxelGridConfig::cell_size_m, {not_a_number, inf, -inf, 0, -0.1, 1e-6, 1e9});
  check_refused(voxel, &VoxelGridConfig::minimum_range_m,
                {not_a_number, inf, -inf, -0.5, 30, 31});  // maximum: 30
  check_refused(voxel, &VoxelGridConfig::maximum_range_m,
                {not_a_number, inf, -inf, -1, 0, 0.5});  // minimum: 0.5
  const auto surface = [](MapperConfig& c) -> SurfaceConfig& { return c.surface; };
  check_refused(surface, &SurfaceConfig::neighbors, {0, 2, KdTree::maximum_neighbors + 1, UINT32_MAX});
  check_refused(surface, &SurfaceConfig::neighbor_reach, {not_a_number, inf, -inf, 0, -1, 0.99, 101});
}

TEST_CASE("settings of a match that make no sense are refused, of scans and of loops") {
  const auto check = [](auto match) {
    check_refused(match, &IcpConfig::maximum_iterations, {0});
    check_refused(match, &IcpConfig::minimum_correspondences, {0, 2});
    check_refused(match, &IcpConfig::first_distance_limit_m, {not_a_number, inf, -inf, 0, -1});
    check_refused(match, &IcpConfig::last_distance_limit_m, {not_a_number, inf, -inf, 0, -1});
    check_refused(match, &IcpConfig::limit_factor, {not_a_number, inf, -inf, 0, -1, 1.5});
    for (float IcpConfig::*number :
         {&IcpConfig::translation_epsilon_m, &IcpConfig::rotation_epsilon_rad, &IcpConfig::robust_factor,
          &IcpConfig::robust_scale_m, &IcpConfig::rough_weight, &IcpConfig::fit_distance_m,
          &IcpConfig::degenerate_ratio}) {
      check_refused(match, number, {not_a_number, inf, -inf, -1e-6});
    }
    check_refused(match, &IcpConfig::rough_weight, {1.1});
    check_refused(match, &IcpConfig::degenerate_ratio, {1.1});
  };
  check([](MapperConfig& c) -> IcpConfig& { return c.scan_match; });
  check([](MapperConfig& c) -> IcpConfig& { return c.loop_match; });
}

TEST_CASE("an uncertainty that would leave edges without one is refused") {
  const auto edge = [](MapperConfig& c) -> EdgeUncertainty& { return c.edge_uncertainty; };
  check_refused(edge, &EdgeUncertainty::inflation, {not_a_number, inf, -inf, 0, -1});
  check_refused(edge, &EdgeUncertainty::minimum_translation_m, {not_a_number, inf, -inf, 0, -1});
  check_refused(edge, &EdgeUncertainty::minimum_rotation_rad, {not_a_number, inf, -inf, 0, -1});
  check_refused(edge, &EdgeUncertainty::unconverged_factor, {not_a_number, inf, -inf, 0, 0.99, -5});
}

TEST_CASE("settings of the detection, of the search and of the belief that make no sense are refused") {
  const auto detector = [](MapperConfig& c) -> LoopDetectorConfig& { return c.detector; };
  check_refused(detector, &LoopDetectorConfig::radius_m,
                {not_a_number, inf, -inf, 0, -1, 6.1});  // the cap: 6
  check_refused(detector, &LoopDetectorConfig::radius_cap_m, {not_a_number, inf, -inf, 0, 5.9});
  check_refused(detector, &LoopDetectorConfig::sigma_factor, {not_a_number, inf, -inf, -1});
  check_refused(detector, &LoopDetectorConfig::minimum_gap_scans, {0});
  check_refused(detector, &LoopDetectorConfig::minimum_gap_m, {not_a_number, inf, -inf, -1});
  const auto trigger = [](MapperConfig& c) -> LoopTriggerConfig& { return c.trigger; };
  check_refused(trigger, &LoopTriggerConfig::hysteresis_m, {not_a_number, inf, -inf, -1});

  const auto search = [](MapperConfig& c) -> LoopSearchConfig& { return c.loop_search; };
  check_refused(search, &LoopSearchConfig::sure_overlap, {not_a_number, inf, -inf, -0.1, 1.1});
  check_refused(search, &LoopSearchConfig::sure_fit_share, {not_a_number, inf, -inf, -0.1, 11});
  check_refused(search, &LoopSearchConfig::iterations, {0});
  check_refused(search, &LoopSearchConfig::shift_step_m, {not_a_number, inf, -inf, 0, -0.1, 0.001});
  check_refused(search, &LoopSearchConfig::shift_steps, {Icp::maximum_shift_steps + 1});
  check_refused(search, &LoopSearchConfig::shift_gain, {not_a_number, inf, -inf, -0.1});
  check_refused(search, &LoopSearchConfig::candidates, {0});

  const auto belief = [](MapperConfig& c) -> LoopVerification& { return c.loop_verification; };
  for (double LoopVerification::*number :
       {&LoopVerification::minimum_overlap, &LoopVerification::maximum_rms_m,
        &LoopVerification::maximum_mahalanobis2, &LoopVerification::minimum_wall_fit,
        &LoopVerification::small_correction_m, &LoopVerification::known_m,
        &LoopVerification::minimum_fit_share, &LoopVerification::ambiguity_sigmas,
        &LoopVerification::free_space_sigmas}) {
    check_refused(belief, number, {not_a_number, inf, -inf, -0.1});
  }
  check_refused(belief, &LoopVerification::minimum_overlap, {1.1});
  check_refused(belief, &LoopVerification::minimum_wall_fit, {1.1});
}

TEST_CASE(
    "settings of the prediction, of a step's belief and of the search for starts that make no sense are "
    "refused") {
  const auto motion = [](MapperConfig& c) -> MotionUncertainty& { return c.motion; };
  for (double MotionUncertainty::*number :
       {&MotionUncertainty::odometry_m_per_m, &MotionUncertainty::odometry_rad_per_m,
        &MotionUncertainty::without_odometry_m, &MotionUncertainty::without_odometry_rad,
        &MotionUncertainty::steps_assumed}) {
    check_refused(motion, number, {not_a_number, inf, -inf, 0, -1});
  }
  check_refused(motion, &MotionUncertainty::steps_remembered, {not_a_number, inf, -inf, 0, 1});

  const auto step = [](MapperConfig& c) -> StepVerification& { return c.step_verification; };
  for (double StepVerification::*number :
       {&StepVerification::minimum_overlap, &StepVerification::usual_fit_share,
        &StepVerification::least_fit_share, &StepVerification::minimum_fit}) {
    check_refused(step, number, {not_a_number, inf, -inf, -0.1, 1.1});
  }
  check_refused(step, &StepVerification::maximum_mahalanobis2, {not_a_number, inf, -inf, -1});

  const auto start = [](MapperConfig& c) -> StartSearchConfig& { return c.start_search; };
  check_refused(start, &StartSearchConfig::cell_m, {not_a_number, inf, -inf, 0, -1, 0.01});
  check_refused(start, &StartSearchConfig::reach_m, {not_a_number, inf, -inf, -1, 61});
  check_refused(start, &StartSearchConfig::turn_step_rad, {not_a_number, inf, -inf, 0, -0.1, 0.01});
  check_refused(start, &StartSearchConfig::gain, {not_a_number, inf, -inf, -0.1, 1.1});
  check_refused(start, &StartSearchConfig::gain_against_odometry, {not_a_number, inf, -inf, -0.1, 1.1});
  check_refused(start, &StartSearchConfig::iterations, {0});

  const auto uncertainty = [](MapperConfig& c) -> IcpUncertainty& { return c.scan_match.uncertainty; };
  check_refused(uncertainty, &IcpUncertainty::noise, {not_a_number, inf, -inf, -1});
  check_refused(uncertainty, &IcpUncertainty::pull, {not_a_number, inf, -inf, -1});
  const auto whole = [](MapperConfig& c) -> MapperConfig& { return c; };
  check_refused(whole, &MapperConfig::pair_reach, {not_a_number, inf, -inf, -1, 101});
  check_refused(whole, &MapperConfig::longest_reach_m, {not_a_number, inf, -inf, 0, -1});
}
