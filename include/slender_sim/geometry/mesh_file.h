#pragma once

#include <string>
#include <vector>

#include "slender_sim/geometry/triangle_mesh.h"

namespace slender {

/// Reads the vertices and faces of a Wavefront OBJ file [m]. Vertices keep the file's order, used or not; a polygon
/// becomes the fan of triangles about its first vertex; texture coordinates, normals, groups, materials, lines and
/// points are passed over. Throws std::runtime_error "FILE:LINE: reason": not readable, not a number or not finite, a
/// face with fewer than three vertices, with one twice, or with one that the file does not have (later vertices may be
/// named only by absolute indices), no faces at all.
TriangleMesh readObj(const std::string& path);

struct VertexGroup
{
  std::string name;
  std::vector<int> vertices;   ///< from 0, ascending
};

/// The vertices of the faces of each group (`g NAME ...`) of an OBJ file, in the order in which the names first occur;
/// faces before the first one, and those of "default", are in none. Throws as readObj.
std::vector<VertexGroup> readObjGroups(const std::string& path);

/// Reads x, y, z of the element "vertex" and the list vertex_indices (or vertex_index) of the element "face" of a
/// Stanford PLY file [m]: ascii, binary_little_endian or binary_big_endian; order of vertices and polygons as in
/// readObj, other elements and properties are passed over. Throws std::runtime_error "FILE: reason": not readable, a
/// header that is not PLY's or lacks these, the file ends early, and what readObj says of numbers and faces.
TriangleMesh readPly(const std::string& path);

/// By the end of the name: .obj or .ply, in small or capital letters. Throws std::runtime_error for another.
TriangleMesh readMesh(const std::string& path);

/// Reads a binary or ASCII STL file. Coordinates stay in the unit of the file. Corners with the same coordinates become
/// one vertex. Throws std::runtime_error "FILE: reason".
TriangleMesh readStl(const std::string& path);

/// Reads all triangles of a COLLADA (DAE) file and scales them to [m] by the unit that the file gives. The up axis that
/// the file gives is ignored. Throws std::runtime_error "FILE: reason"; builds without assimp always throw.
TriangleMesh readCollada(const std::string& path);

/// Write all vertices in order, with enough digits to read the same doubles back (PLY: binary_little_endian, double).
/// Throw std::runtime_error "FILE: cannot be written".
void writeObj(const std::string& path, const TriangleMesh& mesh);
void writePly(const std::string& path, const TriangleMesh& mesh);

/// A named part of an OBJ file: triangles, or a polyline through vertices (from 0), or both.
struct ObjObject
{
  std::string name;
  TriangleMesh mesh;
  std::vector<int> line;
};

/// Several objects in one file, after a line of comment (line breaks in it become blanks). Digits and errors as above.
void writeObj(const std::string& path, const std::string& comment, const std::vector<ObjObject>& objects);

/// With a colour per vertex (3 x n: red, green, blue in [0, 1]): PLY with uchar red, green, blue, OBJ with three more
/// numbers per vertex. By the end of the name; throws likewise.
void writeColoredMesh(const std::string& path, const TriangleMesh& mesh, const Eigen::Matrix3Xd& colors);

/// Throws what writeMesh would for the end of the name.
void requireMeshName(const std::string& path);

/// By the end of the name, as readMesh.
void writeMesh(const std::string& path, const TriangleMesh& mesh);

}   // namespace slender
