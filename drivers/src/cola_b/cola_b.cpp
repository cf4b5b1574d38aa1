#include "alces_drivers/cola_b/cola_b.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

namespace alces {
namespace {

constexpr std::int64_t response_timeout_ns = 2 * ns_per_s;
constexpr std::int64_t poll_pause_ns = 500 * ns_per_ms;
constexpr std::int64_t poll_limit_ns = 90 * ns_per_s;
constexpr std::int64_t shortest_back_off_ns = ns_per_s;
constexpr std::int64_t longest_back_off_ns = 16 * ns_per_s;
constexpr std::uint32_t tries = 3;
/// Values below are codes: 0 no echo, 1 dazzled, the others reserved.
constexpr std::uint16_t least_range = 16;

/// What must follow the answer's name.
enum class Check : std::uint8_t {
  anything,
  is_0,
  is_1,
  rays_fit,  ///< LMPoutputRange: sectors (2 bytes), angle step, first and last angle (4 bytes each)
  measures,  ///< STlms: a 16-bit status that becomes 7; asked again until then
};

struct Step {
  const char* doing;
  std::string_view request;  ///< type and name
  std::string_view response;
  Check check;
  bool is_optional;  ///< an error answer is passed over
};

enum : std::uint32_t {
  log_in,
  set_scan,
  set_output,
  start_measurement,
  run,
  wait_until_ready,
  ask_range,
  stream,
  step_count
};

constexpr std::array<Step, step_count> dialogue{{
    {"logging in", "sMN SetAccessMode", "sAN SetAccessMode", Check::is_1, false},
    {"setting frequency and resolution", "sMN mLMPsetscancfg", "sAN mLMPsetscancfg", Check::is_0, false},
    {"choosing what scan data hold", "sWN LMDscandatacfg", "sWA LMDscandatacfg", Check::anything, false},
    {"starting the measurement", "sMN LMCstartmeas", "sAN LMCstartmeas", Check::is_0, true},
    {"leaving configuration", "sMN Run", "sAN Run", Check::is_1, false},
    {"waiting until the laser measures", "sRN STlms", "sRA STlms", Check::measures, true},
    {"asking how many rays come", "sRN LMPoutputRange", "sRA LMPoutputRange", Check::rays_fit, true},
    {"starting the stream of scan data", "sEN LMDscandata", "sEA LMDscandata", Check::is_1, false},
}};

/// A payload under construction.
struct Payload {
  std::array<std::uint8_t, 64> bytes{};
  std::size_t size = 0;
  void text(std::string_view characters) {
    for (const char character : characters) bytes[size++] = static_cast<std::uint8_t>(character);
  }
  void number(std::uint32_t value, std::size_t count) {
    for (std::size_t i = count; i-- > 0;) bytes[size++] = static_cast<std::uint8_t>(value >> (8 * i) & 0xffU);
  }
};

std::uint32_t ten_thousandths(double deg) {
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(deg * 10000)));
}

Payload request_of(std::uint32_t step, const ColaBConfig& config) {
  Payload payload;
  payload.text(dialogue[step].request);
  switch (step) {
    case log_in:
      payload.text(" ");
      payload.number(3, 1);  // user level: authorized client
      payload.number(config.password_hash, 4);
      break;
    case set_scan:
      payload.text(" ");
      payload.number(static_cast<std::uint32_t>(std::lround(config.scan_frequency_hz * 100)), 4);
      payload.number(1, 2);  // sectors
      payload.number(ten_thousandths(config.angle_step_deg), 4);
      payload.number(ten_thousandths(config.start_angle_deg), 4);
      payload.number(ten_thousandths(config.stop_angle_deg), 4);
      break;
    case set_output:
      payload.text(" ");
      payload.number(0x0100, 2);  // the first echo
      payload.number(0, 1);       // no remission
      payload.number(1, 1);       // (which would have 16 bits)
      payload.number(0, 1);       // unit of remission: digits
      payload.number(0, 2);       // no encoders
      payload.number(0, 1);       // no position
      payload.number(0, 1);       // no device name
      payload.number(0, 1);       // no comment
      payload.number(0, 1);       // no time of day
      payload.number(1, 2);       // every scan
      break;
    case stream:
      payload.text(" ");
      payload.number(1, 1);
      break;
    default:
      break;
  }
  return payload;
}

