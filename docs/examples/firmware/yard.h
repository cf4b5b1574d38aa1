// A drive around a house in a walled yard, made as it is needed: what a scanner would have measured, and what
// the wheels counted. Nothing but +, -, *, / and square roots, so that every processor sees the same drive.
#pragma once

#include <cstdint>
#include <span>

#include "alces/point.h"
#include "alces/pose.h"

namespace yard {

inline constexpr std::uint32_t scan_count = 52;
inline constexpr std::uint32_t rays_around = 240;
inline constexpr std::uint32_t rings = 10;
inline constexpr std::uint32_t points_per_scan = rays_around * rings;

/// Where the vehicle is when scan `number` is taken; the first is the origin.
[[nodiscard]] alces::Pose truth(std::uint32_t number);

/// From scan `number` - 1 to this one by the wheels: 2 % too long, and turning to one side.
[[nodiscard]] alces::Pose wheel_step(std::uint32_t number);

/// What the scanner sees there, with up to 5 cm of noise; in the body's frame.
void scan(std::uint32_t number, std::span<alces::Point, points_per_scan> points);

}  // namespace yard
