// Where scans go for which the pool has no room, unless --archive names a file: gone at the end of the run.
#pragma once

#include <filesystem>
#include <system_error>
#include <utility>

namespace alces::offline {

class ScratchArchive {
 public:
  explicit ScratchArchive(std::filesystem::path file) : file_(std::move(file)) {}
  ScratchArchive(const ScratchArchive&) = delete;
  ScratchArchive& operator=(const ScratchArchive&) = delete;
  ~ScratchArchive() {
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
  }

 private:
  std::filesystem::path file_;
};

}  // namespace alces::offline
