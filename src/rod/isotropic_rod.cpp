#include "slender_sim/rod/isotropic_rod.h"

#include <algorithm>
#include <cmath>

#include "slender_sim/dynamics/newton.h"
#include "slender_sim/geometry/rotation.h"

namespace slender {

namespace {

constexpr int kHalo = IsotropicArrays::kHalo;
constexpr int kShortPiece = 8;   ///< edges; less is not worth the correction where pieces meet
/// [rad] < pi: a larger change of twist in one step could be the other way round
constexpr double kCountable = 2.8;

}   // namespace

IsotropicRod::IsotropicRod(const RodModel& model, RodSystem& system) : model_(model), system_(system)
{
  const int n = model.nodes();
  a_.nodes = n;
  a_.edges = model.edges();
  a_.closed = model.closed;
  storage_.reserve(40);
  const auto allocate = [&](double*& p, double fill) {
    storage_.emplace_back(n + 2 * kHalo, fill);
    p = storage_.back().data() + kHalo;
  };
  for (int k = 0; k < 3; ++k)
    for (double** p : {&a_.x[k], &a_.t[k], &a_.before[k], &a_.after[k], &a_.u[k]})
      allocate(*p, 0.0);
  for (double** p : {&a_.strain, &a_.inverse_chi, &a_.bend, &a_.torque, &a_.stretch, &a_.angle})
    allocate(*p, 0.0);
  for (double** p : {&a_.inverse_length, &a_.inverse_rest_length})
    allocate(*p, 1.0);
  gradient_.assign(3 * n, 0.0);
  a_.gradient = gradient_.data();
  for (int j = 0; j < a_.edges; ++j)
    a_.inverse_rest_length[j] = 1.0 / model.rest_length[j];
}

/// Calls f(node) for the joints inside a span.
template <class F>
void IsotropicRod::forJoints(const Span& span, F&& f) const
{
  for (int k = 1; k < span.count; ++k)
    f((span.first + k) % a_.nodes);
  if (span.loop)
    f(span.first);
}

void IsotropicRod::compose()
{
  composition_ = system_.composition();
  const int n = a_.nodes, edges = a_.edges;
  const double *twist_stiffness = system_.twistStiffness(), *rest_twist = system_.restTwist();
  for (int i = 0; i < n; ++i)
  {
    a_.bend[i] = system_.bendStiffness()[i];
    a_.torque[i] = 0.0;
    a_.stretch[i] = i < edges && !model_.inextensible ? model_.stretch_modulus[i] : 0.0;
  }
  a_.stretch[-1] = model_.closed ? a_.stretch[edges - 1] : 0.0;

  const std::vector<ClampJoint>& clamps = system_.clamps();
  clamp_moment_.assign(clamps.size(), 0.0);
  clamp_torque_.assign(clamps.size(), Eigen::Vector3d::Zero());
  spans_.clear();
  if (clamps.empty())
  {
    Span whole;
    whole.count = edges;
    whole.loop = model_.closed;
    spans_.push_back(whole);
  }
  // A span begins behind each held section, and at the start of an open rod before the first of them.
  const auto sectionAfter = [&](int edge) {
    for (int c = 0; c < static_cast<int>(clamps.size()); ++c)
      if (clamps[c].side == 0 && clamps[c].edge == edge)
        return c;
    return -1;
  };
  const auto extend = [&](Span& span) {
    for (int edge = span.first;; edge = (edge + 1) % edges)
    {
      ++span.count;
      span.after = sectionAfter(edge);
      if (span.after >= 0 || (!model_.closed && edge == edges - 1))
        break;
    }
    spans_.push_back(span);
  };
  int first_clamp = -1;
  for (int c = 0; c < static_cast<int>(clamps.size()); ++c)
  {
    if (first_clamp < 0 || clamps[c].node < clamps[first_clamp].node ||
        (clamps[c].node == clamps[first_clamp].node && clamps[c].side == 0))
      first_clamp = c;
    if (clamps[c].side == 1)
    {
      Span span;
      span.first = clamps[c].edge;
      span.before = c;
      extend(span);
    }
  }
  if (!model_.closed && first_clamp >= 0 && clamps[first_clamp].side == 0)
  {
    Span span;
    extend(span);
  }

  for (Span& span : spans_)
  {
    forJoints(span, [&](int i) {
      span.rest += rest_twist[i];
      span.compliance += twist_stiffness[i] > 0 ? 1.0 / twist_stiffness[i] : 0.0;
    });
    for (int c : {span.before, span.after})
      if (c >= 0)
      {
        span.rest += clamps[c].rest_twist;
        span.compliance += 1.0 / clamps[c].beta;
      }
    span.pieces = span.count >= 4 * kShortPiece ? 4 : 1;
    for (int p = 0; p < span.pieces; ++p)
    {
      const int from = span.count * p / span.pieces, to = span.count * (p + 1) / span.pieces;
      span.piece_first[p] = (span.first + from) % edges;
      span.piece_count[p] = to - from;
    }
  }
  old_tangents_.resize(spans_.size());
}

double IsotropicRod::totalTwist(const Span& span, const RodState& state) const
{
  double sum = 0.0;
  forJoints(span, [&](int i) { sum += state.twistAt(i); });
  for (int c : {span.before, span.after})
    if (c >= 0)
      sum += state.grasps[system_.clamps()[c].grasp].section_twist[system_.clamps()[c].side];
  return sum;
}

RodEvaluation IsotropicRod::evaluate(const RodState& state)
{
  system_.compose(state);
  if (composition_ != system_.composition())
    compose();
  for (int i = 0; i < a_.nodes; ++i)
    for (int k = 0; k < 3; ++k)
      a_.x[k][i] = state.x(k, i);
  const IsotropicKernels& kernels = isotropicKernels();
  IsotropicEnergy sum;
  kernels.tangents(a_, sum);
  twist_energy_ = 0.0;
  for (const Span& span : spans_)
  {
    const double moment = span.held() ? (totalTwist(span, state) - span.rest) / span.compliance : 0.0;
    forJoints(span, [&](int i) { a_.torque[i] = moment; });
    for (int c : {span.before, span.after})
      if (c >= 0)
        clamp_moment_[c] = moment;
    twist_energy_ += 0.5 * moment * moment * span.compliance;
  }
  kernels.forces(a_, sum);
  RodEvaluation result;
  result.bend_twist = twist_energy_;
  for (int c = 0; c < static_cast<int>(clamp_moment_.size()); ++c)
    result.bend_twist += evaluateClamp(c, state, sum.min_chi);
  result.bend_twist += sum.bend;
  result.stretch = sum.stretch;
  result.min_chi = sum.min_chi;
  result.max_strain = sum.max_strain;
  return result;
}

/// The half joint of a clamp (see ClampJoint), in the form of the other joints.
double IsotropicRod::evaluateClamp(int index, const RodState& state, double& min_chi)
{
  const ClampJoint& c = system_.clamps()[index];
  const GraspState& g = state.grasps[c.grasp];
  const int j = c.edge, next = (j + 1) % a_.nodes;
  const Eigen::Vector3d section = g.X_WG.orientation * Eigen::Vector3d(g.section_G[c.side].col(0)), t = tangent(j);
  const double cosine = section.dot(t), chi = 1.0 + cosine, sign = c.side == 1 ? 1.0 : -1.0;
  const Eigen::Vector3d b = sign * section.cross(t);
  const Eigen::Vector3d gradient =
      a_.inverse_length[j] * ((-4.0 * c.b11 / (chi * chi)) * (section - cosine * t) + (clamp_moment_[index] / chi) * b);
  for (int k = 0; k < 3; ++k)
  {
    gradient_[3 * j + k] -= gradient[k];
    gradient_[3 * next + k] += gradient[k];
  }
  clamp_torque_[index] = t.cross(gradient) / a_.inverse_length[j] + sign * clamp_moment_[index] * t;
  min_chi = std::min(min_chi, chi);
  return 2.0 * c.b11 * b.squaredNorm() / (chi * chi);
}

Eigen::Vector3d IsotropicRod::clampTorque(int grasp) const
{
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t c = 0; c < clamp_torque_.size(); ++c)
    if (system_.clamps()[c].grasp == grasp)
      sum += clamp_torque_[c];
  return sum;
}

