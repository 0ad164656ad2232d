#pragma once

#include <array>
#include <vector>

#include "slender_sim/contact/contact_surface.h"

namespace slender {

/// The edges and corners of a surface's triangles, and which of the pieces a search looks at. Segments are among them,
/// because triangles meet them. Without triangles everything is empty. Memory is reused.
struct SheetPieces
{
  struct Point
  {
    int point, object;
    double radius;   ///< [m] half the thickness of a cloth; radius of a segment
    bool driven;
  };
  struct Edge
  {
    int a, b, object;
    double radius;   ///< [m] as that of a point
    bool driven;
  };
  /// A segment or a triangle, as leaves of a tree. Each point and edge is owned by one element.
  struct Element
  {
    int corners;                      ///< 2 or 3
    std::array<int, 3> corner;        ///< points; of a segment the third is the second one
    std::array<int, 3> point, edge;   ///< numbers of points and edges that it owns; then -1
    int object;
  };
  /// A triangle, or a free edge or corner, as it touches solids.
  struct Face
  {
    int corners;                 ///< 1: a point; 2: an edge; 3: the whole triangle
    int index;                   ///< number of the point, edge or triangle
    std::array<int, 3> corner;   ///< points; -1: unused
    double radius;               ///< [m]
    int object;
    unsigned char driven = 0;   ///< bits of the corners that move as prescribed
  };

  void build(const ContactSurface& surface);
  bool empty() const { return triangles == 0; }
  /// The segment or triangle of an element.
  int triangleOf(int element) const { return element - segments; }

  int segments = 0, triangles = 0;
  std::vector<Point> points;
  std::vector<Edge> edges;         ///< first those that are segments, with the same numbers
  std::vector<Element> elements;   ///< segments, then triangles
  std::vector<Face> faces;         ///< What may touch solids that move as prescribed: in order of corners and index.
  std::vector<Face> whole;         ///< What touches bodies: all triangles.
  std::vector<Face> corners;       ///< All corners of triangles that are not driven: what touches planes.

private:
  struct Side
  {
    int low, high, triangle, side;
  };
  void addPoint(int point, double radius, bool driven, Element& owner);
  void findEdges(const ContactSurface& surface);
  void findFaces(const ContactSurface& surface);

  std::vector<int> number_of_point_;
  std::vector<Side> sides_;
  std::vector<char> covered_;
};

}   // namespace slender
