// Ways of enforcing weak constraints (thesis 6.3.3) on the same motion: Lagrange multipliers, penalty forces, manifold
// projection. Error against run time.
#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/Eigenvalues>

#include "guided_cloth.h"

namespace slender::study {

using Eigen::Matrix3Xd;

namespace {

constexpr double kDuration = 1.0;   // [s]
constexpr double kSmooth = 100;     // bending that leaves no fine wrinkles, over that of the sheet

/// A sheet that is shaken and turned by its averages.
GuidedCloth shakenSheet()
{
  GuidedCloth c;
  c.name = "shaken sheet";
  c.guide = guideSheet(0.5, 3, 0.0);
  c.fine = subdivide(c.guide, 3);
  c.functions = subdivisionBasis(c.fine);
  c.model = buildCloth("sheet", c.fine.mesh, 0.2, isotropicMembrane(2e5, 0.3, 1e-3));
  c.model.bending = BendingModel::hinge;
  c.model.bending_modulus = 1e-4;
  c.model.stiffness_damping = 2e-3;
  c.gravity = Eigen::Vector3d(0, 0, -9.81);
  c.at = [rest = c.guide.vertices](double t) {
    Matrix3Xd x = rest;
    const double ramp = t < 0.3 ? (t / 0.3) * (t / 0.3) * (3 - 2 * t / 0.3) : 1.0;
    for (Eigen::Index i = 0; i < x.cols(); ++i)
    {
      const double angle = 2.0 * ramp * std::sin(5.0 * t) * rest(0, i);   // twists about its x axis
      x.col(i) << rest(0, i), rest(1, i) * std::cos(angle),
          rest(1, i) * std::sin(angle) + 0.05 * ramp * std::sin(12.0 * t + 6.0 * rest(0, i));
    }
    return x;
  };
  return c;
}

/// What black boxes can do: a free cloth, and forces or corrections from outside.
class Outside
{
public:
  explicit Outside(const GuidedCloth& c)
    : case_(c),
      constraints_(c.constraints()),
      inverse_mass_(c.model.mass.cwiseInverse()),
      weights_(constraints_.matrix()),
      gram_(Eigen::MatrixXd(weights_ * inverse_mass_.asDiagonal() * weights_.transpose()))
  {
    for (Eigen::Index i = 0; i < gram_.rows(); ++i)
      masses_.push_back(1.0 / gram_(i, i));
    solver_.compute(gram_);
  }