bool begins_with(std::span<const std::uint8_t> bytes, std::string_view text) {
  if (bytes.size() < text.size()) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (bytes[i] != static_cast<std::uint8_t>(text[i])) return false;
  }
  return true;
}

/// What follows the name and a blank; `payload` begins with `name`.
std::span<const std::uint8_t> after_name(std::span<const std::uint8_t> payload, std::string_view name) {
  return payload.subspan(std::min(payload.size(), name.size() + 1));
}

bool is_left_out(std::uint32_t step, const ColaBConfig& config) {
  if (step == set_scan) return !config.sets_scan || config.model == cola_b::Model::tim;
  if (step == wait_until_ready) return config.model == cola_b::Model::tim;  // it has no STlms
  return false;
}

}  // namespace

const char* cola_b::error_text(std::uint32_t code) {
  switch (code) {
    case 1:
      return "the laser refuses a method: access denied";
    case 2:
      return "the laser does not know a method";
    case 3:
      return "the laser does not know a variable";
    case 4:
      return "the laser refuses: a local condition failed";
    case 5:
      return "the laser refuses: invalid data";
    case 6:
      return "the laser reports an unknown error";
    case 7:
      return "the laser refuses: too many data (buffer overflow)";
    case 8:
      return "the laser refuses: too few data (buffer underflow)";
    case 9:
      return "the laser refuses: unknown type";
    case 10:
      return "the laser refuses to write a variable: access denied";
    case 11:
      return "the laser's name server does not know a command";
    case 12:
      return "the laser does not know a CoLa command";
    case 13:
      return "the laser's method server is busy";
    case 14:
      return "the laser refuses: array index out of bounds";
    case 15:
      return "the laser does not know an event";
    case 16:
      return "the laser refuses: a CoLa A value overflows";
    case 17:
      return "the laser refuses: invalid CoLa A character";
    case 18:
      return "the laser's operating system has no message";
    case 19:
      return "the laser's operating system has no answer";
    case 20:
      return "the laser reports an internal error";
    case 21:
      return "the laser refuses: the hub address is corrupt";
    case 22:
      return "the laser refuses: the hub address cannot be decoded";
    case 23:
      return "the laser refuses: too many hub addresses";
    case 24:
      return "the laser refuses: a blank is missing in the hub address";
    case 25:
      return "the laser refuses: asynchronous methods are suppressed";
    case 26:
      return "the laser refuses: nested arrays are not supported";
    default:
      return "the laser reports an error that is not in the manual";
  }
}

const char* validate(const ColaBConfig& config) {
  if (!(config.scan_frequency_hz >= 1 && config.scan_frequency_hz <= 1000)) {
    return "scan_frequency_hz must be 1 to 1000";
  }
  if (!(std::abs(config.straight_ahead_deg) <= 360)) return "straight_ahead_deg must be within 360 deg";
  if (config.sets_scan) {
    if (config.model == cola_b::Model::tim) return "the scan of a TiM cannot be set";
    if (!(config.angle_step_deg >= 0.01 && config.angle_step_deg <= 10))
      return "angle_step_deg must be 0.01 to 10";
    if (!(config.start_angle_deg >= -180 && config.stop_angle_deg <= 360 &&
          config.start_angle_deg < config.stop_angle_deg)) {
      return "start_angle_deg must be below stop_angle_deg";
    }
  }
  return nullptr;
}

ColaB::ColaB(const ColaBConfig& config, BytePort& port, NoticePort& notices, ProfileSink& profiles)
    : config_(config),
      port_(port),
      notices_(notices),
      sink_(profiles),
      notice_limiter_(notices, config_.name),
      clock_({.block_ns = ns_per_s, .block_count = 32, .maximum_drift = 1e-3, .jump_ns = ns_per_s}) {}

LaserState ColaB::state() const {
  switch (phase_) {
    case Phase::stopped:
      return LaserState::stopped;
    case Phase::bad_config:
      return LaserState::failed;
    case Phase::waiting_for_link:
    case Phase::backing_off:
      return LaserState::connecting;
    case Phase::in_dialogue:
      return LaserState::configuring;
    case Phase::measuring:
      return LaserState::measuring;
    case Phase::stopping:
      return LaserState::stopping;
  }
  return LaserState::failed;
}

