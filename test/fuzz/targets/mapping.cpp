// The mapper: any configuration that check() takes, any scans and poses.
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <type_traits>
#include <vector>

#include "../byte_feed.h"
#include "../target.h"
#include "alces/deskew.h"
#include "alces/mapper.h"
#include "alces_platform/settings/mapper_keys.h"

namespace alces::fuzz {
namespace {

/// Small, so that a drive takes milliseconds.
MapperConfig small_config() {
  MapperConfig config = MapperConfig::standard();
  config.scan_capacity = 32;
  config.loop_capacity = 8;
  config.pool_bytes = std::size_t{256} << 10;
  config.cache_slots = 10;
  config.voxel.cell_capacity = 512;
  config.surface.sample_capacity = 128;
  config.correspondence_capacity = 512;
  config.scan_match.maximum_iterations = 10;
  config.loop_match.maximum_iterations = 5;
  config.start_search.reach_m = 4;
  config.start_search.turn_step_rad = 0.3F;
  config.detector.minimum_gap_scans = 4;
  config.detector.minimum_gap_m = 1;
  return config;
}

/// Writes any number into any key, with no regard to the ranges of the file's reader.
class KeySetter {
 public:
  KeySetter(std::uint8_t place, double value) : place_(place), value_(value) {}
  void table(const char*, const char*) {}
  template <class Number, class Least, class Most>
  void number(const char*, Number& number, Least, Most, const char*) {
    if (!is_it()) return;
    if constexpr (std::is_floating_point_v<Number>) {
      // Not a conversion: what a double cannot be as a float is infinite.
      number = std::abs(value_) <= static_cast<double>(std::numeric_limits<Number>::max())
                   ? static_cast<Number>(value_)
                   : static_cast<Number>(std::copysign(std::numeric_limits<double>::infinity(), value_));
      if (std::isnan(value_)) number = std::numeric_limits<Number>::quiet_NaN();
    } else {
      // Sizes and counts: small ones, or the largest that there are.
      number = value_ >= 0 && value_ < 1e6 ? static_cast<Number>(value_) : std::numeric_limits<Number>::max();
    }
  }
  void flag(const char*, bool& flag, const char*) {
    if (is_it()) flag = value_ > 0;
  }
  template <class Enum>
  void choice(const char*, Enum& value, const settings::Names<Enum>& words, const char*) {
    if (is_it()) value = words.at(value_ > 0 ? 1 : 0).second;
  }
  void retired(const char*) {}

