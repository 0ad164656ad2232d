#include <gtest/gtest.h>

#include "cloth/wind_load.h"
#include "slender_sim/cloth/cloth_stepper.h"
#include "test/support/cloths.h"

namespace slender::test {
namespace {

constexpr double kRho = 1.2, kDrag = 1.1, kLift = 0.7;
const double kArea = 0.5 * 0.4;

ClothModel flat(double drag, double lift)
{
  ClothModel model =
      buildCloth("sheet", gridMesh(0.5, 0.4, 4, 4, GridPattern::irregular), 0.2, isotropicMembrane(1e4, 0.3, 1e-3));
  model.aerodynamics = {kRho, drag, lift};
  return model;
}

/// On the sheet at rest in this air, from the explicit forces; a second sheet's coefficient c adds the linear model.
Matrix3Xd forces(const ClothModel& model, const Matrix3Xd& v, const Vector3d& wind)
{
  PointVector force(4 * model.vertices(), 0.0);
  WindLoad(model).addForces(pointsOf(model.rest.vertices), pointsOf(v), wind, force);
  return matrixOf(force);
}

Vector3d total(const ClothModel& model, const Vector3d& wind)
{
  return forces(model, Matrix3Xd::Zero(3, model.vertices()), wind).rowwise().sum();
}

TEST(ClothWind, PlatesAtAnAngleFeelDragAndLift)
{
  for (const double degrees : {5.0, 30.0, 45.0, 80.0, 90.0, 135.0, 250.0})
    for (const double speed : {0.3, 20.0})
    {
      const double angle = degrees * M_PI / 180, pressure = 0.5 * kRho * speed * speed * kArea;
      const Vector3d along(std::cos(angle), 0, std::sin(angle));   // the sheet lies in z = 0
      const double c = std::abs(along.z()), side = along.z() > 0 ? 1 : -1;
      const Vector3d drag = total(flat(kDrag, 0), speed * along), lift = total(flat(0, kLift), speed * along);
      EXPECT_LT((drag - pressure * kDrag * c * along).norm(), 1e-12 * pressure) << degrees;
      EXPECT_NEAR(lift.dot(along), 0.0, 1e-12 * pressure);
      // of length sqrt(1 - c^2), towards the lee side
      const Vector3d across = (side * Vector3d::UnitZ() - c * along);
      EXPECT_LT((lift - pressure * kLift * c * across).norm(), 1e-12 * pressure) << degrees;
      EXPECT_LT((total(flat(kDrag, kLift), speed * along) - drag - lift).norm(), 1e-12 * pressure);
    }
  EXPECT_EQ(total(flat(kDrag, kLift), Vector3d(7, 3, 0)), Vector3d(0, 0, 0));   // along the sheet
  EXPECT_EQ(total(flat(kDrag, kLift), Vector3d(0, 0, 0)), Vector3d(0, 0, 0));
}

/// What an implicit step takes: the force at the start's velocities exactly, and of the derivative a positive
/// semidefinite part.
TEST(ClothWind, LinearisedForcesTouchTheTrueOnes)
{
  Random random(5);
  for (const bool normal_flow : {false, true})
  {
    ClothModel model = flat(kDrag, normal_flow ? 0.0 : kLift);
    model.wind_coefficient = 0.3;
    const int n = model.vertices();
    const Vector3d wind = normal_flow ? Vector3d(0, 0, 3) : Vector3d(2, -1, 3);
    Matrix3Xd v(3, n);
    for (int i = 0; i < n; ++i)
      v.col(i) = normal_flow ? Vector3d(0, 0, random.vector(2)[0]) : Vector3d(random.vector(2));
    const double h = 0.01;
    const PointVector start = pointsOf(model.rest.vertices);
    WindLoad wind_load(model);
    PointVector constant(4 * n, 0.0);
    wind_load.begin(start, start, v, wind, h, constant);
    const auto linearised = [&](const Matrix3Xd& velocities) {
      PointVector slope(4 * n, 0.0);
      wind_load.addGradient(pointsOf(model.rest.vertices + h * velocities).data(), slope.data());
      return Matrix3Xd(matrixOf(constant) - matrixOf(slope));
    };
    const Matrix3Xd exact = forces(model, v, wind);
    EXPECT_LT((linearised(v) - exact).norm(), 1e-12 * exact.norm());
    BlockMatrix matrix(n, {model.rest.triangles});
    matrix.setZero();
    wind_load.setPattern(matrix);
    wind_load.addHessian(matrix.values());
    const MatrixXd d = h * denseOf(matrix);
    EXPECT_GE(smallestEigenvalue(d), -1e-14);
    const MatrixXd slope = differences(v, 1e-4, [&](const Matrix3Xd& at) { return flattened(linearised(at)); });
    EXPECT_LT((slope + d).norm(), 1e-9 * d.norm());   // Hessian and gradient agree
    const MatrixXd truth =
        differences(v, 1e-4, [&](const Matrix3Xd& at) { return flattened(forces(model, at, wind)); });
    for (int i = 0; i < n; ++i)   // along the normal
      if (normal_flow)
        EXPECT_NEAR(truth(3 * i + 2, 3 * i + 2), -d(3 * i + 2, 3 * i + 2), 1e-8 * d.norm());
      else
        EXPECT_GT(truth(3 * i + 2, 3 * i + 2), -2 * d(3 * i + 2, 3 * i + 2));
  }
}

TEST(ClothWind, AFallingSheetReachesItsTerminalVelocity)
{
  // v = sqrt(2 m g / (rho C_D A)), on the way v tanh(g t / v)
  const double terminal = std::sqrt(2 * 0.2 * 9.81 / (kRho * kDrag)), pi_half = terminal / 9.81;
  for (const Integrator integrator : {Integrator::implicit_euler, Integrator::symplectic_euler})
    for (const double h : {2e-4, 0.1})
    {
      if (integrator == Integrator::symplectic_euler && h > 0.01)
        continue;
      auto model = std::make_shared<ClothModel>(flat(kDrag, kLift));
      ClothState state = makeClothState(*model, model->rest.vertices);
      ClothOptions options;
      options.integrator = integrator;
      ClothStepper stepper(model, options);
      double t = 0.0, worst = 0.0;
      for (; t < 10 * pi_half; t += h)
      {
        const StepReport report = stepper.step(state, {}, h);
        ASSERT_TRUE(report.ok) << report.message;
        worst = std::max(worst, std::abs(-state.v(2, 7) - terminal * std::tanh((t + h) / pi_half)));
      }
      EXPECT_LT(worst, 0.5 * h * 9.81);   // first order
      EXPECT_LT((state.v.colwise() - Vector3d(0, 0, -terminal)).norm(), 1e-4 * terminal * std::sqrt(state.v.cols()));
    }
}

/// The air's impulse is what the cloth's momentum changes by, whatever it does meanwhile.
TEST(ClothWind, MomentumBalances)
{
  auto model = std::make_shared<ClothModel>(flat(kDrag, kLift));
  model->bending_modulus = 1e-5;
  ClothState state = makeClothState(*model, model->rest.vertices);
  Random random(11);
  for (Eigen::Index i = 0; i < state.x.cols(); ++i)
    state.v.col(i) = random.vector(0.5);
  ClothInputs inputs;
  inputs.wind << 5, 1, 3;
  ClothStepper stepper(model, {});
  for (int k = 0; k < 20; ++k)
  {
    const ClothState before = state;
    const double h = 1e-5;
    ASSERT_TRUE(stepper.step(state, inputs, h).ok);
    PointVector force(4 * model->vertices(), 0.0);
    WindLoad(*model).addForces(pointsOf(before.x), pointsOf(before.v), inputs.wind, force);
    const Vector3d gained = (state.v - before.v) * model->mass / h - model->totalMass() * inputs.gravity;
    const Vector3d pushed = matrixOf(force).rowwise().sum();
    EXPECT_LT((gained - pushed).norm(), 2e-2 * pushed.norm());
  }
}

/// Drag takes energy out of still air and lift none: no step length makes either blow up.
TEST(ClothWind, StormsAndLongStepsStayFinite)
{
  for (const double lift : {0.0, 1.0, 4.0})
    for (const double h : {0.005, 0.05})
    {
      auto model = std::make_shared<ClothModel>(flat(kDrag, lift));
      model->bending_modulus = 1e-5;
      ClothState state = makeClothState(*model, model->rest.vertices);
      pinVertices(state, {0, 1});
      ClothInputs inputs;
      inputs.wind << 2, 30, 5;
      inputs.pins = state.x.leftCols(2);
      ClothStepper stepper(model, {});
      double fastest = 0.0;
      for (int k = 0; k < 200; ++k)
      {
        const StepReport report = stepper.step(state, inputs, h);
        ASSERT_TRUE(report.ok) << report.message;
        fastest = std::max(fastest, state.v.colwise().norm().maxCoeff());
      }
      // Lift beyond the drag makes it flutter, however short the step, with largest speeds of about 300 m/s, which
      // depend on rounding errors.
      EXPECT_LT(fastest, lift > kDrag ? 500.0 : 30.0) << lift << " " << h;
      EXPECT_LT(state.x.norm(), 20.0);
    }
}

TEST(ClothWind, RefusesBadCoefficients)
{
  EXPECT_THROW(WindLoad(flat(-1, 0)), std::invalid_argument);
  EXPECT_THROW(WindLoad(flat(0, NAN)), std::invalid_argument);
  EXPECT_FALSE(WindLoad::actsOn(flat(0, 0)));
}

}   // namespace
}   // namespace slender::test
