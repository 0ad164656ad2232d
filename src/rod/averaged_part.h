#pragma once

#include <algorithm>

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>

#include "rod_part.h"
#include "slender_sim/rod/average_projection.h"

namespace slender {

/// A rod under the constraints C x = targets. A Schur complement of the rod's matrix makes Newton's directions satisfy
/// the constraints.
class AveragedPart : public RodPart
{
public:
  using Averages = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  /// c: the matrix C, count x nodes. Its rows sum to 1. It must outlive the part.
  AveragedPart(RodStepper::Impl& rod, const Averages& c)
    : RodPart(rod, false),
      c_(c),
      rows_(3 * c.rows()),
      columns_(4 * c.cols(), rows_),
      schur_(rows_, rows_),
      factor_(rows_),
      gap_(rows_),
      multipliers_(rows_),
      projection_(c)
  {
    multipliers_.setZero();
  }

  /// The averages move uniformly in the step from where they are in the loaded state to `targets` (3 x count [m]).
  void setTargets(const Eigen::Matrix3Xd& targets)
  {
    targets_ = &targets;
    start_.setZero(3, targets.cols());   // entry by entry: Eigen's product takes memory
    for (Eigen::Index i = 0; i < targets.cols(); ++i)
      for (Averages::InnerIterator entry(c_, i); entry; ++entry)
        start_.col(i) += entry.value() * rod().work.x.col(entry.col());
  }

  Eigen::Matrix3Xd forces;   ///< with which the averages act at the end of the last substep (3 x count [N])

private:
  // ---- its steps
  StepFailure beginSubstep(const StepPlan& plan, const Substep& substep) override
  {
    if (const StepFailure failure = RodPart::beginSubstep(plan, substep); failure != StepFailure::none)
      return failure;
    at_ = start_ + (substep.from + substep.length) / duration() * (*targets_ - start_);
    return projection_.prepare(rod().model->mass, [this](int node) { return system_.isFree(node); })
               ? StepFailure::none
               : StepFailure::singular_matrix;   // averages depend on each other
  }
  void beginStage(std::size_t stage) override
  {
    RodPart::beginStage(stage);
    meet();
  }
  void endStage(std::size_t stage, bool last, StepReport& report) override
  {
    RodPart::endStage(stage, last, report);
    forces = -Eigen::Map<const Eigen::Matrix3Xd>(multipliers_.data(), 3, c_.rows());
    bearShares();
  }
  void refuse(StepFailure failure, double length, StepReport& report) const override
  {
    const char* dependent =
        "prescribed averages depend on each other on the nodes that are not held: leave some out, or hold fewer nodes";
    rod().refuseUnsolved(report, failure, length, false, failure == StepFailure::singular_matrix ? dependent : "",
                         true);
  }

  // ---- as Part
  void solve() override;
  /// With the forces of the averages, which are in the gradient only here.
  double residual() const override
  {
    addMultipliers(1.0);
    const double residual = system_.residual();
    addMultipliers(-1.0);
    return residual;
  }
  double forceScale() const override
  {
    return std::max(system_.forceScale(),
                    multipliers_.cwiseAbs().maxCoeff() / std::max<Eigen::Index>(1, c_.cols() / c_.rows()));
  }

  void meet();
  void bearShares();
  double average(Eigen::Index i, const double* x) const
  {
    double sum = 0.0;
    for (Averages::InnerIterator entry(c_, i); entry; ++entry)
      sum += entry.value() * x[entry.col()];
    return sum;
  }
  void addMultipliers(double factor) const
  {
    for (Eigen::Index i = 0; i < c_.rows(); ++i)
      for (Averages::InnerIterator entry(c_, i); entry; ++entry)
        if (system_.isFree(static_cast<int>(entry.col())))
          for (int k = 0; k < 3; ++k)
            system_.gradient()[4 * entry.col() + k] += factor * entry.value() * multipliers_[3 * i + k];
  }

  const Averages& c_;
  const Eigen::Matrix3Xd* targets_ = nullptr;
  Eigen::Matrix3Xd start_, at_;   ///< averages where the step begins, and where the substep ends [m]
  Eigen::Index rows_;
  Eigen::MatrixXd columns_;   ///< K^-1 C^T, 4 nodes x 3 averages
  Eigen::MatrixXd schur_;     ///< C K^-1 C^T
  Eigen::LDLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd gap_, multipliers_;   ///< multipliers_: three per average [N]
  AverageProjection projection_;
};

}   // namespace slender
