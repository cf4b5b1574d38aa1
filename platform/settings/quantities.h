// Values that stand otherwise in a file than in the configuration: times in the unit that suits them, angles
// in degrees, poses as position and roll, pitch, yaw. What the file does not name keeps its value to the bit.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <type_traits>
#include <vector>

#include "alces/pose.h"
#include "alces_drivers/stamp.h"

namespace alces::settings {

inline constexpr double an_hour_s = 3600;
inline constexpr double an_hour_ms = 3600e3;

[[nodiscard]] inline double radians(double angle_deg) {
  return angle_deg * (std::numbers::pi / 180);
}
/// To 1e-9 deg, so that what a person wrote comes out as it was; never -0.
[[nodiscard]] inline double degrees(double angle_rad) {
  return std::round(angle_rad * (180 / std::numbers::pi) * 1e9) / 1e9 + 0.0;
}

/// Where something stands: position, then rotations about the FIXED axes of the parent frame, first roll
/// about x, then pitch about y, then yaw about z (R = Rz Ry Rx). REP 103.
struct Placement {
  std::array<double, 3> position_m{};
  double roll_deg = 0;
  double pitch_deg = 0;
  double yaw_deg = 0;
  friend bool operator==(const Placement&, const Placement&) = default;
};
[[nodiscard]] Pose pose_of(const Placement& placement);
/// Angles in (-180, 180]; pitch in [-90, 90], where at the ends the roll is 0.
[[nodiscard]] Placement placement_of(const Pose& pose);

template <typename Visitor, typename Time>
void duration_ms(Visitor& visit, const char* key, Time& time_ns, double least, double most,
                 const char* comment) {
  double value = static_cast<double>(time_ns) / static_cast<double>(ns_per_ms);
  visit.number(key, value, least, most, comment);
  if constexpr (!std::is_const_v<Time>) time_ns = std::llround(value * static_cast<double>(ns_per_ms));
}

template <typename Visitor, typename Time>
void duration_s(Visitor& visit, const char* key, Time& time_ns, double least, double most,
                const char* comment) {
  double value = static_cast<double>(time_ns) / static_cast<double>(ns_per_s);
  visit.number(key, value, least, most, comment);
  if constexpr (!std::is_const_v<Time>) time_ns = std::llround(value * static_cast<double>(ns_per_s));
}

/// Also of rates: anything in radians.
template <typename Visitor, typename Angle>
void angle_deg(Visitor& visit, const char* key, Angle& angle_rad, double least, double most,
               const char* comment) {
  const double before = degrees(angle_rad);
  double value = before;
  visit.number(key, value, least, most, comment);
  if constexpr (!std::is_const_v<Angle>) {
    if (value != before) angle_rad = radians(value);
  }
}

template <typename Visitor, typename AnyPose>
void placement(Visitor& visit, AnyPose& pose) {
  const Placement before = placement_of(pose);
  Placement value = before;
  visit.number("x_m", value.position_m[0], -100, 100, "ahead");
  visit.number("y_m", value.position_m[1], -100, 100, "to the left");
  visit.number("z_m", value.position_m[2], -100, 100, "up");
  visit.number("roll_deg", value.roll_deg, -360, 360, "first, about x");
  visit.number("pitch_deg", value.pitch_deg, -360, 360, "then about y, as it was before the roll");
  visit.number("yaw_deg", value.yaw_deg, -360, 360, "then about z, as it was before both");
  if constexpr (!std::is_const_v<AnyPose>) {
    if (!(value == before)) pose = pose_of(value);
  }
}

/// A StaticVector as a list of rows.
template <typename Visitor, typename Table, typename VisitRow>
void static_vector(Visitor& visit, const char* key, Table& table, VisitRow visit_row, const char* comment) {
  using Row = std::remove_cvref_t<decltype(table[0])>;
  std::vector<Row> rows(table.begin(), table.end());
  visit.rows(key, rows, std::remove_const_t<Table>::capacity, visit_row, comment);
  if constexpr (!std::is_const_v<Table>) {
    table.clear();
    for (const Row& row : rows) static_cast<void>(table.add(row));  // rows() saw to it that they fit
  }
}

}  // namespace alces::settings
