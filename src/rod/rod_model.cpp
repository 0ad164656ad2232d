#include "slender_sim/rod/rod_model.h"

#include <cmath>
#include <stdexcept>

#include "slender_sim/energy/compensated_response.h"
#include "slender_sim/geometry/framed_curve.h"
#include "slender_sim/geometry/rotation.h"
#include "slender_sim/rod/rod_system.h"

namespace slender {

namespace {

void requirePositive(double value, const char* what, int edge)
{
  if (!(value > 0) || !std::isfinite(value))
    throw std::invalid_argument(what + (" of edge " + std::to_string(edge)) + " must be positive and finite, got " +
                                std::to_string(value));
}

void checkSections(const std::vector<RodSection>& sections, int edges)
{
  if (static_cast<int>(sections.size()) != edges)
    throw std::invalid_argument("expected " + std::to_string(edges) + " cross-sections, one per edge, got " +
                                std::to_string(sections.size()));
  for (int j = 0; j < edges; ++j)
  {
    const RodSection& s = sections[j];
    requirePositive(s.a, "semi-axis a", j);
    requirePositive(s.b, "semi-axis b", j);
    requirePositive(s.linear_density, "linear density", j);
    requirePositive(s.stretch_modulus, "stretch modulus", j);
    requirePositive(s.twist_modulus, "twist modulus", j);
    requirePositive(s.bend_modulus(0, 0), "bend modulus B11", j);
    requirePositive(s.bend_modulus.determinant(), "determinant of the bend modulus", j);
    if (std::abs(s.bend_modulus(0, 1) - s.bend_modulus(1, 0)) > 1e-9 * s.bend_modulus.norm())
      throw std::invalid_argument("bend modulus of edge " + std::to_string(j) + " must be symmetric, got " +
                                  std::to_string(s.bend_modulus(0, 1)) + " and " +
                                  std::to_string(s.bend_modulus(1, 0)));
  }
}

/// A curvature of the thesis (3.14) between edges twisted by m as the compensated strain; it does not depend on the
/// rest of the joint.
Eigen::Vector2d compensatedCurvature(const Eigen::Vector2d& kappa, double m)
{
  const double secant = regularInverse(std::cos(0.5 * m)), cosine = 1.0 / std::hypot(1.0, 0.5 * kappa.norm() * secant);
  return kappa * (cosine * turnOverSine(1.0 - cosine).value * secant);
}

/// See JointOptions::matched_to_arcs.
void matchToArcs(RodModel& model)
{
  const bool tangent = model.curvature == Curvature::tangent;
  for (int i = 0; i < model.nodes(); ++i)
  {
    const Eigen::Vector2d curvature = model.rest_curvature.col(i);
    const double k = curvature.norm(), half = tangent ? std::atan(0.5 * k) : 0.5 * k;   // half the joint's turn
    if (k == 0)
      continue;
    const double across = half / std::tan(half), length = std::sin(half) / half;
    Eigen::Matrix2d bend;
    bend << model.bend_modulus(0, i), model.bend_modulus(1, i), model.bend_modulus(1, i), model.bend_modulus(2, i);
    if (tangent)
    {
      const double along = std::pow(std::cos(half), 2);
      const Eigen::Matrix2d scale =
          across * Eigen::Matrix2d::Identity() + (along - across) / (k * k) * curvature * curvature.transpose();
      bend = scale * bend * scale;
    }
    model.bend_modulus.col(i) << length * bend(0, 0), length * bend(0, 1), length * bend(1, 1);
    model.twist_modulus[i] *= length * across * across;
  }
}

/// d1 of an edge, whether the state has frames or not.
Eigen::Vector3d directorOf(const RodModel& model, const RodState& state, int edge)
{
  if (state.framed())
    return state.d1.col(edge);
  Eigen::Vector3d director = state.director;
  forEachFrame(model, state, [&](int j, const Eigen::Matrix3d& axes) {
    if (j == edge)
      director = axes.col(1);
  });
  return director;
}

}   // namespace

RodModel buildRod(const std::string& name, const Eigen::Matrix3Xd& nodes, bool closed,
                  const std::vector<RodSection>& sections, const Eigen::Vector3d& director, bool naturally_straight,
                  const JointOptions& joints)
{
  const int n = static_cast<int>(nodes.cols());
  if (n < (closed ? 5 : 3))
    throw std::invalid_argument("rod '" + name + "' needs at least " + (closed ? "5" : "3") + " nodes, got " +
                                std::to_string(n));
  if (!nodes.allFinite())
    throw std::invalid_argument("rod '" + name + "' has a node that is not finite");
  if (naturally_straight && joints.matched_to_arcs)
    throw std::invalid_argument("rod '" + name +
                                "' is naturally straight: it has no arcs that its joints could be matched to");
  const FramedCurve curve(nodes, closed, director);
  const int edges = curve.edges();
  checkSections(sections, edges);

  RodModel model;
  model.name = name;
  model.closed = closed;
  model.curvature = joints.curvature;
  model.mass = Eigen::VectorXd::Zero(n);
  model.spin_inertia.resize(edges);
  model.rest_length.resize(edges);
  model.stretch_modulus.resize(edges);
  model.radius_a.resize(edges);
  model.radius_b.resize(edges);
  model.bend_modulus = Eigen::Matrix3Xd::Zero(3, n);
  model.twist_modulus = Eigen::VectorXd::Zero(n);
  model.rest_curvature = Eigen::Matrix2Xd::Zero(2, n);
  model.rest_twist = Eigen::VectorXd::Zero(n);

  for (int j = 0; j < edges; ++j)
  {
    const RodSection& s = sections[j];
    const double length = (nodes.col((j + 1) % n) - nodes.col(j)).norm();
    model.rest_length[j] = length;
    model.stretch_modulus[j] = s.stretch_modulus;
    model.radius_a[j] = s.a;
    model.radius_b[j] = s.b;
    model.mass[j] += 0.5 * s.linear_density * length;
    model.spin_inertia[j] = 0.25 * s.linear_density * length * (s.a * s.a + s.b * s.b);
    model.mass[(j + 1) % n] += 0.5 * s.linear_density * length;
  }
  for (int i = 0; i < n; ++i)
  {
    // The stiffness of a joint is the length-weighted mean of its two edges'; an end has only one.
    const int e = closed ? (i + edges - 1) % edges : std::max(i - 1, 0), f = closed ? i : std::min(i, edges - 1);
    const double share = model.rest_length[e] / (model.rest_length[e] + model.rest_length[f]);
    const Eigen::Matrix2d b = share * sections[e].bend_modulus + (1 - share) * sections[f].bend_modulus;
    model.bend_modulus.col(i) << b(0, 0), 0.5 * (b(0, 1) + b(1, 0)), b(1, 1);
    model.twist_modulus[i] = share * sections[e].twist_modulus + (1 - share) * sections[f].twist_modulus;
    if (curve.hasJoint(i))
    {
      if (!naturally_straight)
      {
        const Eigen::Vector2d kappa = curve.materialCurvature(i);
        model.rest_curvature.col(i) =
            joints.curvature == Curvature::tangent ? kappa : compensatedCurvature(kappa, curve.twist(i));
      }
      model.rest_twist[i] = curve.twist(i);
    }
  }
  if (!closed)
  {
    // The ends carry the rest curvature of their half edge, continued from the next joint; clamps use it.
    const auto continued = [&](int end, int joint, int edge) {
      const double l = 0.5 * (model.rest_length[joint - 1] + model.rest_length[joint]);
      model.rest_curvature.col(end) = model.rest_curvature.col(joint) * (0.5 * model.rest_length[edge] / l);
    };
    continued(0, 1, 0);
    continued(n - 1, n - 2, edges - 1);
  }
  if (joints.matched_to_arcs)
    matchToArcs(model);
  return model;
}

std::string whyNotIsotropic(const RodModel& model)
{
  for (int i = 0; i < model.nodes(); ++i)
  {
    const std::string at = " at node " + std::to_string(i);
    const Eigen::Vector3d b = model.bend_modulus.col(i);
    if (model.rest_curvature.col(i).norm() > 1e-9)   // round-off of a straight line's nodes
      return "it is naturally curved" + at + " (naturally_straight: true makes it straight)";
    if (std::abs(b[0] - b[2]) > 1e-9 * (b[0] + b[2]) || std::abs(b[1]) > 1e-9 * (b[0] + b[2]))
      return "its bending modulus depends on the direction" + at;
  }
  if (model.stiffness_damping > 0)
    return "it has damping.stiffness";
  if (model.curvature != Curvature::tangent)
    return "it has curvature: compensated (leave curvature out)";
  return "";
}

RodState makeRodState(const RodModel& model, const Eigen::Matrix3Xd& nodes, const Eigen::Vector3d& director,
                      double total_twist)
{
  if (nodes.cols() != model.nodes())
    throw std::invalid_argument("rod '" + model.name + "' has " + std::to_string(model.nodes()) + " nodes, got " +
                                std::to_string(nodes.cols()));
  if (!nodes.allFinite() || !std::isfinite(total_twist))
    throw std::invalid_argument("rod '" + model.name + "': a node or the total twist is not finite");
  if (model.closed && std::abs(std::remainder(total_twist, 2 * M_PI)) > 1e-6)
    throw std::invalid_argument(
        "rod '" + model.name +
        "': the frames of a closed rod meet again only after whole turns; its total twist must be a multiple of 2 pi, "
        "got " +
        std::to_string(total_twist) +
        " (a loop glued at another angle has that angle as natural twist: see addNaturalTwist)");
  const int n = model.nodes(), edges = model.edges();
  RodState state;
  state.x = nodes;
  state.v = Eigen::Matrix3Xd::Zero(3, n);
  if (doesWithoutFrames(model) && total_twist == 0.0)
  {
    state.director = firstDirector(nodes, model.closed, director);
    return state;
  }
  FramedCurve curve(nodes, model.closed, director);
  const int joints = model.closed ? n : n - 2;
  for (int j = 0; j < edges; ++j)
    curve.theta[j] = total_twist * j / joints;
  state.d1.resize(3, edges);
  state.twist = Eigen::VectorXd::Zero(n);
  for (int j = 0; j < edges; ++j)
    state.d1.col(j) = curve.d1(j);
  for (int i = 0; i < n; ++i)
    state.twist[i] = curve.twist(i);
  if (model.closed)
    state.twist[0] += total_twist;   // the turns closed into the loop: frames alone do not show them
  return state;
}

double shareOfEdge(const RodModel& model, int node, int side)
{
  const int n = model.nodes(), edges = model.edges();
  if (!model.closed && (node == 0 || node == n - 1))
    return 1.0;
  const double before = model.rest_length[(node + edges - 1) % edges], after = model.rest_length[node];
  return (side ? after : before) / (before + after);
}

bool doesWithoutFrames(const RodModel& model)
{
  // round-off of a straight line's frames
  return model.isotropic && !model.closed && model.rest_twist.cwiseAbs().maxCoeff() < 1e-9;
}

bool framesFit(const RodModel& model, const RodState& state)
{
  if (state.framed())
    return state.d1.cols() == model.edges() && state.twist.size() == model.nodes();
  const Eigen::Vector3d t = (state.x.col(1) - state.x.col(0)).normalized();
  return state.twist.size() == 0 && std::abs(t.cross(state.director).norm() - 1.0) < 1e-3;
}

void addFrames(const RodModel& model, RodState& state)
{
  if (state.framed())
    return;
  Eigen::Matrix3Xd d1(3, model.edges());
  forEachFrame(model, state, [&](int edge, const Eigen::Matrix3d& axes) { d1.col(edge) = axes.col(1); });
  state.d1 = std::move(d1);
  state.twist = Eigen::VectorXd::Zero(model.nodes());
}

Eigen::Matrix3d sectionFrame(const RodModel& model, const RodState& state, int node)
{
  const int n = model.nodes(), edges = model.edges();
  const auto tangent = [&](int j) { return Eigen::Vector3d((state.x.col((j + 1) % n) - state.x.col(j)).normalized()); };
  Eigen::Vector3d t, d1;
  if (!model.closed && (node == 0 || node == n - 1))
  {
    // Half the rest turn and twist back from the end edge: curvature (kappa1, kappa2) turns t about kappa b = kappa1 d2
    // - kappa2 d1, with the directors half way of the twist.
    const int edge = node == 0 ? 0 : edges - 1;
    const double side = node == 0 ? -1.0 : 1.0, m = model.rest_twist[node];
    const Eigen::Vector3d te = tangent(edge), d1e = directorOf(model, state, edge);
    const Eigen::Vector3d d1h = m == 0.0 ? d1e : rotateAbout(d1e, te, 0.5 * side * m), d2h = te.cross(d1h);
    const bool tangents = model.curvature == Curvature::tangent;
    const Eigen::Vector2d k = model.rest_curvature.col(node) / (tangents ? std::cos(0.5 * m) : 1.0);
    const Eigen::Vector3d kb = k[0] * d2h - k[1] * d1h;
    const double angle = (tangents ? 2.0 * std::atan(0.5 * kb.norm()) : kb.norm()) * side;
    const Eigen::Vector3d axis = kb.norm() > 0 ? Eigen::Vector3d(kb.normalized()) : d1h;
    t = rotateAbout(te, axis, angle);
    d1 = rotateAbout(rotateAbout(d1e, axis, angle), t, side * m);
  }
  else
  {
    // between the middles of the two edges, where the node is: the turn and the twist are shared in proportion to their
    // lengths
    const int e = (node + edges - 1) % edges, f = node;
    const Eigen::Vector3d te = tangent(e), tf = tangent(f);
    const double share = shareOfEdge(model, node, 0);
    const Eigen::Vector3d kb = te.cross(tf);
    t = kb.norm() > 0 ? rotateAbout(te, kb.normalized(), share * std::atan2(kb.norm(), te.dot(tf))).normalized() : te;
    d1 = rotateAbout(parallelTransport(directorOf(model, state, e), te, t), t, share * state.twistAt(node));
  }
  d1 = (d1 - d1.dot(t) * t).normalized();
  Eigen::Matrix3d frame;
  frame << t, d1, t.cross(d1);
  return frame;
}

Pose sectionPose(const RodModel& model, const RodState& state, int node)
{
  return {state.x.col(node), Eigen::Quaterniond(sectionFrame(model, state, node)).normalized()};
}

GraspState makeGrasp(const RodModel& model, const RodState& state, int first_node, int last_node, bool holds_frame)
{
  const int n = model.nodes();
  if (first_node < 0 || last_node < first_node || last_node >= n)
    throw std::invalid_argument("rod '" + model.name + "': held nodes " + std::to_string(first_node) + ".." +
                                std::to_string(last_node) + " must lie in 0.." + std::to_string(n - 1));
  if (!holds_frame && first_node != last_node)
    throw std::invalid_argument("rod '" + model.name + "': a point pin holds one node, not " +
                                std::to_string(last_node - first_node + 1));
  if (!state.framed() && last_node > first_node)   // all at once instead of edge by edge
  {
    RodState framed = state;
    addFrames(model, framed);
    return makeGrasp(model, framed, first_node, last_node, holds_frame);
  }
  GraspState g;
  g.first_node = first_node;
  g.last_node = last_node;
  g.holds_frame = holds_frame;
  // origin half way along the held part; axes of the section there
  const int held = last_node - first_node;
  if (held % 2 == 0)
  {
    g.X_WG = sectionPose(model, state, first_node + held / 2);
  }
  else
  {
    const int edge = first_node + held / 2;
    g.X_WG.position = 0.5 * (state.x.col(edge) + state.x.col(edge + 1));
    Eigen::Matrix3d frame;
    const Eigen::Vector3d t = (state.x.col(edge + 1) - state.x.col(edge)).normalized();
    frame << t, directorOf(model, state, edge), t.cross(directorOf(model, state, edge));
    g.X_WG.orientation = Eigen::Quaterniond(frame).normalized();
  }
  const Pose X_GW = g.X_WG.inverse();
  for (int i = first_node; i <= last_node; ++i)
    g.nodes_G.push_back(X_GW * Eigen::Vector3d(state.x.col(i)));
  for (int j = first_node; j < last_node; ++j)
    g.directors_G.push_back(X_GW.orientation * Eigen::Vector3d(directorOf(model, state, j)));
  for (int side = 0; side < 2; ++side)
  {
    const int node = side ? last_node : first_node;
    const Eigen::Matrix3d section = sectionFrame(model, state, node);
    g.section_G[side] = X_GW.orientation.toRotationMatrix() * section;
    const bool free_side = model.closed || (side ? node < n - 1 : node > 0);
    if (!free_side)
      continue;
    const int edge = side ? node : (node + model.edges() - 1) % model.edges();
    const Eigen::Vector3d te = (state.x.col((edge + 1) % n) - state.x.col(edge)).normalized();
    const double angle =
        signedAngle(parallelTransport(section.col(1), section.col(0), te), directorOf(model, state, edge), te);
    const bool end = !model.closed && (node == 0 || node == n - 1);   // whose half joint has its rest twist
    const double expected = end ? model.rest_twist[node] : shareOfEdge(model, node, side) * state.twistAt(node);
    g.section_twist[side] = unwrapNear(side ? angle : -angle, expected);
  }
  return g;
}

}   // namespace slender
