#include "spooled_scan_source.h"

#include "offline/io/files/scratch_file.h"

namespace alces::offline {
namespace {

template <class T>
std::uint64_t bytes_of(const std::vector<T>& values) {
  return values.size() * sizeof(T);
}

/// The end of what was written.
template <class T>
std::uint64_t write(ScratchFile& file, std::uint64_t at, const std::vector<T>& values) {
  if (!values.empty()) file.write(at, values.data(), bytes_of(values));
  return at + bytes_of(values);
}

template <class T>
std::uint64_t read(const ScratchFile& file, std::uint64_t at, std::size_t count, std::vector<T>& values) {
  values.resize(count);
  if (count > 0) file.read(at, values.data(), bytes_of(values));
  return at + bytes_of(values);
}

}  // namespace

SpooledScanSource::SpooledScanSource(ScanSource& source, const std::filesystem::path& folder,
                                     const std::function<void(std::size_t, std::size_t)>& progress)
    : file_(std::make_unique<ScratchFile>(folder)) {
  std::uint64_t end = 0;
  ScanPoints scan;
  for (std::size_t i = 0; i < source.size() && source.read(i, scan); ++i) {
    scans_.push_back({end, scan.size(), !scan.time_s.empty(), !scan.intensity.empty(), source.name(i),
                      source.number(i), source.odometry(i), source.stamp_s(i)});
    end = write(*file_, end, scan.points);
    end = write(*file_, end, scan.time_s);
    end = write(*file_, end, scan.intensity);
    if (progress) progress(i + 1, source.size());
  }
  description_ = source.description();
  warnings_ = source.warnings();
}

SpooledScanSource::~SpooledScanSource() = default;

bool SpooledScanSource::read(std::size_t index, ScanPoints& scan) {
  if (index >= scans_.size()) return false;
  const Scan& kept = scans_[index];
  std::uint64_t at = offline::read(*file_, kept.begin, kept.points, scan.points);
  at = offline::read(*file_, at, kept.has_time ? kept.points : 0, scan.time_s);
  offline::read(*file_, at, kept.has_intensity ? kept.points : 0, scan.intensity);
  return true;
}

}  // namespace alces::offline
