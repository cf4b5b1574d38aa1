// What is wrong with a configuration: one sentence that names the file and the line.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace alces::settings {

class Error : public std::runtime_error {
 public:
  Error(const std::string& file, const std::string& sentence) : std::runtime_error(file + ": " + sentence) {}
  Error(const std::string& file, std::size_t line, const std::string& sentence)
      : std::runtime_error(file + ":" + std::to_string(line) + ": " + sentence) {}
};

}  // namespace alces::settings
