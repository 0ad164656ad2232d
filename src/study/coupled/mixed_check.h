#pragma once

#include <string>
#include <vector>

#include "slender_sim/scene/simulation.h"

namespace slender::study {

/// What an independent check of all pairs finds in a state. It shares no search structure, no soft distances and no
/// continuous collision detection with the contact that it checks.
struct MixedFindings
{
  int penetrations = 0;           ///< pairs that intersect, or passed through each other in the step
  int thickness_violations = 0;   ///< pairs that are nearer than their thickness, and do not intersect
  double least_room = 0.0;        ///< least distance of all pairs beyond their thickness [m]
  std::string first;              ///< names of the first pair that is wrong
};

/// Checks a scene of rods with round sections, cloths, simulated bodies and obstacles (spheres, capsules, boxes,
/// planes) after each step.
class MixedCheck
{
public:
  /// Which faces of cloths are checked against solids. Solids that move as prescribed pass through those corners and
  /// edges of faces that are held (contact_potential.h).
  enum class Faces
  {
    all,
    without_held_corners
  };
  /// The scene as it starts.
  explicit MixedCheck(const Simulation& scene, Faces against_solids = Faces::all);
  /// The scene after a step.
  MixedFindings check(const Simulation& scene);

private:
  struct Tube
  {
    int object, a, b;
    double radius, start, length;   ///< [m]; along the rod
  };
  struct Face
  {
    int object;
    int corner[3];
    double half_thickness;   ///< [m]
    bool against_solids;
  };
  /// A solid shape, or the rounded surface of a body.
  struct Solid
  {
    std::string name;
    Shape shape;
    Pose pose;
    bool simulated;
  };

  void take(const Simulation& scene);
  void checkTubes(MixedFindings& out) const;
  void checkFaces(MixedFindings& out) const;
  void checkSolids(MixedFindings& out) const;
  void checkSides(MixedFindings& out);
  void note(double room, const std::string& a, const std::string& b, MixedFindings& out) const;
  double restScale(const Face& f, const Face& g) const;

  double gap_ = 0.0;
  std::vector<std::string> names_;       ///< of rods, then of cloths
  std::vector<Eigen::Matrix3Xd> x_;      ///< likewise
  std::vector<Eigen::Matrix3Xd> rest_;   ///< likewise; of rods empty
  std::vector<Tube> tubes_;
  std::vector<Face> faces_;
  std::vector<Solid> solids_;
  std::vector<std::vector<double>> sides_;   ///< of the step before, see checkSides()
};

}   // namespace slender::study
