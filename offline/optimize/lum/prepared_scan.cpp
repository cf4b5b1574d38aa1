#include "prepared_scan.h"

#include <cstring>

namespace alces::offline {
namespace {

struct PreparedHeader {
  std::uint32_t points = 0;
  std::uint32_t samples = 0;
};

std::size_t tree_bytes(std::uint32_t points) {
  Arena counting;
  const KdTree tree(counting, points);
  return counting.used_bytes();
}

}  // namespace

void PreparedScan::reserve(std::uint32_t points) {
  block_ = std::make_unique<settings::MemoryBlock>(tree_bytes(points));
  Arena arena(block_->bytes());
  tree_ = KdTree(arena, points);
}

std::size_t PreparedScan::bytes() const {
  return (block_ ? block_->bytes().size() : 0) + samples_.size() * sizeof(SurfaceSample);
}

std::string PreparedScan::to_bytes() const {
  std::vector<Point> points(tree_.size());
  for (std::uint32_t i = 0; i < tree_.size(); ++i) points[i] = tree_.point(i);
  const PreparedHeader header{tree_.size(), static_cast<std::uint32_t>(samples_.size())};
  std::string bytes(sizeof(header) + points.size() * sizeof(Point) + samples_.size() * sizeof(SurfaceSample),
                    '\0');
  char* to = bytes.data();
  std::memcpy(to, &header, sizeof(header));
  to += sizeof(header);
  if (!points.empty()) std::memcpy(to, points.data(), points.size() * sizeof(Point));
  to += points.size() * sizeof(Point);
  if (!samples_.empty()) std::memcpy(to, samples_.data(), samples_.size() * sizeof(SurfaceSample));
  return bytes;
}

bool PreparedScan::from_bytes(std::string_view bytes) {
  PreparedHeader header;
  if (bytes.size() < sizeof(header)) return false;
  std::memcpy(&header, bytes.data(), sizeof(header));
  const std::size_t expected = sizeof(header) + std::size_t{header.points} * sizeof(Point) +
                               std::size_t{header.samples} * sizeof(SurfaceSample);
  if (bytes.size() != expected || header.samples > header.points) return false;
  if (header.points == 0) {
    *this = PreparedScan();
    return true;
  }
  std::vector<Point> points(header.points);
  const char* from = bytes.data() + sizeof(header);
  std::memcpy(points.data(), from, points.size() * sizeof(Point));
  from += points.size() * sizeof(Point);
  samples_.resize(header.samples);
  if (!samples_.empty()) std::memcpy(samples_.data(), from, samples_.size() * sizeof(SurfaceSample));
  reserve(header.points);
  return tree_.restore(points);
}

std::size_t ScanPreparation::bytes_needed(const VoxelGridConfig& voxel) {
  Arena counting;
  const VoxelGrid grid(counting, voxel);
  const KdTreeScratch scratch(counting, voxel.cell_capacity);
  return counting.used_bytes();
}

ScanPreparation::ScanPreparation(const LumSettings& settings)
    : voxel_(settings.voxel),
      surface_{settings.samples, settings.neighbors, settings.neighbor_reach},
      block_(bytes_needed(settings.voxel)),
      reduced_(settings.voxel.cell_capacity) {
  Arena arena(block_.bytes());
  grid_ = std::make_unique<VoxelGrid>(arena, voxel_);
  scratch_ = std::make_unique<KdTreeScratch>(arena, voxel_.cell_capacity);
}

PreparedScan ScanPreparation::prepare(std::span<const Point> points) {
  PreparedScan scan;
  VoxelGridCounts counts;
  const Status status = grid_->reduce(points, reduced_, counts);
  if ((status != Status::ok && status != Status::no_voxel_capacity) || counts.kept == 0) return scan;
  scan.reserve(counts.kept);
  if (!scan.tree_.build(std::span(reduced_).first(counts.kept), *scratch_)) return {};
  scan.samples_.resize(surface_.sample_capacity);
  const ScanSpacing spacing = measure_spacing(scan.tree_, surface_.neighbors);
  scan.samples_.resize(sample_surface(scan.tree_, surface_, spacing, scan.samples_));
  return scan;
}

}  // namespace alces::offline
