#include "swept_blocks.h"

#include <algorithm>
#include <numeric>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace slender {

namespace {

template <class Scalar>
void putBlock(const Eigen::Matrix3d& block, int stride, Scalar* to)
{
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r)
      to[stride * c + r] = static_cast<Scalar>(block(r, c));
}

/// By Cholesky's factors: the product with the block is the identity up to rounding times the root of the condition
/// number, where cofactors leave the condition number. Blocks that are not positive definite have their plain inverse.
Eigen::Matrix3d exactInverse(const Eigen::Matrix3d& block)
{
  const Eigen::LLT<Eigen::Matrix3d> factor(block);
  if (factor.info() != Eigen::Success)
    return block.inverse();
  const Eigen::Matrix3d root = factor.matrixL().solve(Eigen::Matrix3d::Identity());
  return root.transpose() * root;
}

}   // namespace

double largestEntry(const PointVector& v)
{
  return v.empty()
             ? 0.0
             : Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size())).cwiseAbs().maxCoeff();
}

void SweptBlocks::orderPoints()
{
  const int n = a_->points();
  std::vector<int> level(n, 0);
  const auto follow = [&](int j, int i) { level[i] = std::max(level[i], level[j] + 1); };
  for (int j = 0; j < n; ++j)
  {
    for (int k = a_->starts()[j] + 1; k < a_->starts()[j + 1]; ++k)
      follow(j, a_->rows()[k]);
    for (int k = b_ ? b_->starts()[j] : 0; k < (b_ ? b_->starts()[j + 1] : 0); ++k)
      if (b_->column(k) > j)
        follow(j, b_->column(k));
  }
  order_.resize(n);
  std::iota(order_.begin(), order_.end(), 0);
  std::stable_sort(order_.begin(), order_.end(), [&](int i, int j) { return level[i] < level[j]; });
}

void SweptBlocks::setPattern(const BlockMatrix& a, const PointMatrix* b)
{
  a_ = &a;
  b_ = b;
  orderPoints();
  const int n = points();
  std::vector<int> visit(n);
  for (int v = 0; v < n; ++v)
    visit[order_[v]] = v;
  starts_.assign(1, 0);
  for (std::vector<int>* v : {&rows_, &a_entry_, &b_entry_})
    v->clear();
  b_diagonal_.assign(n, -1);
  for (int v = 0; v < n; ++v)
  {
    const int j = order_[v];
    int in_b = b ? b->starts()[j] : 0;
    const int b_end = b ? b->starts()[j + 1] : 0;
    const auto take = [&](int row, int a_entry, int b_entry) {
      rows_.push_back(visit[row]);
      a_entry_.push_back(a_entry);
      b_entry_.push_back(b_entry);
    };
    for (; in_b < b_end && b->column(in_b) <= j; ++in_b)
      if (b->column(in_b) == j)
        b_diagonal_[v] = in_b;
    for (int k = a.starts()[j] + 1; k < a.starts()[j + 1]; ++k)
    {
      for (; in_b < b_end && b->column(in_b) < a.rows()[k]; ++in_b)
        take(b->column(in_b), -1, in_b);
      const bool both = in_b < b_end && b->column(in_b) == a.rows()[k];
      take(a.rows()[k], k, both ? in_b++ : -1);
    }
    for (; in_b < b_end; ++in_b)
      take(b->column(in_b), -1, in_b);
    starts_.push_back(static_cast<int>(rows_.size()));
  }
}

void SweptBlocks::set(double factor, const std::vector<char>& held, const std::vector<char>* apart)
{
  factor_ = factor;
  held_ = &held;
  moves_.resize(order_.size());
  for (int v = 0; v < points(); ++v)
    moves_[v] = !isHeld(v) && !(apart && (*apart)[order_[v]]);
}

Eigen::Matrix3d SweptBlocks::block(int entry) const
{
  Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
  if (a_entry_[entry] >= 0)
    block = Eigen::Map<const Eigen::Matrix3d>(a_->values() + 9 * static_cast<std::size_t>(a_entry_[entry]));
  if (b_entry_[entry] >= 0)
    block.diagonal().array() += factor_ * b_->values()[b_entry_[entry]];
  return block;
}

Eigen::Matrix3d SweptBlocks::diagonal(int visit) const
{
  Eigen::Matrix3d block =
      Eigen::Map<const Eigen::Matrix3d>(a_->values() + 9 * static_cast<std::size_t>(a_->starts()[order_[visit]]));
  if (b_diagonal_[visit] >= 0)
    block.diagonal().array() += factor_ * b_->values()[b_diagonal_[visit]];
  return block;
}

template <class Scalar>
void SweptBlocks::pack(SweptValues<Scalar>& values, Deflation* deflation) const
{
  values.blocks.resize(9 * rows_.size() + 3);   // three more, for wide loads
  values.diagonal.resize(12 * order_.size());
  values.inverse.resize(12 * order_.size());
  const Eigen::Matrix3d zero = Eigen::Matrix3d::Zero();
  for (int v = 0; v < points(); ++v)
  {
    const Eigen::Matrix3d own = diagonal(v);
    putBlock(isHeld(v) ? zero : own, 4, values.diagonal.data() + 12 * static_cast<std::size_t>(v));
    constexpr bool exact = std::is_same_v<Scalar, double>;   // Single precision spoils what this gains.
    putBlock(isHeld(v) ? zero
             : exact   ? exactInverse(own)
                       : Eigen::Matrix3d(own.inverse()),
             4, values.inverse.data() + 12 * static_cast<std::size_t>(v));
    if (deflation)
      deflation->addDiagonal(v, own);
    for (int k = starts_[v]; k < starts_[v + 1]; ++k)
    {
      const Eigen::Matrix3d between = block(k);
      putBlock(isHeld(v) || isHeld(rows_[k]) ? zero : between, 3,
               values.blocks.data() + 9 * static_cast<std::size_t>(k));
      if (deflation)
        deflation->add(k, rows_[k], v, between);
    }
  }
}

template void SweptBlocks::pack(SweptValues<float>&, Deflation*) const;
template void SweptBlocks::pack(SweptValues<double>&, Deflation*) const;

void SweptBlocks::multiply(const PointVector& x, PointVector& product) const
{
  std::fill(product.begin(), product.end(), 0.0);
  a_->addProduct(x.data(), product.data());
  if (b_)
    b_->addProduct(factor_, x.data(), product.data());
}

void SweptBlocks::toVisits(const PointVector& from, PointVector& to) const
{
  for (int v = 0; v < points(); ++v)
    point(to, v) = point(from, order_[v]);
}

}   // namespace slender
