// What a place looks like, in 512 bytes: by it a place is recognised, and how far one is turned there.
//
// Seen from above, the surroundings are divided into 64 sectors of azimuth by 16 rings of range. A cell
// says how high what was seen there reaches, in whole metres above -2 m: 0 (below -1 m, or nothing at all) to
// 15 (13 m and higher). Heights are those of the body frame, whose z points up. Two scans of one place
// have alike cells, turned by some sectors: a correlation over the circle finds the turn, and what is alike
// then, as a share, is the likeness.
//
// Only the highest point of a cell counts. So the order of the points does not matter, and their density
// hardly does: a thinned scan loses a cell where it has no point left, not where it has fewer.
//
// A signature changes as the scanner moves: 2 m to the side do little harm, 5 m do. A scan can be
// asked from beside, though: of() takes the place that it is to be seen from. Nine such places, 2.5 m apart,
// for the one scan that asks, recognise what lies up to 5 m off (docs/benchmarks.md: how surely).
//
// The likeness alone is no proof: floors and aisles look alike. What it finds is to be matched, and believed,
// as a loop is.
//
// Integer sums and comparisons of floats: equal points give equal bits on every processor.
// Cost: of(): some 50 instructions a point. correlate(): 64 sums over 1024 bytes, the same for any two scans;
// some 30,000 instructions where the processor has sums of differences of bytes, as x86-64 and ARM64 have.
// Memory: 1 KiB each, 512 bytes as it is stored.
// Source: the cells and their heights are those of Scan Context (Kim and Kim, 2018), the bound is by its ring
// key; likeness and correlation are ours (the quotient of Ruzicka, 1958).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "alces/point.h"

namespace alces {

/// A turn by which two signatures are alike.
struct YawCandidate {
  /// Turns the data's axes into the model's, about the upright; -pi to pi, steps of 5.6 deg.
  float yaw_rad = 0;
  float likeness = 0;  ///< 0 to 1
};

class ScanSignature {
 public:
  static constexpr std::uint32_t sectors = 64;
  static constexpr std::uint32_t rings = 16;
  static constexpr float ring_width_m = 3.75F;  ///< what is farther away than 60 m does not count
  static constexpr float lowest_m = -2;
  static constexpr float height_step_m = 1;
  static constexpr std::uint8_t highest = 15;
  static constexpr std::size_t stored_bytes = std::size_t{sectors} * rings / 2;
  static constexpr std::uint16_t version = 1;  ///< of the block in a stored scan (stored_scan.h)

  /// Nothing seen: like no other.
  ScanSignature() = default;

  /// Of finite points in the body frame; seen from (`x_m`, `y_m`) instead of the body's origin, with the
  /// body's axes. O(points).
  [[nodiscard]] static ScanSignature of(std::span<const Point> points, float x_m = 0, float y_m = 0);

  /// False, and this signature is one of nothing seen, where `bytes` are not a signature of this version.
  [[nodiscard]] bool read(std::span<const std::byte> bytes, std::uint16_t stored_version);
  void write(std::span<std::byte, stored_bytes> bytes) const;

  /// The turns where `data` is more like this signature (the model) than turned by a sector more or less, the
  /// best first, at most candidates.size(); returns how many. 0: one of them has nothing but empty cells.
  [[nodiscard]] std::uint32_t correlate(const ScanSignature& data, std::span<YawCandidate> candidates) const;

  /// The best turn's likeness; 0: one of them has nothing but empty cells. Cost: as correlate().
  [[nodiscard]] float likeness(const ScanSignature& data) const;

  /// The likeness is never above this, whatever the turn: 16 comparisons, which spare most of the
  /// correlations of a search for the best of many.
  [[nodiscard]] float likeness_bound(const ScanSignature& data) const;

  /// 0 to 15; sector 0 begins at the body's x axis, counted counter-clockwise; ring 0 is the nearest.
  [[nodiscard]] std::uint8_t cell(std::uint32_t sector, std::uint32_t ring) const {
    return cells_[sector * rings + ring];
  }

 private:
  void add_up();
  using Likenesses = std::array<float, sectors>;
  void correlate_all(const ScanSignature& data, Likenesses& likenesses) const;

  std::array<std::uint8_t, std::size_t{sectors} * rings> cells_{};  // sector behind sector
  std::array<std::uint16_t, rings> ring_sums_{};
  std::uint32_t sum_ = 0;
};

}  // namespace alces
