#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "cloth_preconditioner.h"
#include "cloth_terms.h"
#include "slender_sim/cloth/cloth_stepper.h"
#include "slender_sim/linalg/conjugate_gradients.h"
#include "slender_sim/linalg/constrained_cholesky.h"
#include "slender_sim/linalg/sparse_cholesky.h"
#include "slender_sim/linalg/symmetric_sweeps.h"

namespace slender {

/// What the energy of a step is made of at a configuration.
struct ClothEvaluation
{
  /// [J]; viscous response is part of the first two, inertia and loads of the last
  double membrane = 0, bending = 0, potential = 0;
  double max_strain = 0;   ///< largest |principal stretch - 1|
  double energy() const { return membrane + bending + potential; }
  double magnitude() const;
  void count(TermAccount account, const TermSums& sums);
};

/// One implicit stage M (x - q_hat) / tau^2 = F(x, (x - q_tilde) / tau) of a step (see Stage).
struct ClothStage
{
  double tau = 0;   ///< [s]
  const PointVector *q_hat = nullptr, *q_tilde = nullptr;
  const PointVector* start = nullptr;           ///< where the stage starts: potentials count from there
  const PointVector* wind_at = nullptr;         ///< where the wind sees the cloth
  const Eigen::Matrix3Xd* velocity = nullptr;   ///< at which it does, as far as its force is not linear in the end's
};

/// What became of linear equations.
enum class LinearOutcome
{
  solved,
  not_definite,   ///< the matrix is not positive definite, or prescribed averages depend on each other
  not_converged   ///< the most iterations that are taken did not reach the tolerance
};

/// Energy of one implicit stage of a cloth, with gradient and Hessian, and the solution of its Newton equations:
///   E(x) + sum 1/2 w |x - target|^2 + 1/2 (x - y)^T D (x - y) - f . x,
/// E from the terms (see clothTerms()), w from mass and mass damping, D and y from the loads (see clothLoads());
/// stiffness damping makes E viscous (see PointTerm).
class ClothSystem
{
public:
  /// Measured (study implicit_step): sweeps are faster up to so many points, the constant factor above.
  static constexpr int kMostSwept = 3000;

  ClothSystem(const ClothModel& model, const ClothOptions& options);

  int points() const { return model_.vertices(); }
  ClothSolver solver() const { return solver_; }
  /// What solves and evaluations spend; must outlive this.
  void useBudget(WorkBudget& budget) { budget_ = &budget; }

  /// What is held, and the plastic variables.
  void hold(const ClothState& state);
  /// The set of averages that acts from now on.
  void useAverages(const ClothState& state);
  bool bounded() const { return bounds_ != nullptr; }
  int averageCount() const { return averages_ ? averages_->count() : 0; }
  /// After setViscosity(stiffness damping / tau, ...).
  void beginStage(const ClothStage& stage, const ClothInputs& inputs);
  void usePlasticState(const ClothState& state);
  /// Strains at x as those that viscous response of the given ratio starts from; 0: none.
  void setViscosity(double ratio, const PointVector& x);
  /// The same for strains that are combined like the points x + move + share (other - x), to second order in `move`;
  /// `move` and `other` may be null.
  void setViscosity(double ratio, const PointVector& x, const PointVector* move, double share,
                    const PointVector* other);

  double viscosity() const { return ratio_; }
  /// Without what viscosity adds [J].
  double elasticEnergy(const PointVector& x);

