#pragma once

#include <vector>

#include "slender_sim/energy/chain_term.h"
#include "slender_sim/energy/surface_tension.h"

namespace slender {

/// Surface tension of a thread (thesis 5.4.2): gamma times the lateral surface of its edges, whose volumes are fixed,
/// and the caps of its free ends.
class SurfaceEnergy final : public ChainTerm
{
public:
  /// Of a thread with this number of edges, which have no volume yet; gamma [N/m] >= 0.
  void begin(double gamma, SurfaceShape shape, int edges);
  /// Fluid volume [m^3] of an edge. An edge without volume is the inside of a holder. It has no surface, and the thread
  /// ends before it.
  void setVolume(int edge, double volume) { volume_[edge] = volume; }

  void add(const ChainRange& range, RodEvaluation& sum) override;

private:
  void addEdgePair(int joint, const LengthFunction& area, const ChainRange& range) const;

  double gamma_ = 0.0;
  SurfaceShape shape_ = SurfaceShape::cone;
  std::vector<double> volume_;
};

}   // namespace slender
