#include "alces_platform/recording/scan_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string_view>

namespace alces {

static_assert(sizeof(off_t) == 8, "files end at 2 GiB: build with _FILE_OFFSET_BITS=64");
namespace {

constexpr std::string_view first_line = "alces scan archive 1\n";

}  // namespace

const char* to_string(ScanFileProblem problem) {
  switch (problem) {
    case ScanFileProblem::none:
      return "none";
    case ScanFileProblem::cannot_make:
      return "the scan archive cannot be made";
    case ScanFileProblem::in_use:
      return "is the scan archive of another process";
    case ScanFileProblem::not_an_archive:
      return "exists and is no scan archive, so it is not overwritten";
    case ScanFileProblem::cannot_empty:
      return "the scan archive of before cannot be emptied";
    case ScanFileProblem::cannot_write_begin:
      return "the scan archive cannot be written";
    case ScanFileProblem::out_of_order:
      return "a scan came out of order";
    case ScanFileProblem::too_many:
      return "more scans than there is room for in the index";
    case ScanFileProblem::cannot_write:
      return "a scan cannot be archived";
    case ScanFileProblem::not_archived:
      return "a scan was not archived in this size";
    case ScanFileProblem::cannot_read:
      return "a scan cannot be read back";
    case ScanFileProblem::ends_early:
      return "the file ends within a scan, somebody changed it meanwhile";
  }
  return "unknown";
}

ScanFile::~ScanFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

bool ScanFile::fail(ScanFileProblem problem, std::uint32_t scan, int error_number) {
  if (problem_ == ScanFileProblem::none) {
    problem_ = problem;
    problem_scan_ = scan;
    error_number_ = error_number;
  }
  return false;
}

bool ScanFile::open(const char* path, std::uint32_t scan_capacity) {
  descriptor_ = ::open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) return fail(ScanFileProblem::cannot_make, 0, errno);
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    return fail(ScanFileProblem::in_use, 0, 0);
  struct stat status {};
  if (::fstat(descriptor_, &status) == 0 && S_ISREG(status.st_mode) && status.st_size > 0) {
    std::array<char, first_line.size()> begin{};
    const ssize_t count = ::pread(descriptor_, begin.data(), begin.size(), 0);
    if (count != static_cast<ssize_t>(begin.size()) ||
        std::string_view(begin.data(), begin.size()) != first_line)
      return fail(ScanFileProblem::not_an_archive, 0, 0);
    if (::ftruncate(descriptor_, 0) != 0) return fail(ScanFileProblem::cannot_empty, 0, errno);
  }
  if (::pwrite(descriptor_, first_line.data(), first_line.size(), 0) !=
      static_cast<ssize_t>(first_line.size()))
    return fail(ScanFileProblem::cannot_write_begin, 0, errno);
  end_ = first_line.size();
  capacity_ = scan_capacity;
  records_.reserve(scan_capacity);
  return true;
}

bool ScanFile::write(std::uint32_t scan, std::span<const std::byte> bytes) {
  if (!records_.empty() && records_.back().scan >= scan) return fail(ScanFileProblem::out_of_order, scan, 0);
  if (records_.size() >= capacity_) return fail(ScanFileProblem::too_many, scan, 0);
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count =
        ::pwrite(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(end_ + done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return fail(ScanFileProblem::cannot_write, scan, count < 0 ? errno : ENOSPC);
    done += static_cast<std::size_t>(count);
  }
  records_.push_back({scan, bytes.size(), end_});
  end_ += bytes.size();
  return true;
}

bool ScanFile::read(std::uint32_t scan, std::span<std::byte> bytes) {
  const auto record = std::lower_bound(records_.begin(), records_.end(), scan,
                                       [](const Record& r, std::uint32_t wanted) { return r.scan < wanted; });
  if (record == records_.end() || record->scan != scan || record->bytes != bytes.size())
    return fail(ScanFileProblem::not_archived, scan, 0);
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = ::pread(descriptor_, bytes.data() + done, bytes.size() - done,
                                  static_cast<off_t>(record->position + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return fail(ScanFileProblem::cannot_read, scan, errno);
    if (count == 0) return fail(ScanFileProblem::ends_early, scan, 0);
    done += static_cast<std::size_t>(count);
  }
  return true;
}

}  // namespace alces
