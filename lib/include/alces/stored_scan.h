// The layout of a stored scan: what lies in the point pool, in an archive, and in scans.alces of a map
// folder.
//
// One record, little-endian, without padding (docs/map-folder.md has it as a table):
//
//   offset  bytes      what
//   0       2          version, 1
//   2       2          channels: a bit for each block behind the points
//   4       4          bytes of the whole record
//   8       4          number of points n, at least 1
//   12      4          size of the cells that the scan was downsampled to, float, m; 0: not known
//   16      12         lowest corner of the box around the points, x y z, float, m
//   28      12         step of the codes, x y z, float, m
//   40      6 n        points: code x, y, z, 16 bits each; coordinate = corner + step * code
//   40+6n   ...        blocks, in the order of their bits: 2 bytes kind (the bit's number), 2 bytes version,
//                      4 bytes length, then the content
//
//   kind 0  samples    8 bytes each: index of the point (4), roughness (1, of 255), normal (3: octahedron,
//                      12 bits v, 12 bits u)
//   kind 1  intensity  n bytes, 0 to 255
//   kind 2  time       8 + 2 n bytes: earliest time and step, float, s; then 16 bits a point: time = earliest
//   +
//                      step * code, relative to the scan's reference time
//   kind 3  signature  1 to 1024 bytes; its own version is the block's (scan_signature.h: 1, 512 bytes)
//   kind 4  seen_from  12 bytes: position of the sensor in the body frame, x y z, float, m; absent: the
//   origin
//
// What is not there has no bit and no block, and costs nothing. A reader skips blocks of kinds, and of
// versions, that it does not know: later channels get a new kind, and older readers go on reading.
//
// Cost: O(n). Memory: none but the caller's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "alces/kd_tree.h"
#include "alces/point.h"
#include "alces/surface.h"

namespace alces {

/// What a scan may bring beside its points; an empty span or nullopt: it does not.
struct ScanChannels {
  std::span<const std::uint8_t> intensity;  ///< of each point
  std::span<const float> time_s;            ///< of each point, relative to the scan's reference time
  std::span<const std::byte> signature;     ///< at most StoredScanLayout::most_signature_bytes
  std::uint16_t signature_version = 0;
  std::optional<Point> seen_from;  ///< position of the sensor, body frame
};

/// Room for channels, beside that for points and samples.
struct ChannelCapacity {
  bool has_intensity = false;
  bool has_time = false;
  std::uint32_t signature_bytes = 0;
};

struct StoredScanLayout {
  static constexpr std::uint16_t version = 1;
  static constexpr std::size_t header_bytes = 40;
  static constexpr std::size_t point_bytes = 6;
  static constexpr std::size_t block_header_bytes = 8;
  static constexpr std::size_t sample_bytes = 8;
  static constexpr std::uint32_t most_signature_bytes = 1024;

  /// A record of so many points and samples, with all channels that there is room for.
  [[nodiscard]] static constexpr std::size_t record_bytes(std::uint32_t points, std::uint32_t samples,
                                                          const ChannelCapacity& channels = {}) {
    std::size_t bytes = header_bytes + point_bytes * std::size_t{points};
    bytes += block_header_bytes + sample_bytes * std::size_t{samples};
    bytes += block_header_bytes + 12;  // seen_from
    if (channels.has_intensity) bytes += block_header_bytes + points;
    if (channels.has_time) bytes += block_header_bytes + 8 + 2 * std::size_t{points};
    if (channels.signature_bytes > 0) bytes += block_header_bytes + channels.signature_bytes;
    return bytes;
  }
};

/// Why a record cannot be decoded.
enum class StoredScanFault : std::uint8_t {
  none,
  too_short,      ///< fewer bytes than a header, or than the header says
  other_version,  ///< made by a later alces
  wrong_length,   ///< more bytes than the header says, or than its blocks fill
  no_points,
  box_not_finite,        ///< a corner, a step or a cell size is no number, negative, or beyond 1e30
  wrong_blocks,          ///< not those, or not in the order, that the header's bits say
  wrong_block_size,      ///< a block's length is not what its kind and the number of points ask for
  sample_without_point,  ///< a sample's index is beyond the points
  time_not_finite,
  seen_from_not_finite,
};
/// A short English clause; never null, static storage.
[[nodiscard]] const char* to_string(StoredScanFault fault);

/// A record that parse() has checked, in place: valid as long as its bytes.
class StoredScanView {
 public:
  /// Checks every field. The view is empty unless it returns none.
  [[nodiscard]] static StoredScanFault parse(std::span<const std::byte> record, StoredScanView& view);

