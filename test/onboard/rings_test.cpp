#include <array>
#include <catch2/catch.hpp>
#include <cstdint>
#include <deque>
#include <numeric>
#include <thread>
#include <vector>

#include "alces_onboard/bell.h"
#include "alces_onboard/recorder/record_ring.h"
#include "alces_onboard/recorder/spsc_ring.h"

using namespace alces;
using namespace alces::onboard;

namespace {

/// splitmix64: both threads of a stress test make the same numbers from the same seed.
std::uint64_t mixed(std::uint64_t number) {
  number += 0x9E3779B97F4A7C15U;
  number = (number ^ (number >> 30)) * 0xBF58476D1CE4E5B9U;
  number = (number ^ (number >> 27)) * 0x94D049BB133111EBU;
  return number ^ (number >> 31);
}

struct Parcel {
  std::uint64_t number = 0;
  std::array<std::uint64_t, 7> words{};
};

}  // namespace

TEST_CASE("a ring hands slots on in order, all of them usable, and says full and empty") {
  std::vector<int> slots(3);
  SpscRing<int> ring(slots);
  CHECK(ring.front() == nullptr);
  for (int i = 1; i <= 3; ++i) {
    int* const slot = ring.claim();
    REQUIRE(slot != nullptr);
    CHECK(slot == ring.claim());  // the same one until it is published
    *slot = i;
    ring.publish();
  }
  CHECK(ring.claim() == nullptr);
  CHECK(ring.size() == 3);
  for (int i = 1; i <= 3; ++i) {
    REQUIRE(ring.front() != nullptr);
    CHECK(*ring.front() == i);
    ring.pop();
  }
  CHECK(ring.front() == nullptr);
  CHECK(ring.size() == 0);
}

TEST_CASE("a ring of one slot, or of an odd number, goes round and round") {
  for (const std::size_t capacity : {1U, 2U, 5U, 7U}) {
    std::vector<std::size_t> slots(capacity);
    SpscRing<std::size_t> ring(slots);
    std::size_t in = 0;
    std::size_t out = 0;
    while (out < 1000) {
      for (std::size_t* slot = ring.claim(); slot != nullptr; slot = ring.claim()) {
        *slot = in++;
        ring.publish();
      }
      CHECK(ring.size() == capacity);
      for (std::size_t i = 0; i <= out % capacity; ++i) {
        REQUIRE(ring.front() != nullptr);
        REQUIRE(*ring.front() == out);
        ring.pop();
        ++out;
      }
    }
  }
}

TEST_CASE("two threads at the ends of a ring lose, double and tear nothing") {
  constexpr std::uint64_t parcels = 200'000;
  std::vector<Parcel> slots(5);
  SpscRing<Parcel> ring(slots);
  Bell bell;
  std::uint64_t wrong = 0;
  std::uint64_t received = 0;
  std::thread consumer([&] {
    while (received < parcels) {
      const Bell::Strokes heard = bell.strokes();
      const Parcel* const parcel = ring.front();
      if (parcel == nullptr) {
        bell.wait(heard);
        continue;
      }
      if (parcel->number != received) ++wrong;
      for (std::size_t i = 0; i < parcel->words.size(); ++i) {
        if (parcel->words[i] != mixed(received + i)) ++wrong;
      }
      ring.pop();
      ++received;
    }
  });
  for (std::uint64_t number = 0; number < parcels;) {
    Parcel* const parcel = ring.claim();
    if (parcel == nullptr) {
      std::this_thread::yield();
      continue;
    }
    parcel->number = number;
    for (std::size_t i = 0; i < parcel->words.size(); ++i) parcel->words[i] = mixed(number + i);
    ring.publish();
    bell.ring();
    ++number;
  }
  consumer.join();
  CHECK(received == parcels);
  CHECK(wrong == 0);
  CHECK(ring.front() == nullptr);
}

TEST_CASE("records come out of a record ring whole and in order, whatever their sizes") {
  std::vector<std::uint8_t> memory(1000);
  RecordRing ring(memory);
  std::deque<std::vector<std::uint8_t>> expected;
  std::uint64_t refused = 0;
  std::uint64_t compared = 0;
  for (std::uint64_t step = 0; step < 20'000; ++step) {
    const std::uint64_t dice = mixed(step);
    if (dice % 2 == 0) {
      std::vector<std::uint8_t> record((dice >> 8) % (ring.largest_record() + 1));
      std::iota(record.begin(), record.end(), static_cast<std::uint8_t>(step));
      if (ring.push(record)) {
        expected.push_back(record);
      } else {
        ++refused;
        REQUIRE_FALSE(expected.empty());  // an empty ring takes every record
      }
    } else {
      std::span<const std::uint8_t> record;
      REQUIRE(ring.front(record) == !expected.empty());
      if (expected.empty()) continue;
      REQUIRE(std::vector<std::uint8_t>(record.begin(), record.end()) == expected.front());
      ring.pop();
      expected.pop_front();
      ++compared;
    }
  }
  CHECK(refused > 100);
  CHECK(compared > 1000);
}

TEST_CASE("the largest record fits an empty record ring wherever it stands, a larger one never") {
  std::vector<std::uint8_t> memory(256);
  RecordRing ring(memory);
  const std::vector<std::uint8_t> largest(ring.largest_record(), 7);
  const std::vector<std::uint8_t> larger(ring.largest_record() + 1, 7);
  CHECK(ring.largest_record() >= 100);
  for (int round = 0; round < 100; ++round) {
    REQUIRE_FALSE(ring.push(larger));
    REQUIRE(ring.push(largest));
    std::span<const std::uint8_t> record;
    REQUIRE(ring.front(record));
    REQUIRE(record.size() == largest.size());
    ring.pop();
    REQUIRE(
        ring.push(std::vector<std::uint8_t>(static_cast<std::size_t>(round % 9))));  // one granule or two on
    REQUIRE(ring.front(record));
    ring.pop();
    REQUIRE(ring.empty());
  }
}

TEST_CASE("a record ring too small for anything refuses everything") {
  std::vector<std::uint8_t> memory(24);
  RecordRing ring(memory);
  CHECK(ring.largest_record() == 0);
  CHECK_FALSE(ring.push(std::vector<std::uint8_t>(1)));
  std::span<const std::uint8_t> record;
  CHECK_FALSE(ring.front(record));
}

TEST_CASE("two threads at the ends of a record ring lose, double and tear nothing") {
  constexpr std::uint64_t records = 100'000;
  std::vector<std::uint8_t> memory(4096);
  RecordRing ring(memory);
  std::uint64_t wrong = 0;
  std::uint64_t received = 0;
  const auto size_of = [](std::uint64_t number) { return mixed(number) % 300; };
  std::thread consumer([&] {
    while (received < records) {
      std::span<const std::uint8_t> record;
      if (!ring.front(record)) {
        std::this_thread::yield();
        continue;
      }
      if (record.size() != size_of(received)) ++wrong;
      for (const std::uint8_t byte : record) {
        if (byte != static_cast<std::uint8_t>(received)) ++wrong;
      }
      ring.pop();
      ++received;
    }
  });
  std::vector<std::uint8_t> record;
  for (std::uint64_t number = 0; number < records;) {
    record.assign(size_of(number), static_cast<std::uint8_t>(number));
    if (ring.push(record)) {
      ++number;
    } else {
      std::this_thread::yield();
    }
  }
  consumer.join();
  CHECK(received == records);
  CHECK(wrong == 0);
}