StepFailure IsotropicRod::settle(const RodState& from, const std::vector<Pose>& poses, RodState& to)
{
  const Eigen::Vector3d first_tangent = tangent(0);
  for (std::size_t s = 0; s < spans_.size(); ++s)
    for (int p = 0; p < spans_[s].pieces; ++p)
      old_tangents_[s][p] = tangent(spans_[s].piece_first[p]);
  for (int i = 0; i < a_.nodes; ++i)
    for (int k = 0; k < 3; ++k)
      a_.x[k][i] = to.x(k, i);
  IsotropicEnergy sum;
  isotropicKernels().tangents(a_, sum);
  if (!std::isfinite(sum.max_strain))
    return StepFailure::state_not_finite;
  if (!(sum.min_chi > kFoldedChi))
    return StepFailure::folded_back;
  if (!from.framed())   // no frame is held: no twist, and nothing that frames could do
  {
    const Eigen::Vector3d t = tangent(0), d = parallelTransport(from.director, first_tangent, t);
    to.director = (d - d.dot(t) * t).normalized();
    if (!(1.0 + first_tangent.dot(t) > kFoldedChi))
      return StepFailure::folded_back;
    double inverse_lengths = 0.0;   // infinite if nodes coincide: such an edge has no tangent
    for (int j = 0; j < a_.edges; ++j)
      inverse_lengths += a_.inverse_length[j];
    return to.director.allFinite() && std::isfinite(inverse_lengths) ? StepFailure::none
                                                                     : StepFailure::state_not_finite;
  }
  to.d1.resize(3, a_.edges);
  to.twist = from.twist;
  for (const Span& span : spans_)
    if (const StepFailure failure = settleSpan(span, from, poses, to); failure != StepFailure::none)
      return failure;
  for (int j = 0; j < a_.edges; ++j)
    to.d1.col(j) = director(j);
  for (std::size_t k = 0; k < to.grasps.size(); ++k)
  {
    const GraspState& g = to.grasps[k];
    if (!g.active || !g.holds_frame)
      continue;
    for (int j = g.first_node; j < g.last_node; ++j)
    {
      const Eigen::Vector3d t = tangent(j), d = poses[k].orientation * g.directors_G[j - g.first_node];
      to.d1.col(j) = (d - d.dot(t) * t).normalized();
    }
    releaseTwists(from.grasps[k], to, g);
  }
  // a zero edge has no tangent, and the least of several numbers forgets what is not one
  return to.d1.allFinite() && to.twist.allFinite() ? StepFailure::none : StepFailure::state_not_finite;
}

