// Records of bytes between two threads, whole and in order, in fixed memory: one thread puts in, one takes
// out, neither waits for the other, no lock and no heap.
//
// A record lies in one piece, behind a header of 8 bytes; one that does not fit before the end of the memory
// goes to its front. So the largest record is what is sure to fit: half of the memory, less a little. O(size)
// for push(), O(1) for the rest.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

namespace alces::onboard {

class RecordRing {
 public:
  /// `memory` is cut to a multiple of 8 bytes; it outlives the ring.
  explicit RecordRing(std::span<std::uint8_t> memory);
  RecordRing(const RecordRing&) = delete;
  RecordRing& operator=(const RecordRing&) = delete;

  /// One that fits whenever the ring is empty.
  [[nodiscard]] std::size_t largest_record() const;

  /// The producer's: a copy of all of the bytes, or none. False: there is no room now, or the record is
  /// larger than largest_record().
  [[nodiscard]] bool push(std::span<const std::uint8_t> record);

  /// The consumer's: is there one, and which. The same one until pop().
  [[nodiscard]] bool front(std::span<const std::uint8_t>& record);
  void pop();

  [[nodiscard]] bool empty() const;

 private:
  static constexpr std::size_t granule = 8;
  static constexpr std::uint64_t goes_on_at_front = UINT64_MAX;
  [[nodiscard]] static std::size_t space_of(std::size_t record_bytes) {
    return granule + (record_bytes + granule - 1) / granule * granule;
  }
  void put_header(std::size_t position, std::uint64_t header);

  static constexpr std::size_t cache_line_bytes = 64;
  std::span<std::uint8_t> memory_;
  alignas(cache_line_bytes) std::atomic<std::size_t> write_{0};  ///< always below the size; a multiple of 8
  alignas(cache_line_bytes) std::atomic<std::size_t> read_{0};
  std::size_t front_space_ = 0;  ///< the consumer's: of the record that front() gave
};

}  // namespace alces::onboard
