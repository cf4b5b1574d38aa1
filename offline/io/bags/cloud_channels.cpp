#include "cloud_channels.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "pose_track.h"

namespace alces::offline {
namespace {

constexpr double longest_s = 10;
constexpr double least_epoch_s = 1e8;  // 1973

struct Unit {
  double s;
  const char* name;
};
constexpr std::array<Unit, 4> units = {{{1, "s"}, {1e-3, "ms"}, {1e-6, "us"}, {1e-9, "ns"}}};

const bags::PointField* field_of(const bags::PointCloud2& cloud,
                                 std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names) {
    const bags::PointField* field = cloud.field(name);
    if (field != nullptr && field->type >= 1 && field->type <= 8) return field;
  }
  return nullptr;
}

}  // namespace

CloudChannelFacts look_at_channels(const bags::PointCloud2& cloud, std::int64_t stamp_ns) {
  CloudChannelFacts facts;
  facts.stamp_s = stamp_in_s(stamp_ns);
  std::vector<double> values;
  if (const bags::PointField* field = field_of(
          cloud, {"t", "time", "timestamp", "time_stamp", "time_offset", "offset_time", "t_offset"})) {
    facts.time_field = field->name;
    facts.time_type = field->type;
    bags::read_values(cloud, *field, values);
    facts.has_bad_times = values.empty() || std::any_of(values.begin(), values.end(),
                                                        [](double time) { return !std::isfinite(time); });
    if (!facts.has_bad_times) {
      const auto [first, last] = std::minmax_element(values.begin(), values.end());
      facts.first_time = *first;
      facts.last_time = *last;
    }
  }
  if (const bags::PointField* field =
          field_of(cloud, {"intensity", "i", "reflectivity", "signal", "reflectance"})) {
    facts.intensity_field = field->name;
    facts.intensity_type = field->type;
    bags::read_values(cloud, *field, values);
    std::erase_if(values, [](double value) { return !std::isfinite(value); });
    if (!values.empty()) {
      const auto usual = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) * 99 / 100);
      std::nth_element(values.begin(), usual, values.end());
      facts.usual_intensity = *usual;
    }
  }
  return facts;
}

CloudChannelReading choose_channels(const CloudChannelFacts& facts, double interval_s) {
  CloudChannelReading reading;
  reading.intensity_field = facts.intensity_field;
  constexpr double largest = 255;
  if (facts.intensity_type != 2 && facts.usual_intensity > 0) {
    if (facts.usual_intensity <= 1 && facts.intensity_type >= 7) {
      reading.intensity_scale = largest;
    } else if (facts.usual_intensity > largest) {
      reading.intensity_scale = largest / facts.usual_intensity;
    }
  }
  if (facts.time_field.empty()) return reading;
  const double span = facts.last_time - facts.first_time;
  if (facts.has_bad_times || !(span > 0)) {
    reading.time_problem = facts.has_bad_times ? "some are not finite" : "all are equal";
    return reading;
  }
  // Units are a thousand apart: one fits, or none.
  const double expected_s = interval_s > 0 ? interval_s : 0.1;
  constexpr double shortest_part = 0.02;  // of the time from cloud to cloud: a sensor that looks to one side
  constexpr double longest_part = 2;
  for (const Unit& unit : units) {
    const double lasts_s = span * unit.s;
    if (lasts_s < shortest_part * expected_s || lasts_s > longest_part * expected_s) continue;
    const bool is_since_1970 = facts.last_time * unit.s >= least_epoch_s;
    const double from_stamp_s = facts.first_time * unit.s - (is_since_1970 ? facts.stamp_s : 0);
    if (std::abs(from_stamp_s) > longest_s) {
      reading.time_problem =
          fmt::format("they are {:.3f} s from the clouds' stamps, as of another clock", from_stamp_s);
      return reading;
    }
    reading.time = CloudTimeReading{facts.time_field, unit.s, is_since_1970,
                                    fmt::format("{} {} {}", bags::type_name(facts.time_type), unit.name,
                                                is_since_1970 ? "since 1970" : "from the stamp")};
    return reading;
  }
  reading.time_problem = fmt::format(
      "a cloud spans {:g}, which is in no unit the {:.3g} s from one cloud to the next", span, expected_s);
  return reading;
}

bool read_channels(const bags::PointCloud2& cloud, const CloudChannelReading& reading, std::int64_t stamp_ns,
                   ScanPoints& scan) {
  scan.time_s.clear();
  scan.intensity.clear();
  std::vector<double> values;
  const bags::PointField* intensity =
      reading.intensity_field.empty() ? nullptr : cloud.field(reading.intensity_field);
  if (intensity != nullptr) {
    bags::read_values(cloud, *intensity, values);
    scan.intensity.reserve(values.size());
    for (const double value : values) {
      const double scaled = std::round(value * reading.intensity_scale);
      scan.intensity.push_back(scaled > 0 ? static_cast<std::uint8_t>(std::min(scaled, 255.0))
                                          : std::uint8_t{0});
    }
  }
  const bags::PointField* time = reading.time ? cloud.field(reading.time->field) : nullptr;
  if (time == nullptr) return true;
  bags::read_values(cloud, *time, values);
  const double begin_s = reading.time->is_since_1970 ? stamp_in_s(stamp_ns) : 0;
  scan.time_s.reserve(values.size());
  for (const double value : values) {
    const double from_stamp_s = value * reading.time->unit_s - begin_s;
    if (!(std::abs(from_stamp_s) <= longest_s)) {
      scan.time_s.clear();
      return false;
    }
    scan.time_s.push_back(static_cast<float>(from_stamp_s));
  }
  return true;
}

}  // namespace alces::offline
