#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCore>

#include "slender_sim/energy/hinge_term.h"
#include "slender_sim/energy/isometric_bending.h"
#include "slender_sim/energy/membrane_term.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/geometry/mesh_topology.h"
#include "test/support/random.h"

/// Meshes and derivatives that several tests of cloth share.
namespace slender::test {

using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

inline PointVector pointsOf(const Matrix3Xd& x)
{
  PointVector points;
  toPoints(x, points);
  return points;
}

inline Matrix3Xd matrixOf(const PointVector& points)
{
  Matrix3Xd x;
  fromPoints(points, x);
  return x;
}

/// 3n x 3n, dense.
inline MatrixXd denseOf(const BlockMatrix& m)
{
  MatrixXd a = MatrixXd::Zero(3 * m.points(), 3 * m.points());
  for (int j = 0; j < m.points(); ++j)
    for (int k = m.starts()[j]; k < m.starts()[j + 1]; ++k)
    {
      const Eigen::Matrix3d block = Eigen::Map<const Eigen::Matrix3d>(m.values() + 9 * k);
      a.block<3, 3>(3 * m.rows()[k], 3 * j) = block;
      a.block<3, 3>(3 * j, 3 * m.rows()[k]) = block.transpose();
    }
  return a;
}

/// Gradient (3 x n) and Hessian of a term.
struct Derivatives
{
  PointTerm& energy;
  BlockMatrix matrix;

  Derivatives(PointTerm& e, int points) : energy(e), matrix(points, {e.elements()}) { energy.setPattern(matrix); }

  Matrix3Xd gradient(const Matrix3Xd& x)
  {
    PointVector g(4 * x.cols(), 0.0);
    energy.addGradient(pointsOf(x).data(), g.data());
    return matrixOf(g);
  }
  /// `from`: see PointTerm::addHessian(); without columns: null.
  MatrixXd hessian(const Matrix3Xd& x, HessianKind kind, const Matrix3Xd& from = Matrix3Xd())
  {
    matrix.setZero();
    PointVector g(4 * x.cols(), 0.0);
    energy.addHessian(kind, pointsOf(x).data(), g.data(), matrix.values(),
                      from.cols() ? pointsOf(from).data() : nullptr);
    return denseOf(matrix);
  }
};

/// Central differences of fourth order of a function of points (3 x n); one row per coordinate of the point.
template <class Function>
MatrixXd differences(const Matrix3Xd& x, double h, Function f)
{
  MatrixXd rows;
  Matrix3Xd y = x;
  for (Eigen::Index k = 0; k < x.size(); ++k)
  {
    const auto at = [&](double step) -> VectorXd {
      y.data()[k] = x.data()[k] + step;
      const VectorXd value = f(y);
      y.data()[k] = x.data()[k];
      return value;
    };
    const VectorXd d = (8.0 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12.0 * h);
    if (rows.size() == 0)
      rows.resize(x.size(), d.size());
    rows.row(k) = d;
  }
  return rows;
}

inline double smallestEigenvalue(const MatrixXd& a)
{
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(a).eigenvalues()[0];
}

inline VectorXd flattened(const Matrix3Xd& x) { return Eigen::Map<const VectorXd>(x.data(), x.size()); }

}   // namespace slender::test
