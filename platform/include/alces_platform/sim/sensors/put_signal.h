// What a simulated sensor writes into its frame: a DBC signal (alces_drivers/can_signal.h), saturated.
#pragma once

#include <cstdint>
#include <span>

#include "alces_drivers/odometry/can_signal.h"

namespace alces::sim {

/// Rounds to the nearest raw value; what does not fit becomes the largest or smallest that does (a real
/// sensor saturates, where insert() refuses). For integer signals. False, and nothing written: the signal
/// does not lie within the data, or is none. NaN is written as raw 0.
[[nodiscard]] bool put_signal(const CanSignal& signal, double physical, std::span<std::uint8_t> data);

}  // namespace alces::sim
