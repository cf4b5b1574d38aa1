// NMEA 0183 sentences: a line "$" talker(2) type(3) "," fields "*" checksum (2 hex digits, XOR between $ and
// *). GGA is the fix (time, position, quality, satellites, HDOP, altitude), RMC the recommended minimum
// (time, validity, position, speed); GNS is GGA for several satellite systems. Any talker will do (GP, GL,
// GA, GB, GN).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace alces::nmea {

/// Puts lines together from bytes, split anywhere, and checks them.
class LineAssembler {
 public:
  /// The standard says 82; some receivers write more.
  static constexpr std::size_t maximum_line = 120;

  struct Counters {
    std::uint64_t lines = 0;  ///< good ones
    std::uint64_t checksum_errors = 0;
    std::uint64_t without_checksum = 0;
    std::uint64_t too_long = 0;
    std::uint64_t cut_off = 0;        ///< another one began before the end
    std::uint64_t bytes_skipped = 0;  ///< between lines, and bytes that are no text
    template <class Visitor>
    void visit(Visitor&& visit) const {
      visit("lines", lines);
      visit("checksum_errors", checksum_errors);
      visit("lines_without_checksum", without_checksum);
      visit("lines_too_long", too_long);
      visit("lines_cut_off", cut_off);
      visit("bytes_skipped", bytes_skipped);
    }
  };

  /// A line when this byte completed a good one: what stands between $ and *, valid until the next push().
  [[nodiscard]] std::optional<std::string_view> push(std::uint8_t byte);
  /// The line was lost: what has been begun is forgotten.
  void discard() { is_inside_ = false; }
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  [[nodiscard]] std::optional<std::string_view> finish();

  std::array<char, maximum_line> line_{};
  std::size_t size_ = 0;
  bool is_inside_ = false;
  Counters counters_;
};

enum class SentenceKind : std::uint8_t { gga, gns, rmc };

/// What GGA, GNS and RMC have in common, and what only some of them have.
struct Sentence {
  SentenceKind kind = SentenceKind::gga;
  std::optional<std::int32_t> time_of_day_ms;  ///< UTC
  bool has_position = false;
  double latitude_deg = 0;    ///< north positive
  double longitude_deg = 0;   ///< east positive
  std::uint32_t quality = 0;  ///< GGA: 0 none, 1 GPS, 2 differential, 4 RTK, 5 float, 6 estimated, 7, 8; GNS:
                              ///< as GGA's, of the best system; RMC: 1 if valid
  std::uint32_t satellites = 0;  ///< GGA, GNS
  std::optional<double> hdop;    ///< GGA, GNS
  std::optional<double>
      altitude_m;  ///< GGA, GNS: above the WGS 84 ellipsoid where the geoid's height is given
};

/// Takes a line apart. Nothing: another sentence. is_malformed: it is a GGA, GNS or RMC, but a field cannot
/// be read.
struct ParsedSentence {
  std::optional<Sentence> sentence;
  bool is_malformed = false;
};
[[nodiscard]] ParsedSentence parse(std::string_view line);

}  // namespace alces::nmea
