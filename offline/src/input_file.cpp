#include "alces_offline/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <system_error>

#include "alces_offline/error.h"

namespace alces::offline {
namespace {

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

class Descriptor {
 public:
  explicit Descriptor(int descriptor) : descriptor_(descriptor) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  [[nodiscard]] int get() const { return descriptor_; }

 private:
  int descriptor_;
};

[[noreturn]] void fail(const std::filesystem::path& file, int error_number) {
  throw InputError(file, "cannot be read (" + std::generic_category().message(error_number) +
                             "); check the path and its permissions");
}

}  // namespace

void read_file(const std::filesystem::path& file, std::string& bytes) {
  const Descriptor descriptor(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  if (descriptor.get() < 0) fail(file, errno);
  struct stat status {};
  if (::fstat(descriptor.get(), &status) != 0) fail(file, errno);
  if (S_ISDIR(status.st_mode)) throw InputError(file, "is a folder, a file is needed here");
  if (S_ISCHR(status.st_mode) || S_ISBLK(status.st_mode))
    throw InputError(file, "is a device, a file or a pipe is needed here");
  // one byte more than its size, so that the read that sees the end needs no second round
  bytes.resize(static_cast<std::size_t>(std::max<off_t>(status.st_size, 0)) + 1);
  std::size_t filled = 0;
  while (true) {
    const ssize_t got = ::read(descriptor.get(), bytes.data() + filled, bytes.size() - filled);
    if (got < 0) {
      if (errno == EINTR) continue;
      fail(file, errno);
    }
    if (got == 0) break;
    filled += static_cast<std::size_t>(got);
    if (filled == bytes.size()) bytes.resize(2 * filled);  // a pipe, or a file that grows
  }
  bytes.resize(filled);
}

std::vector<std::filesystem::path> list_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  std::filesystem::directory_iterator entry(folder, error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    std::error_code unknown;
    if (!entry->is_directory(unknown)) files.push_back(entry->path());
  }
  if (error) {
    throw InputError(
        folder, "the folder cannot be read (" + error.message() + "); check the path and its permissions");
  }
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) {
    return natural_less(a.filename().native(), b.filename().native());
  });
  return files;
}

bool natural_less(std::string_view a, std::string_view b) {
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      while (i < a.size() && a[i] == '0') ++i;
      while (j < b.size() && b[j] == '0') ++j;
      const std::size_t a_begin = i;
      const std::size_t b_begin = j;
      while (i < a.size() && is_digit(a[i])) ++i;
      while (j < b.size() && is_digit(b[j])) ++j;
      if (i - a_begin != j - b_begin) return i - a_begin < j - b_begin;
      const int order = a.substr(a_begin, i - a_begin).compare(b.substr(b_begin, j - b_begin));
      if (order != 0) return order < 0;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
  }
  if (i < a.size() || j < b.size()) return i == a.size() && j < b.size();
  return a < b;  // scan7 and scan007: some order, always the same
}

std::optional<std::uint64_t> number_in_name(const std::filesystem::path& file) {
  const std::string stem = file.stem().string();
  std::size_t end = stem.size();
  while (end > 0 && !is_digit(stem[end - 1])) --end;
  std::size_t begin = end;
  while (begin > 0 && is_digit(stem[begin - 1])) --begin;
  std::uint64_t number = 0;
  const auto [at, error] = std::from_chars(stem.data() + begin, stem.data() + end, number);
  if (begin == end) return std::nullopt;
  return error == std::errc::result_out_of_range ? UINT64_MAX : number;
}

}  // namespace alces::offline
