#include "alces_drivers/gps/gps.h"

#include <algorithm>
#include <cmath>

namespace alces {
namespace {

/// So long is watched before it is said what comes instead of fixes ...
constexpr std::int64_t watch_ns = 20 * ns_per_s;
/// ... and so long a receiver that has no fix may search for one: a cold start takes half a minute.
constexpr std::int64_t search_ns = 60 * ns_per_s;

constexpr std::uint8_t ubx_first_byte = 0xB5;
constexpr std::uint8_t ubx_second_byte = 0x62;

}  // namespace

const char* validate(const GpsConfig& config) {
  if (config.maximum_age_ns <= 0) return "maximum_age must be positive";
  if (!(config.maximum_speed_m_s > 0)) return "maximum_speed_m_s must be positive";
  if (!(config.jump_slack_m >= 0)) return "jump_slack_m must not be negative";
  if (!(config.maximum_hdop > 0)) return "maximum_hdop must be positive";
  if (config.jump_patience == 0) return "jump_patience must be at least 1";
  return nullptr;
}

Gps::Gps(const GpsConfig& config, NoticePort& notices) : config_(config), notices_(notices) {}

void Gps::raise(std::int64_t now_ns, Severity severity, const char* text) {
  notices_.raise({now_ns, severity, config_.name, text, 0, false});
}

const GpsFix& Gps::fix(std::uint32_t age) const {
  return fixes_[(newest_ + history - age) % history];
}

void Gps::on_bytes(std::span<const std::uint8_t> bytes, std::int64_t stamp_ns) {
  bytes_ += bytes.size();
  for (const std::uint8_t byte : bytes) {
    if (byte == ubx_second_byte && last_byte_ == ubx_first_byte) ++counters_.ubx_messages;
    last_byte_ = byte;
    const auto line = lines_.push(byte);
    if (!line) continue;
    const nmea::ParsedSentence parsed = nmea::parse(*line);
    if (parsed.sentence || parsed.is_malformed) ++positions_;
    if (parsed.sentence) {
      on_sentence(*parsed.sentence, stamp_ns);
    } else if (parsed.is_malformed) {
      ++counters_.sentences_malformed;
    } else {
      ++counters_.sentences_ignored;
    }
  }
}

void Gps::on_link(bool is_up, std::int64_t now_ns) {
  lines_.discard();
  watched_since_ns_ = no_stamp_ns;
  raise(now_ns, is_up ? Severity::info : Severity::warning,
        is_up ? "the receiver's line is up" : "the receiver's line went down");
}

void Gps::on_tick(std::int64_t now_ns) {
  if (ticked_ns_ != no_stamp_ns && now_ns < ticked_ns_ - clock_step_ns) {
    // Fixes of another clock: new ones would seem older than they are.
    fix_count_ = 0;
    jumped_count_ = 0;
    last_gga_ns_ = last_gns_ns_ = no_stamp_ns;
  }
  ticked_ns_ = now_ns;
  if (fix_count_ > 0 && !is_lost_ && now_ns - fix(0).stamp_ns > 5 * config_.maximum_age_ns) {
    is_lost_ = true;
    raise(now_ns, Severity::warning, "no usable fix comes");
  }
  watch_traffic(now_ns);
}

Gps::Traffic Gps::traffic() const {
  const nmea::LineAssembler::Counters& lines = lines_.counters();
  return {bytes_,
          lines.checksum_errors + lines.cut_off + lines.too_long,
          lines.without_checksum,
          lines.lines,
          positions_,
          counters_.without_fix,
          counters_.ubx_messages};
}

/// Every watch_ns without a fix: what came instead, told when it is another thing than before.
void Gps::watch_traffic(std::int64_t now_ns) {
  const bool is_fix_new = fix_count_ > 0 && now_ns - fix(0).stamp_ns <= watch_ns;
  const bool begins = watched_since_ns_ == no_stamp_ns || now_ns < watched_since_ns_;
  if (is_fix_new || fixless_since_ns_ == no_stamp_ns || now_ns < fixless_since_ns_)
    fixless_since_ns_ = now_ns;
  if (is_fix_new) told_instead_ = nullptr;
  if (!begins && !is_fix_new && now_ns - watched_since_ns_ < watch_ns) return;
  const Traffic now = traffic();
  const Traffic& before = traffic_before_;
  const Traffic since{now.bytes - before.bytes,
                      now.damaged - before.damaged,
                      now.without_checksum - before.without_checksum,
                      now.lines - before.lines,
                      now.positions - before.positions,
                      now.without_fix - before.without_fix,
                      now.ubx - before.ubx};
  traffic_before_ = now;
  watched_since_ns_ = now_ns;
  if (begins || is_fix_new) return;
  const char* const instead = what_comes_instead(since, now_ns - fixless_since_ns_ >= search_ns);
  if (instead == nullptr || instead == told_instead_) return;
  told_instead_ = instead;
  raise(now_ns, Severity::warning, instead);
}

/// Null: nothing to tell yet.
const char* Gps::what_comes_instead(const Traffic& since, bool is_fix_overdue) const {
  if (since.bytes == 0) return "nothing comes from the receiver: is it powered and connected to this line?";
  if (since.positions > 0) {
    if (!is_fix_overdue || counters_.fixes > 0) return nullptr;
    return since.without_fix * 2 > since.positions
               ? "the receiver has no fix: does its antenna see the sky?"
               : "the receiver's fixes are not believed: too few satellites, a large HDOP, or simulated";
  }
  if (since.lines > 0) return "no sentence has a position: have the receiver send GGA, GNS or RMC";
  if (since.ubx > 0) return "the receiver speaks UBX, not NMEA: have it send GGA, GNS or RMC";
  if (since.without_checksum > 0 && since.without_checksum >= since.damaged)
    return "the receiver's lines have no checksum: they are not believed";
  return "what comes from the receiver is no NMEA: is the baud rate right?";
}

bool Gps::is_second_rate(const nmea::Sentence& sentence, std::int64_t stamp_ns) {
  const auto is_recent = [&](std::int64_t last_ns) {
    return last_ns != no_stamp_ns && stamp_ns - last_ns < config_.gga_silence_ns;
  };
  switch (sentence.kind) {
    case nmea::SentenceKind::gga:
      last_gga_ns_ = stamp_ns;
      return false;
    case nmea::SentenceKind::gns:
      last_gns_ns_ = stamp_ns;
      return is_recent(last_gga_ns_);
    case nmea::SentenceKind::rmc:
      break;
  }
  return is_recent(last_gga_ns_) || is_recent(last_gns_ns_);
}

void Gps::on_sentence(const nmea::Sentence& sentence, std::int64_t stamp_ns) {
  if (is_second_rate(sentence, stamp_ns)) {
    ++counters_.sentences_ignored;
    return;
  }
  if (!is_good_enough(sentence)) return;
  if (sentence.altitude_m) height_m_ = *sentence.altitude_m;

  GpsFix fix;
  fix.stamp_ns = stamp_ns - config_.delay_ns;
  fix.position = {sentence.latitude_deg, sentence.longitude_deg, height_m_};
  fix.quality = sentence.quality;
  fix.satellites = sentence.satellites;
  fix.hdop = sentence.hdop.value_or(0.0);

  if (fix_count_ > 0) {
    constexpr std::int32_t day_ms = 86'400'000;
    std::int32_t step_ms = 1;
    if (sentence.time_of_day_ms && last_time_ms_) step_ms = *sentence.time_of_day_ms - *last_time_ms_;
    if (step_ms < -day_ms / 2) step_ms += day_ms;                               // midnight
    const bool is_long_ago = stamp_ns - this->fix(0).stamp_ns > 30 * ns_per_s;  // the receiver's time was set
    if ((step_ms <= 0 && !is_long_ago) || fix.stamp_ns <= this->fix(0).stamp_ns) {
      ++counters_.time_backwards;
      return;
    }
  }
  if (!plane_) plane_.emplace(fix.position);
  fix.enu_m = plane_->enu_from_geodetic(fix.position);
  if (!is_plausible(fix, stamp_ns)) return;
  last_time_ms_ = sentence.time_of_day_ms;
  keep(fix, stamp_ns);
}

bool Gps::is_good_enough(const nmea::Sentence& sentence) {
  if (sentence.quality == 0 || !sentence.has_position) {
    ++counters_.without_fix;
    return false;
  }
  const bool is_made_up = sentence.quality >= 6 && !config_.accepts_simulated;
  const bool has_figures = sentence.kind != nmea::SentenceKind::rmc;
  const bool is_weak = has_figures && (sentence.satellites < config_.minimum_satellites ||
                                       (sentence.hdop && *sentence.hdop > config_.maximum_hdop));
  const bool is_absurd_height = sentence.altitude_m && std::abs(*sentence.altitude_m) > 20'000;
  if (is_made_up || is_weak || is_absurd_height) {
    ++counters_.bad_quality;
    return false;
  }
  if (std::abs(sentence.latitude_deg) < 1e-3 && std::abs(sentence.longitude_deg) < 1e-3) {
    ++counters_.at_zero;
    return false;
  }
  return true;
}

bool Gps::is_reachable(const GpsFix& from, const GpsFix& to) const {
  const double reach_m =
      config_.maximum_speed_m_s * seconds(to.stamp_ns - from.stamp_ns) + config_.jump_slack_m;
  return (to.enu_m - from.enu_m).head<2>().norm() <= reach_m;
}

bool Gps::is_plausible(const GpsFix& fix, std::int64_t now_ns) {
  if (fix_count_ == 0 || is_reachable(this->fix(0), fix)) {
    jumped_count_ = 0;
    return true;
  }
  ++counters_.jumps;
  const bool agrees = jumped_count_ > 0 && is_reachable(jumped_, fix);
  jumped_count_ = agrees ? jumped_count_ + 1 : 1;
  jumped_ = fix;
  if (jumped_count_ == 1)
    raise(now_ns, Severity::warning, "a position that cannot be reached is not believed");
  if (jumped_count_ < config_.jump_patience) return false;
  // The old place was the wrong one: nothing is interpolated across.
  ++counters_.jumps_believed;
  jumped_count_ = 0;
  fix_count_ = 0;
  raise(now_ns, Severity::warning, "the receiver insists on another place; believed now");
  return true;
}

void Gps::keep(const GpsFix& fix, std::int64_t now_ns) {
  if (counters_.fixes == 0) {
    raise(now_ns, Severity::info, "first fix");
  } else if (is_lost_) {
    raise(now_ns, Severity::info, "fixes come again");
  }
  is_lost_ = false;
  const bool is_close = fix_count_ >= 2 && this->fix(0).stamp_ns - this->fix(1).stamp_ns < history_spacing_ns;
  if (!is_close) {
    newest_ = (newest_ + 1) % history;
    fix_count_ = std::min(fix_count_ + 1, history);
  }
  fixes_[newest_] = fix;
  ++counters_.fixes;
}

std::optional<GpsFix> Gps::newest() const {
  if (fix_count_ == 0) return std::nullopt;
  return fix(0);
}

std::optional<Eigen::Vector3d> Gps::position_at(std::int64_t stamp_ns, std::int64_t maximum_age_ns) const {
  const GpsFix* before = nullptr;
  const GpsFix* after = nullptr;
  for (std::uint32_t age = 0; age < fix_count_ && before == nullptr; ++age) {
    const GpsFix& each = fix(age);
    if (each.stamp_ns >= stamp_ns) after = &each;
    if (each.stamp_ns <= stamp_ns) before = &each;
  }
  if (before != nullptr && stamp_ns - before->stamp_ns > maximum_age_ns) before = nullptr;
  if (after != nullptr && after->stamp_ns - stamp_ns > maximum_age_ns) after = nullptr;
  if (before == nullptr && after == nullptr) return std::nullopt;
  if (before == nullptr || after == nullptr || before->stamp_ns == after->stamp_ns)
    return before == nullptr ? after->enu_m : before->enu_m;
  const double fraction = seconds(stamp_ns - before->stamp_ns) / seconds(after->stamp_ns - before->stamp_ns);
  return before->enu_m + fraction * (after->enu_m - before->enu_m);
}

}  // namespace alces
