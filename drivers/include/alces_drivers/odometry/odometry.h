// The vehicle's motion from CAN: speeds and turning rates in frames of any make, integrated to a pose, and
// the pose at any past time.
//
// Which bits mean what is configuration (can_signal.h); factor and offset bring them to SI. There is either a
// speed for each side (wheels: differential, crawler) or one speed and a yaw rate (vehicle). A gyro's yaw
// rate takes the place of the wheels'; roll and pitch rates, where there are any, make the pose 6D: x
// forward, rates about the body's own axes (REP 103: a positive pitch rate lowers the nose).
//
// Each signal is integrated over its own frames by the trapezoidal rule. When all signals have come again
// since the last node, the increments since then (way along x, rotation vector) make a new node: pose *
// exp(twist), an exact arc for constant speed and rate. Between nodes the same arc is followed in part.
//
// Refused and counted: frames too short, values outside a signal's limits, speeds and rates beyond what the
// vehicle can do, changes faster than it can (until `patience` of them agree), duplicates and frames that
// came late. When frames stay away, or come but are frozen, the answer is stale until they are good again;
// the pose goes on from where it was, so it never jumps. Frozen is a sender whose alive counter stands still;
// one that sends the same data though the vehicle moves (with an alive counter: only where a gyro is among
// them, whose noise never rests); and wheels that say that they stand while the gyro turns, until they move
// again.
//
// Memory: about 130 KiB in the object. on_frame: O(1); pose_at: O(log capacity).
#pragma once

#include <array>
#include <cstdint>

#include "alces_drivers/notice_rate_limiter.h"
#include "alces_drivers/odometry/can_signal.h"
#include "alces_drivers/odometry/motion.h"
#include "alces_drivers/odometry/odometry_uncertainty.h"
#include "alces_drivers/stamp.h"
#include "alces_drivers/stamp_ring.h"

namespace alces {

enum class OdometryKind : std::uint8_t {
  wheels,   ///< left_speed_m_s and right_speed_m_s, and wheel_base_m between them
  vehicle,  ///< speed_m_s and yaw_rate_rad_s
};

struct OdometryConfig {
  OdometryKind kind = OdometryKind::wheels;
  CanSignalSource left_speed_m_s;
  CanSignalSource right_speed_m_s;
  double wheel_base_m = 0;  ///< from the left wheels' track to the right's, as effective for turning
  CanSignalSource speed_m_s;
  CanSignalSource yaw_rate_rad_s;    ///< kind wheels: optional, a gyro
  CanSignalSource roll_rate_rad_s;   ///< optional
  CanSignalSource pitch_rate_rad_s;  ///< optional
  CanSignalSource alive_counter;     ///< optional: changes with every cycle of the sender

  std::int64_t latency_ns = 0;  ///< a value is that much older than its frame's stamp

  bool learn_rate_bias = false;  ///< the rates' mean while the vehicle stands is taken off
  double standstill_speed_m_s = 0.01;
  std::int64_t standstill_ns = ns_per_s;  ///< standing so long before it counts
  double maximum_bias_rad_s = 0.05;

  double maximum_speed_m_s = 15;
  double maximum_rate_rad_s = 3;
  double maximum_acceleration_m_s2 = 15;
  double maximum_rate_change_rad_s2 = 50;
  std::uint32_t patience = 5;  ///< refused changes in a row after which the new value is believed

  std::int64_t maximum_wait_ns = 60 * ns_per_ms;  ///< for the frame after a time; then it is extrapolated
  std::int64_t maximum_extrapolation_ns = 100 * ns_per_ms;
  std::int64_t timeout_ns = 300 * ns_per_ms;        ///< frames farther apart are not bridged
  std::int64_t frozen_after_ns = 5 * ns_per_s;      ///< the same data while moving; 0: not looked for
  std::int64_t alive_timeout_ns = 300 * ns_per_ms;  ///< the same alive counter

