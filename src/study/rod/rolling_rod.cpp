// A rod and a viscous thread that lie across a slope. Friction turns them about their tangents, so that they roll as a
// full cylinder does, with 2/3 g sin(slope), or slide where the slope is more than three times the coefficient.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/study/study.h"

namespace slender::study {
namespace {

constexpr double kWeight = 9.81;        // [m/s^2]
constexpr double kTubeRadius = 0.005;   // [m]

struct Roller
{
  const char* name;
  bool thread;
  const char* integrator;   // of the rod
  double slope;             // [rad]
  double friction;
};

/// The floor is level and gravity is inclined instead. The curve lies along y, a third of the gap above the floor.
Simulation onSlope(const Roller& roller)
{
  constexpr double kGap = 0.0001;
  std::ostringstream text;
  text.precision(17);
  const double height = kTubeRadius + kGap / 3;
  text << "time: {step: 0.002, duration: 10";
  if (!roller.thread)
    text << ", integrator: " << roller.integrator;
  text << "}\ncontact: {gap: " << kGap << "}\ngravity: [" << kWeight * std::sin(roller.slope) << ", 0, "
       << -kWeight * std::cos(roller.slope)
       << "]\nobstacles:\n  - {name: floor, shape: {plane: {}}, friction: " << roller.friction << "}\n";
  std::ostringstream line;
  line << "    centerline: {straight: {from: [0, -0.05, " << height << "], to: [0, 0.05, " << height
       << "], edges: 10}}\n";
  const std::string contact = "    contact: {friction: " + std::to_string(roller.friction) + "}\n";
  if (roller.thread)
    text << "threads:\n  - name: curve\n    fluid: {density: 1000, viscosity: 1000}\n    radius: " << kTubeRadius
         << "\n"
         << line.str() << contact;
  else
    text << "rods:\n  - name: curve\n    material: {density: 1000, youngs_modulus: 1e7, poissons_ratio: 0.45}\n    "
            "cross_section: {radius: "
         << kTubeRadius << "}\n"
         << line.str() << contact;
  return Simulation(parseScene(text.str()));
}

/// Mean acceleration down the slope, from 0.1 s on, when gaps have taken up the weight [m/s^2].
double acceleration(const Roller& roller, double seconds)
{
  Simulation s = onSlope(roller);
  const auto speed = [&] {
    return roller.thread ? s.state().threads[0].threads[0].v[5].x() : s.state().rods[0].v(0, 5);
  };
  double start = 0.0;
  const double step = s.config().time.step;
  const int last = static_cast<int>(std::round(seconds / step)), first = static_cast<int>(std::round(0.1 / step));
  for (int k = 0; k < last; ++k)
  {
    if (k == first)
      start = speed();
    if (const StepReport report = s.step(s.defaultInputs()); !report.ok)
      throw std::runtime_error(std::string(roller.name) + ": " + report.message);
  }
  return (speed() - start) / ((last - first) * step);
}

void runRollingRod(StudyContext& context)
{
  constexpr double kBound = 0.01;   // of the acceleration
  const Roller rollers[] = {
      {"rod, implicit_euler", false, "implicit_euler", 0.2, 0.3},
      {"rod, bdf2", false, "bdf2", 0.2, 0.3},
      {"rod, tr_bdf2", false, "tr_bdf2", 0.2, 0.3},
      {"rod, steep", false, "implicit_euler", 0.7, 0.4},
      {"rod slides", false, "implicit_euler", 0.7, 0.2},
      {"thread", true, "", 0.2, 0.3},
      {"thread slides", true, "", 0.7, 0.2},
  };
  for (const Roller& roller : rollers)
  {
    const double rolls = 2.0 / 3.0 * std::sin(roller.slope),
                 slides = std::sin(roller.slope) - roller.friction * std::cos(roller.slope),
                 expected = kWeight * std::max(rolls, slides);
    context.row()
        .set("curve", roller.name)
        .set("slope_rad", roller.slope)
        .set("friction", roller.friction)
        .check(acceleration(roller, context.quick() ? 0.3 : 1.0), expected, kBound * expected,
               rolls > slides ? "2/3 g sin(slope)" : "g (sin(slope) - mu cos(slope))");
  }
}

const StudyRegistration kRollingRodRegistration{
    "rolling_rod", "a rod and a thread roll across a slope as a cylinder does, or slide", runRollingRod};

}   // namespace
}   // namespace slender::study