void ColaB::raise(std::int64_t now_ns, Severity severity, const char* text) {
  notices_.raise({now_ns, severity, config_.name, text, 0, false});
}

void ColaB::raise(std::int64_t now_ns, Severity severity, const char* text, std::int64_t value) {
  notices_.raise({now_ns, severity, config_.name, text, value, true});
}

void ColaB::enter(Phase phase, const char* reason) {
  phase_ = phase;
  reason_ = reason;
}

// ---- from outside

void ColaB::start(std::int64_t now_ns) {
  if (is_started_) return;
  if (const char* what = validate(config_); what != nullptr) {
    enter(Phase::bad_config, what);
    raise(now_ns, Severity::error, what);
    return;
  }
  is_started_ = true;
  back_off_ns_ = shortest_back_off_ns;
  told_failure_ = nullptr;
  begin(now_ns);
}

void ColaB::begin(std::int64_t now_ns) {
  if (!link_is_up_ && !config_.is_listen_only) {
    enter(Phase::waiting_for_link, "not connected");
  } else if (config_.is_listen_only) {
    begin_measuring(now_ns);
  } else {
    ++counters_.dialogues;
    step_ = 0;
    begin_step(now_ns);
  }
}

void ColaB::stop(std::int64_t now_ns) {
  if (!is_started_) return;
  is_started_ = false;
  const bool may_stream = phase_ == Phase::measuring || phase_ == Phase::in_dialogue;
  if (!may_stream || config_.is_listen_only || !link_is_up_) {
    enter(Phase::stopped, "stopped");
    return;
  }
  enter(Phase::stopping, "waiting for the laser to end its stream");
  tries_left_ = tries;
  transmit(now_ns);
}

void ColaB::on_link(bool is_up, std::int64_t now_ns) {
  if (is_up == link_is_up_) return;
  link_is_up_ = is_up;
  garbage_bytes_ = 0;
  parser_.discard();
  if (!is_up) {
    if (phase_ == Phase::stopping) {
      enter(Phase::stopped, "the connection was lost while stopping");
    } else if (is_started_) {
      enter(Phase::waiting_for_link, "not connected");
      raise(now_ns, Severity::warning, "the connection was lost");
    }
    return;
  }
  if (!is_started_) return;
  back_off_ns_ = shortest_back_off_ns;
  begin(now_ns);
}

void ColaB::on_bytes(std::span<const std::uint8_t> bytes, std::int64_t stamp_ns) {
  garbage_bytes_ += bytes.size();
  while (!bytes.empty()) {
    const std::size_t taken = parser_.push(bytes);
    bytes = bytes.subspan(taken);
    while (const auto payload = parser_.next()) {
      garbage_bytes_ = bytes.size();
      is_garbage_told_ = false;
      on_payload(*payload, stamp_ns);
    }
    if (taken == 0 && parser_.pending_bytes() > 0 && !bytes.empty())
      parser_.discard();  // cannot be: never hang
  }
  if (garbage_bytes_ < garbage_limit_bytes) return;
  garbage_bytes_ = 0;
  ++counters_.peers_dropped;
  parser_.discard();
  if (!is_garbage_told_)
    raise(stamp_ns, Severity::error,
          "nothing but garbage comes: the connection is dropped; does CoLa B run on this port?");
  is_garbage_told_ = true;
  port_.drop();
}

