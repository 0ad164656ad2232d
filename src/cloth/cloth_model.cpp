#include "slender_sim/cloth/cloth_model.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

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

ClothModel buildCloth(const std::string& name, const TriangleMesh& rest, double area_density, const MembraneModuli& membrane,
                      const Eigen::Vector3d& warp)
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

ClothState makeClothState(const ClothModel& model, const Eigen::Matrix3Xd& vertices)
{
  if (vertices.cols() != model.vertices() || !vertices.allFinite())
    throw std::invalid_argument("cloth '" + model.name + "': needs " + std::to_string(model.vertices()) + " finite vertices, got " +
                                std::to_string(vertices.cols()));
  ClothState state;
  state.x = vertices;
  state.v = Eigen::Matrix3Xd::Zero(3, vertices.cols());
  if (model.undeformed.cols() != 0 && (model.undeformed.cols() != model.vertices() || !model.undeformed.allFinite()))
    throw std::invalid_argument("cloth '" + model.name + "': the undeformed shape needs " + std::to_string(model.vertices()) + " finite vertices, got " +
                                std::to_string(model.undeformed.cols()));
  if (model.bending == BendingModel::hinge)
  {
    const Eigen::VectorXd none = Eigen::VectorXd::Zero(model.topology.hingeCount());
    const HingeBending hinges(model.topology.hinges, none, none);
    PointVector points;
    toPoints(model.undeformed.cols() ? model.undeformed : model.rest.vertices, points);
    Eigen::VectorXd angles(hinges.paddedCount());
    hinges.angles(points.data(), angles.data());
    state.rest_angles = angles.head(hinges.count());
    if (std::isfinite(model.plasticity.yield_curvature))
      state.stiffening = Eigen::VectorXd::Ones(hinges.count());
  }
  return state;
}

void pinVertices(ClothState& state, const std::vector<int>& vertices)
{
  for (const int v : vertices)
    if (v < 0 || v >= state.x.cols())
      throw std::invalid_argument("pin: vertex " + std::to_string(v) + " is not there; must be from 0 to " + std::to_string(state.x.cols() - 1));
  state.pins.insert(state.pins.end(), vertices.begin(), vertices.end());
  std::sort(state.pins.begin(), state.pins.end());
  state.pins.erase(std::unique(state.pins.begin(), state.pins.end()), state.pins.end());
}

}  // namespace slender
