#include "alces_drivers/motor/permit.h"

namespace alces {

const char* validate(const PermitConfig& config) {
  switch (config.source) {
    case PermitSource::none:
      return nullptr;
    case PermitSource::gpio:
      return config.debounce_ns < 0 ? "the permit's debounce time is negative" : nullptr;
    case PermitSource::can:
      if (config.cob_id == 0 || config.cob_id > 0x7FF) return "the permit's CAN identifier is not 1 to 0x7FF";
      if (config.byte > 7) return "the permit's byte is not 0 to 7";
      if (config.mask == 0 || (config.value & ~config.mask) != 0)
        return "the permit's mask is 0, or its value has bits beyond the mask";
      break;
    case PermitSource::socket:
      break;
  }
  return config.timeout_ns <= 0 ? "the permit's time-out is not positive" : nullptr;
}

void Permit::on_edge(const GpioEdge& edge, std::int64_t stamp_ns) {
  if (config_.source != PermitSource::gpio || edge.line != config_.line) return;
  const bool is_on = edge.is_rising != config_.is_active_low;
  // An edge shows the level before it.
  level_ = is_on ? Level::off : Level::on;
  take(is_on, stamp_ns);
}

void Permit::on_edges_lost(std::uint8_t line) {
  if (config_.source == PermitSource::gpio && line == config_.line) forget();
}

void Permit::on_frame(const CanFrame& frame, std::int64_t stamp_ns) {
  if (config_.source != PermitSource::can || !frame.is_classical_data() || frame.id != config_.cob_id) return;
  if (frame.size <= config_.byte) {
    ++counters_.malformed;
    return;
  }
  take((frame.data[config_.byte] & config_.mask) == config_.value, stamp_ns);
}

void Permit::on_message(bool is_on, std::int64_t stamp_ns) {
  if (config_.source == PermitSource::socket) take(is_on, stamp_ns);
}

void Permit::take(bool is_on, std::int64_t stamp_ns) {
  const Level before = level_;
  level_ = is_on ? Level::on : Level::off;
  // Two messages farther apart than the time-out, and no tick between them: the first had run out.
  const bool has_run_out = config_.source != PermitSource::gpio && heard_ns_ != no_stamp_ns &&
                           stamp_ns - heard_ns_ > config_.timeout_ns;
  heard_ns_ = stamp_ns;
  if (has_run_out) {
    if (is_given_) ++counters_.timed_out;
    is_given_ = false;
  }
  if (!is_on) {
    on_since_ns_ = no_stamp_ns;
    if (is_given_) ++counters_.withdrawn;
    is_given_ = false;
    return;
  }
  if (before == Level::on && !has_run_out) return;
  if (before != Level::off || has_run_out) {
    ++counters_.without_edge;
    return;
  }
  if (config_.source == PermitSource::gpio && config_.debounce_ns > 0) {
    on_since_ns_ = stamp_ns;
  } else {
    give();
  }
}

void Permit::give() {
  ++counters_.given;
  is_given_ = true;
}

void Permit::forget() {
  if (is_given_) ++counters_.not_watched;
  level_ = Level::unknown;
  is_given_ = false;
  on_since_ns_ = no_stamp_ns;
}

void Permit::on_tick(std::int64_t now_ns) {
  if (!is_asked_for()) return;
  if (last_tick_ns_ != no_stamp_ns && now_ns - last_tick_ns_ > tick_gap_ns) forget();
  last_tick_ns_ = now_ns;
  if (config_.source == PermitSource::gpio) {
    if (on_since_ns_ == no_stamp_ns || now_ns - on_since_ns_ < config_.debounce_ns) return;
    on_since_ns_ = no_stamp_ns;
    give();
  } else if (heard_ns_ != no_stamp_ns && now_ns - heard_ns_ > config_.timeout_ns) {
    if (is_given_) ++counters_.timed_out;
    level_ = Level::unknown;
    is_given_ = false;
    heard_ns_ = no_stamp_ns;
  }
}

}  // namespace alces
