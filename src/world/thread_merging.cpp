#include "thread_merging.h"

namespace slender {

void ThreadMerging::begin(const Eigen::Matrix3Xd& x, const ContactSurface& surface,
                          const std::vector<GridPairs::Pair>& pairs, double gap, double h)
{
  fluids_.assign(surface.objects.size() - parts_.size(), {});
  held_.assign(static_cast<std::size_t>(surface.points), 0);
  for (const ThreadPart* part : parts_)
  {
    const ThreadModel& model = *part->thread().model;
    fluids_.push_back({part->merging() > 0.0, model.surface_tension, model.viscosity});
    for (int i = 0; i < part->points(); ++i)
      held_[static_cast<std::size_t>(part->first_point + i)] = part->thread().isHeld(i);
  }
  merging_.begin(x, surface.segments, fluids_, pairs, held_, gap, h);
}

}   // namespace slender
