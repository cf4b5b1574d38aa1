// Free space: what a scan has looked through, and which surfaces of another scan would stand in it.
//
// A ray that came back from a wall has shown that nothing stands before the wall. So a surface of another
// scan that would lie clearly before it contradicts the two scans' poses. Two scans of one place that lie
// where they should contradict each other hardly ever; two places laid on each other do, and so does one
// place that is shown twice beside itself.
//
// The view of a scan is a cube map around its scanner: six faces of 32 x 32 cells, 1.8 to 3.6 deg wide, each
// with the shortest range of itself and its neighbours, so that a slanted surface never stands before itself.
// Cells without a point, and those with few neighbours that have one, tell nothing. No angles are computed.
//
// Time: a division for each point of the view, and for each sample that is asked. Memory: 48 KiB.
#pragma once

#include <cstdint>
#include <span>

#include "alces/arena.h"
#include "alces/kd_tree.h"
#include "alces/pose.h"
#include "alces/surface.h"

namespace alces {

/// How samples of one scan stand in the view of another. Those where nothing was seen are in no number.
struct FreeSpaceCount {
  std::uint32_t agreeing = 0;  ///< about as far as what was seen there
  std::uint32_t standing = 0;  ///< clearly before it: in free space
  std::uint32_t hidden = 0;    ///< clearly behind it

  void add(const FreeSpaceCount& other) {
    agreeing += other.agreeing;
    standing += other.standing;
    hidden += other.hidden;
  }
  /// Of those in sight: what the viewer can tell of.
  [[nodiscard]] std::uint32_t known() const { return agreeing + standing; }
  /// 0 where nothing is known.
  [[nodiscard]] double share() const { return known() == 0 ? 0.0 : static_cast<double>(standing) / known(); }
};

/// Whether the share of `more` is larger than that of `less` beyond chance: by so many standard deviations of
/// their difference. Samples of one surface stand or fall together, so that ten of them count as one.
[[nodiscard]] bool is_clearly_more(const FreeSpaceCount& more, const FreeSpaceCount& less, double sigmas);

/// Whether the scans are of two places that do not see each other, as floors and parallel corridors are: less
/// than half as much of what one saw is in sight of the other as is `usual` between neighbours, the rest lies
/// behind, and no more stands in free space. False where the views tell too little.
[[nodiscard]] bool lies_apart(const FreeSpaceCount& count, const FreeSpaceCount& usual, double sigmas);

class FreeSpace {
 public:
  constexpr explicit FreeSpace(Arena& arena)
      : ranges_m_(arena.allocate<float>(cell_count)), nearest_m_(arena.allocate<float>(cell_count)) {}

  /// Takes the view of a scan from the origin of its body. O(points).
  void look(const KdTree& scan);

  /// How the samples of another scan stand in the view taken last. `tolerance_m`: how far surfaces may be
  /// apart and still be the same.
  [[nodiscard]] FreeSpaceCount count(const KdTree& scan, std::span<const SurfaceSample> samples,
                                     const Pose& viewer_from_body, float tolerance_m) const;

 private:
  static constexpr std::int32_t face_size = 32;
  static constexpr std::uint32_t cell_count = 6 * face_size * face_size;
  static constexpr float unseen = -1;

  std::span<float> ranges_m_;   // of each cell alone
  std::span<float> nearest_m_;  // with its neighbours; unseen where too few of them are known
};

}  // namespace alces
