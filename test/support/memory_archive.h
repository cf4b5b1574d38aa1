// An archive in memory that fails when told to.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "alces/scan_archive.h"

namespace alces::test {

class MemoryArchive final : public ScanArchive {
 public:
  bool write(std::uint32_t scan, std::span<const std::byte> bytes) override {
    if (write_fails) return false;
    records[scan].assign(bytes.begin(), bytes.end());
    return true;
  }
  bool read(std::uint32_t scan, std::span<std::byte> bytes) override {
    const auto record = records.find(scan);
    if (read_fails || record == records.end() || record->second.size() != bytes.size()) return false;
    std::ranges::copy(record->second, bytes.begin());
    return true;
  }
  std::map<std::uint32_t, std::vector<std::byte>> records;
  bool write_fails = false;
  bool read_fails = false;
};

}  // namespace alces::test
