#pragma once

#include <string>
#include <vector>

#include <Eigen/SparseCore>

#include "slender_sim/tracking/test_functions.h"

namespace slender {

using MassMatrix = Eigen::SparseMatrix<double>;

/// Integrals of products of two hat functions (Petrov-Galerkin mass matrix, thesis 6.4.2) [m^2]: A_j/6 and A_jl/12.
MassMatrix hatMassMatrix(const TriangleMesh& rest);
/// The same along a curve of straight edges [m]: a third of the edges at a node, a sixth of the edge between two.
MassMatrix hatMassMatrix(const Eigen::Matrix3Xd& rest_nodes, bool closed);

/// Averages of a tracked shape that equal those of its guide (thesis 6.3.2):
///   sum_j Cbar_ij qbar_j = sum_l C_il q_l for each test function i and each coordinate.
/// Rows are scaled so that both sum to 1, which is the normalisation (6.8) up to a common factor per row: constraints
/// are lengths [m], and a multiplier is the force [N] with which the guide pulls at its region.
class WeakConstraints
{
public:
  using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  /// Throws std::invalid_argument naming test functions whose integral is not positive on either mesh, or sizes that do
  /// not fit.
  WeakConstraints(const TestFunctions& functions, const MassMatrix& guide, const MassMatrix& tracked);

  int count() const { return static_cast<int>(c_.rows()); }
  const std::string& name(int i) const { return names_[i]; }
  const Matrix& matrix() const { return c_; }            ///< C, count x tracked vertices
  const Matrix& guideMatrix() const { return guide_; }   ///< Cbar, count x guide vertices

  /// Integrals of the test functions over the tracked shape [m^2], of curves [m].
  const Eigen::VectorXd& measures() const { return measures_; }

  /// What the averages shall be: 3 x count, of guide vertices 3 x nbar [m].
  Eigen::Matrix3Xd averages(const Eigen::Matrix3Xd& guide) const;
  /// The same into `result`, which takes no memory when it has had that size before.
  void averages(const Eigen::Matrix3Xd& guide, Eigen::Matrix3Xd& result) const;
  /// Distance of average i of the tracked vertices (3 x n) from its target [m].
  double distance(int i, const Eigen::Matrix3Xd& targets, const Eigen::Matrix3Xd& tracked) const;
  /// The greatest of all.
  double error(const Eigen::Matrix3Xd& targets, const Eigen::Matrix3Xd& tracked) const;

  /// Throws std::invalid_argument naming functions that can be had from others (see C), on the vertices that are free:
  /// no two constraints may prescribe the same average. `held` may be empty.
  void requireIndependent(const std::vector<char>& held) const;

private:
  std::vector<std::string> names_;
  Eigen::VectorXd measures_;
  Matrix c_, guide_;
};

}   // namespace slender
