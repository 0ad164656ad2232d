#pragma once

#include <Eigen/Core>

namespace slender {

/// First director of the first edge of a curve that framed curves can begin with: `director` across the edge, or any
/// normal if it is zero. x: 3 x n node positions [m]. Throws std::invalid_argument on too few or repeated nodes, an
/// edge folded back, a director along the edge.
Eigen::Vector3d firstDirector(const Eigen::Matrix3Xd& x, bool closed, const Eigen::Vector3d& director);

/// Discrete adapted framed curve in the curve-angle representation (thesis 3.2.2, 3.4): positions, one reference frame
/// per edge, and one angle per edge that turns the reference frame into the material frame.
///
/// Edge j runs from node j to node j+1 (mod n when closed), joint i sits at node i. Per-joint arrays have one entry per
/// node; those of the ends of an open curve are zero.
class FramedCurve
{
public:
  /// x: 3 x n node positions [m]. `director`: reference director of edge 0 (projected; zero: any normal).
  /// The reference frame starts space-parallel. Throws std::invalid_argument on repeated nodes or an edge folded back.
  FramedCurve(const Eigen::Matrix3Xd& x, bool closed, const Eigen::Vector3d& director = Eigen::Vector3d::Zero());

  bool closed() const { return closed_; }
  int nodes() const { return static_cast<int>(x_.cols()); }
  int edges() const { return static_cast<int>(t_.cols()); }
  const Eigen::Matrix3Xd& positions() const { return x_; }
  const Eigen::Matrix3Xd& tangents() const { return t_; }

  /// Moves the nodes; reference frames follow by parallel transport in time (3.17) and the reference twist accumulates,
  /// unwrapped, so that any number of full turns survives. Throws std::invalid_argument when a tangent turns over; the
  /// curve then stays.
  void moveTo(const Eigen::Matrix3Xd& x);

  /// Replaces the reference frames by the space-parallel (Bishop) ones (3.18), starting from the present one at edge 0.
  /// Angles are changed so that material frames stay. The reference twist becomes zero (closed: its holonomy stays at
  /// node 0).
  void makeSpaceParallel();

  /// Angles theta^j from reference to material frame, per edge [rad].
  Eigen::VectorXd theta;

  /// Angle from the parallel-transported reference frame of edge i-1 to that of edge i, unwrapped [rad].
  const Eigen::VectorXd& referenceTwist() const { return reference_twist_; }
  /// Material twist m_i = theta^i - theta^{i-1} + reference twist [rad].
  double twist(int joint) const;
  /// Curvature binormal (3.13) and material curvature (3.14), both integrated.
  Eigen::Vector3d curvatureBinormal(int joint) const;
  Eigen::Vector2d materialCurvature(int joint) const;
  /// Material directors (3.15).
  Eigen::Vector3d d1(int edge) const;
  Eigen::Vector3d d2(int edge) const;

  bool hasJoint(int i) const { return closed_ || (i > 0 && i + 1 < nodes()); }

private:
  int before(int joint) const { return joint > 0 ? joint - 1 : edges() - 1; }
  Eigen::Matrix3Xd tangentsOf(const Eigen::Matrix3Xd& x) const;

  bool closed_;
  Eigen::Matrix3Xd x_, t_, u_;
  Eigen::VectorXd reference_twist_;
};

}   // namespace slender