/// What the joints at the ends of a held part will have when it is released: whole turns live in the sections' twists
/// until then.
void IsotropicRod::releaseTwists(const GraspState& before, RodState& to, const GraspState& g) const
{
  for (int side = 0; side < 2; ++side)
  {
    const int node = side ? g.last_node : g.first_node, e = (node + a_.edges - 1) % a_.edges, f = node;
    if (!model_.closed && (node == 0 || node == a_.nodes - 1))
      continue;
    if (g.first_node == g.last_node)
      to.twist[node] = g.section_twist[0] + g.section_twist[1];
    else   // the rest of the joint is rigid
      to.twist[node] =
          unwrapNear(signedAngle(parallelTransport(to.d1.col(e), tangent(e), tangent(f)), to.d1.col(f), tangent(f)),
                     to.twist[node] + g.section_twist[side] - before.section_twist[side]);
  }
}

IsotropicRod::Section IsotropicRod::sectionOf(int clamp, const RodState& from, const std::vector<Pose>& poses) const
{
  const ClampJoint& joint = system_.clamps()[clamp];
  const GraspState& g = from.grasps[joint.grasp];
  const Eigen::Matrix3d before = g.X_WG.orientation * g.section_G[joint.side];
  const Eigen::Matrix3d now = poses[joint.grasp].orientation * g.section_G[joint.side];
  Section s;
  s.t = now.col(0);
  s.d1 = now.col(1);
  s.turn = signedAngle(parallelTransport(before.col(1), before.col(0), s.t), s.d1, s.t);
  return s;
}

/// Carries the frame along each piece of the span: along the first from the section before it, if there is one. False:
/// an edge has folded back.
bool IsotropicRod::transportFrames(const Span& span, const RodState& from, const Section& start)
{
  const std::size_t index = &span - spans_.data();
  for (int p = 0; p < span.pieces; ++p)
  {
    const int edge = span.piece_first[p];
    const Eigen::Vector3d& before = old_tangents_[index][p];
    const Eigen::Vector3d t = tangent(edge), d = parallelTransport(from.d1.col(edge), before, t);
    if (!(1.0 + before.dot(t) > kFoldedChi))
      return false;
    setDirector(edge, (d - d.dot(t) * t).normalized());
  }
  if (span.before >= 0)
  {
    if (!(1.0 + start.t.dot(tangent(span.first)) > kFoldedChi))
      return false;
    setDirector(span.first, parallelTransport(start.d1, start.t, tangent(span.first)));
  }
  isotropicKernels().transport(a_, span.pieces, span.piece_first, span.piece_count);
  return true;
}

