#include "cloth_preconditioner.h"

#include <algorithm>

#include <Eigen/Geometry>

namespace slender {

namespace {

void addEntries(const PointMatrix& matrix, std::vector<Eigen::Triplet<double>>& entries)
{
  for (int i = 0; i < matrix.size(); ++i)
    for (int k = matrix.starts()[i]; k < matrix.starts()[i + 1]; ++k)
      entries.emplace_back(i, matrix.column(k), matrix.values()[k]);
}

double largestDiagonal(const PointMatrix& matrix)
{
  double largest = 0.0;
  for (int i = 0; i < matrix.size(); ++i)
    for (int k = matrix.starts()[i]; k < matrix.starts()[i + 1]; ++k)
      if (matrix.column(k) == i)
        largest = std::max(largest, matrix.values()[k]);
  return largest;
}

/// Bending reaches farther than stretching, so that its factor is twice as large: left out where it hardly matters.
PointMatrix constantPart(int points, const PointMatrix& bending, const PointMatrix& stretching)
{
  constexpr double kSmall = 0.1;
  if (bending.size() == 0 || largestDiagonal(bending) < kSmall * largestDiagonal(stretching))
    return stretching;
  std::vector<Eigen::Triplet<double>> entries;
  addEntries(bending, entries);
  addEntries(stretching, entries);
  return PointMatrix(points, entries);
}

/// Sum of the matrices that stand in for the terms of an account; without rows if there are none.
PointMatrix standIn(int points, const std::vector<ClothTerm>& terms, TermAccount account)
{
  std::vector<Eigen::Triplet<double>> entries;
  bool any = false;
  for (const ClothTerm& term : terms)
  {
    const PointMatrix* constant = term.energy->constantMatrix();
    if (term.energy->account() != account || !(constant || term.stand_in))
      continue;
    addEntries(constant ? *constant : term.stand_in(), entries);
    any = true;
  }
  return any ? PointMatrix(points, entries) : PointMatrix();
}

}   // namespace

ShiftedMatrix::ShiftedMatrix(const PointMatrix& a)
{
  const int n = a.size();
  std::vector<Eigen::Triplet<double>> entries;
  addEntries(a, entries);
  for (int i = 0; i < n; ++i)
    entries.emplace_back(i, i, 0.0);
  a_ = PointMatrix(n, entries);
  for (int i = 0; i < n; ++i)
    for (int k = a_.starts()[i]; k < a_.starts()[i + 1]; ++k)
      if (a_.column(k) == i)
        diagonal_.push_back(k);
  values_ = a_.values();
  weight_.assign(n, 0.0);
  factor_.setPattern(a_);
}

bool ShiftedMatrix::factor(const std::vector<double>& diagonal, double c, const std::vector<char>& held)
{
  weight_ = diagonal;
  c_ = c;
  for (std::size_t k = 0; k < values_.size(); ++k)
    values_[k] = c * a_.values()[k];
  for (std::size_t i = 0; i < diagonal_.size(); ++i)
    values_[diagonal_[i]] += diagonal[i];
  return factor_.factor(a_, values_.data(), held.data());
}

void ShiftedMatrix::addProduct(const double* x, double* y) const
{
  a_.addProduct(c_, x, y);
  for (std::size_t i = 0; i < weight_.size(); ++i)
    for (int k = 0; k < 3; ++k)
      y[4 * i + k] += weight_[i] * x[4 * i + k];
}

ClothPreconditioner::ClothPreconditioner(const ClothModel& model, const std::vector<ClothTerm>& terms,
                                         const BlockMatrix& pattern)
  : ClothPreconditioner(model, terms, pattern, standIn(model.vertices(), terms, TermAccount::bending))
{
}

ClothPreconditioner::ClothPreconditioner(const ClothModel& model, const std::vector<ClothTerm>& terms,
                                         const BlockMatrix& pattern, const PointMatrix& bending)
  : model_(model),
    constant_(constantPart(model.vertices(), bending, standIn(model.vertices(), terms, TermAccount::stretching)))
{
  const int n = model.vertices();
  bending_diagonal_.assign(static_cast<std::size_t>(n), 0.0);
  for (int i = 0; i < bending.size(); ++i)
    for (int k = bending.starts()[i]; k < bending.starts()[i + 1]; ++k)
      if (bending.column(k) == i)
        bending_diagonal_[static_cast<std::size_t>(i)] = bending.values()[k];
  const PointMatrix* separate = nullptr;
  for (const ClothTerm& term : terms)
    if (term.energy->constantMatrix())
      separate = term.energy->constantMatrix();
  std::vector<Eigen::Triplet<double>> entries;
  for (int j = 0; j < n; ++j)
    for (int k = pattern.starts()[j]; k < pattern.starts()[j + 1]; ++k)
    {
      entries.emplace_back(pattern.rows()[k], j, 1.0);
      if (pattern.rows()[k] != j)
        entries.emplace_back(j, pattern.rows()[k], 1.0);
    }
  if (separate)
    addEntries(*separate, entries);
  normal_pattern_ = PointMatrix(n, entries);
  Eigen::SparseMatrix<double> values(n, n);
  if (separate)
    values = separate->toEigen();
  for (int i = 0; i < n; ++i)
    for (int k = normal_pattern_.starts()[i]; k < normal_pattern_.starts()[i + 1]; ++k)
    {
      const int j = normal_pattern_.column(k);
      normal_block_.push_back(j <= i ? pattern.block(i, j) : -1);
      normal_bending_.push_back(j <= i && separate ? values.coeff(i, j) : 0.0);
    }
  normal_values_.assign(normal_block_.size(), 0.0);
  normal_factor_.setPattern(normal_pattern_);
  for (PointVector* v : {&normals_, &along_, &within_})
    v->assign(4 * n, 0.0);
}

bool ClothPreconditioner::setConstant(const std::vector<double>& weights, double factor, const std::vector<char>& held)
{
  factor_ = factor;
  aligned_ = false;
  return constant_.factor(weights, factor, held);
}

void ClothPreconditioner::align(const PointVector& x, const BlockMatrix& matrix, const std::vector<char>& held)
{
  const int n = model_.vertices();
  std::fill(normals_.begin(), normals_.end(), 0.0);
  for (Eigen::Index f = 0; f < model_.rest.triangles.cols(); ++f)
  {
    const Eigen::Vector3i t = model_.rest.triangles.col(f);
    const Eigen::Vector3d area = (point(x, t[1]) - point(x, t[0])).cross(point(x, t[2]) - point(x, t[0]));
    for (int k = 0; k < 3; ++k)
      point(normals_, t[k]) += area;
  }
  for (int i = 0; i < n; ++i)
  {
    const double size = point(normals_, i).norm();
    point(normals_, i) = size > 0 ? Eigen::Vector3d(point(normals_, i) / size) : Eigen::Vector3d::UnitZ();
  }
  for (int i = 0; i < n; ++i)
    for (int k = normal_pattern_.starts()[i]; k < normal_pattern_.starts()[i + 1]; ++k)
    {
      const int j = normal_pattern_.column(k), block = normal_block_[k];
      if (j > i)
        continue;
      const Eigen::Vector3d a = point(normals_, i), b = point(normals_, j);
      normal_values_[k] = factor_ * normal_bending_[k] * a.dot(b);
      if (block >= 0)
        normal_values_[k] +=
            a.dot(Eigen::Map<const Eigen::Matrix3d>(matrix.values() + 9 * static_cast<std::size_t>(block)) * b);
    }
  aligned_ = normal_factor_.factor(normal_pattern_, normal_values_.data(), held.data());
}

void ClothPreconditioner::apply(const PointVector& r, PointVector& z)
{
  if (!aligned_)
    return constant_.solve(r, z);
  for (int i = 0; i < model_.vertices(); ++i)
  {
    const double along = point(normals_, i).dot(point(r, i));
    point(along_, i) = Eigen::Vector3d(along, 0, 0);
    point(within_, i) = point(r, i) - along * point(normals_, i);
  }
  constant_.solve(within_, z);
  normal_factor_.solvePoints(along_.data(), along_.data());
  for (int i = 0; i < model_.vertices(); ++i)
  {
    const Eigen::Vector3d normal = point(normals_, i), within = point(z, i);
    point(z, i) = within + (along_[4 * i] - normal.dot(within)) * normal;
  }
}

}   // namespace slender
