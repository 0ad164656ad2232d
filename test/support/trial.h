#pragma once

#include "slender_sim/rod/rod_system.h"
#include "test/support/rods.h"

/// Displaced configurations of a RodSystem in its own unknowns: four per node, position and turn of the edge after it.
namespace slender::test {

/// Trial := state moved by q; held parts are put where the grasps are. Frames are transported from the state.
inline RodEvaluation evaluateAt(RodSystem& system, const RodState& state, const Eigen::VectorXd& q,
                                bool with_hessian = false)
{
  const int n = system.model().nodes(), edges = system.model().edges();
  const RodArrays& a = system.arrays();
  for (int i = 0; i < n; ++i)
  {
    system.setPosition(i, state.x.col(i) + q.segment<3>(4 * i));
    a.turn[i] = i < edges ? q[4 * i + 3] : 0.0;
  }
  if (a.closed)
    for (int i = 1; i <= RodArrays::kHalo; ++i)
    {
      a.turn[-i] = a.turn[((n - i) % n + n) % n];
      a.turn[n - 1 + i] = a.turn[(i - 1) % n];
    }
  std::vector<Pose> poses;
  for (const GraspState& g : state.grasps)
    poses.push_back(g.X_WG);
  system.placeGrasps(poses);
  return system.evaluate(with_hessian);
}

/// Gradient of the last evaluation; unknowns that are held are zero.
inline Eigen::VectorXd gradientOf(const RodSystem& system)
{
  return Eigen::Map<const Eigen::VectorXd>(system.arrays().gradient, 4 * system.model().nodes());
}

/// A direction in which nothing held moves.
inline Eigen::VectorXd freeDirection(const RodSystem& system, const RodState& state, Random& random)
{
  const int n = system.model().nodes();
  Eigen::VectorXd d = random.numbers(4 * n);
  for (int i = 0; i < n; ++i)
    if (!system.isFree(i))
      d.segment<3>(4 * i).setZero();
  for (const GraspState& g : state.grasps)
    for (int j = g.first_node; g.active && j < g.last_node; ++j)
      d[4 * j + 3] = 0.0;
  if (!system.model().closed)
    d[4 * n - 1] = 0.0;
  return d;
}

/// Newton's direction -K^-1 gradient of an evaluation with Hessian at the base. The system stays there.
inline Eigen::VectorXd newtonDirection(RodSystem& system)
{
  const int n = system.model().nodes();
  Eigen::VectorXd base(3 * n), d(4 * n);
  for (int i = 0; i < n; ++i)
    base.segment<3>(3 * i) = system.position(i);
  system.solve();
  system.moveAlong(1.0);
  for (int i = 0; i < n; ++i)
  {
    d.segment<3>(4 * i) = system.position(i) - base.segment<3>(3 * i);
    d[4 * i + 3] = system.arrays().turn[i];
  }
  system.moveAlong(0.0);
  return d;
}

}   // namespace slender::test
