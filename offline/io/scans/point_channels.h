// What fields beside x y z mean: times and intensities of points, by a field's name, type and range.
//
// Names: t, time, timestamp, time_offset, offset_time, gps_time, ...; intensity, reflectivity, reflectance,
// signal, ...; in any case, with CloudCompare's scalar_ in front and a unit behind (time_ns, "t [us]").
//
// Times. A value that is a date since 1970 has its unit by its size. Else the unit is the one in the name;
// else the largest of s, ms, us, ns in which a scan is no longer than the interval between scans, or than 10
// s where that is not known; whole numbers are no seconds. Values around 0 count from the scan's stamp,
// others are of a clock: the scan's own if the stamp is within 10 s, else that of the points
// (ScanPoints::clock_s).
//
// Intensities become 0 to 255. Bytes stay. Else full is the smallest of 1 (no whole numbers), 255, 4095,
// 65535 and further powers of two that 99 % of the points do not exceed; what does is 255.
//
// Unit and scale are found with the first scan and hold for all. Times that cannot be right are not used, and
// that is told: not finite, all the same, a scan longer than the interval or 10 s, shorter than 1 ms.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "offline/io/files/binary_number.h"
#include "scan_points.h"

namespace alces::offline {

enum class ChannelKind : std::uint8_t { none, time, intensity };

/// Of a field or column of that name.
[[nodiscard]] ChannelKind channel_called(std::string_view name);
/// Of several fields of one kind the lowest is taken: a name says more or less clearly what it is.
[[nodiscard]] std::size_t channel_rank(std::string_view name);

/// As in the file, one value a point; no name: there is no such field.
struct RawChannel {
  std::string name = {};
  NumberType type = NumberType::f64;
  std::vector<double> values = {};
};

struct RawChannels {
  RawChannel time;
  RawChannel intensity;
};

/// Which of the fields `names` are channels; one of names.size() and beyond: none.
struct ChannelFields {
  std::size_t time = SIZE_MAX;
  std::size_t intensity = SIZE_MAX;
};
[[nodiscard]] ChannelFields find_channels(const std::vector<std::string_view>& names);

/// How the channels of all scans of an input are read.
struct ChannelReading {
  bool is_decided = false;
  double time_unit_s = 0;              ///< 0: times are not used
  double full_intensity = 0;           ///< 0: intensities are not used
  std::string time_text = {};          ///< for people: what was taken and why, or why not; empty: no field
  std::string intensity_text = {};     ///< the same
  std::vector<std::string> told = {};  ///< reasons that a scan was named for already

  /// "times from t (uint32, ns: ...), intensity from ..."; empty: there are no channels.
  [[nodiscard]] std::string text() const;
};

/// What is known of the scan whose channels are read.
struct ChannelContext {
  std::string name;                            ///< for warnings
  std::optional<double> stamp_s = {};          ///< of the scan
  std::optional<double> scan_interval_s = {};  ///< usual, between scans; none: not known
};

/// Fills time_s, clock_s and intensity of `out`, whose points are there already, from one value a point.
/// `reading` is decided first where it is not. Why times of this scan are not used goes to `warnings`, once
/// for each reason.
void take_channels(const RawChannels& raw, const ChannelContext& context, ChannelReading& reading,
                   ScanPoints& out, std::vector<std::string>& warnings);

}  // namespace alces::offline
