#include "slender_sim/rod/rod_sections.h"

#include <cmath>

#include "slender_sim/energy/compensated_response.h"
#include "slender_sim/rod/rod_system.h"

namespace slender {

namespace {

using Eigen::Vector3d;

Vector3d eigen(const Vec3<double>& v) { return {v.x, v.y, v.z}; }

struct Joint
{
  double kappa1, kappa2;
  Vector3d force_e, force_f;   ///< gradients by the two edge vectors [N]
  Vector3d moment;             ///< of what follows on what precedes [N m]
};

Joint jointAt(const RodModel& model, const RodArrays& a, int node, int e)
{
  const int f = node;
  const Vec3<double> te = pointAt(a.t, e), d1e = pointAt(a.d1, e), tf = pointAt(a.t, f), d1f = pointAt(a.d1, f);
  const JointFrames<double> frames = {
      te, d1e, cross(te, d1e), tf, d1f, cross(tf, d1f), a.inverse_length[e], a.inverse_length[f]};
  const JointStrains<double> strains = jointStrains(frames);
  const JointMaterial<double> material = {a.b11[node],         a.b12[node],         a.b22[node],       a.beta[node],
                                          a.rest_kappa1[node], a.rest_kappa2[node], a.rest_twist[node]};
  Joint joint{strains.kappa1, strains.kappa2, {}, {}, {}};
  JointGradient<double> g;
  JointHessian<double> unused;
  const double m = a.twist[node];
  if (model.curvature == Curvature::compensated)
  {
    const JointCompensation<double> compensation = {a.coupling[node], std::sqrt(0.5 / strains.inverse_chi),
                                                    std::sin(0.5 * m), std::cos(0.5 * m)};
    jointDerivatives<false, true>(frames, strains,
                                  compensatedResponse(strains, m, material, compensation, joint.kappa1, joint.kappa2),
                                  g, unused);
  }
  else
    jointDerivatives<false, false>(frames, strains, tangentResponse(strains, m, material), g, unused);
  joint.force_e = eigen(g.e);
  joint.force_f = eigen(g.f);
  const Vector3d t = eigen(tf);
  joint.moment = t.cross(joint.force_f) / a.inverse_length[f] + g.theta_f * t;
  return joint;
}

/// Has the stiffnesses respond with the part of Rayleigh damping that the state's strain rates tell of.
void addDamping(const RodModel& model, const RodState& state, RodSystem& system)
{
  const Eigen::Index columns = model.nodes() + 2 * static_cast<Eigen::Index>(state.grasps.size());
  if (!(model.stiffness_damping > 0) || state.strain_rate.cols() != columns)
    return;
  Eigen::Matrix4Xd strains;
  system.strains(strains);
  strains -= model.stiffness_damping * state.strain_rate;
  system.setResponse(1.0, &strains);   // k (strain - rest) + 1 k (strain - (strain - damping * rate))
  system.evaluate(false);
}

void takeJoints(const RodModel& model, const RodState& state, const RodSystem& system, RodSections& out)
{
  const RodArrays& a = system.arrays();
  for (int i = 0; i < model.nodes(); ++i)
  {
    double length = model.voronoiLength(i);
    out.curvature.col(i) = model.rest_curvature.col(i) / length;
    out.twist[i] = model.rest_twist[i] / length;
    const bool end = !model.closed && (i == 0 || i == model.nodes() - 1);
    if (end)
      continue;
    // held: inside the held part, or a section whose half joints come later
    const bool jointless = !(system.twistStiffness()[i] > 0);
    const Joint joint = jointAt(model, a, i, i > 0 ? i - 1 : model.edges() - 1);
    if (!jointless)
      length = model.twist_modulus[i] / system.twistStiffness()[i];
    out.curvature.col(i) << joint.kappa1 / length, joint.kappa2 / length;
    out.twist[i] = a.twist[i] / length;
    if (jointless)
      continue;
    out.moment.col(i) = joint.moment;
    out.material_moment.col(i) = sectionFrame(model, state, i).transpose() * joint.moment;
    out.force.col(i > 0 ? i - 1 : model.edges() - 1) += joint.force_e;
    out.force.col(i) += joint.force_f;
  }
}

/// Of a section in the middle of a rod, which has a half joint on either side, the one after it comes last and stays.
void takeClamps(const RodModel& model, const RodSystem& system, RodSections& out)
{
  for (const ClampJoint& c : system.clamps())
  {
    out.force.col(c.edge) += c.gradient_e;
    const double length = model.twist_modulus[c.node] / c.beta;
    out.curvature.col(c.node) << c.kappa1 / length, c.kappa2 / length;
    out.twist[c.node] = c.twist / length;
    out.moment.col(c.node) = c.side == 1 ? c.torque : Vector3d(-c.torque);
    const Eigen::Matrix3d section = (Eigen::Matrix3d() << c.t, c.d1, c.t.cross(c.d1)).finished();
    out.material_moment.col(c.node) = section.transpose() * out.moment.col(c.node);
  }
}

/// Forces and moments inside what is held as a rigid whole are not determined.
void blankHeldParts(const RodState& state, RodSections& out)
{
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  for (const GraspState& grasp : state.grasps)
    if (grasp.active)
    {
      for (int j = grasp.first_node; j < grasp.last_node; ++j)
        out.force.col(j).setConstant(unknown);
      for (int i = grasp.first_node + 1; i < grasp.last_node; ++i)
      {
        out.moment.col(i).setConstant(unknown);
        out.material_moment.col(i).setConstant(unknown);
      }
    }
}

}   // namespace

RodSections sectionsOf(const RodModel& model, const RodState& given)
{
  RodState state = given;
  addFrames(model, state);
  RodSystem system(model);
  system.load(state);
  system.setResponse(0.0, nullptr);
  for (int i = 0; i < model.nodes(); ++i)
    system.setInertia(i, 0.0, Vector3d::Zero(), Vector3d::Zero());
  system.evaluate(false);
  addDamping(model, state, system);

  const int nodes = model.nodes(), edges = model.edges();
  const RodArrays& a = system.arrays();
  RodSections out{Eigen::Matrix2Xd(2, nodes),      Eigen::VectorXd(nodes), Eigen::VectorXd(edges),
                  Eigen::Matrix3Xd(3, edges),      Eigen::VectorXd(edges), Eigen::Matrix3Xd::Zero(3, nodes),
                  Eigen::Matrix3Xd::Zero(3, nodes)};
  for (int j = 0; j < edges; ++j)
  {
    out.strain[j] = a.strain[j];
    out.force.col(j) = a.stretch[j] * (a.strain[j] - a.rest_strain[j]) * eigen(pointAt(a.t, j));
  }
  takeJoints(model, state, system, out);
  takeClamps(model, system, out);
  blankHeldParts(state, out);
  for (int j = 0; j < edges; ++j)
    out.tension[j] = out.force.col(j).dot(eigen(pointAt(a.t, j)));
  return out;
}

}   // namespace slender
