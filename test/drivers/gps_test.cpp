#include "alces_drivers/gps/gps.h"

#include <catch2/catch.hpp>
#include <cstdio>
#include <string>
#include <vector>

#include "alces_platform/sim/random.h"

using alces::Gps;
using alces::GpsConfig;
using alces::ns_per_s;

namespace {

std::string line(const std::string& content) {
  unsigned sum = 0;
  for (const char character : content) sum ^= static_cast<unsigned char>(character);
  char checksum[8];
  std::snprintf(checksum, sizeof checksum, "*%02X\r\n", sum);
  return "$" + content + checksum;
}

/// A GGA line; seconds since midnight, position in degrees.
std::string gga(double time_s, double latitude_deg, double longitude_deg, int quality = 1, int satellites = 8,
                double hdop = 1.0) {
  const auto part = [](double deg) {
    return static_cast<int>(deg) * 100 + (deg - static_cast<int>(deg)) * 60;
  };
  const int whole = static_cast<int>(time_s);
  char text[160];
  std::snprintf(text, sizeof text, "GNGGA,%02d%02d%05.2f,%012.7f,%c,%013.7f,%c,%d,%02d,%.1f,50.0,M,46.0,M,,",
                whole / 3600, whole / 60 % 60, time_s - whole / 60 * 60, part(std::abs(latitude_deg)),
                latitude_deg < 0 ? 'S' : 'N', part(std::abs(longitude_deg)), longitude_deg < 0 ? 'W' : 'E',
                quality, satellites, hdop);
  return line(text);
}

struct Rig final : alces::NoticePort {
  explicit Rig(const GpsConfig& config = {}) : gps(config, *this) {}
  void raise(const alces::Notice& notice) override { notices.emplace_back(notice.text); }
  void feed(const std::string& text, std::int64_t stamp_ns) {
    gps.on_bytes({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, stamp_ns);
  }
  Gps gps;
  std::vector<std::string> notices;
};

constexpr double home_deg[2] = {52.3849, 9.7126};
constexpr double north_m_per_deg = 111'264;  // at 52.38 N

}  // namespace

TEST_CASE("known lines are read, whoever talks and however they are split") {
  // Receivers' manuals print these.
  const std::string text =
      "$GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,*76\r\n"
      "$GPGSV,3,1,11,10,63,137,17,07,61,098,15,05,59,290,20,08,54,157,30*70\r\n";
  Rig rig;
  for (const char character : text) rig.feed(std::string(1, character), ns_per_s);
  CHECK(rig.gps.line_counters().lines == 2);
  CHECK(rig.gps.line_counters().checksum_errors == 0);
  CHECK(rig.gps.counters().sentences_ignored == 1);
  const auto fix = rig.gps.newest();
  REQUIRE(fix);
  CHECK(fix->position.latitude_deg == Approx(53 + 21.6802 / 60).epsilon(1e-12));
  CHECK(fix->position.longitude_deg == Approx(-(6 + 30.3372 / 60)).epsilon(1e-12));
  CHECK(fix->position.height_m == Approx(116.9));
  CHECK(fix->satellites == 8);
  CHECK(fix->hdop == Approx(1.03));
  CHECK(fix->enu_m.norm() == 0);
}

TEST_CASE("lines that are damaged, endless or cut off are counted and left out") {
  Rig rig;
  std::string damaged = gga(1, home_deg[0], home_deg[1]);
  damaged[20] = '9';
  rig.feed(damaged, ns_per_s);
  CHECK(rig.gps.line_counters().checksum_errors == 1);
  rig.feed("$GPGGA,1,2,3\r\n", ns_per_s);
  CHECK(rig.gps.line_counters().without_checksum == 1);
  rig.feed("$" + std::string(500, 'A') + "\r\n", ns_per_s);
  CHECK(rig.gps.line_counters().too_long == 1);
  rig.feed("$GPGGA,092750", ns_per_s);
  rig.feed(gga(1, home_deg[0], home_deg[1]), ns_per_s);
  CHECK(rig.gps.line_counters().cut_off == 1);
  CHECK(rig.gps.counters().fixes == 1);
  rig.feed("\xff\x00\x02", 2 * ns_per_s);
  CHECK(rig.gps.line_counters().bytes_skipped > 2);
  for (const char* content : {"GPGGA,x,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,", "GPGGA,,,,,,",
                              "GPGGA,092751,9921.6802,N,00630.3372,W,1,8,1,61.7,M,55.2,M,,",
                              "GPGGA,092751,5361.6802,N,00630.3372,W,1,8,1,61.7,M,55.2,M,,",
                              "GPGGA,092751,5321.6802,X,00630.3372,W,1,8,1,61.7,M,55.2,M,,",
                              "GPGGA,092751,5321.6802,N,00630.3372,W,-1,8,1,61.7,M,55.2,M,,",
                              "GPGGA,092751,5321.6802,N,00630.3372,W,,8,1,61.7,M,55.2,M,,",
                              "GPRMC,246060,A,5321.6802,N,00630.3372,W,0.02,31.66,280511,,,A"}) {
    CAPTURE(content);
    const auto before = rig.gps.counters().sentences_malformed;
    rig.feed(line(content), 3 * ns_per_s);
    CHECK(rig.gps.counters().sentences_malformed == before + 1);
  }
  CHECK(rig.gps.counters().fixes == 1);
}

TEST_CASE("random text is survived") {
  alces::sim::Random random(4);
  Rig rig;
  const std::string alphabet = "$*GPGGARMC,,,..0123456789NSEWM\r\n";
  std::string text;
  for (int i = 0; i < 200'000; ++i) {
    text += alphabet[static_cast<std::size_t>(random.integer(0, static_cast<int>(alphabet.size()) - 1))];
  }
  rig.feed(text, ns_per_s);
  for (int i = 0; i < 5000; ++i) {
    std::string content = "GPGGA,";
    for (int n = random.integer(0, 60); n > 0; --n)
      content += alphabet[static_cast<std::size_t>(random.integer(8, 29))];
    rig.feed(line(content), 2 * ns_per_s);
  }
  CHECK(rig.gps.counters().fixes == 0);
  CHECK(rig.gps.counters().sentences_malformed > 1000);
}

TEST_CASE("the local plane is metric on the ellipsoid") {
  const alces::LocalPlane plane({52, 9, 100});
  // A meridian's and a parallel's radius of curvature at 52 deg: 6375 km and 6391.9 km.
  const Eigen::Vector3d north = plane.enu_from_geodetic({52.001, 9, 100});
  CHECK(north.y() == Approx(111.2668).epsilon(1e-4));
  CHECK(std::abs(north.x()) < 1e-6);
  const Eigen::Vector3d east = plane.enu_from_geodetic({52, 9.001, 100});
  CHECK(east.x() == Approx(68.6785).epsilon(1e-4));
  const Eigen::Vector3d up = plane.enu_from_geodetic({52, 9, 107});
  CHECK((up - Eigen::Vector3d(0, 0, 7)).norm() < 1e-6);
  CHECK((alces::ecef_from_geodetic({90, 0, 0}) - Eigen::Vector3d(0, 0, 6356752.3142)).norm() < 1e-3);
  CHECK((alces::ecef_from_geodetic({0, 90, 0}) - Eigen::Vector3d(0, 6378137, 0)).norm() < 1e-3);
}

TEST_CASE("a position at a time lies between two fixes, is the nearest one for a while, and then none") {
  Rig rig;
  constexpr std::int64_t age_ns = 2 * ns_per_s;
  CHECK_FALSE(rig.gps.position_at(0, age_ns));
  for (int n = 0; n < 50; ++n) {
    rig.feed(gga(100 + n, home_deg[0] + 10.0 * n / north_m_per_deg, home_deg[1]), (100 + n) * ns_per_s);
  }
  CHECK(rig.gps.counters().fixes == 50);
  const auto between = rig.gps.position_at(125 * ns_per_s + ns_per_s / 4, age_ns);
  REQUIRE(between);
  CHECK(between->y() == Approx(252.5).epsilon(1e-3));
  CHECK(rig.gps.position_at(149 * ns_per_s + ns_per_s, age_ns)->y() == Approx(490).epsilon(1e-3));
  CHECK_FALSE(rig.gps.position_at(152 * ns_per_s, age_ns));
  CHECK(rig.gps.position_at(152 * ns_per_s, 2 * age_ns));
  CHECK_FALSE(rig.gps.position_at(105 * ns_per_s, age_ns));  // older than the history
  rig.feed(gga(160, home_deg[0] + 600.0 / north_m_per_deg, home_deg[1]), 160 * ns_per_s);
  CHECK_FALSE(rig.gps.position_at(155 * ns_per_s, age_ns));  // across an outage nothing is interpolated
  CHECK(rig.gps.position_at(159 * ns_per_s, age_ns)->y() == Approx(600).epsilon(1e-3));
}

TEST_CASE("at any rate of the receiver a position three seconds back lies between the fixes of that time") {
  const int rate_hz = GENERATE(1, 5, 10, 20, 50);
  Rig rig;
  const auto north_m = [](double t_s) { return 2 * t_s + 3 * std::sin(t_s); };
  double now_s = 100;
  for (int n = 0; n < 10 * rate_hz; ++n) {
    now_s = 100 + static_cast<double>(n) / rate_hz;
    rig.feed(gga(now_s, home_deg[0] + north_m(now_s) / north_m_per_deg, home_deg[1]),
             std::llround(now_s * 1e9));
  }
  CHECK(rig.gps.counters().fixes == 10U * static_cast<unsigned>(rate_hz));
  CHECK(rig.gps.newest()->stamp_ns == std::llround(now_s * 1e9));
  for (double back_s = 0; back_s < 3.0; back_s += 0.13) {
    const auto position = rig.gps.position_at(std::llround((now_s - back_s) * 1e9), 2 * ns_per_s);
    REQUIRE(position);
    // Between fixes a second apart the curve's sagitta is 3 / 8 m.
    const double margin_m = rate_hz == 1 ? 0.4 : 0.06;
    CHECK(position->y() == Approx(north_m(now_s - back_s) - north_m(100)).margin(margin_m));
  }
}

TEST_CASE("absurd fixes are not believed, each for its reason") {
  Rig rig;
  std::int64_t now_s = 1000;
  const auto feed = [&](const std::string& text) { rig.feed(text, now_s++ * ns_per_s); };
  const auto time = [&] { return static_cast<double>(now_s); };
  feed(gga(time(), home_deg[0], home_deg[1]));
  feed(gga(time(), home_deg[0], home_deg[1], 0));
  feed(line("GPGGA,001641.00,,,,,0,00,99.9,,,,,,"));
  CHECK(rig.gps.counters().without_fix == 2);
  feed(gga(time(), home_deg[0], home_deg[1], 1, 3));
  feed(gga(time(), home_deg[0], home_deg[1], 1, 8, 20));
  feed(gga(time(), home_deg[0], home_deg[1], 8));
  CHECK(rig.gps.counters().bad_quality == 3);
  feed(gga(time(), 0, 0));
  CHECK(rig.gps.counters().at_zero == 1);
  feed(gga(time(), home_deg[0] + 1, home_deg[1]));
  CHECK(rig.gps.counters().jumps == 1);
  feed(gga(900, home_deg[0], home_deg[1]));
  CHECK(rig.gps.counters().time_backwards == 1);
  CHECK(rig.gps.counters().fixes == 1);
  feed(gga(time(), home_deg[0], home_deg[1]));
  CHECK(rig.gps.counters().fixes == 2);
}

TEST_CASE("a receiver that insists on a jump is believed in the end, one that hops about is not") {
  Rig rig;
  rig.feed(gga(100, home_deg[0], home_deg[1]), 100 * ns_per_s);
  alces::sim::Random random(8);
  for (int n = 101; n < 131; ++n) {
    rig.feed(gga(n, home_deg[0] + random.uniform(0.1, 5), home_deg[1]), n * ns_per_s);
  }
  CHECK(rig.gps.counters().fixes == 1);
  for (int n = 131; n < 145; ++n) rig.feed(gga(n, home_deg[0] + 0.05, home_deg[1]), n * ns_per_s);
  CHECK(rig.gps.counters().jumps_believed == 1);
  CHECK(rig.gps.counters().fixes > 1);
  CHECK(rig.gps.newest()->enu_m.y() == Approx(0.05 * north_m_per_deg).epsilon(1e-3));
}

TEST_CASE("midnight is no time running backwards, RMC serves where there is no GGA") {
  Rig rig;
  rig.feed(gga(86399, home_deg[0], home_deg[1]), 10 * ns_per_s);
  rig.feed(gga(0, home_deg[0], home_deg[1]), 11 * ns_per_s);
  CHECK(rig.gps.counters().fixes == 2);
  const std::string rmc = "GPRMC,000001.00,A,5223.0940,N,00942.7560,E,0.02,31.66,280511,,,A";
  rig.feed(line(rmc), 12 * ns_per_s);
  CHECK(rig.gps.counters().fixes == 2);
  Rig alone;
  alone.feed(line(rmc), 12 * ns_per_s);
  CHECK(alone.gps.counters().fixes == 1);
  CHECK(alone.gps.newest()->position.latitude_deg == Approx(52.3849).epsilon(1e-9));
  alone.feed(line("GPRMC,000002.00,V,,,,,,,280511,,,N"), 13 * ns_per_s);
  CHECK(alone.gps.counters().without_fix == 1);
}

TEST_CASE("GNS serves where there is no GGA, with the best system's quality") {
  Rig rig;
  rig.feed(line("GNGNS,000001.00,5223.0940,N,00942.7560,E,ANN,09,1.1,50.0,46.0,,"), 12 * ns_per_s);
  REQUIRE(rig.gps.newest());
  CHECK(rig.gps.newest()->position.latitude_deg == Approx(52.3849).epsilon(1e-9));
  CHECK(rig.gps.newest()->position.height_m == Approx(96));
  CHECK(rig.gps.newest()->satellites == 9);
  CHECK(rig.gps.newest()->hdop == Approx(1.1));
  CHECK(rig.gps.newest()->quality == 1);
  const auto quality_of = [](const char* modes) {
    const auto parsed = alces::nmea::parse(std::string("GNGNS,000002.00,5223.0940,N,00942.7560,E,") + modes +
                                           ",09,1.1,50.0,46.0,,");
    return parsed.sentence ? static_cast<int>(parsed.sentence->quality) : -1;
  };
  CHECK(quality_of("NN") == 0);
  CHECK(quality_of("AD") == 2);
  CHECK(quality_of("ARF") == 4);
  CHECK(quality_of("NS") == 8);
  CHECK(quality_of("EA") == 1);
  CHECK(quality_of("AX") == -1);
  CHECK(quality_of("") == -1);
  rig.feed(line("GNGNS,000002.00,,,,,NN,00,99.9,,,,"), 13 * ns_per_s);
  CHECK(rig.gps.counters().without_fix == 1);
  // RMC beside GNS, and GNS beside GGA, are second-rate.
  rig.feed(line("GNRMC,000003.00,A,5223.0940,N,00942.7560,E,0.02,31.66,280511,,,A"), 14 * ns_per_s);
  CHECK(rig.gps.counters().sentences_ignored == 1);
  rig.feed(gga(4, home_deg[0], home_deg[1]), 15 * ns_per_s);
  rig.feed(line("GNGNS,000005.00,5223.0940,N,00942.7560,E,AN,09,1.1,50.0,46.0,,"), 16 * ns_per_s);
  CHECK(rig.gps.counters().sentences_ignored == 2);
  CHECK(rig.gps.counters().fixes == 2);
}

TEST_CASE("a receiver that never gives a usable fix is told, with what comes instead") {
  struct Case {
    const char* told;
    std::string text;  ///< a second
    double within_s;
  };
  alces::sim::Random random(3);
  std::string noise;  // text at another rate: bytes of every value, no line
  for (int i = 0; i < 200; ++i) noise += static_cast<char>(random.integer(0, 255));
  std::string bare = gga(100, home_deg[0], home_deg[1]);
  bare = bare.substr(0, bare.find('*')) + "\r\n";
  std::string damaged = gga(100, home_deg[0], home_deg[1]);
  damaged[12] = 'x';
  const std::vector<Case> cases{
      {"nothing comes from the receiver", "", 21},
      {"what comes from the receiver is no NMEA: is the baud rate right?", noise, 21},
      {"what comes from the receiver is no NMEA: is the baud rate right?", damaged, 21},
      {"the receiver speaks UBX", "\xB5\x62\x01\x07\x5c" + std::string(94, '\x11'), 21},
      {"the receiver's lines have no checksum", bare, 21},
      {"no sentence has a position", line("GPGSV,1,1,01,10,63,137,17"), 21},
      {"the receiver has no fix", gga(100, home_deg[0], home_deg[1], 0), 81},
      {"the receiver's fixes are not believed", gga(100, home_deg[0], home_deg[1], 1, 3), 81},
  };
  for (const Case& each : cases) {
    CAPTURE(each.told);
    Rig rig;
    double told_s = 0;
    for (int ms = 0; ms < 300'000; ms += 20) {
      const std::int64_t now_ns = (1000 + ms) * alces::ns_per_ms;
      if (ms % 1000 == 0 && !each.text.empty()) rig.feed(each.text, now_ns);
      rig.gps.on_tick(now_ns);
      if (told_s == 0 && !rig.notices.empty()) told_s = ms * 1e-3;
    }
    REQUIRE(rig.notices.size() == 1);
    CHECK(rig.notices[0].find(each.told) == 0);
    CHECK(told_s <= each.within_s);
  }
}

TEST_CASE("of a receiver that does its work nothing is told, and what comes after an outage is told anew") {
  Rig rig;
  const auto run = [&](int from_s, int to_s, bool has_fixes) {
    for (int ms = from_s * 1000; ms < to_s * 1000; ms += 20) {
      if (ms % 1000 == 0 && has_fixes)
        rig.feed(gga(ms / 1000, home_deg[0], home_deg[1]), ms * alces::ns_per_ms);
      rig.gps.on_tick(ms * alces::ns_per_ms);
    }
  };
  run(100, 400, true);
  CHECK(rig.notices == std::vector<std::string>{"first fix"});
  run(400, 450, false);
  run(450, 500, true);
  run(500, 550, false);
  const std::string silent = "nothing comes from the receiver: is it powered and connected to this line?";
  CHECK(rig.notices == std::vector<std::string>{"first fix", "no usable fix comes", silent,
                                                "fixes come again", "no usable fix comes", silent});
}

TEST_CASE("an outage is told once, what comes instead, and its end") {
  Rig rig;
  rig.feed(gga(100, home_deg[0], home_deg[1]), 100 * ns_per_s);
  for (int n = 100; n < 200; ++n) rig.gps.on_tick(n * ns_per_s);
  CHECK(rig.notices == std::vector<std::string>{
                           "first fix", "no usable fix comes",
                           "nothing comes from the receiver: is it powered and connected to this line?"});
  rig.feed(gga(200, home_deg[0], home_deg[1]), 200 * ns_per_s);
  CHECK(rig.notices.back() == "fixes come again");
  CHECK(alces::validate(GpsConfig{}) == nullptr);
  CHECK(alces::validate(GpsConfig{.maximum_speed_m_s = 0}) != nullptr);
}
