#include "shape_cases.h"

#include <cmath>

#include "slender_sim/rod/rod_system.h"

namespace slender::study {

RodSection sectionOf(double stretch, double bend1, double bend2, double twist)
{
  RodSection s{};
  s.a = s.b = 1e-3;   // only for the record
  s.linear_density = 1.0;
  s.stretch_modulus = stretch;
  s.bend_modulus << bend1, 0, 0, bend2;
  s.twist_modulus = twist;
  return s;
}

RodSetup naturalRod(const RodSection& section, const Eigen::Matrix3Xd& rest, const Eigen::Vector3d& director,
                    const JointOptions& joints)
{
  const std::vector<RodSection> sections(static_cast<std::size_t>(rest.cols() - 1), section);
  RodModel model = buildRod("study", rest, false, sections, director, false, joints);
  RodSetup rod;
  rod.state = makeRodState(model, rest, director);
  rod.model = std::make_shared<const RodModel>(std::move(model));
  rod.inputs.gravity.setZero();
  return rod;
}

void lay(RodSetup& rod, const Eigen::Matrix3Xd& nodes, const Eigen::Vector3d& director)
{
  const RodState laid = makeRodState(*rod.model, nodes, director);
  rod.state.x = laid.x;
  rod.state.v = laid.v;
  rod.state.d1 = laid.d1;
  rod.state.twist = laid.twist;
  rod.state.forgetHistory();
}

std::shared_ptr<const RodModel> keptPlanar(const RodModel& model, int keep, double factor)
{
  auto stiff = std::make_shared<RodModel>(model);
  stiff->bend_modulus.row(keep == 1 ? 2 : 0) *= factor;
  stiff->twist_modulus *= factor;
  return stiff;
}

int unstableModes(const RodModel& model, const RodState& state, const Eigen::Vector3d& gravity)
{
  RodSystem system(model);
  system.load(state);
  system.setResponse(0.0, nullptr);
  for (int i = 0; i < model.nodes(); ++i)
    system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), model.mass[i] * gravity);
  std::vector<Pose> poses;
  for (const GraspState& g : state.grasps)
    poses.push_back(g.X_WG);
  system.placeGrasps(poses);
  const RodEvaluation at = system.evaluate(true);
  return at.inertia.negative + at.inertia.zero;
}

void pushOff(RodSetup& rod, const Eigen::Vector3d& direction, double amplitude)
{
  const int last = rod.model->nodes() - 1;
  Eigen::Matrix3Xd nodes = rod.state.x;
  for (int i = 1; i <= last; ++i)
    nodes.col(i) += amplitude * std::pow(static_cast<double>(i) / last, 2) * direction;
  const Eigen::Vector3d director = rod.state.d1.col(0);
  lay(rod, nodes, director);
}

}   // namespace slender::study
