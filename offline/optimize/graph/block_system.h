// A sparse symmetric positive definite system of square blocks, solved by CHOLMOD.
//
// The pattern is analysed once: the fill-reducing order is sought on the blocks (a graph 36 times smaller
// than the numbers' for blocks of 6) and expanded. Then fill, factorize and solve as often as needed.
// Everything runs in one thread and in a fixed order: equal input gives equal bits.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace alces::offline {

class BlockSystem {
 public:
  using Pair = std::pair<std::uint32_t, std::uint32_t>;

  /// `blocks` unknowns of `dimension` numbers each; `pairs` are coupled, in any order, repeated or not.
  /// CapacityError when memory does not suffice.
  BlockSystem(std::uint32_t blocks, int dimension, std::span<const Pair> pairs);
  ~BlockSystem();
  BlockSystem(BlockSystem&&) noexcept;
  BlockSystem& operator=(BlockSystem&&) noexcept;

  void set_zero();

  /// Adds to block (row, column), which must be on the diagonal or one of the pairs. The other triangle
  /// follows by symmetry: give each pair once, either way round.
  template <int dimension>
  void add(std::uint32_t row, std::uint32_t column, const Eigen::Matrix<double, dimension, dimension>& m) {
    if (row > column) {
      add_upper(column, row, Eigen::Matrix<double, dimension, dimension>(m.transpose()).data());
    } else {
      add_upper(row, column, m.data());
    }
  }

  /// Factorizes the system with its diagonal multiplied by 1 + lambda. False: not positive definite.
  [[nodiscard]] bool factorize(double lambda);

  /// After factorize(). As many rows as numbers.
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& right_side);

  [[nodiscard]] Eigen::VectorXd diagonal() const;
  [[nodiscard]] std::size_t factor_numbers() const;  ///< that are not zero, of the last factorize()

 private:
  struct Cholmod;

  void add_upper(std::uint32_t row, std::uint32_t column, const double* block);

  std::unique_ptr<Cholmod> cholmod_;
  int dimension_ = 0;
  std::uint32_t blocks_ = 0;
  std::vector<std::uint32_t> first_row_;  ///< of each block column in rows_
  std::vector<std::uint32_t> rows_;       ///< block rows above the diagonal, ascending in each column
  std::vector<double> values_;            ///< as CHOLMOD's matrix, before damping
};

}  // namespace alces::offline
