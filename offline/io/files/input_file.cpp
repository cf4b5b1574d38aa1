#include "input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <system_error>

#include "error.h"

namespace alces::offline {
namespace {

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// Whether the digits at `at` stand behind "NUMBER." that is not itself decimals (1.2.3 is no decimal number,
/// and its second point separates).
bool begins_decimals(std::string_view name, std::size_t at) {
  if (at < 2 || name[at - 1] != '.' || !is_digit(name[at - 2])) return false;
  std::size_t begin = at - 1;
  while (begin > 0 && is_digit(name[begin - 1])) --begin;
  return begin == 0 || name[begin - 1] != '.';
}

/// Without the zeros at their end: .2 is .20.
std::string_view take_decimals(std::string_view name, std::size_t& at) {
  const std::size_t begin = at;
  while (at < name.size() && is_digit(name[at])) ++at;
  std::size_t end = at;
  while (end > begin && name[end - 1] == '0') --end;
  return name.substr(begin, end - begin);
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

void check_read(const std::filesystem::path& file, int error_number) {
  if (error_number == 0) return;
  throw InputError(file, fmt::format("cannot be read to its end ({}); check the disk",
                                     std::generic_category().message(error_number)));
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
    if (is_digit(a[i]) && is_digit(b[j]) && begins_decimals(a, i) && begins_decimals(b, j)) {
      const std::string_view a_decimals = take_decimals(a, i);
      const std::string_view b_decimals = take_decimals(b, j);
      const int order = a_decimals.compare(b_decimals);
      if (order != 0) return order < 0;
    } else if (is_digit(a[i]) && is_digit(b[j])) {
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

namespace {

/// The last run of digits of a name, and whether it is the decimals of a number.
struct LastDigits {
  std::size_t begin = 0;
  std::size_t end = 0;
  bool are_decimals = false;
};

LastDigits last_digits(std::string_view stem) {
  LastDigits last;
  last.end = stem.size();
  while (last.end > 0 && !is_digit(stem[last.end - 1])) --last.end;
  last.begin = last.end;
  while (last.begin > 0 && is_digit(stem[last.begin - 1])) --last.begin;
  last.are_decimals = last.begin < last.end && begins_decimals(stem, last.begin);
  return last;
}

}  // namespace

std::optional<std::uint64_t> number_in_name(const std::filesystem::path& file) {
  const std::string stem = file.stem().string();
  const LastDigits last = last_digits(stem);
  if (last.begin == last.end || last.are_decimals) return std::nullopt;
  std::uint64_t number = 0;
  const auto [at, error] = std::from_chars(stem.data() + last.begin, stem.data() + last.end, number);
  return error == std::errc::result_out_of_range ? UINT64_MAX : number;
}

std::optional<double> stamp_in_name(const std::filesystem::path& file) {
  const std::string stem = file.stem().string();
  const LastDigits last = last_digits(stem);
  if (last.are_decimals) {
    std::size_t begin = last.begin - 1;
    while (begin > 0 && is_digit(stem[begin - 1])) --begin;
    double stamp_s = 0;
    const auto [at, error] = std::from_chars(stem.data() + begin, stem.data() + last.end, stamp_s);
    if (error != std::errc{}) return std::nullopt;
    return stamp_s;
  }
  const std::optional<std::uint64_t> number = number_in_name(file);
  if (!number) return std::nullopt;
  // since 1970, in this century: 2001 to 2106
  for (const double a_second : {1.0, 1e3, 1e6, 1e9}) {
    const double stamp_s = static_cast<double>(*number) / a_second;
    if (stamp_s >= 1e9 && stamp_s < 4.3e9) return stamp_s;
  }
  return std::nullopt;
}

void ContentDigest::add(std::string_view bytes) {
  for (const char byte : bytes) hash_ = (hash_ ^ static_cast<unsigned char>(byte)) * 0x100000001b3U;
}

std::string ContentDigest::text() const {
  return fmt::format("{:016x}", hash_);
}

}  // namespace alces::offline
