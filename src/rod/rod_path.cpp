#include "slender_sim/rod/rod_path.h"

#include <algorithm>
#include <cmath>

#include "slender_sim/dynamics/newton.h"
#include "slender_sim/rod/rod_system.h"
#include "dynamics/statics_advice.h"

namespace slender {

class RodPath::Impl
{
public:
  Impl(std::shared_ptr<const RodModel> m, const RodState& s, const RodInputs& constant, const RodInputs& scaled,
       double last)
    : model(std::move(m)),
      state(s),
      system(*model),
      last_factor(last)
  {
    const int n = model->nodes();
    addFrames(*model, state);
    const auto loads = [&](const RodInputs& inputs) {
      Eigen::Matrix3Xd f(3, n);
      for (int i = 0; i < n; ++i)
        f.col(i) = model->mass[i] * inputs.gravity;
      if (model->drag.size() > 0)
        f += inputs.wind * model->drag.transpose();
      if (inputs.forces.cols() > 0)
        f += inputs.forces;
      return f;
    };
    const auto torques = [&](const RodInputs& inputs) {
      return inputs.torques.size() > 0 ? inputs.torques : Eigen::VectorXd(Eigen::VectorXd::Zero(model->edges()));
    };
    if (constant.torques.size() + scaled.torques.size() > 0)
    {
      fixed_torques = torques(constant);
      unit_torques = torques(scaled);
    }
    fixed = loads(constant);
    unit = loads(scaled);
    for (const GraspState& g : state.grasps)
      poses.push_back(g.X_WG);
    reload();
    tangent.setZero(4 * n);
    length = model->rest_length.sum();
  }

  void reload()
  {
    system.load(state);
    system.setResponse(0.0, nullptr);
    system.placeGrasps(poses);
  }

  void setLoads(double at)
  {
    for (int i = 0; i < model->nodes(); ++i)
      system.setInertia(i, 0.0, Eigen::Vector3d::Zero(), fixed.col(i) + at * unit.col(i));
    system.setTwistLoads(fixed_torques + at * unit_torques);
  }

  /// The displacement per unit of the factor, with the matrix last factored.
  Eigen::VectorXd perFactor() const
  {
    Eigen::VectorXd v = Eigen::VectorXd::Zero(4 * model->nodes());
    for (int i = 0; i < model->nodes(); ++i)
      if (system.isFree(i))
        v.segment<3>(4 * i) = unit.col(i);
    for (int j = 0; j < static_cast<int>(unit_torques.size()); ++j)
      if (system.mayTurn(j))
        v[4 * j + 3] = unit_torques[j];
    system.solveFor(v.data());
    return v;
  }

  /// Inner product of two steps (displacement, factor): mean square of positions over the length, and the factor over
  /// its last value.
  double inner(const Eigen::VectorXd& a, double fa, const Eigen::VectorXd& b, double fb) const
  {
    double sum = 0.0;
    for (int i = 0; i < model->nodes(); ++i)
      sum += a.segment<3>(4 * i).dot(b.segment<3>(4 * i));
    return sum / (model->nodes() * length * length) + fa * fb / (last_factor * last_factor);
  }

  /// From the last point of the path to the trial at the factor `at`, as inner() measures.
  double distanceTo(double at) const
  {
    double sum = 0.0;
    for (int i = 0; i < model->nodes(); ++i)
      sum += (system.position(i) - state.x.col(i)).squaredNorm();
    return std::sqrt(sum / (model->nodes() * length * length) + std::pow((at - factor) / last_factor, 2));
  }

  void move(const Eigen::VectorXd& by)
  {
    Eigen::Map<Eigen::VectorXd>(system.direction(), by.size()) = by;
    system.moveAlong(1.0);
  }

  bool sound(const RodEvaluation& at) const
  {
    return std::isfinite(at.energy()) && at.min_chi > kFoldedChi && at.inertia.zero == 0;
  }

  bool correct(double& at, const Eigen::VectorXd* along, double along_factor, long& iterations);
  bool tryStep(double share, long& iterations);

