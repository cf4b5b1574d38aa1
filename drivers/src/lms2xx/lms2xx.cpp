#include "alces_drivers/lms2xx/lms2xx.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace alces {
namespace {

using lms2xx::Telegram;
using lms2xx::TelegramParser;

// Commands; the answer has the reply bit set.
constexpr std::uint8_t change_mode = 0x20;
constexpr std::uint8_t read_status = 0x31;
constexpr std::uint8_t change_variant = 0x3b;
constexpr std::uint8_t read_configuration = 0x74;
constexpr std::uint8_t write_configuration = 0x77;
constexpr std::uint8_t values_reply = 0xb0;
constexpr std::uint8_t power_on_message = 0x90;

// Operating modes of command 0x20.
constexpr std::uint8_t mode_installation = 0x00;
constexpr std::uint8_t mode_stream_all = 0x24;
constexpr std::uint8_t mode_on_request = 0x25;
constexpr std::uint8_t mode_stream_partial = 0x2a;

// Places in the data of the status answer 0xB1 and of the configuration answer 0xF4.
constexpr std::size_t status_field_of_view = 106;
constexpr std::size_t status_resolution = 108;
constexpr std::size_t configuration_availability = 4;
constexpr std::size_t configuration_mode = 5;
constexpr std::size_t configuration_unit = 6;
constexpr std::uint8_t availability_turn_index = 0x02;

// The manual gives 60 ms for an acknowledgement; mode changes and writes to the EEPROM take seconds.
constexpr std::int64_t search_time_out_ns = 300 * ns_per_ms;
constexpr std::int64_t acknowledged_time_out_ns = ns_per_s;
constexpr std::int64_t mode_time_out_ns = 3 * ns_per_s;
constexpr std::int64_t read_time_out_ns = 2 * ns_per_s;
constexpr std::int64_t write_time_out_ns = 10 * ns_per_s;
constexpr std::int64_t settling_ns = 100 * ns_per_ms;
constexpr std::int64_t stale_ns = 250 * ns_per_ms;
constexpr std::int64_t shortest_back_off_ns = 500 * ns_per_ms;
constexpr std::int64_t longest_back_off_ns = 8 * ns_per_s;
constexpr std::uint32_t tries = 3;
constexpr std::uint32_t unexpected_limit = 20;

std::uint8_t rate_mode(std::uint32_t baud) {
  switch (baud) {
    case 9600:
      return 0x42;
    case 19200:
      return 0x41;
    case 38400:
      return 0x40;
    case 500000:
      return 0x48;
    default:
      return 0;
  }
}

std::uint32_t word_at(std::span<const std::uint8_t> data, std::size_t place) {
  return data[place] + 256U * data[place + 1];
}

}  // namespace

const char* validate(const Lms2xxConfig& config) {
  if (rate_mode(config.baud) == 0) return "baud must be 9600, 19200, 38400 or 500000";
  for (const std::uint32_t baud : config.candidate_bauds) {
    if (baud != 0 && rate_mode(baud) == 0) return "candidate bauds must be 9600, 19200, 38400 or 500000";
  }
  if (config.field_of_view_deg != 100 && config.field_of_view_deg != 180) {
    return "the field of view must be 100 or 180 deg";
  }
  const std::uint32_t resolution = config.resolution_hundredths_deg;
  if (resolution != 100 && resolution != 50 && resolution != 25)
    return "the resolution must be 1, 0.5 or 0.25 deg";
  if (resolution == 25 && config.field_of_view_deg != 100) {
    return "a resolution of 0.25 deg needs the field of view of 100 deg";
  }
  if (config.unit != lms2xx::Unit::cm && config.unit != lms2xx::Unit::mm) return "the unit must be cm or mm";
  if (!lms2xx::is_known(config.mode)) return "the measuring mode is unknown";
  if (!(config.turns_per_s >= 1 && config.turns_per_s <= 1000)) return "turns_per_s must be 1 to 1000";
  if (config.address > 0x7f) return "the address must be 0 to 127";
  return nullptr;
}

Lms2xx::Lms2xx(const Lms2xxConfig& config, BytePort& port, NoticePort& notices, ProfileSink& profiles)
    : config_(config), port_(port), notices_(notices), sink_(profiles), clock_(config.turns_per_s) {}

