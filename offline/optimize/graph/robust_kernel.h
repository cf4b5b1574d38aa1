// How much a constraint that contradicts the others may weigh. s is its chi-squared, k the kernel's width in
// the same unit as sqrt(s), that is, in standard deviations.
//   none     s
//   huber    s up to k^2, then 2 k sqrt(s) - k^2: linear, still convex
//   cauchy   k^2 log(1 + s / k^2): far outliers weigh little
//   dcs      dynamic covariance scaling (Agarwal, Tipaldi, Spinello, Stachniss, Burgard, ICRA 2013),
//            Phi = k^2: the weight is min(1, 2 Phi / (Phi + s))^2; the cost is its integral, at most
//            3 Phi. What the switchable constraints of Suenderhauf and Protzel (IROS 2012) find, without
//            their variables.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace alces::offline {

enum class RobustKernel : std::uint8_t { none, huber, cauchy, dcs };

struct RobustCost {
  double cost = 0;
  double weight = 1;  ///< its derivative by s: what the constraint's information is multiplied by
};

[[nodiscard]] inline RobustCost robust_cost(RobustKernel kernel, double width, double s) {
  const double k2 = width * width;
  switch (kernel) {
    case RobustKernel::none:
      break;
    case RobustKernel::huber:
      if (s > k2) return {.cost = 2 * width * std::sqrt(s) - k2, .weight = width / std::sqrt(s)};
      break;
    case RobustKernel::cauchy:
      return {.cost = k2 * std::log1p(s / k2), .weight = 1 / (1 + s / k2)};
    case RobustKernel::dcs:
      if (s > k2) {
        const double scale = 2 * k2 / (k2 + s);
        return {.cost = 3 * k2 - 2 * k2 * scale, .weight = scale * scale};
      }
      break;
  }
  return {.cost = s, .weight = 1};
}

}  // namespace alces::offline
