#include "alces_platform/sim/simulated_rig.h"

#include <cmath>
#include <utility>

namespace alces::sim {
namespace {

RigSettings with_seed(RigSettings settings) {
  settings.motion.seed = settings.seed;
  return settings;
}

LaserSweeps::Settings sweep_settings(const RigSettings& settings, std::uint8_t laser) {
  LaserSweeps::Settings sweeps;
  sweeps.laser = laser;
  sweeps.seed = mix(settings.seed, 120);
  sweeps.field_of_view_rad = settings.field_of_view_rad;
  sweeps.batch = settings.sweeps_cast_ahead;
  sweeps.is_parallel = settings.is_parallel;
  return sweeps;
}

SerialSettings gps_line(SerialSettings settings, const GpsSettings& gps) {
  settings.first_baud_rate = gps.baud_rate;  // nobody searches for a GPS receiver's rate
  return settings;
}

}  // namespace

SimulatedRig::SimulatedRig(const RigSettings& settings)
    : SimulatedRig(settings, std::make_shared<const Town>(make_tour(with_seed(settings).motion).layout)) {}

SimulatedRig::SimulatedRig(const RigSettings& settings, std::shared_ptr<const Town> town)
    : settings_(with_seed(settings)),
      town_(std::move(town)),
      motion_(settings_.motion, make_tour(settings_.motion), *town_),
      steady_head_(settings_.motion.start_stamp_ns, settings_.head_speed_rad_per_s),
      motor_(&steady_head_),
      encoder_(settings_.encoder, settings_.geometry.index_angle_rad, settings_.seed),
      odometry_(settings_.odometry, settings_.seed, motion_, settings_.motion.start_stamp_ns),
      crowd_(settings_.crowd, settings_.seed, motion_, *town_),
      caster_(town_->scene(), &crowd_, settings_.range_errors, settings_.geometry, settings_.rings),
      sweeps_{LaserSweeps(sweep_settings(settings_, 0), caster_, motion_, head_, settings_.geometry),
              LaserSweeps(sweep_settings(settings_, 1), caster_, motion_, head_, settings_.geometry)},
      can_(settings_.can, settings_.seed, settings_.motion.start_stamp_ns, faults_, events_),
      lines_{SerialLine(settings_.serial, laser_a_channel, settings_.seed, settings_.motion.start_stamp_ns,
                        faults_, events_),
             SerialLine(settings_.serial, laser_b_channel, settings_.seed, settings_.motion.start_stamp_ns,
                        faults_, events_),
             SerialLine(gps_line(settings_.serial, settings_.gps), gps_channel, settings_.seed,
                        settings_.motion.start_stamp_ns, faults_, events_)},
      gps_(settings_.gps, settings_.seed, motion_, town_->scene(), settings_.geometry.body_from_antenna_m,
           settings_.motion.start_stamp_ns, faults_),
      stepped_ns_(settings_.motion.start_stamp_ns),
      now_ns_(stepped_ns_),
      next_tick_ns_(stepped_ns_ + settings_.tick_ns),
      random_(mix(settings_.seed, 130)) {
  if (settings_.has_gps) lines_[gps_channel].attach(gps_);
}

Pose SimulatedRig::map_from_body(std::int64_t stamp_ns, std::int64_t reference_stamp_ns) const {
  return motion_.town_from_body(reference_stamp_ns).inverse() * motion_.town_from_body(stamp_ns);
}

// Faults that happen at one time. Those that last are looked up where they act.
void SimulatedRig::start_fault(const Injection& injection) {
  ++counters_.faults;
  switch (injection.fault) {
    // In the motor drive.
    case Fault::late_boot_up:
    case Fault::node_reset:
    case Fault::sdo_abort:
    case Fault::drive_fault_once:
    case Fault::drive_fault_for_ever:
      can_.on_fault(injection);
      break;
    case Fault::emergency:
      can_.send_emergency(static_cast<std::uint16_t>(argument_or(injection, 0x8110)));
      break;
    // In a laser.
    case Fault::laser_wrong_baud:
    case Fault::laser_reset:
      if (laser_of(injection) < RigGeometry::maximum_lasers) lines_[laser_of(injection)].on_fault(injection);
      break;
    case Fault::laser_half_telegram:
      if (laser_of(injection) < RigGeometry::maximum_lasers)
        lines_[laser_of(injection)].lose(static_cast<std::uint64_t>(number_or(injection, 366)));
      break;
    case Fault::odometry_jump:
      odometry_.jump(static_cast<double>(argument_or(injection, 30'000)) * 1e-3);
      break;
    // Looked up while they last: can_bus.cpp, head_encoder.cpp, serial_line.cpp, odometry_sensor.cpp,
    // gps_receiver.cpp.
    case Fault::node_absent:
    case Fault::heartbeat_lost:
    case Fault::sdo_silence:
    case Fault::bus_off:
    case Fault::error_passive_flood:
    case Fault::pdo_lost:
    case Fault::pdo_duplicated:
    case Fault::pdo_delayed:
    case Fault::pdo_reordered:
    case Fault::bus_load:
    case Fault::index_missing:
    case Fault::index_extra:
    case Fault::index_bouncing:
    case Fault::ab_swapped:
    case Fault::edges_lost:
    case Fault::laser_garbage:
    case Fault::laser_crc_errors:
    case Fault::laser_unplugged:
    case Fault::odometry_frozen:
    case Fault::odometry_silent:
    case Fault::gps_absurd:
    case Fault::gps_silent:
      break;
  }
}

void SimulatedRig::step(std::int64_t now_ns) {
  while (const auto injection = faults_.take(now_ns)) start_fault(*injection);

  head_.add(now_ns, motor_->angle_rad(now_ns), motor_->velocity_rad_per_s(now_ns));
  edges_.clear();
  encoder_.step(now_ns, head_.angle_rad(now_ns), faults_, edges_);
  for (const HeadEncoder::Output& output : edges_) {
    Event event;
    event.stamp_ns = output.stamp_ns;
    if (output.lost_count > 0) {
      event.kind = EventKind::edges_lost;
      event.lost_count = output.lost_count;
    } else {
      event.kind = EventKind::edge;
      event.edge = output.edge;
      ++counters_.edges;
    }
    // Read in batches: all of a step at once.
    events_.push(now_ns + 100'000, event);
  }
  counters_.edges_lost = encoder_.lost_count();

  odometry_frames_.clear();
  odometry_.poll(now_ns, faults_, odometry_frames_);
  counters_.odometry_frames += odometry_frames_.size();
  for (const OdometrySensor::Output& output : odometry_frames_)
    can_.send_from_sensor(output.frame, output.ready_stamp_ns);
  can_.step(now_ns);
  for (SerialLine& line : lines_) line.step(now_ns);

  const auto tick = [this](std::int64_t due_ns) {
    Event event;
    // A busy host gets to its ticks late; the stamp says when it did.
    const double late_us =
        settings_.tick_late_us > 0 ? -settings_.tick_late_us * std::log(1 - random_.uniform()) : 0;
    event.stamp_ns = due_ns + static_cast<std::int64_t>(late_us * 1e3);
    ++counters_.ticks;
    events_.push(event.stamp_ns, event);
  };
  if (wake_ns_ != no_stamp_ns && wake_ns_ <= now_ns) {
    const bool is_new = wake_ns_ > stepped_ns_ - step_ns;
    if (is_new && wake_ns_ != next_tick_ns_) tick(wake_ns_);
    wake_ns_ = no_stamp_ns;
  }
  for (; next_tick_ns_ <= now_ns; next_tick_ns_ += settings_.tick_ns) tick(next_tick_ns_);
}

void SimulatedRig::advance_to(std::int64_t stamp_ns, EventSink& sink) {
  while (stepped_ns_ + step_ns <= stamp_ns) {
    stepped_ns_ += step_ns;
    step(stepped_ns_);
    events_.deliver(stepped_ns_, now_ns_, sink);
    now_ns_ = stepped_ns_;
  }
}

}  // namespace alces::sim
