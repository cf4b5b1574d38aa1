#include "alces_onboard/recorder/record_ring.h"

#include <algorithm>
#include <cstring>

namespace alces::onboard {

RecordRing::RecordRing(std::span<std::uint8_t> memory)
    : memory_(memory.first(memory.size() / granule * granule)) {}

// Wherever the two positions are, one of the two free pieces of an empty ring has half of the memory; a
// granule stays free, so that a full ring does not look empty, and the header takes one.
std::size_t RecordRing::largest_record() const {
  const std::size_t half = memory_.size() / 2 / granule * granule;
  return half <= 2 * granule ? 0 : half - 2 * granule;
}

void RecordRing::put_header(std::size_t position, std::uint64_t header) {
  std::memcpy(memory_.data() + position, &header, sizeof header);
}

bool RecordRing::push(std::span<const std::uint8_t> record) {
  if (record.size() > largest_record()) return false;
  const std::size_t space = space_of(record.size());
  const std::size_t write = write_.load(std::memory_order_relaxed);
  const std::size_t read = read_.load(std::memory_order_acquire);
  std::size_t at = write;
  if (write >= read) {
    const std::size_t to_end = memory_.size() - write;
    const bool fits = read == 0 ? space < to_end : space <= to_end;
    if (!fits) {
      if (space >= read) return false;
      put_header(write, goes_on_at_front);
      at = 0;
    }
  } else if (space >= read - write) {
    return false;
  }
  put_header(at, record.size());
  std::ranges::copy(record, memory_.begin() + static_cast<std::ptrdiff_t>(at + granule));
  const std::size_t end = at + space;
  write_.store(end == memory_.size() ? 0 : end, std::memory_order_release);
  return true;
}

bool RecordRing::front(std::span<const std::uint8_t>& record) {
  std::size_t read = read_.load(std::memory_order_relaxed);
  const std::size_t write = write_.load(std::memory_order_acquire);
  if (read == write) return false;
  std::uint64_t header = 0;
  std::memcpy(&header, memory_.data() + read, sizeof header);
  if (header == goes_on_at_front) {
    read = 0;
    std::memcpy(&header, memory_.data(), sizeof header);
    read_.store(read, std::memory_order_release);
  }
  record = memory_.subspan(read + granule, static_cast<std::size_t>(header));
  front_space_ = space_of(record.size());
  return true;
}

void RecordRing::pop() {
  const std::size_t end = read_.load(std::memory_order_relaxed) + front_space_;
  read_.store(end == memory_.size() ? 0 : end, std::memory_order_release);
}

bool RecordRing::empty() const {
  return read_.load(std::memory_order_acquire) == write_.load(std::memory_order_acquire);
}

}  // namespace alces::onboard