  /// Largest penalty stiffness [N/m] that explicit forces of steps h bear: h < 2 / omega, without damping.
  double stableStiffness(double h) const
  {
    const double largest =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(gram_, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
    return 4.0 / (h * h * largest);
  }

  /// Penalty forces with half the critical damping of each average, as they are when the step begins.
  Matrix3Xd penalty(const ClothState& state, double t, double stiffness) const
  {
    const Matrix3Xd gap = constraints_.averages(case_.at(t)) - state.x * weights_.transpose();
    const Matrix3Xd rate = constraints_.averages(case_.velocity(t)) - state.v * weights_.transpose();
    Matrix3Xd pull(3, gap.cols());
    for (Eigen::Index i = 0; i < gap.cols(); ++i)
      pull.col(i) = stiffness * gap.col(i) + std::sqrt(stiffness * masses_[i]) * rate.col(i);
    return pull * weights_;
  }

  /// The nearest positions, by mass, that have the guide's averages; velocities go along.
  void project(ClothState& state, double t, double h) const
  {
    const Matrix3Xd gap = constraints_.averages(case_.at(t)) - state.x * weights_.transpose();
    const Matrix3Xd move = (solver_.solve(gap.transpose()).transpose() * weights_) * inverse_mass_.asDiagonal();
    state.x += move;
    state.v += move / h;
  }

private:
  const GuidedCloth& case_;
  WeakConstraints constraints_;
  Eigen::VectorXd inverse_mass_;
  WeakConstraints::Matrix weights_;
  Eigen::MatrixXd gram_;
  Eigen::LDLT<Eigen::MatrixXd> solver_;
  std::vector<double> masses_;   ///< [kg] that an average moves
};

struct Run
{
  bool ok = false;
  std::string reason;
  double seconds = 0, constraint_error = 0;
  std::vector<Matrix3Xd> frames;   ///< at tenths of the duration
};

enum class Method
{
  multipliers,
  penalty,
  projection
};

Run followBy(const GuidedCloth& base, const Outside& outside, Method method, double h, double stiffness)
{
  GuidedCloth c = base;
  c.step = h;
  GuidedStepper stepper(c, method == Method::multipliers ? Follow::averages : Follow::nothing);
  const int steps = static_cast<int>(std::lround(kDuration / h));
  const WeakConstraints& constraints = stepper.constraints();
  Run run;
  for (int k = 1; k <= steps; ++k)
  {
    ClothState& state = stepper.cloth().state;
    const double start = threadSeconds();
    if (method == Method::penalty)
      stepper.cloth().inputs.forces = outside.penalty(state, (k - 1) * h, stiffness);
    run.seconds += threadSeconds() - start;
    const StepReport report = stepper.step();
    if (!report.ok)
    {
      run.reason = report.message;
      return run;
    }
    const double projection = threadSeconds();
    if (method == Method::projection)
      outside.project(state, k * h, h);
    run.seconds += threadSeconds() - projection;
    const double error = constraints.error(constraints.averages(c.at(k * h)), state.x);
    run.constraint_error = std::max(run.constraint_error, error);
    if (!(error < 10.0))
    {
      run.reason = "blew up after " + std::to_string(k) + " steps";
      return run;
    }
    if (10 * k % steps == 0)
      run.frames.push_back(state.x);
  }
  run.seconds += stepper.seconds();
  run.ok = true;
  return run;
}

/// RMS distance over all frames [m].
}   // namespace

void runTrackingMethods(StudyContext& context)
{
  useOneBlasThread();
  const GuidedCloth c = shakenSheet();
  const Outside outside(c);
  Plot& paths = context.plot("tracking_methods", "Ways of tracking: error against run time, steps of 20 ms down",
                             "CPU time per simulated second [s]", "RMS distance from the converged motion [m]");
  Plot& drift = context.plot("tracking_methods_constraints", "Ways of tracking: how well averages are kept",
                             "CPU time per simulated second [s]", "greatest distance of an average [m]");
  const int halvings = context.quick() ? 2 : 5;   // of 20 ms
  GuidedCloth exact = c;
  exact.one_newton_step = false;
  exact.linear_tolerance = 1e-6;
  const Run reference = followBy(exact, outside, Method::multipliers, 0.02 / std::exp2(halvings + 2), 0.0);
  if (!reference.ok)
    throw std::runtime_error("reference: " + reference.reason);

  const std::vector<double> stiffnesses =
      context.quick() ? std::vector<double>{1e1, 1e2, 1e3} : std::vector<double>{1e0, 1e1, 1e2, 1e3, 1e4, 1e5};
  struct Way
  {
    std::string name;
    Method method;
    double stiffness;
  };
  std::vector<Way> ways{{"multipliers", Method::multipliers, 0}, {"projection", Method::projection, 0}};
  for (const double stiffness : stiffnesses)
    ways.push_back({"penalty, " + std::to_string(static_cast<int>(stiffness)) + " N/m", Method::penalty, stiffness});
  double fine_multipliers = 0, coarse_multipliers = 0, worst_multipliers = 0,
         best_penalty = std::numeric_limits<double>::infinity(), coarse_projection = 0;
  int done = 0, blown_up = 0;
  for (const Way& way : ways)
  {
    context.progress(done++, static_cast<int>(ways.size()), way.name);
    for (int k = 0; k <= halvings; ++k)
    {
      const double h = 0.02 / std::exp2(k);
      const Run run = followBy(c, outside, way.method, h, way.stiffness);
      Row& row = context.row();
      row.set("method", way.name).set("step_ms", 1e3 * h);
      if (way.method == Method::penalty)
        row.set("stable_stiffness_N_per_m", outside.stableStiffness(h));
      if (!run.ok)
      {
        ++blown_up;
        row.set("outcome", run.reason);
        continue;
      }
      const double error = rmsDistance(run.frames, reference.frames);
      row.set("outcome", "done")
          .set("cpu_seconds", run.seconds)
          .set("rms_error_m", error)
          .set("average_error_m", run.constraint_error);
      paths.at(way.name).x.push_back(run.seconds / kDuration);
      paths.at(way.name).y.push_back(error);
      drift.at(way.name).x.push_back(run.seconds / kDuration);
      drift.at(way.name).y.push_back(std::max(run.constraint_error, 1e-16));
      if (way.method == Method::multipliers)
        worst_multipliers = std::max(worst_multipliers, run.constraint_error);
      if (way.method == Method::penalty)
        best_penalty = std::min(best_penalty, run.constraint_error);
      if (k == 0 && way.method == Method::multipliers)
        coarse_multipliers = error;
      if (k == halvings && way.method == Method::multipliers)
        fine_multipliers = error;
      if (k == 0 && way.method == Method::projection)
        coarse_projection = error;
    }
  }

  // where bending smooths out the wrinkles that steps do not resolve, errors of multipliers are of first order
  GuidedCloth smooth = exact;
  smooth.model.bending_modulus *= kSmooth;
  const Run smooth_reference = followBy(smooth, outside, Method::multipliers, 0.02 / std::exp2(halvings + 2), 0.0);
  if (!smooth_reference.ok)
    throw std::runtime_error("reference of the stiff sheet: " + smooth_reference.reason);
  double coarse_smooth = 0, fine_smooth = 0;
  for (int k = 0; k <= halvings; ++k)
  {
    const double h = 0.02 / std::exp2(k);
    const Run run = followBy(smooth, outside, Method::multipliers, h, 0.0);
    if (!run.ok)
      throw std::runtime_error("stiff sheet: " + run.reason);
    const double error = rmsDistance(run.frames, smooth_reference.frames);
    context.row()
        .set("method", "multipliers, bending " + std::to_string(static_cast<int>(kSmooth)) + " times as stiff")
        .set("step_ms", 1e3 * h)
        .set("outcome", "done")
        .set("cpu_seconds", run.seconds)
        .set("rms_error_m", error)
        .set("average_error_m", run.constraint_error);
    (k == 0 ? coarse_smooth : fine_smooth) = error;
  }
  context.metric("order_of_multipliers_smooth", std::log2(coarse_smooth / fine_smooth) / halvings);
  context.metric("constraint_error_multipliers", worst_multipliers);
  context.metric("constraint_error_penalty_best", best_penalty);
  context.metric("projection_over_multipliers_20ms", coarse_projection / coarse_multipliers);
  context.metric("order_of_multipliers", std::log2(coarse_multipliers / fine_multipliers) / halvings);
  context.metric("penalty_blown_up", blown_up);
  context.note(
      "errors against multipliers at a quarter of the shortest step with full Newton and a linear tolerance of 1e-6; "
      "penalty: forces of springs and dampers as they are when the step begins, "
      "unstable above stable_stiffness; projection: free step, then the nearest positions by mass that have the "
      "averages.");
}

const StudyRegistration kTrackingMethodsRegistration{
    "tracking_methods",
    "error against run time of ways to keep averages: Lagrange multipliers, penalty, manifold projection",
    runTrackingMethods};

}   // namespace slender::study
