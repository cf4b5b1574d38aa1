// Sine, cosine, arc tangent and hypotenuse that have the same bits on every processor and with every C
// library. Those of a C library have not: glibc picks another version where the processor has FMA, compilers
// fuse differently for ARM, newlib's are others again. One bit decides in the end which points of a scan are
// paired: poses of a drive that is replayed elsewhere would be millimetres off. These are sums and products
// of doubles, nothing else, compiled with -ffp-contract=off. (Square roots, and remainders, are exact
// everywhere: std has them.)
//
// Error: at most 4e-16 absolute for results up to pi. Cost: some twenty multiplications and at most two
// divisions. NaN gives NaN, an infinite angle has no sine and gives NaN; atan2 of zeros and infinities is
// that of C's annex F.
#pragma once

namespace alces::portable {

struct SineCosine {
  double sine = 0;
  double cosine = 1;
};

/// Beyond 1e6 rad, where nothing turns, the angle is first taken modulo the double nearest to 2 pi.
[[nodiscard]] SineCosine sine_cosine(double angle_rad);

/// In [-pi, pi].
[[nodiscard]] double atan2(double y, double x);

/// Plain root of the sum of squares: overflows beyond 1e154.
[[nodiscard]] double hypot(double x, double y);

/// Natural logarithm of a positive, finite number, to 1e-12.
[[nodiscard]] double logarithm(double value);

}  // namespace alces::portable
