#include "rod_cases.h"

#include <cmath>
#include <stdexcept>

namespace slender::study {

RodCase circularRod(double length, double radius, double youngs_modulus, double poissons_ratio, double density,
                    int edges)
{
  const double area = M_PI * radius * radius;
  RodCase c;
  c.length = length;
  c.edges = edges;
  c.radius = radius;
  c.linear_density = density * area;
  c.stretch = youngs_modulus * area;
  c.bend = youngs_modulus * area * radius * radius / 4;
  c.twist = c.bend / (1 + poissons_ratio);
  return c;
}

int RodSetup::hold(int first_node, int last_node, bool holds_frame)
{
  state.grasps.push_back(makeGrasp(*model, state, first_node, last_node, holds_frame));
  inputs.grasps.push_back({state.grasps.back().X_WG, {}});
  return static_cast<int>(state.grasps.size()) - 1;
}

RodSetup straightRod(const RodCase& rod_case, double total_twist)
{
  Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, rod_case.edges + 1);
  nodes.row(0).setLinSpaced(rod_case.edges + 1, 0.0, rod_case.length);
  return shapedRod(rod_case, nodes, total_twist);
}

RodSetup shapedRod(const RodCase& c, const Eigen::Matrix3Xd& nodes, double total_twist)
{
  RodSection section{};
  section.a = section.b = c.radius;
  section.linear_density = c.linear_density;
  section.stretch_modulus = c.stretch;
  section.bend_modulus = c.bend * Eigen::Matrix2d::Identity();
  section.twist_modulus = c.twist;
  const std::vector<RodSection> sections(static_cast<std::size_t>(c.edges), section);
  const Eigen::Vector3d director = Eigen::Vector3d::UnitY();

  RodModel model = buildRod("study", nodes, false, sections, director, true);
  model.mass_damping = c.mass_damping;
  model.stiffness_damping = c.stiffness_damping;
  if (c.drag > 0)
    model.drag = model.mass * (c.drag / c.linear_density);   // Voronoi length is mass over linear density

  RodSetup rod;
  rod.state = makeRodState(model, nodes, director, total_twist);
  rod.model = std::make_shared<const RodModel>(std::move(model));
  rod.inputs.gravity.setZero();
  return rod;
}

double fastestNode(const RodState& state) { return std::sqrt(state.v.colwise().squaredNorm().maxCoeff()); }

bool isFinite(const RodState& state)
{
  bool finite = state.x.allFinite() && state.v.allFinite() && state.d1.allFinite() && state.twist.allFinite();
  for (const GraspState& g : state.grasps)
    finite = finite && g.X_WG.position.allFinite() && g.X_WG.orientation.coeffs().allFinite();
  return finite;
}

void require(const StepReport& report, const std::string& what)
{
  if (!report.ok)
    throw std::runtime_error(what + ": " + toString(report.failure) + ": " + report.message);
}

std::string settle(RodStepper& stepper, RodSetup& rod, double step, double speed, int max_steps)
{
  for (int i = 0; i < max_steps; ++i)
  {
    const StepReport report = stepper.step(rod.state, rod.inputs, step);
    if (!report.ok)
      return report.message;
    if (fastestNode(rod.state) < speed)
      return "";
  }
  return "has not settled after " + std::to_string(max_steps) + " steps";
}

TimeConfig timeConfig(Integrator integrator, double step, double tolerance)
{
  TimeConfig time;
  time.integrator = integrator;
  time.step = step;
  time.newton.tolerance = tolerance;
  return time;
}

double observedOrder(double coarse_error, double fine_error)
{
  return std::log2(std::abs(coarse_error) / std::abs(fine_error));
}

double logSlope(const std::vector<double>& x, const std::vector<double>& y)
{
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
  {
    const double u = std::log(x[i]), v = std::log(y[i]);
    sx += u;
    sy += v;
    sxx += u * u;
    sxy += u * v;
  }
  const double n = static_cast<double>(x.size());
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

const std::vector<Integrator>& implicitIntegrators()
{
  static const std::vector<Integrator> all = {Integrator::implicit_euler, Integrator::bdf2, Integrator::tr_bdf2,
                                              Integrator::implicit_midpoint, Integrator::generalized_alpha};
  return all;
}

bool isSecondOrder(Integrator integrator)
{
  return integrator != Integrator::implicit_euler && integrator != Integrator::symplectic_euler;
}

}   // namespace slender::study
