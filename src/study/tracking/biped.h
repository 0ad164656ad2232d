#pragma once

#include <optional>
#include <vector>

#include "slender_sim/geometry/triangle_mesh.h"
#include "slender_sim/tracking/guide_binding.h"
#include "walk_angles.h"

namespace slender::study {

/// A walking puppet in the shape of an X (thesis 6.5.4): two sheets of cells, sewn along their outline, skinned over
/// twelve bodies. It stands on z = 0 at the origin and walks along x.
class Biped
{
public:
  /// Cells of `cell` [m]; of 0.02: 3,050 vertices.
  explicit Biped(double cell = 0.02);

  const TriangleMesh& mesh() const { return mesh_; }                     ///< at rest, facing outwards
  const std::vector<int>& bodyOfFace() const { return body_of_face_; }   ///< that moves it, for the most part
  /// vertices [m] at a time [s]; at rest at t <= 0, in full swing from 0.25 s on
  Eigen::Matrix3Xd at(double t) const;
  static constexpr double kPeriod = kWalkPeriod;   ///< of two steps [s]

private:
  std::vector<Pose> poses(double t) const;

  TriangleMesh mesh_;
  std::vector<int> body_of_face_;
  std::optional<GuideBinding> binding_;
};

}   // namespace slender::study
