#include "alces_platform/sim/sensors/head_encoder.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace alces::sim {
namespace {
constexpr double turn_rad = 2 * std::numbers::pi;
}

HeadEncoder::HeadEncoder(const HeadEncoderSettings& settings, double index_angle_rad, std::uint64_t seed)
    : settings_(settings), index_angle_rad_(index_angle_rad), random_(mix(seed, 90)) {}

// Passes of the angles first + k * spacing, k any whole number.
void HeadEncoder::cross(double from_rad, double to_rad, double first_rad, double spacing_rad,
                        std::uint8_t line, bool rises_forwards) {
  if (from_rad == to_rad) return;
  const bool is_forwards = to_rad > from_rad;
  // Forwards, an edge at the new angle itself belongs to this step, one at the old angle to the step before.
  const double low = (std::min(from_rad, to_rad) - first_rad) / spacing_rad;
  const double high = (std::max(from_rad, to_rad) - first_rad) / spacing_rad;
  for (double k = std::floor(low) + 1; k <= high; ++k) {
    const double fraction = (first_rad + k * spacing_rad - from_rad) / (to_rad - from_rad);
    crossings_.push_back({std::clamp(fraction, 0.0, 1.0), line, rises_forwards == is_forwards});
  }
}

void HeadEncoder::emit(std::int64_t true_stamp_ns, std::uint8_t line, bool is_rising, const FaultPlan& faults,
                       std::vector<Output>& edges) {
  ++sequence_[line];
  if (faults.active(Fault::edges_lost, true_stamp_ns) != nullptr) {
    ++lost_;
    ++lost_in_all_;
    return;
  }
  if (lost_ > 0) {  // with the kernel's count the gap shows at the next edge
    if (settings_.has_sequence) edges.push_back({true_stamp_ns, {}, lost_});
    lost_ = 0;
  }
  double late_us = -settings_.latency_us * std::log(1 - random_.uniform());
  if (random_.chance(0.001)) late_us += 20 * settings_.latency_us;
  std::int64_t& last_ns = last_stamp_ns_[line];
  last_ns = std::max(last_ns, true_stamp_ns + static_cast<std::int64_t>(late_us * 1e3));
  Output output;
  output.stamp_ns = last_ns;
  output.edge = {line, is_rising, settings_.has_sequence ? sequence_[line] : 0};
  edges.push_back(output);
}

void HeadEncoder::step(std::int64_t now_ns, double angle_rad, const FaultPlan& faults,
                       std::vector<Output>& edges) {
  const std::size_t first = edges.size();
  if (has_angle_) {
    crossings_.clear();
    const auto index = HeadEncoderSettings::index_line;
    cross(angle_rad_, angle_rad, index_angle_rad_, turn_rad, index, true);
    cross(angle_rad_, angle_rad, index_angle_rad_ + settings_.index_width_rad, turn_rad, index, false);
    if (settings_.quadrature_lines > 0) {
      const double line_rad = turn_rad / settings_.quadrature_lines;
      cross(angle_rad_, angle_rad, 0, line_rad, HeadEncoderSettings::a_line, true);
      cross(angle_rad_, angle_rad, 0.5 * line_rad, line_rad, HeadEncoderSettings::a_line, false);
      cross(angle_rad_, angle_rad, 0.25 * line_rad, line_rad, HeadEncoderSettings::b_line, true);
      cross(angle_rad_, angle_rad, 0.75 * line_rad, line_rad, HeadEncoderSettings::b_line, false);
    }
    std::ranges::stable_sort(crossings_, {}, &Crossing::fraction);
    for (const Crossing& crossing : crossings_) {
      const std::int64_t stamp_ns =
          stamp_ns_ + std::llround(crossing.fraction * static_cast<double>(now_ns - stamp_ns_));
      std::uint8_t line = crossing.line;
      if (line == index && faults.active(Fault::index_missing, stamp_ns) != nullptr) continue;
      if (line != index && faults.active(Fault::ab_swapped, stamp_ns) != nullptr)
        line =
            line == HeadEncoderSettings::a_line ? HeadEncoderSettings::b_line : HeadEncoderSettings::a_line;
      emit(stamp_ns, line, crossing.is_rising, faults, edges);
      if (line == index && faults.active(Fault::index_bouncing, stamp_ns) != nullptr) {
        std::int64_t bounce_ns = stamp_ns;
        bool is_rising = crossing.is_rising;
        for (int bounce = 2 * random_.integer(1, 3); bounce > 0; --bounce) {
          bounce_ns += static_cast<std::int64_t>(random_.uniform(5e3, 50e3));
          is_rising = !is_rising;
          emit(bounce_ns, line, is_rising, faults, edges);
        }
      }
    }
    if (const Injection* extra = faults.active(Fault::index_extra, now_ns)) {
      if (next_extra_ns_ < extra->at_ns) next_extra_ns_ = extra->at_ns;
      for (; next_extra_ns_ <= now_ns; next_extra_ns_ += argument_or(*extra, 700) * 1'000'000) {
        emit(next_extra_ns_, index, true, faults, edges);
        emit(next_extra_ns_ + 400'000, index, false, faults, edges);
      }
    }
  }
  std::stable_sort(edges.begin() + static_cast<std::ptrdiff_t>(first), edges.end(),
                   [](const Output& a, const Output& b) { return a.stamp_ns < b.stamp_ns; });
  has_angle_ = true;
  angle_rad_ = angle_rad;
  stamp_ns_ = now_ns;
}

}  // namespace alces::sim
