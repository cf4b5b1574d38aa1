#include "map_deskew.h"

#include <utility>

namespace alces::offline {

MapDeskewedSource::MapDeskewedSource(std::unique_ptr<ScanSource> scans, const Trajectory& trajectory,
                                     const std::vector<std::size_t>& source_index)
    : scans_(std::move(scans)), poses_(scans_->size()) {
  for (std::size_t row = 0; row < source_index.size(); ++row)
    poses_.at(source_index[row]) = trajectory.poses[row];
}

bool MapDeskewedSource::read(std::size_t index, ScanPoints& scan) {
  if (!scans_->read(index, scan)) return false;
  deskew_.deskew(*this, index, scan);
  return true;
}

}  // namespace alces::offline
