// The simulated vehicle with its scanner, on the wires that drivers speak: CAN, GPIO lines, serial lines.
//
// The host hands frames and bytes to can_port() and byte_port(), and gets Events from advance_to(): with the
// stamps that a kernel would give them, delivered in the order (and with the latency) in which it would hear
// of them. Simulated time goes on in steps of a millisecond; what the host sends while it is told of an event
// reaches the wire with the next step. A run is a function of the settings, the injections and what the host
// sends: not of the calls of advance_to(), the number of cores, or any clock.
//
// Devices that speak a protocol (the motor drive, the lasers) are attached from outside; without a drive the
// head turns by itself, without lasers their lines stay silent. A link (can_link, byte_link) comes up with
// the first step.
//
// Cost: about 25 ms of CPU for a second with two lasers, nearly all of it rays (shared by the cores).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "alces_drivers/port/byte_port.h"
#include "alces_drivers/port/can_port.h"
#include "alces_drivers/scanner/event.h"
#include "alces_drivers/stamp.h"
#include "alces_platform/sim/event_queue.h"
#include "alces_platform/sim/fault.h"
#include "alces_platform/sim/motor/can_bus.h"
#include "alces_platform/sim/motor/head_motor.h"
#include "alces_platform/sim/rig_geometry.h"
#include "alces_platform/sim/sensors/gps_receiver.h"
#include "alces_platform/sim/sensors/head_encoder.h"
#include "alces_platform/sim/sensors/odometry_sensor.h"
#include "alces_platform/sim/sensors/serial_line.h"
#include "alces_platform/sim/sensors/sweep_caster.h"
#include "alces_platform/sim/sensors/sweep_source.h"
#include "alces_platform/sim/world/crowd.h"
#include "alces_platform/sim/world/range_errors.h"
#include "alces_platform/sim/world/town.h"
#include "alces_platform/sim/world/vehicle_motion.h"

namespace alces::sim {

/// Two lasers at 75 sweeps/s on a head that turns once in 2.4 s: half a turn sees all around, so a scan
/// is 1.2 s long and has 180 profiles of 181 rays, 32,580 in all.
struct RigSettings {
  std::uint64_t seed = 1;  ///< of town, route and all errors; motion.seed is set to it
  MotionSettings motion;
  RigGeometry geometry;
  double head_speed_rad_per_s = 3.14159265358979323846 / 1.2;  ///< without a drive
  std::uint8_t lasers = 2;
  double field_of_view_rad = 3.14159265358979323846;
  RangeErrors range_errors{.dropout_share = 0.002};
  Rings rings;
  CrowdSettings crowd;
  OdometrySensorSettings odometry;
  GpsSettings gps;
  bool has_gps = true;
  HeadEncoderSettings encoder;
  CanBusSettings can;
  SerialSettings serial;
  std::int64_t tick_ns = 10'000'000;
  double tick_late_us =
      0;  ///< mean (exponential) by which the host's ticks come late: a busy one takes its time
  std::size_t sweeps_cast_ahead = 16;
  bool is_parallel = true;
};

class SimulatedRig {
 public:
  struct Counters {
    std::uint64_t ticks = 0;
    std::uint64_t edges = 0;
    std::uint64_t edges_lost = 0;
    std::uint64_t odometry_frames = 0;
    std::uint64_t faults = 0;
    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("ticks", ticks);
      visit("edges", edges);
      visit("edges_lost", edges_lost);
      visit("odometry_frames", odometry_frames);
      visit("faults", faults);
    }
  };

  /// Builds the town (about 0.3 s) and the route.
  explicit SimulatedRig(const RigSettings& settings);
  /// In a town that is there already: that of make_tour(settings.motion).layout.
  SimulatedRig(const RigSettings& settings, std::shared_ptr<const Town> town);
  SimulatedRig(const SimulatedRig&) = delete;
  SimulatedRig& operator=(const SimulatedRig&) = delete;
  ~SimulatedRig() = default;

  // What is attached must outlive the rig's use; before the first advance_to().
  void attach(CanNode& node) { can_.attach(node); }
  void attach(HeadMotor& motor) { motor_ = &motor; }
  void attach(std::uint8_t channel, SerialDevice& device) { lines_[channel].attach(device); }
  /// What the laser of this number measures.
  [[nodiscard]] SweepSource& sweeps(std::uint8_t laser) { return sweeps_[laser]; }

  // The host's side.
  [[nodiscard]] CanPort& can_port() { return can_; }
  [[nodiscard]] BytePort& byte_port(std::uint8_t channel) { return lines_[channel]; }
  /// Lets time pass and hands on all events due by then (in whole milliseconds since the start).
  void advance_to(std::int64_t stamp_ns, EventSink& sink);
  /// The due time of the event being handed on, or where advance_to() ended.
  [[nodiscard]] std::int64_t now_ns() const { return now_ns_; }
  /// One more tick at this time, as a host's timer gives it; stamps that have passed, and no_stamp_ns: none.
  void wake_at(std::int64_t stamp_ns) { wake_ns_ = stamp_ns; }
  void inject(const Injection& injection) { faults_.add(injection); }

  // The truth.
  [[nodiscard]] const VehicleMotion& motion() const { return motion_; }
  [[nodiscard]] Pose town_from_body(std::int64_t stamp_ns) const { return motion_.town_from_body(stamp_ns); }
  /// In a map whose origin is the body at `reference_stamp_ns` (the first scan's): what trajectory.tum is
  /// held against.
  [[nodiscard]] Pose map_from_body(std::int64_t stamp_ns, std::int64_t reference_stamp_ns) const;
  /// Within the last second.
  [[nodiscard]] double head_angle_rad(std::int64_t stamp_ns) const { return head_.angle_rad(stamp_ns); }
  [[nodiscard]] const Town& town() const { return *town_; }
  [[nodiscard]] const RigSettings& settings() const { return settings_; }

  [[nodiscard]] const Counters& counters() const { return counters_; }
  [[nodiscard]] const CanBus::Counters& can_counters() const { return can_.counters(); }
  [[nodiscard]] const SerialLine::Counters& line_counters(std::uint8_t channel) const {
    return lines_[channel].counters();
  }
  [[nodiscard]] const LaserSweeps::Counters& sweep_counters(std::uint8_t laser) const {
    return sweeps_[laser].counters();
  }

 private:
  static constexpr std::int64_t step_ns = 1'000'000;
  void step(std::int64_t now_ns);
  void start_fault(const Injection& injection);

  RigSettings settings_;
  std::shared_ptr<const Town> town_;
  VehicleMotion motion_;
  FaultPlan faults_;
  EventQueue events_;
  HeadTrack head_;
  SteadyHead steady_head_;
  HeadMotor* motor_;
  HeadEncoder encoder_;
  OdometrySensor odometry_;
  Crowd crowd_;
  SweepCaster caster_;
  std::array<LaserSweeps, RigGeometry::maximum_lasers> sweeps_;
  CanBus can_;
  std::array<SerialLine, byte_channel_count> lines_;
  GpsReceiver gps_;
  std::int64_t stepped_ns_;
  std::int64_t now_ns_;
  std::int64_t next_tick_ns_;
  std::int64_t wake_ns_ = no_stamp_ns;
  Random random_;
  std::vector<OdometrySensor::Output> odometry_frames_;
  std::vector<HeadEncoder::Output> edges_;
  Counters counters_;
};

}  // namespace alces::sim
