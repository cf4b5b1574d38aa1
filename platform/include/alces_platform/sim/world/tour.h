// Where the vehicle goes: a tour over crossings of a town's streets, and the rounded line that is driven.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "alces_platform/sim/world/town.h"

namespace alces::sim {

/// A tour over crossings of a layout's street lines, (column line, row line) one after the other, closed.
struct Tour {
  Layout layout;
  std::vector<Eigen::Vector2i> crossings;
  bool closed = true;
  double start_fraction = 0;  ///< of the first street that lies behind the first scan
};

/// Mean way from scan to scan of the paper's drive: 1.2 s at 1.1 m/s.
inline constexpr double way_per_scan_m = 1.34;

/// The tour for a drive of so many scans, way_per_scan_m apart. From about 230 scans: 26 streets, about 1.24
/// km with loops in loops, some streets driven twice the same way and some the other way; longer drives start
/// over. Below: around one small block.
[[nodiscard]] Tour make_tour(std::size_t scans, std::uint64_t seed);
/// The same for a drive of so many metres.
[[nodiscard]] Tour make_tour_of_way(double way_m, std::uint64_t seed);

/// The line of a tour on the ground: a little to the right of the streets' axes, corners rounded.
class TourLine {
 public:
  struct Place {
    Eigen::Vector2d xy_m;
    Eigen::Vector2d forward;  ///< unit vector
  };

  TourLine(const Tour& tour, const Town& town);

  /// Piecewise linear. A closed tour starts over; an open one ends.
  [[nodiscard]] Place at(double way_m) const;
  /// Direction of travel, averaged over a vehicle's length.
  [[nodiscard]] Eigen::Vector2d forward(double way_m) const;
  /// Before it starts over.
  [[nodiscard]] double length_m() const { return length_m_; }
  [[nodiscard]] double start_m() const { return start_m_; }
  [[nodiscard]] bool is_closed() const { return is_closed_; }

 private:
  bool is_closed_;
  std::vector<Eigen::Vector2d> line_;
  std::vector<double> way_m_;  ///< along the line, up to each point
  double length_m_ = 0;
  double start_m_ = 0;
};

/// How a vehicle of four wheels (0.8 m x 0.6 m) stands on the ground: curbs and ramps lift what stands on
/// them.
struct Stand {
  double height_m = 0;
  double pitch_rad = 0;  ///< about y: nose down is positive
  double roll_rad = 0;   ///< about x: left side up is positive
};
[[nodiscard]] Stand stand_on(const Town& town, const Eigen::Vector2d& xy_m, double yaw_rad);

}  // namespace alces::sim