 private:
  bool is_it() { return place_-- == 0; }
  int place_;
  double value_;
};

float any_float(ByteFeed& feed) {
  return feed.number<float>();
}

/// Walls and ground around the vehicle, a bit different from scan to scan; or bytes as they are.
void take_points(ByteFeed& feed, std::uint8_t form, std::vector<Point>& points) {
  points.clear();
  const std::uint8_t count = feed.byte();
  if ((form & 1U) != 0) {
    const float wall_m = static_cast<float>(feed.byte()) / 16 + 1;
    for (int i = 0; i < 2 * count; ++i) {
      const auto t = static_cast<float>(i);
      const float along_m = std::fmod(t * 0.731F, 20.0F) - 10;
      const float up_m = std::fmod(t * 0.377F, 3.0F) - 1;
      if (i % 3 == 0) points.push_back({along_m, wall_m, up_m});
      if (i % 3 == 1) points.push_back({wall_m + 2, along_m, up_m});
      if (i % 3 == 2) points.push_back({along_m, up_m * 4, -1});
    }
  }
  if ((form & 2U) != 0) {
    for (unsigned i = 0; i < (count & 31U); ++i) {
      const float x = any_float(feed);
      const float y = any_float(feed);
      points.push_back({x, y, any_float(feed)});
    }
  }
}

Pose take_pose(ByteFeed& feed, std::uint8_t form, const Pose& before) {
  Pose pose = before;
  if ((form & 4U) != 0) {
    for (int axis = 0; axis < 3; ++axis) pose.translation_m[axis] = feed.number<double>();
    for (int axis = 0; axis < 4; ++axis) pose.rotation.coeffs()[axis] = feed.number<double>();
    return pose;
  }
  Vector6d step = Vector6d::Zero();
  step[0] = feed.number<std::int8_t>() / 32.0;
  step[1] = feed.number<std::int8_t>() / 64.0;
  step[5] = feed.number<std::int8_t>() / 64.0;
  return before * exp_se3(step);
}

void drive(ByteFeed& feed, const MapperConfig& config) {
  static std::vector<std::max_align_t> memory;
  const std::size_t size = Mapper::memory_required(config);
  if (size > (std::size_t{8} << 20)) return;  // also SIZE_MAX: what has no size at all
  memory.resize((std::size_t{8} << 20) / sizeof(std::max_align_t) + 16);
  const auto begin = (reinterpret_cast<std::uintptr_t>(memory.data()) + 63) / 64 * 64;
  Status status = Status::bad_config;
  Mapper* const mapper = Mapper::create({reinterpret_cast<std::byte*>(begin), size}, config, status);
  require(mapper != nullptr && status == Status::ok, "a checked configuration makes a mapper");
  std::vector<Point> points;
  Pose odometry;
  for (int scan = 0; scan < 24 && !feed.is_empty(); ++scan) {
    const std::uint8_t form = feed.byte();
    take_points(feed, form, points);
    const bool has_odometry = (form & 8U) != 0;
    const Pose pose = has_odometry ? take_pose(feed, form, odometry) : odometry;
    if (is_valid(pose)) odometry = pose;
    Eigen::Vector3d gps_m(feed.number<std::int8_t>(), 0, 0);
    if ((form & 32U) != 0) gps_m.y() = feed.number<double>();
    ScanReport report;
    const std::uint32_t before = mapper->scan_count();
    const Status added = mapper->add_scan(points, has_odometry ? &pose : nullptr, report,
                                          (form & 16U) != 0 ? &gps_m : nullptr);
    const bool is_in = added == Status::ok || added == Status::no_voxel_capacity;
    require(mapper->scan_count() == before + (is_in ? 1 : 0), "a scan is added, or the map stays as it was");
    for (const Pose& each : mapper->graph().poses()) require(is_valid(each), "poses of a map are poses");
    if ((form & 64U) != 0 && mapper->scan_count() > 1) {
      LoopReport loop;
      (void)mapper->offer_loop(feed.byte() % (mapper->scan_count() + 1), mapper->scan_count() - 1, loop);
    }
  }
  LoopReport loop;
  (void)mapper->finish(loop);
  (void)mapper->health();
  for (const Pose& each : mapper->graph().poses()) require(is_valid(each), "poses of a map are poses");
  points.resize(config.voxel.cell_capacity);
  for (std::uint32_t scan = 0; scan < mapper->scan_count(); ++scan) {
    std::uint32_t count = 0;
    if (mapper->read_scan(scan, points, count) != Status::ok) continue;
    for (const Point& point : std::span(points).first(count))
      require(is_finite(point), "stored points are finite");
  }
}

/// Poses or a twist, then points with times.
ALCES_FUZZ_TARGET(deskew) {
  alignas(Arena::alignment) static std::byte block[8192];
  ByteFeed feed(bytes);
  Arena arena(block);
  Deskew deskew(arena, DeskewConfig{.pose_capacity = 16});
  require(!arena.overflowed(), "16 poses fit");
  const std::uint8_t form = feed.byte();
  if ((form & 1U) != 0) {
    Vector6d twist;
    for (int k = 0; k < 6; ++k)
      twist[k] = (form & 2U) != 0 ? feed.number<double>() : feed.number<std::int8_t>();
    (void)deskew.set_twist(twist);
  } else {
    Pose pose;
    for (int i = 0; i < form / 8; ++i) {
      pose = take_pose(feed, form, pose);
      const double time_s = (form & 2U) != 0 ? feed.number<double>() : 0.01 * i;
      (void)deskew.add_pose(time_s, pose);
    }
  }
  require(deskew.pose_count() <= 16, "no more poses than there is room for");
  std::vector<Point> points;
  take_points(feed, feed.byte(), points);
  std::vector<float> time_s;
  for (std::size_t i = 0; i < points.size(); ++i)
    time_s.push_back((form & 2U) != 0 ? feed.number<float>() : 0.001F * feed.byte());
  const std::vector<Point> before = points;
  if (deskew.apply(points, time_s, (form & 2U) != 0 ? feed.number<double>() : 0) == DeskewStatus::ok) return;
  require(std::memcmp(points.data(), before.data(), points.size() * sizeof(Point)) == 0 || points.empty(),
          "a scan that cannot be deskewed stays as it was");
}

ALCES_FUZZ_TARGET(add_scan) {
  ByteFeed feed(bytes);
  static const MapperConfig standard = small_config();
  drive(feed, standard);
}

/// A list of keys with numbers, then a drive by what they make, if check() takes it.
ALCES_FUZZ_TARGET(mapper_config) {
  ByteFeed feed(bytes);
  MapperConfig config = small_config();
  if ((feed.byte() & 1U) != 0) {
    const MapperConfig small = config;
    config = MapperConfig::paper();
    config.scan_capacity = small.scan_capacity;
    config.loop_capacity = small.loop_capacity;
    config.pool_bytes = small.pool_bytes;
    config.cache_slots = small.cache_slots;
    config.voxel = small.voxel;
    config.surface = small.surface;
    config.correspondence_capacity = small.correspondence_capacity;
    config.detector.minimum_gap_scans = small.detector.minimum_gap_scans;
  }
  const std::uint8_t changes = feed.byte() & 15U;
  for (std::uint8_t i = 0; i < changes; ++i) {
    const std::uint8_t place = feed.byte();
    const std::uint8_t form = feed.byte();
    const double value = (form & 1U) != 0 ? feed.number<double>() : feed.number<std::int16_t>() / 256.0;
    KeySetter setter(place, value);
    settings::visit_mapper(config, setter);
  }
  if (Mapper::validate(config) != Status::ok) return;
  // Good, and slow by intent.
  if (config.scan_match.maximum_iterations > 100 || config.loop_match.maximum_iterations > 100 ||
      config.loop_search.iterations > 100 || config.loop_search.candidates > 10)
    return;
  drive(feed, config);
}

}  // namespace
}  // namespace alces::fuzz
