#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/scene/simulation.h"

namespace slender {

/// Notices rods, threads and cloths without contact that pass through rods, threads, cloths with contact or through
/// simulated bodies. Bodies that are welded to a rod may be inside it. Of a cloth only the edges are
/// checked. Pairs of cloths are not checked, because guides may pass through the cloths that follow them.
class CrossingWatch
{
public:
  /// The simulation must outlive the watch.
  explicit CrossingWatch(const Simulation& simulation);

  /// Looks at the present state. Call it after a step. Returns a text for each pair that was not found before.
  std::vector<std::string> check();

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

  Pieces piecesOf(const Object& object) const;
  bool meets(const Pieces& pieces, const Object& other) const;

  const Simulation& simulation_;
  std::vector<Object> objects_;
  std::vector<Pair> pairs_;   ///< that were not found so far
};

}   // namespace slender
