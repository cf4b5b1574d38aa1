#include "alces_drivers/gps/gps.h"

#include <algorithm>
#include <cmath>

namespace alces {

const char* problem(const GpsConfig& config) {
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
  for (const std::uint8_t byte : bytes) {
    const auto line = lines_.push(byte);
    if (!line) continue;
    const nmea::ParsedSentence parsed = nmea::parse(*line);
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
  raise(now_ns, is_up ? Severity::info : Severity::warning,
        is_up ? "the receiver's line is up" : "the receiver's line went down");
}

void Gps::on_tick(std::int64_t now_ns) {
  if (ticked_ns_ != no_stamp_ns && now_ns < ticked_ns_ - clock_step_ns) {
    // Fixes of another clock: new ones would seem older than they are.
    fix_count_ = 0;
    jumped_count_ = 0;
    last_gga_ns_ = no_stamp_ns;
  }
  ticked_ns_ = now_ns;
  if (fix_count_ == 0 || is_lost_ || now_ns - fix(0).stamp_ns <= 5 * config_.maximum_age_ns) return;
  is_lost_ = true;
  raise(now_ns, Severity::warning, "no usable fix comes");
}

void Gps::on_sentence(const nmea::Sentence& sentence, std::int64_t stamp_ns) {
  if (sentence.kind == nmea::SentenceKind::gga) {
    last_gga_ns_ = stamp_ns;
  } else if (last_gga_ns_ != no_stamp_ns && stamp_ns - last_gga_ns_ < config_.gga_silence_ns) {
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
  const bool is_gga = sentence.kind == nmea::SentenceKind::gga;
  const bool is_weak = is_gga && (sentence.satellites < config_.minimum_satellites ||
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
  newest_ = (newest_ + 1) % history;
  fixes_[newest_] = fix;
  fix_count_ = std::min(fix_count_ + 1, history);
  ++counters_.fixes;
}

std::optional<GpsFix> Gps::newest() const {
  if (fix_count_ == 0) return std::nullopt;
  return fix(0);
}

std::optional<Eigen::Vector3d> Gps::position_at(std::int64_t stamp_ns) const {
  if (fix_count_ == 0) return std::nullopt;
  if (stamp_ns >= fix(0).stamp_ns) {
    if (stamp_ns - fix(0).stamp_ns > config_.maximum_age_ns) return std::nullopt;
    return fix(0).enu_m;
  }
  for (std::uint32_t age = 1; age < fix_count_; ++age) {
    const GpsFix& before = fix(age);
    if (before.stamp_ns > stamp_ns) continue;
    const GpsFix& after = fix(age - 1);
    if (after.stamp_ns - before.stamp_ns > config_.maximum_age_ns) return std::nullopt;
    const double fraction = static_cast<double>(stamp_ns - before.stamp_ns) /
                            static_cast<double>(after.stamp_ns - before.stamp_ns);
    return Eigen::Vector3d(before.enu_m + fraction * (after.enu_m - before.enu_m));
  }
  return std::nullopt;
}

}  // namespace alces
