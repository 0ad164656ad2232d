#pragma once

#include <Eigen/Core>

namespace slender {

/// First director of the first edge of a curve that framed curves can begin with: `director` across the edge, or any
/// normal if it is zero. x: 3 x n node positions [m]. Throws std::invalid_argument on too few or repeated nodes, an
/// edge folded back, a director along the edge.
Eigen::Vector3d firstDirector(const Eigen::Matrix3Xd& x, bool closed, const Eigen::Vector3d& director);

/// Discrete adapted framed curve in the curve-angle representation (thesis 3.2.2, 3.4): tangents, one space-parallel
/// (Bishop) reference frame per edge (3.18), and one angle per edge that turns the reference frame into the material
/// frame.
///
/// Edge j runs from node j to node j+1 (mod n when closed), joint i sits at node i. Per-joint values of the ends of an
/// open curve are zero.
class FramedCurve
{
public:
  /// x: 3 x n node positions [m]. `director`: reference director of edge 0 (projected; zero: any normal).
  /// Throws std::invalid_argument on repeated nodes or an edge folded back.
  FramedCurve(const Eigen::Matrix3Xd& x, bool closed, const Eigen::Vector3d& director = Eigen::Vector3d::Zero());

  int nodes() const { return closed_ ? edges() : edges() + 1; }
  int edges() const { return static_cast<int>(t_.cols()); }
  const Eigen::Matrix3Xd& tangents() const { return t_; }

  /// Angles theta^j from reference to material frame, per edge [rad].
  Eigen::VectorXd theta;

  /// Returns true if node i joins two edges. The end nodes of an open curve do not.
  bool hasJoint(int i) const { return closed_ || (i > 0 && i + 1 < nodes()); }

  /// Material twist m_i = theta^i - theta^{i-1} [rad]. At node 0 of a closed curve the angle is added by which the
  /// reference frame, carried once round the loop, misses the one it started from: in (-pi, pi].
  double twist(int joint) const;
  /// Curvature binormal (3.13) and material curvature (3.14), both integrated.
  Eigen::Vector3d curvatureBinormal(int joint) const;
  Eigen::Vector2d materialCurvature(int joint) const;
  /// Material directors (3.15).
  Eigen::Vector3d d1(int edge) const;
  Eigen::Vector3d d2(int edge) const;

private:
  int before(int joint) const { return joint > 0 ? joint - 1 : edges() - 1; }

  bool closed_;
  Eigen::Matrix3Xd t_, u_;
  double holonomy_ = 0.0;   // of the loop [rad]; 0 for an open curve
};

}   // namespace slender
