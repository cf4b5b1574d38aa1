#include "alces/arena.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdint>

using namespace alces;

namespace {

struct Tables {
  constexpr Tables(Arena& arena, std::size_t count)
      : bytes(arena.allocate<unsigned char>(count)), numbers(arena.allocate<double>(count)) {}
  std::span<unsigned char> bytes;
  std::span<double> numbers;
};

constexpr std::size_t plan(std::size_t count) {
  Arena counting;
  const Tables tables(counting, count);
  return counting.used_bytes();
}

static_assert(plan(0) == 0);
static_assert(plan(1) == 128);
static_assert(plan(64) == 64 + 512);
alignas(Arena::alignment) std::byte block[plan(100)];

std::uintptr_t address(const void* pointer) {
  return reinterpret_cast<std::uintptr_t>(pointer);
}

}  // namespace

TEST_CASE("a plan made at compile time is used to its last byte, and one byte less overflows") {
  Arena arena(block);
  const Tables tables(arena, 100);
  CHECK(tables.bytes.size() == 100);
  CHECK(tables.numbers.size() == 100);
  CHECK(arena.used_bytes() == sizeof block);
  CHECK_FALSE(arena.overflowed());

  Arena short_arena(std::span<std::byte>(block).first(sizeof block - 1));
  const Tables fewer(short_arena, 100);
  CHECK(short_arena.overflowed());
  CHECK(fewer.bytes.size() == 100);
  CHECK(fewer.numbers.empty());
}

TEST_CASE("an arena's arrays start on cache lines, do not overlap and are zero") {
  std::ranges::fill(block, std::byte{0xff});
  Arena arena(block);
  const auto bytes = arena.allocate<unsigned char>(65);
  const auto numbers = arena.allocate<double>(3);
  CHECK(address(bytes.data()) % Arena::alignment == 0);
  CHECK(address(numbers.data()) % Arena::alignment == 0);
  CHECK(address(numbers.data()) >= address(bytes.data()) + 65);
  CHECK(std::ranges::count(bytes, 0) == 65);
  CHECK(std::ranges::count(numbers, 0.0) == 3);
}

TEST_CASE(
    "a counting arena gives empty arrays and never overflows, unless no address space could hold them") {
  Arena counting;
  CHECK(counting.allocate<double>(1000).empty());
  CHECK(counting.used_bytes() == 8000);
  CHECK_FALSE(counting.overflowed());
  CHECK(counting.allocate<double>(SIZE_MAX / 4).empty());
  CHECK(counting.overflowed());
  CHECK(counting.used_bytes() == 8000);
}

TEST_CASE("requests that add up to more than any address space overflow, however they are cut") {
  constexpr std::size_t half = SIZE_MAX / 2;
  for (const std::size_t first : {half / 2, half - 1000, half - 63, half - 1, half}) {
    for (const std::size_t second : {half / 2 + 1000, half - 64, half, half + 1, SIZE_MAX - 1000, SIZE_MAX}) {
      Arena counting;
      (void)counting.allocate<std::byte>(first);
      const std::size_t used = counting.used_bytes();
      CHECK(used >= first);
      CHECK_FALSE(counting.overflowed());
      CHECK(counting.allocate<std::byte>(second).empty());
      CHECK(counting.overflowed());
      CHECK(counting.used_bytes() == used);
      (void)counting.allocate<double>(half / sizeof(double));
      CHECK(counting.used_bytes() == used);
    }
  }
}

TEST_CASE("an arena that has overflowed says so for ever, and still hands out what fits") {
  Arena arena(block);
  CHECK(arena.allocate<double>(sizeof block).empty());
  CHECK(arena.overflowed());
  CHECK(arena.allocate<double>(1).size() == 1);
  CHECK(arena.overflowed());
  CHECK(arena.allocate<double>(SIZE_MAX).empty());
}
