// Holds a cord at one end, lifts it by 0.1 m in a second, and prints where the other end is then.
#include <cstdio>
#include <slender_sim/scene/reader.h>
#include <slender_sim/scene/simulation.h>

int main()
{
  slender::Simulation simulation(slender::parseScene(R"(
    rods:
      - centerline: {straight: {from: [0, 0, 0], to: [0.5, 0, 0], edges: 40}}
        material: {density: 1100, youngs_modulus: 3.0e6}
        cross_section: {radius: 0.005}
        grasps: {hand: {edges: [0]}}
  )"));
  slender::SceneInputs inputs = simulation.defaultInputs();
  for (int step = 0; step < 200; ++step)   // of 0.005 s, unless the scene has time.step
  {
    inputs.grasps[0].X_WG.position.z() += 0.1 / 200;   // where the hand shall be at the end of the step [m]
    const slender::StepReport report = simulation.step(inputs);
    if (!report.ok)
      return std::fprintf(stderr, "%s\n", report.message.c_str()), 1;
  }
  const Eigen::Vector3d end = simulation.state().rods[0].x.rightCols<1>();
  std::printf("the free end is at %.3f %.3f %.3f\n", end.x(), end.y(), end.z());
}
