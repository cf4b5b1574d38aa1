// A GPS receiver that writes NMEA 0183: positions for loop detection, which needs them roughly right and
// never absurd.
//
// Fixes come from GGA; from GNS when no GGA came for `gga_silence_ns`; from RMC when neither did (then
// without altitude: the last one stays). A fix is believed when its quality, satellites and HDOP are good
// enough, it does not lie at 0 N 0 E (what receivers write when they know nothing), its time goes on, and it
// can be reached from the last one at `maximum_speed_m_s`. A receiver that insists on a jump (`jump_patience`
// fixes in a row that agree with each other) is believed again.
//
// A receiver that gives no usable fix is told with what comes instead: nothing, noise, UBX, lines without a
// checksum, sentences without a position, or a receiver that has no fix.
//
// The history is thinned: its fixes are at least `history_spacing_ns` apart, so that it reaches as far back
// at any rate.
//
// Memory: about 4 KiB.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "alces_drivers/gps/gps_position.h"
#include "alces_drivers/gps/local_plane.h"
#include "alces_drivers/gps/nmea.h"
#include "alces_drivers/port/notice_port.h"
#include "alces_drivers/stamp.h"

namespace alces {

struct GpsConfig {
  const char* name = "gps";                    ///< in notices; static storage
  std::int64_t delay_ns = 0;                   ///< from the fix's time to its line's last byte
  std::int64_t maximum_age_ns = 2 * ns_per_s;  ///< of a fix; after five times that without one it is told
  std::int64_t gga_silence_ns = 5 * ns_per_s;
  std::uint32_t minimum_satellites = 4;
  double maximum_hdop = 6;
  double maximum_speed_m_s = 40;
  double jump_slack_m = 25;  ///< a jump is more than this beyond what the speed allows
  std::uint32_t jump_patience = 10;
  bool accepts_simulated = false;  ///< quality 6, 7, 8: estimated, manual input, simulator
};

/// What is wrong with it; null: nothing.
[[nodiscard]] const char* validate(const GpsConfig& config);

struct GpsFix {
  std::int64_t stamp_ns = 0;
  Geodetic position;
  Eigen::Vector3d enu_m = Eigen::Vector3d::Zero();  ///< east, north, up of the first believed fix
  std::uint32_t quality = 0;
  std::uint32_t satellites = 0;
  double hdop = 0;  ///< 0: not given
};

class Gps final : public GpsPosition {
 public:
  static constexpr std::uint32_t history = 32;  ///< fixes kept for position_at()
  static constexpr std::int64_t history_spacing_ns = 100 * ns_per_ms;

  struct Counters {
    std::uint64_t fixes = 0;              ///< believed
    std::uint64_t sentences_ignored = 0;  ///< other than GGA, GNS and RMC; GNS and RMC beside a better one
    std::uint64_t sentences_malformed = 0;
    std::uint64_t without_fix = 0;
    std::uint64_t bad_quality = 0;  ///< too few satellites, HDOP, estimated or simulated
    std::uint64_t at_zero = 0;      ///< 0 N 0 E
    std::uint64_t jumps = 0;
    std::uint64_t time_backwards = 0;  ///< its own time, or ours, did not go on
    std::uint64_t jumps_believed = 0;  ///< after patience
    std::uint64_t ubx_messages = 0;    ///< beginnings of them: binary, not read
    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("fixes", fixes);
      visit("sentences_ignored", sentences_ignored);
      visit("sentences_malformed", sentences_malformed);
      visit("without_fix", without_fix);
      visit("fixes_of_bad_quality", bad_quality);
      visit("fixes_at_zero", at_zero);
      visit("jumps", jumps);
      visit("time_backwards", time_backwards);
      visit("jumps_believed", jumps_believed);
      visit("ubx_messages", ubx_messages);
    }
  };

  Gps(const GpsConfig& config, NoticePort& notices);

  /// Bytes in the order they came; `stamp_ns`: when the last of them did.
  void on_bytes(std::span<const std::uint8_t> bytes, std::int64_t stamp_ns);
  void on_link(bool is_up, std::int64_t now_ns);
  /// Tells when fixes do not come, or stop coming, and what comes instead.
  void on_tick(std::int64_t now_ns);

  /// At least (history - 1) * history_spacing_ns back: 3.1 s.
  [[nodiscard]] std::optional<Eigen::Vector3d> position_at(std::int64_t stamp_ns,
                                                           std::int64_t maximum_age_ns) const override;
  [[nodiscard]] std::optional<GpsFix> newest() const;
  [[nodiscard]] const Counters& counters() const { return counters_; }
  [[nodiscard]] const nmea::LineAssembler::Counters& line_counters() const { return lines_.counters(); }

 private:
  /// What came since a time; by the difference one sees what comes instead of fixes.
  struct Traffic {
    std::uint64_t bytes = 0;
    std::uint64_t damaged = 0;           ///< lines with a wrong checksum, cut off or too long
    std::uint64_t without_checksum = 0;  ///< lines
    std::uint64_t lines = 0;             ///< good ones
    std::uint64_t positions = 0;         ///< sentences of the kinds that are read, with a position or without
    std::uint64_t without_fix = 0;       ///< of them
    std::uint64_t ubx = 0;
  };
  [[nodiscard]] Traffic traffic() const;
  void watch_traffic(std::int64_t now_ns);
  [[nodiscard]] const char* what_comes_instead(const Traffic& since, bool is_fix_overdue) const;
  [[nodiscard]] bool is_second_rate(const nmea::Sentence& sentence, std::int64_t stamp_ns);

  void on_sentence(const nmea::Sentence& sentence, std::int64_t stamp_ns);
  [[nodiscard]] bool is_good_enough(const nmea::Sentence& sentence);
  [[nodiscard]] bool is_reachable(const GpsFix& from, const GpsFix& to) const;
  [[nodiscard]] bool is_plausible(const GpsFix& fix, std::int64_t now_ns);
  void keep(const GpsFix& fix, std::int64_t now_ns);
  void raise(std::int64_t now_ns, Severity severity, const char* text);
  [[nodiscard]] const GpsFix& fix(std::uint32_t age) const;  ///< 0: the newest

  GpsConfig config_;
  NoticePort& notices_;
  nmea::LineAssembler lines_;
  std::optional<LocalPlane> plane_;
  std::array<GpsFix, history> fixes_{};
  std::uint32_t fix_count_ = 0;
  std::uint32_t newest_ = 0;
  GpsFix jumped_;                             ///< the last one that was not believed for its place
  std::uint32_t jumped_count_ = 0;            ///< that agree with each other, in a row
  std::optional<std::int32_t> last_time_ms_;  ///< of the last believed fix
  std::int64_t last_gga_ns_ = no_stamp_ns;
  std::int64_t last_gns_ns_ = no_stamp_ns;
  std::int64_t ticked_ns_ = no_stamp_ns;
  double height_m_ = 0;
  bool is_lost_ = false;
  std::uint8_t last_byte_ = 0;
  std::uint64_t bytes_ = 0;
  std::uint64_t positions_ = 0;
  Traffic traffic_before_;  ///< when the watch's time began
  std::int64_t watched_since_ns_ = no_stamp_ns;
  std::int64_t fixless_since_ns_ = no_stamp_ns;
  const char* told_instead_ = nullptr;  ///< since the last fix
  Counters counters_;
};

}  // namespace alces
