// A vertical strip pressed on a floor with Coulomb friction: the compression at which its foot slips (Sano, Yamaguchi &
// Wada 2017).
#include <cmath>
#include <iterator>
#include <string>

#include "contact_cases.h"
#include "study/framework/shape_cases.h"
#include "slender_sim/geometry/curves.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

/// stickslip_inverse.csv: first slip as the compression eps (over L) grows, for a coefficient of friction.
struct Slip
{
  double mu, compression;
};
constexpr Slip kSlips[] = {{0.05, 0.01238049378}, {0.1, 0.04687417821}, {0.15, 0.09690456801},
                           {0.2, 0.1548673548},   {0.25, 0.2144635647}, {0.3, 0.2715634261}};

struct PressedRod
{
  double compression = 0;                     ///< of the foot's first slip, 0: none
  std::vector<double> compressions, ratios;   ///< |Fx| / N on the way there
};

/// L = B = 1. The strip is far stiffer out of its plane, so the problem is planar; light and damped, so the motion is
/// quasistatic.
PressedRod press(int edges, const Slip& slip)
{
  const double radius = 5e-4, gap = 5e-5, foot = radius + 0.5 * gap;
  Eigen::Matrix3Xd nodes = straightCurve({0, 0, 1 + foot}, {0, 0, foot}, edges);
  RodSection section = sectionOf(1e6, 100.0, 1.0, 100.0);   // curvature along d1 = y is out of the plane
  section.a = section.b = radius;
  section.linear_density = 1e-3;
  RodSetup rod = naturalRod(section, nodes, Eigen::Vector3d::UnitY());
  auto model = std::make_shared<RodModel>(*rod.model);
  model->mass_damping = 100.0;
  rod.model = model;
  for (int i = 0; i <= edges; ++i)
  {
    const double s = static_cast<double>(i) / edges;
    nodes(0, i) = 2e-3 * s * s * (1 - s);   // towards the first buckling mode
  }
  lay(rod, nodes, Eigen::Vector3d::UnitY());
  rod.hold(0, 0, true);
  rod.inputs.grasps[0].X_WG.orientation = Eigen::Quaterniond(rod.inputs.grasps[0].X_WG.orientation);
  rod.inputs.gravity.setZero();
  GroupSetup g;
  g.add(rod);
  g.setGravity(Eigen::Vector3d::Zero());
  g.model.rods[0].contact = ContactProperties{false, false, true, slip.mu};
  addObstacle(g, Plane{}, {});
  g.model.contact.gap = gap;
  // creep: at most 2e-6 in a move; less, and the range that sticks is no longer resolved
  g.model.contact.slip_speed = 5e-5;
  const double step = 0.02;
  World world = g.world(timeConfig(Integrator::implicit_euler, step, 1e-8));
  const Pose start = rod.inputs.grasps[0].X_WG;
  PressedRod result;
  double foot_before = g.state.rods[0].x(0, edges);
  for (double compression = 0; compression < 1.15 * slip.compression;)
  {
    compression += (compression < 0.9 * slip.compression ? 0.01 : 0.002) * slip.compression;
    g.inputs.rods[0].grasps[0].X_WG = start;
    g.inputs.rods[0].grasps[0].X_WG.position.z() -= compression;
    for (int k = 0; k < 2; ++k)   // and wait: the motion shall be quasistatic
      require(world.step(g.state, g.inputs), "stick-slip, mu = " + std::to_string(slip.mu));
    const double at = g.state.rods[0].x(0, edges);
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    for (const ContactForce& contact : world.contacts())
      force += contact.force;
    result.compressions.push_back(compression);
    result.ratios.push_back(std::hypot(force.x(), force.y()) / force.z());
    if (compression > 0.3 * slip.compression && std::abs(at - foot_before) > 1e-3)
    {
      result.compression = compression;
      break;
    }
    foot_before = at;
  }
  return result;
}

}   // namespace

void runStickSlip(StudyContext& context)
{
  Plot& plot = context.plot("stick_slip", "Pressed strip: horizontal over vertical force until the foot slips",
                            "compression / L", "|Fx| / N");
  plot.log_x = plot.log_y = false;
  constexpr int kMeshes[] = {40, 80};
  int done = 0;
  for (const int edges : kMeshes)
    for (std::size_t k = 0; k < std::size(kSlips); ++k)
    {
      const Slip& slip = kSlips[k];
      context.progress(done++, static_cast<int>(std::size(kMeshes) * std::size(kSlips)),
                       "mu = " + std::to_string(slip.mu));
      const PressedRod r = press(edges, slip);
      // the coefficient that belongs to the measured compression, by the table's local power law
      const Slip &a = kSlips[k > 0 ? k - 1 : 0], &b = kSlips[k > 0 ? k : 1];
      const double power = std::log(b.mu / a.mu) / std::log(b.compression / a.compression);
      const double mu = r.compression > 0 ? slip.mu * std::pow(r.compression / slip.compression, power) : 0.0;
      context.row()
          .set("n", edges)
          .set("compression", r.compression)
          .set("expected_compression", slip.compression)
          .check(mu, slip.mu, 0.01 * slip.mu, "stickslip_inverse.csv: mu at the compression of the first slip");
      if (edges != kMeshes[0])
        continue;
      Series& series = plot.at("mu = " + std::to_string(slip.mu).substr(0, 4));
      series.x = r.compressions;
      series.y = r.ratios;
    }
}

const StudyRegistration kStickSlipRegistration{
    "stick_slip",
    "compression at which the foot of a strip pressed on a floor slips, against the coefficient of friction",
    runStickSlip};

}   // namespace slender::study
