#pragma once

#include <vector>

#include "island/island.h"
#include "thread_part.h"

namespace slender {

/// Fluid of one thread, as merging needs it.
struct MergingFluid
{
  bool merges = false;
  double surface_tension = 0.0, viscosity = 0.0;   ///< [N/m], [Pa s]
};

/// Merging of the threads of an island that graze (thesis 5.4.3), per pair of balls of radius r = (r1 + r2)/2 at a
/// distance d
///
///   F = 2 pi gamma r - mu (4 pi/3) rho |d'|,   rho^2 = r^2 - d^2/4,
///
/// with one pair of balls per length 2r of a thread, so that the force per length does not depend on the edges; each
/// node stands for its half edges and meets the nearest places of other strands. These places, with their directions,
/// are those at the start of the step. There the first term is constant and d enters the second at the end of the step:
/// over a step h the potential is
///
///   W(d) = 2 pi gamma r d + (4 pi mu / 3 h) int_d0^d rho(s) (s - d0) ds,
///
/// convex for all d < d0. The attraction sets in over the gap of the contact.
class ThreadMerging : public SubstepPotential
{
public:
  /// The threads. Their objects come behind all others.
  void setParts(const std::vector<ThreadPart*>& parts) { parts_ = parts; }
  void begin(const Eigen::Matrix3Xd& x, const ContactSurface& surface, const std::vector<GridPairs::Pair>& pairs,
             double gap, double h) override;
  /// Finds what merges in a step of h seconds. `pairs`: segments that are near each other; `fluids`: per object;
  /// `held`: per point.
  void begin(const Eigen::Matrix3Xd& x, const std::vector<ContactSegment>& segments,
             const std::vector<MergingFluid>& fluids, const std::vector<GridPairs::Pair>& pairs,
             const std::vector<char>& held, double gap, double h);
  /// Potential [J] and terms(), as ContactPotential::evaluate().
  double evaluate(const Eigen::Matrix3Xd& x, bool with_stiffness) override;
  const std::vector<ContactTerm>& terms() const override { return terms_; }
  double largestForce() const override;

private:
  struct Place
  {
    int point[3];              ///< a node, and the ends of the segment that it meets
    double t;                  ///< where on it
    Eigen::Vector3d normal;    ///< from there to the node
    double start, radius;      ///< d0, r [m]
    double attraction, drag;   ///< 2 pi gamma r [N] and 4 pi mu / 3 h [N/m^2], times the number of pairs of balls
  };
  void meet(const Eigen::Matrix3Xd& x, const std::vector<ContactSegment>& segments,
            const std::vector<MergingFluid>& fluids, int own, bool far_end, int other, double gap, double h);

  std::vector<ThreadPart*> parts_;
  std::vector<MergingFluid> fluids_;   ///< per object
  std::vector<char> held_;             ///< per point
  std::vector<Place> places_;
  std::vector<ContactTerm> terms_;
};

/// int_d0^d rho(s) (s - d0) ds of balls of radius r [m^3].
double mergingWork(double r, double d0, double d);

}   // namespace slender
