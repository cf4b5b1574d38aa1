#include "spooled_scan_source.h"

#include "offline/io/files/scratch_file.h"

namespace alces::offline {

SpooledScanSource::SpooledScanSource(ScanSource& source, const std::filesystem::path& folder,
                                     const std::function<void(std::size_t, std::size_t)>& progress)
    : file_(std::make_unique<ScratchFile>(folder)) {
  std::uint64_t end = 0;
  std::vector<Point> points;
  for (std::size_t i = 0; i < source.size() && source.read(i, points); ++i) {
    file_->write(end, points.data(), points.size() * sizeof(Point));
    scans_.push_back(
        {end, points.size(), source.name(i), source.number(i), source.odometry(i), source.stamp_s(i)});
    end += points.size() * sizeof(Point);
    if (progress) progress(i + 1, source.size());
  }
  description_ = source.description();
  warnings_ = source.warnings();
}

SpooledScanSource::~SpooledScanSource() = default;

bool SpooledScanSource::read(std::size_t index, std::vector<Point>& points) {
  if (index >= scans_.size()) return false;
  points.resize(scans_[index].points);
  file_->read(scans_[index].begin, points.data(), points.size() * sizeof(Point));
  return true;
}

}  // namespace alces::offline