  std::shared_ptr<const RodModel> model;
  RodState state;
  RodSystem system;
  std::vector<Pose> poses;
  Eigen::Matrix3Xd fixed, unit;
  Eigen::VectorXd fixed_torques, unit_torques;   ///< about the tangents; empty without torques
  Eigen::VectorXd tangent;
  double tangent_factor = 0.0;   ///< 0: no step yet
  double factor = 0.0, last_factor, length = 1.0, share_now = 0.0;
};

/// Newton's method from the trial on, in the plane across the tangent `along`; null: at a fixed factor.
bool RodPath::Impl::correct(double& at, const Eigen::VectorXd* along, double along_factor, long& iterations)
{
  constexpr int kMost = 25;
  // of the length and of the last factor; differences of positions round to 1e-16 of the length
  constexpr double kTolerance = 1e-10;
  double last = 1e300;
  for (iterations = 0; iterations < kMost; ++iterations)
  {
    setLoads(at);
    if (!sound(system.evaluate(true)))
      return false;
    system.accept();
    system.solve();
    Eigen::VectorXd by = Eigen::Map<const Eigen::VectorXd>(system.direction(), 4 * model->nodes());
    double change = 0.0;
    if (along)
    {
      const Eigen::VectorXd per = perFactor();
      change = -inner(*along, along_factor, by, 0.0) / inner(*along, along_factor, per, 1.0);
      by += change * per;
    }
    const double size = std::sqrt(inner(by, change, by, change));
    if (!std::isfinite(size) || (iterations > 3 && size > 4 * last))
      return false;
    move(by);
    at += change;
    last = size;
    if (size < kTolerance)
    {
      setLoads(at);
      if (!sound(system.evaluate(true)))
        return false;
      system.accept();
      return true;
    }
  }
  return false;
}

bool RodPath::Impl::tryStep(double share, long& iterations)
{
  constexpr double kFurthest = 1.5;   // times the step: what is further away may be another branch, or leave out a fold
  iterations = 0;
  setLoads(factor);
  if (!sound(system.evaluate(true)))
    return false;
  system.accept();
  Eigen::VectorXd next = perFactor();
  const double norm = std::sqrt(inner(next, 1.0, next, 1.0));
  double next_factor = 1.0 / norm;
  next /= norm;
  const bool back = tangent_factor == 0.0 ? last_factor < 0 : inner(next, next_factor, tangent, tangent_factor) < 0;
  if (back)
  {
    next = -next;
    next_factor = -next_factor;
  }
  Eigen::VectorXd by = share * next;
  Eigen::Map<Eigen::VectorXd>(system.direction(), by.size()) = by;
  if (system.stepLimit() < 1.0)
    return false;
  move(by);
  double at = factor + share * next_factor;
  if (!correct(at, &next, next_factor, iterations) || distanceTo(at) > kFurthest * share)
    return false;
  tangent = next;
  tangent_factor = next_factor;
  factor = at;
  return true;
}

RodPath::RodPath(std::shared_ptr<const RodModel> model, const RodState& start, const RodInputs& constant,
                 const RodInputs& scaled, double last_factor)
  : impl_(std::make_unique<Impl>(std::move(model), start, constant, scaled, last_factor))
{
}
RodPath::~RodPath() = default;

StepReport RodPath::advance(double share)
{
  Impl& m = *impl_;
  StepReport report;
  double now = m.share_now > 0 ? std::min(share, m.share_now) : share;
  for (int attempt = 0; attempt < 24; ++attempt, now *= 0.5)
  {
    long iterations = 0;
    m.reload();
    const bool good = m.tryStep(now, iterations);
    report.iterations += iterations;
    if (!good)
      continue;
    m.system.store(m.state);
    m.share_now = iterations < 5 ? 2 * now : now;
    ++report.substeps;
    return report;
  }
  return report.refuse(
      StepFailure::newton_diverged,
      "rod '" + m.model->name +
          "': the path of equilibria could not be followed further: use more edges, or a small perturbation, which "
          "rounds off the points where paths branch");
}

StepReport RodPath::settleAt(double factor)
{
  Impl& m = *impl_;
  StepReport report;
  m.reload();
  double at = factor;
  if (!m.correct(at, nullptr, 0.0, report.iterations))
    return report.refuse(StepFailure::newton_diverged,
                         "rod '" + m.model->name + "': " + explainStatics(StepFailure::newton_diverged));
  m.factor = factor;
  m.system.store(m.state);
  return report;
}

double RodPath::factor() const { return impl_->factor; }
const RodState& RodPath::state() const { return impl_->state; }

}   // namespace slender
