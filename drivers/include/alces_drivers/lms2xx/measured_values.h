// The measured values in an LMS 2xx telegram 0xB0 (SICK 8007954, section "Measured values", and the table of
// measured-value error codes): a count word, then one 16-bit word a ray, right to left.
//
//   count word: bits 0-9 number of values | 11-12 partial scan: rays at n + 0, 0.25, 0.5, 0.75 deg |
//               13 partial scan | 14-15 unit: 0 cm, 1 mm
//   then, if the laser was told to: mirror turn count and telegram count, 8 bits each
//
// How many bits of a word are the range depends on the measuring mode; the rest are flags of fields,
// reflectors and dazzling. The highest ranges are no ranges but codes: beyond reach, too weak, overflow,
// dazzled, not valid.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace alces::lms2xx {

enum class Unit : std::uint8_t { cm = 0, mm = 1 };

/// As configuration telegram 0x77 numbers them. Reach in mm / in cm.
enum class MeasuringMode : std::uint8_t {
  fields_a_b_dazzle = 0x00,   ///< 8 / 80 m: 13 bits; the default
  reflector_8_levels = 0x01,  ///< 8 / 80 m
  fields_a_b_c = 0x02,        ///< 8 / 80 m
  reflector_4_levels = 0x03,  ///< 16 / 160 m: 14 bits
  fields_a_b = 0x04,          ///< 16 / 160 m
  reflector_2_levels = 0x05,  ///< 32 / 320 m: 15 bits
  field_a = 0x06,             ///< 32 / 320 m
  no_flags = 0x0f,            ///< 32 / 320 m
};
[[nodiscard]] bool is_known(MeasuringMode mode);
/// Bits of the range: 13, 14 or 15.
[[nodiscard]] unsigned range_bits(MeasuringMode mode);

/// Rays without a range, by reason.
struct RayCounters {
  std::uint64_t beyond_reach = 0;
  std::uint64_t too_weak = 0;
  std::uint64_t channel_error = 0;
  std::uint64_t overflow = 0;
  std::uint64_t dazzled = 0;
  std::uint64_t not_valid = 0;  ///< the code for it, zero, and reserved codes
  template <class Visitor>
  void visit(Visitor&& visit) const {
    visit("rays_beyond_reach", beyond_reach);
    visit("rays_too_weak", too_weak);
    visit("rays_with_channel_error", channel_error);
    visit("rays_with_overflow", overflow);
    visit("rays_dazzled", dazzled);
    visit("rays_not_valid", not_valid);
  }
};

struct MeasuredValues {
  std::uint32_t count = 0;
  Unit unit = Unit::cm;
  bool is_partial = false;
  std::uint8_t quarter_deg = 0;            ///< of a partial scan: what its angles are past whole degrees
  std::span<const std::uint8_t> words;     ///< 2 bytes a ray
  std::optional<std::uint8_t> turn_index;  ///< the laser's count of mirror turns
  std::optional<std::uint8_t> telegram_index;
};

/// Takes the data of a telegram 0xB0 apart; nothing when its length does not fit its count word or the unit
/// is none.
[[nodiscard]] std::optional<MeasuredValues> split_measured_values(std::span<const std::uint8_t> data);

/// Metres; 0 for a word that is no range, which is counted.
[[nodiscard]] float range_m(std::uint16_t word, MeasuringMode mode, Unit unit, RayCounters& counters);

}  // namespace alces::lms2xx
