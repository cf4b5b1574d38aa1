#include "alces_platform/sim/sensors/put_signal.h"

#include <cmath>

namespace alces::sim {

bool put_signal(const CanSignal& signal, double physical, std::span<std::uint8_t> data) {
  if (!is_valid(signal) || signal.type == RawType::float_ieee || bytes_needed(signal) > data.size())
    return false;
  const int length = signal.length;
  const double raw = std::round((physical - signal.offset) / signal.factor);
  std::uint64_t bits = 0;
  if (signal.type == RawType::signed_integer) {
    const double limit = std::ldexp(1.0, length - 1);
    if (raw >= limit)
      bits = (std::uint64_t{1} << (length - 1)) - 1;
    else if (raw < -limit)
      bits = std::uint64_t{1} << (length - 1);
    else if (!std::isnan(raw))
      bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(raw));
  } else if (raw >= std::ldexp(1.0, length)) {
    bits = ~std::uint64_t{0};
  } else if (raw > 0) {
    bits = static_cast<std::uint64_t>(raw);
  }
  insert_bits(signal, bits, data);
  return true;
}

}  // namespace alces::sim
