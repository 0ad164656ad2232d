// A thread in the substeps of an island.
#include <algorithm>

#include "thread_part.h"

namespace slender {

StepFailure ThreadPart::beginSubstep(const StepPlan&, const Substep& substep)
{
  const StepFailure failure = thread_.beginSubstep(substep);
  if (failure == StepFailure::none)
    noteEnds();
  return failure;
}

void ThreadPart::addSurface(ContactSurface& surface) const
{
  if (!touches_)
    return;
  const ThreadState& state = thread_.work;
  ContactSegment s;
  s.object = static_cast<int>(surface.objects.size());
  s.core = merging_ > 0.0 ? merging_ : 1.0;
  for (int j = 0; j < state.edges(); ++j)
  {
    s.a = surface.points + j;
    s.b = surface.points + j + 1;
    s.radius = state.radius(j);
    s.length = state.edge(j).norm();
    s.driven = static_cast<unsigned char>(thread_.isHeld(j) + 2 * thread_.isHeld(j + 1));
    surface.segments.push_back(s);
    s.start += s.length;
  }
  surface.objects.push_back({contact_, s.start, false, owner_});
  surface.objects.back().turns = contact_.friction > 0.0;
  surface.points += state.nodes();
}

BoundingBox ThreadPart::surfaceBox(double ahead) const
{
  const ThreadState& state = thread_.work;
  BoundingBox box = BoundingBox::empty();
  if (!touches_)
    return box;
  double radius = 0.0;
  for (int i = 0; i < state.nodes(); ++i)
    box.include(state.x[i] + ahead * state.v[i]);
  for (int j = 0; j < state.edges(); ++j)
    radius = std::max(radius, state.radius(j));
  box.enlarge(radius);
  return box;
}

/// The barrier is no softer than weights and what stops a node within the gap ask for. It does not become stiffer than
/// a force that would double the length of the thread in a step: where parts are jammed, gaps do not open however stiff
/// the barrier is.
BarrierRange ThreadPart::barrierRange(double gap) const
{
  const double h = thread_.substep.length, duration = thread_.duration, gravity = thread_.inputs->gravity.norm();
  const RodArrays& a = system_.arrays();
  BarrierRange range;
  for (int i = 0; i < a.nodes; ++i)
    range.least = std::max(range.least, a.weight[i] * h * h * std::max(gravity, gap / (duration * duration)));
  double length = 0.0;
  for (int j = 0; j < thread_.work.edges(); ++j)
    length += thread_.work.edge(j).norm();
  range.most = 3.0 * thread_.model->viscosity * thread_.work.totalVolume() / (length * duration);
  return range;
}

/// A shorter substep would hide that all of them are too long, or it would draw the thread out or thicken it bit by
/// bit.
bool ThreadPart::shorterMayHelp(StepFailure failure) const
{
  return failure != StepFailure::overstretched && thread_.overgrownEdge() < 0;
}

double ThreadPart::sharpestFold() const
{
  double cosine = -2.0;
  return thread_.foldedNode(cosine) < 0 ? 1.0 : 1.0 + cosine;
}

/// Takes out the sharpest fold that can be taken out.
bool ThreadPart::mend()
{
  double cosine = -2.0;
  for (int fold = thread_.foldedNode(cosine); fold >= 0; fold = thread_.foldedNode(cosine))
    if (mendFold(thread_.work, fold, guard_))
      return true;
  return false;
}

void ThreadPart::refuse(StepFailure failure, double length, StepReport& report) const
{
  thread_.refuseUnsolved(report, failure, length);
}

}   // namespace slender
