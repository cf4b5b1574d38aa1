#include "alces_offline/spooled_scan_source.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "alces_offline/error.h"

namespace alces::offline {
namespace {

std::string reason(int error_number) {
  return std::generic_category().message(error_number);
}

int open_without_name(const std::filesystem::path& folder) {
  std::string name = (folder / ".scans_XXXXXX").string();
  const int descriptor = ::mkstemp(name.data());
  if (descriptor < 0) throw OutputError(folder, "takes no files (" + reason(errno) + ")");
  ::unlink(name.c_str());
  return descriptor;
}

}  // namespace

SpooledScanSource::SpooledScanSource(ScanSource& source, const std::filesystem::path& folder,
                                     const Progress& progress, const std::function<bool()>& stop_requested)
    : folder_(folder), descriptor_(open_without_name(folder)) {
  std::uint64_t offset = 0;
  std::vector<Point> points;
  try {
    for (std::size_t index = 0; index < source.size(); ++index) {
      if (stop_requested && stop_requested()) {
        was_stopped_ = true;
        break;
      }
      if (!source.read(index, points)) break;
      const auto* bytes = reinterpret_cast<const char*>(points.data());
      const std::size_t size = points.size() * sizeof(Point);
      for (std::size_t written = 0; written < size;) {
        const ssize_t some =
            ::pwrite(descriptor_, bytes + written, size - written, static_cast<off_t>(offset + written));
        if (some < 0 && errno == EINTR) continue;
        if (some <= 0)
          throw OutputError(folder_, fmt::format("has no room for the scans ({}); {} MB were needed so far",
                                                 reason(errno), (offset + size) / 1'000'000));
        written += static_cast<std::size_t>(some);
      }
      scans_.push_back({offset, points.size(), source.name(index), source.number(index),
                        source.odometry(index), source.stamp_s(index)});
      offset += size;
      if (progress) progress(index + 1, source.size());
    }
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
  description_ = source.description();
  warnings_ = source.warnings();
}

SpooledScanSource::~SpooledScanSource() {
  ::close(descriptor_);
}

bool SpooledScanSource::read(std::size_t index, std::vector<Point>& points) {
  if (index >= scans_.size()) return false;
  last_read_ = index;
  const Scan& scan = scans_[index];
  points.resize(scan.points);
  auto* bytes = reinterpret_cast<char*>(points.data());
  const std::size_t size = points.size() * sizeof(Point);
  for (std::size_t done = 0; done < size;) {
    const ssize_t some =
        ::pread(descriptor_, bytes + done, size - done, static_cast<off_t>(scan.offset + done));
    if (some < 0 && errno == EINTR) continue;
    if (some <= 0) throw InputError(folder_, fmt::format("does not give {} back; start again", scan.name));
    done += static_cast<std::size_t>(some);
  }
  return true;
}

}  // namespace alces::offline