  ClothEvaluation energy(const PointVector& x);
  /// Overwrites gradient().
  ClothEvaluation evaluate(const PointVector& x);
  /// The same with the matrix of solve().
  ClothEvaluation evaluateHessian(const PointVector& x, HessianKind kind);
  /// Adds a multiple of the weights of inertia to the matrix.
  void shiftMatrix(double factor);
  /// Adds the masses times `rate` [1/s^2] to the matrix; the rate may be negative.
  void addInertia(double rate);
  /// Factors the matrix (Cholesky only). Returns false where it is not positive definite on what is not held.
  bool factor();
  /// v := matrix^-1 v after a factor() that returned true. Held points of v must be zero and stay so.
  void solveFactored(PointVector& v) const { factor_.solvePoints(v.data(), v.data()); }
  /// Makes the inertia in the matrix, and mass damping, that of a stage with this tau [s].
  void setInertia(double tau);
  /// Adds the elastic and viscous parts only. `with_constant`: also that of the term with a constant matrix.
  ClothEvaluation addInternal(const PointVector& x, PointVector& gradient, bool with_constant = true);
  PointVector& gradient() { return gradient_; }
  const PointVector& gradient() const { return gradient_; }
  /// Solves H d = -gradient; `d` holds what held points move by, and for conjugate gradients the first guess of the
  /// others. `at`: where the matrix is from, for conjugate gradients that are preconditioned along the normals there;
  /// null: by the constant matrix. `tolerance`: theirs, 0: that of the options. The numbers grow by what was needed.
  /// Averages stay what the first guess makes them; with `averages` (3 x count) the points x + d, x the start of the
  /// stage, get these.
  LinearOutcome solve(PointVector& d, const PointVector* at, int& linear_iterations, int& factorizations,
                      double tolerance = 0.0, const Eigen::Matrix3Xd* averages = nullptr);
  /// The blocks of solve()'s matrix as last evaluated; those of constantMatrix() are among them only for Cholesky.
  const BlockMatrix& matrix() const { return matrix_; }
  /// The matrix of solve() times p.
  void applyMatrix(const PointVector& p, PointVector& ap);

  /// The same for a linearised step of a model with bounds of its averages' forces. `at_bound`: which were, and are, at
  /// their bounds.
  LinearOutcome solveBounded(PointVector& d, const Eigen::Matrix3Xd& averages, std::vector<int>& at_bound,
                             int& linear_iterations);
  /// Moves what is free, by as little as the preconditioner's norm allows, so that the averages are the given ones (3 x
  /// count).
  void meetAverages(const Eigen::Matrix3Xd& averages, PointVector& x);
  /// Takes the part out of the gradient that the averages balance: their forces (3 x count). With bounds these are
  /// those of solveBounded(), and of the `response` to other forces those of averages that are not at their bounds.
  void balanceAverages(Eigen::Matrix3Xd& forces, bool response = false);
  /// False when averages depend on each other on what is not held: then nothing can be solved.
  bool averagesIndependent() const { return !averages_ || used_->independent; }
  /// What they are at x.
  void averagesOf(const PointVector& x, Eigen::Matrix3Xd& averages) const;

  /// Work of gravity, extra forces and loads on the points that are not held, on the way between two configurations,
  /// the loads as at the end of the stage [J].
  double loadWork(const PointVector& from, const PointVector& to) const;
  /// The elastic and viscous part of the gradient as last evaluated [N].
  Eigen::Vector3d internalGradient(int i) const { return point(gradient_, i) - point(load_gradient_, i); }

  const PointVector& start() const { return start_; }
  /// Of the term that has one; nullptr without.
  const PointMatrix* constantMatrix() const { return constant_; }
  const PointVector& target() const { return target_; }
  const std::vector<char>& held() const { return held_; }
  const std::vector<std::unique_ptr<PointLoad>>& loads() const { return loads_; }

private:
  /// Weight of inertia per mass [1/s^2].
  double rate(double tau) const { return 1.0 / (tau * tau) + model_.mass_damping / tau; }
  void usePattern(bool direct);
  void setWeights(double tau, double ratio);
  void clearHeld(PointVector& v) const;
  /// Adds correction_, the solution of conjugate gradients, to d.
  LinearOutcome correct(PointVector& d, const LinearResult& result, double tolerance, int& linear_iterations);
  /// gap_: by how much the averages at x fall short.
  void setGap(const Eigen::Matrix3Xd& averages, const PointVector& x);
  void preconditionWithin(PointVector& r, PointVector& z);
  double takeFirstStep(PointVector& d, const Eigen::Matrix3Xd* averages, double tolerance);
  void move(PointVector& d);
  void moveAverages(PointVector& d);
  bool sweepsSuit(const PrescribedAverages& averages) const;
  bool bendsLittle(double viscosity) const;
  LinearOutcome sweepWithAverages(PointVector& d, const Eigen::Matrix3Xd& averages, double tolerance,
                                  int& linear_iterations);
  /// right_: what d leaves of the equations, held points zero.
  void setRight(const PointVector& d);
  LinearOutcome stepTowardsBounded(PointVector& d, const Eigen::Matrix3Xd& averages, double& reference,
                                   int& linear_iterations);
  LinearOutcome minimizeBounded(PointVector& d, const Eigen::Matrix3Xd& averages, double reference,
                                int& linear_iterations);
  double boundedForces();
  void takeOutAverages(PointVector& r);
  struct AverageSet;
  void use(AverageSet& set);
  double loadPotential(const PointVector& x) const;
  /// Inertia and loads: adds their gradient to gradient_; returns their potential.
  double addLoads(const PointVector& x);

