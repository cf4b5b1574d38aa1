#include "alces_drivers/cola_b/scan_data.h"

#include <bit>
#include <string_view>

namespace alces::cola_b {
namespace {

/// Reads big-endian numbers one after the other; past the end it reads zeros and says so.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  std::span<const std::uint8_t> bytes(std::size_t count) {
    if (count > bytes_.size()) {
      is_good_ = false;
      return {};
    }
    const auto taken = bytes_.first(count);
    bytes_ = bytes_.subspan(count);
    return taken;
  }
  std::uint32_t number(std::size_t count) {
    std::uint32_t value = 0;
    for (const std::uint8_t byte : bytes(count)) value = value << 8 | byte;
    return value;
  }
  std::uint16_t u16() { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t u32() { return number(4); }
  float real() { return std::bit_cast<float>(u32()); }
  [[nodiscard]] bool is_good() const { return is_good_; }

 private:
  std::span<const std::uint8_t> bytes_;
  bool is_good_ = true;
};

bool begins_with(std::span<const std::uint8_t> bytes, std::string_view text) {
  if (bytes.size() < text.size()) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (bytes[i] != static_cast<std::uint8_t>(text[i])) return false;
  }
  return true;
}

constexpr std::string_view event = "sSN LMDscandata ";
constexpr std::string_view answer = "sRA LMDscandata ";
constexpr std::uint32_t most_channels = 20;  // 5 echoes of distance, remission, angle, ...

}  // namespace

bool is_scan_data(std::span<const std::uint8_t> payload) {
  return begins_with(payload, event) || begins_with(payload, answer);
}

std::optional<ScanData> parse_scan_data(std::span<const std::uint8_t> payload) {
  if (!is_scan_data(payload)) return std::nullopt;
  Reader reader(payload.subspan(event.size()));
  ScanData scan;
  scan.version = reader.u16();
  scan.device_number = reader.u16();
  scan.serial_number = reader.u32();
  scan.device_status = reader.u16();
  scan.telegram_counter = reader.u16();
  scan.scan_counter = reader.u16();
  scan.start_us = reader.u32();
  scan.transmission_us = reader.u32();
  (void)reader.u16();  // digital inputs
  (void)reader.u16();  // digital outputs
  scan.layer_angle = static_cast<std::int16_t>(reader.u16());
  scan.scan_frequency = reader.u32();
  scan.measurement_frequency = reader.u32();
  const std::uint32_t encoders = reader.u16();
  if (encoders > 4) return std::nullopt;
  (void)reader.bytes(std::size_t{6} * encoders);  // position, speed

  bool has_dist1 = false;
  const auto read_channels = [&](std::size_t value_bytes) {
    const std::uint32_t channels = reader.u16();
    if (channels > most_channels) return channels;
    for (std::uint32_t i = 0; i < channels && reader.is_good(); ++i) {
      const auto content = reader.bytes(5);
      Channel channel;
      channel.scale = reader.real();
      channel.offset = reader.real();
      channel.start_angle = static_cast<std::int32_t>(reader.u32());
      channel.angle_step = reader.u16();
      channel.count = reader.u16();
      channel.values = reader.bytes(value_bytes * channel.count);
      if (value_bytes == 2 && !has_dist1 && begins_with(content, "DIST1")) {
        scan.dist1 = channel;
        has_dist1 = true;
      }
    }
    return channels;
  };
  scan.channels_16_bit = read_channels(2);
  if (scan.channels_16_bit > most_channels) return std::nullopt;
  scan.channels_8_bit = read_channels(1);
  if (scan.channels_8_bit > most_channels) return std::nullopt;
  if (!reader.is_good() || !has_dist1) return std::nullopt;
  return scan;
}

std::uint32_t rays_per_turn(std::uint32_t angle_step) {
  constexpr std::uint32_t turn = 3'600'000;
  if (angle_step == 0) return 0;
  return (turn + angle_step / 2) / angle_step;
}

double first_ray_offset_us(const ScanData& scan) {
  constexpr double zero_index_deg = -90;
  const std::uint32_t rays = rays_per_turn(scan.dist1.angle_step);
  if (scan.scan_frequency == 0 || rays == 0) return 0;
  const double turn_us = 1e8 / scan.scan_frequency;
  const double sweep_us = turn_us * scan.dist1.count / rays;
  const double since_zero_us = (scan.dist1.start_angle * 1e-4 - zero_index_deg) / 360 * turn_us;
  const auto to_transmission_us =
      static_cast<double>(scan.transmission_us - scan.start_us);  // wraps with them
  return to_transmission_us < sweep_us ? since_zero_us - turn_us : since_zero_us;
}

}  // namespace alces::cola_b
