// Whether an equilibrium of one rod is stable: inertia of the banded Hessian, lowest eigenvalue and mode.
#include "rod_stability.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "slender_sim/dynamics/lowest_eigenvalue.h"
#include "dynamics/statics_advice.h"

namespace slender {

namespace {

/// The pencil K + s M at the configuration that the system holds.
class RodPencil
{
public:
  explicit RodPencil(RodWork& rod) : rod_(rod)
  {
    const RodModel& m = *rod.model;
    double inertia = 0.0;
    for (int j = 0; j < m.edges(); ++j)
      inertia += 0.25 * (m.radius_a[j] * m.radius_a[j] + m.radius_b[j] * m.radius_b[j]) / m.edges();
    edge_inertia_ = inertia * m.totalMass() / m.edges();
    const HessianShift one{0.0, 1.0};
    spin_ = rod.system.diagonalShift(0, {})[1];
    unit_ = rod.system.diagonalShift(0, one)[1] - spin_;
  }

  RodEvaluation evaluate(double s, bool with_hessian)
  {
    for (int i = 0; i < rod_.model->nodes(); ++i)
      rod_.system.setInertia(i, s * rod_.model->mass[i], rod_.system.position(i), rod_.load(i));
    // The system keeps rods that may spin freely definite by a share 1e-8 of the twist stiffness. On fine meshes that
    // is more than twisting of the whole rod costs, so that only what round-off needs is left of it: 1e-12.
    const double angle = (spin_ > 0 ? 1e-12 * unit_ : 0.0) + std::max(0.0, s) * edge_inertia_;
    return rod_.system.evaluate(with_hessian, {0.0, unit_ > 0 ? (angle - spin_) / unit_ : 0.0});
  }

  bool definite(double s) { return evaluate(s, true).inertia.positiveDefinite(); }

  /// What rounding errors of the matrix and its factor change of the eigenvalue of this mode v. They are 1e-16 of each
  /// entry, and so of stretching sum of E A / l (|v_i| + |v_j|)^2 and of bending sum of B / l^3 (|v_i| + 2 |v_j| +
  /// |v_k|)^2, over sum of m |v|^2. Bending counts where edges are shorter than the rod is thick. B is the smaller
  /// bending modulus: rounding errors of the larger one stay in its own plane, and a band that is as wide as those
  /// would hide that the rod buckles across that plane.
  double rounding(const Eigen::VectorXd& v) const
  {
    const RodModel& m = *rod_.model;
    double stretching = 0.0, bending = 0.0, inertia = 1e-300;
    const auto size = [&](int i) { return v.segment<3>(4 * (i % m.nodes())).norm(); };
    for (int j = 0; j < m.edges(); ++j)
      stretching += m.stretch_modulus[j] / m.rest_length[j] * std::pow(size(j) + size(j + 1), 2);
    const double bend = std::min(m.bend_modulus.row(0).maxCoeff(), m.bend_modulus.row(2).maxCoeff());
    for (int i = 0; i + (m.closed ? 0 : 2) < m.nodes(); ++i)
      bending += bend / std::pow(std::min(m.rest_length[i], m.rest_length[(i + 1) % m.edges()]), 3) *
                 std::pow(size(i) + 2 * size(i + 1) + size(i + 2), 2);
    for (int i = 0; i < m.nodes(); ++i)
      inertia += m.mass[i] * v.segment<3>(4 * i).squaredNorm();
    constexpr double kStretching = 2.0, kBending = 0.3;   // measured on 1,280 edges: 0.8 and 0.13
    return std::numeric_limits<double>::epsilon() * (kStretching * stretching + kBending * bending) / inertia;
  }

