// Stands between a program and the C library (LD_PRELOAD) and makes one call fail, ends the program at one,
// or keeps a log of what is written and when it is on the disk. failing_calls.py drives it.
//
//   ALCES_FAIL=CALL:N:HOW   the N-th (from 1) CALL fails: HOW is an error's name (EIO), "short" (half of it
//   is done),
//                           or "kill" (SIGKILL, before the call). CALL "any": whichever is the N-th of all
//                           but malloc.
//   ALCES_FAIL_COUNTS=FILE  how often each was called, "CALL COUNT" a line, written at the end
//   ALCES_WRITE_LOG=FILE    a line for each change of the file system (see log_line)
//   ALCES_CAN_WIRE=FOLDER   CAN sockets are Unix sockets in FOLDER: two programs on one bus without the
//   kernel's vcan
//
// Calls that the C library makes inside itself (stdio's own write) are not seen: fread and fwrite are, as
// such.
#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
}

namespace {

enum Call : int {
  call_open,
  call_read,
  call_fread,
  call_write,
  call_fwrite,
  call_fsync,
  call_rename,
  call_mmap,
  call_malloc,
  call_socket,
  call_poll,
  call_ioctl,
  call_close,
  call_ftruncate,
  call_mkdir,
  call_unlink,
  call_flock,
  call_count
};
constexpr const char* names[call_count] = {"open",   "read",      "fread",  "write",  "fwrite", "fsync",
                                           "rename", "mmap",      "malloc", "socket", "poll",   "ioctl",
                                           "close",  "ftruncate", "mkdir",  "unlink", "flock"};

struct ErrorName {
  const char* name;
  int number;
};
constexpr ErrorName errors[] = {{"EIO", EIO},       {"ENOSPC", ENOSPC}, {"EINTR", EINTR}, {"ENOMEM", ENOMEM},
                                {"EMFILE", EMFILE}, {"EACCES", EACCES}, {"EXDEV", EXDEV}, {"EINVAL", EINVAL}};

constexpr int how_short = -1;
constexpr int how_kill = -2;
constexpr int any_call = call_count;

std::atomic<bool> is_ready{false};
int failing_call = -1;
long failing_number = 0;
int failing_how = 0;
std::atomic<long> counts[call_count];
std::atomic<long> all_count{0};
const char* counts_file = nullptr;
int log_descriptor = -1;
const char* can_folder = nullptr;

template <class Function>
Function next(const char* name, Function& cached) {
  if (cached == nullptr) {
    void* const found = dlsym(RTLD_NEXT, name);
    std::memcpy(&cached, &found, sizeof cached);
  }
  return cached;
}
#define NEXT(name) (next(#name, next_##name))
#define REAL(result, name, ...) static result (*next_##name)(__VA_ARGS__) = nullptr

/// 0: go on. Otherwise an error number, or how_short.
int verdict(Call call) {
  if (!is_ready.load(std::memory_order_relaxed)) return 0;
  const long mine = counts[call].fetch_add(1) + 1;
  const long all = call == call_malloc ? 0 : all_count.fetch_add(1) + 1;
  const bool is_it =
      failing_call == any_call ? all == failing_number : failing_call == call && mine == failing_number;
  if (!is_it) return 0;
  if (failing_how == how_kill) ::kill(::getpid(), SIGKILL);
  return failing_how;
}

/// True: the call fails, errno says why.
bool fails(Call call) {
  const int how = verdict(call);
  if (how <= 0) return false;
  errno = how;
  return true;
}

// ------------------------------------------------------------------------------------------ the log

REAL(ssize_t, write, int, const void*, std::size_t);
REAL(int, open, const char*, int, ...);

/// "WORD INODE NUMBER [NUMBER] PATHS..." and for data its bytes in hexadecimal; one write a line, so that
/// threads do not mix. Paths are absolute and hold no blank.
void log_text(const char* format, ...) {
  char line[3 * PATH_MAX];
  va_list arguments;
  va_start(arguments, format);
  const int size = std::vsnprintf(line, sizeof line, format, arguments);
  va_end(arguments);
  if (size > 0) (void)!NEXT(write)(log_descriptor, line, static_cast<std::size_t>(size));
}

bool is_logging() {
  return log_descriptor >= 0;
}

std::uint64_t inode_of(int descriptor) {
  struct stat status {};
  return ::fstat(descriptor, &status) == 0 && (S_ISREG(status.st_mode) || S_ISDIR(status.st_mode))
             ? status.st_ino
             : 0;
}

void absolute(int folder, const char* path, char* out) {
  if (path[0] == '/') {
    std::snprintf(out, PATH_MAX, "%s", path);
    return;
  }
  char base[PATH_MAX];
  if (folder == AT_FDCWD) {
    if (::getcwd(base, sizeof base) == nullptr) base[0] = '\0';
  } else {
    char link[64];
    std::snprintf(link, sizeof link, "/proc/self/fd/%d", folder);
    const ssize_t size = ::readlink(link, base, sizeof base - 1);
    base[size > 0 ? size : 0] = '\0';
  }
  if (std::snprintf(out, PATH_MAX, "%s/%s", base, path) >= PATH_MAX) out[0] = '\0';
}

void log_data(std::uint64_t inode, long long at, const void* data, std::size_t size) {
  if (inode == 0) return;
  const std::size_t room = 64 + 2 * size;
  char* const line = static_cast<char*>(__libc_malloc(room));
  if (line == nullptr) return;
  int length = std::snprintf(line, room, "data %llu %lld ", static_cast<unsigned long long>(inode), at);
  const auto* const bytes = static_cast<const unsigned char*>(data);
  for (std::size_t i = 0; i < size; ++i) {
    line[length++] = "0123456789abcdef"[bytes[i] >> 4];
    line[length++] = "0123456789abcdef"[bytes[i] & 15U];
  }
  line[length++] = '\n';
  (void)!NEXT(write)(log_descriptor, line, static_cast<std::size_t>(length));
  std::free(line);
}

// ------------------------------------------------------------------------------------------ start and end

__attribute__((constructor)) void begin() {
  counts_file = std::getenv("ALCES_FAIL_COUNTS");
  can_folder = std::getenv("ALCES_CAN_WIRE");
  if (const char* const file = std::getenv("ALCES_WRITE_LOG"); file != nullptr)
    log_descriptor = NEXT(open)(file, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (const char* const order = std::getenv("ALCES_FAIL"); order != nullptr) {
    char call[32];
    char how[32];
    if (std::sscanf(order, "%31[a-z]:%ld:%31s", call, &failing_number, how) == 3) {
      failing_call = std::strcmp(call, "any") == 0 ? any_call : -1;
      for (int i = 0; i < call_count; ++i) {
        if (std::strcmp(names[i], call) == 0) failing_call = i;
      }
      failing_how = std::strcmp(how, "kill") == 0    ? how_kill
                    : std::strcmp(how, "short") == 0 ? how_short
                                                     : EIO;
      for (const ErrorName& error : errors) {
        if (std::strcmp(error.name, how) == 0) failing_how = error.number;
      }
    }
  }
  is_ready = true;
}

__attribute__((destructor)) void end() {
  is_ready = false;
  log_descriptor = -1;
  if (counts_file == nullptr) return;
  std::FILE* const file = std::fopen(counts_file, "w");
  if (file == nullptr) return;
  for (int i = 0; i < call_count; ++i) std::fprintf(file, "%s %ld\n", names[i], counts[i].load());
  std::fprintf(file, "any %ld\n", all_count.load());
  std::fclose(file);
}

int opened(int descriptor, int folder, const char* path, int flags) {
  if (descriptor < 0 || !is_logging() || (flags & O_ACCMODE) == O_RDONLY) return descriptor;
  char name[PATH_MAX];
  absolute(folder, path, name);
  if (const std::uint64_t inode = inode_of(descriptor); inode != 0)
    log_text("open %llu %d %s\n", static_cast<unsigned long long>(inode), (flags & O_TRUNC) != 0 ? 1 : 0,
             name);
  return descriptor;
}

// ------------------------------------------------------------------------------------------ CAN without a
// kernel's

/// Of descriptors: a CAN socket that is a Unix socket.
bool is_can[1024];

bool is_can_socket(int descriptor) {
  return descriptor >= 0 && descriptor < 1024 && is_can[descriptor];
}

/// The first program takes one end of the wire, the second one the other.
int bind_can(int descriptor) {
  sockaddr_un mine{};
  mine.sun_family = AF_UNIX;
  REAL(int, bind, int, const sockaddr*, socklen_t);
  for (const char end : {'a', 'b'}) {
    std::snprintf(mine.sun_path, sizeof mine.sun_path, "%s/can.%c", can_folder, end);
    if (NEXT(bind)(descriptor, reinterpret_cast<const sockaddr*>(&mine), sizeof mine) == 0) return 0;
  }
  return -1;
}

/// A frame goes to the other end, if there is one; a bus without others takes it, too.
ssize_t send_can(int descriptor, const void* data, std::size_t size) {
  sockaddr_un own{};
  socklen_t length = sizeof own;
  if (::getsockname(descriptor, reinterpret_cast<sockaddr*>(&own), &length) != 0) return -1;
  char* const end = own.sun_path + std::strlen(own.sun_path) - 1;
  *end = *end == 'a' ? 'b' : 'a';
  const ssize_t sent =
      ::sendto(descriptor, data, size, MSG_DONTWAIT, reinterpret_cast<const sockaddr*>(&own), sizeof own);
  return sent < 0 && (errno == ENOENT || errno == ECONNREFUSED) ? static_cast<ssize_t>(size) : sent;
}

}  // namespace

extern "C" {

// ------------------------------------------------------------------------------------------ opening, closing

#define OPEN(name)                                                       \
  int name(const char* path, int flags, ...) {                           \
    static int (*next_##name)(const char*, int, ...) = nullptr;          \
    va_list arguments;                                                   \
    va_start(arguments, flags);                                          \
    const mode_t mode = va_arg(arguments, mode_t);                       \
    va_end(arguments);                                                   \
    if (fails(call_open)) return -1;                                     \
    return opened(NEXT(name)(path, flags, mode), AT_FDCWD, path, flags); \
  }
OPEN(open)
OPEN(open64)

int openat(int folder, const char* path, int flags, ...) {
  REAL(int, openat, int, const char*, int, ...);
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = va_arg(arguments, mode_t);
  va_end(arguments);
  if (fails(call_open)) return -1;
  return opened(NEXT(openat)(folder, path, flags, mode), folder, path, flags);
}

#define FOPEN(name)                                                                               \
  FILE* name(const char* path, const char* mode) {                                                \
    static FILE* (*next_##name)(const char*, const char*) = nullptr;                              \
    if (fails(call_open)) return nullptr;                                                         \
    FILE* const file = NEXT(name)(path, mode);                                                    \
    if (file != nullptr && mode[0] != 'r')                                                        \
      (void)opened(fileno(file), AT_FDCWD, path, mode[0] == 'w' ? O_WRONLY | O_TRUNC : O_WRONLY); \
    return file;                                                                                  \
  }
FOPEN(fopen)
FOPEN(fopen64)

int close(int descriptor) {
  REAL(int, close, int);
  if (is_can_socket(descriptor)) is_can[descriptor] = false;
  const bool is_failing = fails(call_close);
  const int error_number = errno;
  const int result = NEXT(close)(descriptor);  // the descriptor is gone all the same, as in the kernel
  if (!is_failing) return result;
  errno = error_number;
  return -1;
}

// ------------------------------------------------------------------------------------------ reading, writing

#define READ(name, PARAMETERS, ARGUMENTS, SIZE)        \
  ssize_t name PARAMETERS {                            \
    static ssize_t(*next_##name) PARAMETERS = nullptr; \
    const int how = verdict(call_read);                \
    if (how > 0) {                                     \
      errno = how;                                     \
      return -1;                                       \
    }                                                  \
    if (how == how_short && SIZE > 1) SIZE /= 2;       \
    return NEXT(name) ARGUMENTS;                       \
  }
READ(read, (int descriptor, void* room, std::size_t size), (descriptor, room, size), size)
READ(pread, (int descriptor, void* room, std::size_t size, off_t at), (descriptor, room, size, at), size)
READ(pread64, (int descriptor, void* room, std::size_t size, off64_t at), (descriptor, room, size, at), size)

std::size_t fread(void* room, std::size_t size, std::size_t count, FILE* file) {
  REAL(std::size_t, fread, void*, std::size_t, std::size_t, FILE*);
  if (fails(call_fread)) {
    file->_flags |= 0x20;  // _IO_ERR_SEEN: ferror() says so
    return 0;
  }
  return NEXT(fread)(room, size, count, file);
}

ssize_t write(int descriptor, const void* data, std::size_t size) {
  const int how = verdict(call_write);
  if (how > 0) {
    errno = how;
    return -1;
  }
  if (how == how_short && size > 1) size /= 2;
  const ssize_t done = NEXT(write)(descriptor, data, size);
  if (done > 0 && is_logging())
    log_data(inode_of(descriptor), ::lseek(descriptor, 0, SEEK_CUR) - done, data,
             static_cast<std::size_t>(done));
  return done;
}

#define PWRITE(name, Offset)                                                                                \
  ssize_t name(int descriptor, const void* data, std::size_t size, Offset at) {                             \
    static ssize_t (*next_##name)(int, const void*, std::size_t, Offset) = nullptr;                         \
    const int how = verdict(call_write);                                                                    \
    if (how > 0) {                                                                                          \
      errno = how;                                                                                          \
      return -1;                                                                                            \
    }                                                                                                       \
    if (how == how_short && size > 1) size /= 2;                                                            \
    const ssize_t done = NEXT(name)(descriptor, data, size, at);                                            \
    if (done > 0 && is_logging()) log_data(inode_of(descriptor), at, data, static_cast<std::size_t>(done)); \
    return done;                                                                                            \
  }
PWRITE(pwrite, off_t)
PWRITE(pwrite64, off64_t)

ssize_t writev(int descriptor, const iovec* pieces, int count) {
  REAL(ssize_t, writev, int, const iovec*, int);
  if (fails(call_write)) return -1;
  const ssize_t done = NEXT(writev)(descriptor, pieces, count);
  if (done > 0 && is_logging()) {
    long long at = ::lseek(descriptor, 0, SEEK_CUR) - done;
    auto rest = static_cast<std::size_t>(done);
    for (int i = 0; i < count && rest > 0; ++i) {
      const std::size_t size = pieces[i].iov_len < rest ? pieces[i].iov_len : rest;
      log_data(inode_of(descriptor), at, pieces[i].iov_base, size);
      at += static_cast<long long>(size);
      rest -= size;
    }
  }
  return done;
}

std::size_t fwrite(const void* data, std::size_t size, std::size_t count, FILE* file) {
  REAL(std::size_t, fwrite, const void*, std::size_t, std::size_t, FILE*);
  if (fails(call_fwrite)) {
    file->_flags |= 0x20;
    return 0;
  }
  return NEXT(fwrite)(data, size, count, file);
}

#define FTRUNCATE(name, Offset)                                                          \
  int name(int descriptor, Offset size) {                                                \
    static int (*next_##name)(int, Offset) = nullptr;                                    \
    if (fails(call_ftruncate)) return -1;                                                \
    const int result = NEXT(name)(descriptor, size);                                     \
    if (result == 0 && is_logging())                                                     \
      log_text("cut %llu %lld\n", static_cast<unsigned long long>(inode_of(descriptor)), \
               static_cast<long long>(size));                                            \
    return result;                                                                       \
  }
FTRUNCATE(ftruncate, off_t)
FTRUNCATE(ftruncate64, off64_t)

#define SYNC(name)                                                                              \
  int name(int descriptor) {                                                                    \
    static int (*next_##name)(int) = nullptr;                                                   \
    if (fails(call_fsync)) return -1;                                                           \
    const int result = NEXT(name)(descriptor);                                                  \
    if (result == 0 && is_logging())                                                            \
      log_text("sync %llu " #name "\n", static_cast<unsigned long long>(inode_of(descriptor))); \
    return result;                                                                              \
  }
SYNC(fsync)
SYNC(fdatasync)
SYNC(syncfs)

// ------------------------------------------------------------------------------------------ names

static int renamed(int result, int from_folder, const char* from, int to_folder, const char* to,
                   unsigned flags) {
  if (result != 0 || !is_logging()) return result;
  char names_[2][PATH_MAX];
  absolute(from_folder, from, names_[0]);
  absolute(to_folder, to, names_[1]);
  log_text("rename %u %s %s\n", flags, names_[0], names_[1]);
  return result;
}

int rename(const char* from, const char* to) {
  REAL(int, rename, const char*, const char*);
  if (fails(call_rename)) return -1;
  return renamed(NEXT(rename)(from, to), AT_FDCWD, from, AT_FDCWD, to, 0);
}
int renameat(int from_folder, const char* from, int to_folder, const char* to) {
  REAL(int, renameat, int, const char*, int, const char*);
  if (fails(call_rename)) return -1;
  return renamed(NEXT(renameat)(from_folder, from, to_folder, to), from_folder, from, to_folder, to, 0);
}
int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) {
  REAL(int, renameat2, int, const char*, int, const char*, unsigned);
  if (fails(call_rename)) return -1;
  return renamed(NEXT(renameat2)(from_folder, from, to_folder, to, flags), from_folder, from, to_folder, to,
                 flags);
}

#define OF_ONE_NAME(name, call, word, PARAMETERS, ARGUMENTS, folder) \
  int name PARAMETERS {                                              \
    static int(*next_##name) PARAMETERS = nullptr;                   \
    if (fails(call)) return -1;                                      \
    const int result = NEXT(name) ARGUMENTS;                         \
    if (result == 0 && is_logging()) {                               \
      char full[PATH_MAX];                                           \
      absolute(folder, path, full);                                  \
      log_text(word " %s\n", full);                                  \
    }                                                                \
    return result;                                                   \
  }
OF_ONE_NAME(mkdir, call_mkdir, "mkdir", (const char* path, mode_t mode), (path, mode), AT_FDCWD)
OF_ONE_NAME(mkdirat, call_mkdir, "mkdir", (int folder, const char* path, mode_t mode), (folder, path, mode),
            folder)
OF_ONE_NAME(unlink, call_unlink, "unlink", (const char* path), (path), AT_FDCWD)
OF_ONE_NAME(remove, call_unlink, "unlink", (const char* path), (path), AT_FDCWD)
OF_ONE_NAME(rmdir, call_unlink, "unlink", (const char* path), (path), AT_FDCWD)
OF_ONE_NAME(unlinkat, call_unlink, "unlink", (int folder, const char* path, int flags), (folder, path, flags),
            folder)

int link(const char* from, const char* to) {
  REAL(int, link, const char*, const char*);
  if (fails(call_rename)) return -1;
  const int result = NEXT(link)(from, to);
  if (result == 0 && is_logging()) {
    char full[2][PATH_MAX];
    absolute(AT_FDCWD, from, full[0]);
    absolute(AT_FDCWD, to, full[1]);
    log_text("link %s %s\n", full[0], full[1]);
  }
  return result;
}

// ------------------------------------------------------------------------------------------ others

int flock(int descriptor, int operation) {
  REAL(int, flock, int, int);
  return fails(call_flock) ? -1 : NEXT(flock)(descriptor, operation);
}

#define MMAP(name, Offset)                                                                          \
  void* name(void* place, std::size_t size, int protection, int flags, int descriptor, Offset at) { \
    static void* (*next_##name)(void*, std::size_t, int, int, int, Offset) = nullptr;               \
    if (fails(call_mmap)) return MAP_FAILED;                                                        \
    return NEXT(name)(place, size, protection, flags, descriptor, at);                              \
  }
MMAP(mmap, off_t)
MMAP(mmap64, off64_t)

int poll(pollfd* descriptors, nfds_t count, int timeout_ms) {
  REAL(int, poll, pollfd*, nfds_t, int);
  return fails(call_poll) ? -1 : NEXT(poll)(descriptors, count, timeout_ms);
}
int epoll_wait(int descriptor, epoll_event* events, int count, int timeout_ms) {
  REAL(int, epoll_wait, int, epoll_event*, int, int);
  return fails(call_poll) ? -1 : NEXT(epoll_wait)(descriptor, events, count, timeout_ms);
}

void* malloc(std::size_t size) {
  return fails(call_malloc) ? nullptr : __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  return fails(call_malloc) ? nullptr : __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  return fails(call_malloc) ? nullptr : __libc_realloc(block, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return fails(call_malloc) ? nullptr : __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  if (fails(call_malloc)) return ENOMEM;
  *block = __libc_memalign(alignment, size);
  return *block == nullptr ? ENOMEM : 0;
}

int socket(int family, int type, int protocol) {
  REAL(int, socket, int, int, int);
  if (fails(call_socket)) return -1;
  if (family != PF_CAN || can_folder == nullptr) return NEXT(socket)(family, type, protocol);
  const int descriptor = NEXT(socket)(AF_UNIX, SOCK_DGRAM | (type & ~SOCK_RAW), 0);
  if (descriptor >= 0 && descriptor < 1024) is_can[descriptor] = true;
  return descriptor;
}

int bind(int descriptor, const sockaddr* address, socklen_t size) {
  REAL(int, bind, int, const sockaddr*, socklen_t);
  if (fails(call_socket)) return -1;
  return is_can_socket(descriptor) ? bind_can(descriptor) : NEXT(bind)(descriptor, address, size);
}

int setsockopt(int descriptor, int level, int option, const void* value, socklen_t size) {
  REAL(int, setsockopt, int, int, int, const void*, socklen_t);
  if (is_can_socket(descriptor)) return 0;
  return NEXT(setsockopt)(descriptor, level, option, value, size);
}

ssize_t send(int descriptor, const void* data, std::size_t size, int flags) {
  REAL(ssize_t, send, int, const void*, std::size_t, int);
  if (fails(call_write)) return -1;
  return is_can_socket(descriptor) ? send_can(descriptor, data, size)
                                   : NEXT(send)(descriptor, data, size, flags);
}

int recvmmsg(int descriptor, mmsghdr* messages, unsigned count, int flags, timespec* timeout) {
  REAL(int, recvmmsg, int, mmsghdr*, unsigned, int, timespec*);
  return fails(call_read) ? -1 : NEXT(recvmmsg)(descriptor, messages, count, flags, timeout);
}

int ioctl(int descriptor, unsigned long request, ...) {
  REAL(int, ioctl, int, unsigned long, ...);
  va_list arguments;
  va_start(arguments, request);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  if (fails(call_ioctl)) return -1;
  if (is_can_socket(descriptor)) {
    auto* const asked = static_cast<ifreq*>(argument);
    if (request == SIOCGIFINDEX) asked->ifr_ifindex = 1;
    if (request == SIOCGIFFLAGS) asked->ifr_flags = IFF_UP | IFF_RUNNING;
    return 0;
  }
  return NEXT(ioctl)(descriptor, request, argument);
}

}  // extern "C"
