// Test data that lie packed as NAME.tar.xz beside the others: unpacked into a folder of the test's own.
#pragma once

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "support/test_data.h"

namespace alces::test {

/// As has_test_data().
[[nodiscard]] inline bool has_packed_data(const std::string& name) {
  return has_test_data(name + ".tar.xz");
}

/// A folder that goes away with the test.
class UnpackedData {
 public:
  explicit UnpackedData(const std::string& name) {
    std::string folder = (std::filesystem::temp_directory_path() / "alces-data-XXXXXX").string();
    REQUIRE(mkdtemp(folder.data()) != nullptr);
    folder_ = folder;
    const std::string command = "tar -xJf '" + test_data(name + ".tar.xz").string() + "' -C '" + folder + "'";
    REQUIRE(std::system(command.c_str()) == 0);
  }
  UnpackedData(const UnpackedData&) = delete;
  UnpackedData& operator=(const UnpackedData&) = delete;
  ~UnpackedData() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }

 private:
  std::filesystem::path folder_;
};

}  // namespace alces::test
