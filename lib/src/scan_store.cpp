#include "alces/scan_store.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace alces {
namespace {

constexpr float steps = 65535.0F;
constexpr float roughness_steps = 255.0F;

// What a record begins with.
struct Box {
  float low[3];
  float step[3];

  [[nodiscard]] float decode(std::uint16_t code, int axis) const {
    return low[axis] + step[axis] * static_cast<float>(code);
  }
};

struct BoxEncoder {
  Box box;
  float steps_per_m[3];  // 0 where the box is flat

  explicit BoxEncoder(const Box& around) : box(around) {
    constexpr float flat_m = 1e-30F;
    for (int axis = 0; axis < 3; ++axis)
      steps_per_m[axis] = box.step[axis] > flat_m ? 1.0F / box.step[axis] : 0.0F;
  }
  [[nodiscard]] std::uint16_t encode(float value, int axis) const {
    const float code = (value - box.low[axis]) * steps_per_m[axis] + 0.5F;
    return static_cast<std::uint16_t>(std::min(std::max(code, 0.0F), steps));
  }
  [[nodiscard]] float round(float value, int axis) const { return box.decode(encode(value, axis), axis); }
};

Box box_around(std::span<const Point> points) {
  Box box{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto coordinate = [axis](const Point& p) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; };
    float low = coordinate(points[0]);
    float high = low;
    for (const Point& point : points) {
      low = std::min(low, coordinate(point));
      high = std::max(high, coordinate(point));
    }
    box.low[axis] = low;
    box.step[axis] = (high - low) / steps;
  }
  return box;
}

template <typename T>
void put(std::byte*& at, const T& value) {
  std::memcpy(at, &value, sizeof(value));
  at += sizeof(value);
}

template <typename T>
T take(const std::byte*& at) {
  T value;
  std::memcpy(&value, at, sizeof(value));
  at += sizeof(value);
  return value;
}

// A unit vector on the octahedron |x| + |y| + |z| = 1, unfolded to a square (Meyer et al., 2010); 12 bits a
// side keep it to 0.03 deg.
constexpr float octahedron_steps = 2047.0F;

std::uint32_t encode_normal(const float* n) {
  const float sum = std::abs(n[0]) + std::abs(n[1]) + std::abs(n[2]);
  if (!(sum > 0)) return 0;
  float u = n[0] / sum;
  float v = n[1] / sum;
  if (n[2] < 0) {
    const float folded_u = (1.0F - std::abs(v)) * (u < 0 ? -1.0F : 1.0F);
    v = (1.0F - std::abs(u)) * (v < 0 ? -1.0F : 1.0F);
    u = folded_u;
  }
  const auto code = [](float t) {
    return static_cast<std::uint32_t>(std::lround(t * octahedron_steps) + 2048);
  };
  return code(u) << 12 | code(v);
}

void decode_normal(std::uint32_t code, float* n) {
  const auto side = [](std::uint32_t bits) {
    return (static_cast<float>(bits & 0xFFF) - 2048.0F) / octahedron_steps;
  };
  float u = side(code >> 12);
  float v = side(code);
  const float z = 1.0F - std::abs(u) - std::abs(v);
  if (z < 0) {
    const float unfolded_u = (1.0F - std::abs(v)) * (u < 0 ? -1.0F : 1.0F);
    v = (1.0F - std::abs(u)) * (v < 0 ? -1.0F : 1.0F);
    u = unfolded_u;
  }
  const float length = std::sqrt(u * u + v * v + z * z);
  n[0] = u / length;
  n[1] = v / length;
  n[2] = z / length;
}

void decode_samples(const std::byte* at, std::span<SurfaceSample> samples) {
  for (SurfaceSample& sample : samples) {
    sample.index = take<std::uint32_t>(at);
    const auto packed = take<std::uint32_t>(at);
    decode_normal(packed >> 8, sample.normal);
    sample.roughness = static_cast<float>(packed & 0xFF) / roughness_steps;
  }
}

}  // namespace

