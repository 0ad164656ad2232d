#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "slender_sim/rod/rod_model.h"
#include "slender_sim/rod/rod_stepper.h"
#include "test/support/random.h"

/// Rods and inputs that several tests share.
namespace slender::test {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

inline Matrix3Xd straightNodes(int n, double length, const Vector3d& from = Vector3d::Zero(),
                               const Vector3d& along = Vector3d::UnitX())
{
  Matrix3Xd x(3, n);
  for (int i = 0; i < n; ++i)
    x.col(i) = from + along * (length * i / (n - 1));
  return x;
}

/// Helix of the given radius and pitch [m per turn]; pitch 0: an arc.
inline Matrix3Xd helixNodes(int n, double radius, double pitch, double turns)
{
  Matrix3Xd x(3, n);
  for (int i = 0; i < n; ++i)
  {
    const double phi = 2 * M_PI * turns * i / (n - 1);
    x.col(i) = Vector3d(radius * std::cos(phi), radius * std::sin(phi), pitch * phi / (2 * M_PI));
  }
  return x;
}

inline Matrix3Xd ringNodes(int n, double radius)
{
  Matrix3Xd x(3, n);
  for (int i = 0; i < n; ++i)
    x.col(i) = radius * Vector3d(std::cos(2 * M_PI * i / n), std::sin(2 * M_PI * i / n), 0.0);
  return x;
}

/// A wiggly curve with unequal edges of roughly unit length; closed: around a ring.
inline Matrix3Xd wigglyNodes(int n, bool closed, Random& random)
{
  Matrix3Xd x = closed ? ringNodes(n, n / (2 * M_PI)) : straightNodes(n, n - 1.0);
  for (int i = 0; i < n; ++i)
    x.col(i) += random.vector(0.25);
  return x;
}

/// Circular section of radius r [m]: moduli from Young's modulus E [Pa], Poisson's ratio 0.3 and density rho [kg/m^3]
/// (thesis 4.2.4).
inline RodSection roundSection(double r, double youngs, double density)
{
  const double area = M_PI * r * r, inertia = 0.25 * area * r * r;
  return {r,
          r,
          density * area,
          youngs * area,
          Eigen::Matrix2d(youngs * inertia * Eigen::Matrix2d::Identity()),
          youngs / 2.6 * 2 * inertia};
}

/// Sections by moduli, isotropic.
inline RodSection modulusSection(double bend, double twist, double stretch, double linear_density)
{
  return {0.01, 0.01, linear_density, stretch, Eigen::Matrix2d(bend * Eigen::Matrix2d::Identity()), twist};
}

/// Every modulus of order one and different, with b12: so that no term of the equations hides behind another.
inline RodSection oddSection(Random& random)
{
  Eigen::Matrix2d b;
  const double b12 = random.uniform(-0.4, 0.4);
  b << random.uniform(1.0, 1.5), b12, b12, random.uniform(0.6, 0.9);
  return {0.1, 0.1, random.uniform(0.5, 1.5), random.uniform(2.0, 4.0), b, random.uniform(0.5, 1.0)};
}

inline std::vector<RodSection> uniformSections(const RodSection& section, int edges)
{
  return std::vector<RodSection>(edges, section);
}

inline std::vector<RodSection> oddSections(int edges, Random& random)
{
  std::vector<RodSection> sections;
  for (int j = 0; j < edges; ++j)
    sections.push_back(oddSection(random));
  return sections;
}

inline RodModel openRod(const Matrix3Xd& nodes, const RodSection& section, bool straight = false)
{
  return buildRod("rod", nodes, false, uniformSections(section, static_cast<int>(nodes.cols()) - 1), Vector3d::Zero(),
                  straight);
}

/// A model, its state and inputs that hold every grasp where it is.
struct Rod
{
  std::shared_ptr<RodModel> model;
  RodState state;
  RodInputs inputs;

  Rod(const RodModel& m, const Matrix3Xd& nodes, double twist = 0.0)
    : model(std::make_shared<RodModel>(m)),
      state(makeRodState(m, nodes, Vector3d::Zero(), twist))
  {
  }

  /// Grasps nodes first..last; returns the index of the grasp.
  int hold(int first, int last, bool frame = true)
  {
    state.grasps.push_back(makeGrasp(*model, state, first, last, frame));
    inputs.grasps.push_back({state.grasps.back().X_WG, std::nullopt});
    return static_cast<int>(state.grasps.size()) - 1;
  }
  double weight() const { return model->totalMass() * inputs.gravity.norm(); }
  Vector3d momentum() const { return state.v * model->mass; }
  Vector3d angularMomentum() const
  {
    Vector3d sum = Vector3d::Zero();
    for (int i = 0; i < model->nodes(); ++i)
      sum += model->mass[i] * state.x.col(i).cross(state.v.col(i));
    return sum;
  }
};

/// A straight rod of `length` along x with the given section, at rest, no gravity.
inline Rod straightRod(int n, double length, const RodSection& section)
{
  const Matrix3Xd nodes = straightNodes(n, length);
  Rod rod(openRod(nodes, section), nodes);
  rod.inputs.gravity.setZero();
  return rod;
}

inline TimeConfig withIntegrator(Integrator integrator)
{
  TimeConfig time;
  time.integrator = integrator;
  return time;
}

inline const std::vector<Integrator>& implicitIntegrators()
{
  static const std::vector<Integrator> all = {Integrator::implicit_euler, Integrator::bdf2, Integrator::tr_bdf2,
                                              Integrator::implicit_midpoint, Integrator::generalized_alpha};
  return all;
}

inline const std::vector<Integrator>& allIntegrators()
{
  static const std::vector<Integrator> all = [] {
    std::vector<Integrator> v = implicitIntegrators();
    v.push_back(Integrator::symplectic_euler);
    return v;
  }();
  return all;
}

/// Every number of two states the same, to the last bit.
inline bool bitEqual(const RodState& a, const RodState& b)
{
  const auto same = [](const auto& p, const auto& q) {
    return p.rows() == q.rows() && p.cols() == q.cols() && (p.array() == q.array()).all();
  };
  if (a.grasps.size() != b.grasps.size())
    return false;
  for (std::size_t k = 0; k < a.grasps.size(); ++k)
  {
    const GraspState &g = a.grasps[k], &h = b.grasps[k];
    if (g.active != h.active || g.X_WG.position != h.X_WG.position ||
        g.X_WG.orientation.coeffs() != h.X_WG.orientation.coeffs() || g.velocity.linear != h.velocity.linear ||
        g.velocity.angular != h.velocity.angular || g.section_twist[0] != h.section_twist[0] ||
        g.section_twist[1] != h.section_twist[1])
      return false;
  }
  return same(a.x, b.x) && same(a.v, b.v) && same(a.d1, b.d1) && same(a.twist, b.twist) && a.last_step == b.last_step &&
         a.next_step == b.next_step && same(a.a, b.a) && same(a.x_previous, b.x_previous) &&
         same(a.v_previous, b.v_previous) && same(a.strain_rate, b.strain_rate) &&
         same(a.strain_rate_previous, b.strain_rate_previous) && same(a.strain_previous, b.strain_previous);
}

}   // namespace slender::test
