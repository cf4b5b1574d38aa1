#include "point_channels.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <span>

#include "scan_format.h"

namespace alces::offline {
namespace {

constexpr double longest_scan_s = 10;
constexpr double shortest_scan_s = 1e-3;
constexpr double most_of_interval = 1.5;  ///< a scan may be this long, as a share of the interval

struct Unit {
  std::string_view name;
  double s;
  std::string_view other_name;
};
constexpr std::array<Unit, 4> units = {
    {{"s", 1, "sec"}, {"ms", 1e-3, "msec"}, {"us", 1e-6, "usec"}, {"ns", 1e-9, "nsec"}}};

constexpr std::array<std::string_view, 15> time_names = {
    "t",          "time",       "timestamp",     "time_offset", "offset_time",
    "timeoffset", "offsettime", "t_offset",      "time_stamp",  "times",
    "stamp",      "rel_time",   "relative_time", "gps_time",    "gpstime"};
constexpr std::array<std::string_view, 9> intensity_names = {
    "intensity", "intensities", "reflectivity",     "reflectance", "remission",
    "signal",    "rssi",        "return_intensity", "amplitude"};

/// Lower case, without CloudCompare's prefix; what stands in brackets is left to unit_named().
std::string plain(std::string_view name) {
  std::string text;
  for (const char c : name.substr(0, name.find_first_of("[("))) {
    const char low = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (low == ' ' || low == '-' || low == '.') {
      if (!text.empty() && text.back() != '_') text.push_back('_');
    } else if (low != '/' && low != '#' && low != '"') {
      text.push_back(low);
    }
  }
  while (text.ends_with('_')) text.pop_back();
  if (text.starts_with("scalar_")) text.erase(0, 7);
  return text;
}

const Unit* unit_named(std::string_view name) {
  const std::size_t bracket = name.find_first_of("[(");
  std::string text = plain(name);
  std::string unit;
  if (bracket != std::string_view::npos) {
    for (const char c : name.substr(bracket + 1, name.find_first_of("])") - bracket - 1))
      unit.push_back(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
  } else if (text.find('_') != std::string::npos) {
    unit = text.substr(text.rfind('_') + 1);
  }
  for (const Unit& known : units) {
    if (unit == known.name || unit == known.other_name) return &known;
  }
  return nullptr;
}

std::string without_unit(std::string_view name) {
  std::string text = plain(name);
  if (unit_named(text) != nullptr) text.erase(text.rfind('_'));
  return text;
}

template <std::size_t n>
std::size_t place_in(const std::array<std::string_view, n>& names, const std::string& name) {
  return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
}

std::string_view type_name(NumberType type) {
  constexpr std::array<std::string_view, 10> names = {"int8",   "uint8", "int16",  "uint16", "int32",
                                                      "uint32", "int64", "uint64", "float",  "double"};
  return names.at(static_cast<std::size_t>(type));
}

bool is_whole(NumberType type) {
  return type != NumberType::f32 && type != NumberType::f64;
}

/// Of the points that were measured: a ray without a return often has no time either.
bool is_measured(const Point& point) {
  return is_finite(point) && (point.x != 0 || point.y != 0 || point.z != 0);
}

struct Range {
  double least = INFINITY;
  double most = -INFINITY;
  bool is_finite = true;
  [[nodiscard]] double span() const { return most - least; }
};

Range range_of(const RawChannel& time, std::span<const Point> points) {
  Range range;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!is_measured(points[i])) continue;
    const double value = time.values[i];
    range.is_finite = range.is_finite && std::isfinite(value);
    range.least = std::min(range.least, value);
    range.most = std::max(range.most, value);
  }
  return range;
}

/// Why such times are none, in their unit; empty: they may be right.
std::string why_not(const Range& range, double unit_s, const std::optional<double>& interval_s) {
  if (!range.is_finite) return "some are no numbers";
  if (!(range.span() > 0)) return "they are all the same";
  const double span_s = range.span() * unit_s;
  if (span_s > longest_scan_s) return fmt::format("they span {:.4g} s, and no scan takes 10 s", span_s);
  if (interval_s && span_s > most_of_interval * *interval_s)
    return fmt::format("they span {:.4g} s, and scans come every {:.4g} s", span_s, *interval_s);
  if (span_s < shortest_scan_s) return fmt::format("they span {:.2g} s, and every scan takes longer", span_s);
  return {};
}

/// The unit of dates since 1970, 2001 to 2049, by their size. Some time after a start nanoseconds look like
/// milliseconds of a date; the scan would then take days.
const Unit* unit_of_date(const Range& range) {
  constexpr double half_a_day_s = 43'200;
  for (const Unit& unit : units) {
    const bool is_date = range.least * unit.s > 1e9 && range.least * unit.s < 2.5e9;
    if (is_date && range.span() * unit.s < half_a_day_s) return &unit;
  }
  return nullptr;
}

void decide_time(const RawChannel& time, std::span<const Point> points, const ChannelContext& context,
                 ChannelReading& reading) {
  const Range range = range_of(time, points);
  const std::string what = fmt::format("{} ({})", time.name, type_name(time.type));
  const Unit* unit = unit_of_date(range);
  std::string reason = "a date by its size";
  if (unit == nullptr) {
    unit = unit_named(time.name);
    reason = "by its name";
  }
  if (unit == nullptr) {
    const double limit_s = context.scan_interval_s
                               ? std::min(longest_scan_s, most_of_interval * *context.scan_interval_s)
                               : longest_scan_s;
    for (const Unit& known : units) {
      if (known.s == 1 && is_whole(time.type)) continue;
      if (unit == nullptr && range.span() * known.s <= limit_s) unit = &known;
    }
    reason = "by what a scan takes";
  }
  const std::string why = why_not(range, unit != nullptr ? unit->s : 1, context.scan_interval_s);
  if (!why.empty()) {
    reading.time_text = fmt::format("times in {} are not used: {}", what, why);
    return;
  }
  reading.time_unit_s = unit->s;
  reading.time_text = fmt::format("times from {} in {} {}: {:.4g} s a scan", what, unit->name, reason,
                                  range.span() * unit->s);
}

void decide_intensity(const RawChannel& intensity, std::span<const Point> points, ChannelReading& reading) {
  const std::string what = fmt::format("{} ({})", intensity.name, type_name(intensity.type));
  if (std::all_of(intensity.values.begin(), intensity.values.end(),
                  [](double value) { return value == 0; })) {
    reading.intensity_text = fmt::format("intensities in {} are not used: they are all 0", what);
    return;
  }
  if (intensity.type == NumberType::u8) {
    reading.full_intensity = 255;
    reading.intensity_text = fmt::format("intensity from {}", what);
    return;
  }
  std::vector<double> values;
  std::size_t negative = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!is_measured(points[i]) || !std::isfinite(intensity.values[i])) continue;
    values.push_back(intensity.values[i]);
    negative += intensity.values[i] < 0 ? 1U : 0U;
  }
  if (values.empty() || 2 * negative > values.size()) {
    reading.intensity_text = fmt::format("intensities in {} are not used: {}", what,
                                         values.empty() ? "they are no numbers" : "they are negative");
    return;
  }
  const auto high = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 99 / 100);
  std::nth_element(values.begin(), high, values.end());
  double full = is_whole(intensity.type) || *high > 1 ? 255 : 1;
  if (*high > full) full = 4095;
  if (*high > full) full = 65535;
  while (*high > full && std::isfinite(full)) full *= 2;
  reading.full_intensity = full;
  reading.intensity_text = fmt::format("intensity from {}, 0 to {:.6g}", what, full);
}