LaserState Lms2xx::state() const {
  switch (phase_) {
    case Phase::stopped:
      return LaserState::stopped;
    case Phase::bad_config:
      return LaserState::failed;
    case Phase::waiting_for_link:
    case Phase::backing_off:
    case Phase::searching:
    case Phase::changing_rate:
    case Phase::settling:
    case Phase::confirming_rate:
      return LaserState::connecting;
    case Phase::reading_status:
    case Phase::reading_configuration:
    case Phase::entering_installation:
    case Phase::setting_variant:
    case Phase::writing_configuration:
    case Phase::starting_stream:
      return LaserState::configuring;
    case Phase::measuring:
      return LaserState::measuring;
    case Phase::stopping:
      return LaserState::stopping;
  }
  return LaserState::failed;
}

void Lms2xx::raise(std::int64_t now_ns, Severity severity, const char* text) {
  notices_.raise({now_ns, severity, config_.name, text, 0, false});
}

void Lms2xx::raise(std::int64_t now_ns, Severity severity, const char* text, std::int64_t value) {
  notices_.raise({now_ns, severity, config_.name, text, value, true});
}

void Lms2xx::enter(Phase phase, const char* reason) {
  phase_ = phase;
  reason_ = reason;
}

// ---- from outside

void Lms2xx::start(std::int64_t now_ns) {
  if (is_started_) return;
  if (const char* what = validate(config_); what != nullptr) {
    enter(Phase::bad_config, what);
    raise(now_ns, Severity::error, what);
    return;
  }
  is_started_ = true;
  back_off_ns_ = shortest_back_off_ns;
  told_failure_ = nullptr;
  target_is_possible_ = true;
  if (!link_is_up_) {
    enter(Phase::waiting_for_link, "the line is down");
  } else if (config_.is_listen_only) {
    if (!set_rate(config_.baud, now_ns)) baud_ = config_.baud;
    begin_measuring(now_ns);
  } else {
    search(now_ns);
  }
}

void Lms2xx::stop(std::int64_t now_ns) {
  if (!is_started_) return;
  is_started_ = false;
  const bool may_stream = phase_ == Phase::measuring || state() == LaserState::configuring;
  if (!may_stream || config_.is_listen_only || !link_is_up_) {
    enter(Phase::stopped, "stopped");
    return;
  }
  enter(Phase::stopping, "waiting for the laser to end its stream");
  request_mode(mode_on_request, ns_per_s, now_ns);
}

void Lms2xx::on_link(bool is_up, std::int64_t now_ns) {
  if (is_up == link_is_up_) return;
  link_is_up_ = is_up;
  parser_.discard();
  clock_.reset();
  if (!is_up) {
    if (phase_ == Phase::stopping) {
      enter(Phase::stopped, "the line went down while stopping");
    } else if (is_started_) {
      enter(Phase::waiting_for_link, "the line is down");
      raise(now_ns, Severity::warning, "the serial line went down");
    }
    return;
  }
  if (!is_started_) return;
  raise(now_ns, Severity::info, "the serial line is up");
  back_off_ns_ = shortest_back_off_ns;
  target_is_possible_ = true;
  if (config_.is_listen_only) {
    begin_measuring(now_ns);
  } else {
    search(now_ns);
  }
}

void Lms2xx::on_bytes(std::span<const std::uint8_t> bytes, std::int64_t stamp_ns) {
  if (bytes.empty()) return;
  const auto on_wire_ns = static_cast<std::int64_t>(static_cast<double>(bytes.size()) * byte_ns());
  give_up_stale_bytes(stamp_ns - on_wire_ns);
  last_bytes_ns_ = stamp_ns;
  const std::uint64_t last_position = parser_.position() + bytes.size();
  for (const std::uint8_t byte : bytes) {
    parser_.push(byte);
    while (const auto token = parser_.next()) {
      if (token->kind == TelegramParser::Kind::ack) {
        on_ack(stamp_ns);
      } else if (token->kind == TelegramParser::Kind::nak) {
        on_nak(stamp_ns);
      } else {
        const auto bytes_after = static_cast<double>(last_position - token->end_position);
        on_telegram(token->telegram, stamp_ns - std::llround(bytes_after * byte_ns()), stamp_ns);
      }
    }
  }
}

void Lms2xx::give_up_stale_bytes(std::int64_t now_ns) {
  while (parser_.pending_bytes() > 0 && now_ns - last_bytes_ns_ > stale_ns) {
    parser_.resynchronise();
    while (const auto token = parser_.next()) {
      if (token->kind == TelegramParser::Kind::telegram) on_telegram(token->telegram, last_bytes_ns_, now_ns);
    }
  }
}

