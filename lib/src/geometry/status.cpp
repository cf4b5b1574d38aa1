#include "alces/status.h"

namespace alces {

const char* to_string(Status status) {
  switch (status) {
    case Status::ok:
      return "ok";
    case Status::block_too_small:
      return "the memory block is smaller than memory_required()";
    case Status::block_misaligned:
      return "the memory block does not start on a 64-byte boundary";
    case Status::bad_config:
      return "a configuration value is out of its range";
    case Status::no_scan_capacity:
      return "the configured number of scans is reached";
    case Status::no_edge_capacity:
      return "the configured number of edges is reached";
    case Status::no_point_capacity:
      return "the point pool is full and there is no archive";
    case Status::no_voxel_capacity:
      return "the scan has more cells than the voxel table";
    case Status::empty_scan:
      return "the scan holds no usable point";
    case Status::bad_pose:
      return "a pose is not finite or not a rigid transform";
    case Status::no_such_scan:
      return "there is no scan of this index";
    case Status::no_such_vertex:
      return "there is no vertex of this index";
    case Status::bad_edge:
      return "an edge joins a vertex to itself or has a variance that is not positive";
    case Status::buffer_too_small:
      return "the output buffer is too small";
    case Status::bad_channel:
      return "a channel of the scan does not fit its points, or there is no room for it";
    case Status::archive_write_failed:
      return "the scan archive could not be written";
    case Status::archive_read_failed:
      return "the scan archive could not be read";
    case Status::disconnected:
      return "no way through the graph joins the two vertices";
    case Status::no_loop:
      return "the loop's first and last vertex are the same";
  }
  return "unknown status";
}

}  // namespace alces
