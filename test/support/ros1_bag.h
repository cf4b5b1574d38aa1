// Small bags of ROS 1, made byte by byte, for tests of what is in them. (Bags by other people's writers:
// test/bags.)
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "alces/point.h"
#include "alces/pose.h"

namespace alces::test {

/// ROS 1's serialisation.
class Ros1Bytes {
 public:
  template <typename Number>
  Ros1Bytes& number(Number value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  Ros1Bytes& text(const std::string& text) {
    number(static_cast<std::uint32_t>(text.size()));
    bytes_ += text;
    return *this;
  }
  Ros1Bytes& time(double stamp_s) {
    const auto ns = static_cast<std::int64_t>(stamp_s * 1e9 + 0.5);
    number(static_cast<std::uint32_t>(ns / 1'000'000'000));
    return number(static_cast<std::uint32_t>(ns % 1'000'000'000));
  }
  Ros1Bytes& header(double stamp_s, const std::string& frame) {
    return number(std::uint32_t{0}).time(stamp_s).text(frame);
  }
  Ros1Bytes& pose(const Pose& pose) {
    for (int axis = 0; axis < 3; ++axis) number(pose.translation_m[axis]);
    for (int i = 0; i < 4; ++i) number(pose.rotation.coeffs()[i]);
    return *this;
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

struct CloudField {
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t type = 7;
};

/// A cloud of `step` bytes a point.
inline std::string ros1_cloud(double stamp_s, const std::string& frame, const std::vector<CloudField>& fields,
                              std::uint32_t step, const std::string& data) {
  const auto width = static_cast<std::uint32_t>(step == 0 ? 0 : data.size() / step);
  Ros1Bytes out;
  out.header(stamp_s, frame)
      .number(std::uint32_t{1})
      .number(width)
      .number(static_cast<std::uint32_t>(fields.size()));
  for (const CloudField& field : fields)
    out.text(field.name).number(field.offset).number(field.type).number(std::uint32_t{1});
  out.number(std::uint8_t{0}).number(step).number(static_cast<std::uint32_t>(data.size())).text(data);
  return out.number(std::uint8_t{1}).bytes();
}

inline std::string ros1_cloud(double stamp_s, const std::string& frame, const std::vector<Point>& points) {
  std::string data(points.size() * sizeof(Point), '\0');
  std::memcpy(data.data(), points.data(), data.size());
  return ros1_cloud(stamp_s, frame, {{"x", 0, 7}, {"y", 4, 7}, {"z", 8, 7}}, sizeof(Point), data);
}

inline std::string ros1_odometry(double stamp_s, const std::string& frame, const std::string& child,
                                 const Pose& pose) {
  Ros1Bytes out;
  out.header(stamp_s, frame).text(child).pose(pose);
  for (int i = 0; i < 36 + 6 + 36; ++i) out.number(0.0);
  return out.bytes();
}

inline std::string ros1_transform(double stamp_s, const std::string& parent, const std::string& child,
                                  const Pose& pose) {
  return Ros1Bytes().number(std::uint32_t{1}).header(stamp_s, parent).text(child).pose(pose).bytes();
}

class Ros1BagWriter {
 public:
  explicit Ros1BagWriter(std::filesystem::path file) : file_(std::move(file)) {}

  void add(const std::string& topic, const std::string& type, double log_s, const std::string& message,
           const std::string& definition = {}) {
    const auto [found, is_new] = connections_.emplace(topic + " " + type, connections_.size());
    const auto id = static_cast<std::uint32_t>(found->second);
    const std::string connection = field("conn", number(id));
    if (is_new)
      chunk_ += record(connection + field("op", "\x07") + field("topic", topic),
                       field("topic", topic) + field("type", type) + field("md5sum", "*") +
                           field("message_definition", definition));
    chunk_ +=
        record(connection + field("op", "\x02") + field("time", Ros1Bytes().time(log_s).bytes()), message);
  }

  /// The file as it is so far: one chunk, and `end` behind it.
  [[nodiscard]] std::string bytes() const {
    std::string bag = "#ROSBAG V2.0\n";
    bag += record(field("op", "\x03") + field("chunk_count", number(1U)) + field("conn_count", number(1U)) +
                      field("index_pos", number(std::uint64_t{1})),
                  std::string(16, ' '));
    bag += record(field("compression", "none") + field("op", "\x05") +
                      field("size", number(static_cast<std::uint32_t>(chunk_.size()))),
                  chunk_);
    return bag + record(field("op", "\x06") + field("ver", number(1U)), "");
  }
  void write() const { write(bytes()); }
  void write(const std::string& bytes) const {
    std::ofstream(file_, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }

 private:
  template <typename Number>
  static std::string number(Number value) {
    return Ros1Bytes().number(value).bytes();
  }
  static std::string field(const std::string& name, const std::string& value) {
    return Ros1Bytes().text(name + "=" + value).bytes();
  }
  static std::string record(const std::string& header, const std::string& data) {
    return Ros1Bytes().text(header).text(data).bytes();
  }

  std::filesystem::path file_;
  std::map<std::string, std::size_t> connections_;
  std::string chunk_;
};

}  // namespace alces::test
