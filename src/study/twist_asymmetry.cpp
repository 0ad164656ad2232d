// Twist of a naturally curved rod of flat section whose one end is turned (thesis Fig. 4.2): the bend keeps it on the turned side.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "shape_cases.h"
#include "slender_sim/study/cpu_clock.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

constexpr double kWeak = 1.0, kStrong = 4.0, kTwist = 1.6 / 1.3;   ///< a flat ellipse, 2 : 1, bent the easy way; nu = 0.3; L = 1
constexpr double kBend = 1.0 / 12;                                 ///< length of the V's bend: four edges of 48
constexpr double kTurnStep = 0.05;                                 ///< [rad]

struct Shape
{
  const char* name;
  double turn, length;   ///< of the bend in the middle [rad], [L]
  double angle(double s) const { return turn * std::clamp((s - 0.5) / length + 0.5, 0.0, 1.0); }
  double curvature(double s) const { return std::abs(s - 0.5) < 0.5 * length ? turn / length : 0.0; }
};
constexpr Shape kShapes[] = {{"V", M_PI / 2, kBend}, {"semicircle", M_PI, 1.0}};

/// Twist on the clamped and on the turned side of the middle [rad].
struct Halves
{
  double clamped, turned;
  double share() const { return turned / (clamped + turned); }
};

/// The smooth rod with its centreline held: psi is the angle by which sections have turned from their natural place,
///   C psi'' = k(s)^2 (B1 (1 - cos psi) sin psi + B2 sin psi cos psi),  psi(0) = 0, psi(1) = Theta.
/// Finite differences on a fine grid; each new Theta starts from the last state and goes downhill in energy (proximal Newton).
class HeldCurve
{
public:
  explicit HeldCurve(const Shape& shape) : k2_(kIntervals + 1), psi_(kIntervals + 1, 0.0)
  {
    for (int i = 0; i <= kIntervals; ++i)   // mean over the cell, so that the bend's ends fall where they should
      for (int q = 0; q < 16; ++q)
        k2_[i] += std::pow(shape.curvature((i - 0.5 + (q + 0.5) / 16) / kIntervals), 2) / 16;
  }

  void turnTo(double theta)
  {
    const double last = psi_[kIntervals];
    for (int i = 0; i <= kIntervals; ++i)
      psi_[i] += (theta - last) * std::pow(static_cast<double>(i) / kIntervals, 8);   // at the turned end
    double weight = 1e4;
    for (int round = 0; round < 400; ++round)
    {
      double change = 0;
      const bool definite = newton(weight, change);
      if (change < 1e-10 && weight == 0)
        return;
      weight = !definite ? std::max(10 * weight, 1.0) : change < 1e-2 ? (weight > 1e-3 ? 0.1 * weight : 0.0) : weight;
    }
    throw std::runtime_error("held curve: no equilibrium");
  }

  Halves halves() const { return {psi_[kIntervals / 2], psi_[kIntervals] - psi_[kIntervals / 2]}; }
  double at(double s) const { return psi_[static_cast<std::size_t>(std::lround(s * kIntervals))]; }

private:
  /// One step with `weight` |change|^2 / 2 per length added; does nothing but say so when the matrix is not definite.
  bool newton(double weight, double& change)
  {
    const double h = 1.0 / kIntervals, c = kTwist / h;
    std::vector<double> diagonal(kIntervals + 1, 1.0), right(kIntervals + 1, 0.0);
    for (int i = 1; i < kIntervals; ++i)
    {
      const double s = std::sin(psi_[i]), z = std::cos(psi_[i]);
      right[i] = c * (psi_[i + 1] - 2 * psi_[i] + psi_[i - 1]) - h * k2_[i] * (kWeak * (1 - z) * s + kStrong * s * z);
      diagonal[i] = 2 * c + h * k2_[i] * (kWeak * (z - z * z + s * s) + kStrong * (z * z - s * s)) + h * weight;
      if (i > 1)
      {
        const double factor = c / diagonal[i - 1];
        diagonal[i] -= factor * c;
        right[i] += factor * right[i - 1];
      }
      if (diagonal[i] <= 0)
      {
        change = std::numeric_limits<double>::infinity();
        return false;
      }
    }
    change = 0;
    for (int i = kIntervals - 1; i > 0; --i)
    {
      right[i] = (right[i] + c * (i + 1 < kIntervals ? right[i + 1] : 0.0)) / diagonal[i];
      change = std::max(change, std::abs(right[i]));
    }
    const double shorten = std::min(1.0, 0.3 / change);
    for (int i = 1; i < kIntervals; ++i)
      psi_[i] += shorten * right[i];
    return true;
  }

