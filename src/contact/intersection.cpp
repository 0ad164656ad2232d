#include "slender_sim/contact/intersection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <tuple>

#include <Eigen/Geometry>

#include "slender_sim/contact/distance.h"
#include "slender_sim/contact/solids.h"

namespace slender {

namespace {

/// A sum of doubles without rounding: components that do not overlap [Shewchuk 1997, grow-expansion].
class ExactSum
{
public:
  void add(double b)
  {
    int n = 0;
    for (int i = 0; i < size_; ++i)
    {
      const double sum = b + part_[i], virtual_b = sum - part_[i];
      const double error = (part_[i] - (sum - virtual_b)) + (b - virtual_b);
      if (error != 0.0)
        part_[n++] = error;
      b = sum;
    }
    if (b != 0.0)
      part_[n++] = b;
    size_ = n;
  }
  void addProduct(double a, double b, double c)
  {
    const double ab = a * b, ab_error = std::fma(a, b, -ab);
    for (const double f : {ab_error, ab})
    {
      const double p = f * c;
      add(std::fma(f, c, -p));
      add(p);
    }
  }
  int sign() const { return size_ == 0 ? 0 : part_[size_ - 1] > 0.0 ? 1 : -1; }   // the largest decides

private:
  double part_[128];
  int size_ = 0;
};

/// Of a, b, c in the plane without coordinate `axis`. Exact.
int orientation2(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, int axis)
{
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const double left = (a[u] - c[u]) * (b[v] - c[v]), right = (a[v] - c[v]) * (b[u] - c[u]);
  if (std::abs(left - right) > 1e-15 * (std::abs(left) + std::abs(right)))   // more than all rounding together
    return left > right ? 1 : -1;
  ExactSum sum;
  const Eigen::Vector3d* p[3] = {&a, &b, &c};
  for (int i = 0; i < 3; ++i)
  {
    const Eigen::Vector3d &s = *p[i], &t = *p[(i + 1) % 3];
    sum.addProduct(s[u], t[v], 1.0);
    sum.addProduct(-s[v], t[u], 1.0);
  }
  return sum.sign();
}

/// Of segments in one line or plane, seen along `axis`.
bool segmentsMeet(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& a,
                  const Eigen::Vector3d& b, int axis)
{
  const int pa = orientation2(p, q, a, axis), pb = orientation2(p, q, b, axis), ap = orientation2(a, b, p, axis),
            aq = orientation2(a, b, q, axis);
  if (pa != 0 || pb != 0 || ap != 0 || aq != 0)
    return pa * pb <= 0 && ap * aq <= 0;
  for (int k = 0; k < 3; ++k)   // in a line
    if (std::max(p[k], q[k]) < std::min(a[k], b[k]) || std::max(a[k], b[k]) < std::min(p[k], q[k]))
      return false;
  return true;
}

bool coplanarMeet(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& a,
                  const Eigen::Vector3d& b, const Eigen::Vector3d& c)
{
  int axis = 0;
  while (axis < 2 && orientation2(a, b, c, axis) == 0)
    ++axis;
  const int turn = orientation2(a, b, c, axis);
  if (turn != 0)
  {
    const auto inside = [&](const Eigen::Vector3d& r) {
      return orientation2(a, b, r, axis) * turn >= 0 && orientation2(b, c, r, axis) * turn >= 0 &&
             orientation2(c, a, r, axis) * turn >= 0;
    };
    return inside(p) || inside(q) || segmentsMeet(p, q, a, b, axis) || segmentsMeet(p, q, b, c, axis) ||
           segmentsMeet(p, q, c, a, axis);
  }
  // A triangle without area: its edges, in any view that tells their line from the segment's.
  const auto meets = [&](const Eigen::Vector3d& s, const Eigen::Vector3d& t) {
    return segmentsMeet(p, q, s, t, 0) && segmentsMeet(p, q, s, t, 1) && segmentsMeet(p, q, s, t, 2);
  };
  return meets(a, b) || meets(b, c) || meets(c, a);
}

}   // namespace

int orientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, const Eigen::Vector3d& d)
{
  const Eigen::Vector3d u = a - d, v = b - d, w = c - d;
  const double volume = u.dot(v.cross(w));
  const double size = u.cwiseAbs().dot(Eigen::Vector3d(std::abs(v.y() * w.z()) + std::abs(v.z() * w.y()),
                                                       std::abs(v.z() * w.x()) + std::abs(v.x() * w.z()),
                                                       std::abs(v.x() * w.y()) + std::abs(v.y() * w.x())));
  if (std::abs(volume) > 2e-15 * size)
    return volume > 0.0 ? 1 : -1;
  for (int k = 0; k < 3; ++k)
    if (u[k] == 0.0 && v[k] == 0.0 && w[k] == 0.0)   // differences of equal numbers only: in a plane
      return 0;
  // |a b c| - |b c d| + |c d a| - |d a b| term by term
  const Eigen::Vector3d* p[4] = {&a, &b, &c, &d};
  ExactSum sum;
  for (int skip = 0; skip < 4; ++skip)
  {
    const Eigen::Vector3d &r = *p[skip == 0 ? 1 : 0], &s = *p[skip <= 1 ? 2 : 1], &t = *p[skip <= 2 ? 3 : 2];
    const double sign = skip % 2 ? 1.0 : -1.0;
    for (int k = 0; k < 3; ++k)
    {
      sum.addProduct(sign * r[k], s[(k + 1) % 3], t[(k + 2) % 3]);
      sum.addProduct(-sign * r[k], s[(k + 2) % 3], t[(k + 1) % 3]);
    }
  }
  return sum.sign();
}

