// Where a recording is read from, front to back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>

namespace alces {

class ByteSource {
 public:
  /// Fills `room` as far as there are bytes; fewer than asked for: this is the end.
  [[nodiscard]] virtual std::size_t read(std::span<std::uint8_t> room) = 0;
  /// errno of what failed; 0 when nothing did. Fewer bytes than asked for are then no end.
  [[nodiscard]] virtual int error_number() const { return 0; }

 protected:
  ~ByteSource() = default;
};

class MemorySource final : public ByteSource {
 public:
  explicit MemorySource(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  [[nodiscard]] std::size_t read(std::span<std::uint8_t> room) override;

 private:
  std::span<const std::uint8_t> bytes_;
};

class FileSource final : public ByteSource {
 public:
  explicit FileSource(const char* path);
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;
  ~FileSource();

  [[nodiscard]] bool is_open() const { return file_ != nullptr; }
  [[nodiscard]] std::size_t read(std::span<std::uint8_t> room) override;
  [[nodiscard]] int error_number() const override { return error_number_; }

 private:
  std::FILE* file_ = nullptr;
  int error_number_ = 0;
};

}  // namespace alces
