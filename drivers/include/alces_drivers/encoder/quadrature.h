// Counts quarter steps from the edges of two lines, a quarter period apart: four counts a period. A leads B
// when the count grows.
//
// Bounce on one line counts up and down and cancels. A lost edge shows as the same edge twice; what the count
// is off by then (up to 4) is not known, and an index pulse repairs it.
#pragma once

#include <cstdint>

namespace alces {

class Quadrature {
 public:
  enum class Line : std::uint8_t { a, b };

  struct Step {
    std::int8_t counts = 0;    ///< +1, -1, or 0 until both lines have been seen
    bool is_repeated = false;  ///< the level was this already: an edge between is missing
  };

  Step on_edge(Line line, bool is_rising) {
    Level& level = line == Line::a ? a_ : b_;
    const Level now = is_rising ? Level::high : Level::low;
    if (level == now) return {0, true};
    level = now;
    if (a_ == Level::unknown || b_ == Level::unknown) return {};
    const bool are_equal = a_ == b_;
    const bool is_forward = line == Line::a ? !are_equal : are_equal;
    return {static_cast<std::int8_t>(is_forward ? 1 : -1), false};
  }

  /// The levels are no longer known.
  void reset() { a_ = b_ = Level::unknown; }

 private:
  enum class Level : std::uint8_t { unknown, low, high };
  Level a_ = Level::unknown;
  Level b_ = Level::unknown;
};

}  // namespace alces
