// What goes wrong at the desk, as exceptions: one sentence that names the file, the line or byte, and what to
// do. The program prints `what()` and leaves with `exit_status()`.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

namespace alces::offline {

class Error : public std::runtime_error {
 public:
  Error(const std::string& sentence, int exit_status)
      : std::runtime_error(sentence), exit_status_(exit_status) {}
  [[nodiscard]] int exit_status() const { return exit_status_; }

 private:
  int exit_status_;
};

/// The call itself is wrong: unknown verb, missing argument, values that exclude each other.
class UsageError : public Error {
 public:
  explicit UsageError(const std::string& sentence) : Error(sentence, 2) {}
};

/// A file or folder that cannot be read, or whose content is not what its format promises.
class InputError : public Error {
 public:
  explicit InputError(const std::string& sentence) : Error(sentence, 3) {}
  InputError(const std::filesystem::path& file, const std::string& what_and_remedy)
      : InputError(file.string() + ": " + what_and_remedy) {}
  InputError(const std::filesystem::path& file, std::size_t line, const std::string& what_and_remedy)
      : InputError(file.string() + ":" + std::to_string(line) + ": " + what_and_remedy) {}
};

/// A capacity of the configuration is reached.
class CapacityError : public Error {
 public:
  explicit CapacityError(const std::string& sentence) : Error(sentence, 4) {}
};

/// A device failed or a file cannot be written: disk full, no permission, a folder where a file should be.
class OutputError : public Error {
 public:
  explicit OutputError(const std::string& sentence) : Error(sentence, 5) {}
  OutputError(const std::filesystem::path& file, const std::string& reason)
      : OutputError(file.string() + ": " + reason) {}
};

}  // namespace alces::offline
