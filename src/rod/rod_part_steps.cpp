// A rod in the substeps of an island.
#include "rod_part.h"

#include "slender_sim/geometry/rotation.h"

namespace slender {

StepFailure RodPart::beginSubstep(const StepPlan& plan, const Substep& substep)
{
  const StepFailure failure = rod_.beginSubstep(plan, substep);
  if (failure != StepFailure::none || !averages_)
    return failure;
  dependent_ = !averages_->prepare(rod_.model->mass, [this](int node) { return system_.isFree(node); });
  return dependent_ ? StepFailure::singular_matrix : StepFailure::none;
}

/// Contacts count from the first step on.
void RodPart::addStartLoads()
{
  if (welds_.empty())
    return;
  RodSystem& system = rod_.system;
  system.setResponse(0.0, nullptr);   // an attempt that failed leaves its viscous response
  for (int i = 0; i < system.nodes(); ++i)
    system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), rod_.load(i));
  system.evaluateWhole(false);
  system.closeGradient();
  forActiveWelds([&](const Weld& weld, const GraspState& g) {
    const BodySystem& body = weld.body->system;
    BodySystem::Vector6 wrench = BodySystem::Vector6::Zero();
    BodySystem::Matrix6 inertia = BodySystem::Matrix6::Zero();
    wrench.tail<3>() += system.clampTorque(weld.grasp);
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const Eigen::Vector3d r = rod_.work.x.col(i) - body.pose.position, w = body.velocity().angular;
      const double m = rod_.model->mass[i];
      const Eigen::Vector3d force =
          -system.nodeGradient(i) - rod_.model->damping(i) * rod_.work.v.col(i) - m * w.cross(w.cross(r));
      wrench.head<3>() += force;
      wrench.tail<3>() += r.cross(force);
      inertia.topLeftCorner<3, 3>() += m * Eigen::Matrix3d::Identity();
      inertia.topRightCorner<3, 3>() -= m * skew(r);
      inertia.bottomLeftCorner<3, 3>() += m * skew(r);
      inertia.bottomRightCorner<3, 3>() -= m * skew(r) * skew(r);
    }
    weld.body->addStartLoad(wrench, inertia);
  });
}

void RodPart::takeStartAcceleration()
{
  forActiveWelds([&](const Weld& weld, const GraspState& g) {
    const BodySystem& body = weld.body->system;
    const BodySystem::Vector6& a = weld.body->startAcceleration();
    for (int i = g.first_node; i <= g.last_node; ++i)
    {
      const Eigen::Vector3d r = rod_.work.x.col(i) - body.pose.position, w = body.velocity().angular;
      rod_.work.a.col(i) = a.head<3>() + a.tail<3>().cross(r) + w.cross(w.cross(r));
    }
  });
}

void RodPart::addSurface(ContactSurface& surface) const
{
  if (!touches_)
    return;
  const RodModel& m = *rod_.model;
  const auto isHeld = [this](int node) { return !dof_.empty() && dof_[4 * node] == kPrescribed; };
  double start = 0.0;
  for (int j = 0; j < m.edges(); ++j)
  {
    ContactSegment s;
    s.a = surface.points + j;
    s.b = surface.points + (j + 1) % m.nodes();
    s.driven = static_cast<unsigned char>(isHeld(j) + 2 * isHeld((j + 1) % m.nodes()));
    s.radius = std::max(m.radius_a[j], m.radius_b[j]);
    s.object = static_cast<int>(surface.objects.size());
    s.start = start;
    s.length = m.rest_length[j];
    start += s.length;
    surface.segments.push_back(s);
  }
  constexpr int kNoThread = -1;
  surface.objects.push_back({contact_, start, m.closed, kNoThread, nullptr, surface.points, ignored_});
  surface.objects.back().turns = turns();
  surface.points += m.nodes();
}

BoundingBox RodPart::surfaceBox(double ahead) const
{
  BoundingBox box = BoundingBox::empty();
  if (!touches_)
    return box;
  for (Eigen::Index i = 0; i < rod_.work.x.cols(); ++i)
    box.include(rod_.work.x.col(i) + ahead * rod_.work.v.col(i));
  box.enlarge(std::max(rod_.model->radius_a.maxCoeff(), rod_.model->radius_b.maxCoeff()));
  return box;
}

/// A contact force that every scene meets: the weight of an edge, or what stops it within the gap in a step.
BarrierRange RodPart::barrierRange(double gap) const
{
  const double step = rod_.time.step;
  BarrierRange range;
  if (touches_)
    range.least = rod_.model->mass.maxCoeff() * std::max(10.0, gap / (step * step));
  return range;
}

void RodPart::beginStage(std::size_t stage)
{
  const Stage& now = rod_.plan->stages[stage];
  rod_.beginStage(stage);
  touched_ = false;
  setCarriedInertia(now);
  followJoints();
  if (!averages_)
    return;
  averages_->forces.setZero();
  averages_->place((rod_.substep.from + now.time * rod_.substep.length) / rod_.duration);
  meetAverages();
}

void RodPart::endStage(std::size_t stage, bool last, StepReport& report)
{
  takeCarriedMotion();
  if (last)
    rod_.finish(report);
  else
    rod_.endStage(stage);
}

double RodPart::energyAtStart(double& allowance)
{
  double own = 0.0;
  const double energy = rod_.startEnergy(&own);
  allowance += own;
  return energy;
}

void RodPart::refuse(StepFailure failure, double length, StepReport& report) const
{
  const char* why = "";
  if (dependent_)
    why =
        "prescribed averages depend on each other on the nodes that are not held: leave some out, or hold fewer nodes";
  else if (averages_ && (welded_ || touched_ || failure == StepFailure::squeezed))
    why =
        "what the rod touches or is welded to may not let it have the averages of its guide: keep the guide clear of "
        "that, or let it move by less at once";
  rod_.refuseUnsolved(report, failure, length, why);
}

}   // namespace slender