void Lms2xx::on_tick(std::int64_t now_ns) {
  if (ticked_ns_ != no_stamp_ns && now_ns < ticked_ns_ - clock_step_ns) {
    const std::int64_t step_ns = now_ns - ticked_ns_;
    shift_stamp(deadline_ns_, step_ns);
    if (last_bytes_ns_ > now_ns) shift_stamp(last_bytes_ns_, step_ns);
    if (last_values_ns_ > now_ns) shift_stamp(last_values_ns_, step_ns);
    clock_.reset();
  }
  ticked_ns_ = now_ns;
  parser_.allow_work();
  give_up_stale_bytes(now_ns);
  switch (phase_) {
    case Phase::stopped:
    case Phase::bad_config:
    case Phase::waiting_for_link:
      return;
    case Phase::backing_off:
      if (now_ns >= deadline_ns_) search(now_ns);
      return;
    case Phase::settling:
      if (now_ns < deadline_ns_) return;
      enter(Phase::confirming_rate, "waiting for an answer at the new baud rate");
      request_mode(mode_on_request, ns_per_s, now_ns);
      return;
    case Phase::measuring:
      if (now_ns - last_values_ns_ <= silence_limit_ns()) return;
      ++counters_.silences;
      clock_.reset();
      last_values_ns_ = now_ns;
      if (told_failure_ == nullptr) {
        told_failure_ = "no measured values come";
        raise(now_ns, Severity::warning,
              config_.is_listen_only ? "no measured values come"
                                     : "no measured values come; bringing the laser up again");
      }
      if (!config_.is_listen_only) search(now_ns);
      return;
    default:
      if (now_ns < deadline_ns_) return;
      ++counters_.time_outs;
      repeat_or_give_up(now_ns, "the laser does not answer");
      return;
  }
}

// ---- requests

bool Lms2xx::awaits_response() const {
  switch (phase_) {
    case Phase::stopped:
    case Phase::bad_config:
    case Phase::waiting_for_link:
    case Phase::backing_off:
    case Phase::settling:
    case Phase::measuring:
      return false;
    default:
      return true;
  }
}

void Lms2xx::request(std::span<const std::uint8_t> payload, std::int64_t time_out_ns, std::int64_t now_ns) {
  request_size_ = std::min(payload.size(), request_.size());
  std::copy_n(payload.begin(), request_size_, request_.begin());
  // The longest answer, 160 bytes, takes 170 ms at 9600 baud; a stream that still runs may come before it.
  request_time_out_ns_ = time_out_ns + static_cast<std::int64_t>(400 * byte_ns());
  tries_left_ = tries;
  transmit(now_ns);
}

void Lms2xx::request_mode(std::uint8_t mode, std::int64_t time_out_ns, std::int64_t now_ns) {
  const std::array<std::uint8_t, 2> payload{change_mode, mode};
  request(payload, time_out_ns, now_ns);
}

void Lms2xx::transmit(std::int64_t now_ns) {
  std::array<std::uint8_t, 64 + lms2xx::frame_bytes> out{};
  const std::size_t size = lms2xx::build_telegram(lms2xx::Direction::from_host, config_.address, request_[0],
                                                  std::span(request_).subspan(1, request_size_ - 1), 0, out);
  ++counters_.requests;
  if (!port_.write(std::span(out).first(size))) ++counters_.writes_refused;
  if (tries_left_ > 0) --tries_left_;
  deadline_ns_ = now_ns + request_time_out_ns_;
}

void Lms2xx::repeat_or_give_up(std::int64_t now_ns, const char* why) {
  if (tries_left_ > 0) {
    ++counters_.repetitions;
    transmit(now_ns);
    return;
  }
  switch (phase_) {
    case Phase::searching:
      ++candidate_;
      try_next_rate(now_ns);
      return;
    case Phase::stopping:
      enter(Phase::stopped, "stopped; the laser did not confirm it");
      raise(now_ns, Severity::warning, "the laser did not confirm the end of its stream");
      return;
    default:
      back_off(now_ns, why);
      return;
  }
}

void Lms2xx::on_ack(std::int64_t now_ns) {
  // At a wrong rate anything may look like one: it buys time, once, and nothing more.
  if (phase_ == Phase::searching && !rate_is_proven_ && !was_acknowledged_) {
    was_acknowledged_ = true;
    deadline_ns_ = std::max(deadline_ns_, now_ns + acknowledged_time_out_ns);
  }
}

