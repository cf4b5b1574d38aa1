#include "alces_drivers/scanner/scanner.h"

#include <algorithm>
#include <memory>
#include <new>

namespace alces {

const char* to_string(ScannerPhase phase) {
  switch (phase) {
    case ScannerPhase::stopped:
      return "stopped";
    case ScannerPhase::starting_motor:
      return "starting the motor";
    case ScannerPhase::starting_lasers:
      return "starting the lasers";
    case ScannerPhase::scanning:
      return "scanning";
    case ScannerPhase::stopping_lasers:
      return "stopping the lasers";
    case ScannerPhase::stopping_motor:
      return "stopping the motor";
    case ScannerPhase::left:
      return "ended, and the motor is not confirmed to stand";
  }
  return "unknown";
}

const char* to_string(ScannerPart part) {
  switch (part) {
    case ScannerPart::scanner:
      return "scanner";
    case ScannerPart::motor:
      return "motor";
    case ScannerPart::encoder:
      return "encoder";
    case ScannerPart::laser_a:
      return "laser_a";
    case ScannerPart::laser_b:
      return "laser_b";
    case ScannerPart::odometry:
      return "odometry";
    case ScannerPart::gps:
      return "gps";
    case ScannerPart::assembler:
      return "assembler";
    case ScannerPart::count:
      break;
  }
  return "unknown";
}

const char* validate(const ScannerConfig& config) {
  if (config.has_motor && validate(config.motor) != MotorConfigStatus::ok)
    return to_string(validate(config.motor));
  if (const char* wrong = validate(config.encoder)) return wrong;
  if (config.assembler.laser_count == 0 || config.assembler.laser_count > ScannerConfig::maximum_lasers)
    return "there must be one laser or two";
  for (std::uint32_t laser = 0; laser < config.assembler.laser_count; ++laser) {
    const bool is_lms2xx = config.laser_makes[laser] == LaserMake::lms2xx;
    if (const char* wrong = is_lms2xx ? validate(config.lms2xx[laser]) : validate(config.cola_b[laser]))
      return wrong;
    if ((is_lms2xx ? config.lms2xx[laser].laser : config.cola_b[laser].laser) != laser)
      return "the lasers are not numbered in their order";
  }
  if (config.has_odometry) {
    if (const char* wrong = validate(config.odometry)) return wrong;
  }
  if (config.has_gps) {
    if (const char* wrong = validate(config.gps)) return wrong;
  }
  if (const char* wrong = validate(config.assembler)) return wrong;
  if (config.motor_patience_ns <= 0 || config.laser_silence_ns <= 0 || config.scan_patience_ns <= 0 ||
      config.laser_stop_timeout_ns <= 0)
    return "a patience of the scanner is not positive";
  return nullptr;
}

std::size_t Scanner::memory_required(const ScannerConfig& config) {
  Arena arena;
  arena.allocate<std::byte>(sizeof(Scanner));
  for (std::uint32_t laser = 0; laser < config.assembler.laser_count; ++laser) {
    arena.allocate<std::byte>(config.laser_makes[laser % ScannerConfig::maximum_lasers] == LaserMake::lms2xx
                                  ? sizeof(Lms2xx)
                                  : sizeof(ColaB));
  }
  arena.allocate<std::byte>(ScanAssembler::memory_required(config.assembler.capacity));
  return arena.used_bytes();
}

Scanner* Scanner::create(std::span<std::byte> block, const ScannerConfig& config, const Ports& ports,
                         ScanSink& sink, NoticePort& notices, AssemblerStatus& status) {
  status = AssemblerStatus::bad_config;
  if (validate(config) != nullptr) return nullptr;
  status = AssemblerStatus::block_misaligned;
  if (reinterpret_cast<std::uintptr_t>(block.data()) % Arena::alignment != 0) return nullptr;
  status = AssemblerStatus::block_too_small;
  if (block.size() < memory_required(config)) return nullptr;

  Arena arena(block);
  Scanner* const scanner =
      new (arena.allocate<std::byte>(sizeof(Scanner)).data()) Scanner(config, ports, sink, notices);
  for (std::uint32_t laser = 0; laser < config.assembler.laser_count; ++laser) {
    LaserSlot& slot = scanner->lasers_[laser];
    slot.scanner = scanner;
    BytePort& port = ports.lasers[laser] != nullptr ? *ports.lasers[laser] : scanner->no_port_;
    if (config.laser_makes[laser] == LaserMake::lms2xx) {
      slot.lms2xx = new (arena.allocate<std::byte>(sizeof(Lms2xx)).data())
          Lms2xx(scanner->config_.lms2xx[laser], port, notices, slot);
      slot.laser = slot.lms2xx;
    } else {
      slot.cola_b = new (arena.allocate<std::byte>(sizeof(ColaB)).data())
          ColaB(scanner->config_.cola_b[laser], port, notices, slot);
      slot.laser = slot.cola_b;
    }
  }
  scanner->assembler_ = ScanAssembler::create(
      arena.allocate<std::byte>(ScanAssembler::memory_required(config.assembler.capacity)), config.assembler,
      scanner->encoder_, config.has_odometry ? &scanner->odometry_ : nullptr, scanner->scans_, notices,
      status);
  if (scanner->assembler_ == nullptr) return nullptr;
  if (config.has_gps) scanner->assembler_->ask_for_positions(&scanner->gps_);
  return scanner;
}

Scanner::Scanner(const ScannerConfig& config, const Ports& ports, ScanSink& sink, NoticePort& notices)
    : config_(config),
      notices_(notices),
      motor_(config_.motor, ports.can != nullptr ? *ports.can : no_port_, notices, feedback_),
      encoder_(config_.encoder, notices),
      odometry_(config_.odometry, notices),
      gps_(config_.gps, notices),
      notice_limiter_(notices, "scanner") {
  for (ColaBConfig& cola_b : config_.cola_b) cola_b.most_rays = config_.assembler.capacity.rays_per_profile;
  feedback_.scanner = this;
  scans_.scanner = this;
  scans_.sink = &sink;
}

void Scanner::LaserSlot::on_profile(const Profile& profile) {
  silent_since_ns = scanner->now_ns_;
  ++profiles;
  scanner->assembler_->on_profile(profile);
}

void Scanner::Feedback::on_drive_feedback(const DriveFeedback& feedback) {
  const bool is_at_sync =
      scanner->config_.position_is_sampled_at_sync && feedback.sync_stamp_ns != no_stamp_ns;
  if (is_at_sync && feedback.is_extra) return;  // of which SYNC cycle is it? The next one will do
  scanner->encoder_.on_drive_position(feedback.position_counts,
                                      is_at_sync ? feedback.sync_stamp_ns : feedback.stamp_ns);
}

void Scanner::Scans::on_scan(const Scan& scan) {
  scanner->dry_since_ns_ = scanner->now_ns_;
  scanner->is_drought_told_ = false;
  sink->on_scan(scan);
}

Scanner::LaserSlot* Scanner::slot_of(std::uint8_t channel) {
  static_assert(laser_a_channel == 0 && laser_b_channel == 1);
  return channel < laser_count() ? &lasers_[channel] : nullptr;
}

void Scanner::on_event(const Event& event) {
  ++counters_.events;
  if (!is_sane_stamp(event.stamp_ns)) {
    ++counters_.stamps_absurd;
    notice_limiter_.raise(NoticeKind::stamp, Severity::error, std::max<std::int64_t>(now_ns_, 0),
                          "an event has a time that cannot be, and is left out; so far",
                          static_cast<std::int64_t>(counters_.stamps_absurd));
    return;
  }
  switch (event.kind) {
    case EventKind::tick:
      on_tick(event.stamp_ns);
      return;
    case EventKind::can_frame:
      if (event.channel != 0) {
        ++counters_.events_of_unknown_channel;
        return;
      }
      if (config_.has_motor) motor_.on_frame(event.frame, event.stamp_ns);
      if (config_.has_odometry) odometry_.on_frame(event.frame, event.stamp_ns);
      return;
    case EventKind::can_link:
      if (config_.has_motor && event.channel == 0) motor_.on_link(event.is_up, event.stamp_ns);
      return;
    case EventKind::edge:
      if (config_.has_motor) motor_.on_edge(event.edge, event.stamp_ns);
      encoder_.on_edge(event.edge, event.stamp_ns);
      return;
    case EventKind::edges_lost:
      if (config_.has_motor) motor_.on_edges_lost(event.edge.line, event.stamp_ns);
      encoder_.on_edges_lost(event.lost_count, event.stamp_ns);
      return;
    case EventKind::bytes:
      if (LaserSlot* const slot = slot_of(event.channel)) {
        slot->laser->on_bytes(event.bytes, event.stamp_ns);
      } else if (event.channel == gps_channel && config_.has_gps) {
        gps_.on_bytes(event.bytes, event.stamp_ns);
      } else {
        ++counters_.events_of_unknown_channel;
      }
      return;
    case EventKind::byte_link:
      if (LaserSlot* const slot = slot_of(event.channel)) {
        slot->laser->on_link(event.is_up, event.stamp_ns);
      } else if (event.channel == gps_channel && config_.has_gps) {
        gps_.on_link(event.is_up, event.stamp_ns);
      } else {
        ++counters_.events_of_unknown_channel;
      }
      return;
    case EventKind::stop:
      stop();
      return;
    case EventKind::order:
      if (config_.has_motor) obey(event);
      return;
    case EventKind::sync_sent:
      if (config_.has_motor && event.channel == 0) motor_.on_sync_sent(event.stamp_ns);
      return;
    case EventKind::can_sent:
    case EventKind::bytes_sent:
      return;
  }
}

void Scanner::obey(const Event& event) {
  switch (event.order) {
    case MotorOrder::permit:
      motor_.on_permit(event.is_up, event.stamp_ns);
      return;
    case MotorOrder::reset:
      motor_.reset(event.stamp_ns);
      return;
    case MotorOrder::resumed:
      motor_.on_resumed(event.stamp_ns);
      return;
  }
}

void Scanner::on_tick(std::int64_t now_ns) {
  ++counters_.ticks;
  if (now_ns_ != no_stamp_ns && now_ns < now_ns_) {
    ++counters_.time_went_back;
    if (now_ns < now_ns_ - clock_step_ns) on_clock_step(now_ns - now_ns_, now_ns);
  }
  now_ns_ = now_ns;
  advance_phase(now_ns);
  if (config_.has_motor) motor_.on_tick(now_ns);
  encoder_.on_tick(now_ns);
  if (config_.has_odometry) odometry_.on_tick(now_ns);
  if (config_.has_gps) gps_.on_tick(now_ns);
  for (std::uint32_t laser = 0; laser < laser_count(); ++laser) lasers_[laser].laser->on_tick(now_ns);
  assembler_->on_tick(now_ns);
  watch(now_ns);
}

// What is waited for is waited for on the new clock.
void Scanner::on_clock_step(std::int64_t step_ns, std::int64_t now_ns) {
  raise(now_ns, Severity::error, "the clock was set back; scans begin anew");
  shift_stamp(phase_since_ns_, step_ns);
  shift_stamp(dry_since_ns_, step_ns);
  for (LaserSlot& slot : lasers_) shift_stamp(slot.silent_since_ns, step_ns);
}

void Scanner::enter(ScannerPhase phase, std::int64_t now_ns) {
  phase_ = phase;
  phase_since_ns_ = now_ns;
  raise(now_ns, Severity::info, to_string(phase));
}

void Scanner::start_lasers(std::int64_t now_ns) {
  for (std::uint32_t laser = 0; laser < laser_count(); ++laser) lasers_[laser].laser->start(now_ns);
  enter(ScannerPhase::starting_lasers, now_ns);
}

bool Scanner::are_lasers(LaserState state) const {
  for (std::uint32_t laser = 0; laser < laser_count(); ++laser) {
    if (lasers_[laser].laser->state() != state) return false;
  }
  return true;
}

void Scanner::advance_phase(std::int64_t now_ns) {
  const bool is_running = phase_ == ScannerPhase::starting_motor || phase_ == ScannerPhase::starting_lasers ||
                          phase_ == ScannerPhase::scanning;
  if (is_running && !wants_to_run_) {
    for (std::uint32_t laser = 0; laser < laser_count(); ++laser) lasers_[laser].laser->stop(now_ns);
    enter(ScannerPhase::stopping_lasers, now_ns);
  }
  switch (phase_) {
    case ScannerPhase::stopped:
    case ScannerPhase::left:
      if (!wants_to_run_) return;
      is_hurried_ = false;
      dry_since_ns_ = no_stamp_ns;
      if (!config_.has_motor) {
        start_lasers(now_ns);
        return;
      }
      motor_.start(now_ns);
      enter(ScannerPhase::starting_motor, now_ns);
      return;
    case ScannerPhase::starting_motor:
      if (motor_.state() == MotorState::running) {
        start_lasers(now_ns);
      } else if (now_ns - phase_since_ns_ > config_.motor_patience_ns) {
        ++counters_.starts_without_motor;
        raise(now_ns, Severity::warning, "the motor does not come up; the lasers are started without it");
        start_lasers(now_ns);
      }
      return;
    case ScannerPhase::starting_lasers:
      if (are_lasers(LaserState::measuring)) enter(ScannerPhase::scanning, now_ns);
      return;
    case ScannerPhase::scanning:
      return;
    case ScannerPhase::stopping_lasers:
      if (!are_lasers(LaserState::stopped) && !is_hurried_ &&
          now_ns - phase_since_ns_ <= config_.laser_stop_timeout_ns)
        return;
      assembler_->finish();
      if (config_.has_motor) motor_.stop(now_ns);
      enter(ScannerPhase::stopping_motor, now_ns);
      return;
    case ScannerPhase::stopping_motor:
      if (config_.has_motor && is_hurried_) motor_.quick_stop(now_ns);  // once; it knows that it does already
      if (!config_.has_motor || motor_.state() == MotorState::stopped) {
        enter(ScannerPhase::stopped, now_ns);
      } else if (motor_.has_ended()) {
        enter(ScannerPhase::left, now_ns);
      }
      return;
  }
}

void Scanner::watch(std::int64_t now_ns) {
  if (phase_ != ScannerPhase::starting_lasers && phase_ != ScannerPhase::scanning) return;
  bool do_profiles_come = false;
  for (std::uint32_t laser = 0; laser < laser_count(); ++laser) {
    LaserSlot& slot = lasers_[laser];
    const bool is_measuring = slot.laser->state() == LaserState::measuring;
    if (is_measuring && !slot.was_measuring) slot.silent_since_ns = now_ns;
    slot.was_measuring = is_measuring;
    if (!is_measuring) continue;
    if (now_ns - slot.silent_since_ns <= config_.laser_silence_ns) {
      do_profiles_come = true;
      continue;
    }
    ++counters_.laser_restarts;
    raise(now_ns, Severity::warning, "a laser measures but delivers nothing; it is begun anew");
    slot.laser->stop(now_ns);
    slot.laser->start(now_ns);
    slot.was_measuring = false;
  }
  if (!do_profiles_come || phase_ != ScannerPhase::scanning) {
    dry_since_ns_ = no_stamp_ns;
    return;
  }
  if (dry_since_ns_ == no_stamp_ns) dry_since_ns_ = now_ns;
  if (is_drought_told_ || now_ns - dry_since_ns_ <= config_.scan_patience_ns) return;
  is_drought_told_ = true;
  ++counters_.scan_droughts;
  raise(now_ns, Severity::warning,
        encoder_.is_referenced()
            ? "profiles come, but no scan: does the head turn?"
            : "profiles come, but no scan: the head's angle is not known; is the index line wired?");
}

const char* Scanner::reason() const {
  switch (phase_) {
    case ScannerPhase::starting_motor:
    case ScannerPhase::stopping_motor:
    case ScannerPhase::left:
      return motor_.reason();
    case ScannerPhase::starting_lasers:
    case ScannerPhase::stopping_lasers:
      for (std::uint32_t laser = 0; laser < laser_count(); ++laser) {
        if (lasers_[laser].laser->state() != LaserState::measuring) return lasers_[laser].laser->reason();
      }
      return "";
    case ScannerPhase::scanning:
      if (config_.has_motor && motor_.state() != MotorState::running) return motor_.reason();
      for (std::uint32_t laser = 0; laser < laser_count(); ++laser) {
        if (lasers_[laser].laser->state() != LaserState::measuring) return lasers_[laser].laser->reason();
      }
      if (config_.has_odometry && !odometry_.is_alive()) return "no odometry";
      return "";
    case ScannerPhase::stopped:
      break;
  }
  return "";
}

void Scanner::raise(std::int64_t now_ns, Severity severity, const char* text) {
  notices_.raise({.stamp_ns = now_ns, .severity = severity, .source = "scanner", .text = text});
}

}  // namespace alces
