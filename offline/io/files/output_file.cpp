#include "output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <mutex>
#include <string>
#include <system_error>
#include <utility>

#include "error.h"

namespace alces::offline {
namespace {

constexpr std::size_t buffer_bytes = std::size_t{1} << 20;

std::string reason(int error_number) {
  const std::string message = std::generic_category().message(error_number);
  switch (error_number) {
    case ENOSPC:
      return "cannot be written, the disk is full (" + message + "); free some space or write elsewhere";
    case EACCES:
    case EPERM:
    case EROFS:
      return "cannot be written (" + message + "); write to a folder of yours";
    case ENOENT:
    case ENOTDIR:
      return "cannot be written (" + message + "); its folder must exist and be a folder";
    case EISDIR:
      return "cannot be written, a folder of that name is in the way; remove it or write elsewhere";
    default:
      return "cannot be written (" + message + ")";
  }
}

/// Folders whose files are synced together.
struct SyncedFolders {
  std::mutex mutex;
  std::vector<std::filesystem::path> folders;
};
SyncedFolders& synced_folders() {
  static SyncedFolders folders;
  return folders;
}

bool is_synced_later(const std::filesystem::path& file) {
  const std::scoped_lock lock(synced_folders().mutex);
  return std::ranges::any_of(synced_folders().folders, [&file](const std::filesystem::path& folder) {
    return file.native().starts_with(folder.native() + '/');
  });
}

int sync_to_disk(int descriptor) {
  while (::fsync(descriptor) != 0) {
    if (errno != EINTR) return errno;
  }
  return 0;
}

}  // namespace

SyncedTogether::SyncedTogether(std::filesystem::path folder) : folder_(std::move(folder)) {
  const std::scoped_lock lock(synced_folders().mutex);
  synced_folders().folders.push_back(folder_);
}

SyncedTogether::~SyncedTogether() {
  const std::scoped_lock lock(synced_folders().mutex);
  auto& folders = synced_folders().folders;
  folders.erase(std::ranges::find(folders, folder_));
}

OutputFile::OutputFile(std::filesystem::path file) : file_(std::move(file)) {
  struct stat status {};
  std::filesystem::path target = file_;
  const bool exists = ::stat(file_.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) fail(EISDIR);
  if (!exists || S_ISREG(status.st_mode)) {
    std::error_code ignored;
    // a symbolic link stays one: the file it leads to is replaced
    if (exists && std::filesystem::is_symlink(file_, ignored))
      file_ = std::filesystem::canonical(file_, ignored);
    part_ = file_;
    part_ += ".part";
    target = part_;
  }
  descriptor_ = ::open(target.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor_ < 0) {
    const int error_number = errno;
    part_.clear();  // not ours to remove
    fail(error_number);
  }
  buffer_.reserve(buffer_bytes);
}

OutputFile::~OutputFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  if (!part_.empty()) ::unlink(part_.c_str());
}

void OutputFile::fail(int error_number) {
  throw OutputError(file_, reason(error_number));
}

void OutputFile::write_fully(const char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t written = ::write(descriptor_, data, size);
    if (written < 0) {
      if (errno == EINTR) continue;
      fail(errno);
    }
    data += written;
    size -= static_cast<std::size_t>(written);
  }
}

void OutputFile::flush() {
  write_fully(buffer_.data(), buffer_.size());
  buffer_.clear();
}

void OutputFile::write(std::string_view bytes) {
  if (buffer_.size() + bytes.size() > buffer_bytes) flush();
  if (bytes.size() >= buffer_bytes) {
    write_fully(bytes.data(), bytes.size());
  } else {
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  }
}

void OutputFile::patch(std::uint64_t position, std::string_view bytes) {
  flush();
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(position));
    if (written < 0) {
      if (errno == EINTR) continue;
      fail(errno);
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
    position += static_cast<std::uint64_t>(written);
  }
}

void OutputFile::commit() {
  flush();
  const bool is_file = !part_.empty();
  int error_number = is_file && !is_synced_later(file_) ? sync_to_disk(descriptor_) : 0;
  if (::close(std::exchange(descriptor_, -1)) != 0 && error_number == 0) error_number = errno;
  if (error_number != 0) {
    if (!part_.empty()) ::unlink(part_.c_str());
    fail(error_number);
  }
  if (is_file && ::rename(part_.c_str(), file_.c_str()) != 0) {
    error_number = errno;
    ::unlink(part_.c_str());
    fail(error_number);
  }
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!error && !std::filesystem::is_directory(folder))
    error = std::make_error_code(std::errc::not_a_directory);
  if (error) throw OutputError(folder, "the folder cannot be made (" + error.message() + ")");
}

}  // namespace alces::offline
