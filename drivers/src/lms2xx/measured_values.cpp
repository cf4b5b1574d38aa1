#include "alces_drivers/lms2xx/measured_values.h"

namespace alces::lms2xx {

bool is_known(MeasuringMode mode) {
  return static_cast<unsigned>(mode) <= static_cast<unsigned>(MeasuringMode::field_a) ||
         mode == MeasuringMode::no_flags;
}

unsigned range_bits(MeasuringMode mode) {
  switch (mode) {
    case MeasuringMode::fields_a_b_dazzle:
    case MeasuringMode::reflector_8_levels:
    case MeasuringMode::fields_a_b_c:
      return 13;
    case MeasuringMode::reflector_4_levels:
    case MeasuringMode::fields_a_b:
      return 14;
    case MeasuringMode::reflector_2_levels:
    case MeasuringMode::field_a:
    case MeasuringMode::no_flags:
      break;
  }
  return 15;
}

std::optional<MeasuredValues> split_measured_values(std::span<const std::uint8_t> data) {
  if (data.size() < 2) return std::nullopt;
  const unsigned count_word = data[0] + 256U * data[1];
  const unsigned unit = count_word >> 14;
  if (unit > 1) return std::nullopt;
  MeasuredValues values;
  values.count = count_word & 0x3ffU;
  values.unit = static_cast<Unit>(unit);
  values.is_partial = (count_word & 0x2000U) != 0;
  values.quarter_deg = static_cast<std::uint8_t>((count_word >> 11) & 3U);
  const std::size_t words_size = std::size_t{2} * values.count;
  const std::size_t index_size = data.size() - 2 - words_size;
  if (data.size() < 2 + words_size || index_size > 2) return std::nullopt;
  values.words = data.subspan(2, words_size);
  if (index_size == 2) {
    values.turn_index = data[data.size() - 2];
    values.telegram_index = data[data.size() - 1];
  } else if (index_size == 1) {
    values.telegram_index = data.back();
  }
  return values;
}

float range_m(std::uint16_t word, MeasuringMode mode, Unit unit, RayCounters& counters) {
  const unsigned highest = (1U << range_bits(mode)) - 1U;
  const unsigned value = word & highest;
  if (mode == MeasuringMode::fields_a_b_dazzle && (word & 0x8000U) != 0) {
    ++counters.dazzled;
    return 0;
  }
  // 13 bits: 8183 and up. The codes keep their distance to the highest value in the other modes.
  if (value + 8U >= highest) {
    switch (highest - value) {
      case 8:
        ++counters.beyond_reach;
        break;
      case 5:
        ++counters.channel_error;
        break;
      case 4:
        ++counters.too_weak;
        break;
      case 2:
        ++counters.overflow;
        break;
      case 1:
        ++counters.dazzled;
        break;
      default:
        ++counters.not_valid;
        break;
    }
    return 0;
  }
  if (value == 0) {
    ++counters.not_valid;
    return 0;
  }
  return static_cast<float>(value) * (unit == Unit::mm ? 0.001F : 0.01F);
}

}  // namespace alces::lms2xx
