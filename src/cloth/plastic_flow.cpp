#include "slender_sim/cloth/plastic_flow.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace slender {

PlasticFlow::PlasticFlow(const ClothModel& model) : law_(model.plasticity)
{
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument("cloth '" + model.name + "': plasticity " + why);
  };
  if (!(law_.yield_curvature >= 0))
    refuse("needs a yield curvature of zero or more [1/m]");
  if (!std::isfinite(law_.hardening) || !(law_.creep_time >= 0) || !std::isfinite(law_.creep_time))
    refuse("needs a finite hardening [m] and a creep time of zero or more [s]");
  if (!std::isfinite(law_.yield_curvature))
    return;
  if (model.bending != BendingModel::hinge)
    refuse(std::string("is for hinge bending, not ") + toString(model.bending) + ", which has no rest angles");
  const MeshTopology& t = model.topology;
  const Eigen::VectorXd areas = faceAreas(model.rest), none = Eigen::VectorXd::Zero(t.hingeCount());
  hinges_ = std::make_unique<HingeTerm>(t.hinges, none, none);
  width_.resize(t.hingeCount());
  for (int h = 0; h < t.hingeCount(); ++h)
  {
    const auto faces = t.edge_faces.col(t.hinge_edges[h]);
    const double length = (model.rest.vertices.col(t.hinges(1, h)) - model.rest.vertices.col(t.hinges(0, h))).norm();
    width_[h] = 2.0 * (areas[faces[0]] + areas[faces[1]]) / length;
  }
  x_.assign(4 * model.vertices(), 0.0);
  angles_.assign(hinges_->paddedCount(), 0.0);
}

void PlasticFlow::flow(ClothState& state, double duration)
{
  constexpr double kMostStiffening = 1e3;
  if (!active() || hinges_->count() == 0)
    return;
  toPoints(state.x, x_);
  hinges_->angles(x_.data(), angles_.data());
  const double share = law_.creep_time > 0 ? -std::expm1(-duration / law_.creep_time) : 1.0;
  for (int h = 0; h < hinges_->count(); ++h)
  {
    const double away = std::remainder(angles_[h] - state.rest_angles[h], 2 * M_PI),
                 deviation = std::abs(away) / width_[h];
    if (!(deviation > law_.yield_curvature))
      continue;
    const double flow = share * (deviation - law_.yield_curvature), left = deviation - flow;
    state.rest_angles[h] += std::copysign(flow * width_[h], away);
    const double growth = std::min(std::exp(law_.hardening * flow), deviation * deviation / (left * left));
    state.stiffening[h] = std::clamp(state.stiffening[h] * growth, 1.0 / kMostStiffening, kMostStiffening);
  }
}

}   // namespace slender