  OdometryErrors errors;  ///< for the covariance; no pose depends on it
};

/// Null, or one clause that names the value that cannot be.
[[nodiscard]] const char* validate(const OdometryConfig& config);

struct OdometryCounters {
  std::uint64_t frames = 0;  ///< with a signal of ours
  std::uint64_t frames_too_short = 0;
  std::uint64_t frames_duplicated = 0;  ///< same stamp, same data
  std::uint64_t frames_reordered = 0;   ///< before the last one of their identifier
  std::uint64_t stamps_absurd = 0;
  std::uint64_t values_out_of_limits = 0;  ///< of the signal, or no number
  std::uint64_t values_implausible = 0;    ///< faster than the vehicle can be
  std::uint64_t jumps = 0;                 ///< changes faster than it can
  std::uint64_t jumps_believed = 0;
  std::uint64_t gaps = 0;     ///< times that frames stayed away
  std::uint64_t freezes = 0;  ///< times that they were frozen
  std::uint64_t clock_steps = 0;
  std::uint64_t nodes = 0;
  std::uint64_t standstills = 0;  ///< that the rates' bias was learned from

  template <class Visitor>
  void visit(Visitor&& visit) const {
    visit("frames", frames);
    visit("frames_too_short", frames_too_short);
    visit("frames_duplicated", frames_duplicated);
    visit("frames_reordered", frames_reordered);
    visit("stamps_absurd", stamps_absurd);
    visit("values_out_of_limits", values_out_of_limits);
    visit("values_implausible", values_implausible);
    visit("jumps", jumps);
    visit("jumps_believed", jumps_believed);
    visit("gaps", gaps);
    visit("freezes", freezes);
    visit("clock_steps", clock_steps);
    visit("nodes", nodes);
    visit("standstills", standstills);
  }
};

/// The newest node, and where the vehicle is by it: for those who cannot wait for the next one.
struct OdometryState {
  bool is_valid = false;    ///< frames come and are believed
  std::uint64_t nodes = 0;  ///< so far; 0: nothing below is known
  std::int64_t node_stamp_ns = 0;
  bool is_connected = false;             ///< the way from the node before is known
  Pose node;                             ///< odometry_from_body
  Vector6d velocity = Vector6d::Zero();  ///< along the body's axes: m/s, rad/s
  std::int64_t stamp_ns = 0;             ///< as asked for, or as far as is extrapolated
  Pose odometry_from_body;               ///< at stamp_ns: the node, carried on by the velocity
};

class Odometry final : public Motion {
 public:
  /// The configuration must be one that validate() finds nothing wrong with.
  Odometry(const OdometryConfig& config, NoticePort& notices);

  /// Any frame of the bus; those without a signal of ours are passed over.
  void on_frame(const CanFrame& frame, std::int64_t stamp_ns);
  /// At least every 20 ms. `now_ns` is the time that answers are waited for by.
  void on_tick(std::int64_t now_ns);

  /// ok; not_yet; too_old; stale: no frames (or frozen ones) around that time. The first node is the
  /// identity.
  [[nodiscard]] MotionAnswer pose_at(std::int64_t stamp_ns) const override;

  /// O(1).
  [[nodiscard]] OdometryState state_at(std::int64_t now_ns) const;
  [[nodiscard]] const OdometryUncertainty& uncertainty() const { return uncertainty_; }

  /// Frames come and are believed.
  [[nodiscard]] bool is_alive() const { return is_alive_; }
  [[nodiscard]] const Eigen::Vector3d& rate_bias_rad_s() const { return bias_rad_s_; }
  [[nodiscard]] const OdometryCounters& counters() const { return counters_; }

 private:
  static constexpr std::uint32_t history_capacity = 1024;
  static constexpr std::size_t signal_count = 6;
  enum Channel : std::size_t { left, right, speed, roll, pitch, yaw };
  enum class NoticeKind : std::uint8_t { gap, back, frozen, jump, implausible, clock, bias, count };

