#include "alces/portable_math.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace alces::portable {
namespace {

// pi/2 in three parts (Cody and Waite): the first two have 33 bits, so their product with a number of quarter
// turns below 2^20 is exact.
constexpr double quarter_high = 0x1.921fb544p+0;
constexpr double quarter_middle = 0x1.0b4611a6p-34;
constexpr double quarter_low = 0x1.3198a2e037073p-69;
constexpr double largest_rad = 1e6;

// 1/n! with alternating signs, in powers of x^2. On |x| <= pi/4 what is left out is below 1e-17.
constexpr std::array sine_terms = {
    -1.0 / 6,        1.0 / 120,        -1.0 / 5040,          1.0 / 362880,
    -1.0 / 39916800, 1.0 / 6227020800, -1.0 / 1307674368000, 1.0 / 355687428096000};
constexpr std::array cosine_terms = {
    -1.0 / 2,       1.0 / 24,        -1.0 / 720,         1.0 / 40320,
    -1.0 / 3628800, 1.0 / 479001600, -1.0 / 87178291200, 1.0 / 20922789888000};

// atan(k / 8). Around these, |x| <= 1/16: what is left out is below 1e-18.
constexpr std::array eighths_rad = {0.0,
                                    0x1.fd5ba9aac2f6ep-4,
                                    0x1.f5b75f92c80ddp-3,
                                    0x1.6f61941e4def1p-2,
                                    0x1.dac670561bb4fp-2,
                                    0x1.1e00babdefeb4p-1,
                                    0x1.4978fa3269ee1p-1,
                                    0x1.700a7c5784634p-1,
                                    0x1.921fb54442d18p-1};
constexpr std::array atan_terms = {-1.0 / 3, 1.0 / 5, -1.0 / 7, 1.0 / 9, -1.0 / 11, 1.0 / 13};

template <std::size_t Count>
double polynomial(const std::array<double, Count>& terms, double x) {
  double sum = 0;
  for (std::size_t i = Count; i > 0; --i) sum = terms[i - 1] + x * sum;
  return sum;
}

}  // namespace

SineCosine sine_cosine(double angle_rad) {
  if (!(std::abs(angle_rad) <= largest_rad)) {
    angle_rad = std::remainder(angle_rad, 2 * std::numbers::pi);
    if (std::isnan(angle_rad)) return {angle_rad, angle_rad};
  }
  const auto quarters =
      static_cast<std::int32_t>(angle_rad * (2 / std::numbers::pi) + (angle_rad < 0 ? -0.5 : 0.5));
  const double n = quarters;
  const double x = ((angle_rad - n * quarter_high) - n * quarter_middle) - n * quarter_low;
  const double x2 = x * x;
  const double sine = x + x * (x2 * polynomial(sine_terms, x2));
  const double cosine = 1 + x2 * polynomial(cosine_terms, x2);
  switch (quarters & 3) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}

double atan2(double y, double x) {
  if (std::isnan(x) || std::isnan(y)) return std::numeric_limits<double>::quiet_NaN();
  const double up = std::abs(y);
  const double along = std::abs(x);
  const bool is_steep = up > along;
  const double large = is_steep ? up : along;
  const double small = is_steep ? along : up;
  double tangent = large > 0 ? small / large : 0;
  if (std::isinf(small)) tangent = 1;  // both are
  const auto eighth = static_cast<std::size_t>(8 * tangent + 0.5);
  const double middle = 0.125 * static_cast<double>(eighth);
  const double t = (tangent - middle) / (1 + tangent * middle);
  const double t2 = t * t;
  double angle_rad = eighths_rad[eighth] + (t + t * (t2 * polynomial(atan_terms, t2)));
  if (is_steep) angle_rad = std::numbers::pi / 2 - angle_rad;
  if (std::signbit(x)) angle_rad = std::numbers::pi - angle_rad;
  return std::copysign(angle_rad, y);
}

double hypot(double x, double y) {
  return std::sqrt(x * x + y * y);
}

double logarithm(double value) {
  constexpr double ln_2 = 0.693147180559945309417;
  int exponent = 0;
  const double mantissa = std::frexp(value, &exponent);  // exact; 0.5 to 1
  const double z = (mantissa - 1) / (mantissa + 1);      // ln m = 2 atanh z, -1/3 to 0
  double sum = 0;
  for (int n = 25; n >= 1; n -= 2) sum = sum * z * z + 1.0 / n;
  return exponent * ln_2 + 2 * z * sum;
}

}  // namespace alces::portable
