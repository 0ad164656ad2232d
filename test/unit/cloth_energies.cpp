// What hinges and membranes alone have to show; energy_contract.cpp checks what holds for every energy. Sharp folds,
// degenerate faces, fibre directions, and reference 3f (one triangle of St. Venant-Kirchhoff).
#include <cmath>
#include <fstream>
#include <sstream>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "test/support/cloths.h"

namespace slender::test {
namespace {

struct GridSheet
{
  TriangleMesh mesh;
  MeshTopology topology;

  explicit GridSheet(GridPattern pattern, int cells = 3)
    : mesh(gridMesh(cells, cells, cells, cells, pattern)),
      topology(meshTopology(mesh))
  {
  }
  int points() const { return static_cast<int>(mesh.vertices.cols()); }
};

double energyOf(PointTerm& e, const Matrix3Xd& x) { return e.value(pointsOf(x).data()).energy; }

/// Against differences of energy and gradient.
void check(Derivatives& d, const Matrix3Xd& x, double h, double tolerance)
{
  const Matrix3Xd g = d.gradient(x);
  const MatrixXd slope =
      differences(x, h, [&](const Matrix3Xd& y) { return VectorXd::Constant(1, energyOf(d.energy, y)); });
  EXPECT_LT((flattened(g) - slope.col(0)).norm(), tolerance * g.norm());
  const MatrixXd exact = d.hessian(x, HessianKind::exact);
  const MatrixXd curvature = differences(x, h, [&](const Matrix3Xd& y) { return flattened(d.gradient(y)); });
  EXPECT_LT((exact - curvature).norm(), tolerance * exact.norm());
  const MatrixXd semidefinite = d.hessian(x, HessianKind::semidefinite);
  const double size = exact.norm();
  EXPECT_GT(smallestEigenvalue(semidefinite), -1e-12 * size);
  EXPECT_GT(smallestEigenvalue(semidefinite - exact), -1e-12 * size);
}

/// Two triangles folded about their common edge by `angle`, the third points `height` high.
Matrix3Xd hingeCorners(double angle, double left, double right)
{
  Matrix3Xd x(3, 4);
  x << 0, 1.3, 0.4, 0.7,                      //
      0, 0, left, -right * std::cos(angle),   //
      0, 0, 0, -right * std::sin(angle);
  return x;
}

TEST(Hinges, LargeAnglesAndThinTriangles)
{
  Random random(5);
  Eigen::Matrix4Xi hinge(4, 1);
  hinge << 0, 1, 2, 3;
  for (const double angle : {0.0, 1e-9, 0.5, 1.5, 3.0, 3.14, -0.5, -3.1})
    for (const double height : {1.0, 0.03, 1e-3})
    {
      HingeTerm e(hinge, VectorXd::Constant(1, 2.0), VectorXd::Constant(1, 0.3));
      const Matrix3Xd x =
          Eigen::AngleAxisd(1.1, random.direction()).toRotationMatrix() * hingeCorners(angle, height, 0.8);
      double theta[8];
      e.angles(pointsOf(x).data(), theta);
      EXPECT_NEAR(theta[0], angle, 1e-13 / height) << height;
      Derivatives d(e, 4);
      SCOPED_TRACE(testing::Message() << angle << " height " << height);
      check(d, x, 3e-3 * height, 1e-6);
    }
}

TEST(Hinges, DeviationGoesTheShorterWayRound)
{
  Eigen::Matrix4Xi hinge(4, 1);
  hinge << 0, 1, 2, 3;
  HingeTerm e(hinge, VectorXd::Constant(1, 2.0), VectorXd::Constant(1, 3.0));
  EXPECT_NEAR(energyOf(e, hingeCorners(-3.0, 1, 1)), std::pow(2 * M_PI - 6.0, 2), 1e-12);
}

TEST(Hinges, DegenerateFacesStayFinite)
{
  Eigen::Matrix4Xi hinge(4, 1);
  hinge << 0, 1, 2, 3;
  HingeTerm e(hinge, VectorXd::Constant(1, 1.0), VectorXd::Constant(1, 0.2));
  Derivatives d(e, 4);
  Matrix3Xd line = hingeCorners(0.3, 0.0, 1.0), same = hingeCorners(0.3, 1.0, 1.0);
  same.col(1) = same.col(0);
  for (const Matrix3Xd& x : {line, same, Matrix3Xd(Matrix3Xd::Zero(3, 4))})
  {
    EXPECT_TRUE(std::isfinite(energyOf(e, x)));
    EXPECT_TRUE(d.gradient(x).allFinite());
    EXPECT_TRUE(d.hessian(x, HessianKind::exact).allFinite());
    EXPECT_TRUE(d.hessian(x, HessianKind::semidefinite).allFinite());
  }
}

TEST(Membrane, TakesItsAxesAlongTheWarp)
{
  // stretched along a direction d by s: E = area/2 E_d G^2 to leading order, with the contraction across it left free
  const MembraneModuli m = orthotropicMembrane(100, 40, 0.3, 10);
  const GridSheet s(GridPattern::irregular, 4);
  const Vector3d warp = Eigen::AngleAxisd(0.6, Vector3d::UnitZ()) * Vector3d::UnitX();
  MembraneTerm membrane(s.mesh, m, warp);
  const double g = 1e-4, area = 16;
  const auto stretched = [&](const Vector3d& d, double along, double across) {
    const Vector3d c = Vector3d::UnitZ().cross(d);
    const Eigen::Matrix3d F = Eigen::Matrix3d::Identity() + (std::sqrt(1 + 2 * along) - 1) * d * d.transpose() +
                              (std::sqrt(1 + 2 * across) - 1) * c * c.transpose();
    return energyOf(membrane, Matrix3Xd(F * s.mesh.vertices));
  };
  EXPECT_NEAR(stretched(warp, g, -0.3 * g) / (0.5 * area * 100 * g * g), 1.0, 1e-6);
  const Vector3d weft = Vector3d::UnitZ().cross(warp);
  EXPECT_NEAR(stretched(weft, g, -0.3 * 0.4 * g) / (0.5 * area * 40 * g * g), 1.0, 1e-6);
}

TEST(Membrane, PatchTest)
{
  Random random(13);
  const GridSheet s(GridPattern::irregular, 5);
  MembraneTerm membrane(s.mesh, isotropicMembrane(1e5, 0.3, 1e-3));
  Derivatives d(membrane, s.points());
  const Eigen::Matrix3d F = Eigen::Matrix3d::Random() + 2 * Eigen::Matrix3d::Identity();
  const Matrix3Xd g = d.gradient(F * s.mesh.vertices);
  for (int i = 0; i < s.points(); ++i)
    if (!s.topology.on_boundary[i])
      EXPECT_LT(g.col(i).norm(), 1e-12 * g.norm());
}

/// Reference 3f, 15 digits (reference/rod_plate/stvk_triangle.csv).
TEST(Membrane, OneTriangleOfStVenantKirchhoff)
{
  TriangleMesh rest;
  rest.vertices.resize(3, 3);
  rest.vertices << 0, 1, 0.2, 0, 0.1, 0.8, 0, 0, 0;
  rest.triangles.resize(3, 1);
  rest.triangles << 0, 1, 2;
  MembraneTerm membrane(rest, isotropicMembrane(1e5, 0.3, 1e-3));
  std::ifstream file(std::string(SLENDER_SOURCE_DIR) + "/test/unit/data/stvk_triangle.csv");
  ASSERT_TRUE(file);
  int cases = 0;
  for (std::string line; std::getline(file, line);)
  {
    if (line[0] == '#' || line.rfind("case", 0) == 0)
      continue;
    std::istringstream cells(line);
    std::string name, cell;
    std::getline(cells, name, ',');
    std::vector<double> v;
    while (std::getline(cells, cell, ','))
      v.push_back(std::stod(cell));
    const Matrix3Xd x = Eigen::Map<const Matrix3Xd>(v.data() + 1, 3, 3),
                    force = Eigen::Map<const Matrix3Xd>(v.data() + 10, 3, 3);
    Derivatives d(membrane, 3);
    EXPECT_NEAR(energyOf(membrane, x), v[0], 1e-13) << name;   // forces of order 1 N, energies of order 0.1 J
    EXPECT_LT((d.gradient(x) + force).norm(), 1e-12) << name;
    ++cases;
  }
  EXPECT_EQ(cases, 7);
}

/// The strain that was extrapolated linearly from another configuration, here by central differences, gives the
/// stresses of the geometric stiffness. All else in the Hessian stays.
TEST(Membrane, ExtrapolatesStressesOfTheGeometricStiffness)
{
  TriangleMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0, 1.2, 0.3, 0, 0.1, 0.9, 0, 0, 0;
  mesh.triangles = Eigen::Vector3i(0, 1, 2);
  MembraneTerm e(mesh, {50, 12, 40, 18});
  Eigen::Matrix2d edges;
  edges << 1.2, 0.3, 0.1, 0.9;
  Eigen::Matrix<double, 3, 2> b;   // gradients of the shape functions
  b.bottomRows<2>() = edges.inverse();
  b.row(0) = -b.row(1) - b.row(2);

  Random random(11);
  Matrix3Xd from = mesh.vertices, x = mesh.vertices;
  for (int i = 0; i < 3; ++i)
  {
    from.col(i) += random.vector(0.2);
    x.col(i) += random.vector(0.2);
  }
  const auto strain = [&](const Matrix3Xd& at) {
    std::vector<double> g[3];
    double* out[3];
    for (int k = 0; k < 3; ++k)
    {
      g[k].resize(static_cast<std::size_t>(e.paddedCount()));
      out[k] = g[k].data();
    }
    e.strains(pointsOf(at).data(), out);
    return Eigen::Vector3d(g[0][0], g[1][0], g[2][0]);
  };
  // exact, because strains are quadratic
  const Eigen::Vector3d rate = 0.5 * (strain(from + (x - from)) - strain(from - (x - from)));
  const Eigen::Vector3d second = strain(from) + rate - strain(x);   // of the extrapolated strain, less the present one
  Eigen::Matrix2d stress;
  stress(0, 0) = 50 * second[0] + 12 * second[1];
  stress(1, 1) = 12 * second[0] + 40 * second[1];
  stress(0, 1) = stress(1, 0) = 18 * second[2];
  const Eigen::Matrix3d spread = e.area(0) * b * stress * b.transpose();

  Derivatives d(e, 3);
  const MatrixXd change = d.hessian(x, HessianKind::exact, from) - d.hessian(x, HessianKind::exact);
  for (int p = 0; p < 3; ++p)
    for (int q = 0; q < 3; ++q)
      EXPECT_LT((change.block<3, 3>(3 * p, 3 * q) - spread(p, q) * Eigen::Matrix3d::Identity()).norm(), 1e-11)
          << p << " " << q;   // rounding of moduli of 50
  EXPECT_GT(spread.norm(), 0.1);
  EXPECT_EQ(d.hessian(x, HessianKind::exact, x), d.hessian(x, HessianKind::exact));
}

TEST(Membrane, RefusesBadModuli)
{
  EXPECT_THROW(isotropicMembrane(-1, 0.3, 1e-3), std::invalid_argument);
  EXPECT_THROW(isotropicMembrane(1, 0.6, 1e-3), std::invalid_argument);
  EXPECT_THROW(isotropicMembrane(1, 0.3, 0), std::invalid_argument);
  EXPECT_THROW(orthotropicMembrane(1, 4, 0.6, 1), std::invalid_argument);
  EXPECT_THROW(orthotropicMembrane(1, 4, 0.1, NAN), std::invalid_argument);
  const MembraneModuli a = isotropicMembrane(1e5, 0.3, 1e-3), b = orthotropicMembrane(100, 100, 0.3, 100 / 2.6);
  EXPECT_NEAR(a.c11, b.c11, 1e-12);
  EXPECT_NEAR(a.c12, b.c12, 1e-12);
  EXPECT_NEAR(a.c33, b.c33, 1e-12);
}

}   // namespace
}   // namespace slender::test
