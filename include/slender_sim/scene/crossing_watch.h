#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/scene/simulation.h"

namespace slender {

/// Notices rods, threads and cloths without contact that pass through rods, threads, cloths with contact or through
/// simulated bodies. Bodies that are welded to a rod may be inside it. Of a cloth only the edges are
/// checked. Pairs of cloths are not checked, because guides may pass through the cloths that follow them.
///
/// Also notices rods and cloths with contact that are held inside obstacles or driven bodies. Neither of the two can
/// move away. The held points therefore pass through the obstacle; free points do not.
class CrossingWatch
{
public:
  /// The simulation must outlive the watch.
  explicit CrossingWatch(const Simulation& simulation);

  /// Looks at the present state. Call it after a step. Returns a text for each pair that was not found before.
  std::vector<std::string> check();
  /// The pairs at the last check() of which one is held inside the other: "rod 'rope' is held inside obstacle 'table',
  /// node 0 at (0.1, 0, -0.02) m".
  const std::vector<std::string>& heldInside() const { return held_inside_; }

private:
  enum class Kind
  {
    rod,
    thread,
    cloth,
    body
  };
  struct Object
  {
    Kind kind;
    int index;
    std::string name;   ///< "rod 'rope'"
  };
  struct Pair
  {
    int without, other;   ///< objects
  };
  /// Pieces of an object at present: segments with a radius [m].
  struct Pieces
  {
    std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> segments;
    double radius = 0.0;
  };

  /// An obstacle or a driven body, and an object that is held, with its contact.
  struct HeldPair
  {
    int object, obstacle, body;   ///< the obstacle or the body is -1
    double reach, radius;         ///< of points of the object, within which surfaces touch; of the solid [m]
    const std::vector<IgnoredSolid>* ignored;
    bool told = false;
  };

  Pieces piecesOf(const Object& object) const;
  void pairHeld(Kind kind, int index, double reach, const std::vector<IgnoredSolid>& ignored);
  void checkHeld(std::vector<std::string>& found);
  std::vector<int> heldPoints(const Object& object) const;
  bool meets(const Pieces& pieces, const Object& other) const;

  const Simulation& simulation_;
  std::vector<Object> objects_;
  std::vector<Pair> pairs_;   ///< that were not found so far
  std::vector<HeldPair> held_;
  std::vector<std::string> held_inside_;
};

}   // namespace slender
