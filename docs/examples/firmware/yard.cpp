#include "yard.h"

#include <array>
#include <cmath>
#include <cstddef>

namespace yard {
namespace {

// Along a side of the house the vehicle takes so many steps, at each of its corners three, 30 degrees each.
constexpr double step_m = 1.6;
constexpr std::array<std::uint32_t, 4> steps_of_side = {10, 6, 10, 6};
constexpr std::uint32_t turning_steps = 3;

// Cosines of 0, 30, 60, ... degrees; the sine is three places back.
constexpr double root3_2 = 0.86602540378443864676;
constexpr std::array<double, 12> cosines = {1,  root3_2,  0.5,  0, -0.5, -root3_2,
                                            -1, -root3_2, -0.5, 0, 0.5,  root3_2};
double cosine_of(std::uint32_t heading) {
  return cosines[heading % 12];
}
double sine_of(std::uint32_t heading) {
  return cosines[(heading + 9) % 12];
}

struct Station {
  double x_m = 0;
  double y_m = 0;
  std::uint32_t heading = 0;  ///< times 30 degrees, anticlockwise
};

Station station(std::uint32_t number) {
  Station at;
  std::uint32_t side = 0;
  std::uint32_t step = 0;
  for (std::uint32_t i = 0; i < number; ++i) {
    if (step >= steps_of_side[side]) ++at.heading;
    at.x_m += step_m * cosine_of(at.heading);
    at.y_m += step_m * sine_of(at.heading);
    if (++step == steps_of_side[side] + turning_steps) {
      step = 0;
      side = (side + 1) % 4;
    }
  }
  return at;
}

// Turned about the upright by the angle with this cosine; anticlockwise when `sine` is not negative.
Eigen::Quaterniond turned(double cosine, double sine) {
  const double w = std::sqrt((1 + cosine) / 2);
  const double z = std::sqrt((1 - cosine) / 2);
  return {w, 0, 0, sine < 0 ? -z : z};
}

struct Box {
  double low_m[3];
  double high_m[3];
};

// The ground lies 1 m below the scanner. House, walls with a recess each, sheds, posts: no two corners alike.
constexpr std::array<Box, 15> boxes = {{
    {{1.0, 4.2, -1}, {15.5, 12.6, 3.5}},  // the house
    {{5.0, 3.4, -1}, {7.2, 4.2, 1.6}},    // its porch
    {{15.5, 8.0, -1}, {16.4, 9.5, 2.2}},  // its chimney
    {{-9, -6.5, -1}, {26, -6, 2.5}},      // walls of the yard
    {{-9, 23, -1}, {26, 23.5, 3.0}},      //
    {{-9.5, -6.5, -1}, {-9, 23.5, 2.0}},  //
    {{26, -6.5, -1}, {26.5, 23.5, 2.8}},  //
    {{10, -6, -1}, {14.5, -4.6, 1.2}},    // sheds
    {{22.8, 13, -1}, {26, 16.5, 1.8}},    //
    {{2, 20.5, -1}, {6.5, 23, 1.5}},      //
    {{-9, 6, -1}, {-6.8, 9.2, 1.0}},      //
    {{-4.2, -3.6, -1}, {-3.8, -3.2, 3}},  // posts
    {{22.2, -2.4, -1}, {22.6, -2.0, 3}},  //
    {{20.4, 20.0, -1}, {20.8, 20.4, 3}},  //
    {{-5.0, 17.5, -1}, {-4.5, 18.0, 3}},  //
}};
constexpr double ground_m = -1;

// How far a ray goes before it meets something; the yard has no gate.
double range_m(const double (&from_m)[3], const double (&along)[3]) {
  double nearest_m = 60;
  if (along[2] < 0) nearest_m = std::fmin(nearest_m, (ground_m - from_m[2]) / along[2]);
  for (const Box& box : boxes) {
    double enter_m = 0;
    double leave_m = nearest_m;
    for (std::size_t axis = 0; axis < 3 && enter_m < leave_m; ++axis) {
      const double speed = along[axis] == 0 ? 1e-12 : along[axis];
      const double a_m = (box.low_m[axis] - from_m[axis]) / speed;
      const double b_m = (box.high_m[axis] - from_m[axis]) / speed;
      enter_m = std::fmax(enter_m, std::fmin(a_m, b_m));
      leave_m = std::fmin(leave_m, std::fmax(a_m, b_m));
    }
    if (enter_m < leave_m) nearest_m = enter_m;
  }
  return nearest_m;
}

// Evenly within +-1, always the same after the same seed (a linear congruence, Knuth's constants).
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : state_(seed) {}
  double next() {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return static_cast<double>(state_ >> 32) / 2147483648.0 - 1;
  }

 private:
  std::uint64_t state_;
};

}  // namespace

alces::Pose truth(std::uint32_t number) {
  const Station at = station(number);
  alces::Pose pose;
  pose.rotation = turned(cosine_of(at.heading), sine_of(at.heading));
  pose.translation_m = {at.x_m, at.y_m, 0};
  return pose;
}

alces::Pose wheel_step(std::uint32_t number) {
  alces::Pose step = truth(number - 1).inverse() * truth(number);
  step.translation_m *= 1.02;
  alces::Pose bias;
  bias.rotation = turned(0.9998, 1);  // 1.1 degrees a step
  return step * bias;
}

void scan(std::uint32_t number, std::span<alces::Point, points_per_scan> points) {
  const Station at = station(number);
  Noise noise(number + 1);
  const double from_m[3] = {at.x_m, at.y_m, 0};
  const double heading_cosine = cosine_of(at.heading);
  const double heading_sine = sine_of(at.heading);
  // Rays turn by 1.5 degrees at a time; corrected to unit length, so that a turn adds up.
  const double step_cosine = 0.99965732497555726;
  const double step_sine = 0.02617694830787315;
  double cosine = 1;
  double sine = 0;
  std::size_t count = 0;
  for (std::uint32_t ray = 0; ray < rays_around; ++ray) {
    for (std::uint32_t ring = 0; ring < rings; ++ring) {
      const double slope = -0.42 + 0.08 * ring;  // of the ray against the horizon
      const double level = 1 / std::sqrt(1 + slope * slope);
      const double along[3] = {level * (heading_cosine * cosine - heading_sine * sine),
                               level * (heading_sine * cosine + heading_cosine * sine), level * slope};
      const double measured_m = range_m(from_m, along) + 0.05 * noise.next();
      points[count++] = {static_cast<float>(measured_m * level * cosine),
                         static_cast<float>(measured_m * level * sine),
                         static_cast<float>(measured_m * level * slope)};
    }
    const double turned_cosine = cosine * step_cosine - sine * step_sine;
    sine = sine * step_cosine + cosine * step_sine;
    cosine = turned_cosine;
  }
}

}  // namespace yard
