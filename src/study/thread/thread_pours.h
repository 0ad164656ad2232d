#pragma once

#include <string>
#include <vector>

#include "slender_sim/study/study.h"
#include "slender_sim/thread/thread_flow.h"
#include "slender_sim/thread/thread_state.h"

namespace slender::study {

/// Gravity of all pours [m/s^2].
constexpr double kPourGravity = 9.81;

struct Fluid
{
  const char* name;
  double density, viscosity, surface_tension;   ///< [kg/m^3], [Pa s], [N/m]
};

/// A nozzle that points down, above a floor.
struct Outlet
{
  double diameter, height, speed;   ///< of the nozzle [m], above the floor [m], of the fluid in the nozzle [m/s]
  double area() const { return 0.25 * M_PI * diameter * diameter; }
  double flow() const { return area() * speed; }   ///< [m^3/s]
};

/// Formats as std::printf does.
std::string formatted(const char* format, ...);

/// A scene in which no key says how the thread is resolved. `more_nozzle` and `more_floor` are further keys of those
/// two maps.
std::string pouredScene(const Fluid& fluid, const Outlet& outlet, double step, const std::string& more_nozzle = "",
                        const std::string& more_floor = "");

/// What forms where the fluid lands, as the reader of scenes estimates it.
Landing landingOf(const Fluid& fluid, const Outlet& outlet);

/// Edges per turn of a circle of the given radius [m], from the mean length of the youngest edges that lie on the
/// floor. 0: none lies there.
double edgesPerTurn(const ThreadState& thread, double radius);

/// Pours every fluid out of every nozzle: rows, and metrics of what came out.
void pourAll(StudyContext& context);

}   // namespace slender::study
