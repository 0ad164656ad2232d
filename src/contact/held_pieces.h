#pragma once

#include <tuple>
#include <vector>

#include "surface_motion.h"

namespace slender {

/// Knows which prescribed solids pass at present through which segments and triangles. These pieces have held corners
/// and free corners. See ContactPotential::letPass(). Memory is reused.
class HeldPieces
{
public:
  /// Takes the pieces of a surface. No solid passes through them until the next update().
  void build(const ContactSurface& surface);
  /// Finds the solids that must pass while held points and solids go from the start of the motion to its end.
  void update(const ContactSurface& surface, const std::vector<SolidPieces>& solids, const SurfaceMotion& motion,
              double gap);
  /// Whether a solid passes through a piece, by the number of the segment or of the triangle.
  bool letPass(int solid, bool triangle, int index) const;

private:
  struct Piece
  {
    bool triangle;
    int index, object;
    double radius;   ///< [m]
    int corners, held;
    int corner[3];   ///< points, the held ones first
  };
  void add(Piece piece, const int* corner, unsigned char driven);
  bool isInTheWay(const Piece& piece, const SolidPieces& solid, const Pose (&to_solid)[2], const SurfaceMotion& motion,
                  double gap);
  double roomOf(const SolidPieces& solid, const Eigen::Vector3d* corner, int corners, double radius, double most);

  std::vector<Piece> pieces_;
  std::vector<std::tuple<int, bool, int>> passing_;   ///< solid, triangle, index; ascending
  std::vector<int> near_;                             ///< triangles of a mesh
};

}   // namespace slender