void ColaB::on_tick(std::int64_t now_ns) {
  if (ticked_ns_ != no_stamp_ns && now_ns < ticked_ns_ - clock_step_ns) {
    const std::int64_t step_ns = now_ns - ticked_ns_;
    shift_stamp(deadline_ns_, step_ns);
    shift_stamp(step_limit_ns_, step_ns);
    if (last_scan_ns_ > now_ns) shift_stamp(last_scan_ns_, step_ns);
  }
  ticked_ns_ = now_ns;
  parser_.allow_work();
  switch (phase_) {
    case Phase::stopped:
    case Phase::bad_config:
    case Phase::waiting_for_link:
      return;
    case Phase::backing_off:
      if (now_ns >= deadline_ns_) begin(now_ns);
      return;
    case Phase::measuring: {
      const auto limit_ns = std::max<std::int64_t>(ns_per_s, std::llround(8e9 / config_.scan_frequency_hz));
      if (now_ns - last_scan_ns_ <= limit_ns) return;
      ++counters_.silences;
      last_scan_ns_ = now_ns;
      parser_.discard();
      if (told_failure_ == nullptr) {
        told_failure_ = "no scan data come";
        raise(
            now_ns, Severity::warning,
            config_.is_listen_only ? "no scan data come" : "no scan data come; bringing the laser up again");
      }
      if (!config_.is_listen_only) begin(now_ns);
      return;
    }
    case Phase::in_dialogue:
    case Phase::stopping:
      break;
  }
  if (now_ns < deadline_ns_) return;
  if (is_waiting_to_ask_) {
    is_waiting_to_ask_ = false;
    transmit(now_ns);
    return;
  }
  ++counters_.time_outs;
  if (tries_left_ > 0) {
    transmit(now_ns);
  } else if (phase_ == Phase::stopping) {
    enter(Phase::stopped, "stopped; the laser did not confirm it");
    raise(now_ns, Severity::warning, "the laser did not confirm the end of its stream");
  } else if (step_ == ask_range) {
    next_step(now_ns);
  } else {
    back_off(now_ns, "the laser does not answer: does it speak CoLa B on this port?");
  }
}

// ---- the dialogue

void ColaB::begin_step(std::int64_t now_ns) {
  while (step_ < step_count && is_left_out(step_, config_)) ++step_;
  if (step_ == step_count) {
    begin_measuring(now_ns);
    return;
  }
  enter(Phase::in_dialogue, dialogue[step_].doing);
  tries_left_ = step_ == ask_range ? 1 : tries;  // some firmware keeps silent
  is_waiting_to_ask_ = false;
  step_limit_ns_ = now_ns + poll_limit_ns;
  transmit(now_ns);
}

void ColaB::next_step(std::int64_t now_ns) {
  ++step_;
  begin_step(now_ns);
}

void ColaB::transmit(std::int64_t now_ns) {
  Payload payload;
  if (phase_ == Phase::stopping) {
    payload.text("sEN LMDscandata ");
    payload.number(0, 1);
  } else {
    payload = request_of(step_, config_);
  }
  std::array<std::uint8_t, sizeof(Payload::bytes) + cola_b::frame_overhead_bytes> frame{};
  const std::size_t size = cola_b::build_frame(std::span(payload.bytes).first(payload.size), frame);
  ++counters_.requests;
  if (!port_.write(std::span(frame).first(size))) ++counters_.writes_refused;
  if (tries_left_ > 0) --tries_left_;
  deadline_ns_ = now_ns + response_timeout_ns;
}

void ColaB::back_off(std::int64_t now_ns, const char* why, std::int64_t value) {
  enter(Phase::backing_off, why);
  deadline_ns_ = now_ns + back_off_ns_;
  back_off_ns_ = std::min(2 * back_off_ns_, longest_back_off_ns);
  if (told_failure_ != why) {
    told_failure_ = why;
    if (value != 0) {
      raise(now_ns, Severity::error, why, value);
    } else {
      raise(now_ns, Severity::error, why);
    }
  }
}

/// `range`: angle step, first and last angle. False: refused.
bool ColaB::do_rays_fit(std::span<const std::uint8_t> range, std::int64_t now_ns) {
  if (range.size() < 12) return true;
  const auto number = [&](std::size_t at) {
    return std::int64_t{static_cast<std::int32_t>(std::uint32_t{range[at]} << 24 |
                                                  std::uint32_t{range[at + 1]} << 16 |
                                                  std::uint32_t{range[at + 2]} << 8 | range[at + 3])};
  };
  const std::int64_t step = number(0);
  const std::int64_t turn = number(8) - number(4);
  if (step <= 0 || turn < 0) return true;
  const std::int64_t rays = (turn + step / 2) / step + 1;
  if (rays <= config_.most_rays) return true;
  ++counters_.refusals;
  back_off(now_ns, "the laser has more rays a profile than rays_per_profile has room for; rays", rays);
  return false;
}

