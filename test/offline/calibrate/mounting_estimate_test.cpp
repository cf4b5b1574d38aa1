// The mounting of lasers from full turns in a room whose walls are known.
#include "alces_offline/calibrate/mounting_estimate.h"
#include <catch2/catch.hpp>
#include <cstdio>
#include "alces_offline/error.h"
#include "room_scan.h"
namespace alces::offline {
namespace {
TEST_CASE("experiment", "[.x]") {
  RoomScan room;
  room.lasers = two_lasers();
  room.lasers[0] = {0.083, 0.004, 0, 90.4 * deg, -0.5 * deg, 0};
  room.lasers[1] = {-0.076, -0.006, 0.005, 89.7 * deg, 0.3 * deg, 180.8 * deg};
  const auto configured = two_lasers();
  const auto rays = room.scan();
  auto r = estimate_mounting(rays, configured);
  std::printf("rays %zu patches %zu twice %zu it %zu conv %d\n", r.rays, r.patches, r.patches_seen_twice,
              r.iterations, r.has_converged);
  std::printf("rms %.2f -> %.2f mm, gap median %.2f -> %.2f, rms %.2f -> %.2f\n", 1e3 * r.before.rms_m,
              1e3 * r.after.rms_m, 1e3 * r.before.median_gap_m, 1e3 * r.after.median_gap_m,
              1e3 * r.before.rms_gap_m, 1e3 * r.after.rms_gap_m);
  for (auto& p : r.parameters) {
    double f = is_angle(p.key) ? 1 / deg : 1e3;
    std::printf("%zu %-9s conf %9.3f est %9.3f +- %.3f truth %9.3f fate %d\n", p.laser, name(p.key),
                f * p.configured, f * p.estimated, f * p.sigma, f * room.lasers[p.laser][p.key], int(p.fate));
  }
}
}  // namespace
}  // namespace alces::offline