void Lms2xx::on_nak(std::int64_t now_ns) {
  if (!awaits_response() || (phase_ == Phase::searching && !rate_is_proven_)) return;
  ++counters_.naks;
  repeat_or_give_up(now_ns, "the laser refuses every telegram (NAK): is the line disturbed?");
}

// ---- finding the rate

bool Lms2xx::set_rate(std::uint32_t baud, std::int64_t now_ns) {
  if (!port_.set_baud_rate(baud)) {
    raise(now_ns, Severity::warning, "the line cannot do this baud rate", baud);
    return false;
  }
  baud_ = baud;
  parser_.discard();
  rate_is_proven_ = false;
  was_acknowledged_ = false;
  return true;
}

void Lms2xx::search(std::int64_t now_ns) {
  ++counters_.searches;
  candidate_ = 0;
  enter(Phase::searching, "searching for the laser's baud rate");
  try_next_rate(now_ns);
}

void Lms2xx::try_next_rate(std::int64_t now_ns) {
  for (; candidate_ <= config_.candidate_bauds.size(); ++candidate_) {
    const bool is_target = candidate_ == 0;
    const std::uint32_t baud = is_target ? config_.baud : config_.candidate_bauds[candidate_ - 1];
    if (baud == 0 || (!is_target && baud == config_.baud) || (is_target && !target_is_possible_)) continue;
    if (!set_rate(baud, now_ns)) {
      if (is_target) target_is_possible_ = false;
      continue;
    }
    request_mode(mode_on_request, search_time_out_ns, now_ns);
    tries_left_ = 0;
    return;
  }
  back_off(now_ns, "no answer at any baud rate: is the laser powered and connected?");
}

void Lms2xx::back_off(std::int64_t now_ns, const char* why) {
  enter(Phase::backing_off, why);
  deadline_ns_ = now_ns + back_off_ns_;
  back_off_ns_ = std::min(2 * back_off_ns_, longest_back_off_ns);
  if (told_failure_ != why) {
    told_failure_ = why;
    raise(now_ns, Severity::error, why);
  }
}

void Lms2xx::rate_is_found(std::int64_t now_ns) {
  if (baud_ != config_.baud && target_is_possible_) {
    enter(Phase::changing_rate, "changing the baud rate");
    request_mode(rate_mode(config_.baud), mode_time_out_ns, now_ns);
    return;
  }
  enter(Phase::reading_status, "reading the laser's status");
  const std::array<std::uint8_t, 1> payload{read_status};
  request(payload, read_time_out_ns, now_ns);
}

// ---- answers

void Lms2xx::on_telegram(const Telegram& telegram, std::int64_t end_stamp_ns, std::int64_t now_ns) {
  if (phase_ == Phase::searching && !rate_is_proven_) {
    // A checksum that fits proves the rate: now the answer is worth waiting for.
    rate_is_proven_ = true;
    tries_left_ = tries;
    deadline_ns_ = std::max(deadline_ns_, now_ns + mode_time_out_ns);
  }
  if (telegram.command == values_reply) {
    const bool stream_began = phase_ == Phase::starting_stream;  // the answer to the command was lost
    if (stream_began) begin_measuring(now_ns);
    if (phase_ == Phase::measuring) {
      watch_status(telegram.status, now_ns);
      on_values(telegram, end_stamp_ns);
    } else {
      ++counters_.telegrams_ignored;
    }
    return;
  }
  if (awaits_response() && telegram.command == (request_[0] | lms2xx::reply_bit)) {
    on_response(telegram, now_ns);
    return;
  }
  ++counters_.telegrams_ignored;
  if (telegram.command == power_on_message && is_started_ && !config_.is_listen_only) {
    raise(now_ns, Severity::warning, "the laser was switched on");
    if (phase_ == Phase::searching) {
      transmit(now_ns);
    } else {
      search(now_ns);
    }
  }
}

