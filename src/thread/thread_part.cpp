#include "thread_part.h"

#include <algorithm>

namespace slender {

void ThreadPart::noteEnds()
{
  share_ = 1.0;
  const ThreadState& work = thread_.work;
  end_.resize(static_cast<std::size_t>(points()));
  for (int i = 0; i < points(); ++i)
    end_[i] = nodeOf(i) < 0 ? Eigen::Vector3d(work.x[i] + thread_.substep.length * thread_.inputs->belt_velocity)
                            : system_.position(nodeOf(i));
}

/// Holds the nodes that met the floor. Their prescribed motion leads from the base to the place where they met it.
void ThreadPart::holdMore()
{
  if (!thread_.stopLanding())
    return;
  for (int i = 0; i < points(); ++i)
    if (isHeld(i))
      end_[i] = system_.position(nodeOf(i));
}

bool ThreadPart::numberUnknowns()
{
  const auto count = static_cast<std::size_t>(4 * system_.nodes());
  bool same = dof_.size() == count;
  dof_.resize(count, 0);
  for (std::size_t u = 0; u < count; ++u)
  {
    const bool held = system_.held(static_cast<int>(u));
    same = same && held == (dof_[u] < 0);
    dof_[u] = held ? kPrescribed : 0;
  }
  numberFree();
  return same;
}

void ThreadPart::placeHeld(double fraction)
{
  const double from = thread_.substep.from / thread_.duration, to = thread_.substep.to / thread_.duration;
  share_ = to > from && fraction < to ? std::max(0.0, (fraction - from) / (to - from)) : 1.0;
  for (int i = 0; i < points(); ++i)
    if (isHeld(i))
      thread_.placeNode(i, share_ < 1.0 ? lying(i) : end_[i]);
}

bool ThreadPart::heldMoves(double from, double to) const
{
  for (int i = 0; i < points(); ++i)
  {
    if (from < to && (nodeOf(i) < 0 || isHeld(i)) && end_[i] != thread_.work.x[i])
      return true;
    if (from == to && isHeld(i) && system_.position(nodeOf(i)) != system_.basePosition(nodeOf(i)))
      return true;
  }
  return false;
}

void ThreadPart::retreatHeld(double share)
{
  for (int i = 0; i < points(); ++i)
    if (isHeld(i))
    {
      const Eigen::Vector3d base = system_.basePosition(nodeOf(i));
      thread_.placeNode(i, base + share * (system_.position(nodeOf(i)) - base));
    }
}

void ThreadPart::gather(Eigen::Matrix3Xd& x) const
{
  for (int i = 0; i < points(); ++i)
    x.col(first_point + i) = nodeOf(i) < 0 ? lying(i) : system_.position(nodeOf(i));
}

void ThreadPart::gatherStart(Eigen::Matrix3Xd& x) const
{
  for (int i = 0; i < points(); ++i)
    x.col(first_point + i) = thread_.work.x[i];
}

}   // namespace slender
