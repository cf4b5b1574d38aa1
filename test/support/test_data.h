// Real data, recorded by others, that tests read: CMake's ALCES_TEST_DATA names their folder. They are not
// part of the repository, so a test has to do without them.
#pragma once

#include <catch2/catch.hpp>
#include <filesystem>
#include <string_view>
#include <system_error>

namespace alces::test {

inline std::filesystem::path test_data(std::string_view name) {
  return std::filesystem::path(ALCES_TEST_DATA) / name;
}

/// False: it is not there, and the test is to return. By the sentence CTest knows that the test was skipped;
/// it then asks for nothing else, so what can be checked without the data belongs into another test.
[[nodiscard]] inline bool has_test_data(std::string_view name) {
  std::error_code ignored;
  if (!std::string_view(ALCES_TEST_DATA).empty() && std::filesystem::exists(test_data(name), ignored))
    return true;
  WARN("skipped, no test data: " << test_data(name).string());
  return false;
}

}  // namespace alces::test
