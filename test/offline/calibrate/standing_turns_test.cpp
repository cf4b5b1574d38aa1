// Which profiles of a drive make a stand.
#include "offline/calibrate/standing_turns.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "alces_drivers/stamp.h"

namespace alces::offline {
namespace {

/// A head of half a turn a second with one laser of 50 sweeps a second.
class Feed {
 public:
  Feed(StandingTurns& turns, std::uint32_t lasers) : turns_(turns), lasers_(lasers) {
    ScanAssemblerConfig mounting;
    mounting.laser_count = lasers;
    mounting.lasers[0].minimum_range_m = 0.5;
    mounting.lasers[0].maximum_range_m = 20;
    turns_.set_mounting(mounting);
  }
  void run(double seconds, double speed_m_s = 0) {
    const std::vector<float> ranges{0, 0.3F, 5, 25, std::numeric_limits<float>::quiet_NaN(), -1, 6};
    for (int i = 0; i < std::lround(seconds * 50); ++i) {
      PlacedProfile profile;
      profile.begin_ns = now_ns_;
      profile.end_ns = now_ns_ + 10 * ns_per_ms;
      profile.ranges_m = ranges;
      profile.begin_head_angle_rad = angle(profile.begin_ns);
      profile.end_head_angle_rad = angle(profile.end_ns);
      profile.has_motion = has_motion;
      way_m_ += speed_m_s * 0.02;
      profile.odometry_from_begin_body.translation_m.x() = way_m_;
      profile.odometry_from_end_body.translation_m.x() = way_m_;
      for (std::uint32_t laser = 0; laser < lasers_; ++laser) {
        profile.laser = static_cast<std::uint8_t>(laser);
        if (laser != silent_laser) turns_.on_placed_profile(profile);
      }
      now_ns_ += 20 * ns_per_ms;
    }
  }
  void pause(double seconds) { now_ns_ += std::llround(seconds * 1e9); }
  bool has_motion = true;
  std::uint32_t silent_laser = 99;

 private:
  [[nodiscard]] static double angle(std::int64_t stamp_ns) {
    return -std::numbers::pi * static_cast<double>(stamp_ns) * 1e-9;  // clockwise
  }
  StandingTurns& turns_;
  std::uint32_t lasers_;
  std::int64_t now_ns_ = 0;
  double way_m_ = 0;
};

TEST_CASE("a stand is what lies between two drives, in whole turns") {
  StandingTurns turns({});
  Feed feed(turns, 1);
  feed.run(7.5);  // 3.75 turns
  feed.run(5, 1);
  feed.run(4.5);  // 2.25 turns
  turns.finish();
  REQUIRE(turns.stands() == 2);
  CHECK(turns.turns()[0] == 3);
  CHECK(turns.turns()[1] == 2);
  // Two of seven ranges count: neither none, near, far, NaN nor negative ones.
  CHECK(turns.rays().size() == Approx(2 * 50 * 2 * 5).margin(6));
  CHECK(turns.rays().front().range_m == 5);
  CHECK(turns.rays().back().stand == 1);
}

TEST_CASE("of a long stand the first turns are kept") {
  StandingTurns turns({.most_turns = 2});
  Feed feed(turns, 1);
  feed.run(20);
  turns.finish();
  REQUIRE(turns.stands() == 1);
  CHECK(turns.turns()[0] == 2);
}

TEST_CASE("a vehicle that creeps has no stand, how far the head turned is known") {
  StandingTurns turns({});
  Feed feed(turns, 1);
  feed.run(10, 0.05);
  turns.finish();
  CHECK(turns.stands() == 0);
  CHECK(turns.longest_turn_rad() > 9 * std::numbers::pi);
  CHECK(turns.longest_standing_turn_rad() < std::numbers::pi);
}

TEST_CASE("without odometry there is no stand, unless somebody vouches for it") {
  StandingTurns doubting({});
  Feed feed(doubting, 1);
  feed.has_motion = false;
  feed.run(5);
  doubting.finish();
  CHECK(doubting.stands() == 0);
  CHECK(doubting.profiles_without_motion() == doubting.profiles());

  StandingTurns trusting({.is_vouched_for = true});
  Feed again(trusting, 1);
  again.has_motion = false;
  again.run(5);
  trusting.finish();
  CHECK(trusting.stands() == 1);
}

TEST_CASE("a silence ends a stand, and a laser that never speaks prevents it") {
  StandingTurns turns({});
  Feed feed(turns, 1);
  feed.run(1.5);
  feed.pause(1);
  feed.run(1.5);
  turns.finish();
  CHECK(turns.stands() == 0);

  StandingTurns half({});
  Feed lame(half, 2);
  lame.silent_laser = 1;
  lame.run(10);
  half.finish();
  CHECK(half.stands() == 0);
  CHECK(half.profiles_of()[1] == 0);
}

}  // namespace
}  // namespace alces::offline
