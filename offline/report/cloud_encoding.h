// A point cloud's octree as text inside a page: quantised, delta coded, deflated, in base64.
//
// Within a node a coordinate is a whole number of steps from the node's lowest corner, 16 bits an axis; the
// step is `step_m`, or, in nodes larger than 65535 steps, 1/65535 of the node's side. The error is at most
// half a step an axis. Points stand in the order of their scan and, within a scan, along the Morton curve;
// each of x, y, z and scan is the difference to the point before it in the node (0 before the first), as
// zigzag-coded 16 bit modulo 65536. A chunk is the eight byte planes of its nodes' points behind each other:
// low bytes of x, high bytes of x, of y, of z, of the scan; about 3.4 bytes a point of a street once
// deflated. Where the map has intensities they are a ninth plane, as they are.
//
// More than 65536 scans: the scan is that of the trajectory divided by `scans_a_number`, rounded down.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "cloud_octree.h"

namespace alces::offline {

struct EncodedChunk {
  std::size_t nodes = 0;   ///< so many of EncodedCloud::nodes, after those of the chunks before
  std::size_t points = 0;  ///< of them all
  std::string text;        ///< base64
};

struct EncodedCloud {
  double step_m = 0;
  std::uint32_t scans_a_number = 1;
  bool has_intensity = false;
  std::vector<CloudNode> nodes;  ///< as they are in the chunks; `first` counts their points
  std::vector<EncodedChunk> chunks;
  std::size_t points = 0;
  std::size_t text_bytes = 0;  ///< of all chunks
};

/// Step of a node of this side.
[[nodiscard]] double step_m_of(double node_side_m, double step_m);

/// Level by level until `budget_bytes` of text are used: the last level that does not fit whole is thinned
/// out evenly, finer ones are left out. On all cores; the result does not depend on their number.
[[nodiscard]] EncodedCloud encode_cloud(const CloudOctree& tree, std::size_t scan_count, double step_m,
                                        std::size_t budget_bytes = std::numeric_limits<std::size_t>::max(),
                                        bool has_intensity = false);

}  // namespace alces::offline
