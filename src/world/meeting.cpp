#include "meeting.h"

#include <algorithm>
#include <limits>

#include "slender_sim/contact/distance.h"
#include "slender_sim/contact/solids.h"

namespace slender {

void Meeting::addSolid(const std::string& name, const ContactSolid& solid, const Pose& pose)
{
  solids.push_back(name);
  surface.solids.push_back(solid);
  poses.push_back(pose);
}

std::string Meeting::nearest(double gap) const
{
  double least = std::numeric_limits<double>::infinity();
  std::string names;
  const auto note = [&](double room, const std::string& first, const std::string& second) {
    if (room < least)
    {
      least = room;
      names = first + " and " + second;
    }
  };
  for (std::size_t p = 0; p < surface.segments.size(); ++p)
  {
    const ContactSegment& a = surface.segments[p];
    const ContactObject& object = surface.objects[a.object];
    for (std::size_t q = p + 1; q < surface.segments.size(); ++q)
    {
      const ContactSegment& b = surface.segments[q];
      const bool same = a.object == b.object;
      if ((a.driven && b.driven) || (same ? !object.self || contactNeighbours(a, b, object, gap)
                                          : !object.others || !surface.objects[b.object].others))
        continue;
      note(segmentDistance(x.col(a.a), x.col(a.b), x.col(b.a), x.col(b.b)) - a.coreRadius() - b.coreRadius(),
           objects[a.object], same ? "itself" : objects[b.object]);
    }
    for (std::size_t k = 0; object.solids && !a.driven && k < surface.solids.size(); ++k)
    {
      const ContactSolid& solid = surface.solids[k];
      const bool meets = (solid.only < 0 || solid.only == object.owner) &&
                         std::find(solid.ignores.begin(), solid.ignores.end(), a.object) == solid.ignores.end();
      if (meets)
        note(distanceToShape(solid.shape, poses[k], x.col(a.a), x.col(a.b)) - a.radius, objects[a.object], solids[k]);
    }
  }
  return names;
}

}   // namespace slender
