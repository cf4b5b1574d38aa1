// Messages that are clouds in another form, made a PointCloud2: Livox's CustomMsg, and a 2D laser's profile.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "alces_platform/bags/point_cloud.h"

namespace alces::bags {
namespace {

constexpr std::uint8_t float32 = 7;

/// A field of a message's definition: "uint8[3] rsvd".
struct DefinedField {
  std::string type;  ///< without brackets
  std::string name;
  bool is_sequence = false;
  std::size_t length = 1;  ///< of an array of fixed length
};

/// The fields of `message` ("" for the first) in a definition as bags have it.
std::vector<DefinedField> fields_of(std::string_view definition, std::string_view message) {
  std::vector<DefinedField> fields;
  bool is_in = message.empty();
  while (!definition.empty()) {
    const std::size_t end = std::min(definition.find('\n'), definition.size());
    std::string_view line = definition.substr(0, end);
    definition.remove_prefix(std::min(end + 1, definition.size()));
    line = line.substr(0, line.find('#'));
    if (line.starts_with("====")) {
      if (is_in) break;
      continue;
    }
    if (line.starts_with("MSG:")) {
      const std::size_t last = line.find_last_not_of(" \t\r");
      is_in = line.substr(0, last + 1).ends_with(message);
      continue;
    }
    const std::size_t begin = line.find_first_not_of(" \t\r");
    const std::size_t space = begin == std::string_view::npos ? begin : line.find_first_of(" \t", begin);
    if (!is_in || space == std::string_view::npos || line.find('=') != std::string_view::npos) continue;
    const std::size_t name = line.find_first_not_of(" \t", space);
    if (name == std::string_view::npos) continue;
    DefinedField field;
    field.type = line.substr(begin, space - begin);
    field.name = line.substr(name, line.find_first_of(" \t\r", name) - name);
    if (const std::size_t bracket = field.type.find('['); bracket != std::string::npos) {
      const std::string inside = field.type.substr(bracket + 1, field.type.size() - bracket - 2);
      field.is_sequence = inside.empty();
      field.length =
          inside.empty() || inside.size() > 6 ? 0 : static_cast<std::size_t>(std::atoi(inside.c_str()));
      field.type.resize(bracket);
    }
    fields.push_back(field);
  }
  return fields;
}

/// PointField's number; 0: a type that a point does not have.
std::uint8_t field_type(const std::string& type) {
  constexpr std::array<const char*, 9> names = {"",      "int8",   "uint8",   "int16",  "uint16",
                                                "int32", "uint32", "float32", "float64"};
  for (std::size_t i = 1; i < names.size(); ++i) {
    if (type == names.at(i)) return static_cast<std::uint8_t>(i);
  }
  return type == "byte" ? 1 : type == "char" || type == "bool" ? 2 : 0;
}

template <typename Number>
void append(std::vector<std::uint8_t>& bytes, Number value) {
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof value);
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

void copy_number(MessageCursor& message, std::uint8_t type, std::vector<std::uint8_t>& bytes) {
  switch (type) {
    case 1:
    case 2:
      return append(bytes, message.number<std::uint8_t>());
    case 3:
    case 4:
      return append(bytes, message.number<std::uint16_t>());
    case 5:
    case 6:
      return append(bytes, message.number<std::uint32_t>());
    case 7:
      return append(bytes, message.number<float>());
    default:
      return append(bytes, message.number<double>());
  }
}

/// As both of Livox's drivers have it.
constexpr const char* livox_definition =
    "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\nCustomPoint[] "
    "points\n"
    "====\nMSG: livox/CustomPoint\nuint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 "
    "reflectivity\nuint8 tag\n"
    "uint8 line\n";

std::optional<PointCloud2> read_livox(const Channel& channel, MessageCursor message,
                                      std::vector<std::uint8_t>& room) {
  const std::string_view definition =
      channel.definition.empty() ? std::string_view(livox_definition) : std::string_view(channel.definition);
  PointCloud2 cloud;
  std::size_t point_bytes = 0;
  for (const DefinedField& point : fields_of(definition, "/CustomPoint")) {
    const std::uint8_t type = field_type(point.type);
    if (type == 0 || point.is_sequence || point.length != 1) return std::nullopt;
    cloud.fields.push_back({point.name, static_cast<std::uint32_t>(point_bytes), type, 1});
    constexpr std::array<std::uint8_t, 9> bytes = {0, 1, 1, 2, 2, 4, 4, 4, 8};
    point_bytes += bytes.at(type);
  }
  if (point_bytes == 0) return std::nullopt;
  for (const DefinedField& field : fields_of(definition, "")) {
    if (field.type.ends_with("Header")) {
      cloud.header = message.header();
    } else if (field.type.ends_with("CustomPoint") && field.is_sequence) {
      const std::uint32_t count = message.count(point_bytes);
      room.clear();
      room.reserve(count * point_bytes);
      for (std::uint32_t i = 0; i < count && !message.failed(); ++i) {
        for (const PointField& point : cloud.fields) copy_number(message, point.type, room);
      }
      cloud.height = 1;
      cloud.width = count;
      cloud.point_step = static_cast<std::uint32_t>(point_bytes);
    } else if (field.type == "uint64" || field.type == "int64") {
      for (std::size_t i = 0; i < field.length; ++i) static_cast<void>(message.number<std::uint64_t>());
    } else {
      const std::uint8_t type = field_type(field.type);
      if (type == 0 || field.is_sequence) return std::nullopt;
      std::vector<std::uint8_t> passed_over;
      for (std::size_t i = 0; i < field.length && !message.failed(); ++i)
        copy_number(message, type, passed_over);
    }
  }
  if (message.failed()) return std::nullopt;
  cloud.data = room;
  return cloud;
}

/// Rays that nothing came back of, or out of the laser's range, are NaN.
std::optional<PointCloud2> read_profile(MessageCursor message, std::vector<std::uint8_t>& room) {
  const std::optional<LaserScan> scan = read_laser_scan(message);
  if (!scan) return std::nullopt;
  const bool has_intensity = scan->intensities.size() == scan->ranges_m.size();
  PointCloud2 cloud;
  cloud.header = scan->header;
  cloud.fields = {{"x", 0, float32, 1}, {"y", 4, float32, 1}, {"z", 8, float32, 1}, {"time", 12, float32, 1}};
  if (has_intensity) cloud.fields.push_back({"intensity", 16, float32, 1});
  cloud.point_step = has_intensity ? 20 : 16;
  cloud.height = 1;
  cloud.width = static_cast<std::uint32_t>(scan->ranges_m.size());
  room.clear();
  for (std::size_t i = 0; i < scan->ranges_m.size(); ++i) {
    const float range_m = scan->ranges_m[i];
    const bool is_in_range =
        range_m >= scan->range_min_m && (range_m <= scan->range_max_m || scan->range_max_m <= 0);
    const float length_m = is_in_range ? range_m : std::numeric_limits<float>::quiet_NaN();
    const double angle_rad = static_cast<double>(scan->angle_min_rad) +
                             static_cast<double>(scan->angle_increment_rad) * static_cast<double>(i);
    append(room, static_cast<float>(std::cos(angle_rad)) * length_m);
    append(room, static_cast<float>(std::sin(angle_rad)) * length_m);
    append(room, 0 * length_m);
    append(room, scan->time_increment_s * static_cast<float>(i));
    if (has_intensity) append(room, scan->intensities[i]);
  }
  cloud.data = room;
  return cloud;
}

bool is_livox(const std::string& type) {
  return type == "livox_ros_driver/CustomMsg" || type == "livox_ros_driver2/CustomMsg" ||
         type == "livox_interfaces/CustomMsg";
}

}  // namespace

bool is_cloud_type(const std::string& type) {
  return type == "sensor_msgs/PointCloud2" || is_profile_type(type) || is_livox(type);
}

bool is_profile_type(const std::string& type) {
  return type == "sensor_msgs/LaserScan";
}

std::optional<PointCloud2> read_cloud(const Channel& channel, std::span<const std::uint8_t> data,
                                      std::vector<std::uint8_t>& room) {
  const MessageCursor message(channel.encoding, data);
  if (is_livox(channel.type)) return read_livox(channel, message, room);
  if (is_profile_type(channel.type)) return read_profile(message, room);
  return read_point_cloud2(message);
}

}  // namespace alces::bags
