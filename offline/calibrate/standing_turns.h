// The rays of full turns of the head while the vehicle stood: what a calibration of the mounting works on.
//
// Told of every profile of a drive (placed_profile.h), it keeps the *stands*: times in which the vehicle, by
// its odometry, moved less than the limits while the head turned once or more and no laser fell silent. Of a
// stand only whole turns are kept, so that every direction weighs alike.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "alces_drivers/assembler/placed_profile.h"
#include "alces_drivers/assembler/scan_assembler.h"

namespace alces::offline {

/// A range with the angles it was measured at: nothing of the mounting is in it.
struct StandingRay {
  double head_angle_rad = 0;
  float ray_angle_rad = 0;  ///< in the laser's plane (profile.h)
  float range_m = 0;
  std::uint8_t laser = 0;
  std::uint32_t stand = 0;
};

struct StandingTurnsSettings {
  std::size_t most_turns = 8;        ///< of a stand; the first ones are kept
  double most_translation_m = 0.01;  ///< within a stand
  double most_rotation_rad = 0.01;
  /// No odometry is asked for: the caller knows that the vehicle stood all the time.
  bool is_vouched_for = false;
};

class StandingTurns final : public PlacedProfileSink {
 public:
  explicit StandingTurns(const StandingTurnsSettings& settings);
  /// How many lasers there are, and what ranges of theirs count; before the first profile.
  void set_mounting(const ScanAssemblerConfig& mounting) { mounting_ = mounting; }

  void on_placed_profile(const PlacedProfile& profile) override;
  /// The drive is over.
  void finish() { close(); }

  [[nodiscard]] const std::vector<StandingRay>& rays() const { return rays_; }
  [[nodiscard]] std::size_t stands() const { return turns_.size(); }
  /// Whole turns of each stand.
  [[nodiscard]] const std::vector<std::size_t>& turns() const { return turns_; }

  // Why there is none.
  [[nodiscard]] std::uint64_t profiles() const { return profiles_; }
  [[nodiscard]] std::uint64_t profiles_without_motion() const { return without_motion_; }
  /// The farthest that the head turned at a stretch, standing or not.
  [[nodiscard]] double longest_turn_rad() const { return longest_turn_rad_; }
  /// ... with the vehicle standing.
  [[nodiscard]] double longest_standing_turn_rad() const { return longest_standing_turn_rad_; }
  [[nodiscard]] const std::array<std::uint64_t, ScanAssemblerConfig::maximum_lasers>& profiles_of() const {
    return profiles_of_;
  }

 private:
  void close();
  void begin(const PlacedProfile& profile);
  [[nodiscard]] bool is_gap(const PlacedProfile& profile);

  ScanAssemblerConfig mounting_;
  StandingTurnsSettings settings_;
  std::vector<StandingRay> rays_;
  std::vector<std::size_t> turns_;
  std::vector<StandingRay> open_;  ///< of the stand that may become one
  bool is_open_ = false;
  double first_head_angle_rad_ = 0;
  double last_head_angle_rad_ = 0;
  double stretch_begin_rad_ = 0;  ///< of the head's turn without a gap
  bool has_stretch_ = false;
  Pose odometry_from_first_;
  std::array<std::int64_t, ScanAssemblerConfig::maximum_lasers> last_ns_{};
  std::array<std::uint64_t, ScanAssemblerConfig::maximum_lasers> profiles_of_{};
  std::uint64_t profiles_ = 0;
  std::uint64_t without_motion_ = 0;
  double longest_turn_rad_ = 0;
  double longest_standing_turn_rad_ = 0;
};

}  // namespace alces::offline
