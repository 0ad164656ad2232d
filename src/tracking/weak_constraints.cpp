#include "slender_sim/tracking/weak_constraints.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/SparseCholesky>

namespace slender {

namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;

MassMatrix assembled(const Triplets& entries, Eigen::Index size)
{
  MassMatrix mass(size, size);
  mass.setFromTriplets(entries.begin(), entries.end());
  return mass;
}

WeakConstraints::Matrix scaledRows(const TestFunctions::Values& values, const MassMatrix& mass,
                                   const std::vector<std::string>& names, const char* mesh, Eigen::VectorXd* measures)
{
  if (values.cols() != mass.rows())
    throw std::invalid_argument("test functions of " + std::to_string(values.cols()) + " vertices do not fit a " +
                                mesh + " mesh of " + std::to_string(mass.rows()));
  WeakConstraints::Matrix c = values * mass;
  const Eigen::VectorXd sums = c * Eigen::VectorXd::Ones(c.cols());
  for (Eigen::Index i = 0; i < c.rows(); ++i)
  {
    if (!(sums[i] > 0) || !std::isfinite(sums[i]))
      throw std::invalid_argument("test function '" + names[i] + "' is empty on the " + mesh +
                                  " mesh (its integral is not positive): leave it out");
    c.row(i) *= 1.0 / sums[i];
  }
  if (measures)
    *measures = sums;
  c.makeCompressed();
  return c;
}

}   // namespace

MassMatrix hatMassMatrix(const TriangleMesh& rest)
{
  const Eigen::VectorXd areas = faceAreas(rest);
  Triplets entries;
  for (Eigen::Index f = 0; f < rest.triangles.cols(); ++f)
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        entries.emplace_back(rest.triangles(a, f), rest.triangles(b, f), areas[f] / (a == b ? 6.0 : 12.0));
  return assembled(entries, rest.vertices.cols());
}

MassMatrix hatMassMatrix(const Eigen::Matrix3Xd& rest_nodes, bool closed)
{
  const int nodes = static_cast<int>(rest_nodes.cols());
  Triplets entries;
  for (int i = 0; i < (closed ? nodes : nodes - 1); ++i)
  {
    const int j = (i + 1) % nodes;
    const double length = (rest_nodes.col(j) - rest_nodes.col(i)).norm();
    for (const int end : {i, j})
      entries.emplace_back(end, end, length / 3.0);
    entries.emplace_back(i, j, length / 6.0);
    entries.emplace_back(j, i, length / 6.0);
  }
  return assembled(entries, nodes);
}

WeakConstraints::WeakConstraints(const TestFunctions& functions, const MassMatrix& guide, const MassMatrix& tracked)
  : names_(functions.names),
    c_(scaledRows(functions.tracked, tracked, names_, "tracked", &measures_)),
    guide_(scaledRows(functions.guide, guide, names_, "guide", nullptr))
{
  if (c_.rows() != functions.count() || guide_.rows() != functions.count())
    throw std::invalid_argument("test functions: one row per name expected on both meshes");
}

Eigen::Matrix3Xd WeakConstraints::averages(const Eigen::Matrix3Xd& guide) const
{
  Eigen::Matrix3Xd result;
  averages(guide, result);
  return result;
}

void WeakConstraints::averages(const Eigen::Matrix3Xd& guide, Eigen::Matrix3Xd& result) const
{
  result.setZero(3, guide_.rows());
  for (Eigen::Index i = 0; i < guide_.rows(); ++i)
    for (Matrix::InnerIterator it(guide_, i); it; ++it)
      result.col(i) += it.value() * guide.col(it.col());
}

double WeakConstraints::distance(int i, const Eigen::Matrix3Xd& targets, const Eigen::Matrix3Xd& tracked) const
{
  Eigen::Vector3d away = -targets.col(i);
  for (Matrix::InnerIterator entry(c_, i); entry; ++entry)
    away += entry.value() * tracked.col(entry.col());
  return away.norm();
}

double WeakConstraints::error(const Eigen::Matrix3Xd& targets, const Eigen::Matrix3Xd& tracked) const
{
  double worst = 0.0;
  for (int i = 0; i < count(); ++i)
    worst = std::max(worst, distance(i, targets, tracked));
  return worst;
}

void WeakConstraints::requireIndependent(const std::vector<char>& held) const
{
  Matrix free = c_;
  if (!held.empty())
    free.prune([&](Eigen::Index, Eigen::Index column, double) { return !held[column]; });
  for (int i = 0; i < count(); ++i)
  {
    const double length = free.row(i).norm();
    if (!(length > 0))
      throw std::invalid_argument("test function '" + names_[i] +
                                  "' acts on held vertices only: leave it out or release some");
    free.row(i) *= 1.0 / length;
  }
  // The smallest eigenvalue of the rows' Gram matrix, and what combination of them leaves so little, by inverse
  // iteration.
  constexpr double kDependent = 1e-11, kShift = 1e-13;
  const Eigen::SparseMatrix<double> gram(free * free.transpose());
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor;
  double shift = kShift;
  do   // it stops at pivots that are zero
  {
    factor.setShift(shift);
    factor.compute(gram);
    shift *= 2.0;
  }
  while (factor.info() != Eigen::Success);
  Eigen::VectorXd x(count());
  for (int i = 0; i < count(); ++i)
    x[i] = std::cos(static_cast<double>(i) * i);
  for (int k = 0; k < 4; ++k)
    x = Eigen::VectorXd(factor.solve(x)).normalized();
  if (!(x.dot(gram * x) <= kDependent))
    return;
  std::vector<int> parts;
  for (int i = 0; i < count(); ++i)
    if (std::abs(x[i]) > 1e-3 * x.lpNorm<Eigen::Infinity>())
      parts.push_back(i);
  std::string others;
  for (std::size_t k = 0; k + 1 < parts.size() && k < 5; ++k)
    others += (others.empty() ? "'" : ", '") + names_[parts[k]] + "'";
  if (parts.size() > 6)
    others += " and " + std::to_string(parts.size() - 6) + " more";
  if (others.empty())
    others = "very many others";
  throw std::invalid_argument("test function '" + names_[parts.back()] + "' depends on " + others +
                              (held.empty() ? "" : " (on the vertices that are not held)") +
                              ": leave it out or change its region");
}

}   // namespace slender
