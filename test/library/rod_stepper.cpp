// The same cord without a scene: model, state and stepper.
#include <cstdio>

#include <slender_sim/geometry/curves.h>
#include <slender_sim/rod/rod_stepper.h>

using namespace slender;

int main()
{
  const double radius = 0.005, area = M_PI * radius * radius, youngs = 3.0e6, shear = youngs / 3;
  const Eigen::Matrix2d bending = Eigen::Matrix2d::Identity() * youngs * area * radius * radius / 4;
  const RodSection section{radius, radius, 1100 * area, youngs * area, bending, shear * area * radius * radius / 2};
  const Eigen::Matrix3Xd nodes = straightCurve({0, 0, 0}, {0.5, 0, 0}, 40);
  const Eigen::Vector3d any_normal = Eigen::Vector3d::Zero();
  const JointOptions joints{Curvature::compensated};   // as scenes have it
  const auto model = std::make_shared<const RodModel>(
      buildRod("cord", nodes, false, std::vector<RodSection>(40, section), any_normal, true, joints));

  RodState state = makeRodState(*model, nodes, any_normal);
  state.grasps.push_back(makeGrasp(*model, state, 0, 0, true));   // clamps the first edge at node 0
  RodInputs inputs;
  inputs.grasps.push_back({state.grasps[0].X_WG, {}});
  RodStepper stepper(model, TimeConfig());
  for (int step = 0; step < 200; ++step)
  {
    inputs.grasps[0].X_WG.position.z() += 0.1 / 200;
    const StepReport report = stepper.step(state, inputs, 0.005);
    if (!report.ok)
      return std::fprintf(stderr, "%s\n", report.message.c_str()), 1;
  }
  std::printf("the free end is at %.3f %.3f %.3f\n", state.x(0, 40), state.x(1, 40), state.x(2, 40));
}
