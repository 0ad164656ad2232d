#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace slender {

/// A dead load on a rod: its force keeps its size and its direction in the world wherever the rod moves. At a place
/// between two nodes both nodes bear it in inverse proportion to their distances, as on a straight edge.
struct RodLoadConfig
{
  int node = -1;                    ///< where it acts; -1: at `arc_length`
  double arc_length = 0.0;          ///< [m] along the rest shape from the first node
  Eigen::Vector3d force{0, 0, 0};   ///< [N]
  /// About the tangent of the rod there [N m]: it turns the material frame, and goes along where the tangent turns.
  /// Positive: right-handed about the direction from the first node to the last.
  double torque = 0.0;
};

/// A dead load on a cloth: each of these vertices bears the force, which keeps its size and its direction in the world.
struct ClothLoadConfig
{
  std::vector<int> vertices;        ///< ascending
  Eigen::Vector3d force{0, 0, 0};   ///< on each [N]
};

/// What a load factor multiplies.
enum class FactorScales
{
  all,       ///< gravity and the loads of rods and cloths
  gravity,   ///< gravity alone
  loads,     ///< the loads of rods and cloths alone
};

/// The path of equilibria that is followed while the load factor grows from `from` towards `to`. Steps are equally long
/// along the path, 1/steps of its scale: (to - from) / steps of the factor where nothing moves.
struct PathConfig
{
  double from = 0.0, to = 1.0;
  int steps = 20;
};

/// What `simulate --statics` does (`statics` of a scene).
struct StaticsConfig
{
  std::vector<double> factors;      ///< a stable equilibrium is found at each, one after the other; empty: at 1
  std::optional<PathConfig> path;   ///< instead of factors: equilibria, stable or not, through folds
  FactorScales scales = FactorScales::all;
  /// Size of an imperfection over the sum of the loads that are scaled at factor 1 [-]: forces along the lowest mode of
  /// the first equilibrium.
  double perturbation = 0.0;
  std::optional<double> buckling;   ///< largest factor up to which the critical one is looked for
};

}   // namespace slender