void decide(const RawChannels& raw, std::span<const Point> points, const ChannelContext& context,
            ChannelReading& reading) {
  if (std::none_of(points.begin(), points.end(), is_measured)) return;
  if (!raw.time.name.empty()) decide_time(raw.time, points, context, reading);
  if (!raw.intensity.name.empty()) decide_intensity(raw.intensity, points, reading);
  reading.is_decided = true;
}

void take_time(const RawChannel& time, const ChannelContext& context, ChannelReading& reading,
               ScanPoints& out, std::vector<std::string>& warnings) {
  const double unit_s = reading.time_unit_s;
  const Range range = range_of(time, out.points);
  if (!(range.least <= range.most) && range.is_finite) return;  // no points
  const std::string why = why_not(range, unit_s, context.scan_interval_s);
  if (!why.empty()) {
    const std::string reason = why.substr(0, why.find(" span"));
    if (std::find(reading.told.begin(), reading.told.end(), reason) != reading.told.end()) return;
    reading.told.push_back(reason);
    warnings.push_back(
        fmt::format("{}: the times of its points are not used: {}; further scans of which that is so are "
                    "not named",
                    context.name, why));
    return;
  }
  const double least_s = range.least * unit_s;
  const double most_s = range.most * unit_s;
  const double around_s = most_of_interval * (most_s - least_s);
  double zero_s = 0;
  if (least_s < -around_s || most_s > around_s) {
    const bool is_of_stamp = context.stamp_s && std::abs(least_s - *context.stamp_s) < longest_scan_s;
    zero_s = is_of_stamp ? *context.stamp_s : least_s;
    out.clock_s = zero_s;
  }
  out.time_s.reserve(out.points.size());
  for (std::size_t i = 0; i < out.points.size(); ++i) {
    const double at_s = is_measured(out.points[i]) ? time.values[i] * unit_s : least_s;
    out.time_s.push_back(static_cast<float>(at_s - zero_s));
  }
}

