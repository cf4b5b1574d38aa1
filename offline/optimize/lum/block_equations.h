// Sparse symmetric systems in blocks of six, a block a pose: B X = A (Appendix A.2), by CHOLMOD.
//
// Equations are summed up in the order of the calls, on one thread: the same calls give the same solution bit
// for bit. Some blocks are held (their change is zero). Memory: 300 bytes a pair of poses and the factor.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "alces/pose.h"

namespace alces::offline {

class BlockEquations {
 public:
  explicit BlockEquations(std::size_t poses);
  BlockEquations(const BlockEquations&) = delete;
  BlockEquations& operator=(const BlockEquations&) = delete;
  ~BlockEquations();

  /// Its change is zero; it has no equations.
  void hold(std::size_t pose);

  /// Adds (Y - E)^T information (Y - E) with Y = h_j X_j - h_k X_k; right_side = information E.
  void add_link(std::size_t j, const Matrix6d& h_j, std::size_t k, const Matrix6d& h_k,
                const Matrix6d& information, const Vector6d& right_side);
  /// Adds X^T information X: holds a pose softly.
  void add_prior(std::size_t pose, const Matrix6d& information);

  /// X of every pose. False: the system is not positive definite; something is not determined.
  [[nodiscard]] bool solve(std::vector<Vector6d>& changes);

  /// The diagonal blocks of B^-1, zero for held poses; after solve(). Only the entries of the inverse that
  /// the factor has are computed (Takahashi, Fagan and Chin 1973; Erisman and Tinney 1975): as costly as
  /// factorising.
  [[nodiscard]] std::vector<Matrix6d> covariances();

  /// Entries of the factor.
  [[nodiscard]] std::size_t factor_size() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alces::offline
