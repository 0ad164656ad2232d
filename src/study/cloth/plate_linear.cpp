// Small deflections and buckling of flat plates by the cloth's own energies.
#include "plate_linear.h"

#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>

#include "slender_sim/energy/hinge_term.h"
#include "slender_sim/energy/membrane_term.h"
#include "slender_sim/energy/isometric_bending.h"
#include "slender_sim/linalg/sparse_cholesky.h"

namespace slender::study {

namespace {

using Sparse = Eigen::SparseMatrix<double>;

IsometricElement elementOf(BendingModel model)
{
  return model == BendingModel::isometric_conforming ? IsometricElement::conforming : IsometricElement::nonconforming;
}

/// z-z entries of a matrix of blocks.
Sparse normalPart(const BlockMatrix& m)
{
  std::vector<Eigen::Triplet<double>> entries;
  for (int j = 0; j < m.points(); ++j)
    for (int k = m.starts()[j]; k < m.starts()[j + 1]; ++k)
    {
      const double value = m.values()[9 * static_cast<long>(k) + 8];
      entries.emplace_back(m.rows()[k], j, value);
      if (m.rows()[k] != j)
        entries.emplace_back(j, m.rows()[k], value);
    }
  Sparse matrix(m.points(), m.points());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

struct Free
{
  std::vector<int> number;   ///< of each vertex among the free ones, -1: held
  int count = 0;

  Free(int vertices, const std::vector<int>& held) : number(vertices, 0)
  {
    for (const int v : held)
      number[v] = -1;
    for (int& k : number)
      k = k < 0 ? -1 : count++;
  }
  Sparse of(const Sparse& matrix) const
  {
    std::vector<Eigen::Triplet<double>> entries;
    for (int j = 0; j < matrix.outerSize(); ++j)
      for (Sparse::InnerIterator it(matrix, j); it; ++it)
        if (number[it.row()] >= 0 && number[j] >= 0)
          entries.emplace_back(number[it.row()], number[j], it.value());
    Sparse part(count, count);
    part.setFromTriplets(entries.begin(), entries.end());
    return part;
  }
};

/// A grid with a margin of one cell on the sides asked for, so that holding its vertices clamps; [0, width] x [0,
/// height] without it.
TriangleMesh plateMesh(GridPattern pattern, double width, double height, int columns, bool left, bool others)
{
  const bool triangular = pattern == GridPattern::equilateral || pattern == GridPattern::irregular;
  const double h = width / columns;
  const int rows = std::max(2, static_cast<int>(std::lround(height / (triangular ? h * std::sqrt(0.75) : h))));
  const double v = height / rows;
  TriangleMesh mesh = gridMesh(width + h * (left + others), height + 2 * v * others, columns + left + others,
                               rows + 2 * others, pattern);
  mesh.vertices.row(0).array() -= left ? h : 0.0;
  mesh.vertices.row(1).array() -= others ? v : 0.0;
  return mesh;
}

}   // namespace

double plateEnergy(const TriangleMesh& rest, const MeshTopology& t, BendingModel model, const Eigen::Matrix3Xd& x)
{
  const double coefficient = bendingCalibration(rest, t, elementOf(model), Eigen::Vector3d::UnitX());
  PointVector points, product(4 * x.cols());
  toPoints(x, points);
  if (model == BendingModel::hinge)
    return HingeTerm(t.hinges, hingeStiffness(rest, t, coefficient), Eigen::VectorXd::Zero(t.hingeCount()))
        .value(points.data())
        .energy;
  return 0.5 * isometricBending(rest, t, elementOf(model), coefficient).multiply(points.data(), product.data());
}

Sparse plateStiffness(const TriangleMesh& mesh, BendingModel model)
{
  const MeshTopology t = meshTopology(mesh);
  const double coefficient = bendingCalibration(mesh, t, elementOf(model), Eigen::Vector3d::UnitX());
  if (model != BendingModel::hinge)
    return isometricBending(mesh, t, elementOf(model), coefficient).toEigen();
  HingeTerm hinges(t.hinges, hingeStiffness(mesh, t, coefficient), Eigen::VectorXd::Zero(t.hingeCount()));
  BlockMatrix matrix(static_cast<int>(mesh.vertices.cols()), {t.hinges});
  PointVector x, gradient(4 * mesh.vertices.cols(), 0.0);
  toPoints(mesh.vertices, x);
  matrix.setZero();
  hinges.setPattern(matrix);
  hinges.addHessian(HessianKind::exact, x.data(), gradient.data(), matrix.values());
  return normalPart(matrix);
}

double squarePlateDeflection(GridPattern pattern, const PlateModel& model, int cells, bool clamped)
{
  const TriangleMesh mesh = plateMesh(pattern, 1.0, 1.0, cells, clamped, clamped);
  const double eps = 0.3 / cells;   // irregular vertices of the margin's inner side are not on a line
  const auto outside = [&](const Eigen::Vector3d& p) {
    const double depth = std::min(std::min(p.x(), 1 - p.x()), std::min(p.y(), 1 - p.y()));
    return depth < (clamped && pattern == GridPattern::irregular ? eps : 1e-9);
  };
  const Free free(static_cast<int>(mesh.vertices.cols()), verticesWhere(mesh, outside));
  const Eigen::VectorXd areas = vertexAreas(mesh);
  Eigen::VectorXd load(free.count);
  for (std::size_t i = 0; i < free.number.size(); ++i)
    if (free.number[i] >= 0)
      load[free.number[i]] = areas[static_cast<Eigen::Index>(i)];
  const Eigen::VectorXd w = Eigen::SimplicialLDLT<Sparse>(free.of(model(mesh))).solve(load);
  // a parabola fitted about the centre: no vertex need be there
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < free.number.size(); ++i)
  {
    const double r2 =
        (mesh.vertices.col(static_cast<Eigen::Index>(i)).head<2>() - Eigen::Vector2d(0.5, 0.5)).squaredNorm();
    if (r2 > 0.15 * 0.15)
      continue;
    const Eigen::Vector3d basis(1, r2, r2 * r2);
    normal += basis * basis.transpose();
    right += w[free.number[i]] * basis;
  }
  return normal.ldlt().solve(right)[0];
}

double lateralBucklingLoad(GridPattern pattern, const PlateModel& model, double width, int cells)
{
  const TriangleMesh mesh = plateMesh(pattern, 1.0, width, cells, true, false);
  const int n = static_cast<int>(mesh.vertices.cols());
  const double eps = pattern == GridPattern::irregular ? 0.3 / cells : 1e-9;
  const std::vector<int> held = verticesWhere(mesh, [&](const Eigen::Vector3d& p) { return p.x() < eps; });
  const Eigen::VectorXd areas = vertexAreas(mesh);

  // In-plane displacements under a unit load per area, for c11 = 1
  MembraneTerm membrane(mesh, isotropicMembrane(1.0 - 0.09, 0.3, 1.0));
  BlockMatrix matrix(n, {mesh.triangles});
  membrane.setPattern(matrix);
  PointVector x, gradient(4 * n, 0.0), u(4 * n, 0.0);
  toPoints(mesh.vertices, x);
  matrix.setZero();
  membrane.addHessian(HessianKind::exact, x.data(), gradient.data(), matrix.values());
  for (int j = 0; j < n; ++j)
    matrix.values()[9 * static_cast<long>(matrix.starts()[j]) + 8] = 1.0;   // nothing holds the normal direction
  std::vector<char> fixed(n, 0);
  for (const int v : held)
    fixed[v] = 1;
  for (int i = 0; i < n; ++i)
    u[4 * i + 1] = fixed[i] ? 0.0 : -areas[i];
  SparseCholesky factor;
  factor.setPattern(matrix);
  if (!factor.factor(matrix, fixed.data()))
    return std::numeric_limits<double>::quiet_NaN();
  factor.solvePoints(u.data(), u.data());

  // Its geometric stiffness: the normal part of the Hessian under small displacements
  constexpr double kSmall = 1e-6;
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] += kSmall * u[i];
  matrix.setZero();
  membrane.addHessian(HessianKind::exact, x.data(), gradient.data(), matrix.values());
  const Free free(n, held);
  const Sparse geometric = free.of(normalPart(matrix)) / kSmall, stiffness = free.of(model(mesh));
  const Eigen::SimplicialLDLT<Sparse> solver(stiffness);
  if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 1e-12 * solver.vectorD().maxCoeff()))
    return std::numeric_limits<double>::quiet_NaN();

  // Subspace iteration for the largest 1/load of -geometric w = (1/load) stiffness w; loads of both signs come in pairs
  constexpr int kVectors = 8, kRounds = 40;
  Eigen::MatrixXd w = Eigen::MatrixXd::Random(free.count, kVectors);
  double load = 0;
  for (int round = 0; round < kRounds; ++round)
  {
    const Eigen::MatrixXd image = solver.solve(Eigen::MatrixXd(-(geometric * w)));
    const Eigen::MatrixXd k = image.transpose() * (stiffness * image), g = -(image.transpose() * (geometric * image));
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> ritz(0.5 * (g + g.transpose()),
                                                                         0.5 * (k + k.transpose()));
    w = image * ritz.eigenvectors();
    load = 1.0 / ritz.eigenvalues()[kVectors - 1];
  }
  return load;
}

double squarePlateDeflection(GridPattern pattern, BendingModel model, int cells, bool clamped)
{
  return squarePlateDeflection(
      pattern, [model](const TriangleMesh& mesh) { return plateStiffness(mesh, model); }, cells, clamped);
}

double lateralBucklingLoad(GridPattern pattern, BendingModel model, double width, int cells)
{
  return lateralBucklingLoad(
      pattern, [model](const TriangleMesh& mesh) { return plateStiffness(mesh, model); }, width, cells);
}

}   // namespace slender::study
