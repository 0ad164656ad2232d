// One implicit Euler step of the thread (thesis 5.3, 5.4): set-up, solution, landing, take-over.
#include <algorithm>
#include <cmath>

#include "slender_sim/dynamics/newton.h"
#include "slender_sim/geometry/rotation.h"
#include "slender_sim/thread/thread_remesh.h"
#include "thread_work.h"

namespace slender {

/// Sets the configuration from which the step's strains are measured. It is the present one, except at the nozzle.
/// There the fluid moves on like a solid plug while the nozzle stands, so the last edge is longer by what flows out,
/// and it is less turned against the nozzle. Returns false if the thread is folded.
bool ThreadWork::loadSystem()
{
  const int n = work.nodes();
  int free = 0;
  while (free < n && work.deposited[free])
    ++free;
  first_ = std::max(0, std::min(free - 3, n - 2));
  offset_ = first_ == 0 && work.ends[0].held ? 1 : 0;
  const int last = lastInSystem();
  system.resize(last + 1 + (work.ends[1].held ? 1 : 0));
  for (int i = first_; i < n; ++i)
  {
    system.setPosition(inSystem(i), work.x[i]);
    system.setTwist(inSystem(i), work.twist[i]);
  }
  for (int j = first_; j + 1 < n; ++j)
    system.setFrame(inSystem(j), work.edge(j).normalized(), work.d1[j]);

  if (offset_)
  {
    const Eigen::Matrix3d section = work.ends[0].X_WE.orientation.toRotationMatrix();
    system.setPosition(0, work.x[0] - section.col(0) * work.edge(0).norm());
    system.setFrame(0, section.col(0), section.col(1));
  }
  if (work.ends[1].held)
  {
    const Eigen::Matrix3d section = work.ends[1].X_WE.orientation.toRotationMatrix();
    const double advance = substep.length * flow_speed_, length = work.edge(n - 2).norm();
    const Eigen::Vector3d end = work.x[n - 1] - advance * section.col(0);
    if (advance > 0)
    {
      // What comes out is not twisted: the middle of the longer edge has less of the twist, and passes the rest on.
      const double shed = work.twist[n - 1] * advance / (length + advance);
      const Eigen::Vector3d t0 = work.edge(n - 2) / length, t = (end - work.x[n - 2]).normalized();
      system.setFrame(last - 1, t, rotateAbout(parallelTransport(work.d1[n - 2], t0, t), t, shed));
      system.setTwist(last, work.twist[n - 1] - shed);
      system.setTwist(last - 1, work.twist[n - 2] + shed);
    }
    system.setPosition(last, end);
    system.setPosition(last + 1, end - section.col(0) * (length + advance));
    system.setFrame(last, -section.col(0), section.col(1));
  }
  return system.takeRestStrains().min_chi > kFoldedChi;
}

/// The part of an edge that is not yet below the floor: on a roll that draws the thread down, the edge between the last
/// node taken up and the first one above stretches only there. So a node stiffens gradually as it comes down, and
/// results do not jump when it arrives.
double ThreadWork::deformingShare(int j) const
{
  constexpr double kLeast = 1e-3;
  if (work.deposited[j] == work.deposited[j + 1])
    return 1.0;
  const int low = work.deposited[j] ? j : j + 1, high = work.deposited[j] ? j + 1 : j;
  const double below = restingHeight(low) - work.x[low].z(), above = work.x[high].z() - restingHeight(high);
  return below > 0 && above > 0 ? std::max(above / (above + below), kLeast) : 1.0;
}

/// Spin of edge j [rad/s] that has the section `area` [m^2] with what flows in. Fluid in the nozzle turns with the
/// nozzle. The angular momenta of both add up. If the fluid came with the spin of the edge, a jet of thin fluid that is
/// drawn out below its nozzle would spin faster and faster.
double ThreadWork::spinWithFed(int j, double area) const
{
  if (flow_speed_ == 0.0 || j + 2 < work.nodes() || !work.ends[1].held)
    return work.spin[j];
  const Eigen::Matrix3d from = work.ends[1].X_WE.orientation.toRotationMatrix(),
                        to = end_poses[1].orientation.toRotationMatrix();
  const Eigen::Vector3d t0 = -from.col(0), t = -to.col(0);
  const double nozzle = signedAngle(parallelTransport(from.col(1), t0, t), to.col(1), t) / substep.length;
  // a moment of inertia is half the mass times r^2, and r^2 is the area over pi
  const double own = work.volume[j] * work.volume[j] / work.edge(j).norm(), fed = fedVolume() * model->nozzleArea();
  return (own * work.spin[j] + fed * nozzle) / (volume(j) * area);
}

/// Viscous stiffnesses over the step (thesis 5.3.2), surface tension, inertia and loads; and what is held.
void ThreadWork::setResponse()
{
  const int n = work.nodes();
  const double mu = model->viscosity, h = substep.length;
  system.setSurfaceTension(model->surface_tension, model->surface_shape);
  // of the edge before the node: solid parts end a joint in a clamped section, whose half of the joint has no length
  double length_before = 0.0, radius_before = 0.0, volume_before = 0.0;
  for (int i = first_; i < n; ++i)
  {
    const int k = inSystem(i);
    double length_after = 0.0, radius_after = 0.0, volume_after = 0.0;
    if (i + 1 < n)
    {
      const double length = system.restLength(k);
      volume_after = volume(i);
      if (isSolid(i))
        system.holdTurn(k);
      else
      {
        const double area = volume_after / length, share = deformingShare(i);
        system.setEdge(k, 3.0 * mu * area / (h * share), volume_after);
        length_after = share * length;
        volume_after *= share;
        radius_after = std::sqrt(area / M_PI);
        system.setSpin(k, 0.5 * model->density * volume_after * radius_after * radius_after / (h * h),
                       h * spinWithFed(i, area));
      }
    }
    const bool has_joint = (i > first_ || offset_) && (i + 1 < n || work.ends[1].held);
    if (has_joint && length_before + length_after > 0)
    {
      const double r = length_before > 0 && length_after > 0 ? 0.5 * (radius_before + radius_after)
                                                             : std::max(radius_before, radius_after);
      const double r4 = M_PI * r * r * r * r / (0.5 * (length_before + length_after));
      system.setJoint(k, 0.75 * mu * r4 / h, 0.5 * mu * r4 / h);
    }
    const double mass = 0.5 * model->density * (volume_before + volume_after);
    const bool held = work.deposited[i] || endHeld(i);
    system.setInertia(k, held ? 0.0 : mass / (h * h), work.x[i] + h * work.v[i], mass * inputs->gravity);
    if (held)
      system.hold(k);
    length_before = length_after;
    radius_before = radius_after;
    volume_before = volume_after;
  }
  if (offset_)
  {
    system.hold(0);
    system.holdTurn(0);
  }
  if (work.ends[1].held)
  {
    system.hold(lastInSystem() + 1);
    system.holdTurn(lastInSystem());
  }
}

/// First trial: motions go on as they were; what is held is where it will be.
void ThreadWork::setTrial()
{
  const int n = work.nodes(), last = lastInSystem();
  const double h = substep.length;
  for (int i = first_; i < n; ++i)
    system.setPosition(inSystem(i), work.x[i] + h * (work.deposited[i] ? inputs->belt_velocity : work.v[i]));
  if (offset_)
  {
    const Eigen::Matrix3d section = end_poses[0].orientation.toRotationMatrix();
    system.setPosition(1, end_poses[0].position);
    system.setPosition(0, end_poses[0].position - section.col(0) * system.restLength(0));
    system.setFrame(0, section.col(0), section.col(1));
  }
  if (work.ends[1].held)
  {
    const Eigen::Matrix3d section = end_poses[1].orientation.toRotationMatrix();
    system.setPosition(last, end_poses[1].position);
    system.setPosition(last + 1, end_poses[1].position - section.col(0) * system.restLength(last));
    system.setFrame(last, -section.col(0), section.col(1));
  }
}

StepFailure ThreadWork::explicitPredict(const Substep& next_substep)
{
  if (const StepFailure failure = beginSubstep(next_substep); failure != StepFailure::none)
    return failure;
  for (int j = first_; j + 1 < work.nodes(); ++j)
    if (!isSolid(j))
      system.setTurn(inSystem(j), substep.length * work.spin[j]);
  stopLanding();
  const RodEvaluation there = system.evaluate(false);
  if (there.min_chi <= kFoldedChi)
    return StepFailure::folded_back;
  return std::isfinite(there.energy()) ? StepFailure::none : StepFailure::state_not_finite;
}

/// Explicit step, second half: the forces change the velocities (symplectic Euler, thesis 4.6.1).
void ThreadWork::push()
{
  const RodArrays& a = system.arrays();
  const double h = substep.length;
  for (int i = first_; i < work.nodes(); ++i)
  {
    const int k = inSystem(i);
    if (!work.deposited[i] && !endHeld(i))
      work.v[i] -= system.nodeGradient(k) / (h * a.weight[k]);
    if (i + 1 < work.nodes() && system.spinWeight(k) > 0)
      work.spin[i] -=
          system.angleGradient(k) / (h * system.spinWeight(k)) * (work.edge(i).norm() / system.restLength(k));
  }
}

/// Height of a node whose section touches the floor.
double ThreadWork::restingHeight(int i) const
{
  if (!model->floor.touches_at_radius)
    return model->floor.height;
  const int last = work.edges() - 1;
  return model->floor.height + 0.5 * (work.radius(std::max(i - 1, 0)) + work.radius(std::min(i, last)));
}

bool ThreadWork::meetsFloor(int i, double& when) const
{
  if (work.deposited[i] || landed[i] || endHeld(i))
    return false;
  const double height = restingHeight(i), above = work.x[i].z() - height,
               after = system.position(inSystem(i)).z() - height;
  if (after >= 0)
    return false;
  when = above > 0 ? above / (above - after) : 0.0;
  return true;
}

double ThreadWork::firstLanding() const
{
  double earliest = 2.0, when = 0.0;
  if (model->floor.sticks())
    for (int i = first_; i < work.nodes(); ++i)
      if (meetsFloor(i, when))
        earliest = std::min(earliest, when);
  return earliest;
}

/// Stops the nodes that go through the floor where they meet it. From there they move with the belt. Nodes that arrive
/// first hold back the others, so the others are looked at again after the next solution.
bool ThreadWork::stopLanding()
{
  constexpr double kTogether = 0.1;   // of the step
  const double earliest = firstLanding();
  if (earliest > 1.0)
    return false;
  double when = 0.0;
  for (int i = first_; i < work.nodes(); ++i)
    if (meetsFloor(i, when) && when <= earliest + kTogether)
    {
      const int k = inSystem(i);
      const Eigen::Vector3d x = work.x[i] + when * (system.position(k) - work.x[i]);
      system.setPosition(k, x + (1.0 - when) * substep.length * inputs->belt_velocity);
      system.hold(k);
      landed[i] = 1;
    }
  return true;
}

void ThreadWork::placeNode(int node, const Eigen::Vector3d& x)
{
  const int k = inSystem(node);
  const int inside = node == 0 && offset_ ? 0 : node + 1 == work.nodes() && work.ends[1].held ? k + 1 : -1;
  if (inside >= 0)
    system.setPosition(inside, system.position(inside) + x - system.position(k));
  system.setPosition(k, x);
}

/// Two nodes that lie on the floor hold up an arch of nodes between them. The arch would creep down for ever, and until
/// it has landed every younger node has to stay in the system. Its nodes are deposited where they are, as soon as all
/// of them are nearer to the floor than a small share of the radius.
void ThreadWork::restBetweenLying()
{
  constexpr double kNear = 0.05;   // share of the radius, far below what matters for the place of a section
  if (!model->floor.sticks())
    return;
  int lying = -1;      // the last node that lies, before an arch
  bool near = false;   // there is one, and all nodes since then are near the floor
  for (int i = first_; i + 1 < work.nodes(); ++i)
    if (!work.deposited[i])
      near = near && work.x[i].z() - restingHeight(i) < kNear * std::min(work.radius(i - 1), work.radius(i));
    else
    {
      for (int k = lying + 1; near && k < i; ++k)
      {
        work.deposited[k] = 1;
        work.v[k] = inputs->belt_velocity;
      }
      lying = i;
      near = true;
    }
}

void ThreadWork::finish()
{
  const int n = work.nodes(), last = lastInSystem();
  const double h = substep.length;
  const RodArrays& a = system.arrays();
  for (int end = 0; end < 2; ++end)
    if (work.ends[end].held && (end == 1 || offset_))
      loads[end] = endLoad(end);
  for (int i = 0; i < n; ++i)
  {
    if (work.deposited[i])
    {
      work.x[i] += h * inputs->belt_velocity;
      work.v[i] = inputs->belt_velocity;
      continue;
    }
    const Eigen::Vector3d x = system.position(inSystem(i));
    work.v[i] = landed[i] ? inputs->belt_velocity : Eigen::Vector3d((x - work.x[i]) / h);
    work.x[i] = x;
    work.deposited[i] = landed[i];
  }
  restBetweenLying();
  for (int j = first_; j + 1 < n; ++j)
  {
    const int k = inSystem(j);
    work.d1[j] = {a.d1[0][k], a.d1[1][k], a.d1[2][k]};
    // the edge turns faster as it is drawn out: its moment of inertia is rho V^2 / (2 pi length)
    work.spin[j] = system.turn(k) / h * (work.edge(j).norm() / system.restLength(k));
  }
  for (int i = std::max(1, first_ + 1); i < n - 1; ++i)
    work.twist[i] = a.twist[inSystem(i)];
  if (offset_)
    work.twist[0] = a.twist[1];
  if (work.ends[1].held)
  {
    work.twist[n - 1] = a.twist[last];
    work.v[n - 1] += flow_speed_ * (end_poses[1].orientation * Eigen::Vector3d::UnitX());
    work.volume[n - 2] += fedVolume();
    work.fed_volume += fedVolume();
  }
  for (int end = 0; end < 2; ++end)
    if (work.ends[end].held)
      work.ends[end].X_WE = end_poses[end];
  if (explicit_step)
    push();
}

Wrench ThreadWork::endLoad(int end) const
{
  const int node = end ? lastInSystem() : 1, inside = end ? node + 1 : 0, edge = end ? node : 0;
  const Eigen::Vector3d at = system.nodeGradient(node), beyond = system.nodeGradient(inside);
  const Eigen::Vector3d arm = system.position(inside) - system.position(node);
  const Eigen::Vector3d tangent = (end ? -1.0 : 1.0) * (end_poses[end].orientation * Eigen::Vector3d::UnitX());
  Wrench load;
  load.force = -(at + beyond);
  load.torque = -arm.cross(beyond) - system.angleGradient(edge) * tangent;
  return load;
}

/// The new node lies where the curve suggests, or on the edge when something is in the way.
void ThreadWork::split(int j, double fraction, const RemeshGuard* guard)
{
  Eigen::Vector3d x = splitPoint(work, j, fraction);
  if (guard)
    if (const Eigen::Vector3d chord = work.x[j] + fraction * work.edge(j); !guard->allows(work, j, j, chord, x))
      x = chord;
  splitEdge(work, j, fraction, x);
}

/// Beyond this length edge j is divided.
double ThreadWork::longestEdge(int j) const
{
  const ThreadLimits& limits = model->limits;
  if (!model->floor.present || limits.edge_grading == 0.0)
    return limits.max_edge_length;
  const double above = 0.5 * (work.x[j].z() + work.x[j + 1].z()) - model->floor.height;
  return std::max(limits.max_edge_length,
                  std::min(limits.highest_edge_length, limits.max_edge_length + limits.edge_grading * above));
}

/// A drop that hangs from a fine nozzle is some capillary lengths wide, whatever the nozzle; all else is not much wider
/// than the nozzle. An edge of a thread that is wider, and wider than it is long, is fluid that piles up between two
/// nodes which cannot move.
int ThreadWork::overgrownEdge() const
{
  constexpr double kWider = 5.0;
  if (model->nozzle_diameter == 0.0)
    return -1;
  const double gravity = inputs->gravity.norm();
  if (model->surface_tension > 0.0 && gravity == 0.0)
    return -1;
  const double capillary =
      model->surface_tension > 0.0 ? std::sqrt(model->surface_tension / (model->density * gravity)) : 0.0;
  const double allowed = kWider * std::max(0.5 * model->nozzle_diameter, capillary);
  for (int j = first_; j < work.edges(); ++j)
    if (!isSolid(j))
      if (const double radius = work.radius(j); radius > allowed && radius > work.edge(j).norm())
        return j;
  return -1;
}

bool ThreadWork::remesh(const RemeshGuard* guard)
{
  constexpr double kMostNew = 1e4;
  const ThreadLimits& limits = model->limits;
  const double feed = model->feed_length;
  const bool at_nozzle = model->nozzle_diameter > 0 && work.ends[1].held;
  double more = at_nozzle ? work.edge(work.edges() - 1).norm() / feed : 0.0;
  for (int j = first_; j < work.edges(); ++j)
    if (!isSolid(j))
      more += std::floor(work.edge(j).norm() / longestEdge(j));
  if (!(more < kMostNew))
    return false;
  if (at_nozzle)
  {
    // the edge at the nozzle grows from half a feed length to one and a half
    for (double length = work.edge(work.edges() - 1).norm(); length >= 1.5 * feed;
         length = work.edge(work.edges() - 1).norm())
      split(work.edges() - 1, feed / length, guard);
    if (work.edges() > 1 && !work.deposited[work.nodes() - 2] && work.edge(work.edges() - 1).norm() < 0.2 * feed &&
        mayRemove(work, work.nodes() - 2, guard))
      removeNode(work, work.nodes() - 2);
  }
  for (int j = first_; j < work.edges(); ++j)
  {
    if (isSolid(j))
      continue;
    const double length = work.edge(j).norm();
    if (length > longestEdge(j))
      split(j--, 0.5, guard);
  }
  for (int i = first_ + 1; i + 1 < work.nodes(); ++i)
    if (!work.deposited[i] && std::min(work.edge(i - 1).norm(), work.edge(i).norm()) < limits.min_edge_length &&
        (work.x[i + 1] - work.x[i - 1]).norm() < 0.9 * limits.max_edge_length && mayRemove(work, i, guard) &&
        mayJoin(work, i, guard))
      removeNode(work, i--);

  if (work.ends[0].held)
    return true;
  int outside = 0;
  while (outside + 2 < work.nodes() && !limits.scene.contains(work.x[outside]))
    ++outside;
  dropOldest(work, outside, work.left_volume);
  int youngest = work.nodes() - 1;
  while (youngest >= 0 && !work.deposited[youngest])
    --youngest;
  if (youngest > limits.max_deposited)
    dropOldest(work, youngest - limits.max_deposited, work.dropped_volume);
  return true;
}

}   // namespace slender
