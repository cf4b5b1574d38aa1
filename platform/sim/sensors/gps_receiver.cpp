#include "alces_platform/sim/sensors/gps_receiver.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <numbers>

namespace alces::sim {
namespace {

constexpr double deg = std::numbers::pi / 180;
constexpr std::int64_t second_ns = 1'000'000'000;
constexpr int azimuths = 12;
constexpr double elevations_deg[] = {25, 45, 70};

/// "5222.80000,N" as NMEA writes angles: degrees and minutes run together.
std::string angle_text(double angle_deg, int degree_digits, char positive, char negative) {
  const double magnitude = std::abs(angle_deg);
  // In hundred-thousandths of a minute, so that 59.999999 does not print as 60.00000.
  const auto units = static_cast<std::int64_t>(std::llround(magnitude * 60e5));
  char text[40];
  std::snprintf(text, sizeof text, "%0*d%02d.%05d,%c", degree_digits, static_cast<int>(units / 6'000'000),
                static_cast<int>(units / 100'000 % 60), static_cast<int>(units % 100'000),
                angle_deg < 0 ? negative : positive);
  return text;
}

}  // namespace

GpsReceiver::GpsReceiver(const GpsSettings& settings, std::uint64_t seed, const VehicleMotion& motion,
                         const Scene& scene, const Eigen::Vector3d& body_from_antenna_m,
                         std::int64_t start_stamp_ns, const FaultPlan& faults)
    : settings_(settings),
      motion_(motion),
      scene_(scene),
      body_from_antenna_m_(body_from_antenna_m),
      faults_(faults),
      random_(mix(seed, 80)),
      start_stamp_ns_(start_stamp_ns),
      next_ns_(start_stamp_ns + second_ns / 3) {
  wander_m_ = settings.wander_m * Eigen::Vector3d{random_.normal(), random_.normal(), 1.8 * random_.normal()};
}

GpsReceiver::Geodetic GpsReceiver::geodetic(const Eigen::Vector3d& east_north_up_m) const {
  // WGS 84: radii of curvature at the origin are enough for a town.
  constexpr double equator_m = 6378137.0, eccentricity_squared = 6.69437999014e-3;
  const double sine = std::sin(settings_.latitude_deg * deg);
  const double w = 1 - eccentricity_squared * sine * sine;
  const double meridian_m = equator_m * (1 - eccentricity_squared) / std::pow(w, 1.5);
  const double normal_m = equator_m / std::sqrt(w);
  return {settings_.latitude_deg + east_north_up_m.y() / (meridian_m + settings_.altitude_m) / deg,
          settings_.longitude_deg + east_north_up_m.x() / (normal_m + settings_.altitude_m) /
                                        std::cos(settings_.latitude_deg * deg) / deg,
          settings_.altitude_m + east_north_up_m.z()};
}

double GpsReceiver::open_sky(const Eigen::Vector3d& antenna_m) const {
  int open = 0;
  for (const double elevation_deg : elevations_deg) {
    for (int azimuth = 0; azimuth < azimuths; ++azimuth) {
      const double elevation = elevation_deg * deg;
      const double bearing = 2 * std::numbers::pi * azimuth / azimuths;
      const Eigen::Vector3d direction(std::cos(elevation) * std::cos(bearing),
                                      std::cos(elevation) * std::sin(bearing), std::sin(elevation));
      const Hit hit = scene_.cast(antenna_m.cast<float>(), direction.cast<float>(), 120);
      if (hit.surface == Surface::none) ++open;
    }
  }
  return static_cast<double>(open) / static_cast<double>(azimuths * std::size(elevations_deg));
}

void GpsReceiver::append(const char* body) {
  unsigned checksum = 0;
  for (const char* c = body; *c != 0; ++c) checksum ^= static_cast<unsigned char>(*c);
  char tail[8];
  std::snprintf(tail, sizeof tail, "*%02X\r\n", checksum);
  text_ += '$';
  text_ += body;
  text_ += tail;
}

void GpsReceiver::sentences(std::int64_t stamp_ns) {
  const auto state = motion_.at(stamp_ns);
  const Eigen::Vector3d antenna_m = state.town_from_body * body_from_antenna_m_;
  const double open = open_sky(antenna_m);
  open_for_s_ = open >= settings_.open_sky_for_fix ? open_for_s_ + 1 : 0;
  const bool has_fix = open_for_s_ > settings_.reacquire_s;

  const double stays = std::exp(-1 / settings_.wander_s);
  const double comes = settings_.wander_m * std::sqrt(1 - stays * stays);
  const double worse = 1 + 2 * (1 - open);  // reflections
  Eigen::Vector3d measured = antenna_m;
  for (int axis = 0; axis < 3; ++axis) {
    const double of_axis = axis == 2 ? 1.8 : 1.0;
    wander_m_[axis] = stays * wander_m_[axis] + of_axis * comes * random_.normal();
    measured[axis] += worse * (wander_m_[axis] + of_axis * settings_.noise_m * random_.normal());
  }
  const int satellites = static_cast<int>(std::lround(11 * open)) + random_.integer(0, 1);
  if (const Injection* absurd = faults_.active(Fault::gps_absurd, stamp_ns))
    measured.y() += static_cast<double>(argument_or(*absurd, 1'000'000));

  const Geodetic here = geodetic(measured);
  const std::string position =
      angle_text(here.latitude_deg, 2, 'N', 'S') + "," + angle_text(here.longitude_deg, 3, 'E', 'W');
  const auto elapsed_s = static_cast<std::uint32_t>((stamp_ns - start_stamp_ns_) / second_ns);
  const std::uint32_t total_s = settings_.first_time_of_day_s + elapsed_s;
  const std::uint32_t day_s = total_s % 86400;
  char time[16];
  std::snprintf(time, sizeof time, "%02u%02u%02u.00", day_s / 3600 % 24, day_s / 60 % 60, day_s % 60);

  const Eigen::Vector3d velocity = state.town_from_body.rotation * state.velocity_m_per_s;
  const double knots = velocity.head<2>().norm() / 0.514444;
  double course = std::atan2(velocity.x(), velocity.y()) / deg;
  if (course < 0) course += 360;

  char body[160];
  if (has_fix) {
    std::snprintf(body, sizeof body, "GPGGA,%s,%s,1,%02d,%.1f,%.1f,M,46.0,M,,", time, position.c_str(),
                  satellites, 0.8 / std::max(0.2, open), here.altitude_m);
  } else {
    std::snprintf(body, sizeof body, "GPGGA,%s,,,,,0,%02d,99.9,,M,,M,,", time, satellites / 3);
  }
  append(body);
  // From 1 June 2008 on, a month at most.
  const std::uint32_t day = 1 + (total_s / 86400) % 30;
  if (has_fix) {
    std::snprintf(body, sizeof body, "GPRMC,%s,A,%s,%.2f,%.1f,%02u0608,,,A", time, position.c_str(), knots,
                  course, day);
  } else {
    std::snprintf(body, sizeof body, "GPRMC,%s,V,,,,,,,%02u0608,,,N", time, day);
  }
  append(body);
}

void GpsReceiver::poll(std::int64_t now_ns, SerialOutput& output) {
  const auto latency_ns = static_cast<std::int64_t>(settings_.latency_s * 1e9);
  for (; next_ns_ + latency_ns <= now_ns; next_ns_ += second_ns) {
    text_.clear();
    sentences(next_ns_);
    if (faults_.active(Fault::gps_silent, next_ns_) != nullptr) continue;
    output.write({reinterpret_cast<const std::uint8_t*>(text_.data()), text_.size()}, next_ns_ + latency_ns,
                 settings_.baud_rate);
  }
}

}  // namespace alces::sim
