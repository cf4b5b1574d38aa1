// The head's encoder on GPIO lines: an index pulse once a turn and, on request, quadrature A/B.
//
// Edges come where the head's angle passes them, to the microsecond; the kernel's time stamps are late by a
// few microseconds (interrupt latency), now and then by more. Forwards, A leads B by a quarter of a line.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "alces_drivers/encoder/edge.h"
#include "alces_platform/sim/fault.h"
#include "alces_platform/sim/motor/head_motor.h"
#include "alces_platform/sim/random.h"

namespace alces::sim {

struct HeadEncoderSettings {
  static constexpr std::uint8_t index_line = 0, a_line = 1, b_line = 2;

  double index_width_rad = 0.035;      ///< from the rising edge to the falling one (turning anticlockwise)
  std::uint32_t quadrature_lines = 0;  ///< A/B periods a turn; 0: not wired. 256 is usual
  double latency_us = 4;     ///< mean of the interrupt's latency (exponential), that stamps are late by
  bool has_sequence = true;  ///< false: as libgpiod 1 does, without the kernel's count
};

class HeadEncoder {
 public:
  struct Output {
    std::int64_t stamp_ns = 0;
    GpioEdge edge;
    std::uint32_t lost_count = 0;  ///< not 0: no edge, but so many were lost
  };

  HeadEncoder(const HeadEncoderSettings& settings, double index_angle_rad, std::uint64_t seed);

  /// Edges between the head's last angle and this one, in the order of time. The head's angle in between is
  /// linear.
  void step(std::int64_t now_ns, double angle_rad, const FaultPlan& faults, std::vector<Output>& edges);

  /// Edges that were swallowed by Fault::edges_lost.
  [[nodiscard]] std::uint64_t lost_count() const { return lost_in_all_; }

 private:
  struct Crossing {
    double fraction = 0;
    std::uint8_t line = 0;
    bool is_rising = true;
  };
  void cross(double from_rad, double to_rad, double first_rad, double spacing_rad, std::uint8_t line,
             bool rises_forwards);
  void emit(std::int64_t true_stamp_ns, std::uint8_t line, bool is_rising, const FaultPlan& faults,
            std::vector<Output>& edges);

  HeadEncoderSettings settings_;
  double index_angle_rad_;
  Random random_;
  bool has_angle_ = false;
  double angle_rad_ = 0;
  std::int64_t stamp_ns_ = 0;
  std::vector<Crossing> crossings_;
  std::array<std::uint32_t, 3> sequence_{};
  std::array<std::int64_t, 3> last_stamp_ns_{};
  std::int64_t next_extra_ns_ = 0;
  std::uint32_t lost_ = 0;
  std::uint64_t lost_in_all_ = 0;
};

}  // namespace alces::sim
