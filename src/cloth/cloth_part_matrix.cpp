// The matrix of a cloth in that of an island.
#include "cloth_part.h"

namespace slender {

void ClothPart::notePattern(SharedMatrix& matrix)
{
  const auto note = [&](int i, int j, bool whole) {
    for (int c = 0; c < 3; ++c)
      for (int r = whole ? 0 : c; r < (whole ? 3 : c + 1); ++r)
        matrix.note(base(i) + r, base(j) + c);
  };
  const BlockMatrix& blocks = system().matrix();
  for (int j = 0; j < points(); ++j)
    for (int k = blocks.starts()[j]; k < blocks.starts()[j + 1]; ++k)
      if (isFree(j) && isFree(blocks.rows()[k]))
        note(blocks.rows()[k], j, true);
  const PointMatrix* constant = system().constantInBlocks() ? nullptr : system().constantMatrix();
  for (int i = 0; constant && i < points(); ++i)
    for (int k = constant->starts()[i]; k < constant->starts()[i + 1] && constant->column(k) <= i; ++k)
      if (isFree(i) && isFree(constant->column(k)))
        note(i, constant->column(k), false);
}

void ClothPart::findEntries(const SharedMatrix& matrix)
{
  const BlockMatrix& blocks = system().matrix();
  block_entries_.assign(3 * static_cast<std::size_t>(blocks.blocks()), -1);
  for (int j = 0; j < points(); ++j)
    for (int k = blocks.starts()[j]; k < blocks.starts()[j + 1]; ++k)
      if (const int i = blocks.rows()[k]; isFree(i) && isFree(j))
        for (int c = 0, at = 0; c < 3; ++c)
        {
          at = i == j  ? matrix.diagonal(base(j) + c)
               : c > 0 ? matrix.inNextColumn(at, base(i), base(j) + c - 1)
                       : matrix.index(base(i), base(j));
          block_entries_[3 * k + c] = at;
        }
  constant_entries_.clear();
  const PointMatrix* constant = system().constantInBlocks() ? nullptr : system().constantMatrix();
  for (int i = 0; constant && i < points(); ++i)
    for (int k = constant->starts()[i]; k < constant->starts()[i + 1] && constant->column(k) <= i; ++k)
      for (int c = 0, j = constant->column(k); c < 3; ++c)
        constant_entries_.push_back(isFree(i) && isFree(j) ? matrix.index(base(i) + c, base(j) + c) : -1);
}

/// Rows of a point follow each other in the matrix, so that those of a block's column do.
void ClothPart::addHessian(SharedMatrix& matrix, const HessianShift& shift)
{
  const BlockMatrix& blocks = system().matrix();
  double* const values = matrix.values();
  const double added = inertiaShift(shift);
  for (int j = 0; j < points(); ++j)
    for (int k = blocks.starts()[j]; k < blocks.starts()[j + 1]; ++k)
    {
      const bool diagonal = blocks.rows()[k] == j;
      const double* block = blocks.values() + 9 * static_cast<std::size_t>(k);
      for (int c = 0; c < 3 && block_entries_[3 * k + c] >= 0; ++c)
      {
        double* const to = values + block_entries_[3 * k + c] - (diagonal ? c : 0);
        for (int r = diagonal ? c : 0; r < 3; ++r)
          to[r] += block[3 * c + r] + (diagonal && r == c ? added * system().weights()[j] : 0.0);
      }
    }
  const PointMatrix* constant = system().constantInBlocks() ? nullptr : system().constantMatrix();
  const double factor = 1.0 + system().viscosity();
  const int* entry = constant_entries_.data();
  for (int i = 0; constant && i < points(); ++i)
    for (int k = constant->starts()[i]; k < constant->starts()[i + 1] && constant->column(k) <= i; ++k)
      for (int c = 0; c < 3; ++c, ++entry)
        if (*entry >= 0)
          values[*entry] += factor * constant->values()[k];
}

/// Adds to the gradient what it changes, by the last Hessian, as held vertices go to held_end_.
void ClothPart::addHeldMotion()
{
  PointVector& gradient = system().gradient();
  const auto move = [&](int i) { return Eigen::Vector3d(held_end_->col(first_point + i) - vertex(base_, i)); };
  const BlockMatrix& blocks = system().matrix();
  for (int j = 0; j < points(); ++j)
    for (int k = blocks.starts()[j]; k < blocks.starts()[j + 1]; ++k)
    {
      const int i = blocks.rows()[k];
      const Eigen::Map<const Eigen::Matrix3d> block(blocks.values() + 9 * static_cast<std::size_t>(k));
      if (isFree(i) && !isFree(j))
        vertex(gradient, i) += block * move(j);
      else if (!isFree(i) && isFree(j))
        vertex(gradient, j) += block.transpose() * move(i);
    }
  const PointMatrix* constant = system().constantInBlocks() ? nullptr : system().constantMatrix();
  const double factor = 1.0 + system().viscosity();
  for (int i = 0; constant && i < points(); ++i)
    for (int k = constant->starts()[i]; k < constant->starts()[i + 1]; ++k)
      if (const int j = constant->column(k); isFree(i) && !isFree(j))
        vertex(gradient, i) += factor * constant->values()[k] * move(j);
}

void ClothPart::addColumns(int point, int component, double weight, Columns& row) const
{
  if (isFree(point))
    row.push(base(point) + component, weight);
}

}   // namespace slender
