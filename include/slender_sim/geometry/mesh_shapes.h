#pragma once

#include "slender_sim/geometry/triangle_mesh.h"

namespace slender {

enum class GridPattern
{
  one_diagonal,   ///< right-angled, all diagonals from lower left to upper right
  alternating,    ///< right-angled, diagonals alternate like a chess-board
  equilateral,    ///< every other row shifted by half a cell, its ends at the sides
  irregular       ///< Delaunay, from the equilateral vertices shifted at random
};

const char* toString(GridPattern pattern);

/// Rectangle [0, width] x [0, height] in the plane z = 0, facing +z; `columns` x `rows` cells, vertices row by row.
/// Rows 0: as many as make the cells square (right-angled) or the triangles equilateral, as nearly as whole rows can.
/// The right-angled patterns have (columns + 1) (rows + 1) vertices. `seed` is for irregular. Throws
/// std::invalid_argument naming the bad value: sizes not positive, no columns, irregular with fewer than two columns or
/// rows.
TriangleMesh gridMesh(double width, double height, int columns, int rows, GridPattern pattern, unsigned seed = 1);

/// Disc about the origin in the plane z = 0, facing +z: rings of 6, 12, 18 ... vertices around the middle one.
TriangleMesh discMesh(double radius, int rings);

/// Icosahedron whose faces were divided into four `levels` times, on a sphere about the origin: 10 4^levels + 2
/// vertices.
TriangleMesh icosphere(double radius, int levels);

}   // namespace slender
