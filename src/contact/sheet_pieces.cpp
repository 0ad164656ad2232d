#include "sheet_pieces.h"

#include <algorithm>
#include <tuple>

namespace slender {

namespace {

bool isDriven(const ContactTriangle& triangle, int corner) { return (triangle.driven >> corner & 1) != 0; }

void append(int number, std::array<int, 3>& owned) { *std::find(owned.begin(), owned.end(), -1) = number; }

}   // namespace

void SheetPieces::build(const ContactSurface& surface)
{
  for (auto* list : {&faces, &whole, &corners})
    list->clear();
  points.clear();
  edges.clear();
  elements.clear();
  triangles = static_cast<int>(surface.triangles.size());
  segments = triangles > 0 ? static_cast<int>(surface.segments.size()) : 0;
  if (triangles == 0)
    return;
  number_of_point_.assign(static_cast<std::size_t>(surface.points), -1);
  for (int i = 0; i < segments; ++i)
  {
    const ContactSegment& s = surface.segments[i];
    edges.push_back({s.a, s.b, s.object, s.radius, s.prescribed()});
    Element e{2, {s.a, s.b, s.b}, {-1, -1, -1}, {i, -1, -1}, s.object};
    addPoint(s.a, s.radius, (s.driven & 1) != 0, e);
    addPoint(s.b, s.radius, (s.driven & 2) != 0, e);
    elements.push_back(e);
  }
  const std::size_t first = points.size();
  for (const ContactTriangle& t : surface.triangles)
  {
    Element e{3, t.corner, {-1, -1, -1}, {-1, -1, -1}, t.object};
    for (int k = 0; k < 3; ++k)
      addPoint(t.corner[k], t.half_thickness, isDriven(t, k), e);
    elements.push_back(e);
  }
  findEdges(surface);
  for (std::size_t i = first; i < points.size(); ++i)
    if (!points[i].driven)
      corners.push_back({1, static_cast<int>(i), {points[i].point, -1, -1}, points[i].radius, points[i].object});
  findFaces(surface);
}

/// `owner` owns the point if nobody has owned it so far.
void SheetPieces::addPoint(int point, double radius, bool driven, Element& owner)
{
  int& known = number_of_point_[static_cast<std::size_t>(point)];
  if (known >= 0)
  {
    Point& p = points[static_cast<std::size_t>(known)];
    p.radius = std::max(p.radius, radius);
    p.driven = p.driven || driven;
    return;
  }
  known = static_cast<int>(points.size());
  append(known, owner.point);
  points.push_back({point, owner.object, radius, driven});
}

void SheetPieces::findEdges(const ContactSurface& surface)
{
  sides_.clear();
  for (int i = 0; i < triangles; ++i)
    for (int k = 0; k < 3; ++k)
    {
      const int a = surface.triangles[i].corner[k], b = surface.triangles[i].corner[(k + 1) % 3];
      sides_.push_back({std::min(a, b), std::max(a, b), i, k});
    }
  std::sort(sides_.begin(), sides_.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.triangle, a.side) < std::tie(b.low, b.high, b.triangle, b.side);
  });
  for (std::size_t i = 0; i < sides_.size(); ++i)
  {
    const Side& side = sides_[i];
    const ContactTriangle& t = surface.triangles[side.triangle];
    if (i > 0 && sides_[i - 1].low == side.low && sides_[i - 1].high == side.high)
    {
      edges.back().radius = std::max(edges.back().radius, t.half_thickness);
      continue;
    }
    append(static_cast<int>(edges.size()), elements[segments + side.triangle].edge);
    edges.push_back(
        {side.low, side.high, t.object, t.half_thickness, isDriven(t, side.side) && isDriven(t, (side.side + 1) % 3)});
  }
}

/// A triangle that moves freely with at least one corner is a face. So is an edge, or a corner, that moves freely and
/// is not part of a triangle without driven corners: it remains where solids pass through the triangle.
void SheetPieces::findFaces(const ContactSurface& surface)
{
  covered_.assign(static_cast<std::size_t>(surface.points), 0);
  for (const ContactTriangle& t : surface.triangles)
  {
    const int free = 3 - isDriven(t, 0) - isDriven(t, 1) - isDriven(t, 2);
    if (free >= 2)
      for (int k = 0; k < 3; ++k)
        covered_[t.corner[k]] = 1;
  }
  for (const Face& corner : corners)
    if (!covered_[corner.corner[0]])
      faces.push_back(corner);
  int number = segments;   // of the edge; those of triangles are in the order of sides
  for (std::size_t i = 0; i < sides_.size(); ++number)
  {
    const Side& side = sides_[i];
    bool in_face = false;
    std::size_t j = i;
    for (; j < sides_.size() && sides_[j].low == side.low && sides_[j].high == side.high; ++j)
      in_face = in_face || surface.triangles[sides_[j].triangle].driven == 0;
    const ContactTriangle& t = surface.triangles[side.triangle];
    if (!in_face && !isDriven(t, side.side) && !isDriven(t, (side.side + 1) % 3))
      faces.push_back({2, number, {side.low, side.high, -1}, edges[number].radius, t.object});
    i = j;
  }
  for (int i = 0; i < triangles; ++i)
  {
    const ContactTriangle& t = surface.triangles[i];
    whole.push_back({3, i, t.corner, t.half_thickness, t.object, t.driven});
    if (t.driven != 7)
      faces.push_back(whole.back());
  }
}

}   // namespace slender
