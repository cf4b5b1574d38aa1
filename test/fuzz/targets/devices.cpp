// The scanner as its wires see it: frames, edges, bytes, links and orders, each with a time, in any order.
// And the parts that promise more than to survive: the encoder, whose answers never change.
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numbers>
#include <vector>

#include "../byte_feed.h"
#include "../target.h"
#include "alces_drivers/cola_b/frame.h"
#include "alces_drivers/lms2xx/telegram.h"
#include "alces_drivers/scanner/scanner.h"
#include "alces_platform/settings/vehicle_settings.h"

namespace alces::fuzz {
namespace {

class Nobody final : public CanPort, public BytePort, public NoticePort {
 public:
  [[nodiscard]] bool send(const CanFrame& frame) override {
    require(frame.size <= CanFrame::maximum_bytes, "frames have at most 64 bytes");
    return takes;
  }
  [[nodiscard]] bool write(std::span<const std::uint8_t>) override { return takes; }
  [[nodiscard]] bool set_baud_rate(std::uint32_t) override { return takes; }
  void raise(const Notice& notice) override {
    require(notice.text != nullptr && notice.text[0] != '\0', "a notice has words");
  }
  bool takes = true;
};

class ScanCheck final : public ScanSink {
 public:
  void on_scan(const Scan& scan) override {
    for (const Point& point : scan.points) require(is_finite(point), "points of a scan are finite");
    require(scan.odometry_from_body.translation_m.allFinite(), "odometry is finite");
    require(scan.gps_position_m.allFinite(), "a GPS position is finite");
    points += scan.points.size();
  }
  std::uint64_t points = 0;
};

/// The vehicle of `alces simulate`, in the variants that the first byte chooses.
ScannerConfig scanner_config(std::uint8_t choice) {
  static const ScannerConfig vehicle = settings::default_vehicle_settings().scanner;
  ScannerConfig config = vehicle;
  ScanAssemblerConfig& assembler = config.assembler;
  assembler.capacity = {.rays_per_profile = 181, .waiting_profiles = 32, .points_per_scan = 8192};
  assembler.laser_count = (choice & 1U) != 0 ? 1 : 2;
  for (std::uint8_t laser = 0; laser < 2; ++laser) {
    config.cola_b[laser].laser = laser;
    config.laser_makes[laser] = (choice & 2U) != 0 ? LaserMake::cola_b : LaserMake::lms2xx;
    config.lms2xx[laser].is_listen_only = config.cola_b[laser].is_listen_only = (choice & 4U) != 0;
  }
  if ((choice & 8U) != 0) {
    EncoderConfig& encoder = config.encoder;
    encoder.shape = AngleShape::quadrature;
    encoder.a_line = 1;
    encoder.b_line = 2;
    encoder.sync_line = 3;
    encoder.quadrature_counts_per_turn = 4096;
  }
  config.has_motor = (choice & 16U) == 0;
  config.has_odometry = (choice & 32U) == 0;
  config.motor.permit.source = static_cast<PermitSource>(choice >> 6);
  config.motor.permit.line = 4;
  config.motor.permit.cob_id = 0x301;
  return config;
}

CanFrame take_frame(ByteFeed& feed) {
  CanFrame frame;
  const std::uint16_t head = feed.number<std::uint16_t>();
  frame.id = head & 0x7ffU;
  frame.size = static_cast<std::uint8_t>(std::min(head >> 12, 8));
  if ((head & 0x800U) != 0) {
    const std::uint8_t form = feed.byte();
    frame.is_extended = (form & 1U) != 0;
    frame.is_remote = (form & 2U) != 0;
    frame.is_error = (form & 4U) != 0;
    frame.is_fd = (form & 8U) != 0;
    if (frame.is_fd) frame.size = std::min<std::uint8_t>(form, CanFrame::maximum_bytes);
    if (frame.is_extended) frame.id = feed.number<std::uint32_t>() & 0x1fffffffU;
  }
  for (std::uint8_t& byte : std::span(frame.data).first(frame.size)) byte = feed.byte();
  return frame;
}

/// Bytes as they are, or framed as the channel's device would: no fuzzer guesses a checksum.
/// None: those of the last time, again.
std::vector<std::uint8_t> take_bytes(ByteFeed& feed, std::uint8_t channel, bool is_cola_b, bool is_framed,
                                     std::span<const std::uint8_t>& last) {
  std::span<const std::uint8_t> raw = feed.bytes(feed.number<std::uint16_t>() & 0x7ffU);
  if (is_framed && raw.empty()) raw = last;
  if (is_framed) last = raw;
  std::vector<std::uint8_t> out(raw.begin(), raw.end());
  if (!is_framed) return out;
  if (channel == gps_channel) {
    std::uint8_t sum = 0;
    for (const std::uint8_t byte : raw) sum ^= byte;
    constexpr std::string_view digits = "0123456789ABCDEF";
    out.insert(out.begin(), '$');
    for (const char c : {'*', digits[sum >> 4], digits[sum & 15U], '\r', '\n'})
      out.push_back(static_cast<std::uint8_t>(c));
    return out;
  }
  out.resize(raw.size() + 64);
  const std::size_t size =
      is_cola_b ? cola_b::build_frame(raw, out)
                : lms2xx::build_telegram(lms2xx::Direction::from_laser, 0x80, raw.empty() ? 0x90 : raw[0],
                                         raw.subspan(std::min<std::size_t>(raw.size(), 1)), 0x10, out);
  out.resize(size);
  return out;
}

/// An event: kind, time since the one before, and what the kind asks for. test/fuzz/make_seeds.py writes
/// them, too.
ALCES_FUZZ_TARGET(scanner) {
  ByteFeed feed(bytes);
  const std::uint8_t choice = feed.byte();
  const ScannerConfig config = scanner_config(choice);
  require(validate(config) == nullptr, validate(config) == nullptr ? "" : validate(config));
  static std::vector<std::max_align_t> memory;
  const std::size_t size = Scanner::memory_required(config);
  memory.resize((size + 64) / sizeof(std::max_align_t) + 1);
  const auto begin = (reinterpret_cast<std::uintptr_t>(memory.data()) + 63) / 64 * 64;
  Nobody nobody;
  ScanCheck scans;
  AssemblerStatus status{};
  Scanner* const scanner = Scanner::create({reinterpret_cast<std::byte*>(begin), size}, config,
                                           {&nobody, {&nobody, &nobody}}, scans, nobody, status);
  require(scanner != nullptr, "a good configuration makes a scanner");
  scanner->start();
  const bool is_cola_b = config.laser_makes[0] == LaserMake::cola_b;
  std::int64_t now_ns = 1000 * ns_per_s;
  std::uint64_t events = 0;
  std::span<const std::uint8_t> last_framed;
  const auto hand_on = [&](const Event& event) {
    ++events;
    scanner->on_event(event);
    (void)scanner->next_wake_ns();
  };
  while (!feed.is_empty() && events < 20'000) {
    const std::uint8_t head = feed.byte();
    static constexpr std::array<std::int64_t, 15> steps_ns = {0,
                                                              10'000,
                                                              100'000,
                                                              ns_per_ms,
                                                              3 * ns_per_ms,
                                                              5 * ns_per_ms,
                                                              10 * ns_per_ms,
                                                              13 * ns_per_ms,
                                                              20 * ns_per_ms,
                                                              50 * ns_per_ms,
                                                              200 * ns_per_ms,
                                                              ns_per_s,
                                                              5 * ns_per_s,
                                                              60 * ns_per_s,
                                                              -2 * ns_per_s};
    Event event;
    // Of the last kind of time anything may stand there, and only the one event has it.
    const bool is_any_time = head >> 4 == 15;
    if (!is_any_time) now_ns += steps_ns.at(head >> 4);
    event.stamp_ns = is_any_time ? feed.number<std::int64_t>() : now_ns;
    std::vector<std::uint8_t> content;
    switch (head & 15U) {
      case 0: {  // ticks, as the event loop makes them
        const std::uint8_t count = feed.byte();
        for (std::uint8_t i = 0; i < count; ++i) {
          event.stamp_ns = now_ns += 10 * ns_per_ms;
          hand_on(event);
        }
        continue;
      }
      case 1:
        break;
      case 2:
      case 3:
        event.kind = EventKind::can_frame;
        event.frame = take_frame(feed);
        break;
      case 4:
        event.kind = EventKind::can_link;
        event.is_up = (feed.byte() & 1U) != 0;
        break;
      case 5: {
        event.kind = EventKind::edge;
        const std::uint8_t what = feed.byte();
        event.edge = {.line = static_cast<std::uint8_t>(what & 7U),
                      .is_rising = (what & 8U) != 0,
                      .sequence = static_cast<std::uint32_t>(what >> 4)};
        break;
      }
      case 6:
        event.kind = EventKind::edges_lost;
        event.lost_count = feed.byte();
        event.channel = feed.byte();
        break;
      case 7:
      case 8:
      case 9:
      case 10: {
        event.kind = EventKind::bytes;
        const std::uint8_t which = feed.byte();
        event.channel = which & 3U;
        content = take_bytes(feed, event.channel, is_cola_b, (head & 1U) != 0, last_framed);
        event.bytes = content;
        break;
      }
      case 11: {
        event.kind = EventKind::byte_link;
        const std::uint8_t which = feed.byte();
        event.channel = which & 3U;
        event.is_up = (which & 4U) != 0;
        break;
      }
      case 12: {
        event.kind = EventKind::order;
        const std::uint8_t which = feed.byte();
        event.order = static_cast<MotorOrder>(which % 3);
        event.is_up = (which & 4U) != 0;
        break;
      }
      case 13: {
        event.kind = EventKind::sync_sent;
        event.channel = feed.byte() & 1U;
        break;
      }
      case 14:
        event.kind = EventKind::stop;
        break;
      default:
        nobody.takes = !nobody.takes;
        continue;
    }
    hand_on(event);
  }
  scanner->finish();
  const ScanAssemblerCounters& c = scanner->assembler().counters();
  require(c.profiles == c.profiles_used + c.profiles_of_unknown_laser + c.profiles_absurd +
                            c.profiles_without_room + c.profiles_angle_late + c.profiles_angle_lost +
                            c.profiles_late + c.profiles_head_standing +
                            scanner->assembler().waiting_profiles(),
          "every profile is counted once");
  require(c.rays == c.points + c.rays_without_range + c.rays_not_finite + c.rays_too_near + c.rays_too_far +
                        c.rays_masked + c.rays_without_room,
          "every ray is counted once");
  require(scanner->counters().events == events, "every event is counted");
  require(scans.points <= c.points, "no more points are handed on than were made");
}

ALCES_FUZZ_TARGET(encoder) {
  ByteFeed feed(bytes);
  Nobody nobody;
  EncoderConfig config;
  const std::uint8_t choice = feed.byte();
  config.shape = static_cast<AngleShape>(choice % 3);
  config.drive_counts_per_turn = 4096;
  config.quadrature_counts_per_turn = 4096;
  config.a_line = 1;
  config.b_line = 2;
  config.sync_line = 3;
  config.index_line = (choice & 4U) != 0 ? EncoderConfig::no_line : 0;
  config.wait_for_index = (choice & 8U) != 0;
  if ((choice & 16U) != 0) config.expected_speed_rad_s = -config.expected_speed_rad_s;
  if ((choice & 32U) != 0) config.index_width_rad = 0.1;
  if (config.wait_for_index || config.shape == AngleShape::none) config.maximum_wait_ns = 3 * ns_per_s;
  if (validate(config) != nullptr) return;
  const auto encoder = std::make_unique<Encoder>(config, nobody);
  struct Answered {
    std::int64_t stamp_ns;
    double angle_rad;
  };
  std::vector<Answered> answered;
  std::int64_t now_ns = 100 * ns_per_s;
  std::int32_t position = 0;
  bool has_stepped_back = false;
  for (int events = 0; !feed.is_empty() && events < 5000; ++events) {
    const std::uint8_t head = feed.byte();
    const std::int64_t stamp_ns = now_ns - std::int64_t{feed.byte()} * 50'000;
    switch (head & 7U) {
      case 0:
      case 1:
        encoder->on_edge({.line = static_cast<std::uint8_t>((head >> 3) & 3U),
                          .is_rising = (head & 32U) != 0,
                          .sequence = static_cast<std::uint32_t>(head >> 6)},
                         stamp_ns);
        break;
      case 2:
      case 3:
        position = static_cast<std::int32_t>(static_cast<std::uint32_t>(position) +
                                             static_cast<std::uint32_t>(feed.number<std::int16_t>()));
        encoder->on_drive_position(position, stamp_ns);
        break;
      case 4:
        encoder->on_drive_position(feed.number<std::int32_t>(), stamp_ns);
        break;
      case 5:
        encoder->on_edges_lost(head >> 3, stamp_ns);
        break;
      case 6:
        now_ns += std::int64_t{head >> 3} * ns_per_ms;
        encoder->on_tick(now_ns);
        break;
      default: {
        const AngleAnswer answer = encoder->angle_at(stamp_ns - std::int64_t{head >> 3} * 20 * ns_per_ms);
        if (answer.status != AngleStatus::ok) break;
        require(std::isfinite(answer.angle_rad) && answer.sigma_rad >= 0, "angles are finite");
        if (answered.size() < 200)
          answered.push_back({stamp_ns - std::int64_t{head >> 3} * 20 * ns_per_ms, answer.angle_rad});
      }
    }
    has_stepped_back = has_stepped_back || encoder->counters().clock_steps > 0;
    if (has_stepped_back || events % 64 != 63) continue;
    for (const Answered& before : answered) {
      const AngleAnswer again = encoder->angle_at(before.stamp_ns);
      require(again.status == AngleStatus::too_old ||
                  (again.status == AngleStatus::ok && again.angle_rad == before.angle_rad),
              "what was answered as ok never changes");
    }
  }
}

}  // namespace
}  // namespace alces::fuzz
