// What holds for every energy and every load of points (see slender_sim/energy/point_term.h). A new one gets an entry
// in the list Terms or Loads below.
#include <functional>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "slender_sim/energy/hinge_term.h"
#include "slender_sim/energy/membrane_term.h"
#include "slender_sim/energy/plate_bending.h"
#include "slender_sim/energy/quadratic_term.h"
#include "cloth/wind_load.h"
#include "test/support/cloths.h"

namespace slender::test {
namespace {

/// A flat sheet, the shape at rest of all terms here.
struct Sheet
{
  TriangleMesh mesh = gridMesh(3, 3, 3, 3, GridPattern::irregular);
  MeshTopology topology = meshTopology(mesh);

  int points() const { return static_cast<int>(mesh.vertices.cols()); }
  Matrix3Xd shaken(Random& random, double size) const
  {
    Matrix3Xd x = mesh.vertices;
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      x.col(i) += random.vector(size);
    return x;
  }
};

using Term = std::unique_ptr<PointTerm>;
using Refused = std::vector<std::function<void(const Sheet&)>>;   ///< constructions that must throw

const MembraneModuli kOdd = orthotropicMembrane(3.0, 1.2, 0.4, 0.5);

struct Membrane
{
  static Term make(const Sheet& s) { return std::make_unique<MembraneTerm>(s.mesh, kOdd, Vector3d(1, 0.4, 0.1)); }
  static void with(const Sheet& s, double MembraneModuli::*member, double value)
  {
    MembraneModuli moduli = kOdd;
    moduli.*member = value;
    MembraneTerm(s.mesh, moduli, Vector3d::UnitX());
  }
  static Refused refused()
  {
    return {[](const Sheet& s) { with(s, &MembraneModuli::c11, -1); },
            [](const Sheet& s) { with(s, &MembraneModuli::c12, 100); },
            [](const Sheet& s) { with(s, &MembraneModuli::c22, NAN); },
            [](const Sheet& s) { with(s, &MembraneModuli::c33, -1e-9); }};
  }
};

struct Hinges
{
  static VectorXd stiffness(const Sheet& s) { return hingeStiffness(s.mesh, s.topology, 0.7); }
  static Term make(const Sheet& s)
  {
    return std::make_unique<HingeTerm>(s.topology.hinges, stiffness(s), VectorXd::Zero(s.topology.hingeCount()));
  }
  static void with(const Sheet& s, double k, double angle)
  {
    VectorXd stiff = stiffness(s), rest = VectorXd::Zero(stiff.size());
    stiff[1] = k;
    rest[1] = angle;
    HingeTerm(s.topology.hinges, stiff, rest);
  }
  static Refused refused()
  {
    return {[](const Sheet& s) { with(s, -1, 0); }, [](const Sheet& s) { with(s, INFINITY, 0); },
            [](const Sheet& s) { with(s, 1, NAN); },
            [](const Sheet& s) { HingeTerm(s.topology.hinges, stiffness(s), VectorXd::Zero(1)); }};
  }
};

template <IsometricElement element>
struct Isometric
{
  static Term make(const Sheet& s)
  {
    return std::make_unique<QuadraticTerm>(isometricBending(s.mesh, s.topology, element, 0.7));
  }
  static Refused refused()
  {
    return {[](const Sheet& s) { QuadraticTerm(isometricBending(s.mesh, s.topology, element, NAN)); },
            [](const Sheet&) { QuadraticTerm(PointMatrix{}); }};
  }
};

struct Plate
{
  static Term make(const Sheet& s)
  {
    return std::make_unique<QuadraticTerm>(plateBending(s.mesh, s.topology, 0.3, 0.7));
  }
  static Refused refused()
  {
    return {[](const Sheet& s) { QuadraticTerm(plateBending(s.mesh, s.topology, 1.0, 0.7)); },
            [](const Sheet& s) { QuadraticTerm(plateBending(s.mesh, s.topology, 0.3, INFINITY)); }};
  }
};

using Terms = testing::Types<Membrane, Hinges, Isometric<IsometricElement::nonconforming>,
                             Isometric<IsometricElement::conforming>, Plate>;

template <class Case>
struct EnergyContract : testing::Test
{
  Sheet sheet;
  Random random{7};
  Term term = Case::make(sheet);
  BlockMatrix matrix{sheet.points(), {term->elements()}};