void ColaB::on_payload(std::span<const std::uint8_t> payload, std::int64_t stamp_ns) {
  if (cola_b::is_scan_data(payload)) {
    // The stream may begin before its confirmation, or when that was lost.
    if (phase_ == Phase::in_dialogue && (step_ == stream || step_ == ask_range)) begin_measuring(stamp_ns);
    if (phase_ == Phase::measuring) {
      on_scan(payload, stamp_ns);
    } else {
      ++counters_.telegrams_ignored;
    }
    return;
  }
  // Recordings of earlier versions do not know the question.
  if (phase_ == Phase::in_dialogue && step_ == ask_range && begins_with(payload, dialogue[stream].response))
    step_ = stream;
  const bool awaits_response =
      (phase_ == Phase::in_dialogue && !is_waiting_to_ask_) || phase_ == Phase::stopping;
  if (awaits_response && begins_with(payload, "sFA")) {
    on_error_response(payload, stamp_ns);
  } else if (phase_ == Phase::stopping && begins_with(payload, dialogue[stream].response)) {
    // 1 confirms an earlier start that crossed our request.
    const auto result = after_name(payload, dialogue[stream].response);
    if (!result.empty() && result[0] == 0) enter(Phase::stopped, "stopped");
  } else if (awaits_response && phase_ == Phase::in_dialogue &&
             begins_with(payload, dialogue[step_].response)) {
    on_response(after_name(payload, dialogue[step_].response), stamp_ns);
  } else {
    ++counters_.telegrams_ignored;
  }
}

void ColaB::on_error_response(std::span<const std::uint8_t> payload, std::int64_t now_ns) {
  ++counters_.error_responses;
  const std::size_t at = payload.size() > 3 && payload[3] == ' ' && payload.size() > 5 ? 4 : 3;
  const std::uint32_t code = payload.size() >= at + 2 ? payload[at] * 256U + payload[at + 1] : 0U;
  const char* why = cola_b::error_text(code);
  if (phase_ == Phase::stopping) {
    raise(now_ns, Severity::warning, why, code);
    enter(Phase::stopped, why);
  } else if (dialogue[step_].is_optional) {
    raise(now_ns, Severity::info, why, code);
    next_step(now_ns);
  } else {
    back_off(now_ns, why);
  }
}

void ColaB::on_response(std::span<const std::uint8_t> result, std::int64_t now_ns) {
  const auto refused = [&](const char* why) {
    ++counters_.refusals;
    back_off(now_ns, why);
  };
  switch (dialogue[step_].check) {
    case Check::anything:
      break;
    case Check::is_0:
      if (!result.empty() && result[0] == 0) {
        // mLMPsetscancfg answers with what it made of it: frequency, sectors, angle step, first and last
        // angle.
        if (step_ == set_scan && result.size() >= 7 && !do_rays_fit(result.subspan(7), now_ns)) return;
        break;
      }
      return refused(step_ == set_scan ? "the laser refuses frequency, resolution or field of view"
                                       : "the laser refuses to measure");
    case Check::is_1:
      if (!result.empty() && result[0] == 1) break;
      return refused(step_ == log_in ? "the laser refuses the password"
                                     : "the laser refuses to run or to stream");
    case Check::rays_fit:
      if (result.size() >= 2 && !do_rays_fit(result.subspan(2), now_ns)) return;
      break;
    case Check::measures:
      if (result.size() >= 2 && result[0] * 256U + result[1] == 7) break;
      if (now_ns >= step_limit_ns_) return refused("the laser does not get ready to measure");
      is_waiting_to_ask_ = true;
      deadline_ns_ = now_ns + poll_pause_ns;
      tries_left_ = tries;
      return;
  }
  next_step(now_ns);
}

// ---- measuring

void ColaB::begin_measuring(std::int64_t now_ns) {
  enter(Phase::measuring, "measuring");
  last_scan_ns_ = now_ns;
  has_counter_ = false;
  raise(now_ns, Severity::info, "measuring");
}

void ColaB::watch_status(std::uint16_t status, std::int64_t now_ns) {
  const auto told = static_cast<std::uint8_t>(status & 0xffU);
  if (told == told_status_) return;
  const auto begins = [&](unsigned bit) { return (told & bit) != 0 && (told_status_ & bit) == 0; };
  if (begins(1)) raise(now_ns, Severity::error, "the laser reports a device error");
  if (begins(2)) raise(now_ns, Severity::warning, "the front window is dirty");
  if (begins(4)) raise(now_ns, Severity::error, "the front window is too dirty to measure");
  told_status_ = told;
}