  struct Node {
    std::int64_t stamp_ns = 0;
    bool is_connected = false;          ///< the way from the node before is known
    Vector6d twist = Vector6d::Zero();  ///< from the node before: way, rotation vector
    Pose odometry_from_body;
  };

  /// One signal, integrated.
  struct Integral {
    bool is_used = false;
    bool has_value = false;
    bool is_fresh = false;  ///< came since the last node
    std::int64_t stamp_ns = no_stamp_ns;
    double value = 0;
    double sum = 0;          ///< over time since the begin, up to stamp_ns
    double sum_at_node = 0;  ///< at the last node's time
    std::uint32_t refused_in_a_row = 0;
    double refused_value = 0;
    double received = 0;                    ///< as it came last, believed or not
    std::int64_t changed_ns = no_stamp_ns;  ///< when that last changed
  };

  /// What came last with an identifier: to know duplicates and frozen senders.
  struct Message {
    bool is_used = false;
    std::uint32_t id = 0;
    bool is_extended = false;
    std::int64_t stamp_ns = no_stamp_ns;
    std::int64_t changed_ns = no_stamp_ns;
    std::uint8_t size = 0;
    std::array<std::uint8_t, CanFrame::maximum_bytes> data{};
  };

  [[nodiscard]] bool is_stamp_good(std::int64_t stamp_ns);
  void begin_anew();
  [[nodiscard]] Message* message_of(const CanFrame& frame);
  [[nodiscard]] bool is_frame_new(Message& message, const CanFrame& frame, std::int64_t stamp_ns);
  void take_alive_counter(const CanFrame& frame, std::int64_t stamp_ns);
  void take_value(std::size_t channel, double value, std::int64_t stamp_ns);
  [[nodiscard]] bool is_change_verified(Integral& integral, double value, double limit,
                                        std::int64_t stamp_ns);
  void make_node_if_complete();
  [[nodiscard]] double increment(std::size_t channel, std::int64_t stamp_ns);
  void learn_bias(double way_m, const Eigen::Vector3d& rotation_rad, double duration_s);
  void note_values(const CanFrame& frame, std::int64_t stamp_ns);
  void watch_frozen(std::int64_t stamp_ns);
  [[nodiscard]] bool do_values_rest(std::int64_t stamp_ns) const;
  [[nodiscard]] bool do_wheels_contradict_gyro(std::int64_t stamp_ns);
  void freeze(std::int64_t stamp_ns, const char* text);
  [[nodiscard]] bool is_rate(std::size_t channel) const { return channel >= roll; }

  OdometryConfig config_;
  NoticeRateLimiter<NoticeKind> notices_;
  OdometryCounters counters_;
  std::array<CanSignalSource, signal_count> sources_;  ///< by channel
  std::array<Integral, signal_count> integrals_;
  std::array<Message, signal_count + 1> messages_;  ///< at most one a signal, and the alive counter's
  StampRing<Node, history_capacity> nodes_;
  Pose last_pose_;  ///< of the newest node, also when the history was forgotten
  OdometryUncertainty uncertainty_;
  std::int64_t ticked_ns_ = no_stamp_ns;
  bool is_alive_ = false;
  bool is_frozen_ = false;
  bool is_break_due_ = true;

  std::int64_t contradiction_ns_ = no_stamp_ns;  ///< since when the wheels stand and the gyro turns
  bool are_wheels_dead_ = false;

  bool has_alive_counter_ = false;
  double alive_value_ = 0;
  std::int64_t alive_changed_ns_ = no_stamp_ns;
  std::int64_t alive_seen_ns_ =
      no_stamp_ns;  ///< the newest: a counter that does not come does not stand still

  Eigen::Vector3d bias_rad_s_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d standstill_sum_rad_ = Eigen::Vector3d::Zero();
  double standstill_s_ = 0;
  bool has_bias_ = false;
};

}  // namespace alces
