// Edges of cloth that are clamped between faces that are held and faces that are free.
#include <cmath>
#include <memory>

#include <Eigen/SparseCholesky>
#include <gtest/gtest.h>

#include "slender_sim/cloth/cloth_stepper.h"
#include "slender_sim/energy/plate_bending.h"
#include "test/support/cloths.h"

namespace slender::test {
namespace {

/// A strip [0, 0.3] x [0, 1] with one more row of cells below y = 0.
TriangleMesh stripWithMargin(GridPattern pattern, int rows)
{
  TriangleMesh mesh = gridMesh(0.3, 1.0 + 1.0 / rows, 3, rows + 1, pattern);
  mesh.vertices.row(1).array() -= 1.0 / rows;
  return mesh;
}

std::vector<int> marginOf(const TriangleMesh& mesh, int rows)
{
  std::vector<int> held;
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
    if (mesh.vertices(1, i) < 0.5 / rows)
      held.push_back(static_cast<int>(i));
  return held;
}

/// Deflection of the free end under a unit load per area, D = 1 and Poisson's ratio 0.
double tipDeflection(GridPattern pattern, int rows, bool clamped)
{
  const TriangleMesh mesh = stripWithMargin(pattern, rows);
  const std::vector<int> held = marginOf(mesh, rows);
  const std::vector<char> faces = clamped ? facesWithin(mesh, held) : std::vector<char>();
  const Eigen::SparseMatrix<double> K = plateBending(mesh, meshTopology(mesh), 0.0, 1.0, faces).toEigen();
  std::vector<char> is_held(static_cast<std::size_t>(mesh.vertices.cols()), 0);
  for (const int v : held)
    is_held[static_cast<std::size_t>(v)] = 1;
  std::vector<Eigen::Triplet<double>> entries;
  for (int j = 0; j < K.outerSize(); ++j)
    for (Eigen::SparseMatrix<double>::InnerIterator it(K, j); it; ++it)
      if (!is_held[static_cast<std::size_t>(it.row())] && !is_held[static_cast<std::size_t>(j)])
        entries.emplace_back(it.row(), j, it.value());
  VectorXd load = VectorXd::Zero(K.rows());
  const VectorXd areas = faceAreas(mesh);
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
    for (int k = 0; k < 3; ++k)
      load[mesh.triangles(k, f)] += areas[f] / 3;
  for (const int v : held)
  {
    entries.emplace_back(v, v, 1.0);
    load[v] = 0.0;
  }
  Eigen::SparseMatrix<double> free(K.rows(), K.cols());
  free.setFromTriplets(entries.begin(), entries.end());
  const VectorXd w = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(free).solve(load);
  Eigen::Index tip = 0;
  mesh.vertices.row(1).maxCoeff(&tip);
  return w[tip];
}

TEST(ClampedEdges, aCantileveredStripConvergesWithSecondOrder)
{
  constexpr double kBeam = 1.0 / 8;   // q L^4 / (8 D)
  for (const GridPattern pattern : {GridPattern::one_diagonal, GridPattern::equilateral})
  {
    const double coarse = tipDeflection(pattern, 10, true) / kBeam - 1,
                 fine = tipDeflection(pattern, 20, true) / kBeam - 1;
    EXPECT_LT(std::abs(fine), 0.01) << toString(pattern);
    // second order; the next term is a hundredth of the first
    EXPECT_NEAR(coarse / fine, 4.0, 0.4) << toString(pattern);
    // Without it the hinge of the edge is half as stiff as that of half a cell, and the error is of first order.
    const double soft_coarse = tipDeflection(pattern, 10, false) / kBeam - 1,
                 soft_fine = tipDeflection(pattern, 20, false) / kBeam - 1;
    EXPECT_GT(soft_fine, 0.05) << toString(pattern);
    EXPECT_NEAR(soft_coarse / soft_fine, 2.0, 0.2) << toString(pattern);
  }
}

TEST(ClampedEdges, onlyHingesBesideClampedFacesAreStiffer)
{
  constexpr int kRows = 6;
  const TriangleMesh mesh = stripWithMargin(GridPattern::one_diagonal, kRows);
  const MeshTopology t = meshTopology(mesh);
  const std::vector<char> clamped = facesWithin(mesh, marginOf(mesh, kRows));
  const VectorXd plain = hingeStiffness(mesh, t, 1.0), held = hingeStiffness(mesh, t, 1.0, clamped);
  int stiffer = 0;
  for (Eigen::Index h = 0; h < t.hinges.cols(); ++h)
  {
    const auto faces = t.edge_faces.col(t.hinge_edges[static_cast<std::size_t>(h)]);
    const bool beside = clamped[static_cast<std::size_t>(faces[0])] != clamped[static_cast<std::size_t>(faces[1])];
    EXPECT_NEAR(held[h], beside ? 2 * plain[h] : plain[h], 1e-12 * plain[h]) << h;   // both faces have the same area
    stiffer += beside;
  }
  EXPECT_EQ(stiffer, 3);   // the edges of three cells

  // Isometric bending remains the small-angle limit of the hinges.
  Random random(3);
  Matrix3Xd x = mesh.vertices;
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    x(2, i) = 1e-5 * random.vector().x();
  const PointVector points = pointsOf(x);
  PointVector y(points.size());
  const double isometric =
      0.5 * isometricBending(mesh, t, IsometricElement::nonconforming, 1.0, clamped).multiply(points.data(), y.data());
  const double hinges = HingeTerm(t.hinges, held, VectorXd::Zero(t.hingeCount())).value(points.data()).energy;
  EXPECT_GT(hinges, 0.0);
  EXPECT_NEAR(isometric / hinges, 1.0, 1e-6);
}

/// A strip whose margin is clamped, or the same strip without a clamp.
std::shared_ptr<ClothModel> stripModel(BendingModel bending, bool with_ratio, bool clamped)
{
  constexpr int kRows = 6;
  const TriangleMesh mesh = stripWithMargin(GridPattern::one_diagonal, kRows);
  auto model = std::make_shared<ClothModel>(buildCloth("strip", mesh, 1.0, isotropicMembrane(1e4, 0.0, 1.0)));
  model->bending = bending;
  model->bending_modulus = 1.0;
  if (with_ratio)
    model->bending_poissons_ratio = 0.0;
  if (clamped)
    clampFaces(*model, marginOf(mesh, kRows));
  return model;
}

/// Ten steps under gravity with these pins, from `state` on.
void step(ClothStepper& stepper, ClothState& state, const std::vector<int>& pins)
{
  ClothInputs inputs;
  inputs.gravity = Vector3d(0, 0, -1);
  state.pins.clear();
  pinVertices(state, pins);
  inputs.pins.resize(3, static_cast<Eigen::Index>(pins.size()));
  for (std::size_t k = 0; k < pins.size(); ++k)
    inputs.pins.col(static_cast<Eigen::Index>(k)) = state.x.col(state.pins[k]);
  for (int k = 0; k < 10; ++k)
  {
    const StepReport report = stepper.step(state, inputs, 1e-4);
    ASSERT_TRUE(report.ok) << report.message;
  }
}

TEST(ClampedEdges, aReleasedClampIsGoneAndComesBack)
{
  struct Kind
  {
    BendingModel bending;
    bool with_ratio;
    Integrator integrator;
  };
  for (const Kind& kind : {Kind{BendingModel::hinge, false, Integrator::implicit_euler},
                           Kind{BendingModel::hinge, false, Integrator::symplectic_euler},
                           Kind{BendingModel::isometric_nonconforming, false, Integrator::tr_bdf2},
                           Kind{BendingModel::isometric_nonconforming, true, Integrator::implicit_euler},
                           Kind{BendingModel::isometric_nonconforming, true, Integrator::imex}})
  {
    SCOPED_TRACE(std::string(toString(kind.bending)) + ", " + toString(kind.integrator));
    const auto clamped_model = stripModel(kind.bending, kind.with_ratio, true),
               plain_model = stripModel(kind.bending, kind.with_ratio, false);
    ClothOptions options;
    options.integrator = kind.integrator;
    ClothStepper stepper(clamped_model, options), plain(plain_model, options), again(clamped_model, options);
    ClothState state = makeClothState(*clamped_model, clamped_model->rest.vertices);
    const std::vector<int> margin = marginOf(clamped_model->rest, 6), corner{margin.front()};
    step(stepper, state, margin);
    ClothState without = state;
    step(plain, without, margin);
    step(stepper, state, margin);
    EXPECT_GT((state.x - without.x).cwiseAbs().maxCoeff(), 1e-12);   // the clamp matters
    // Once the margin is released the cloth moves as one that was never clamped, bit by bit.
    without = state;
    step(stepper, state, corner);
    step(plain, without, corner);
    EXPECT_EQ((state.x - without.x).cwiseAbs().maxCoeff(), 0.0);
    EXPECT_EQ(stepper.energies(state, Vector3d::Zero()).bending, plain.energies(state, Vector3d::Zero()).bending);
    // Once it is held again it is clamped, as for a stepper that begins here.
    ClothState begun = state;
    step(stepper, state, margin);
    step(again, begun, margin);
    EXPECT_EQ((state.x - begun.x).cwiseAbs().maxCoeff(), 0.0);
  }
}

TEST(ClampedEdges, staticsFollowsTheClampsThatAreHeld)
{
  const auto clamped_model = stripModel(BendingModel::isometric_nonconforming, true, true),
             plain_model = stripModel(BendingModel::isometric_nonconforming, true, false);
  ClothStepper stepper(clamped_model, ClothOptions{}), plain(plain_model, ClothOptions{});
  // The margin's lower line and the strip's upper end are held: the margin is free to bend.
  const TriangleMesh& mesh = clamped_model->rest;
  std::vector<int> ends;
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
    if (mesh.vertices(1, i) < -0.1 || mesh.vertices(1, i) > 1 - 1e-9)
      ends.push_back(static_cast<int>(i));
  const auto settle = [&](ClothStepper& of, const std::vector<int>& pins) {
    ClothState state = makeClothState(*clamped_model, mesh.vertices);
    pinVertices(state, pins);
    ClothInputs inputs;
    inputs.gravity = Vector3d(0, 0, -1e-2);
    inputs.pins.resize(3, static_cast<Eigen::Index>(pins.size()));
    for (std::size_t k = 0; k < pins.size(); ++k)
      inputs.pins.col(static_cast<Eigen::Index>(k)) = state.x.col(state.pins[k]);
    const StepReport report = of.solveEquilibrium(state, inputs);
    EXPECT_TRUE(report.ok) << report.message;
    return state.x;
  };
  const Matrix3Xd held = settle(stepper, marginOf(mesh, 6));
  EXPECT_GT((held - settle(plain, marginOf(mesh, 6))).cwiseAbs().maxCoeff(), 1e-5);   // of 1e-3
  EXPECT_EQ((settle(stepper, ends) - settle(plain, ends)).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_EQ((settle(stepper, marginOf(mesh, 6)) - held).cwiseAbs().maxCoeff(), 0.0);
}

}   // namespace
}   // namespace slender::test
