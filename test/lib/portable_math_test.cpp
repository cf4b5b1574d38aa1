#include "alces/portable_math.h"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>

using namespace alces;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

// Between -largest and largest, the same on every machine (a standard distribution's values are its library's
// choice).
double uniform(std::mt19937_64& random, double largest) {
  return largest * (static_cast<double>(random() >> 11) * 0x1p-52 - 1);
}

void fold(std::uint64_t& digest, double value) {
  digest = (digest ^ std::bit_cast<std::uint64_t>(value)) * 0x9E3779B97F4A7C15U;
  digest ^= digest >> 29;
}

}  // namespace

TEST_CASE("the logarithm is that of the C library, to 1e-12") {
  for (double value = 1e-12; value < 1e12; value *= 1.37) {
    CAPTURE(value);
    CHECK(portable::logarithm(value) == Approx(std::log(value)).margin(1e-12).epsilon(1e-12));
  }
  CHECK(portable::logarithm(1) == Approx(0).margin(1e-12));
}

TEST_CASE("portable sine, cosine and arc tangent are right to 4e-16") {
  std::mt19937_64 random(1);
  double worst = 0;
  for (int i = 0; i < 200'000; ++i) {
    for (const double largest : {1e-3, 1.0, 4.0, 400.0, 1e6}) {
      const double angle_rad = uniform(random, largest);
      const auto [sine, cosine] = portable::sine_cosine(angle_rad);
      worst = std::max(worst, std::abs(sine - std::sin(angle_rad)));
      worst = std::max(worst, std::abs(cosine - std::cos(angle_rad)));
      const double y = uniform(random, largest);
      worst = std::max(worst, std::abs(portable::atan2(y, angle_rad) - std::atan2(y, angle_rad)));
    }
  }
  CHECK(worst < 4.5e-16);  // half a bit of it may be std's, and pi has no more
  CHECK(worst > 0);
}

TEST_CASE("portable sine and cosine near multiples of a quarter turn") {
  for (int quarter = -600'000; quarter < 600'000; quarter += 997) {
    const double angle_rad = quarter * (std::numbers::pi / 2);
    CAPTURE(quarter);
    CHECK(std::abs(portable::sine_cosine(angle_rad).sine - std::sin(angle_rad)) < 2e-16);
    CHECK(std::abs(portable::sine_cosine(angle_rad).cosine - std::cos(angle_rad)) < 2e-16);
  }
}

TEST_CASE("portable functions have the bits that they have everywhere") {
  // Computed once; each processor, compiler and C library must come to the same.
  std::mt19937_64 random(2);
  std::uint64_t digest = 0;
  for (int i = 0; i < 100'000; ++i) {
    const double x = uniform(random, 10);
    const double y = uniform(random, 10);
    const auto [sine, cosine] = portable::sine_cosine(x);
    fold(digest, sine);
    fold(digest, cosine);
    fold(digest, portable::atan2(y, x));
    fold(digest, portable::hypot(x, y));
  }
  CHECK(digest == 0xDAD466F73658FD1BU);
}

TEST_CASE("portable functions of zeros, infinities and what is no number") {
  CHECK(portable::sine_cosine(-0.0).sine == 0);
  CHECK(portable::sine_cosine(-0.0).cosine == 1);
  CHECK(std::isnan(portable::sine_cosine(infinity).sine));
  CHECK(std::isnan(portable::sine_cosine(-infinity).cosine));
  CHECK(std::isnan(portable::sine_cosine(not_a_number).sine));
  CHECK(std::abs(portable::sine_cosine(1e300).sine) <= 1);
  CHECK(std::abs(portable::sine_cosine(1e6 + 1).sine - std::sin(1e6 + 1)) < 1e-9);
  for (const double y : {0.0, -0.0, 1.0, -1.0, infinity, -infinity}) {
    for (const double x : {0.0, -0.0, 1.0, -1.0, infinity, -infinity}) {
      CAPTURE(y, x);
      CHECK(portable::atan2(y, x) == Approx(std::atan2(y, x)).margin(1e-300));
      CHECK(std::signbit(portable::atan2(y, x)) == std::signbit(std::atan2(y, x)));
    }
  }
  CHECK(std::isnan(portable::atan2(not_a_number, 1)));
  CHECK(std::isnan(portable::atan2(1, not_a_number)));
  CHECK(portable::atan2(5e-324, 1e300) == 0);
  CHECK(portable::atan2(1e300, 5e-324) == Approx(std::numbers::pi / 2));
  CHECK(portable::hypot(3, -4) == 5);
  CHECK(std::isnan(portable::hypot(not_a_number, 1)));
}