  const ClothModel& model_;
  const bool choose_;   ///< the solver of steps with averages is ours to choose
  ClothSolver solver_;
  const double linear_tolerance_;
  WorkBudget unbounded_;
  WorkBudget* budget_ = &unbounded_;
  std::vector<ClothTerm> terms_;
  std::vector<std::unique_ptr<PointLoad>> loads_;
  const PointMatrix* constant_ = nullptr;   ///< of the term that has one
  bool constant_in_blocks_ = false;

  BlockMatrix matrix_;
  std::vector<int> constant_map_;
  std::vector<double> base_;   ///< constant part of matrix_
  double base_tau_ = 0, base_ratio_ = -1;
  double matrix_tau_ = 0;
  std::vector<char> base_held_;
  SparseCholesky factor_;                                 ///< of matrix_
  std::unique_ptr<ClothPreconditioner> preconditioner_;   ///< of conjugate gradients
  bool preconditioned_ = true;                            ///< its constant part could be factored
  bool limp_ = true;                                      ///< bendsLittle(): sweeps are not too slow
  ConjugateGradients cg_;
  SymmetricSweeps sweeps_;   ///< of that solver, and where averages suit them (sweepsSuit())

  struct AverageSet
  {
    const PrescribedAverages* prescribed;
    ConstrainedCholesky solver;   ///< of the preconditioner
    bool swept = false;           ///< sweepsSuit()
    bool ready = false;           ///< factored, with the present one
    bool independent = true;      ///< with what is held
  };
  std::vector<AverageSet> average_sets_;
  AverageSet* used_ = nullptr;                ///< of these, where averages are prescribed, and
  ConstrainedCholesky* averages_ = nullptr;   ///< its solver
  PointVector gap_, multipliers_;             ///< one point per average
  Eigen::Matrix3Xd averages_now_;

  struct AverageBounds
  {
    std::vector<int> at;        ///< averages that are not met because their forces are at their bounds, ascending
    Eigen::Matrix3Xd forces;    ///< of all [N]
    PointVector taken, pulls;   ///< multipliers of the averages that are met, so far; forces of all
    PointVector first_guess, before, image, image_before;
    /// of minimizeBounded(): directions of forces at their bounds, else zero; forces; what they are to a motion
    PointVector wanted, bounded, response;
    Eigen::VectorXd stiffness, weights;   ///< [N/m]
  };
  std::unique_ptr<AverageBounds> bounds_;   ///< of models with bounds

  void respond(double ratio);
  static constexpr int kMostIterations = 2000;   ///< of conjugate gradients
  /// Of conjugate gradients: `most`, or what the budget has room for.
  int iterationsWithin(int most) const
  {
    return static_cast<int>(std::min<long>(most, budget_->left() / points() + 1));
  }
  /// In counts per point.
  void spend(int counts) { budget_->spend(static_cast<long>(counts) * points()); }

  double ratio_ = 0;
  double load_ = 0;         ///< with averages: on the cloth without them, as the tolerance counts it
  double first_step_ = 0;   ///< of takeFirstStep(), in the preconditioner's norm
  PointVector start_, target_, force_, gradient_, load_gradient_, product_, right_, correction_;
  PointVector ahead_, behind_;   ///< with stiffness damping only
  std::vector<double> weight_;   ///< of inertia, per point
  std::vector<char> held_;
};

}   // namespace slender