Status ScanStore::add(std::span<const Point> points) {
  if (scan_count_ == records_.size()) return Status::no_scan_capacity;
  if (points.size() > config_.point_capacity) return Status::no_point_capacity;
  if (points.empty()) return Status::empty_scan;
  if (slots_.empty()) return Status::bad_config;
  const auto count = static_cast<std::uint32_t>(points.size());

  // The tree is built over the points as they will be decoded.
  const BoxEncoder encoder(box_around(points));
  const std::span<Point> rounded = point_scratch_.first(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const Point& p = points[i];
    rounded[i] = {encoder.round(p.x, 0), encoder.round(p.y, 1), encoder.round(p.z, 2)};
  }
  Slot& slot = oldest_slot();
  slot.scan = UINT32_MAX;
  if (!slot.tree.build(rounded, tree_scratch_)) return Status::no_point_capacity;
  slot.spacing = measure_spacing(slot.tree, config_.surface.neighbors);
  slot.sample_count = sample_surface(slot.tree, config_.surface, slot.spacing, slot.samples);

  std::byte* at = record_scratch_.data();
  put(at, encoder.box);
  for (std::uint32_t i = 0; i < count; ++i) {
    const Point& p = points[tree_scratch_.input_of(i)];
    put(at, encoder.encode(p.x, 0));
    put(at, encoder.encode(p.y, 1));
    put(at, encoder.encode(p.z, 2));
  }
  const std::byte* const samples_at = at;
  for (std::uint32_t i = 0; i < slot.sample_count; ++i) {
    const SurfaceSample& sample = slot.samples[i];
    put(at, sample.index);
    const auto roughness = static_cast<std::uint32_t>(std::lround(sample.roughness * roughness_steps));
    put(at, encode_normal(sample.normal) << 8 | roughness);
  }
  const std::span<const std::byte> record = record_scratch_.first(record_bytes(count, slot.sample_count));

  Record entry{in_archive, count, slot.sample_count};
  if (counters_.pool_bytes + record.size() <= pool_.size()) {
    entry.offset = counters_.pool_bytes;
    std::memcpy(pool_.data() + static_cast<std::size_t>(entry.offset), record.data(), record.size());
    counters_.pool_bytes += record.size();
  } else {
    if (archive_ == nullptr) return Status::no_point_capacity;
    if (!archive_->write(scan_count_, record)) return Status::archive_write_failed;
    counters_.archive_bytes += record.size();
    ++counters_.archived_scans;
  }
  records_[scan_count_] = entry;
  counters_.points += count;
  decode_samples(samples_at,
                 slot.samples.first(slot.sample_count));  // the tree is as it will be decoded already
  slot.scan = scan_count_++;
  slot.last_use = ++use_;
  return Status::ok;
}

Status ScanStore::load(std::uint32_t scan, StoredScan& stored) {
  if (scan >= scan_count_) return Status::no_such_scan;
  Slot* slot = nullptr;
  for (Slot& candidate : slots_) {
    if (candidate.scan == scan) slot = &candidate;
  }
  if (slot != nullptr) {
    ++counters_.slot_hits;
  } else {
    ++counters_.slot_misses;
    slot = &oldest_slot();
    slot->scan = UINT32_MAX;
    const Record& entry = records_[scan];
    const std::size_t bytes = record_bytes(entry.point_count, entry.sample_count);
    std::span<const std::byte> record;
    if (entry.offset == in_archive) {
      const std::span<std::byte> buffer = record_scratch_.first(bytes);
      if (archive_ == nullptr || !archive_->read(scan, buffer)) return Status::archive_read_failed;
      record = buffer;
    } else {
      record = pool_.subspan(static_cast<std::size_t>(entry.offset), bytes);
    }
    if (!decode(record, scan, *slot)) return Status::archive_read_failed;
  }
  slot->last_use = ++use_;
  stored = {&slot->tree, slot->samples.first(slot->sample_count), slot->spacing};
  return Status::ok;
}

ScanStore::Slot& ScanStore::oldest_slot() {
  return *std::min_element(slots_.begin(), slots_.end(),
                           [](const Slot& a, const Slot& b) { return a.last_use < b.last_use; });
}

bool ScanStore::decode(std::span<const std::byte> record, std::uint32_t scan, Slot& slot) {
  const Record& entry = records_[scan];
  const std::byte* at = record.data();
  const Box box = take<Box>(at);
  const std::span<Point> points = point_scratch_.first(entry.point_count);
  for (Point& point : points) {
    point.x = box.decode(take<std::uint16_t>(at), 0);
    point.y = box.decode(take<std::uint16_t>(at), 1);
    point.z = box.decode(take<std::uint16_t>(at), 2);
    if (!is_finite(point)) return false;  // an archive may hand back anything
  }
  slot.sample_count = entry.sample_count;
  const std::span<SurfaceSample> samples = slot.samples.first(entry.sample_count);
  decode_samples(at, samples);
  for (const SurfaceSample& sample : samples) {
    if (sample.index >= entry.point_count) return false;
  }
  if (!slot.tree.restore(points)) return false;
  slot.spacing = measure_spacing(slot.tree, config_.surface.neighbors);  // the same tree gives the same
  slot.scan = scan;
  slot.last_use = ++use_;
  return true;
}

}  // namespace alces
