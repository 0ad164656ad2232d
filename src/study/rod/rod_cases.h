#pragma once

#include <memory>
#include <string>
#include <vector>

#include "slender_sim/rod/rod_model.h"
#include "slender_sim/rod/rod_state.h"
#include "slender_sim/rod/rod_stepper.h"

namespace slender::study {

/// A straight rod along x from the origin, y its first director; stiffnesses given directly.
struct RodCase
{
  double length = 1.0;   ///< [m]
  int edges = 40;
  double radius = 1e-3;             ///< [m] (only for the record: stiffnesses are those below)
  double linear_density = 1.0;      ///< [kg/m]
  double stretch = 1e7;             ///< E A [N]
  double bend = 1.0;                ///< E I [N m^2]
  double twist = 1.0 / 1.3;         ///< G J [N m^2]; nu = 0.3
  double mass_damping = 0.0;        ///< [1/s]
  double stiffness_damping = 0.0;   ///< [s]
  double drag = 0.0;                ///< [N s/m^2]: force per length and velocity
};

/// Solid circular section: EA = E pi r^2, EI = E pi r^4/4, GJ = EI/(1+nu).
RodCase circularRod(double length, double radius, double youngs_modulus, double poissons_ratio, double density,
                    int edges);

/// Model, state and inputs of one rod that belong together.
struct RodSetup
{
  std::shared_ptr<const RodModel> model;
  RodState state;
  RodInputs inputs;

  /// Takes hold of nodes first..last where they are; returns the grasp's index.
  int hold(int first_node, int last_node, bool holds_frame);
  Eigen::Vector3d tip() const { return state.x.col(state.x.cols() - 1); }
};

/// The rod at rest in its straight shape; no grasps, no gravity.
RodSetup straightRod(const RodCase& rod_case, double total_twist = 0.0);

/// The rod (naturally straight) at rest at `nodes`, which have the rest spacing; no grasps, no gravity.
RodSetup shapedRod(const RodCase& rod_case, const Eigen::Matrix3Xd& nodes, double total_twist = 0.0);

/// Largest |velocity| of a node [m/s].
double fastestNode(const RodState& state);
bool isFinite(const RodState& state);

/// Throws std::runtime_error with `what` and the report's message unless report.ok.
void require(const StepReport& report, const std::string& what);

/// Steps until no node moves faster than `speed` [m/s]. Returns an empty string, or why it has not come to rest.
std::string settle(RodStepper& stepper, RodSetup& rod, double step, double speed, int max_steps);

/// TimeConfig with this integrator and step, and a Newton tolerance (fraction of the shortest edge).
TimeConfig timeConfig(Integrator integrator, double step, double tolerance = 1e-6);

/// log2(coarse / fine): order seen when the resolution doubles.
double observedOrder(double coarse_error, double fine_error);

/// Slope of log y against log x by least squares.
double logSlope(const std::vector<double>& x, const std::vector<double>& y);

/// All implicit integrators, in the order of the enumeration.
const std::vector<Integrator>& implicitIntegrators();

/// True for the methods of second order.
bool isSecondOrder(Integrator integrator);

}   // namespace slender::study