  /// Half width of the band of eigenvalues that count as zero whatever their mode.
  double neutral() const
  {
    const RodModel& m = *rod_.model;
    const double length = m.rest_length.sum(), mass = m.totalMass(), n = m.nodes();
    const double stiffness =
        std::min({m.bend_modulus.row(0).minCoeff(), m.bend_modulus.row(2).minCoeff(), m.twist_modulus.minCoeff()});
    double largest = 0.0;   // of the matrix's eigenvalues: stretching of one edge
    for (int j = 0; j < m.edges(); ++j)
      largest = std::max(
          largest, 4 * m.stretch_modulus[j] / (m.rest_length[j] * std::min(m.mass[j], m.mass[(j + 1) % m.nodes()])));
    // Rounding errors of the n entries add up like a random walk.
    const double rounding = std::numeric_limits<double>::epsilon() * largest / std::sqrt(n);
    return kNeutralShare * stiffness / (mass * std::pow(length, 3)) + 4.0 * rounding;
  }

  /// Mode by inverse iteration with the matrix last factored.
  Eigen::VectorXd mode()
  {
    const int n = rod_.model->nodes();
    Eigen::VectorXd v(4 * n);
    for (int k = 0; k < 4 * n; ++k)
      v[k] = startOfMode(k);
    for (int k = 0; k < 12; ++k)
    {
      for (int i = 0; i < n; ++i)
      {
        const double mass = rod_.system.isFree(i) ? rod_.model->mass[i] : 0.0;
        v.segment<3>(4 * i) *= mass;
        v[4 * i + 3] *= edge_inertia_;
      }
      clearHeld(v);
      v /= std::max(v.norm(), 1e-300);
      rod_.system.solveFor(v.data());
    }
    clearHeld(v);
    Eigen::Index at = 0;
    v.cwiseAbs().maxCoeff(&at);
    v *= v[at] < 0 ? -1.0 : 1.0;
    return v;
  }

private:
  void clearHeld(Eigen::VectorXd& v) const
  {
    for (const GraspState& g : rod_.work.grasps)
      if (g.active)
        for (int i = g.first_node; i <= g.last_node; ++i)
          v.segment(4 * i, i < g.last_node ? 4 : 3).setZero();
    if (!rod_.model->closed)
      v[v.size() - 1] = 0.0;
  }

  RodWork& rod_;
  double edge_inertia_ = 0.0, spin_ = 0.0, unit_ = 0.0;
};

/// Scales a mode so that the edge that turns most turns by 1 rad.
void scaleToTurns(const RodModel& model, Eigen::VectorXd& v)
{
  double turn = 0.0;
  for (int j = 0; j < model.edges(); ++j)
  {
    const int next = (j + 1) % model.nodes();
    turn = std::max(
        {turn, (v.segment<3>(4 * next) - v.segment<3>(4 * j)).norm() / model.rest_length[j], std::abs(v[4 * j + 3])});
  }
  // a mode that moves the rod as a whole turns nothing
  v /= std::max(turn, v.cwiseAbs().maxCoeff() / model.rest_length.sum());
}

}   // namespace

RodStability assessStability(RodWork& rod, bool spectrum)
{
  RodStability result;
  rod.system.load(rod.work);
  rod.system.setTwistLoads(rod.inputs->torques);
  rod.placeAt(1.0);
  RodPencil pencil(rod);
  const RodEvaluation at = pencil.evaluate(0.0, false);
  result.energy = at.energy();
  result.energy_noise = 1e-13 * (std::abs(at.stretch) + std::abs(at.bend_twist) + std::abs(at.potential));
  if (!spectrum)
    return result;
  rod.system.accept();   // the factors below belong to this configuration
  result.neutral = pencil.neutral();
  const LowestEigenvalue lowest = lowestEigenvalue([&](double s) { return pencil.definite(s); }, result.neutral);
  result.lowest = lowest.value;
  result.mode = pencil.mode();
  if (!result.mode.allFinite() || !(result.mode.norm() > 0))
    result.mode.setZero();
  else
  {
    scaleToTurns(*rod.model, result.mode);
    result.neutral = std::max(result.neutral, pencil.rounding(result.mode));
  }
  if (std::abs(result.lowest) <= result.neutral)
    result.lowest = 0.0;
  result.stable = result.lowest >= 0;
  return result;
}

}   // namespace slender
