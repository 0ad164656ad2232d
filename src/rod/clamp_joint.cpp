// The half joint between a clamped section and the free edge beyond it: the same stencil as every other joint, with the
// section in the place of the missing edge.
#include "slender_sim/rod/clamp_joint.h"

#include <algorithm>
#include <cmath>

#include "slender_sim/energy/compensated_response.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {
Vec3<double> vec(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// A section and the free edge beside it as a joint.
struct HalfJoint
{
  int edge, next;       ///< the free edge's number and its second node
  bool section_first;   ///< the section stands in the place of the edge before
  double inverse;       ///< of the edge's length [1/m]
  Eigen::Vector3d t;    ///< of the edge
  JointFrames<double> frames;
};

/// Also brings the clamp's twist up to date.
HalfJoint halfJoint(ClampJoint& c, const RodArrays& a)
{
  const int j = c.edge;
  const Vec3<double> section_t = vec(c.t), section_d1 = vec(c.d1), section_d2 = vec(c.t.cross(c.d1));
  const Vec3<double> edge_t = pointAt(a.t, j), edge_d1 = pointAt(a.d1, j), edge_d2 = cross(edge_t, edge_d1);
  const double inverse = a.inverse_length[j];
  const bool section_first = c.side == 1;
  const JointFrames<double> frames =
      section_first
          ? JointFrames<double>{section_t, section_d1, section_d2, edge_t, edge_d1, edge_d2, inverse, inverse}
          : JointFrames<double>{edge_t, edge_d1, edge_d2, section_t, section_d1, section_d2, inverse, inverse};

  const Eigen::Vector3d te(edge_t.x, edge_t.y, edge_t.z), de(edge_d1.x, edge_d1.y, edge_d1.z);
  const double angle = section_first ? signedAngle(parallelTransport(c.d1, c.t, te), de, te)
                                     : signedAngle(parallelTransport(de, te, c.t), c.d1, c.t);
  const double turned = section_first ? a.turn[j] - c.turn : c.turn - a.turn[j];
  c.twist = unwrapNear(angle, c.base_twist + turned);
  return {j, j + 1 < a.nodes ? j + 1 : 0, section_first, inverse, te, frames};
}

/// Derivatives of the clamp at these strains, the Hessian only if it is asked for. Sets the energy, and with
/// compensated curvature the curvatures.
void respond(ClampJoint& c, Curvature curvature, const JointFrames<double>& frames, const JointStrains<double>& strains,
             bool with_hessian, JointGradient<double>& g, JointHessian<double>& h)
{
  const JointMaterial<double> material = {c.scale * c.b11, c.scale * c.b12, c.scale * c.b22, c.scale * c.beta,
                                          c.rest1,         c.rest2,         c.rest3};
  JointResponse<double> response;
  if (curvature == Curvature::compensated)
  {
    const JointCompensation<double> compensation = {c.scale * c.scale * c.coupling,
                                                    std::sqrt(0.5 / strains.inverse_chi), std::sin(0.5 * c.twist),
                                                    std::cos(0.5 * c.twist)};
    response = compensatedResponse(strains, c.twist, material, compensation, c.kappa1, c.kappa2);
    if (with_hessian)
      jointDerivatives<true, true>(frames, strains, response, g, h);
    else
      jointDerivatives<false, true>(frames, strains, response, g, h);
  }
  else
  {
    response = tangentResponse(strains, c.twist, material);
    if (with_hessian)
      jointDerivatives<true, false>(frames, strains, response, g, h);
    else
      jointDerivatives<false, false>(frames, strains, response, g, h);
  }
  c.energy = response.energy;
}

void addGradient(const HalfJoint& joint, const JointGradient<double>& g, const RodArrays& a, ClampJoint& c)
{
  const int j = joint.edge;
  const Vec3<double> ge = joint.section_first ? g.f : g.e;
  const double gt = joint.section_first ? g.theta_f : g.theta_e;
  const double force[3] = {ge.x, ge.y, ge.z};
  for (int k = 0; k < 3; ++k)
  {
    a.gradient[4 * j + k] -= force[k];
    a.gradient[4 * joint.next + k] += force[k];
  }
  a.gradient[4 * j + 3] += gt;
  c.gradient_e << ge.x, ge.y, ge.z;
  c.gradient_t = gt;
  c.torque = (1.0 / joint.inverse) * joint.t.cross(c.gradient_e) + gt * joint.t;
}

/// p, q: panels of the edge's first and second node.
void addHessian(const HalfJoint& joint, const JointHessian<double>& h, RodPanel& p, RodPanel& q, ClampJoint& c)
{
  const Sym3<double>& s = joint.section_first ? h.ff : h.ee;
  const Vec3<double>& m = joint.section_first ? h.f_tf : h.e_te;
  const double ee[3][3] = {{s.xx, s.xy, s.xz}, {s.xy, s.yy, s.yz}, {s.xz, s.yz, s.zz}};
  const double et[3] = {m.x, m.y, m.z};
  c.hessian_ee << s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz;
  c.hessian_et << m.x, m.y, m.z;
  c.hessian_tt = joint.section_first ? h.tf_tf : h.te_te;
  for (int col = 0; col < 3; ++col)
  {
    for (int row = 0; row < 3; ++row)
    {
      if (row >= col)
      {
        p.diag[col][row] += ee[row][col];
        q.diag[col][row] += ee[row][col];
      }
      p.below[col][row] -= ee[row][col];
    }
    p.diag[col][3] -= et[col];
    p.below[3][col] += et[col];
  }
  p.diag[3][3] += c.hessian_tt;
}

}   // namespace

void ClampJoints::add(const ChainRange& range, RodEvaluation& sum)
{
  const int n = range.arrays.nodes;
  for (ClampJoint& c : joints)
    if (const int newest = std::max(c.edge, (c.edge + 1) % n); newest >= range.from && newest < range.to)
      evaluate(c, range, sum);
}

void ClampJoints::accept()
{
  for (ClampJoint& c : joints)
  {
    c.base_t = c.t;
    c.base_d1 = c.d1;
    c.base_twist = c.twist;
    c.turn = 0.0;
  }
}

void ClampJoints::evaluate(ClampJoint& c, const ChainRange& range, RodEvaluation& sum) const
{
  const HalfJoint joint = halfJoint(c, range.arrays);
  const JointStrains<double> strains = jointStrains(joint.frames);
  c.kappa1 = strains.kappa1;
  c.kappa2 = strains.kappa2;
  JointGradient<double> g;
  JointHessian<double> h;
  const bool with_hessian = range.panels;
  respond(c, curvature_, joint.frames, strains, with_hessian, g, h);
  sum.bend_twist += c.energy;
  sum.min_chi = std::min(sum.min_chi, 1.0 / strains.inverse_chi);
  addGradient(joint, g, range.arrays, c);
  if (with_hessian)
    addHessian(joint, h, range.panel(joint.edge), range.panel(joint.next), c);
}

}   // namespace slender
