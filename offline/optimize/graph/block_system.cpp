#include "block_system.h"

#include <cholmod.h>

#include <algorithm>
#include <limits>

#include "offline/io/files/error.h"

namespace alces::offline {
namespace {

[[noreturn]] void out_of_memory() {
  throw CapacityError("the machine has not enough memory to factorize this graph");
}

}  // namespace

// Owns what CHOLMOD allocates.
struct BlockSystem::Cholmod {
  Cholmod() {
    cholmod_start(&common);
    common.print = 0;
    common.try_catch = 1;  // status is asked, nothing is printed
  }
  Cholmod(const Cholmod&) = delete;
  Cholmod& operator=(const Cholmod&) = delete;
  ~Cholmod() {
    cholmod_free_factor(&factor, &common);
    cholmod_free_sparse(&matrix, &common);
    cholmod_finish(&common);
  }

  [[nodiscard]] int* column_begin() const { return static_cast<int*>(matrix->p); }
  [[nodiscard]] int* row_index() const { return static_cast<int*>(matrix->i); }
  [[nodiscard]] double* value() const { return static_cast<double*>(matrix->x); }

  cholmod_common common{};
  cholmod_sparse* matrix = nullptr;  // upper triangle
  cholmod_factor* factor = nullptr;
};

BlockSystem::~BlockSystem() = default;
BlockSystem::BlockSystem(BlockSystem&&) noexcept = default;
BlockSystem& BlockSystem::operator=(BlockSystem&&) noexcept = default;

BlockSystem::BlockSystem(std::uint32_t blocks, int dimension, std::span<const Pair> pairs)
    : cholmod_(std::make_unique<Cholmod>()), dimension_(dimension), blocks_(blocks) {
  std::vector<Pair> upper;  // (column, row), so that sorting sorts by columns
  upper.reserve(pairs.size());
  for (const auto& [a, b] : pairs) {
    if (a != b) upper.emplace_back(std::max(a, b), std::min(a, b));
  }
  std::sort(upper.begin(), upper.end());
  upper.erase(std::unique(upper.begin(), upper.end()), upper.end());
  first_row_.assign(blocks + std::size_t{1}, 0);
  for (const auto& [column, row] : upper) {
    ++first_row_[column + std::size_t{1}];
    rows_.push_back(row);
  }
  for (std::size_t i = 0; i < blocks; ++i) first_row_[i + 1] += first_row_[i];

  const auto d = static_cast<std::size_t>(dimension);
  const std::size_t numbers = upper.size() * d * d + blocks * (d * (d + 1) / 2);
  if (numbers > static_cast<std::size_t>(std::numeric_limits<int>::max())) out_of_memory();
  cholmod_common* const common = &cholmod_->common;

  // The order of elimination, from the pattern of the blocks.
  cholmod_sparse* pattern =
      cholmod_allocate_sparse(blocks, blocks, upper.size() + blocks, 1, 1, 1, CHOLMOD_PATTERN, common);
  if (pattern == nullptr) out_of_memory();
  {
    int* const begin = static_cast<int*>(pattern->p);
    int* const row = static_cast<int*>(pattern->i);
    int at = 0;
    for (std::uint32_t column = 0; column < blocks; ++column) {
      begin[column] = at;
      for (std::uint32_t k = first_row_[column]; k < first_row_[column + 1]; ++k)
        row[at++] = static_cast<int>(rows_[k]);
      row[at++] = static_cast<int>(column);
    }
    begin[blocks] = at;
  }
  cholmod_factor* blocks_factor = cholmod_analyze(pattern, common);
  cholmod_free_sparse(&pattern, common);
  if (blocks_factor == nullptr) out_of_memory();
  const int* const block_order = static_cast<const int*>(blocks_factor->Perm);
  std::vector<int> order;
  order.reserve(blocks * d);
  for (std::uint32_t i = 0; i < blocks; ++i) {
    for (int k = 0; k < dimension; ++k) order.push_back(block_order[i] * dimension + k);
  }
  cholmod_free_factor(&blocks_factor, common);

  // The numbers' pattern: column c of a block column holds its blocks' rows, then the diagonal block's to c.
  cholmod_->matrix = cholmod_allocate_sparse(blocks * d, blocks * d, numbers, 1, 1, 1, CHOLMOD_REAL, common);
  if (cholmod_->matrix == nullptr) out_of_memory();
  int* const begin = cholmod_->column_begin();
  int* const row = cholmod_->row_index();
  int at = 0;
  for (std::uint32_t column = 0; column < blocks; ++column) {
    for (int c = 0; c < dimension; ++c) {
      begin[column * d + static_cast<std::size_t>(c)] = at;
      for (std::uint32_t k = first_row_[column]; k < first_row_[column + 1]; ++k) {
        for (int r = 0; r < dimension; ++r) row[at++] = static_cast<int>(rows_[k]) * dimension + r;
      }
      for (int r = 0; r <= c; ++r) row[at++] = static_cast<int>(column) * dimension + r;
    }
  }
  begin[blocks * d] = at;
  common->nmethods = 1;
  common->method[0].ordering = CHOLMOD_GIVEN;
  cholmod_->factor = cholmod_analyze_p(cholmod_->matrix, order.data(), nullptr, 0, common);
  if (cholmod_->factor == nullptr) out_of_memory();
  values_.assign(numbers, 0);
}

void BlockSystem::set_zero() {
  std::fill(values_.begin(), values_.end(), 0.0);
}

void BlockSystem::add_upper(std::uint32_t row, std::uint32_t column, const double* block) {
  const auto first = rows_.begin() + first_row_[column];
  const auto last = rows_.begin() + first_row_[column + std::size_t{1}];
  const auto place = row == column ? last : std::lower_bound(first, last, row);
  const auto offset = (place - first) * dimension_;
  const int* const begin = cholmod_->column_begin() + static_cast<std::ptrdiff_t>(column) * dimension_;
  for (int c = 0; c < dimension_; ++c) {
    const int rows = row == column ? c + 1 : dimension_;
    double* const to = values_.data() + begin[c] + offset;
    for (int r = 0; r < rows; ++r) to[r] += block[c * dimension_ + r];
  }
}

Eigen::VectorXd BlockSystem::diagonal() const {
  const Eigen::Index n = static_cast<Eigen::Index>(blocks_) * dimension_;
  Eigen::VectorXd d(n);
  const int* const begin = cholmod_->column_begin();
  for (Eigen::Index i = 0; i < n; ++i) d[i] = values_[static_cast<std::size_t>(begin[i + 1]) - 1];
  return d;
}

bool BlockSystem::factorize(double lambda) {
  std::copy(values_.begin(), values_.end(), cholmod_->value());
  const Eigen::Index n = static_cast<Eigen::Index>(blocks_) * dimension_;
  const int* const begin = cholmod_->column_begin();
  for (Eigen::Index i = 0; i < n; ++i) cholmod_->value()[begin[i + 1] - 1] *= 1 + lambda;
  const int done = cholmod_factorize(cholmod_->matrix, cholmod_->factor, &cholmod_->common);
  if (cholmod_->common.status == CHOLMOD_OUT_OF_MEMORY || cholmod_->common.status == CHOLMOD_TOO_LARGE)
    out_of_memory();
  return done != 0 && cholmod_->common.status == CHOLMOD_OK;
}

Eigen::MatrixXd BlockSystem::solve(const Eigen::MatrixXd& right_side) {
  Eigen::MatrixXd b = right_side;
  cholmod_dense dense{};
  dense.nrow = dense.d = static_cast<std::size_t>(b.rows());
  dense.ncol = static_cast<std::size_t>(b.cols());
  dense.nzmax = dense.nrow * dense.ncol;
  dense.x = b.data();
  dense.xtype = CHOLMOD_REAL;
  dense.dtype = CHOLMOD_DOUBLE;
  cholmod_dense* x = cholmod_solve(CHOLMOD_A, cholmod_->factor, &dense, &cholmod_->common);
  if (x == nullptr) out_of_memory();
  b = Eigen::Map<const Eigen::MatrixXd>(static_cast<const double*>(x->x), b.rows(), b.cols());
  cholmod_free_dense(&x, &cholmod_->common);
  return b;
}

std::size_t BlockSystem::factor_numbers() const {
  return static_cast<std::size_t>(cholmod_->common.lnz);
}

}  // namespace alces::offline
