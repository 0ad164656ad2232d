#pragma once

#include "cloth_linear_solver.h"
#include "shifted_matrix.h"
#include "linalg/projected_sweeps.h"
#include "slender_sim/linalg/constrained_cholesky.h"

namespace slender {

/// Solves the Newton equations of a cloth with prescribed averages (see PrescribedAverages), by ProjectedSweeps. One
/// set of the model's averages acts at a time.
class AveragedClothSolver final : public ClothLinearSolver
{
public:
  /// The model must have averages.
  AveragedClothSolver(const ClothModel& model, const ClothOptions& options, ClothSystem& system);

  /// The set of averages that acts from now on.
  void use(const ClothState& state);
  /// Whether the forces of averages have bounds.
  bool bounded() const { return bounds_ != nullptr; }
  int count() const { return used_->prescribed->count(); }
  /// False when averages depend on each other on what is not held: then nothing can be solved.
  bool independent() const { return used_->independent && used_->independent_bounded; }
  /// What they are at x.
  void averagesOf(const PointVector& x, Eigen::Matrix3Xd& averages) const;

  void beginStage() override;
  /// Averages stay what the first guess makes them.
  LinearOutcome solve(PointVector& d, long& linear_iterations, long& factorizations, double tolerance = 0.0) override;
  /// The same, but the points x + d, x the start of the stage, get these averages (3 x count).
  LinearOutcome solveTo(const Eigen::Matrix3Xd& averages, PointVector& d, long& linear_iterations);
  /// The same for a linearised step of a model with bounds of its averages' forces. `at_bound`: which were, and are, at
  /// their bounds.
  LinearOutcome solveBounded(PointVector& d, const Eigen::Matrix3Xd& averages, std::vector<int>& at_bound,
                             long& linear_iterations);

  /// Moves what is free, by as little as its mass allows, so that the averages are the given ones (3 x count).
  void meetAverages(const Eigen::Matrix3Xd& averages, PointVector& x);
  /// Takes the part out of the system's gradient that the averages balance: their forces (3 x count). With bounds these
  /// are those of solveBounded(), and of the `response` to other forces those of averages that are not at their bounds.
  void balanceAverages(Eigen::Matrix3Xd& forces, bool response = false);

private:
  struct AverageSet
  {
    explicit AverageSet(const PrescribedAverages& of) : prescribed(&of), projection(*of.weights) {}
    const PrescribedAverages* prescribed;
    AverageProjection projection;
    ConstrainedCholesky bounded;       ///< beside AverageBounds::constant, with bounds only
    bool factored = false;             ///< `bounded`, with the present one
    bool independent = true;           ///< with what is held, by their masses
    bool independent_bounded = true;   ///< the same, by `bounded`
  };
  struct AverageBounds
  {
    std::vector<int> at;       ///< averages that are not met because their forces are at their bounds, ascending
    Eigen::Matrix3Xd forces;   ///< of all [N]
    PointVector pulls;         ///< forces of all
    PointVector first_guess, before, image, image_before;
    /// of minimizeBounded(): directions of forces at their bounds, else zero; forces; what they are to a motion
    PointVector wanted, bounded, response;
    Eigen::VectorXd stiffness, weights;   ///< [N/m]
    /// What preconditions: inertia and constantStiffness(), and what it was factored for.
    ShiftedMatrix constant;
    bool definite = false;
    std::vector<double> inertia;
    std::vector<char> held;
    double ratio = -1.0;
    ConjugateGradients cg;
  };

  void use(AverageSet& set);
  /// gap_: by how much the averages at x fall short.
  void setGap(const Eigen::Matrix3Xd& averages, const PointVector& x);
  LinearOutcome search(PointVector& d, double tolerance, double load, long& linear_iterations);
  void prepareBounded();
  LinearOutcome stepTowardsBounded(PointVector& d, const Eigen::Matrix3Xd& averages, double& reference,
                                   long& linear_iterations);
  LinearOutcome minimizeBounded(PointVector& d, const Eigen::Matrix3Xd& averages, double reference,
                                long& linear_iterations);
  double boundedForces();
  void setBoundedGap(const PointVector& d, const Eigen::Matrix3Xd& averages);
  LinearResult solveBoundedStep(double tolerance, int most);
  double moveBounded(PointVector& d, const Eigen::Matrix3Xd& averages, double start);

  const Eigen::VectorXd& mass_;
  std::vector<AverageSet> average_sets_;
  AverageSet* used_ = nullptr;   ///< of these
  ProjectedSweeps sweeps_;
  std::vector<char> swept_held_;    ///< what was held when sweeps_ took the averages
  PointVector gap_, multipliers_;   ///< one point per average
  Eigen::Matrix3Xd averages_now_;
  std::unique_ptr<AverageBounds> bounds_;   ///< of models with bounds
};

}   // namespace slender