void ColaB::on_scan(std::span<const std::uint8_t> payload, std::int64_t stamp_ns) {
  last_scan_ns_ = stamp_ns;
  const auto scan = cola_b::parse_scan_data(payload);
  const std::uint32_t rays_per_turn = scan ? cola_b::rays_per_turn(scan->dist1.angle_step) : 0;
  if (rays_per_turn == 0 || scan->scan_frequency == 0 || scan->dist1.count > Profile::maximum_rays) {
    ++counters_.unreadable_scans;
    notice_limiter_.raise(NoticeKind::unreadable, Severity::error, stamp_ns, "scan data cannot be used; rays",
                          scan ? std::int64_t{scan->dist1.count} : 0);
    return;
  }
  has_layers_ = has_layers_ || scan->layer_angle != 0;
  if (has_layers_) {  // the middle one, too: its telegrams are every fourth, its times other than a 2D
                      // laser's
    ++counters_.layers_refused;
    notice_limiter_.raise(
        NoticeKind::layers, Severity::error, stamp_ns,
        "the laser scans in several layers (MRS 1000, say): it has no driver, and none of its scans is used",
        static_cast<std::int64_t>(counters_.layers_refused));
    return;
  }
  told_failure_ = nullptr;
  back_off_ns_ = shortest_back_off_ns;
  watch_status(scan->device_status, stamp_ns);
  const double frequency_hz = 0.01 * scan->scan_frequency;
  if (!frequency_was_told_ && std::abs(frequency_hz / config_.scan_frequency_hz - 1) > 0.02) {
    frequency_was_told_ = true;
    raise(stamp_ns, Severity::warning, "the laser scans at another frequency than configured; 1/100 Hz",
          scan->scan_frequency);
  }

  if (has_counter_) {
    const auto step = static_cast<std::uint16_t>(scan->telegram_counter - last_telegram_);
    if (step == 0) {
      ++counters_.telegrams_repeated;
      return;
    }
    // A counter that jumps far was restarted, not overrun.
    if (step < 0x8000) counters_.telegrams_missed += step - 1U;
    counter_ += step < 0x8000 ? step : 1U;
  } else {
    counter_ = scan->telegram_counter;
  }
  has_counter_ = true;
  last_telegram_ = scan->telegram_counter;

  // Wraps after 71.6 minutes; a difference that is negative is a restart, and the filter starts anew.
  const auto since_last_us = static_cast<std::int32_t>(scan->start_us - last_start_us_);
  // A device whose time runs wild is taken for one that was restarted, before nanoseconds overflow.
  constexpr std::int64_t most_us = latest_stamp_ns / ns_per_us;
  const bool goes_on = has_device_time_ && std::abs(device_us_) < most_us;
  device_us_ = goes_on ? device_us_ + since_last_us : std::int64_t{scan->start_us};
  has_device_time_ = true;
  last_start_us_ = scan->start_us;
  const auto to_transmission_us = static_cast<std::int32_t>(scan->transmission_us - scan->start_us);
  (void)clock_.add((device_us_ + to_transmission_us) * ns_per_us, stamp_ns);
  const std::int64_t first_ray_ns =
      device_us_ * ns_per_us + std::llround(1000 * cola_b::first_ray_offset_us(*scan));

  constexpr double deg = std::numbers::pi / 180;
  profile_.first_ray_stamp_ns = clock_.host_from_device(first_ray_ns);
  profile_.ray_interval_ns = 1e9 / frequency_hz / rays_per_turn * (1 + clock_.drift());
  profile_.first_angle_rad = deg * (scan->dist1.start_angle * 1e-4 - config_.straight_ahead_deg);
  profile_.angle_step_rad = 2 * std::numbers::pi / rays_per_turn;
  profile_.laser = config_.laser;
  profile_.counter = counter_;
  profile_.has_counter = true;
  profile_.count = scan->dist1.count;
  for (std::uint32_t i = 0; i < profile_.count; ++i) {
    const std::uint16_t value = scan->dist1.value(i);
    const float range_m = 0.001F * (static_cast<float>(value) * scan->dist1.scale + scan->dist1.offset);
    const bool is_range = value >= least_range && range_m > 0 && range_m < 1000;
    profile_.range_m[i] = is_range ? range_m : 0;
    if (!is_range) ++counters_.rays_without_range;
  }
  ++counters_.profiles;
  sink_.on_profile(profile_);
}

}  // namespace alces
