#include "alces_onboard/page/page_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <linux/magic.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <optional>
#include <system_error>
#include <vector>

#include "alces_onboard/error.h"
#include "alces_platform/linux/clock.h"

namespace alces::onboard {
namespace {

[[noreturn]] void fail(ExitStatus status, const std::string& path, const std::string& what) {
  throw Error(status, fmt::format("{}: {}", path, what));
}

std::string reason_of(int error_number) {
  return std::generic_category().message(error_number);
}

[[noreturn]] void fail_to_make(const std::string& path) {
  fail(ExitStatus::device, path,
       fmt::format("the page cannot be made ({}); name a file in a folder on tmpfs that alcesd may write to",
                   reason_of(errno)));
}

/// The page before this one, if there is one. Error: what is there must not be replaced.
FileDescriptor open_last(const std::string& path) {
  FileDescriptor last(::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (!last) {
    if (errno == ENOENT) return last;
    fail_to_make(path);
  }
  std::array<char, sizeof(alces_page_head::magic)> magic{};
  if (::pread(last.number(), magic.data(), magic.size(), 0) != static_cast<ssize_t>(magic.size()) ||
      std::memcmp(magic.data(), ALCES_PAGE_MAGIC, magic.size()) != 0)
    fail(ExitStatus::configuration, path, "is another program's file; name one that may be replaced");
  if (::flock(last.number(), LOCK_EX | LOCK_NB) != 0)
    fail(ExitStatus::device, path, "another alcesd writes this page; give each its own [page] path");
  return last;
}

/// Through the file: a mapping of what others may have cut off would be a risk.
void mark_replaced(const FileDescriptor& last) {
  const std::uint32_t state = ALCES_PAGE_REPLACED;
  constexpr off_t place = offsetof(alces_page, head) + offsetof(alces_page_head, state);
  if (last) static_cast<void>(::pwrite(last.number(), &state, sizeof state, place) + 0);
}

/// None: none is asked for.
std::optional<gid_t> find_group(const settings::PageSettings& settings) {
  if (settings.group.empty()) return std::nullopt;
  std::vector<char> room(16384);
  struct group entry {};
  struct group* found = nullptr;
  if (::getgrnam_r(settings.group.c_str(), &entry, room.data(), room.size(), &found) != 0 || found == nullptr)
    fail(ExitStatus::configuration, settings.path,
         fmt::format("there is no group {} that may read the page ([page] group)", settings.group));
  return entry.gr_gid;
}

void set_permissions(const FileDescriptor& file, const settings::PageSettings& settings) {
  const auto group = find_group(settings);
  if (group && ::fchown(file.number(), static_cast<uid_t>(-1), *group) != 0)
    fail(ExitStatus::device, settings.path,
         fmt::format("the page cannot be given to the group {} ({}); make alcesd's user a member",
                     settings.group, reason_of(errno)));
  const auto mode = static_cast<mode_t>(std::stoul(settings.mode, nullptr, 8));
  if (::fchmod(file.number(), mode) != 0) fail_to_make(settings.path);
}

void require_memory(const FileDescriptor& file, const std::string& path) {
  struct statfs system {};
  if (::fstatfs(file.number(), &system) != 0) fail_to_make(path);
  const auto type = static_cast<unsigned long>(system.f_type);  // NOLINT(google-runtime-int): the system's
  if (type != TMPFS_MAGIC && type != RAMFS_MAGIC)
    fail(ExitStatus::configuration, path,
         "the page must lie in memory, for a disk would hold the acquisition thread up; name a file below "
         "/run or /dev/shm");
}

void begin(alces_page& page) {
  alces_page_head& head = page.head;
  std::memcpy(head.magic, ALCES_PAGE_MAGIC, sizeof head.magic);
  head.start_id = static_cast<std::uint64_t>(system_clocks.realtime_ns()) | 1U;  // never 0
  head.start_ns = now_ns();
  head.version = ALCES_PAGE_VERSION;
  head.size = sizeof(alces_page);
  head.state = ALCES_PAGE_LIVE;
  head.pid = static_cast<std::uint32_t>(::getpid());
}

}  // namespace

PageFile::PageFile(const settings::PageSettings& settings) {
  const std::string& path = settings.path;
  const FileDescriptor last = open_last(path);
  const std::string made = fmt::format("{}.{}", path, ::getpid());
  std::remove(made.c_str());  // of a process of this number that died just here
  file_ = FileDescriptor(::open(made.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (!file_) fail_to_make(path);
  try {
    require_memory(file_, path);
    set_permissions(file_, settings);
    // All of its memory now: a store must not find that there is none left.
    if (const int failed = ::posix_fallocate(file_.number(), 0, sizeof(alces_page)); failed != 0) {
      errno = failed;
      fail_to_make(path);
    }
    if (::flock(file_.number(), LOCK_EX | LOCK_NB) != 0) fail_to_make(path);
    void* const address = ::mmap(nullptr, sizeof(alces_page), PROT_READ | PROT_WRITE,
                                 MAP_SHARED | MAP_POPULATE, file_.number(), 0);
    if (address == MAP_FAILED) fail_to_make(path);
    page_ = static_cast<alces_page*>(address);
    begin(*page_);
    if (std::rename(made.c_str(), path.c_str()) != 0) fail_to_make(path);
  } catch (...) {
    std::remove(made.c_str());
    if (page_ != nullptr) ::munmap(page_, sizeof(alces_page));
    throw;
  }
  mark_replaced(last);
}

PageFile::~PageFile() {
  end();
  ::munmap(page_, sizeof(alces_page));
}

void PageFile::end() {
  __atomic_store_n(&page_->head.state, std::uint32_t{ALCES_PAGE_ENDED}, __ATOMIC_RELEASE);
}

}  // namespace alces::onboard
