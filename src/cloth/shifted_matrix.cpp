#include "shifted_matrix.h"

#include <algorithm>

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

/// Bending reaches farther than stretching, so that its factor is twice as large: left out where it hardly matters.
PointMatrix constantStiffness(const ClothModel& model, const std::vector<ClothTerm>& terms)
{
  constexpr double kSmall = 0.1;
  const int points = model.vertices();
  const PointMatrix bending = standIn(points, terms, TermAccount::bending),
                    stretching = standIn(points, terms, TermAccount::stretching);
  if (bending.size() == 0 || largestDiagonal(bending) < kSmall * largestDiagonal(stretching))
    return stretching;
  std::vector<Eigen::Triplet<double>> entries;
  addEntries(bending, entries);
  addEntries(stretching, entries);
  return PointMatrix(points, entries);
}

}   // namespace slender
