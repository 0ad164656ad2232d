#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "slender_sim/cloth/cloth_stepper.h"
#include "slender_sim/geometry/mesh_shapes.h"
#include "slender_sim/linalg/point_matrix.h"
#include "study/framework/cpu_clock.h"

// OpenBLAS starts a thread per processor; the clock here sees one. Absent from other BLAS libraries.
extern "C" __attribute__((weak)) void openblas_set_num_threads(int);

namespace slender::study {

inline void useOneBlasThread()
{
  if (openblas_set_num_threads)
    openblas_set_num_threads(1);
}

constexpr GridPattern kPatterns[] = {GridPattern::equilateral, GridPattern::alternating, GridPattern::one_diagonal,
                                     GridPattern::irregular};
constexpr BendingModel kBendingModels[] = {BendingModel::hinge, BendingModel::isometric_nonconforming,
                                           BendingModel::isometric_conforming};

/// Model, state and inputs of one cloth that belong together; no gravity.
struct ClothSetup
{
  std::shared_ptr<ClothModel> model;
  ClothState state;
  ClothInputs inputs;

  explicit ClothSetup(ClothModel m)
    : model(std::make_shared<ClothModel>(std::move(m))),
      state(makeClothState(*model, model->rest.vertices))
  {
    inputs.gravity.setZero();
  }
  /// Holds vertices where they are, in addition to those that already are.
  void pin(const std::vector<int>& vertices)
  {
    pinVertices(state, vertices);
    inputs.pins.resize(3, static_cast<Eigen::Index>(state.pins.size()));
    for (std::size_t k = 0; k < state.pins.size(); ++k)
      inputs.pins.col(static_cast<Eigen::Index>(k)) = state.x.col(state.pins[k]);
  }
};

/// Those of a mesh for which `which(position)` holds.
template <class Which>
std::vector<int> verticesWhere(const TriangleMesh& mesh, Which which)
{
  std::vector<int> found;
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
    if (which(Eigen::Vector3d(mesh.vertices.col(i))))
      found.push_back(static_cast<int>(i));
  return found;
}

/// The vertex nearest to a place.
inline int nearestVertex(const TriangleMesh& mesh, const Eigen::Vector3d& place)
{
  Eigen::Index index;
  (mesh.vertices.colwise() - place).colwise().squaredNorm().minCoeff(&index);
  return static_cast<int>(index);
}

/// Root mean square of the distances of points [m].
inline double rmsDistance(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b)
{
  return std::sqrt((a - b).squaredNorm() / static_cast<double>(a.cols()));
}

/// Root mean square of the distances of the same points in several frames, which count alike [m].
inline double rmsDistance(const std::vector<Eigen::Matrix3Xd>& a, const std::vector<Eigen::Matrix3Xd>& b)
{
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    sum += (a[k] - b[k]).squaredNorm() / static_cast<double>(a[k].cols());
  return std::sqrt(sum / static_cast<double>(a.size()));
}

/// Least CPU time [s] of several calls, for as long as `budget` [s] allows, at least three.
template <class Function>
double leastSeconds(double budget, Function f)
{
  double least = std::numeric_limits<double>::infinity();
  const double begin = threadSeconds();
  for (int k = 0; k < 3 || threadSeconds() - begin < budget; ++k)
  {
    const double start = threadSeconds();
    f();
    least = std::min(least, threadSeconds() - start);
  }
  return least;
}

}   // namespace slender::study
