#include "alces/stored_scan.h"

#include <algorithm>
#include <cmath>

#include "little_endian.h"

namespace alces {
namespace {

constexpr float steps = 65535.0F;
constexpr float roughness_steps = 255.0F;
constexpr float flat_m = 1e-30F;  // a step below this divides into nothing

enum Kind : std::uint32_t { samples_kind, intensity_kind, time_kind, signature_kind, seen_from_kind, kinds };
constexpr std::uint32_t bit(std::uint32_t kind) {
  return 1U << kind;
}
constexpr std::uint16_t first_version = 1;  // of the blocks, but for the signature, which counts its own
constexpr std::size_t time_header_bytes = 8;
constexpr std::size_t seen_from_bytes = 12;

float coordinate(const Point& p, int axis) {
  return axis == 0 ? p.x : axis == 1 ? p.y : p.z;
}

std::uint16_t code_of(float value, float low, float steps_per_unit) {
  const float code = (value - low) * steps_per_unit + 0.5F;
  return static_cast<std::uint16_t>(std::min(std::max(code, 0.0F), steps));
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

struct TimeCodes {
  float first_s = 0;
  float step_s = 0;
  float steps_per_s = 0;
};

bool find_time_codes(std::span<const float> times_s, TimeCodes& codes) {
  if (!std::ranges::all_of(times_s, [](float t) { return std::isfinite(t); })) return false;
  const auto [first, last] = std::ranges::minmax_element(times_s);
  codes.first_s = *first;
  codes.step_s = (*last - *first) / steps;
  if (!std::isfinite(codes.first_s + codes.step_s * steps)) return false;
  codes.steps_per_s = codes.step_s > flat_m ? 1.0F / codes.step_s : 0.0F;
  return true;
}

std::uint32_t bits_of(const ScanChannels& channels) {
  std::uint32_t bits = bit(samples_kind);
  if (!channels.intensity.empty()) bits |= bit(intensity_kind);
  if (!channels.time_s.empty()) bits |= bit(time_kind);
  if (!channels.signature.empty()) bits |= bit(signature_kind);
  if (channels.seen_from) bits |= bit(seen_from_kind);
  return bits;
}

void begin_block(LittleEndianWriter& writer, std::uint32_t kind, std::uint16_t version, std::size_t length) {
  writer.put(static_cast<std::uint16_t>(kind));
  writer.put(version);
  writer.put(static_cast<std::uint32_t>(length));
}

}  // namespace

const char* to_string(StoredScanFault fault) {
  switch (fault) {
    case StoredScanFault::none:
      return "whole";
    case StoredScanFault::too_short:
      return "it ends early";
    case StoredScanFault::other_version:
      return "its version is not one that this program knows";
    case StoredScanFault::wrong_length:
      return "its length is not what its header says";
    case StoredScanFault::no_points:
      return "it has no points";
    case StoredScanFault::box_not_finite:
      return "its box or its cell size is no number or negative";
    case StoredScanFault::wrong_blocks:
      return "its blocks are not those that its header names";
    case StoredScanFault::wrong_block_size:
      return "a block's length does not fit its kind and the number of points";
    case StoredScanFault::sample_without_point:
      return "a sample names a point that is not there";
    case StoredScanFault::time_not_finite:
      return "its times are no numbers";
    case StoredScanFault::seen_from_not_finite:
      return "the place it was seen from is no number";
  }
  return "unknown fault";
}

StoredScanBox::StoredScanBox(std::span<const Point> points) {
  for (int axis = 0; axis < 3; ++axis) {
    float low = coordinate(points[0], axis);
    float high = low;
    for (const Point& point : points) {
      low = std::min(low, coordinate(point, axis));
      high = std::max(high, coordinate(point, axis));
    }
    low_m_[axis] = low;
    step_m_[axis] = (high - low) / steps;
    steps_per_m_[axis] = step_m_[axis] > flat_m ? 1.0F / step_m_[axis] : 0.0F;
  }
}

std::uint16_t StoredScanBox::code(float value, int axis) const {
  return code_of(value, low_m_[axis], steps_per_m_[axis]);
}

Point StoredScanBox::round(const Point& point) const {
  const auto rounded = [this](float value, int axis) {
    return low_m_[axis] + step_m_[axis] * static_cast<float>(code(value, axis));
  };
  return {rounded(point.x, 0), rounded(point.y, 1), rounded(point.z, 2)};
}

std::size_t encode_stored_scan(const StoredScanBox& box, const StoredScanContent& content,
                               std::span<std::byte> buffer) {
  const ScanChannels& channels = content.channels;
  const std::size_t n = content.points.size();
  if (n == 0 || n > UINT32_MAX || channels.signature.size() > StoredScanLayout::most_signature_bytes)
    return 0;
  if (!channels.intensity.empty() && channels.intensity.size() != n) return 0;
  if (!channels.time_s.empty() && channels.time_s.size() != n) return 0;
  if (channels.seen_from && !is_finite(*channels.seen_from)) return 0;
  TimeCodes times;
  if (!channels.time_s.empty() && !find_time_codes(channels.time_s, times)) return 0;
  const ChannelCapacity needed{!channels.intensity.empty(), !channels.time_s.empty(),
                               static_cast<std::uint32_t>(channels.signature.size())};
  const std::size_t bytes =
      StoredScanLayout::record_bytes(static_cast<std::uint32_t>(n),
                                     static_cast<std::uint32_t>(content.samples.size()), needed) -
      (channels.seen_from ? 0 : StoredScanLayout::block_header_bytes + seen_from_bytes);
  if (bytes > buffer.size() || bytes > UINT32_MAX) return 0;
  const auto input_of = [&content](std::size_t i) {
    return content.order == nullptr ? i : content.order->input_of(static_cast<std::uint32_t>(i));
  };

  LittleEndianWriter writer(buffer.data());
  writer.put(StoredScanLayout::version);
  writer.put(static_cast<std::uint16_t>(bits_of(channels)));
  writer.put(static_cast<std::uint32_t>(bytes));
  writer.put(static_cast<std::uint32_t>(n));
  writer.put_float(content.cell_size_m);
  for (const float low : box.low_m_) writer.put_float(low);
  for (const float step : box.step_m_) writer.put_float(step);
  for (std::size_t i = 0; i < n; ++i) {
    const Point& p = content.points[input_of(i)];
    writer.put(box.code(p.x, 0));
    writer.put(box.code(p.y, 1));
    writer.put(box.code(p.z, 2));
  }
  begin_block(writer, samples_kind, first_version, StoredScanLayout::sample_bytes * content.samples.size());
  for (const SurfaceSample& sample : content.samples) {
    writer.put(sample.index);
    const auto roughness = static_cast<std::uint32_t>(std::lround(sample.roughness * roughness_steps));
    writer.put(encode_normal(sample.normal) << 8 | roughness);
  }
  if (needed.has_intensity) {
    begin_block(writer, intensity_kind, first_version, n);
    for (std::size_t i = 0; i < n; ++i) writer.put(channels.intensity[input_of(i)]);
  }
  if (needed.has_time) {
    begin_block(writer, time_kind, first_version, time_header_bytes + 2 * n);
    writer.put_float(times.first_s);
    writer.put_float(times.step_s);
    for (std::size_t i = 0; i < n; ++i)
      writer.put(code_of(channels.time_s[input_of(i)], times.first_s, times.steps_per_s));
  }
  if (needed.signature_bytes > 0) {
    begin_block(writer, signature_kind, channels.signature_version, needed.signature_bytes);
    writer.put(channels.signature);
  }
  if (channels.seen_from) {
    begin_block(writer, seen_from_kind, first_version, seen_from_bytes);
    writer.put_float(channels.seen_from->x);
    writer.put_float(channels.seen_from->y);
    writer.put_float(channels.seen_from->z);
  }
  return bytes;
}

StoredScanFault StoredScanView::parse(std::span<const std::byte> record, StoredScanView& view) {
  view = StoredScanView{};
  StoredScanView parsed;
  if (record.size() < StoredScanLayout::header_bytes) return StoredScanFault::too_short;
  const std::byte* const at = record.data();
  if (little_endian<std::uint16_t>(at) != StoredScanLayout::version) return StoredScanFault::other_version;
  const std::uint32_t channels = little_endian<std::uint16_t>(at + 2);
  const auto bytes = little_endian<std::uint32_t>(at + 4);
  if (bytes > record.size()) return StoredScanFault::too_short;
  if (bytes != record.size()) return StoredScanFault::wrong_length;
  parsed.point_count_ = little_endian<std::uint32_t>(at + 8);
  if (parsed.point_count_ == 0) return StoredScanFault::no_points;
  parsed.cell_size_m_ = little_endian_float(at + 12);
  if (!(parsed.cell_size_m_ >= 0) || !std::isfinite(parsed.cell_size_m_))
    return StoredScanFault::box_not_finite;
  for (int axis = 0; axis < 3; ++axis) {
    parsed.low_m_[axis] = little_endian_float(at + 16 + 4 * axis);
    parsed.step_m_[axis] = little_endian_float(at + 28 + 4 * axis);
    const float high_m = parsed.low_m_[axis] + parsed.step_m_[axis] * steps;
    if (!std::isfinite(parsed.low_m_[axis]) || !(parsed.step_m_[axis] >= 0) || !std::isfinite(high_m))
      return StoredScanFault::box_not_finite;
  }
  const std::uint64_t points_bytes = std::uint64_t{parsed.point_count_} * StoredScanLayout::point_bytes;
  const std::span<const std::byte> behind_header = record.subspan(StoredScanLayout::header_bytes);
  if (points_bytes > behind_header.size()) return StoredScanFault::too_short;
  parsed.points_ = behind_header.first(static_cast<std::size_t>(points_bytes));
  const StoredScanFault fault =
      parsed.parse_blocks(behind_header.subspan(static_cast<std::size_t>(points_bytes)), channels);
  if (fault == StoredScanFault::none) view = parsed;
  return fault;
}

StoredScanFault StoredScanView::parse_blocks(std::span<const std::byte> blocks, std::uint32_t channels) {
  for (std::uint32_t kind = 0; kind < 16; ++kind) {
    if ((channels & bit(kind)) == 0) continue;
    if (blocks.size() < StoredScanLayout::block_header_bytes) return StoredScanFault::too_short;
    if (little_endian<std::uint16_t>(blocks.data()) != kind) return StoredScanFault::wrong_blocks;
    const std::uint32_t version = little_endian<std::uint16_t>(blocks.data() + 2);
    const auto length = little_endian<std::uint32_t>(blocks.data() + 4);
    blocks = blocks.subspan(StoredScanLayout::block_header_bytes);
    if (length > blocks.size()) return StoredScanFault::too_short;
    const StoredScanFault fault = take_block(kind, version, blocks.first(length));
    if (fault != StoredScanFault::none) return fault;
    blocks = blocks.subspan(length);
  }
  return blocks.empty() ? StoredScanFault::none : StoredScanFault::wrong_length;
}

StoredScanFault StoredScanView::take_block(std::uint32_t kind, std::uint32_t version,
                                           std::span<const std::byte> content) {
  if (kind == signature_kind) {
    if (content.empty() || content.size() > StoredScanLayout::most_signature_bytes)
      return StoredScanFault::wrong_block_size;
    signature_ = content;
    signature_version_ = static_cast<std::uint16_t>(version);
    return StoredScanFault::none;
  }
  if (kind >= kinds || version != first_version) return StoredScanFault::none;  // of a later alces
  const std::size_t n = point_count_;
  switch (kind) {
    case samples_kind:
      if (content.size() % StoredScanLayout::sample_bytes != 0) return StoredScanFault::wrong_block_size;
      samples_ = content;
      for (std::uint32_t i = 0; i < sample_count(); ++i) {
        const std::byte* const at = samples_.data() + StoredScanLayout::sample_bytes * i;
        if (little_endian<std::uint32_t>(at) >= point_count_) return StoredScanFault::sample_without_point;
      }
      break;
    case intensity_kind:
      if (content.size() != n) return StoredScanFault::wrong_block_size;
      intensity_ = content;
      break;
    case time_kind: {
      if (content.size() < time_header_bytes || content.size() - time_header_bytes != 2 * n)
        return StoredScanFault::wrong_block_size;
      first_time_s_ = little_endian_float(content.data());
      time_step_s_ = little_endian_float(content.data() + 4);
      const float last_s = first_time_s_ + time_step_s_ * steps;
      if (!std::isfinite(first_time_s_) || !(time_step_s_ >= 0) || !std::isfinite(last_s))
        return StoredScanFault::time_not_finite;
      time_ = content.subspan(time_header_bytes);
      break;
    }
    default: {  // seen_from_kind
      if (content.size() != seen_from_bytes) return StoredScanFault::wrong_block_size;
      const Point place{little_endian_float(content.data()), little_endian_float(content.data() + 4),
                        little_endian_float(content.data() + 8)};
      if (!is_finite(place)) return StoredScanFault::seen_from_not_finite;
      seen_from_ = place;
    }
  }
  return StoredScanFault::none;
}

std::uint32_t StoredScanView::sample_count() const {
  return static_cast<std::uint32_t>(samples_.size() / StoredScanLayout::sample_bytes);
}

Point StoredScanView::point(std::uint32_t i) const {
  const std::byte* const at = points_.data() + StoredScanLayout::point_bytes * i;
  const auto decode = [&](int axis) {
    return low_m_[axis] + step_m_[axis] * static_cast<float>(little_endian<std::uint16_t>(at + 2 * axis));
  };
  return {decode(0), decode(1), decode(2)};
}

SurfaceSample StoredScanView::sample(std::uint32_t i) const {
  const std::byte* const at = samples_.data() + StoredScanLayout::sample_bytes * i;
  SurfaceSample sample;
  sample.index = little_endian<std::uint32_t>(at);
  const auto packed = little_endian<std::uint32_t>(at + 4);
  decode_normal(packed >> 8, sample.normal);
  sample.roughness = static_cast<float>(packed & 0xFF) / roughness_steps;
  return sample;
}

std::uint8_t StoredScanView::intensity(std::uint32_t i) const {
  return std::to_integer<std::uint8_t>(intensity_[i]);
}

float StoredScanView::time_s(std::uint32_t i) const {
  return first_time_s_ +
         time_step_s_ * static_cast<float>(little_endian<std::uint16_t>(time_.data() + 2 * i));
}

}  // namespace alces
