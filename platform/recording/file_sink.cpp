#include "alces_platform/recording/file_sink.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>

namespace alces {

static_assert(sizeof(off_t) == 8, "files end at 2 GiB: build with _FILE_OFFSET_BITS=64");

FileSink::~FileSink() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

bool FileSink::open(const char* path, Existing existing) {
  if (descriptor_ >= 0) ::close(descriptor_);
  size_ = 0;
  error_number_ = 0;
  const int exclusive = existing == Existing::refuse ? O_EXCL : 0;
  descriptor_ = ::open(path, O_RDWR | O_CREAT | O_CLOEXEC | exclusive, 0666);
  struct stat status {};
  if (descriptor_ < 0 || ::fstat(descriptor_, &status) != 0) {
    error_number_ = errno;
  } else if (!S_ISREG(status.st_mode)) {
    error_number_ = ESPIPE;  // it could not be cut back to the last whole write
  } else if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    error_number_ = errno == EWOULDBLOCK ? EBUSY : errno;
  } else if (::ftruncate(descriptor_, 0) != 0) {
    error_number_ = errno;
  }
  if (error_number_ == 0) return true;
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
  return false;
}

bool FileSink::write(std::span<const std::uint8_t> bytes) {
  if (descriptor_ < 0) {
    error_number_ = EBADF;
    return false;
  }
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t written =
        ::pwrite(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(size_ + done));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      error_number_ = written < 0 ? errno : ENOSPC;
      // Should even this fail, the next write still starts at size_ and covers what is left there.
      if (::ftruncate(descriptor_, static_cast<off_t>(size_)) != 0 && error_number_ == 0)
        error_number_ = errno;
      return false;
    }
    done += static_cast<std::size_t>(written);
  }
#ifdef SYNC_FILE_RANGE_WRITE
  // A hint: on file systems that know nothing of it the data goes to the disk a little later.
  static_cast<void>(::sync_file_range(descriptor_, static_cast<off64_t>(size_),
                                      static_cast<off64_t>(bytes.size()), SYNC_FILE_RANGE_WRITE));
#endif
  size_ += bytes.size();
  return true;
}

bool FileSink::read_back(std::uint64_t position, std::span<std::uint8_t> bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got =
        ::pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(position + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) {
      error_number_ = got < 0 ? errno : EIO;  // what was written is not there
      return false;
    }
    done += static_cast<std::size_t>(got);
  }
  return true;
}

bool FileSink::sync() {
  const int failed = sync_data(descriptor_);
  if (failed != 0) error_number_ = failed;
  return failed == 0;
}

bool FileSink::close() {
  if (descriptor_ < 0) return true;
  const bool closed = ::close(descriptor_) == 0;
  if (!closed) error_number_ = errno;
  descriptor_ = -1;
  return closed;
}

int sync_data(int descriptor) {
  return ::fdatasync(descriptor) == 0 ? 0 : errno;
}

int sync_folder(const char* folder) {
  const int descriptor = ::open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return errno;
  const int failed = ::fsync(descriptor) == 0 ? 0 : errno;
  ::close(descriptor);
  return failed == EINVAL ? 0 : failed;
}

}  // namespace alces
