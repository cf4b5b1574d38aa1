#include "scratch_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>

#include "error.h"

namespace alces::offline {

ScratchFile::ScratchFile(std::filesystem::path folder) : folder_(std::move(folder)) {
  std::string name = (folder_ / ".alces_scratch_XXXXXX").string();
  descriptor_ = ::mkostemp(name.data(), O_CLOEXEC);
  if (descriptor_ < 0) fail("no scratch file for scans can be made");
  ::unlink(name.c_str());
}

ScratchFile::~ScratchFile() {
  ::close(descriptor_);
}

void ScratchFile::write(std::uint64_t position, const void* data, std::size_t bytes) {
  for (std::size_t done = 0; done < bytes;) {
    const ssize_t wrote = ::pwrite(descriptor_, static_cast<const char*>(data) + done, bytes - done,
                                   static_cast<off_t>(position + done));
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) fail("the scratch file for scans cannot be written");
    done += static_cast<std::size_t>(wrote);
  }
}

void ScratchFile::read(std::uint64_t position, void* data, std::size_t bytes) const {
  for (std::size_t done = 0; done < bytes;) {
    const ssize_t got = ::pread(descriptor_, static_cast<char*>(data) + done, bytes - done,
                                static_cast<off_t>(position + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) fail("the scratch file for scans cannot be read back");
    done += static_cast<std::size_t>(got);
  }
}

void ScratchFile::fail(const char* what) const {
  throw OutputError(folder_, fmt::format("{} ({}); make room there", what, std::strerror(errno)));
}

}  // namespace alces::offline
