#pragma once

#include <memory>

#include "slender_sim/cloth/cloth_model.h"
#include "slender_sim/energy/hinge_term.h"

namespace slender {

/// Plastic flow of a cloth's hinges (thesis 6.4.4). A hinge of rest length e between triangles of area A together has
/// the curvature deviation dk = e / (2A) (theta - rest angle); on a cylinder of radius R with edges along its axis that
/// is its mean curvature, 1/(2R). Where |dk| exceeds the yield curvature, the rest angle moves towards theta until it
/// does no more, and the stiffness grows by exp(eta * flow), flow being what |dk| lost. It grows by less where the
/// hinge's energy would rise otherwise, which takes eta * yield > 2 or a jump far beyond the yield, and within a
/// thousandth and a thousand times the original.
class PlasticFlow
{
public:
  /// Throws std::invalid_argument for plasticity that is not valid, or that the bending model does not have.
  explicit PlasticFlow(const ClothModel& model);

  bool active() const { return hinges_ != nullptr; }

  /// Rest angles and stiffening of the state after `duration` [s] in its present shape. Nothing unless active().
  void flow(ClothState& state, double duration);

private:
  Plasticity law_;
  std::unique_ptr<HingeTerm> hinges_;   ///< for their angles
  Eigen::VectorXd width_;               ///< 2A / e [m]
  PointVector x_;
  AlignedVector<double> angles_;
};

}   // namespace slender