void Lms2xx::on_response(const Telegram& telegram, std::int64_t now_ns) {
  const std::span<const std::uint8_t> data = telegram.data;
  const std::uint8_t result = data.empty() ? std::uint8_t{0xff} : data[0];
  const auto refused = [&](const char* why) {
    ++counters_.refusals;
    back_off(now_ns, why);
  };
  switch (phase_) {
    case Phase::searching:
    case Phase::confirming_rate:
      if (result != 0) return refused("the laser reports a fault and does not change its operating mode");
      rate_is_found(now_ns);
      return;
    case Phase::changing_rate:
      if (result != 0) return refused("the laser refuses the baud rate");
      if (!set_rate(config_.baud, now_ns))
        return back_off(now_ns, "the line cannot do the laser's new baud rate");
      enter(Phase::settling, "waiting for the new baud rate");
      deadline_ns_ = now_ns + settling_ns;
      return;
    case Phase::reading_status: {
      variant_differs_ = data.size() < status_resolution + 2 ||
                         word_at(data, status_field_of_view) != config_.field_of_view_deg ||
                         word_at(data, status_resolution) != config_.resolution_hundredths_deg;
      enter(Phase::reading_configuration, "reading the laser's configuration");
      const std::array<std::uint8_t, 1> payload{read_configuration};
      request(payload, read_time_out_ns, now_ns);
      return;
    }
    case Phase::reading_configuration: {
      configuration_differs_ = false;
      if (data.size() < configuration_.size()) {
        raise(now_ns, Severity::warning, "the laser's configuration is too short to be changed; bytes",
              static_cast<std::int64_t>(data.size()));
      } else {
        std::copy_n(data.begin(), configuration_.size(), configuration_.begin());
        configuration_[configuration_mode] = static_cast<std::uint8_t>(config_.mode);
        configuration_[configuration_unit] = static_cast<std::uint8_t>(config_.unit);
        if (config_.with_turn_index) configuration_[configuration_availability] |= availability_turn_index;
        configuration_differs_ = !std::equal(configuration_.begin(), configuration_.end(), data.begin());
      }
      if (!variant_differs_ && !configuration_differs_) return start_stream(now_ns);
      enter(Phase::entering_installation, "entering installation mode");
      std::array<std::uint8_t, 10> payload{change_mode, mode_installation};
      for (std::size_t i = 0; i < config_.password.size(); ++i) {
        payload[2 + i] = static_cast<std::uint8_t>(config_.password[i]);
      }
      request(payload, mode_time_out_ns, now_ns);
      return;
    }
    case Phase::entering_installation:
      if (result == 1) return refused("the laser refuses the password for installation mode");
      if (result != 0) return refused("the laser reports a fault and does not enter installation mode");
      configure_next(now_ns);
      return;
    case Phase::setting_variant:
      if (result != 1) return refused("the laser refuses the field of view and resolution");
      variant_differs_ = false;
      configure_next(now_ns);
      return;
    case Phase::writing_configuration:
      if (result != 1) return refused("the laser refuses the unit and measuring mode");
      configuration_differs_ = false;
      configure_next(now_ns);
      return;
    case Phase::starting_stream:
      if (result != 0) return refused("the laser refuses to stream measured values");
      begin_measuring(now_ns);
      return;
    case Phase::stopping:
      enter(Phase::stopped, "stopped");
      return;
    default:
      ++counters_.telegrams_ignored;
      return;
  }
}

void Lms2xx::configure_next(std::int64_t now_ns) {
  if (variant_differs_) {
    enter(Phase::setting_variant, "setting field of view and resolution");
    const auto low = [](std::uint32_t value) { return static_cast<std::uint8_t>(value & 0xffU); };
    const std::array<std::uint8_t, 5> payload{
        change_variant, low(config_.field_of_view_deg), low(config_.field_of_view_deg >> 8),
        low(config_.resolution_hundredths_deg), low(config_.resolution_hundredths_deg >> 8)};
    request(payload, mode_time_out_ns, now_ns);
  } else if (configuration_differs_) {
    enter(Phase::writing_configuration, "writing unit and measuring mode");
    std::array<std::uint8_t, 35> payload{write_configuration};
    std::copy(configuration_.begin(), configuration_.end(), payload.begin() + 1);
    request(payload, write_time_out_ns, now_ns);
    raise(now_ns, Severity::info, "the laser's configuration is changed");
  } else {
    start_stream(now_ns);
  }
}

void Lms2xx::start_stream(std::int64_t now_ns) {
  enter(Phase::starting_stream, "starting the stream of measured values");
  request_mode(config_.resolution_hundredths_deg == 100 ? mode_stream_all : mode_stream_partial,
               mode_time_out_ns, now_ns);
}

// ---- measuring

void Lms2xx::begin_measuring(std::int64_t now_ns) {
  enter(Phase::measuring, "measuring");
  clock_.reset();
  last_values_ns_ = now_ns;
  unexpected_in_a_row_ = 0;
  raise(now_ns, Severity::info, "measuring; baud rate", baud_);
}

