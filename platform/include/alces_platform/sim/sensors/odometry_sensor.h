// Wheels and a gyro that report over CAN: what they measure of the vehicle's motion, and wrongly how.
//
// Each sample is the mean since the sample before (wheels count ticks, gyros filter): half a period old when
// it is sent. Which quantity stands where in which frame is a table, as in a DBC file.
//
// Default numbers: wheels of a skid-steered robot of Kurt3D's size: 1.5 % scale, 1 % slip that changes over
// seconds, and a turn from the wheels that is no better than 3 %. Gyro of the MEMS class: 0.3 deg/s bias at
// power-on (a driver can estimate it at standstill), 0.02 deg/s/sqrt(Hz) noise, and a bias that wanders by
// 0.0002 deg/s/sqrt(s): about 10 deg of heading error after 18 minutes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "alces_drivers/can_frame.h"
#include "alces_drivers/odometry/can_signal.h"
#include "alces_platform/sim/fault.h"
#include "alces_platform/sim/random.h"
#include "alces_platform/sim/world/vehicle_motion.h"

namespace alces::sim {

enum class OdometryQuantity : std::uint8_t {
  speed,            ///< m/s, ahead; mean of the wheels
  left_speed,       ///< m/s
  right_speed,      ///< m/s
  wheel_yaw_rate,   ///< rad/s, from the difference of the wheels
  gyro_yaw_rate,    ///< rad/s, anticlockwise
  left_way,         ///< m since power-on, wraps within its signal
  right_way,        ///< m
  counter,          ///< frames of this id since power-on, wraps within its signal
  gyro_roll_rate,   ///< rad/s about the body's x axis
  gyro_pitch_rate,  ///< rad/s about the body's y axis: nose down is positive
};
inline constexpr std::size_t odometry_quantity_count = 10;

struct OdometrySignal {
  OdometryQuantity quantity = OdometryQuantity::speed;
  std::uint32_t can_id = 0;
  CanSignal signal;
};

struct OdometryFrame {
  std::uint32_t can_id = 0;
  bool is_extended = false;
  std::uint8_t size = 8;
  double rate_hz = 50;
};

struct OdometrySensorSettings {
  std::vector<OdometryFrame> frames = {{0x110, false, 5, 50}, {0x111, false, 3, 100}};
  std::vector<OdometrySignal> signals = {
      {OdometryQuantity::left_speed,
       0x110,
       {0, 16, ByteOrder::intel, RawType::signed_integer, 0.001}},  // Intel, mm/s
      {OdometryQuantity::right_speed,
       0x110,
       {16, 16, ByteOrder::intel, RawType::signed_integer, 0.001}},  // Intel, mm/s
      {OdometryQuantity::counter, 0x110, {32, 8, ByteOrder::intel, RawType::unsigned_integer, 1}},
      {OdometryQuantity::gyro_yaw_rate,
       0x111,
       {7, 16, ByteOrder::motorola, RawType::signed_integer, 0.0001}},  // Motorola, 0.1 mrad/s
      {OdometryQuantity::counter, 0x111, {16, 8, ByteOrder::intel, RawType::unsigned_integer, 1}}};
  double track_m = 0.6;  ///< between the wheels, as they stand; left and right speed are given by it

  double scale_error = 0.015;  ///< of the way: 0.7 to 1.3 times this, either sign
  double slip = 0.01;          ///< standard deviation of the wheels' relative error that changes over slip_s
  double slip_s = 3;
  double speed_noise_m_per_s = 0.004;
  double wheel_turn_error = 0.03;    ///< standard deviation of the scale of turns by the wheels
  double gyro_scale_error = 0.005;   ///< standard deviation
  double gyro_bias_deg_per_s = 0.3;  ///< standard deviation of the constant part
  double gyro_noise_deg_per_sqrt_s = 0.02;
  double gyro_bias_walk_deg_per_s_per_sqrt_s = 0.0002;

  /// No errors but those of the signals' resolution.
  [[nodiscard]] OdometrySensorSettings without_errors() const;
};

class OdometrySensor {
 public:
  struct Output {
    CanFrame frame;
    std::int64_t ready_stamp_ns = 0;  ///< sampled just then, ready to be sent
  };

  OdometrySensor(const OdometrySensorSettings& settings, std::uint64_t seed, const VehicleMotion& motion,
                 std::int64_t start_stamp_ns);

  /// Frames due since the last call, up to and including `now_ns`, in the order of time.
  void poll(std::int64_t now_ns, const FaultPlan& faults, std::vector<Output>& frames);
  /// The next speed is this instead (Fault::odometry_jump).
  void jump(double speed_m_per_s) { jump_m_per_s_ = speed_m_per_s; }

 private:
  struct Timetable {
    OdometryFrame frame;
    bool has_wheels = false;  ///< among its quantities
    std::int64_t period_ns = 0;
    std::int64_t next_ns = 0;
    std::int64_t last_ns = 0;
    std::uint64_t count = 0;
    Random random;
    double left_m = 0, right_m = 0;
    std::array<double, odometry_quantity_count> values{};
  };
  /// What the sensors wrongly take for standing.
  enum class Standing : std::uint8_t { nothing, wheels, wheels_and_gyro };
  void sample(Timetable& timetable, Standing standing);
  /// Errors that go on are stepped every 10 ms, so that they do not depend on the frames' rates.
  void step_errors(std::int64_t now_ns);

  OdometrySensorSettings settings_;
  const VehicleMotion& motion_;
  Random random_;
  std::vector<Timetable> timetables_;
  double scale_ = 1;
  double turn_scale_ = 1;
  std::array<double, 3> gyro_scale_{1, 1, 1};  ///< roll, pitch, yaw
  std::int64_t errors_stamp_ns_ = 0;
  double left_slip_ = 0, right_slip_ = 0;
  std::array<double, 3> gyro_bias_rad_per_s_{};
  double jump_m_per_s_ = 0;
};

}  // namespace alces::sim
