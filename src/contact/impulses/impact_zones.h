#pragma once

#include <vector>

#include <Eigen/Core>

namespace slender {

/// Points that collide in spite of all impulses, joined to pieces that move rigidly [Provot 1997; Bridson et al. 2002].
/// What moves rigidly by less than a quarter of a turn collides nowhere within itself along the straight lines of its
/// points, whose motion is affine. Nodes: points, then bodies whose motion is prescribed (solids).
class ImpactZones
{
public:
  void clear(int points, int bodies);
  bool empty() const { return joined_ == 0; }

  void join(int a, int b);
  bool together(int a, int b) { return root(a) == root(b); }

  /// Zones in an order that depends on their members only.
  struct Zone
  {
    const int* members;   ///< free points
    int count;
    const int* prescribed;   ///< points without inverse mass and bodies, rising
    int prescribed_count;
  };
  const std::vector<Zone>& zones(const Eigen::VectorXd& inverse_mass);

private:
  int root(int i);

  std::vector<int> parent_, members_, order_;
  std::vector<Zone> zones_;
  int points_ = 0, joined_ = 0;
};

/// Rigid motion with the linear and angular momentum that points at x have by displacements (or velocities) u: linear
/// part at the centre of mass and rotation vector.
struct RigidFit
{
  Eigen::Vector3d center, linear, angular;
  Eigen::Vector3d rate(const Eigen::Vector3d& x) const { return linear + angular.cross(x - center); }
};
RigidFit rigidFit(const int* points, int count, const Eigen::VectorXd& inverse_mass, const Eigen::Matrix3Xd& x,
                  const Eigen::Matrix3Xd& u);

}   // namespace slender
