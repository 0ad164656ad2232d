#pragma once

#include <vector>

#include "linalg/disjoint_sets.h"
#include "slender_sim/contact/broad_phase.h"

namespace slender {

/// Divides parts into islands: parts belong to the same island where joints connect them, or where their boxes overlap
/// and they may touch. Memory is reused from call to call.
class IslandFinder
{
public:
  /// What a part may touch, and the box that its surface stays in.
  struct Reach
  {
    bool has_points = false;   ///< of a curve or a sheet
    bool others = false;       ///< its points touch points of other parts
    bool solids = false;       ///< its points touch solids
    bool is_solid = false;     ///< a simulated body with a shape
    BoundingBox box;           ///< [m]
    bool mayTouch(const Reach& other) const
    {
      return (others && other.others) || (has_points && solids && other.is_solid) ||
             (other.has_points && other.solids && is_solid);
    }
  };

  /// Begins with this many parts, each of which is an island.
  void begin(int parts) { sets_.begin(parts); }
  void join(int a, int b) { sets_.unite(a, b); }
  /// Joins parts that may touch and whose boxes, enlarged by `margin` [m], overlap. A box that is not finite overlaps
  /// all others. Returns whether parts of different islands were joined.
  bool joinNear(const std::vector<Reach>& parts, double margin);

  /// Number of islands; each is in the order of its first part.
  int find();
  /// Parts of an island in ascending order, after find().
  void partsOf(int island, std::vector<int>& parts) const;

private:
  DisjointSets sets_;
  std::vector<int> order_, island_of_, start_, parts_;
  std::vector<BoundingBox> boxes_;
};

}   // namespace slender
