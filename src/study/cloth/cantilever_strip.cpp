#include "cantilever_strip.h"

#include <cmath>

namespace slender::study {

double cantileverStrip(GridPattern pattern, BendingModel bending, double gamma, double stiffness, double width,
                       int cells, double& seconds)
{
  const double h = 1.0 / (cells + 0.5), start = threadSeconds();
  // rows of vertices across the strip: along them a sheet bends without stretching
  const bool triangular = pattern == GridPattern::equilateral || pattern == GridPattern::irregular;
  const double column = triangular ? h / std::sqrt(0.75) : h;
  const int columns = static_cast<int>(std::lround(width / column));
  width = columns * column;
  TriangleMesh mesh = gridMesh(width, (cells + 1) * h, columns, cells + 1, pattern);
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
    mesh.vertices.col(i) = Eigen::Vector3d(mesh.vertices(1, i) - 0.5 * h, -mesh.vertices(0, i), 0);
  ClothModel model = buildCloth("strip", mesh, 1.0, isotropicMembrane(stiffness, 0.0, 1.0));
  model.bending = bending;
  model.bending_modulus = 1.0;
  model.mass_damping = 4.0;
  ClothSetup strip(std::move(model));
  strip.pin(verticesWhere(mesh, [&](const Eigen::Vector3d& p) { return p.x() < 0.8 * h; }));
  strip.inputs.gravity = Eigen::Vector3d(0, 0, -gamma);
  ClothOptions options;
  options.solver = ClothSolver::cholesky;
  options.newton.max_iterations = 100;
  ClothStepper stepper(strip.model, options);
  double rate = std::max(1.0, std::sqrt(gamma));
  for (int k = 0; k < 60; ++k)
  {
    const double step = (k < 20 ? 0.1 : k < 30 ? 1.0 : 30.0) / rate;
    if (!stepper.step(strip.state, strip.inputs, step).ok)
      return std::numeric_limits<double>::quiet_NaN();
    if (k > 30 && strip.state.v.cwiseAbs().maxCoeff() * 30.0 / rate < 1e-7)
      break;
  }
  seconds = threadSeconds() - start;
  const Eigen::Vector3d tip = strip.state.x.col(nearestVertex(mesh, Eigen::Vector3d(1, -0.5 * width, 0)));
  return -tip.z() / tip.x();
}

}   // namespace slender::study