  EnergyContract() { term->setPattern(matrix); }

  double value(const Matrix3Xd& x) { return term->value(pointsOf(x).data()).energy; }
  Matrix3Xd gradient(const Matrix3Xd& x)
  {
    PointVector g(4 * x.cols(), 0.0);
    term->addGradient(pointsOf(x).data(), g.data());
    return matrixOf(g);
  }
  MatrixXd hessian(const Matrix3Xd& x, HessianKind kind, double ratio)
  {
    matrix.setZero();
    PointVector g(4 * x.cols(), 0.0);
    const TermSums sums = term->addHessian(kind, pointsOf(x).data(), g.data(), matrix.values());
    EXPECT_NEAR(sums.energy, value(x), 1e-12 * std::abs(sums.energy) + 1e-15);
    EXPECT_LT((matrixOf(g) - gradient(x)).norm(), 1e-12 * gradient(x).norm());
    MatrixXd h = denseOf(matrix);
    if (const PointMatrix* constant = term->constantMatrix())
    {
      const MatrixXd k = constant->toEigen();
      for (Eigen::Index i = 0; i < k.rows(); ++i)
        for (Eigen::Index j = 0; j < k.cols(); ++j)
          h.block<3, 3>(3 * i, 3 * j) += (1.0 + ratio) * k(i, j) * Eigen::Matrix3d::Identity();
    }
    return h;
  }
  /// Takes the strains of a shape of the past.
  void respond(double ratio, const Matrix3Xd& before)
  {
    const PointVector x = pointsOf(before);
    StrainReference at;
    at.x = &x;
    term->takeStrains(at);
    term->setResponse(ratio);
  }
};
TYPED_TEST_SUITE(EnergyContract, Terms);

TYPED_TEST(EnergyContract, IsZeroAtRestAndPositiveElsewhere)
{
  const Matrix3Xd moved =
      (this->random.rotation().toRotationMatrix() * this->sheet.mesh.vertices).colwise() + Vector3d(3, 4, 5);
  const Matrix3Xd bent = this->sheet.shaken(this->random, 0.3);
  ASSERT_GT(this->value(bent), 1e-3);
  EXPECT_LT(std::abs(this->value(moved)), 1e-13 * this->value(bent));   // squares of strains of round-off, and more
  EXPECT_LT(this->gradient(moved).norm(), 1e-12 * this->gradient(bent).norm());
}

TYPED_TEST(EnergyContract, RigidMotionsDoNothing)
{
  const Matrix3Xd x = this->sheet.shaken(this->random, 0.3), g = this->gradient(x);
  ASSERT_GT(g.norm(), 0.0);
  EXPECT_LT(g.rowwise().sum().norm(), 1e-12 * g.norm());
  Vector3d moment = Vector3d::Zero();
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    moment += x.col(i).cross(g.col(i));
  EXPECT_LT(moment.norm(), 1e-11 * g.norm());   // arms are a few times the unit of length
  const Eigen::Matrix3d turn = this->random.rotation().toRotationMatrix();
  const Matrix3Xd moved = (turn * x).colwise() + Vector3d(3, 4, 5);
  EXPECT_NEAR(this->value(moved) / this->value(x), 1.0, 1e-12);
  EXPECT_LT((this->gradient(moved) - turn * g).norm(), 1e-11 * g.norm());
}

/// Gradient and Hessians against differences at a shape; the response is that of `ratio`.
template <class Contract>
void checkDerivatives(Contract& c, const Matrix3Xd& x, double ratio)
{
  const Matrix3Xd g = c.gradient(x);
  ASSERT_GT(g.norm(), 0.0);
  // differences of fourth order of steps of 1e-3 have an error of 1e-12 times fifth derivatives, which hinges have
  const double h = 1e-3, tolerance = 1e-6;
  const MatrixXd slope = differences(x, h, [&](const Matrix3Xd& y) { return VectorXd::Constant(1, c.value(y)); });
  EXPECT_LT((flattened(g) - slope.col(0)).norm(), tolerance * g.norm());
  const MatrixXd exact = c.hessian(x, HessianKind::exact, ratio);
  const MatrixXd curvature = differences(x, h, [&](const Matrix3Xd& y) { return flattened(c.gradient(y)); });
  EXPECT_LT((exact - curvature).norm(), tolerance * exact.norm());
  const MatrixXd semidefinite = c.hessian(x, HessianKind::semidefinite, ratio);
  EXPECT_GT(smallestEigenvalue(semidefinite), -1e-12 * exact.norm());
  EXPECT_GT(smallestEigenvalue(semidefinite - exact), -1e-12 * exact.norm());
}

TYPED_TEST(EnergyContract, DerivativesMatchDifferences)
{
  // nearly flat, bent, crumpled with sides of 1; and compressed, where stress is negative
  for (const double ratio : {0.0, 0.8})
    for (const double size : {0.05, 0.2, 0.4})
      for (const double scale : {1.0, 0.7})
      {
        SCOPED_TRACE(testing::Message() << "ratio " << ratio << " size " << size << " scale " << scale);
        this->respond(ratio, this->sheet.shaken(this->random, 0.2));
        checkDerivatives(*this, scale * this->sheet.shaken(this->random, size), ratio);
      }
}

TYPED_TEST(EnergyContract, ViscousForcesCountFromTheReference)
{
  const Matrix3Xd x = this->sheet.shaken(this->random, 0.2), before = this->sheet.shaken(this->random, 0.2);
  const Matrix3Xd elastic = this->gradient(x), elastic_before = this->gradient(before);
  this->respond(0.8, before);
  EXPECT_LT((this->gradient(before) - elastic_before).norm(), 1e-12 * elastic_before.norm());
  const Matrix3Xd viscous = this->gradient(x) - elastic;
  EXPECT_GT(viscous.norm(), 0.1 * elastic.norm());
  this->respond(1.6, before);
  EXPECT_LT((this->gradient(x) - elastic - 2.0 * viscous).norm(), 1e-12 * viscous.norm() + 1e-12 * elastic.norm());
  this->respond(0.8, this->sheet.mesh.vertices);   // elastic forces count from there as well
  EXPECT_LT((this->gradient(x) - 1.8 * elastic).norm(), 1e-12 * elastic.norm());
  this->term->setResponse(0.0);
  EXPECT_EQ(this->gradient(x), elastic);
}

/// The reference x + move + share (other - x). The error of its strains is of second order in the move.
TYPED_TEST(EnergyContract, TheReferenceIsMoved)
{
  const Matrix3Xd x = this->sheet.shaken(this->random, 0.2), from = this->sheet.shaken(this->random, 0.1),
                  other = this->sheet.shaken(this->random, 0.1),
                  way = this->sheet.shaken(this->random, 0.1) - this->sheet.shaken(this->random, 0.1);
  const auto error = [&](double size, double share) {
    const PointVector a = pointsOf(from), b = pointsOf(other), move = pointsOf(size * way),
                      ahead = pointsOf(from + size * way), behind = pointsOf(from - size * way);
    StrainReference at;
    at.x = &a;
    at.move = &move;
    at.ahead = &ahead;
    at.behind = &behind;
    at.share = share;
    at.other = share != 0.0 ? &b : nullptr;
    this->term->takeStrains(at);
    this->term->setResponse(0.8);
    const Matrix3Xd moved = this->gradient(x);
    this->respond(0.8, from + size * way);
    return (moved - this->gradient(x)).norm() / moved.norm();
  };
  const double coarse = error(0.2, 0.0), fine = error(0.1, 0.0);
  EXPECT_LT(coarse, 0.05);
  EXPECT_LT(fine, 0.3 * coarse + 1e-12);   // a quarter, or nothing where strains are linear
  // All of the way to the other points: their strains.
  this->respond(0.8, other);
  const Matrix3Xd there = this->gradient(x);
  const PointVector a = pointsOf(from), b = pointsOf(other);
  StrainReference at;
  at.x = &a;
  at.share = 1.0;
  at.other = &b;
  this->term->takeStrains(at);
  EXPECT_LT((this->gradient(x) - there).norm(), 1e-11 * there.norm());
}

TYPED_TEST(EnergyContract, RefusesBadParameters)
{
  for (const auto& construct : TypeParam::refused())
    EXPECT_THROW(construct(this->sheet), std::invalid_argument);
}

// ---- loads

struct Wind
{
  static ClothModel model(const Sheet& s)
  {
    ClothModel model = buildCloth("sheet", s.mesh, 0.2, isotropicMembrane(1e4, 0.3, 1e-3));
    model.aerodynamics = {1.2, 1.1, 0.7};
    model.wind_coefficient = 0.3;
    return model;
  }
  static std::unique_ptr<PointLoad> make(const ClothModel& model) { return std::make_unique<WindLoad>(model); }
  static std::vector<std::function<void(ClothModel&)>> refused()
  {
    return {[](ClothModel& m) { m.aerodynamics.drag = -1; }, [](ClothModel& m) { m.aerodynamics.lift = NAN; },
            [](ClothModel& m) { m.aerodynamics.air_density = -1.2; }};
  }
};

using Loads = testing::Types<Wind>;

template <class Case>
struct LoadContract : testing::Test
{
};
TYPED_TEST_SUITE(LoadContract, Loads);

TYPED_TEST(LoadContract, TouchesTheForceAndHasAPotentialInItsStage)
{
  Random random(5);
  const Sheet sheet;
  const ClothModel model = TypeParam::model(sheet);
  const auto load = TypeParam::make(model);
  const int n = sheet.points();
  BlockMatrix matrix(n, {sheet.mesh.triangles});
  load->setPattern(matrix);
  const double h = 0.1;
  const Vector3d wind(2, -1, 3);
  const Matrix3Xd shape = sheet.shaken(random, 0.2), v = sheet.shaken(random, 2) - sheet.mesh.vertices;
  PointVector constant(4 * n, 0.0), exact = constant;
  load->begin(pointsOf(shape), pointsOf(shape), v, wind, h, constant);
  load->addForces(pointsOf(shape), pointsOf(v), wind, exact);
  const auto gradient = [&](const Matrix3Xd& x) {
    PointVector g(4 * n, 0.0);
    const double value = load->addGradient(pointsOf(x).data(), g.data());
    EXPECT_NEAR(value, load->value(pointsOf(x).data()), 1e-13 * value);
    return matrixOf(g);
  };
  const Matrix3Xd end = shape + h * v, g = gradient(end), force = matrixOf(exact);
  ASSERT_GT(force.norm(), 0.0);
  EXPECT_LT((matrixOf(constant) - g - force).norm(), 1e-12 * force.norm());
  const MatrixXd slope = differences(
      end, 1e-3, [&](const Matrix3Xd& y) { return VectorXd::Constant(1, load->value(pointsOf(y).data())); });
  EXPECT_LT((flattened(g) - slope.col(0)).norm(), 1e-9 * g.norm());
  matrix.setZero();
  load->addHessian(matrix.values());
  const MatrixXd hessian = denseOf(matrix);
  const MatrixXd curvature = differences(end, 1e-3, [&](const Matrix3Xd& y) { return flattened(gradient(y)); });
  EXPECT_LT((hessian - curvature).norm(), 1e-9 * hessian.norm());
  EXPECT_GT(smallestEigenvalue(hessian), -1e-12 * hessian.norm());

  std::vector<char> held(static_cast<std::size_t>(n), 0);
  const PointVector from = pointsOf(shape), to = pointsOf(end);
  const double drop = load->value(from.data()) - load->value(to.data());
  EXPECT_NEAR(load->work(from, to, held), drop, 1e-12 * load->value(from.data()));
  std::fill(held.begin(), held.end(), 1);
  EXPECT_EQ(load->work(from, to, held), 0.0);
}

TYPED_TEST(LoadContract, RefusesBadParameters)
{
  for (const auto& spoil : TypeParam::refused())
  {
    ClothModel model = TypeParam::model(Sheet());
    spoil(model);
    EXPECT_THROW(TypeParam::make(model), std::invalid_argument);
  }
}

}   // namespace
}   // namespace slender::test