void take_intensity(const RawChannel& intensity, const ChannelReading& reading, ScanPoints& out) {
  const double scale = 255 / reading.full_intensity;
  out.intensity.reserve(intensity.values.size());
  for (const double value : intensity.values) {
    const double scaled = std::isfinite(value) ? std::clamp(value * scale, 0.0, 255.0) : 0;
    out.intensity.push_back(static_cast<std::uint8_t>(std::lround(scaled)));
  }
}

}  // namespace

ChannelKind channel_called(std::string_view name) {
  const std::string text = without_unit(name);
  if (place_in(time_names, text) < time_names.size()) return ChannelKind::time;
  if (place_in(intensity_names, text) < intensity_names.size()) return ChannelKind::intensity;
  return ChannelKind::none;
}

std::size_t channel_rank(std::string_view name) {
  const std::string text = without_unit(name);
  return channel_called(name) == ChannelKind::time ? place_in(time_names, text)
                                                   : place_in(intensity_names, text);
}

ChannelFields find_channels(const std::vector<std::string_view>& names) {
  ChannelFields fields;
  const auto take_if_clearer = [&names](std::size_t& field, std::size_t i) {
    if (field == SIZE_MAX || channel_rank(names[i]) < channel_rank(names[field])) field = i;
  };
  for (std::size_t i = 0; i < names.size(); ++i) {
    const ChannelKind kind = channel_called(names[i]);
    if (kind == ChannelKind::time) take_if_clearer(fields.time, i);
    if (kind == ChannelKind::intensity) take_if_clearer(fields.intensity, i);
  }
  return fields;
}

std::string ChannelReading::text() const {
  return time_text + (time_text.empty() || intensity_text.empty() ? "" : "; ") + intensity_text;
}

void take_channels(const RawChannels& raw, const ChannelContext& context, ChannelReading& reading,
                   ScanPoints& out, std::vector<std::string>& warnings) {
  const auto is_there = [&out](const RawChannel& channel) {
    return !channel.name.empty() && !out.points.empty() && channel.values.size() == out.points.size();
  };
  if (!is_there(raw.time) && !is_there(raw.intensity)) return;
  if (!reading.is_decided) decide(raw, out.points, context, reading);
  if (is_there(raw.time) && reading.time_unit_s > 0) take_time(raw.time, context, reading, out, warnings);
  if (is_there(raw.intensity) && reading.full_intensity > 0) take_intensity(raw.intensity, reading, out);
}

void hand_over_channels(const ScanBytes& scan, const RawChannels& raw, ScanPoints& out) {
  ChannelReading alone;
  ChannelReading& reading = scan.reading.channels != nullptr ? *scan.reading.channels : alone;
  take_channels(raw, {scan.file.string(), scan.stamp_s, scan.scan_interval_s}, reading, out, scan.warnings);
}

}  // namespace alces::offline
