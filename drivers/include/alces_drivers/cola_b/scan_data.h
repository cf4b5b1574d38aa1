// The scan data telegram of LMS 1xx, LMS 5xx and TiM: "sSN LMDscandata ..." ("Telegram listing", SICK
// 8014631, section "Output of measured values"). All numbers big-endian.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace alces::cola_b {

/// One output channel of 16-bit values: DIST1 is the first echo's range in mm.
struct Channel {
  float scale = 1;
  float offset = 0;
  std::int32_t start_angle = 0;  ///< 1/10000 deg
  std::uint32_t angle_step = 0;  ///< 1/10000 deg, rounded: 1667 means 1/6 deg
  std::uint32_t count = 0;
  std::span<const std::uint8_t> values;  ///< 2 bytes each
  [[nodiscard]] std::uint16_t value(std::uint32_t i) const {
    return static_cast<std::uint16_t>(values[2 * i] << 8 | values[2 * i + 1]);
  }
};

struct ScanData {
  std::uint16_t version = 0;
  std::uint16_t device_number = 0;
  std::uint32_t serial_number = 0;
  std::uint16_t device_status = 0;  ///< the low byte: 0 fine, 1 error, 2 pollution warning, 4 pollution error
  std::uint16_t telegram_counter = 0;
  std::uint16_t scan_counter = 0;
  std::uint32_t start_us = 0;  ///< since the device was switched on, wraps after 71.6 min
  std::uint32_t transmission_us = 0;
  std::int16_t layer_angle = 0;             ///< of an MRS's layer, 1/200 deg above its middle; else 0
  std::uint32_t scan_frequency = 0;         ///< 1/100 Hz
  std::uint32_t measurement_frequency = 0;  ///< 100 Hz
  Channel dist1;
  std::uint32_t channels_16_bit = 0;  ///< of them, all
  std::uint32_t channels_8_bit = 0;
};

/// The payload of a frame as scan data; its spans lie in `payload`. Other channels than DIST1, the encoders,
/// and what follows the channels (position, name, comment, time) are stepped over. Nothing: it is another
/// telegram, is cut off, or has no DIST1.
[[nodiscard]] std::optional<ScanData> parse_scan_data(std::span<const std::uint8_t> payload);

/// True for a payload that begins like scan data, as an event (sSN) or an answer (sRA).
[[nodiscard]] bool is_scan_data(std::span<const std::uint8_t> payload);

/// Rays in a full turn at this angle step, undoing its rounding: 2160 for 1667. 0: the step is none.
[[nodiscard]] std::uint32_t rays_per_turn(std::uint32_t angle_step);

/// Device time, in microseconds, when the ray at `start_angle` was measured, minus `start_us`.
///
/// The listing says that `start_us` is the zero index before the measurement; the zero index is at the back,
/// at -90 deg. The LMS 5xx does so: it transmits 40.8 ms after it, its turn takes 40 ms. LMS 1xx and TiM
/// transmit 3 to 6 ms after `start_us`, before the sweep could have been measured: their stamp is of the zero
/// index after the sweep. So when transmission comes sooner than the sweep takes, a turn is taken off.
[[nodiscard]] double first_ray_offset_us(const ScanData& scan);

}  // namespace alces::cola_b
