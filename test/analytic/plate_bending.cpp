// Bending energies of cylinders and spheres, and the isometric model's matrix, against plate theory (reference 3c).
#include <cmath>
#include <fstream>
#include <sstream>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "test/support/cloths.h"

namespace slender::test {
namespace {

constexpr double kPi = 3.14159265358979323846;
const GridPattern kPatterns[] = {GridPattern::one_diagonal, GridPattern::alternating, GridPattern::equilateral,
                                 GridPattern::irregular};
enum class Model
{
  hinge,
  nonconforming,
  conforming
};
const Model kModels[] = {Model::hinge, Model::nonconforming, Model::conforming};

IsometricElement elementOf(Model model)
{
  return model == Model::conforming ? IsometricElement::conforming : IsometricElement::nonconforming;
}

double bendingEnergy(const TriangleMesh& rest, const MeshTopology& t, Model model, double coefficient,
                     const Matrix3Xd& x)
{
  const PointVector points = pointsOf(x);
  if (model == Model::hinge)
    return HingeTerm(t.hinges, hingeStiffness(rest, t, coefficient), VectorXd::Zero(t.hingeCount()))
        .value(points.data())
        .energy;
  PointVector y(points.size());
  return 0.5 * isometricBending(rest, t, elementOf(model), coefficient).multiply(points.data(), y.data());
}

/// Area that has bending energy: cells of the inner edges or vertices.
double coveredArea(const TriangleMesh& mesh, const MeshTopology& t, Model model)
{
  double area = 0;
  const VectorXd faces = faceAreas(mesh), cells = voronoiAreas(mesh);
  if (model == Model::conforming)
    for (Eigen::Index i = 0; i < cells.size(); ++i)
      area += t.on_boundary[i] ? 0.0 : cells[i];
  else
    for (const int e : t.hinge_edges)
      area += (faces[t.edge_faces(0, e)] + faces[t.edge_faces(1, e)]) / 3;
  return area;
}

/// The plane z = 0 rolled up along a direction in it.
Matrix3Xd rolled(const Matrix3Xd& flat, double radius, double degrees)
{
  const Vector3d along(std::cos(degrees * kPi / 180), std::sin(degrees * kPi / 180), 0),
      across(-along.y(), along.x(), 0);
  Matrix3Xd x(3, flat.cols());
  for (Eigen::Index i = 0; i < flat.cols(); ++i)
  {
    const double angle = along.dot(flat.col(i)) / radius;
    x.col(i) = across * across.dot(flat.col(i)) +
               radius * (std::sin(angle) * along + (1 - std::cos(angle)) * Vector3d::UnitZ());
  }
  return x;
}

TEST(PlateBending, RolledLatticesMatchTheReference)
{
  std::ifstream file(std::string(SLENDER_SOURCE_DIR) + "/test/unit/data/hinge_rolled_mesh.csv");
  ASSERT_TRUE(file);
  int compared = 0;
  for (std::string line; std::getline(file, line);)
  {
    const GridPattern pattern =
        line.rfind("right_single", 0) == 0 ? GridPattern::one_diagonal : GridPattern::alternating;
    if (line.rfind("right_", 0) != 0)
      continue;
    std::istringstream cells(line);
    std::string cell;
    std::vector<double> v;
    for (std::getline(cells, cell, ','); std::getline(cells, cell, ',');)
      v.push_back(std::stod(cell));
    const double radius = v[0], hinge = v[3], nonconforming = v[4], conforming = v[5];
    const TriangleMesh mesh = gridMesh(24, 24, 24, 24, pattern);
    const MeshTopology t = meshTopology(mesh);
    const Matrix3Xd x = rolled(mesh.vertices, radius, v[1]);
    const auto ratio = [&](Model model) {
      return bendingEnergy(mesh, t, model, 1.0, x) * 2 * radius * radius / coveredArea(mesh, t, model);
    };
    EXPECT_NEAR(ratio(Model::hinge), hinge, 1e-8) << line;
    EXPECT_NEAR(ratio(Model::nonconforming), nonconforming, 1e-8) << line;
    if (pattern == GridPattern::one_diagonal)   // with Voronoi cells, alternating diagonals make no difference either
      EXPECT_NEAR(ratio(Model::conforming), conforming, 1e-8) << line;
    else
      EXPECT_NEAR(ratio(Model::conforming), 1.0, 0.02 * 64 / (radius * radius)) << line;
    ++compared;
  }
  EXPECT_EQ(compared, 30);
}

TEST(PlateBending, CylindersHaveTheEnergyOfPlateTheory)
{
  const double D = 3.7, radius = 1.3;
  for (const GridPattern pattern : kPatterns)
  {
    const TriangleMesh mesh = gridMesh(1.0, 0.9, 40, 0, pattern);
    const MeshTopology t = meshTopology(mesh);
    for (const Model model : kModels)
      for (const double direction : {0.0, 90.0})
      {
        const double coefficient = D * bendingCalibration(mesh, t, elementOf(model), Vector3d::UnitX());
        const double energy = bendingEnergy(mesh, t, model, coefficient, rolled(mesh.vertices, radius, direction));
        const double expected = 0.5 * D * coveredArea(mesh, t, model) / (radius * radius);
        EXPECT_NEAR(energy / expected, 1.0, 0.02)
            << toString(pattern) << " model " << int(model) << " direction " << direction;
      }
  }
}

/// The one inner edge is a straight line in every cylinder along or across the warp: no calibration can give these an
/// energy.
TEST(PlateBending, TooCoarseMeshesAreRefused)
{
  TriangleMesh square;
  square.vertices.resize(3, 4);
  square.vertices << 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0;
  square.triangles.resize(3, 2);
  square.triangles << 0, 1, 1, 3, 2, 2;
  for (const auto element : {IsometricElement::nonconforming, IsometricElement::conforming})
    EXPECT_THROW(bendingCalibration(square, meshTopology(square), element, Vector3d::UnitX()), std::invalid_argument);
}

TEST(PlateBending, CalibrationsOfLatticesAreThird)
{
  for (const GridPattern pattern : {GridPattern::one_diagonal, GridPattern::alternating, GridPattern::equilateral})
  {
    const double height = pattern == GridPattern::equilateral ? 20 * std::sqrt(0.75) : 20;   // an exact lattice
    const TriangleMesh mesh = gridMesh(20, height, 20, 20, pattern);
    const MeshTopology t = meshTopology(mesh);
    // at the edge the directions' shares differ
    EXPECT_NEAR(bendingCalibration(mesh, t, IsometricElement::nonconforming, Vector3d::UnitX()), 1.0 / 3, 0.015)
        << toString(pattern);
    EXPECT_NEAR(bendingCalibration(mesh, t, IsometricElement::conforming, Vector3d::UnitX()), 1.0, 1e-2)
        << toString(pattern);
  }
}

TEST(PlateBending, SpheresHaveTheirWillmoreEnergy)
{
  const TriangleMesh sphere = icosphere(2.0, 4);
  const MeshTopology t = meshTopology(sphere);
  for (const Model model : kModels)
  {
    // reference/rod_plate/sphere_willmore.csv, level 4: coefficient 1
    const double ratio = bendingEnergy(sphere, t, model, 1.0, sphere.vertices) / (8 * kPi);
    const double expected = model == Model::hinge           ? 1.015275595
                            : model == Model::nonconforming ? 1.015098972
                                                            : 0.9988855204;
    EXPECT_NEAR(ratio, expected, model == Model::conforming ? 2e-3 : 1e-5);
    // Poisson's ratio -1/3 of hinges: D (1 + nu) / 2 of the energy with D H^2 / 2
    const double calibrated = bendingEnergy(
        sphere, t, model, bendingCalibration(sphere, t, elementOf(model), Vector3d::UnitX()), sphere.vertices);
    EXPECT_NEAR(calibrated / (8 * kPi), model == Model::conforming ? 1.0 : 1.0 / 3,
                model == Model::conforming ? 0.02 : 0.02 / 3)
        << int(model);
  }
}

TEST(IsometricBending, IsSemidefiniteAndLeavesAffineMapsOfFlatSheetsAlone)
{
  for (const GridPattern pattern : kPatterns)
    for (const IsometricElement element : {IsometricElement::nonconforming, IsometricElement::conforming})
    {
      const TriangleMesh mesh = gridMesh(1.0, 1.2, 8, 0, pattern);
      const MeshTopology t = meshTopology(mesh);
      const MatrixXd K = isometricBending(mesh, t, element, 2.0).toEigen();
      EXPECT_EQ(K, K.transpose());
      const double size = K.norm();
      EXPECT_GT(smallestEigenvalue(K), -1e-13 * size);
      EXPECT_LT((K * VectorXd::Ones(K.rows())).norm(), 1e-12 * size);
      EXPECT_LT((K * mesh.vertices.transpose()).norm(), 1e-12 * size);
      // and nothing else: a free sheet has no other way to move
      const VectorXd eigenvalues = Eigen::SelfAdjointEigenSolver<MatrixXd>(K).eigenvalues();
      const double fourth = eigenvalues[3];
      if (element == IsometricElement::nonconforming)
        EXPECT_GT(fourth, 1e-6 * size) << toString(pattern);
      EXPECT_LT(std::abs(eigenvalues[2]), 1e-12 * size);
    }
}

TEST(IsometricBending, IsTheHessianOfFlatHinges)
{
  Random random(17);
  for (const GridPattern pattern : kPatterns)
  {
    const TriangleMesh mesh = gridMesh(1.0, 1.0, 6, 0, pattern);
    const MeshTopology t = meshTopology(mesh);
    const double coefficient = 0.8;
    const Eigen::Matrix3d turn = random.rotation().toRotationMatrix();
    const Vector3d normal = turn.col(2);
    HingeTerm hinges(t.hinges, hingeStiffness(mesh, t, coefficient), VectorXd::Zero(t.hingeCount()));
    Derivatives d(hinges, static_cast<int>(mesh.vertices.cols()));
    const MatrixXd H = d.hessian(turn * mesh.vertices, HessianKind::exact);
    const MatrixXd K = isometricBending(mesh, t, IsometricElement::nonconforming, coefficient).toEigen();
    MatrixXd expected = MatrixXd::Zero(H.rows(), H.cols());
    for (Eigen::Index i = 0; i < K.rows(); ++i)
      for (Eigen::Index j = 0; j < K.cols(); ++j)
        expected.block<3, 3>(3 * i, 3 * j) = K(i, j) * normal * normal.transpose();
    EXPECT_LT((H - expected).norm(), 1e-12 * H.norm());
  }
}

TEST(PointMatrix, ProductsMatchDenseOnes)
{
  Random random(19);
  const TriangleMesh mesh = gridMesh(1.0, 1.0, 9, 0, GridPattern::irregular);
  const MeshTopology t = meshTopology(mesh);
  const PointMatrix K = isometricBending(mesh, t, IsometricElement::nonconforming, 1.0);
  const MatrixXd dense = K.toEigen();
  Matrix3Xd x(3, K.size()), y(3, K.size());
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    x.col(i) = random.vector(), y.col(i) = random.vector();
  const PointVector px = pointsOf(x);
  PointVector py = pointsOf(y);
  const double form = K.addProduct(-0.3, px.data(), py.data());
  const Matrix3Xd product = (dense * x.transpose()).transpose(), sum = y - 0.3 * product;
  EXPECT_LT((matrixOf(py) - sum).norm(), 1e-13 * sum.norm());
  EXPECT_NEAR(form, x.cwiseProduct(product).sum(), 1e-12 * std::abs(form));
  EXPECT_NEAR(K.multiply(px.data(), py.data()), form, 1e-12 * std::abs(form));
  EXPECT_LT((matrixOf(py) - product).norm(), 1e-13 * product.norm());
  for (std::size_t i = 3; i < py.size(); i += 4)
    EXPECT_EQ(py[i], 0.0);

  // as blocks, with others beside them
  MembraneTerm membrane(mesh, orthotropicMembrane(3.0, 1.2, 0.4, 0.5));
  BlockMatrix blocks(K.size(), {mesh.triangles, t.hinges});
  PointVector gradient(4 * K.size(), 0.0);
  membrane.setPattern(blocks);
  membrane.addHessian(HessianKind::exact, pointsOf(mesh.vertices + 0.1 * x).data(), gradient.data(), blocks.values());
  const MatrixXd before = denseOf(blocks);
  EXPECT_LT((before - before.transpose()).norm(), 1e-14 * before.norm());
  blocks.add(0.5, K, blocks.mapOf(K));
  MatrixXd whole = before;
  for (int i = 0; i < K.size(); ++i)
    for (int j = 0; j < K.size(); ++j)
      whole.block<3, 3>(3 * i, 3 * j) += 0.5 * dense(i, j) * Eigen::Matrix3d::Identity();
  EXPECT_LT((denseOf(blocks) - whole).norm(), 1e-13 * whole.norm());
  py.assign(4 * K.size(), 0.0);
  blocks.addProduct(px.data(), py.data());
  const VectorXd expected = whole * flattened(x);
  EXPECT_LT((flattened(matrixOf(py)) - expected).norm(), 1e-13 * expected.norm());
  EXPECT_THROW(BlockMatrix(K.size(), {mesh.triangles}).mapOf(K), std::invalid_argument);
}

}   // namespace
}   // namespace slender::test
