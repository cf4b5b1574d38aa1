#include "block_equations.h"

#include <cholmod.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <new>

namespace alces::offline {
namespace {

constexpr std::size_t none = SIZE_MAX;

using Index = SuiteSparse_long;

}  // namespace

struct BlockEquations::Impl {
  explicit Impl(std::size_t pose_count)
      : diagonal(pose_count, Matrix6d::Zero()), right(pose_count, Vector6d::Zero()), held(pose_count, false) {
    cholmod_l_start(&common);
    common.print = 0;
    common.supernodal =
        CHOLMOD_SIMPLICIAL;  // as fast on the long chains of a drive, and its factor can be read
    common.final_ll = 1;
  }
  ~Impl() {
    cholmod_l_free_factor(&factor, &common);
    cholmod_l_finish(&common);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  // The lower triangle of all poses that are not held, column by column.
  [[nodiscard]] cholmod_sparse* matrix();

  std::vector<Matrix6d> diagonal;
  std::vector<Vector6d> right;
  std::vector<bool> held;
  std::map<std::pair<std::size_t, std::size_t>, Matrix6d> lower;  // (column, row), row > column
  std::vector<std::size_t> block_of;                              // place among the free poses
  std::size_t free_count = 0;
  cholmod_common common{};
  cholmod_factor* factor = nullptr;
};

cholmod_sparse* BlockEquations::Impl::matrix() {
  block_of.assign(diagonal.size(), none);
  free_count = 0;
  for (std::size_t i = 0; i < diagonal.size(); ++i)
    if (!held[i]) block_of[i] = free_count++;
  std::size_t entries = 21 * free_count;
  for (const auto& [place, block] : lower)
    if (!held[place.first] && !held[place.second]) entries += 36;
  const std::size_t size = 6 * free_count;
  cholmod_sparse* sparse = cholmod_l_allocate_sparse(size, size, entries, 1, 1, -1, CHOLMOD_REAL, &common);
  if (sparse == nullptr) throw std::bad_alloc();
  auto* column_begin = static_cast<Index*>(sparse->p);
  auto* rows = static_cast<Index*>(sparse->i);
  auto* values = static_cast<double*>(sparse->x);
  Index at = 0;
  std::size_t column = 0;
  auto below = lower.begin();
  for (std::size_t pose = 0; pose < diagonal.size(); ++pose) {
    const auto first = below;
    while (below != lower.end() && below->first.first == pose) ++below;
    if (held[pose]) continue;
    for (Eigen::Index c = 0; c < 6; ++c) {
      column_begin[column++] = at;
      const auto put = [&](std::size_t block_row, Eigen::Index r, double value) {
        rows[at] = static_cast<Index>(6 * block_of[block_row]) + r;
        values[at++] = value;
      };
      for (Eigen::Index r = c; r < 6; ++r) put(pose, r, diagonal[pose](r, c));
      for (auto block = first; block != below; ++block) {
        if (held[block->first.second]) continue;
        for (Eigen::Index r = 0; r < 6; ++r) put(block->first.second, r, block->second(r, c));
      }
    }
  }
  column_begin[column] = at;
  return sparse;
}

BlockEquations::BlockEquations(std::size_t poses) : impl_(std::make_unique<Impl>(poses)) {}
BlockEquations::~BlockEquations() = default;

void BlockEquations::hold(std::size_t pose) {
  impl_->held[pose] = true;
}

void BlockEquations::add_link(std::size_t j, const Matrix6d& h_j, std::size_t k, const Matrix6d& h_k,
                              const Matrix6d& information, const Vector6d& right_side) {
  const Matrix6d j_information = h_j.transpose() * information;
  impl_->diagonal[j] += j_information * h_j;
  impl_->diagonal[k] += h_k.transpose() * information * h_k;
  const Matrix6d off = -j_information * h_k;  // row j, column k
  const auto [block, is_new] = impl_->lower.try_emplace({std::min(j, k), std::max(j, k)}, Matrix6d::Zero());
  block->second += j > k ? off : Matrix6d(off.transpose());
  impl_->right[j] += h_j.transpose() * right_side;
  impl_->right[k] -= h_k.transpose() * right_side;
}

void BlockEquations::add_prior(std::size_t pose, const Matrix6d& information) {
  impl_->diagonal[pose] += information;
}

bool BlockEquations::solve(std::vector<Vector6d>& changes) {
  Impl& system = *impl_;
  changes.assign(system.diagonal.size(), Vector6d::Zero());
  cholmod_sparse* sparse = system.matrix();
  cholmod_l_free_factor(&system.factor, &system.common);
  if (system.free_count == 0) {
    cholmod_l_free_sparse(&sparse, &system.common);
    return true;
  }
  system.factor = cholmod_l_analyze(sparse, &system.common);
  if (system.factor != nullptr) cholmod_l_factorize(sparse, system.factor, &system.common);
  const int status = system.common.status;
  cholmod_l_free_sparse(&sparse, &system.common);
  if (status == CHOLMOD_OUT_OF_MEMORY || system.factor == nullptr) throw std::bad_alloc();
  if (status != CHOLMOD_OK) return false;
  const std::size_t size = 6 * system.free_count;
  cholmod_dense* right = cholmod_l_allocate_dense(size, 1, size, CHOLMOD_REAL, &system.common);
  if (right == nullptr) throw std::bad_alloc();
  for (std::size_t i = 0; i < system.diagonal.size(); ++i)
    if (!system.held[i])
      Eigen::Map<Vector6d>(static_cast<double*>(right->x) + 6 * system.block_of[i]) = system.right[i];
  cholmod_dense* solution = cholmod_l_solve(CHOLMOD_A, system.factor, right, &system.common);
  cholmod_l_free_dense(&right, &system.common);
  if (solution == nullptr) throw std::bad_alloc();
  bool finite = true;
  for (std::size_t i = 0; i < system.diagonal.size(); ++i) {
    if (system.held[i]) continue;
    changes[i] = Eigen::Map<const Vector6d>(static_cast<const double*>(solution->x) + 6 * system.block_of[i]);
    finite = finite && changes[i].allFinite();
  }
  cholmod_l_free_dense(&solution, &system.common);
  return finite;
}

std::vector<Matrix6d> BlockEquations::covariances() {
  Impl& system = *impl_;
  std::vector<Matrix6d> blocks(system.diagonal.size(), Matrix6d::Zero());
  if (system.free_count == 0) return blocks;
  cholmod_l_change_factor(CHOLMOD_REAL, 1, 0, 1, 1, system.factor, &system.common);
  const cholmod_factor& factor = *system.factor;
  const auto size = static_cast<Index>(factor.n);
  const auto* begin = static_cast<const Index*>(factor.p);
  const auto* rows = static_cast<const Index*>(factor.i);
  const auto* values = static_cast<const double*>(factor.x);
  const auto* permutation = static_cast<const Index*>(factor.Perm);

  // Z = B^-1 from L^T Z = L^-1, columns from the last to the first, within the pattern of L:
  //   Z_ij = (delta_ij / L_jj - sum_{k > j} L_kj Z_ik) / L_jj.
  std::vector<double> inverse(static_cast<std::size_t>(begin[size]));
  std::vector<Index> place(static_cast<std::size_t>(size), -1);  // of a row in the column at hand
  std::vector<double> sums;
  for (Index j = size - 1; j >= 0; --j) {
    const Index first = begin[j] + 1;  // below the diagonal
    const Index last = begin[j + 1];
    sums.assign(static_cast<std::size_t>(last - first), 0.0);
    for (Index at = first; at < last; ++at) place[static_cast<std::size_t>(rows[at])] = at - first;
    for (Index at = first; at < last; ++at) {
      const Index k = rows[at];
      const double l_kj = values[at];
      double& sum_k = sums[static_cast<std::size_t>(at - first)];
      sum_k += l_kj * inverse[static_cast<std::size_t>(begin[k])];
      for (Index in_k = begin[k] + 1; in_k < begin[k + 1]; ++in_k) {
        const Index i = place[static_cast<std::size_t>(rows[in_k])];
        if (i < 0) continue;
        const double z = inverse[static_cast<std::size_t>(in_k)];
        sums[static_cast<std::size_t>(i)] += l_kj * z;
        sum_k += values[first + i] * z;
      }
    }
    const double l_jj = values[begin[j]];
    double diagonal = 1 / l_jj;
    for (Index at = first; at < last; ++at) {
      const double z = -sums[static_cast<std::size_t>(at - first)] / l_jj;
      inverse[static_cast<std::size_t>(at)] = z;
      diagonal -= values[at] * z;
      place[static_cast<std::size_t>(rows[at])] = -1;
    }
    inverse[static_cast<std::size_t>(begin[j])] = diagonal / l_jj;
  }

  std::vector<Index> permuted(static_cast<std::size_t>(size));
  for (Index i = 0; i < size; ++i) permuted[static_cast<std::size_t>(permutation[i])] = i;
  for (std::size_t pose = 0; pose < blocks.size(); ++pose) {
    if (system.held[pose]) continue;
    for (Eigen::Index r = 0; r < 6; ++r) {
      for (Eigen::Index c = 0; c <= r; ++c) {
        const std::size_t base = 6 * system.block_of[pose];
        const Index a = permuted[base + static_cast<std::size_t>(r)];
        const Index b = permuted[base + static_cast<std::size_t>(c)];
        const Index column = std::min(a, b);
        const Index row = std::max(a, b);
        const Index* found = std::lower_bound(rows + begin[column], rows + begin[column + 1], row);
        const double z = inverse[static_cast<std::size_t>(found - rows)];
        blocks[pose](r, c) = blocks[pose](c, r) = z;
      }
    }
  }
  return blocks;
}

std::size_t BlockEquations::factor_size() const {
  return impl_->factor == nullptr ? 0 : static_cast<std::size_t>(impl_->common.lnz);
}

}  // namespace alces::offline
