#include "slender_sim/cloth/cloth_model.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Eigenvalues>

#include "slender_sim/dynamics/failure_place.h"
#include "slender_sim/energy/hinge_term.h"
#include "slender_sim/energy/isometric_bending.h"
#include "slender_sim/geometry/mesh_defects.h"

namespace slender {

const char* toString(BendingModel model)
{
  switch (model)
  {
    case BendingModel::none: return "none";
    case BendingModel::hinge: return "hinge";
    case BendingModel::isometric_nonconforming: return "isometric_nonconforming";
    case BendingModel::isometric_conforming: return "isometric_conforming";
  }
  return "unknown";
}

ClothModel buildCloth(const std::string& name, const TriangleMesh& rest, double area_density,
                      const MembraneModuli& membrane, const Eigen::Vector3d& warp)
{
  const std::string who = "cloth '" + name + "'";
  requireSoundMesh(rest, who);
  if (!(area_density > 0) || !std::isfinite(area_density))
    throw std::invalid_argument(who + ": area density must be positive [kg/m^2], got " + std::to_string(area_density));
  if (!warp.allFinite() || !(warp.norm() > 0))
    throw std::invalid_argument(who + ": warp must be a direction");
  ClothModel model;
  model.name = name;
  model.rest = rest;
  model.topology = meshTopology(rest);
  model.mass = area_density * vertexAreas(rest);
  model.membrane = membrane;
  model.warp = warp.normalized();
  return model;
}

namespace {

/// Angles between the faces of the undeformed shape, one per hinge [rad].
Eigen::VectorXd restAngles(const ClothModel& model)
{
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(model.topology.hingeCount());
  const HingeTerm hinges(model.topology.hinges, none, none);
  PointVector points;
  toPoints(model.undeformed.cols() ? model.undeformed : model.rest.vertices, points);
  Eigen::VectorXd angles(hinges.paddedCount());
  if (hinges.count() > 0)
    hinges.angles(points.data(), angles.data());
  return angles.head(hinges.count());
}

void checkUndeformed(const ClothModel& model)
{
  if (model.undeformed.cols() != 0 && (model.undeformed.cols() != model.vertices() || !model.undeformed.allFinite()))
    throw std::invalid_argument("cloth '" + model.name + "': the undeformed shape needs " +
                                std::to_string(model.vertices()) + " finite vertices, got " +
                                std::to_string(model.undeformed.cols()));
}

std::string degrees(double radians) { return shortNumber(radians * 180 / M_PI, 3) + " degrees"; }

}   // namespace

double largestRestAngle(const ClothModel& model)
{
  return model.topology.hingeCount() > 0 ? restAngles(model).cwiseAbs().maxCoeff() : 0.0;
}

bool restsFlat(const ClothModel& model)
{
  constexpr double kFolded = 0.5;      // [rad]; rounding of vertices tilts no sound face so far
  constexpr double kRounding = 2e-6;   // of the size
  if (largestRestAngle(model) > kFolded)
    return false;
  const Eigen::Matrix3Xd& x = model.undeformed.cols() ? model.undeformed : model.rest.vertices;
  const Eigen::Matrix3Xd from_mean = x.colwise() - x.rowwise().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(from_mean * from_mean.transpose());
  const Eigen::Vector3d normal = spread.eigenvectors().col(0);   // of the plane that fits best
  const double size = (x.rowwise().maxCoeff() - x.rowwise().minCoeff()).norm();
  return (normal.transpose() * from_mean).cwiseAbs().maxCoeff() <= kRounding * size;
}

void checkBending(const ClothModel& model)
{
  const std::string who = "cloth '" + model.name + "': ";
  checkUndeformed(model);
  const bool isometric =
      model.bending == BendingModel::isometric_nonconforming || model.bending == BendingModel::isometric_conforming;
  if (model.bending_poissons_ratio && !(*model.bending_poissons_ratio > -1.0 && *model.bending_poissons_ratio < 1.0))
    throw std::invalid_argument(who + "Poisson's ratio of bending must be in (-1, 1), got " +
                                std::to_string(*model.bending_poissons_ratio));
  if (isometric && model.bending_modulus > 0 && !restsFlat(model))
    throw std::invalid_argument(
        who + "its shape at rest is curved (adjacent faces enclose up to " + degrees(largestRestAngle(model)) +
        "), and the constant matrix of isometric bending would flatten it; use bending: {model: hinge}");
  if (!model.clamped_faces.empty() &&
      model.clamped_faces.size() != static_cast<std::size_t>(model.rest.triangles.cols()))
    throw std::invalid_argument(who + "clamped_faces needs one entry per face, or none");
  const auto clamped = [](char face) { return face != 0; };
  if (model.bending == BendingModel::isometric_conforming &&
      std::any_of(model.clamped_faces.begin(), model.clamped_faces.end(), clamped))
    throw std::invalid_argument(who +
                                "conforming bending has no clamped edges; use bending: {model: isometric} or {model: "
                                "hinge}, or leave out clamp");
  if (model.bending_poissons_ratio && model.bending != BendingModel::isometric_nonconforming)
    throw std::invalid_argument(
        who +
        "bending: {poissons_ratio} is for bending: {model: isometric} of flat shapes at rest. Hinges have the ratio of "
        "their mesh (-1/3 on equilateral triangles), conforming bending has 1: leave poissons_ratio out");
}

ClothState makeClothState(const ClothModel& model, const Eigen::Matrix3Xd& vertices)
{
  if (vertices.cols() != model.vertices() || !vertices.allFinite())
    throw std::invalid_argument("cloth '" + model.name + "': needs " + std::to_string(model.vertices()) +
                                " finite vertices, got " + std::to_string(vertices.cols()));
  ClothState state;
  state.x = vertices;
  state.v = Eigen::Matrix3Xd::Zero(3, vertices.cols());
  checkUndeformed(model);
  if (model.bending == BendingModel::hinge)
  {
    state.rest_angles = restAngles(model);
    if (std::isfinite(model.plasticity.yield_curvature))
      state.stiffening = Eigen::VectorXd::Ones(state.rest_angles.size());
  }
  return state;
}

void clampFaces(ClothModel& model, const std::vector<int>& held)
{
  const std::vector<char> faces = facesWithin(model.rest, held);
  if (std::find(faces.begin(), faces.end(), 1) == faces.end())
    throw std::invalid_argument("cloth '" + model.name +
                                "': a clamp holds no whole face, so that nothing holds the slope; let it hold the "
                                "vertices of at least one face");
  model.clamped_faces.resize(faces.size(), 0);
  for (std::size_t f = 0; f < faces.size(); ++f)
    model.clamped_faces[f] = static_cast<char>(model.clamped_faces[f] | faces[f]);
}

void pinVertices(ClothState& state, const std::vector<int>& vertices)
{
  for (const int v : vertices)
    if (v < 0 || v >= state.x.cols())
      throw std::invalid_argument("pin: vertex " + std::to_string(v) + " is not there; must be from 0 to " +
                                  std::to_string(state.x.cols() - 1));
  state.pins.insert(state.pins.end(), vertices.begin(), vertices.end());
  std::sort(state.pins.begin(), state.pins.end());
  state.pins.erase(std::unique(state.pins.begin(), state.pins.end()), state.pins.end());
}

}   // namespace slender
