#include "alces_onboard/run_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "alces_onboard/error.h"

namespace alces::onboard {
namespace {

constexpr const char* file_name = "/alcesd.lock";
constexpr const char* usual_folder = "/run/alces";

/// In the order in which they are looked at.
std::vector<std::string> folders() {
  std::vector<std::string> found;
  for (const char* variable : {"RUNTIME_DIRECTORY", "XDG_RUNTIME_DIR"}) {
    const char* const folder = std::getenv(variable);
    if (folder != nullptr && *folder == '/') found.emplace_back(folder);
  }
  found.emplace_back(usual_folder);
  return found;
}

struct flock whole_file() {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return lock;
}

}  // namespace

bool RunLock::take() {
  const std::string path = folders().front() + file_name;
  file_ = FileDescriptor(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644));
  if (!file_) {
    error_.set("%s: cannot be opened (%s)", path.c_str(), std::strerror(errno));
    return false;
  }
  struct flock lock = whole_file();
  if (::fcntl(file_.number(), F_SETLK, &lock) == 0) return true;
  error_.set("%s: cannot be locked (%s): another alcesd runs", path.c_str(), std::strerror(errno));
  file_.reset();
  return false;
}

void reset_motor_of_running_program() {
  for (const std::string& folder : folders()) {
    const FileDescriptor file(::open((folder + file_name).c_str(), O_RDONLY | O_CLOEXEC));
    struct flock lock = whole_file();
    if (!file || ::fcntl(file.number(), F_GETLK, &lock) != 0 || lock.l_type == F_UNLCK) continue;
    if (::kill(lock.l_pid, SIGUSR1) == 0) return;
    throw Error(
        ExitStatus::device,
        fmt::format("alcesd runs as process {} and cannot be told ({}); run this as the same user or as root",
                    lock.l_pid, std::strerror(errno)));
  }
  throw Error(ExitStatus::device, "no alcesd runs here whose motor could be reset");
}

}  // namespace alces::onboard
