#include "meeting.h"

#include <limits>

#include "contact/contact_potential.h"
#include "slender_sim/contact/solids.h"

namespace slender {

namespace {

/// The part of a surface that is of two objects, which may be one. `self`: they meet themselves.
ContactSurface piecesOf(const ContactSurface& all, int a, int b, bool self)
{
  ContactSurface result;
  result.points = all.points;
  result.objects = all.objects;
  for (ContactObject& object : result.objects)
    object.self = object.self && self;
  for (const ContactSegment& segment : all.segments)
    if (segment.object == a || segment.object == b)
      result.segments.push_back(segment);
  for (const ContactTriangle& triangle : all.triangles)
    if (triangle.object == a || triangle.object == b)
      result.triangles.push_back(triangle);
  return result;
}

}   // namespace

void Meeting::add(const std::string& name, const Eigen::Matrix3Xd& points)
{
  objects.push_back(name);
  x.conservativeResize(3, x.cols() + points.cols());
  x.rightCols(points.cols()) = points;
}

void Meeting::addSolid(const std::string& name, const ContactSolid& solid, const Pose& pose)
{
  solids.push_back(name);
  surface.solids.push_back(solid);
  poses.push_back(pose);
}

std::vector<BoundingBox> Meeting::boxes() const
{
  std::vector<BoundingBox> result(objects.size(), BoundingBox::empty());
  const auto add = [&](int object, int point, double radius) {
    BoundingBox ball = BoundingBox::empty();
    ball.include(x.col(point));
    ball.enlarge(radius);
    result[object].include(ball);
  };
  for (const ContactSegment& segment : surface.segments)
    for (const int point : {segment.a, segment.b})
      add(segment.object, point, segment.radius);
  for (const ContactTriangle& triangle : surface.triangles)
    for (const int point : triangle.corner)
      add(triangle.object, point, triangle.half_thickness);
  return result;
}

/// Smallest distance between the surfaces of an object and a solid, up to the gap [m].
double Meeting::room(int object, int solid, const ContactOptions& options) const
{
  ContactSurface pieces = piecesOf(surface, object, object, false);
  pieces.solids = {surface.solids[solid]};
  return ContactPotential(std::move(pieces), options).clearance(x, {poses[solid]});
}

std::string Meeting::nearest(const ContactOptions& options) const
{
  double least = std::numeric_limits<double>::infinity();
  std::string names;
  const auto note = [&](double room, const std::string& first, const std::string& second) {
    if (room >= least)
      return;
    least = room;
    names = first + " and " + second;
  };
  const auto between = [&](int a, int b, bool self) {
    return ContactPotential(piecesOf(surface, a, b, self), options).clearance(x, {});
  };
  std::vector<BoundingBox> near = boxes();
  for (BoundingBox& box : near)
    box.enlarge(options.gap);
  const int count = static_cast<int>(objects.size());
  for (int a = 0; a < count; ++a)
  {
    note(between(a, a, true), objects[a], "itself");
    for (int b = a + 1; b < count; ++b)
      if (near[a].overlaps(near[b]))
        note(between(a, b, false), objects[a], objects[b]);
    for (std::size_t k = 0; k < solids.size(); ++k)
      note(room(a, static_cast<int>(k), options), objects[a], solids[k]);
  }
  return names;
}

std::vector<Meeting::Near> Meeting::near(int count, const ContactOptions& options) const
{
  std::vector<Near> result;
  const std::vector<BoundingBox> all = boxes();
  for (int k = 0; k < static_cast<int>(solids.size()); ++k)
  {
    BoundingBox ball = BoundingBox::empty();
    ball.include(poses[k].position);
    ball.enlarge(boundingRadius(surface.solids[k].shape) + options.gap);
    for (int a = 0; a < count; ++a)
      if (all[a].overlaps(ball))
        if (const double distance = room(a, k, options); distance < options.gap)
          result.push_back({a, k, distance});
  }
  return result;
}

}   // namespace slender
