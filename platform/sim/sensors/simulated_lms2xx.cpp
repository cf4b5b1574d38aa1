#include "alces_platform/sim/sensors/simulated_lms2xx.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "alces_platform/sim/random.h"

namespace alces::sim {
namespace {

constexpr std::size_t status_data_bytes = 151;
constexpr std::size_t configuration_bytes = 34;
constexpr std::uint8_t turn_index_bit = 0x02;  // of the configuration's availability

void put_word(std::vector<std::uint8_t>& bytes, std::size_t place, std::uint32_t word) {
  bytes[place] = static_cast<std::uint8_t>(word & 0xff);
  bytes[place + 1] = static_cast<std::uint8_t>((word >> 8) & 0xff);
}

std::uint32_t rate_of_mode(std::uint8_t mode) {
  switch (mode) {
    case 0x42:
      return 9600;
    case 0x41:
      return 19200;
    case 0x40:
      return 38400;
    case 0x48:
      return 500000;
    default:
      return 0;
  }
}

std::uint16_t word_of(float range_m, lms2xx::MeasuringMode mode, lms2xx::Unit unit) {
  const std::uint32_t highest = (1U << lms2xx::range_bits(mode)) - 1U;
  const std::uint32_t no_echo = highest - 8;
  const double value = std::round(static_cast<double>(range_m) * (unit == lms2xx::Unit::mm ? 1000.0 : 100.0));
  if (!(value >= 1 && value < no_echo)) return static_cast<std::uint16_t>(no_echo);
  return static_cast<std::uint16_t>(value);
}

}  // namespace

SimulatedLms2xx::SimulatedLms2xx(const SimulatedLms2xxSettings& settings, SweepSource& source)
    : settings_(settings),
      source_(source),
      mode_(!settings.is_streaming                      ? Mode::on_request
            : settings.resolution_hundredths_deg == 100 ? Mode::stream_all
                                                        : Mode::stream_partial),
      baud_(settings.baud),
      availability_(settings.sends_turn_index ? turn_index_bit : std::uint8_t{0}) {}

// ---- from the host

void SimulatedLms2xx::on_bytes(std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  measure(now_ns);
  if (!is_on_ || !is_connected_) return;
  const bool is_garbled = host_baud_ != 0 && host_baud_ != baud_;
  for (const std::uint8_t byte : bytes) {
    parser_.push(is_garbled ? static_cast<std::uint8_t>(mix(byte, ++garbled_) | 0x80U) : byte);
    const std::uint64_t crc_errors = parser_.counters().crc_errors;
    while (const auto token = parser_.next()) {
      if (token->kind == lms2xx::TelegramParser::Kind::telegram) on_telegram(token->telegram, now_ns);
    }
    if (parser_.counters().crc_errors != crc_errors) {
      enqueue({lms2xx::nak_byte}, now_ns + ns_per_ms);
      ++counters_.naks_sent;
    }
  }
}

void SimulatedLms2xx::on_telegram(const lms2xx::Telegram& telegram, std::int64_t now_ns) {
  if (telegram.address != 0 && telegram.address != settings_.address) return;
  if (refused_ > 0) {
    --refused_;
    ++counters_.naks_sent;
    enqueue({lms2xx::nak_byte}, now_ns + ns_per_ms);
    return;
  }
  ++counters_.telegrams_taken;
  enqueue({lms2xx::ack_byte}, now_ns + ns_per_ms);
  const std::int64_t soon_ns = now_ns + settings_.response_delay_ns;
  const std::span<const std::uint8_t> data = telegram.data;
  const bool is_installing = mode_ == Mode::installation;
  switch (telegram.command) {
    case 0x10: {
      send(0x91, {}, soon_ns);
      mode_ = Mode::on_request;
      return;
    }
    case 0x20: {
      const std::array<std::uint8_t, 1> result{change_mode(data)};
      send(0xa0, result, soon_ns);
      return;
    }
    case 0x31: {
      std::vector<std::uint8_t> status(status_data_bytes, 0);
      const std::string_view version = "V02.10 ";
      std::copy(version.begin(), version.end(), status.begin());
      status[7] = is_installing ? 0x00 : is_streaming() ? 0x24 : 0x25;
      status[101] = static_cast<std::uint8_t>(settings_.mode);
      put_word(status, 106, settings_.field_of_view_deg);
      put_word(status, 108, settings_.resolution_hundredths_deg);
      status[119] = settings_.address;
      status[121] = static_cast<std::uint8_t>(settings_.unit);
      send(0xb1, status, soon_ns);
      return;
    }
    case 0x32:
      send(0xb2, {}, soon_ns);
      return;
    case 0x3a: {
      const std::string_view type = "LMS291;S05 X02.10  ";
      const std::vector<std::uint8_t> bytes(type.begin(), type.end());
      send(0xba, bytes, soon_ns);
      return;
    }
    case 0x3b: {
      const std::uint32_t angle = data.size() == 4 ? data[0] + 256U * data[1] : 0;
      const std::uint32_t resolution = data.size() == 4 ? data[2] + 256U * data[3] : 0;
      const bool is_good = is_installing && (angle == 100 || angle == 180) &&
                           (resolution == 100 || resolution == 50 || (resolution == 25 && angle == 100));
      if (is_good) {
        settings_.field_of_view_deg = angle;
        settings_.resolution_hundredths_deg = resolution;
        ++counters_.variant_changes;
      }
      std::vector<std::uint8_t> answer(5, is_good ? std::uint8_t{1} : std::uint8_t{0});
      put_word(answer, 1, settings_.field_of_view_deg);
      put_word(answer, 3, settings_.resolution_hundredths_deg);
      send(0xbb, answer, soon_ns);
      return;
    }
    case 0x74:
      send(0xf4, configuration(), soon_ns);
      return;
    case 0x77: {
      const bool is_good = is_installing && data.size() == configuration_bytes && data[6] <= 1 &&
                           lms2xx::is_known(static_cast<lms2xx::MeasuringMode>(data[5]));
      if (is_good) {
        availability_ = data[4];
        settings_.mode = static_cast<lms2xx::MeasuringMode>(data[5]);
        settings_.unit = static_cast<lms2xx::Unit>(data[6]);
        ++counters_.configuration_writes;
      }
      std::vector<std::uint8_t> answer = configuration();
      answer.insert(answer.begin(), is_good ? std::uint8_t{1} : std::uint8_t{0});
      send(0xf7, answer, now_ns + settings_.write_delay_ns);
      return;
    }
    default:
      send(0x92, {}, soon_ns);
      return;
  }
}

std::uint8_t SimulatedLms2xx::change_mode(std::span<const std::uint8_t> data) {
  constexpr std::uint8_t done = 0;
  constexpr std::uint8_t wrong_password = 1;
  constexpr std::uint8_t fault = 2;
  if (data.empty()) return fault;
  if (const std::uint32_t baud = rate_of_mode(data[0]); baud != 0) {
    baud_after_response_ = baud;
    return done;
  }
  switch (data[0]) {
    case 0x00:
      if (data.size() != 1 + settings_.password.size()) return wrong_password;
      for (std::size_t i = 0; i < settings_.password.size(); ++i) {
        if (data[1 + i] != static_cast<std::uint8_t>(settings_.password[i])) return wrong_password;
      }
      mode_ = Mode::installation;
      return done;
    case 0x24:
      mode_ = Mode::stream_all;
      return done;
    case 0x25:
      mode_ = Mode::on_request;
      return done;
    case 0x2a:
      mode_ = Mode::stream_partial;
      return done;
    default:
      return fault;
  }
}

std::vector<std::uint8_t> SimulatedLms2xx::configuration() const {
  std::vector<std::uint8_t> bytes(configuration_bytes, 0);
  bytes[3] = 1;  // sensitivity medium
  bytes[4] = availability_;
  bytes[5] = static_cast<std::uint8_t>(settings_.mode);
  bytes[6] = static_cast<std::uint8_t>(settings_.unit);
  bytes[9] = 2;   // multiple evaluation
  bytes[10] = 2;  // no restart block
  return bytes;
}

// ---- to the host

void SimulatedLms2xx::send(std::uint8_t command, std::span<const std::uint8_t> data,
                           std::int64_t earliest_ns) {
  constexpr std::uint8_t type_6_no_error = 0x10;
  std::vector<std::uint8_t> bytes(lms2xx::maximum_telegram_bytes);
  bytes.resize(lms2xx::build_telegram(lms2xx::Direction::from_laser, settings_.address, command, data,
                                      type_6_no_error, bytes));
  if (swallowed_ > 0) {
    --swallowed_;
    return;
  }
  if (spoiled_ > 0) {
    --spoiled_;
    bytes[bytes.size() / 2] = static_cast<std::uint8_t>(bytes[bytes.size() / 2] ^ 0x10U);
  }
  if (truncated_ > 0) {
    --truncated_;
    bytes.resize(bytes.size() / 2);
  }
  enqueue(std::move(bytes), earliest_ns);
}

void SimulatedLms2xx::enqueue(std::vector<std::uint8_t> bytes, std::int64_t earliest_ns) {
  const std::int64_t start_ns = std::max(earliest_ns, line_free_ns_);
  line_free_ns_ = start_ns + std::llround(static_cast<double>(bytes.size()) * 1e10 / baud_);
  outgoing_.push_back({start_ns, baud_, std::move(bytes), 0});
}

std::optional<SimulatedLms2xx::Chunk> SimulatedLms2xx::poll(std::int64_t now_ns) {
  measure(now_ns);
  while (!outgoing_.empty()) {
    Outgoing& next = outgoing_.front();
    const double byte_ns = 1e10 / next.baud;
    const double elapsed_ns = static_cast<double>(now_ns - next.start_ns);
    const auto due = static_cast<std::size_t>(
        std::clamp(std::floor(elapsed_ns / byte_ns + 1e-6), 0.0, static_cast<double>(next.bytes.size())));
    if (due == next.sent) return std::nullopt;
    Chunk chunk;
    chunk.baud = next.baud;
    chunk.stamp_ns = next.start_ns + std::llround(static_cast<double>(due) * byte_ns);
    chunk.bytes.assign(next.bytes.begin() + static_cast<std::ptrdiff_t>(next.sent),
                       next.bytes.begin() + static_cast<std::ptrdiff_t>(due));
    next.sent = due;
    const bool is_garbled = host_baud_ != 0 && host_baud_ != next.baud;
    if (next.sent == next.bytes.size()) outgoing_.pop_front();
    if (outgoing_.empty() && baud_after_response_ != 0) {
      baud_ = baud_after_response_;
      baud_after_response_ = 0;
    }
    if (!is_connected_) continue;
    if (is_garbled) {
      for (std::uint8_t& byte : chunk.bytes) byte = static_cast<std::uint8_t>(mix(byte, ++garbled_));
    }
    return chunk;
  }
  return std::nullopt;
}

std::int64_t SimulatedLms2xx::first_ray_ns(std::int64_t turn) const {
  return settings_.first_ray_stamp_ns + std::llround(static_cast<double>(turn) * 1e9 / settings_.turns_per_s);
}

std::int64_t SimulatedLms2xx::ready_ns(std::int64_t turn) const {
  const double rays_ns = settings_.field_of_view_deg / 360.0 * 1e9 / settings_.turns_per_s;
  return first_ray_ns(turn) + std::llround(rays_ns) + settings_.send_delay_ns;
}

void SimulatedLms2xx::measure(std::int64_t until_ns) {
  if (is_first_poll_) {
    is_first_poll_ = false;
    const double turns =
        static_cast<double>(until_ns - settings_.first_ray_stamp_ns) * 1e-9 * settings_.turns_per_s;
    next_turn_ = std::max<std::int64_t>(0, std::llround(std::floor(turns)) - 1);
    while (ready_ns(next_turn_) < until_ns) ++next_turn_;
  }
  for (; ready_ns(next_turn_) <= until_ns; ++next_turn_) {
    if (!is_on_ || !is_streaming()) continue;
    if (line_free_ns_ > ready_ns(next_turn_) || baud_after_response_ != 0) {
      ++counters_.sweeps_left_out;
      continue;
    }
    send_sweep(next_turn_, ready_ns(next_turn_));
  }
}

void SimulatedLms2xx::send_sweep(std::int64_t turn, std::int64_t ready_ns) {
  // A mirror turn measures every `interlacing()`th of the rays; the next turn begins one ray further.
  const bool is_partial = mode_ == Mode::stream_partial;
  if (!is_partial && interlacing() != 1) return;  // turns mixed into one telegram: not simulated
  const auto shift = static_cast<std::uint32_t>(turn % interlacing());
  const double ray_interval_ns = 1e9 / settings_.turns_per_s / 360.0 / interlacing();
  ranges_m_.assign(settings_.field_of_view_deg * interlacing() + 1, 0.0F);
  source_.sweep(first_ray_ns(turn), ray_interval_ns, ranges_m_);

  std::vector<std::uint8_t> data(2);
  std::uint32_t count = 0;
  for (std::size_t ray = shift; ray < ranges_m_.size(); ray += interlacing(), ++count) {
    const std::uint16_t word = word_of(ranges_m_[ray], settings_.mode, settings_.unit);
    data.push_back(static_cast<std::uint8_t>(word & 0xff));
    data.push_back(static_cast<std::uint8_t>(word >> 8));
  }
  std::uint32_t count_word = count | static_cast<std::uint32_t>(settings_.unit) << 14;
  if (is_partial) count_word |= 0x2000U | (shift * settings_.resolution_hundredths_deg / 25U) << 11;
  put_word(data, 0, count_word);
  if ((availability_ & turn_index_bit) != 0) {
    data.push_back(static_cast<std::uint8_t>(turn & 0xff));
    data.push_back(telegram_index_);
  }
  ++telegram_index_;
  ++counters_.sweeps_sent;
  send(0xb0, data, ready_ns);
}

// ---- faults

void SimulatedLms2xx::send_garbage(std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  measure(now_ns);
  enqueue({bytes.begin(), bytes.end()}, now_ns);
}

void SimulatedLms2xx::switch_off() {
  is_on_ = false;
  outgoing_.clear();
  line_free_ns_ = INT64_MIN;
  baud_after_response_ = 0;
}

void SimulatedLms2xx::switch_on(std::int64_t now_ns, std::uint32_t baud) {
  measure(now_ns);
  is_on_ = true;
  mode_ = Mode::on_request;
  baud_ = baud;
  parser_ = lms2xx::TelegramParser(lms2xx::Direction::from_host);
  const std::string_view type = "LMS291;S05 X02.10  ";
  const std::vector<std::uint8_t> bytes(type.begin(), type.end());
  send(0x90, bytes, now_ns);
}

}  // namespace alces::sim
