#include "alces_drivers/odometry/can_signal.h"

#include <bit>
#include <cmath>

namespace alces {
namespace {

std::uint64_t low_bits(std::uint32_t count) {
  return count >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
}

/// Calls visit(byte, shift, count, weight) for each run of bits in one byte: `count` bits from bit `shift` of
/// byte `byte` upward are the raw number's bits from `weight` upward.
template <class Visit>
void visit_runs(const CanSignal& signal, Visit visit) {
  std::uint32_t byte = signal.start_bit / 8U;
  std::uint32_t bit = signal.start_bit % 8U;
  std::uint32_t left = signal.length;
  if (signal.order == ByteOrder::intel) {
    for (std::uint32_t weight = 0; left > 0; ++byte, bit = 0) {
      const std::uint32_t count = left < 8 - bit ? left : 8 - bit;
      visit(byte, bit, count, weight);
      weight += count;
      left -= count;
    }
  } else {
    for (; left > 0; ++byte, bit = 7) {
      const std::uint32_t count = left < bit + 1 ? left : bit + 1;
      left -= count;
      visit(byte, bit + 1 - count, count, left);
    }
  }
}

double value_of_bits(const CanSignal& signal, std::uint64_t bits) {
  switch (signal.type) {
    case RawType::unsigned_integer:
      return static_cast<double>(bits);
    case RawType::signed_integer: {
      const std::uint32_t above = 64U - signal.length;
      return static_cast<double>(static_cast<std::int64_t>(bits << above) >> above);
    }
    case RawType::float_ieee:
      return signal.length == 32 ? static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)))
                                 : std::bit_cast<double>(bits);
  }
  return 0;
}

}  // namespace

const char* to_string(SignalStatus status) {
  switch (status) {
    case SignalStatus::ok:
      return "ok";
    case SignalStatus::bad_signal:
      return "the signal's description is impossible";
    case SignalStatus::frame_too_short:
      return "the frame is too short for the signal";
    case SignalStatus::out_of_limits:
      return "the value is outside the signal's limits";
    case SignalStatus::does_not_fit:
      return "the value needs more bits than the signal has";
  }
  return "unknown";
}

bool is_valid(const CanSignal& signal) {
  if (signal.length == 0 || signal.length > 64 || signal.start_bit >= 8U * CanFrame::maximum_bytes)
    return false;
  if (signal.type == RawType::float_ieee && signal.length != 32 && signal.length != 64) return false;
  if (!std::isfinite(signal.factor) || signal.factor == 0 || !std::isfinite(signal.offset)) return false;
  return bytes_needed(signal) <= CanFrame::maximum_bytes;
}

std::uint32_t bytes_needed(const CanSignal& signal) {
  // Bits of the first byte that belong to the signal, if it is long enough; the rest fills whole bytes.
  const std::uint32_t bit = signal.start_bit % 8U;
  const std::uint32_t in_first = signal.order == ByteOrder::intel ? 8U - bit : bit + 1U;
  const std::uint32_t rest = signal.length > in_first ? signal.length - in_first : 0U;
  return signal.start_bit / 8U + 1U + (rest + 7U) / 8U;
}

std::uint64_t extract_bits(const CanSignal& signal, std::span<const std::uint8_t> bytes) {
  std::uint64_t bits = 0;
  visit_runs(signal, [&](std::uint32_t byte, std::uint32_t shift, std::uint32_t count, std::uint32_t weight) {
    bits |= ((std::uint64_t{bytes[byte]} >> shift) & low_bits(count)) << weight;
  });
  return bits;
}

void insert_bits(const CanSignal& signal, std::uint64_t bits, std::span<std::uint8_t> bytes) {
  visit_runs(signal, [&](std::uint32_t byte, std::uint32_t shift, std::uint32_t count, std::uint32_t weight) {
    const std::uint64_t mask = low_bits(count) << shift;
    const std::uint64_t kept = bytes[byte] & ~mask;
    bytes[byte] = static_cast<std::uint8_t>((kept | ((bits >> weight) << shift & mask)) & 0xFFU);
  });
}

SignalValue extract(const CanSignal& signal, std::span<const std::uint8_t> bytes) {
  if (!is_valid(signal)) return {SignalStatus::bad_signal, 0};
  if (bytes.size() < bytes_needed(signal)) return {SignalStatus::frame_too_short, 0};
  const double value = value_of_bits(signal, extract_bits(signal, bytes)) * signal.factor + signal.offset;
  if (!std::isfinite(value)) return {SignalStatus::out_of_limits, 0};
  // Half a raw step of grace, so that a limit written in decimals does not cut off the value that it means.
  const double grace = signal.type == RawType::float_ieee ? 0 : 0.5 * std::abs(signal.factor);
  const bool is_outside = value < signal.minimum - grace || value > signal.maximum + grace;
  if (signal.has_limits() && is_outside) return {SignalStatus::out_of_limits, 0};
  return {SignalStatus::ok, value};
}

SignalStatus insert(const CanSignal& signal, double value, std::span<std::uint8_t> bytes) {
  if (!is_valid(signal)) return SignalStatus::bad_signal;
  if (bytes.size() < bytes_needed(signal)) return SignalStatus::frame_too_short;
  if (!std::isfinite(value)) return SignalStatus::out_of_limits;
  if (signal.has_limits() && (value < signal.minimum || value > signal.maximum))
    return SignalStatus::out_of_limits;
  const double raw = (value - signal.offset) / signal.factor;
  std::uint64_t bits = 0;
  if (signal.type == RawType::float_ieee) {
    const auto narrow = static_cast<float>(raw);
    if (!std::isfinite(signal.length == 32 ? static_cast<double>(narrow) : raw))
      return SignalStatus::does_not_fit;
    bits = signal.length == 32 ? std::uint64_t{std::bit_cast<std::uint32_t>(narrow)}
                               : std::bit_cast<std::uint64_t>(raw);
  } else {
    const double rounded = std::round(raw);
    const bool is_signed = signal.type == RawType::signed_integer;
    const double end = std::ldexp(1.0, is_signed ? signal.length - 1 : signal.length);  // the first too large
    if (!(rounded < end) || !(rounded >= (is_signed ? -end : 0.0))) return SignalStatus::does_not_fit;
    bits = is_signed ? static_cast<std::uint64_t>(static_cast<std::int64_t>(rounded))
                     : static_cast<std::uint64_t>(rounded);
  }
  insert_bits(signal, bits, bytes);
  return SignalStatus::ok;
}

}  // namespace alces