/// How far the pieces' frames lie from the one that is parallel along the whole span.
IsotropicRod::Ahead IsotropicRod::anglesAhead(const Span& span) const
{
  Ahead ahead = {};
  for (int p = 1; p < span.pieces; ++p)
  {
    const int edge = span.piece_first[p], last = (edge + a_.edges - 1) % a_.edges;
    ahead[p] = ahead[p - 1] + signedAngle(parallelTransport(director(last), tangent(last), tangent(edge)),
                                          director(edge), tangent(edge));
  }
  return ahead;
}

/// From the parallel frame to the held one at the span's end, or to its beginning if it is a loop; 0 at a free end.
/// `behind`: the last piece's angle. Nothing: the rod has folded back there.
std::optional<double> IsotropicRod::angleToEnd(const Span& span, const Section& end, double behind) const
{
  const int last = (span.first + span.count - 1) % a_.edges;
  if (span.after >= 0)
  {
    if (!(1.0 + end.t.dot(tangent(last)) > kFoldedChi))
      return std::nullopt;
    return signedAngle(parallelTransport(director(last), tangent(last), end.t), end.d1, end.t) + behind;
  }
  if (span.loop)
    return signedAngle(parallelTransport(director(last), tangent(last), tangent(span.first)), director(span.first),
                       tangent(span.first)) +
           behind;
  return 0.0;
}

double IsotropicRod::setSectionTwist(int clamp, double moment, RodState& to) const
{
  const ClampJoint& joint = system_.clamps()[clamp];
  const double m = joint.rest_twist + moment / joint.beta;
  to.grasps[joint.grasp].section_twist[joint.side] = m;
  return m;
}

/// Gives the joints inside a span their twists under a twisting moment [N m].
void IsotropicRod::shareTwist(const Span& span, double moment, RodState& to) const
{
  const double *twist_stiffness = system_.twistStiffness(), *rest_twist = system_.restTwist();
  if (span.held())
    forJoints(span, [&](int i) {
      if (twist_stiffness[i] > 0)   // else the whole rod is held
        to.twist[i] = rest_twist[i] + moment / twist_stiffness[i];
    });
  else if (span.count > 1 && twist_stiffness[span.first + 1] > 0)   // of an open rod, unless all of it is held
    to.twist.segment(span.first + 1, span.count - 1) =
        Eigen::Map<const Eigen::VectorXd>(rest_twist + span.first + 1, span.count - 1);
}

/// Turns the transported frames by the joints' twists, from the angle phi of the span's first edge on.
void IsotropicRod::turnFrames(const Span& span, double phi, const Ahead& ahead, const RodState& to)
{
  for (int p = 0, k = 0; p < span.pieces; ++p)
    for (int q = 0; q < span.piece_count[p]; ++q, ++k)
    {
      const int edge = (span.first + k) % a_.edges;
      if (k > 0)
        phi += to.twist[edge];
      a_.angle[edge] = phi - ahead[p];
    }
  const int until = std::min(span.first + span.count, a_.edges);
  isotropicKernels().turn(a_, span.first, until);
  if (span.first + span.count > a_.edges)
    isotropicKernels().turn(a_, 0, span.first + span.count - a_.edges);
}

/// The total twist is read off the frame carried along the span from one held section to the other, and counted on from
/// the last one; equilibrium of the frames (thesis 4.3) then shares it out in proportion to the joints' compliances.
StepFailure IsotropicRod::settleSpan(const Span& span, const RodState& from, const std::vector<Pose>& poses,
                                     RodState& to)
{
  const double before = span.held() ? totalTwist(span, from) : span.rest;
  const Section start = span.before >= 0 ? sectionOf(span.before, from, poses) : Section();
  const Section end = span.after >= 0 ? sectionOf(span.after, from, poses) : Section();
  if (!transportFrames(span, from, start))
    return StepFailure::folded_back;
  const Ahead ahead = anglesAhead(span);
  const std::optional<double> angle = angleToEnd(span, end, ahead[span.pieces - 1]);
  if (!angle)
    return StepFailure::folded_back;

  double moment = 0.0, phi = 0.0;
  if (span.held())
  {
    const double expected = span.loop ? before : before + end.turn - start.turn;
    const double total = unwrapNear(*angle, expected);
    if (std::abs(total - expected) > kCountable)
      return StepFailure::turned_too_far;
    moment = (total - span.rest) / span.compliance;
  }
  else
  {
    phi = span.after >= 0 ? *angle - before : 0.0;
  }

  shareTwist(span, moment, to);
  if (span.before >= 0)
    phi += setSectionTwist(span.before, moment, to);
  if (span.after >= 0)
    setSectionTwist(span.after, moment, to);
  turnFrames(span, phi, ahead, to);
  return StepFailure::none;
}

}   // namespace slender
