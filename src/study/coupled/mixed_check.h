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

/// Checks a scene of rods with round sections, threads, cloths, simulated bodies and obstacles of all shapes after each
/// step: all pairs but those of two solids that move as prescribed.
class MixedCheck
{
public:
  /// Which faces of cloths, and segments of rods, are checked against solids that move as prescribed. These pass
  /// through pieces with held corners where they press on them (ContactPotential::letPass()).
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
    double radius, whole, start, length;   ///< [m]: that others keep out of; of the tube; along the rod
    bool free;                             ///< checked against solids that move as prescribed
  };
  struct Face
  {
    int object;
    int corner[3];
    double half_thickness;   ///< [m]
    bool free;               ///< checked against solids that move as prescribed
  };
  struct Solid
  {
    std::string name;
    Shape shape;
    Pose pose;
    bool simulated;
  };

  void take(const Simulation& scene);
  void takeThreads(const Simulation& scene);
  void checkSolidPairs(MixedFindings& out) const;
  void checkTubes(MixedFindings& out) const;
  void checkFaces(MixedFindings& out) const;
  void checkSolids(MixedFindings& out) const;
  void checkSides(MixedFindings& out);
  void note(double room, const std::string& a, const std::string& b, MixedFindings& out) const;
  double restScale(const Face& f, const Face& g) const;

  double gap_ = 0.0;
  std::vector<std::string> names_;                       ///< of rods, then of cloths, then of pieces of threads
  std::vector<ContactObject> curves_;                    ///< likewise
  std::vector<Eigen::Matrix3Xd> x_;                      ///< likewise
  std::vector<Eigen::Matrix3Xd> rest_;                   ///< likewise; of rods empty
  std::vector<Tube> tubes_;                              ///< of rods, then of threads
  std::size_t rods_ = 0, objects_ = 0, rod_tubes_ = 0;   ///< objects: rods and cloths
  std::vector<Face> faces_;
  std::vector<Solid> solids_;
  std::vector<std::vector<double>> sides_;   ///< of the step before, see checkSides()
};

}   // namespace slender::study