bool segmentMeetsTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& a,
                          const Eigen::Vector3d& b, const Eigen::Vector3d& c)
{
  const int side_p = orientation(a, b, c, p), side_q = orientation(a, b, c, q);
  if (side_p * side_q > 0)
    return false;
  if (side_p == 0 && side_q == 0)
    return coplanarMeet(p, q, a, b, c);
  const int ab = orientation(p, q, a, b), bc = orientation(p, q, b, c), ca = orientation(p, q, c, a);
  return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
}

namespace {

struct Face
{
  std::array<int, 3> v;
  int object;
};
struct Side
{
  int a, b, object;
};

void addFaces(const Eigen::Matrix3Xi& triangles, int first, int object, std::vector<Face>& faces,
              std::vector<Side>& sides)
{
  for (Eigen::Index t = 0; t < triangles.cols(); ++t)
  {
    const std::array<int, 3> v{first + triangles(0, t), first + triangles(1, t), first + triangles(2, t)};
    faces.push_back({v, object});
    for (int k = 0; k < 3; ++k)
      sides.push_back({std::min(v[k], v[(k + 1) % 3]), std::max(v[k], v[(k + 1) % 3]), object});
  }
}

/// Smallest distance of a segment from a convex piece, by golden section of a convex function.
double segmentDepth(const ConvexPiece& piece, const Eigen::Vector3d& a, const Eigen::Vector3d& b)
{
  const Eigen::Vector3d e = b - a;
  const auto distance = [&](double t) { return pieceDistance(piece, a + t * e).distance; };
  double low = 0.0, high = 1.0;
  for (int k = 0; k < 60; ++k)
  {
    const double s = low + (high - low) / 3.0, t = high - (high - low) / 3.0;
    if (distance(s) < distance(t))
      high = t;
    else
      low = s;
  }
  return std::min({distance(0.0), distance(1.0), distance(0.5 * (low + high))});
}

/// The pieces of a surface, all of them in one list each.
class AllPieces
{
public:
  AllPieces(const CollisionSurface& surface, const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids);
  /// Faces of sheets that touch or enter solids that are no meshes.
  void meetSolids(std::vector<Intersection>& out) const;
  /// Edges that meet faces.
  void meetFaces(std::vector<Intersection>& out);

private:
  bool touches(int sheet, std::size_t solid) const;
  bool mayTouch(int a, int b) const;
  double left(const Side& s) const { return std::min(points_[s.a].x(), points_[s.b].x()); }

