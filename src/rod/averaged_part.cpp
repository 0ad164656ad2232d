#include "averaged_part.h"

namespace slender {

/// Moves the trial positions of free nodes by the least sum of mass times distance squared, so that they have the
/// averages.
void AveragedPart::meet()
{
  for (int k = 0; k < 3; ++k)
  {
    for (Eigen::Index i = 0; i < c_.rows(); ++i)
      gap_[i] = at_(k, i) - average(i, system_.arrays().x[k]);
    const Eigen::VectorXd& moved = projection_.displacements(gap_.head(c_.rows()));
    for (int j = 0; j < static_cast<int>(c_.cols()); ++j)
      if (system_.isFree(j))
      {
        Eigen::Vector3d x = system_.position(j);
        x[k] += moved[j];
        system_.setPosition(j, x);
      }
  }
}

void AveragedPart::solve()
{
  system_.solve();
  columns_.setZero();
  for (Eigen::Index i = 0; i < c_.rows(); ++i)
    for (Averages::InnerIterator entry(c_, i); entry; ++entry)
      if (system_.isFree(static_cast<int>(entry.col())))
        for (int k = 0; k < 3; ++k)
          columns_(4 * entry.col() + k, 3 * i + k) = entry.value();
  for (Eigen::Index r = 0; r < rows_; ++r)
    system_.solveFor(columns_.col(r).data());
  Eigen::Map<Eigen::VectorXd> direction(system_.direction(), columns_.rows());
  for (Eigen::Index i = 0; i < c_.rows(); ++i)
    for (int k = 0; k < 3; ++k)
    {
      const Eigen::Index row = 3 * i + k;
      schur_.row(row).setZero();
      gap_[row] = -at_(k, i);
      for (Averages::InnerIterator entry(c_, i); entry; ++entry)
      {
        const Eigen::Index at = 4 * entry.col() + k;
        schur_.row(row) += entry.value() * columns_.row(at);
        gap_[row] += entry.value() * (system_.basePosition(static_cast<int>(entry.col()))[k] + direction[at]);
      }
    }
  factor_.compute(schur_);
  multipliers_ = gap_;
  factor_.solveInPlace(multipliers_);
  direction.noalias() -= columns_ * multipliers_;
}

/// Averages pull at held nodes, too, which hand that on to what holds them.
void AveragedPart::bearShares()
{
  RodStepper::Impl& rod = this->rod();
  for (Eigen::Index i = 0; i < c_.rows(); ++i)
    for (Averages::InnerIterator entry(c_, i); entry; ++entry)
    {
      const int node = static_cast<int>(entry.col());
      for (std::size_t k = 0; k < rod.wrenches.size() && !system_.isFree(node); ++k)
      {
        const GraspState& grasp = rod.work.grasps[k];
        if (!grasp.active || node < grasp.first_node || node > grasp.last_node)
          continue;
        const Eigen::Vector3d force = entry.value() * forces.col(i);
        rod.wrenches[k].force += force;
        rod.wrenches[k].torque += (system_.position(node) - rod.stage_poses[k].position).cross(force);
      }
    }
}

}   // namespace slender
