// What a call of the library answers. Every function that can fail returns a Status; none throws.
#pragma once

namespace alces {

enum class Status {
  ok,
  block_too_small,       ///< the block handed to create() is smaller than memory_required()
  block_misaligned,      ///< the block does not start on a 64-byte boundary
  bad_config,            ///< a configuration value is out of its range
  no_scan_capacity,      ///< the configured number of scans is reached
  no_edge_capacity,      ///< the configured number of edges is reached
  no_point_capacity,     ///< the point pool is full and there is no archive
  no_voxel_capacity,     ///< the scan has more cells than the voxel table: it was downsampled to larger ones
  empty_scan,            ///< no usable point was left after the range and finiteness checks
  bad_pose,              ///< a pose holds NaN, Inf or a rotation that is no unit quaternion
  no_such_scan,          ///< the index is not that of a scan of this map
  no_such_vertex,        ///< an edge names a vertex that the graph does not have
  bad_edge,              ///< an edge joins a vertex to itself or has a variance that is not positive
  buffer_too_small,      ///< the caller's output span cannot hold the answer
  bad_channel,           ///< a channel of a scan does not fit its points, or there is no room for it
  archive_write_failed,  ///< the ScanArchive could not store a scan
  archive_read_failed,   ///< the ScanArchive could not bring a scan back
  disconnected,          ///< no way through the graph joins the two vertices
  no_loop,               ///< the loop's first and last vertex are the same
};

/// A short English sentence for people; never null, static storage.
[[nodiscard]] const char* to_string(Status status);

}  // namespace alces
