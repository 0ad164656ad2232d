#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCore>

#include "slender_sim/energy/hinge.h"
#include "slender_sim/energy/isometric_bending.h"
#include "slender_sim/energy/membrane.h"
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

/// Energy, gradient (3 x n) and Hessian of a HingeBending or MembraneEnergy.
template <class Energy>
struct Derivatives
{
  const Energy& energy;
  Eigen::MatrixXi elements;
  BlockMatrix matrix;
  std::vector<int> slots;

  Derivatives(const Energy& e, int points, const Eigen::MatrixXi& of)
    : energy(e),
      elements(of),
      matrix(points, {of}),
      slots(e.slotsIn(matrix))
  {
  }

  Matrix3Xd gradient(const Matrix3Xd& x)
  {
    PointVector g(4 * x.cols(), 0.0);
    energy.addGradient(pointsOf(x).data(), g.data());
    return matrixOf(g);
  }
  /// `from`: further arguments of addHessian(), see MembraneEnergy.
  template <class... From>
  MatrixXd hessian(const Matrix3Xd& x, HessianKind kind, const From&... from)
  {
    matrix.setZero();
    PointVector g(4 * x.cols(), 0.0);
    energy.addHessian(kind, pointsOf(x).data(), slots, g.data(), matrix.values(), pointsOf(from).data()...);
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
