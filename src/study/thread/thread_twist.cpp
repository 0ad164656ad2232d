// Straight threads twisted at their ends, uniform and with a step in radius (exact_checks.csv T4).
#include <cmath>
#include <string>

#include "study/rod/rod_cases.h"
#include "thread_cases.h"

namespace slender::study {
namespace {

constexpr double kTwistedViscosity = 1000.0, kTwistedLength = 2.0, kRate = 3.0;

/// Torque about the axis on the turning end after `turns` of the thread.
double torque(const Eigen::VectorXd& radii, double h, double turns, double* twist = nullptr)
{
  ThreadSetup t = straightThread(kTwistedLength, radii);
  t.model.viscosity = kTwistedViscosity;
  t.model.density = 1e-3;
  t.hold(0);
  t.hold(1);
  const Pose start = t.inputs.ends[1];
  ThreadStepper stepper = makeStepper(t);
  const int steps = static_cast<int>(std::ceil(2 * M_PI * turns / (kRate * h)));
  for (int k = 1; k <= steps; ++k)
  {
    t.inputs.ends[1].orientation =
        Eigen::Quaterniond(Eigen::AngleAxisd(kRate * k * h, Eigen::Vector3d::UnitX())) * start.orientation;
    advance(stepper, t, h, "thread_twist");
  }
  if (twist)
  {
    *twist = 0.0;
    for (const double m : t.state.twist)
      *twist += m;
    *twist /= kRate * t.time;
  }
  return -stepper.endLoads()[1].torque.x();
}

Eigen::VectorXd stepped(int edges)
{
  Eigen::VectorXd radii(edges);
  radii << Eigen::VectorXd::Constant(edges / 2, 0.1), Eigen::VectorXd::Constant(edges - edges / 2, 0.2);
  return radii;
}

double exactStepped()
{
  return kRate /
         (0.5 * kTwistedLength * (1 / std::pow(0.1, 4) + 1 / std::pow(0.2, 4)) / (0.5 * M_PI * kTwistedViscosity));
}

}   // namespace

void runThreadTwist(StudyContext& context)
{
  const double uniform = 0.5 * M_PI * kTwistedViscosity * 1e-4 * kRate / kTwistedLength,
               step = context.quick() ? 0.02 : 0.005;
  for (const int edges : {10, 40})
  {
    double twist = 0.0;
    const double seen = torque(Eigen::VectorXd::Constant(edges, 0.1), step, 5.0, &twist);
    checkRelative(context, "uniform", "torque", seen, uniform, 0.01, "(pi/2) mu a^4 rate/L").set("edges", edges);
    checkRelative(context, "uniform", "sum of twists over turns", twist, 1.0, 1e-6, "no turn is lost in five")
        .set("edges", edges);
  }
  double errors[3];
  int k = 0;
  for (const int edges : {40, 80, 160})
  {
    const double seen = torque(stepped(edges), step, 0.1);
    errors[k++] = seen / exactStepped() - 1;
    if (edges < 160)
      context.row()
          .set("test", "half a = 0.1, half a = 0.2")
          .set("quantity", "torque")
          .set("measured", seen)
          .set("relative_error", errors[k - 1])
          .set("edges", edges);
    else
      checkRelative(context, "half a = 0.1, half a = 0.2", "torque", seen, exactStepped(), 0.01,
                    "rate / sum l_i/(pi mu a_i^4/2)")
          .set("edges", edges);
  }
  context.metric("observed_order", observedOrder(errors[1], errors[2]));
  context.note(
      "The joint at the step has the mean radius of its two edges, as in the thesis: an error of first order.");
}

const StudyRegistration kThreadTwistRegistration{
    "thread_twist", "torque of straight viscous threads twisted at a steady rate", runThreadTwist};

}   // namespace slender::study
