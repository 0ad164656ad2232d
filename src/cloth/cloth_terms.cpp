#include "cloth_terms.h"

#include <Eigen/Geometry>

#include "slender_sim/energy/hinge_term.h"
#include "slender_sim/energy/isometric_bending.h"
#include "slender_sim/energy/membrane_term.h"
#include "slender_sim/energy/plate_bending.h"
#include "slender_sim/energy/quadratic_term.h"
#include "wind_load.h"

namespace slender {

namespace {

/// Cotangent stiffness of the rest mesh times a modulus: the membrane as if it acted on each coordinate alike.
PointMatrix scalarMembrane(const ClothModel& model)
{
  std::vector<Eigen::Triplet<double>> entries;
  const double modulus = 0.5 * (model.membrane.c11 + model.membrane.c22);
  const Eigen::Matrix3Xd& x = model.rest.vertices;
  for (Eigen::Index f = 0; f < model.rest.triangles.cols(); ++f)
    for (int k = 0; k < 3; ++k)
    {
      const auto corner = [&](int c) { return model.rest.triangles((k + c) % 3, f); };
      const int a = corner(1), b = corner(2);
      const Eigen::Vector3d u = x.col(a) - x.col(corner(0)), v = x.col(b) - x.col(corner(0));
      const double weight = 0.5 * modulus * u.dot(v) / u.cross(v).norm();
      entries.emplace_back(a, a, weight);
      entries.emplace_back(b, b, weight);
      entries.emplace_back(a, b, -weight);
      entries.emplace_back(b, a, -weight);
    }
  return PointMatrix(model.vertices(), entries);
}

ClothTerm bendingTerm(const ClothModel& model)
{
  const MeshTopology& t = model.topology;
  const auto element = model.bending == BendingModel::isometric_conforming ? IsometricElement::conforming
                                                                           : IsometricElement::nonconforming;
  const double coefficient = model.bending_modulus * bendingCalibration(model.rest, t, element, model.warp);
  const auto matrix = [&model, element, coefficient] {
    const auto ratio = model.bending_poissons_ratio;
    return ratio ? plateBending(model.rest, model.topology, *ratio, model.bending_modulus, model.clamped_faces)
                 : isometricBending(model.rest, model.topology, element, coefficient, model.clamped_faces);
  };
  if (model.bending != BendingModel::hinge)
    return {std::make_unique<QuadraticTerm>(matrix()), nullptr};
  return {std::make_unique<HingeTerm>(t.hinges, hingeStiffness(model.rest, t, coefficient, model.clamped_faces),
                                      Eigen::VectorXd::Zero(t.hingeCount())),
          matrix};
}

}   // namespace

std::vector<ClothTerm> clothTerms(const ClothModel& model)
{
  std::vector<ClothTerm> terms;
  terms.push_back({std::make_unique<MembraneTerm>(model.rest, model.membrane, model.warp),
                   [&model] { return scalarMembrane(model); }});
  if (model.bending != BendingModel::none && model.bending_modulus > 0 && model.topology.hingeCount() > 0)
    terms.push_back(bendingTerm(model));
  return terms;
}

std::vector<std::unique_ptr<PointLoad>> clothLoads(const ClothModel& model)
{
  std::vector<std::unique_ptr<PointLoad>> loads;
  if (WindLoad::actsOn(model))
    loads.push_back(std::make_unique<WindLoad>(model));
  return loads;
}

}   // namespace slender
