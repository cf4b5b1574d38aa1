// The clock that the mapper's stage times are measured with on a desk.
#pragma once

#include <chrono>
#include <cstdint>

#include "alces/mapper.h"

namespace alces::offline {

class SteadyStageClock final : public StageClock {
 public:
  [[nodiscard]] std::uint64_t now_ns() override {
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
  }
};

}  // namespace alces::offline
