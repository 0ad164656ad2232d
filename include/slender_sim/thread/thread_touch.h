#pragma once

namespace slender {

/// What one thread touches. Parts that broke off it count as other threads.
struct ThreadTouch
{
  bool self = true, others = true, solids = true;
  double friction = 0.3;   ///< Coulomb [-]
  /// Surface tension draws parts that touch into each other (thesis 5.4.3), until the distance of their centrelines is
  /// this share of the sum of their radii; there they touch. 0: they do not merge. Half discs of one round section have
  /// their centroids at 0.6.
  double merging = 0.0;
};

}   // namespace slender
