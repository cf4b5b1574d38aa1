// A smooth random function of one variable: mean 0, standard deviation about 1, changing over a given length.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "alces_platform/sim/random.h"

namespace alces::sim {

/// Four sines of random length (0.7 to 1.6 times `length`) and phase. Never leaves +-2.83.
class Wander {
 public:
  Wander(std::uint64_t seed, double length) {
    Random random(seed);
    for (Tone& tone : tones_)
      tone = {2 * std::numbers::pi / (length * random.uniform(0.7, 1.6)),
              random.uniform(0, 2 * std::numbers::pi)};
  }
  [[nodiscard]] double operator()(double at) const {
    double sum = 0;
    for (const Tone& tone : tones_) sum += std::sin(tone.frequency * at + tone.phase);
    return sum * 0.7071;
  }

 private:
  struct Tone {
    double frequency = 0;
    double phase = 0;
  };
  Tone tones_[4];
};

}  // namespace alces::sim
