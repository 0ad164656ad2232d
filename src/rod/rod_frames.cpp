// Material frames at fixed positions: the quasistatic condition dE/dtheta = 0 (thesis 4.3) is a tridiagonal system.
#include <algorithm>
#include <cmath>

#include "slender_sim/rod/rod_system.h"

namespace slender {

double RodSystem::solveFrames()
{
  // Thomas' algorithm on the edge angles; held ones are decoupled. A closed rod's corner is treated by Sherman and
  // Morrison.
  const int edges = a_.edges;
  double* d = a_.theta_diagonal;
  double* off = a_.theta_off;   // off[j] couples edges j and j+1
  for (int j = 0; j < edges; ++j)
    d[j] += spin_;
  for (ClampJoint& c : clamps_.joints)
    d[c.edge] += c.beta * c.scale;
  for (int edge : holds_.turns())
  {
    d[edge] = 1.0;
    off[edge] = 0.0;
    if (edge > 0)
      off[edge - 1] = 0.0;
    else if (model_.closed)
      off[edges - 1] = 0.0;
  }
  const double corner = model_.closed ? off[edges - 1] : 0.0;
  const double gamma = -d[0];
  if (corner != 0.0)
  {
    d[edges - 1] -= corner * corner / gamma;
    d[0] -= gamma;
  }
  double* r = reduced_.data();
  double* u = direction_.data();
  for (int j = 0; j < edges; ++j)
  {
    r[j] = -gradient_[4 * j + 3];
    u[j] = 0.0;
  }
  u[0] = gamma;
  u[edges - 1] = corner;
  // in the measure of the twisting, not of the bending: that may be stiffer by any factor
  const double floor = std::max(1e-3 * *std::max_element(a_.beta, a_.beta + a_.nodes), 1e-12 * shift_theta_);
  for (int j = 0; j < edges; ++j)
  {
    // twisting alone makes the angles' matrix positive; a curved rod's may not be, then the pivot is lifted
    if (d[j] < floor)
      d[j] = floor;
    if (j + 1 < edges)
    {
      const double f = off[j] / d[j];
      d[j + 1] -= f * off[j];
      r[j + 1] -= f * r[j];
      u[j + 1] -= f * u[j];
    }
  }
  for (int j = edges - 1; j >= 0; --j)
  {
    if (j + 1 < edges)
    {
      r[j] -= off[j] * r[j + 1];
      u[j] -= off[j] * u[j + 1];
    }
    r[j] /= d[j];
    u[j] /= d[j];
  }
  if (corner != 0.0)
  {
    const double factor = (r[0] + corner * r[edges - 1] / gamma) / (1.0 + u[0] + corner * u[edges - 1] / gamma);
    for (int j = 0; j < edges; ++j)
      r[j] -= factor * u[j];
  }
  double largest = 0.0;
  for (int j = 0; j < edges; ++j)
  {
    r[j] = std::clamp(r[j], -1.5, 1.5);
    largest = std::max(largest, std::abs(r[j]));
  }
  return largest;
}

void RodSystem::turnFrames()
{
  std::copy_n(reduced_.data(), a_.edges, a_.turn);
  wrapHalo(a_.turn, a_.edges);
}

void RodSystem::storeTurned(RodState& state) const
{
  store(state);
  const double* turn = reduced_.data();
  for (int j = 0; j < a_.edges; ++j)
  {
    const Eigen::Vector3d t = get(a_.t, j), d = state.d1.col(j);
    state.d1.col(j) = (std::cos(turn[j]) * d + std::sin(turn[j]) * t.cross(d)).normalized();
  }
  for (int i = model_.closed ? 0 : 1; i < (model_.closed ? a_.nodes : a_.nodes - 1); ++i)
    state.twist[i] += turn[i] - turn[before(i)];
  for (const ClampJoint& c : clamps_.joints)
    state.grasps[c.grasp].section_twist[c.side] += c.side == 1 ? turn[c.edge] : -turn[c.edge];
}

RodEvaluation RodSystem::relaxFrames()
{
  RodEvaluation result = evaluate(false);
  for (int k = 0; k < 50 && solveFrames() > 1e-10; ++k)
  {
    accept();
    turnFrames();
    result = evaluate(false);
  }
  return result;
}

}   // namespace slender