  static constexpr int kIntervals = 1920;
  std::vector<double> k2_, psi_;
};

/// The discrete rod; its centreline held by pins at every node, or free between the clamps.
class TurnedRod
{
public:
  TurnedRod(const Shape& shape, int edges, bool held) : edges_(edges)
  {
    Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, edges + 1);
    for (int j = 0; j < edges; ++j)
    {
      const double a = shape.angle((j + 0.5) / edges);
      nodes.col(j + 1) = nodes.col(j) + Eigen::Vector3d(std::cos(a), 0, std::sin(a)) / edges;
    }
    rod_ = naturalRod(sectionOf(1e6, kWeak, kStrong, kTwist), nodes, Eigen::Vector3d::UnitZ());
    rod_.hold(0, 0, true);
    rod_.hold(edges, edges, true);
    for (int i = 1; held && i < edges; ++i)
      rod_.hold(i, i, false);
    start_ = rod_.inputs.grasps[1].X_WG.orientation;
    TimeConfig time = timeConfig(Integrator::implicit_euler, 1.0, 1e-9);
    time.newton.max_iterations = 1000;
    stepper_ = std::make_unique<RodStepper>(rod_.model, time);
  }

  StepReport turnTo(double theta)
  {
    rod_.inputs.grasps[1].X_WG.orientation = start_ * Eigen::AngleAxisd(theta, Eigen::Vector3d::UnitX());   // x: the section's tangent
    return stepper_->solveEquilibrium(rod_.state, rod_.inputs);
  }

  /// Angle of edge j against the clamped section, in excess of the natural one [rad]; j = edges: of the turned section.
  double at(int edge) const
  {
    double sum = rod_.state.grasps[0].section_twist[1];
    for (int i = 1; i <= std::min(edge, edges_ - 1); ++i)
      sum += rod_.state.twist[i];
    return sum + (edge == edges_ ? rod_.state.grasps[1].section_twist[0] : 0.0);
  }
  Halves halves() const
  {
    const double middle = 0.5 * (at(edges_ / 2 - 1) + at(edges_ / 2));
    return {middle, at(edges_) - middle};
  }
  const Eigen::Matrix3Xd& nodes() const { return rod_.state.x; }

private:
  int edges_;
  RodSetup rod_;
  Eigen::Quaterniond start_;
  std::unique_ptr<RodStepper> stepper_;
};

}  // namespace

void runTwistAsymmetry(StudyContext& context)
{
  for (const Shape& shape : kShapes)
    for (int edges : {48, 192})
    {
      HeldCurve exact(shape);
      TurnedRod rod(shape, edges, true);
      double last = 0, last_exact = 0;
      for (int k = 1; k * kTurnStep < 40; ++k)
      {
        const double theta = k * kTurnStep;
        exact.turnTo(theta);
        const StepReport r = rod.turnTo(theta);
        if (!r.ok)
        {
          context.row().set("shape", shape.name).set("theta", theta).set("refused", r.message);
          break;
        }
        const Halves h = rod.halves(), e = exact.halves();
        if (h.clamped - last > 1 || e.clamped - last_exact > 1 || k % 40 == 0)
          context.row().set("shape", shape.name).set("edges", edges).set("theta", theta).set("total", h.clamped + h.turned).set("clamped", h.clamped).set("exact", e.clamped).set("share", h.share()).set("eshare", e.share());
        last = h.clamped;
        last_exact = e.clamped;
      }
    }
}

}  // namespace slender::study
