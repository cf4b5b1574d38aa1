#include "alces_offline/file_archive.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string_view>
#include <system_error>
#include <utility>

#include "alces_offline/error.h"

namespace alces::offline {
namespace {

constexpr std::string_view first_line = "alces scan archive 1\n";

std::string message(int error_number) {
  return std::generic_category().message(error_number);
}

}  // namespace

FileArchive::FileArchive(std::filesystem::path file, std::uint32_t scan_capacity) : file_(std::move(file)) {
  const auto refuse = [this](const std::string& reason) {
    if (descriptor_ >= 0) ::close(descriptor_);
    throw OutputError(file_, reason);
  };
  descriptor_ = ::open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0)
    refuse("the scan archive cannot be made (" + message(errno) + "); name a file in a folder of yours");
  struct stat status {};
  if (::fstat(descriptor_, &status) == 0 && S_ISREG(status.st_mode) && status.st_size > 0) {
    std::array<char, first_line.size()> begin{};
    const ssize_t count = ::pread(descriptor_, begin.data(), begin.size(), 0);
    if (count != static_cast<ssize_t>(begin.size()) ||
        std::string_view(begin.data(), begin.size()) != first_line)
      refuse("exists and is no scan archive, so it is not overwritten; give --archive another name");
    if (::ftruncate(descriptor_, 0) != 0) refuse("cannot be emptied (" + message(errno) + ")");
  }
  if (::pwrite(descriptor_, first_line.data(), first_line.size(), 0) !=
      static_cast<ssize_t>(first_line.size()))
    refuse("the scan archive cannot be written (" + message(errno) + "); free some space or write elsewhere");
  end_ = first_line.size();
  records_.reserve(scan_capacity);
}

FileArchive::~FileArchive() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

bool FileArchive::fail(const std::string& what) {
  if (problem_.empty()) problem_ = file_.string() + ": " + what;
  return false;
}

bool FileArchive::write(std::uint32_t scan, std::span<const std::byte> bytes) {
  if (!records_.empty() && records_.back().scan >= scan)
    return fail(fmt::format("scan {} came out of order", scan));
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count =
        ::pwrite(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(end_ + done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0)
      return fail(fmt::format("scan {} cannot be archived ({}); free some space or name a file elsewhere",
                              scan, message(errno)));
    done += static_cast<std::size_t>(count);
  }
  records_.push_back({scan, bytes.size(), end_});
  end_ += bytes.size();
  return true;
}

bool FileArchive::read(std::uint32_t scan, std::span<std::byte> bytes) {
  const auto record = std::lower_bound(records_.begin(), records_.end(), scan,
                                       [](const Record& r, std::uint32_t wanted) { return r.scan < wanted; });
  if (record == records_.end() || record->scan != scan || record->bytes != bytes.size())
    return fail(fmt::format("scan {} was not archived in {} bytes", scan, bytes.size()));
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = ::pread(descriptor_, bytes.data() + done, bytes.size() - done,
                                  static_cast<off_t>(record->position + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0)
      return fail(fmt::format("scan {} cannot be read back ({}); map again", scan, message(errno)));
    if (count == 0)
      return fail(fmt::format("ends within scan {}; was the file changed meanwhile? Map again", scan));
    done += static_cast<std::size_t>(count);
  }
  return true;
}

}  // namespace alces::offline
