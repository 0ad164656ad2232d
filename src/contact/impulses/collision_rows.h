#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/dynamics/work_budget.h"

namespace slender {

/// A condition n . sum_i w_i y_i >= bound on vectors y of points (positions at the end of a step, or velocities), with
/// friction against departures of the sum from `anchor` across n.
struct CollisionRow
{
  int point[4];
  double weight[4];
  Eigen::Vector3d normal, anchor;
  double bound;
  double push;   ///< share of the bound that only moves pieces apart and causes no friction
  double friction;
  double tolerance;   ///< of the bound
  // set by CollisionRows
  double response[4] = {0, 0, 0, 0};   ///< w_i / m_i
  double mobility = 0.0;               ///< sum of w_i^2 / m_i
  double impulse = 0.0;
  Eigen::Vector3d rubbing = Eigen::Vector3d::Zero();
  int seen = -1;
};

/// Solves rows by projected Gauss-Seidel: impulses that never pull, friction in Coulomb's cone. Rows are visited in
/// their order, and only while points that they act on still move.
class CollisionRows
{
public:
  std::vector<CollisionRow> rows;

  /// Whether any row acts on any of these points.
  bool touch(int first, int count) const;
  /// Everything is forgotten but the memory.
  void clear(int points);
  /// Begins on other vectors y, for which bounds and anchors may have been changed since: a share of all impulses but
  /// pushes is the start.
  void restart(const Eigen::VectorXd& inverse_mass, double share, Eigen::Matrix3Xd& y);
  /// Adds impulses to y until no sweep changes a row by more than its tolerance or 1/200 of the largest miss at first,
  /// or for `sweeps` sweeps, or until the budget is spent. Rows may have been added since the last call.
  void relax(const Eigen::VectorXd& inverse_mass, int sweeps, Eigen::Matrix3Xd& y, WorkBudget& budget);

private:
  std::vector<int> moved_;
  int clock_ = 0;
};

}   // namespace slender
