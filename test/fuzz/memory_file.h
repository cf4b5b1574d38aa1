// Bytes as files, for parsers that ask for a path: in memory, and as fast as that.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "target.h"

namespace alces::fuzz {

/// A file without a name on any disk; its path is good as long as it lives.
class MemoryFile {
 public:
  explicit MemoryFile(std::span<const std::uint8_t> bytes)
      : descriptor_(::memfd_create("input", MFD_CLOEXEC)) {
    require(descriptor_ >= 0, "memfd_create");
    std::size_t done = 0;
    while (done < bytes.size()) {
      const ssize_t count = ::write(descriptor_, bytes.data() + done, bytes.size() - done);
      require(count > 0, "write");
      done += static_cast<std::size_t>(count);
    }
    path_ = "/proc/self/fd/" + std::to_string(descriptor_);
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { ::close(descriptor_); }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  int descriptor_;
  std::filesystem::path path_;
};

[[nodiscard]] inline std::string_view as_text(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A folder of this process in memory (/dev/shm), emptied for each input.
class MemoryFolder {
 public:
  MemoryFolder() : path_("/dev/shm/alces_fuzz." + std::to_string(::getpid())) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directory(path_);
  }
  MemoryFolder(const MemoryFolder&) = delete;
  MemoryFolder& operator=(const MemoryFolder&) = delete;
  ~MemoryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  void write(std::string_view name, std::string_view bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
  }

 private:
  std::filesystem::path path_;
};

/// Several files in one input: each begins with a line "== NAME". Other names than these are passed over.
template <class Take>
void for_each_file(std::span<const std::uint8_t> bytes, std::initializer_list<std::string_view> names,
                   const Take& take) {
  constexpr std::string_view mark = "== ";
  std::string_view rest = as_text(bytes);
  while (rest.starts_with(mark)) {
    rest.remove_prefix(mark.size());
    const std::size_t line_end = std::min(rest.find('\n'), rest.size());
    const std::string_view name = rest.substr(0, line_end);
    rest.remove_prefix(std::min(line_end + 1, rest.size()));
    std::size_t end = rest.find("\n== ");
    end = end == std::string_view::npos ? rest.size() : end;
    for (const std::string_view known : names) {
      if (known == name) take(name, rest.substr(0, end));
    }
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
}

}  // namespace alces::fuzz
