// Where a scan may lie on a model, looked for over the whole circle and some metres around: starts for a
// match that does not come together from where the prediction says.
//
// Seen from above, walls and trees of the model fill the cells of a grid. The data's are laid over it, turned
// and shifted, and the cells they hit are counted (correlative scan matching; Olson, 2009).
// The ground tells nothing of a place seen from above, so points on level ground are left out.
//
// Time: turns x shifts x at most `most_points` look-ups, a few each; some 20 million instructions for the
// whole circle and 12 m. Memory: 16 KiB.
#pragma once

#include <cstdint>
#include <span>

#include "alces/arena.h"
#include "alces/icp.h"
#include "alces/pose.h"

namespace alces {

struct StartSearchConfig {
  float reach_m = 12;          ///< shifts to each side
  float turn_step_rad = 0.1F;  ///< about the upright
  float cell_m = 1.0F;         ///< also the step between shifts
  /// Of a match from each start, which then is within ICP's reach or never will be; the best is matched in
  /// full.
  std::uint32_t iterations = 15;
  /// By which a match from another start has to fit better (IcpResult::balanced_fit): less is chance.
  double gain = 0.03;
  /// The same as a share of the usual fit, where an odometry points to the first start: another place has to
  /// be clearly better than that one.
  double gain_against_odometry = 0.15;
};

/// A place to start a match from.
struct Start {
  Pose model_from_data;
  float share = 0;  ///< of the data's points, that hit a cell of the model
};

class StartSearch {
 public:
  static constexpr std::uint32_t most_points = 192;
  static constexpr std::uint32_t most_starts = 8;

  constexpr explicit StartSearch(Arena& arena)
      : cells_(arena.allocate<std::uint8_t>(std::size_t{grid_size} * grid_size)),
        points_(arena.allocate<Point>(most_points)),
        best_(arena.allocate<Candidate>(most_turns)) {}

  /// Looks around `guess` (model_from_data) for the places where most of the data hit the model: turned by up
  /// to `turn_rad` to each side (pi: all around), shifted by up to config.reach_m. `level_from_model` turns
  /// the model's frame upright. Writes at most starts.size() different places, the best first; returns how
  /// many. Their height and tilt are those over the ground that the model shows,
  /// or the guess's where there is none.
  [[nodiscard]] std::uint32_t find(std::span<const IcpScan> model, std::span<const IcpScan> data,
                                   const Pose& guess, const Eigen::Quaterniond& level_from_model,
                                   float turn_rad, const StartSearchConfig& config, std::span<Start> starts);

 private:
  static constexpr std::int32_t grid_size = 128;
  static constexpr std::uint32_t most_turns = 256;
  struct Candidate {
    std::int32_t score;
    std::int32_t x;
    std::int32_t y;
  };
  void fill(std::span<const IcpScan> model, const Eigen::Quaterniond& level_from_model, float cell_m);

  std::span<std::uint8_t> cells_;
  std::span<Point> points_;
  std::span<Candidate> best_;  // of each turn
};

}  // namespace alces