  const CollisionSurface& surface_;
  const std::vector<Pose>& solids_;
  const int sheets_;
  std::vector<Eigen::Vector3d> points_;   ///< of the sheets, then of the solids that are meshes
  std::vector<Face> faces_;               ///< likewise
  std::size_t sheet_faces_ = 0;
  std::vector<Side> sides_;
};

AllPieces::AllPieces(const CollisionSurface& surface, const Eigen::Matrix3Xd& x, const std::vector<Pose>& solids)
  : surface_(surface),
    solids_(solids),
    sheets_(static_cast<int>(surface.sheets.size()))
{
  for (Eigen::Index i = 0; i < x.cols(); ++i)
    points_.emplace_back(x.col(i));
  for (int s = 0; s < sheets_; ++s)
    addFaces(surface.sheets[s].triangles, 0, s, faces_, sides_);
  sheet_faces_ = faces_.size();
  for (std::size_t k = 0; k < surface.solids.size(); ++k)
    if (const auto* mesh = std::get_if<std::shared_ptr<const TriangleMesh>>(&surface.solids[k].shape))
    {
      const int first = static_cast<int>(points_.size());
      for (Eigen::Index i = 0; i < (*mesh)->vertices.cols(); ++i)
        points_.push_back(solids[k] * Eigen::Vector3d((*mesh)->vertices.col(i)));
      addFaces((*mesh)->triangles, first, sheets_ + static_cast<int>(k), faces_, sides_);
    }
}

bool AllPieces::touches(int sheet, std::size_t solid) const
{
  const std::vector<int>& ignores = surface_.solids[solid].ignores;
  return surface_.sheets[sheet].solids && std::find(ignores.begin(), ignores.end(), sheet) == ignores.end();
}

bool AllPieces::mayTouch(int a, int b) const
{
  if (a >= sheets_ && b >= sheets_)
    return false;
  if (a >= sheets_ || b >= sheets_)
    return touches(std::min(a, b), static_cast<std::size_t>(std::max(a, b) - sheets_));
  return a == b ? surface_.sheets[a].self : surface_.sheets[a].others && surface_.sheets[b].others;
}

/// A shape that is no mesh.
ConvexPiece convexPiece(const Shape& shape)
{
  return std::visit(
      [](const auto& s) -> ConvexPiece {
        if constexpr (std::is_constructible_v<ConvexPiece, decltype(s)>)
          return s;
        else
          throw std::logic_error("a mesh is not convex");
      },
      shape);
}

/// Whether what sticks out of a solid meets the inside of a face, whose corners are in the frame of the solid.
bool meetsInside(const Shape& shape, const std::array<Eigen::Vector3d, 3>& v)
{
  const auto axisMeets = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius) {
    return segmentMeetsTriangle(a, b, v[0], v[1], v[2]) ||
           (radius > 0.0 &&
            std::min(pointTriangleDistance(a, v[0], v[1], v[2]), pointTriangleDistance(b, v[0], v[1], v[2])) <= radius);
  };
  bool meets = false;
  if (const auto* s = std::get_if<Sphere>(&shape))
    meets = axisMeets({0, 0, 0}, {0, 0, 0}, s->radius);
  else if (const auto* c = std::get_if<Capsule>(&shape))
    meets = axisMeets({0, 0, -0.5 * c->length}, {0, 0, 0.5 * c->length}, c->radius);
  else if (const auto* y = std::get_if<Cylinder>(&shape))
    for (int i = 0; i < 64 && !meets; ++i)
    {
      const double angle = 2.0 * M_PI * i / 64, px = y->radius * std::cos(angle), py = y->radius * std::sin(angle);
      meets = axisMeets({px, py, -0.5 * y->length}, {px, py, 0.5 * y->length}, 0.0);
    }
  else if (const auto* b = std::get_if<Box>(&shape))
    for (int i = 0; i < 8 && !meets; ++i)
      for (int axis = 0; axis < 3 && !meets; ++axis)
      {
        const Eigen::Vector3d p =
            0.5 * b->size.cwiseProduct(Eigen::Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
        Eigen::Vector3d q = p;
        q[axis] = -q[axis];
        meets = axisMeets(p, q, 0.0);
      }
  return meets;
}

void AllPieces::meetSolids(std::vector<Intersection>& out) const
{
  for (std::size_t k = 0; k < surface_.solids.size(); ++k)
  {
    const Shape& shape = surface_.solids[k].shape;
    if (std::holds_alternative<std::shared_ptr<const TriangleMesh>>(shape))
      continue;
    const ConvexPiece piece = convexPiece(shape);
    const Pose inverse = solids_[k].inverse();
    for (std::size_t f = 0; f < sheet_faces_; ++f)
    {
      if (!touches(faces_[f].object, k))
        continue;
      std::array<Eigen::Vector3d, 3> v;
      for (int i = 0; i < 3; ++i)
        v[i] = inverse * points_[faces_[f].v[i]];
      bool meets = false;
      for (int i = 0; i < 3 && !meets; ++i)
        meets = segmentDepth(piece, v[i], v[(i + 1) % 3]) <= 0.0;
      if (meets || meetsInside(shape, v))
        out.push_back({{faces_[f].v[0], faces_[f].v[1]}, {-1, -1, static_cast<int>(k)}});
    }
  }
}

/// Sorts the edges along x, and tests each face against those that begin before it ends.
void AllPieces::meetFaces(std::vector<Intersection>& out)
{
  std::sort(sides_.begin(), sides_.end(),
            [](const Side& a, const Side& b) { return std::tie(a.object, a.a, a.b) < std::tie(b.object, b.a, b.b); });
  sides_.erase(
      std::unique(sides_.begin(), sides_.end(),
                  [](const Side& a, const Side& b) { return a.object == b.object && a.a == b.a && a.b == b.b; }),
      sides_.end());
  std::sort(sides_.begin(), sides_.end(), [&](const Side& a, const Side& b) { return left(a) < left(b); });
  double longest = 0.0;
  for (const Side& s : sides_)
    longest = std::max(longest, std::abs(points_[s.a].x() - points_[s.b].x()));
  for (const Face& f : faces_)
  {
    const Eigen::Vector3d &a = points_[f.v[0]], &b = points_[f.v[1]], &c = points_[f.v[2]];
    const Eigen::Vector3d from = a.cwiseMin(b).cwiseMin(c), to = a.cwiseMax(b).cwiseMax(c);
    const auto begin = std::lower_bound(sides_.begin(), sides_.end(), from.x() - longest,
                                        [&](const Side& s, double value) { return left(s) < value; });
    for (auto s = begin; s != sides_.end() && left(*s) <= to.x(); ++s)
    {
      const Eigen::Vector3d &p = points_[s->a], &q = points_[s->b];
      if (p.x() < from.x() && q.x() < from.x())
        continue;
      if ((p.y() < from.y() && q.y() < from.y()) || (p.y() > to.y() && q.y() > to.y()) ||
          (p.z() < from.z() && q.z() < from.z()) || (p.z() > to.z() && q.z() > to.z()))
        continue;
      const bool shared =
          std::find(f.v.begin(), f.v.end(), s->a) != f.v.end() || std::find(f.v.begin(), f.v.end(), s->b) != f.v.end();
      if (!shared && mayTouch(s->object, f.object) && segmentMeetsTriangle(p, q, a, b, c))
        out.push_back({{s->a, s->b}, {f.v[0], f.v[1], f.v[2]}});
    }
  }
}

}   // namespace

std::vector<Intersection> intersections(const CollisionSurface& surface, const Eigen::Matrix3Xd& x,
                                        const std::vector<Pose>& solids)
{
  AllPieces pieces(surface, x, solids);
  std::vector<Intersection> out;
  pieces.meetSolids(out);
  pieces.meetFaces(out);
  return out;
}

}   // namespace slender