  [[nodiscard]] std::uint32_t point_count() const { return point_count_; }
  [[nodiscard]] float cell_size_m() const { return cell_size_m_; }
  [[nodiscard]] std::uint32_t sample_count() const;
  [[nodiscard]] bool has_intensity() const { return !intensity_.empty(); }
  [[nodiscard]] bool has_time() const { return !time_.empty(); }

  [[nodiscard]] Point point(std::uint32_t i) const;             ///< i < point_count()
  [[nodiscard]] SurfaceSample sample(std::uint32_t i) const;    ///< i < sample_count()
  [[nodiscard]] std::uint8_t intensity(std::uint32_t i) const;  ///< of point i; has_intensity()
  [[nodiscard]] float time_s(std::uint32_t i) const;            ///< of point i; has_time()
  [[nodiscard]] std::span<const std::byte> signature() const { return signature_; }  ///< empty: none
  [[nodiscard]] std::uint16_t signature_version() const { return signature_version_; }
  [[nodiscard]] const std::optional<Point>& seen_from() const { return seen_from_; }

 private:
  [[nodiscard]] StoredScanFault parse_blocks(std::span<const std::byte> blocks, std::uint32_t channels);
  [[nodiscard]] StoredScanFault take_block(std::uint32_t kind, std::uint32_t version,
                                           std::span<const std::byte> content);

  std::uint32_t point_count_ = 0;
  float cell_size_m_ = 0;
  float low_m_[3] = {};
  float step_m_[3] = {};
  std::span<const std::byte> points_;
  std::span<const std::byte> samples_;
  std::span<const std::byte> intensity_;
  std::span<const std::byte> time_;  // codes
  float first_time_s_ = 0;
  float time_step_s_ = 0;
  std::span<const std::byte> signature_;
  std::uint16_t signature_version_ = 0;
  std::optional<Point> seen_from_;
};

/// What a record is made of.
struct StoredScanContent {
  std::span<const Point> points;
  /// Point i of the record is points[order->input_of(i)], and so its channels; null: points[i].
  const KdTreeScratch* order = nullptr;
  float cell_size_m = 0;
  std::span<const SurfaceSample> samples;  ///< their indices are the record's
  ScanChannels channels;
};

/// Quantises points to the codes of a record.
class StoredScanBox {
 public:
  /// Around points, which are finite and at least one.
  explicit StoredScanBox(std::span<const Point> points);
  /// The point as it will be decoded.
  [[nodiscard]] Point round(const Point& point) const;

 private:
  friend std::size_t encode_stored_scan(const StoredScanBox&, const StoredScanContent&, std::span<std::byte>);
  [[nodiscard]] std::uint16_t code(float value, int axis) const;
  float low_m_[3];
  float step_m_[3];
  float steps_per_m_[3];  // 0 where the box is flat
};

/// Writes the record to the front of `buffer` and returns its bytes; 0: there is no room, no point, a channel
/// without an entry for each point, a signature that is too long, or a time or seen_from that is not finite.
[[nodiscard]] std::size_t encode_stored_scan(const StoredScanBox& box, const StoredScanContent& content,
                                             std::span<std::byte> buffer);

}  // namespace alces
