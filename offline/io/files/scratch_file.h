// A file without a name, for what does not fit into memory: it goes away with the object, whatever ends the
// program.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

namespace alces::offline {

class ScratchFile {
 public:
  /// In `folder`, which must exist; OutputError.
  explicit ScratchFile(std::filesystem::path folder);
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;
  ~ScratchFile();

  /// From any thread; OutputError.
  void write(std::uint64_t position, const void* data, std::size_t bytes);
  void read(std::uint64_t position, void* data, std::size_t bytes) const;

 private:
  [[noreturn]] void fail(const char* what) const;

  std::filesystem::path folder_;
  int descriptor_ = -1;
};

}  // namespace alces::offline