std::int64_t Lms2xx::nominal_turns(std::size_t telegram_bytes) const {
  const double turns = static_cast<double>(telegram_bytes) * byte_ns() * 1e-9 * config_.turns_per_s;
  return std::max<std::int64_t>(1, std::llround(std::ceil(turns)));
}

std::int64_t Lms2xx::silence_limit_ns() const {
  const std::size_t telegram_bytes = 2U * (config_.field_of_view_deg + 1U) + 16U;
  const double interval_ns = static_cast<double>(nominal_turns(telegram_bytes)) * 1e9 / config_.turns_per_s;
  return std::max<std::int64_t>(ns_per_s / 2, std::llround(4 * interval_ns));
}

void Lms2xx::watch_status(std::uint8_t status, std::int64_t now_ns) {
  constexpr std::uint8_t severity_bits = 0x07;  // 0 none, 1 info, 2 warning, 3 error, 4 fatal
  constexpr std::uint8_t implausible_bit = 0x40;
  constexpr std::uint8_t pollution_bit = 0x80;
  if ((status & implausible_bit) != 0) ++counters_.implausible_telegrams;
  if ((status & pollution_bit) != 0) ++counters_.polluted_telegrams;
  const auto told = static_cast<std::uint8_t>(status & (severity_bits | pollution_bit));
  if (told == told_status_) return;
  if ((told & pollution_bit) != 0 && (told_status_ & pollution_bit) == 0) {
    raise(now_ns, Severity::warning, "the front window is dirty");
  }
  const int severity = told & severity_bits;
  if (severity > (told_status_ & severity_bits) && severity >= 2) {
    raise(now_ns, severity == 2 ? Severity::warning : Severity::error, "the laser reports a problem; level",
          severity);
  }
  told_status_ = told;
}

void Lms2xx::on_values(const Telegram& telegram, std::int64_t end_stamp_ns) {
  const auto values = lms2xx::split_measured_values(telegram.data);
  const bool is_interlaced = config_.resolution_hundredths_deg != 100;
  const std::uint32_t rays = config_.field_of_view_deg + 1;
  const bool fits = values && (values->is_partial || (!is_interlaced && values->quarter_deg == 0)) &&
                    (values->count == rays || (values->quarter_deg != 0 && values->count + 1 == rays));
  if (!fits) {
    ++counters_.unexpected_layouts;
    if (++unexpected_in_a_row_ == unexpected_limit) {
      unexpected_in_a_row_ = 0;
      raise(end_stamp_ns, Severity::error,
            "the measured values are not laid out as configured; values a telegram",
            values ? static_cast<std::int64_t>(values->count) : 0);
      if (!config_.is_listen_only) search(end_stamp_ns);
    }
    return;
  }
  unexpected_in_a_row_ = 0;
  last_values_ns_ = end_stamp_ns;
  told_failure_ = nullptr;
  back_off_ns_ = shortest_back_off_ns;

  const TelegramParser::Counters& parsed = parser_.counters();
  const std::uint64_t damage = parsed.bytes_skipped + parsed.crc_errors;
  const lms2xx::SweepClock::Sweep sweep = clock_.add({.stamp_ns = end_stamp_ns,
                                                      .nominal_turns = nominal_turns(telegram.wire_bytes),
                                                      .bytes_were_lost = damage != damage_seen_,
                                                      .turn_index = values->turn_index});
  damage_seen_ = damage;

  constexpr double deg = std::numbers::pi / 180;
  profile_.ray_interval_ns = clock_.turn_ns() / 360;
  const double since_first_ray_ns =
      static_cast<double>(telegram.wire_bytes) * byte_ns() + static_cast<double>(config_.send_delay_ns) +
      (config_.field_of_view_deg - 0.25 * values->quarter_deg) * profile_.ray_interval_ns;
  profile_.first_ray_stamp_ns = sweep.stamp_ns - std::llround(since_first_ray_ns);
  profile_.first_angle_rad = deg * (0.25 * values->quarter_deg - 0.5 * config_.field_of_view_deg);
  profile_.angle_step_rad = deg;
  profile_.laser = config_.laser;
  profile_.counter = static_cast<std::uint32_t>(sweep.number);
  profile_.has_counter = true;
  profile_.count = values->count;
  for (std::uint32_t i = 0; i < values->count; ++i) {
    const auto word = static_cast<std::uint16_t>(word_at(values->words, std::size_t{2} * i));
    profile_.range_m[i] = lms2xx::range_m(word, config_.mode, values->unit, ray_counters_);
  }
  ++counters_.profiles;
  sink_.on_profile(profile_);
}

}  // namespace alces
