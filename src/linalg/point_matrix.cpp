#include "slender_sim/linalg/point_matrix.h"

#include <stdexcept>

#include "slender_sim/linalg/point_kernel.h"

namespace slender {

void toPoints(const Eigen::Matrix3Xd& from, PointVector& to)
{
  to.resize(4 * from.cols());
  for (Eigen::Index i = 0; i < from.cols(); ++i)
  {
    point(to, i) = from.col(i);
    to[4 * i + 3] = 0.0;
  }
}

void fromPoints(const PointVector& from, Eigen::Matrix3Xd& to)
{
  to.resize(3, static_cast<Eigen::Index>(from.size() / 4));
  for (Eigen::Index i = 0; i < to.cols(); ++i)
    to.col(i) = point(from, i);
}

PointMatrix::PointMatrix(int size, const std::vector<Eigen::Triplet<double>>& entries)
{
  Eigen::SparseMatrix<double> matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseMatrix<double> transposed = matrix.transpose();
  if ((transposed - matrix).norm() > 1e-12 * matrix.norm())
    throw std::invalid_argument("PointMatrix: the entries are not symmetric");
  matrix = 0.5 * (matrix + transposed);
  starts_.assign(matrix.outerIndexPtr(), matrix.outerIndexPtr() + size + 1);   // of columns, so of rows
  for (Eigen::Index k = 0; k < matrix.nonZeros(); ++k)
    offsets_.push_back(4u * static_cast<unsigned>(matrix.innerIndexPtr()[k]));
  values_.assign(matrix.valuePtr(), matrix.valuePtr() + matrix.nonZeros());
}

Eigen::SparseMatrix<double> PointMatrix::toEigen() const
{
  std::vector<int> columns(offsets_.size());
  for (std::size_t k = 0; k < columns.size(); ++k)
    columns[k] = column(static_cast<int>(k));
  return Eigen::Map<const Eigen::SparseMatrix<double>>(size(), size(), static_cast<Eigen::Index>(values_.size()),
                                                       starts_.data(), columns.data(), values_.data());
}

double PointMatrix::multiply(const double* x, double* y) const
{
  return pointKernels().multiply(size(), starts_.data(), offsets_.data(), values_.data(), 0.0, x, y);
}

double PointMatrix::addProduct(double factor, const double* x, double* y) const
{
  if (factor == 0.0)
    return 0.0;
  return pointKernels().multiply(size(), starts_.data(), offsets_.data(), values_.data(), factor, x, y);
}

double PointMatrix::bytes() const
{
  return static_cast<double>(values_.size()) * (sizeof(double) + sizeof(int)) +
         size() * (sizeof(int) + 8.0 * sizeof(double));
}

}   // namespace slender
