// Threads held between two plates that sag: the middle's path in time, and catenary or U (thesis 5.5, Fig. 5.4;
// sag_D0175.csv, sag_D0033.csv).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "study/rod/rod_cases.h"
#include "thread_cases.h"

namespace slender::study {
namespace {

struct Reference
{
  double diameter, gamma, time, sag, middle_radius, end_radius;
};

/// String model (no bending) with inertia, plates 2.5 apart.
const std::vector<Reference> kStringModel = {
    {0.175, 0.0, 0.0300, 0.44157, 0.083852, 0.082929},  {0.175, 0.0, 0.0600, 0.95563, 0.077909, 0.073392},
    {0.175, 0.0, 0.1000, 1.3472, 0.073922, 0.064344},   {0.175, 0.0, 0.1500, 1.8778, 0.071053, 0.052003},
    {0.175, 0.0, 0.2000, 2.6924, 0.068615, 0.038199},   {0.175, 20.0, 0.0300, 0.44157, 0.08409, 0.083214},
    {0.175, 20.0, 0.0600, 0.88566, 0.078774, 0.074409}, {0.175, 20.0, 0.1000, 1.2301, 0.075834, 0.066655},
    {0.175, 20.0, 0.1500, 1.5662, 0.073969, 0.056087},  {0.175, 20.0, 0.2000, 2.1649, 0.072778, 0.04429},
    {0.033, 0.0, 0.0300, 0.44157, 0.015812, 0.015638},  {0.033, 0.0, 0.0600, 0.95563, 0.014691, 0.01384},
    {0.033, 0.0, 0.1000, 1.3472, 0.013939, 0.012133},   {0.033, 0.0, 0.1500, 1.8778, 0.013398, 0.0098063},
    {0.033, 0.0, 0.2000, 2.6924, 0.012939, 0.0072032},  {0.033, 20.0, 0.0300, 0.4372, 0.01599, 0.015851},
    {0.033, 20.0, 0.0600, 0.64654, 0.015503, 0.014832}, {0.033, 20.0, 0.1000, 0.69433, 0.015698, 0.014291},
    {0.033, 20.0, 0.1500, 0.74003, 0.016019, 0.013602}, {0.033, 20.0, 0.2000, 0.77275, 0.01639, 0.012805}};

ThreadSetup heldThread(double length, double diameter, double gamma, int edges)
{
  ThreadSetup t = straightThread(length, Eigen::VectorXd::Constant(edges, 0.5 * diameter));
  t.model.density = ThesisOil::density;
  t.model.viscosity = ThesisOil::viscosity;
  t.model.surface_tension = gamma;
  t.model.limits.max_edge_length = 2 * length / edges;
  t.inputs.gravity = {0, 0, -ThesisOil::gravity};
  t.hold(0);
  t.hold(1);
  return t;
}

/// Depth and radius of the thread in the middle between the plates.
struct Middle
{
  double sag, radius;
};

Middle middleOf(const ThreadState& s, double length)
{
  for (int j = 0; j < s.edges(); ++j)
  {
    const double from = s.x[j].x() - 0.5 * length, to = s.x[j + 1].x() - 0.5 * length;
    if (from <= 0 && to > 0)
      return {-(s.x[j].z() - from / (to - from) * (s.x[j + 1].z() - s.x[j].z())), s.radius(j)};
  }
  return {std::nan(""), std::nan("")};
}

/// The lowest speed of the middle on its way down to the depth of the plates' distance, in units of rho g L^2 / mu.
double slowest(double length, double diameter, double gamma, int edges)
{
  ThreadSetup t = heldThread(length, diameter, gamma, edges);
  ThreadStepper stepper = makeStepper(t);
  const double unit = ThesisOil::viscosity / (ThesisOil::density * ThesisOil::gravity * length), h = 0.02;
  double before = 0.0, lowest = 1e300;
  while (t.time < 40 * unit)
  {
    advance(stepper, t, h * unit, "sagging");
    const double sag = middleOf(t.state, length).sag;
    if (t.time > unit && sag > 0.02 * length)   // it has got going
      lowest = std::min(lowest, (sag - before) / (h * length));
    before = sag;
    bool broken = false;
    for (int j = 0; j < t.state.edges(); ++j)
      broken = broken || t.state.radius(j) < 0.05 * diameter;
    if (sag > length || broken)
      break;
  }
  return lowest;
}

/// One thread of the reference from its start to the last time listed: its path, and its sag at the times listed.
void followPath(StudyContext& context, Plot& path, double diameter, double gamma, int edges)
{
  ThreadSetup t = heldThread(2.5, diameter, gamma, edges);
  ThreadStepper stepper = makeStepper(t);
  char label[64];
  std::snprintf(label, sizeof label, "D = %g, gamma = %g", diameter, gamma);
  context.progress(0, 1, label);
  const double h = 2e-4;
  for (const Reference& r : kStringModel)
  {
    if (r.diameter != diameter || r.gamma != gamma)
      continue;
    while (t.time < r.time - 0.5 * h)
    {
      advance(stepper, t, h, "sagging");
      path.at(label).x.push_back(t.time);
      path.at(label).y.push_back(middleOf(t.state, 2.5).sag);
    }
    const Middle middle = middleOf(t.state, 2.5);
    Row& row = context.row();
    row.set("test", label).set("t", r.time);
    if (diameter < 0.1)
      row.check(middle.sag, r.sag, 0.05 * r.sag, "string with inertia");
    else   // it resists bending and is clamped, the reference is neither
      row.set("measured", middle.sag).set("expected", r.sag);
    row.set("relative_error", middle.sag / r.sag - 1);
    row.set("middle_radius_error", middle.radius / r.middle_radius - 1);
    Series& series = path.at(std::string(label) + ", string");
    series.points = true;
    series.x.push_back(r.time);
    series.y.push_back(r.sag);
  }
}

/// A thread whose shape is to be told: L D is ratio times 4.7 a^2, where a is the capillary length.
struct Shape
{
  double length, diameter, ratio;
  double slowed_to = 0;   ///< lowest speed of the middle over that without surface tension

  // a U has all but stopped where a thread without surface tension goes on
  bool catenary() const { return slowed_to > 0.2; }
  bool agrees() const { return catenary() == (ratio > 1); }
};

void reportShape(StudyContext& context, Plot& map, const Shape& shape, double capillary)
{
  const char* name = shape.catenary() ? "catenary" : "U";
  context.row()
      .set("test", "shape")
      .set("L_over_a", shape.length / capillary)
      .set("D_over_a", shape.diameter / capillary)
      .set("L_D_over_4.7a2", shape.ratio)
      .set("slowed_to", shape.slowed_to)
      .set("shape", name)
      .set("agrees", shape.agrees() ? "yes" : "no");
  Series& s = map.at(name);
  s.points = true;
  s.x.push_back(shape.diameter / capillary);
  s.y.push_back(shape.length / capillary);
}

/// Maps the shapes of threads of several lengths and diameters; returns the fraction that disagrees with the law.
double mapShapes(StudyContext& context, Plot& map, int edges)
{
  const double capillary = std::sqrt(ThesisOil::surface_tension / (ThesisOil::density * ThesisOil::gravity));
  const std::vector<double> lengths =
      context.quick() ? std::vector<double>{1.0, 2.5} : std::vector<double>{0.6, 1.0, 1.6, 2.5, 4.0};
  const std::vector<double> ratios = context.quick() ? std::vector<double>{0.3, 0.7, 1.4, 3.0}
                                                     : std::vector<double>{0.2, 0.35, 0.6, 0.8, 1.25, 1.7, 3.0, 5.0};
  int wrong = 0, cases = 0, done = 0;
  for (const double length : lengths)
    for (const double ratio : ratios)
    {
      context.progress(done++, static_cast<int>(lengths.size() * ratios.size()), "catenary or U");
      Shape shape{length, ratio * 4.7 * capillary * capillary / length, ratio};
      if (shape.diameter > 0.25 * length)
        continue;   // no thread
      shape.slowed_to = slowest(length, shape.diameter, ThesisOil::surface_tension, edges) /
                        slowest(length, shape.diameter, 0.0, edges);
      wrong += !shape.agrees();
      ++cases;
      reportShape(context, map, shape, capillary);
    }
  for (double d = 0.1; d < 2; d *= 1.2)
  {
    map.at("L D = 4.7 a^2").x.push_back(d);
    map.at("L D = 4.7 a^2").y.push_back(4.7 / d);
  }
  return static_cast<double>(wrong) / cases;
}

}   // namespace

void runSagging(StudyContext& context)
{
  const int edges = context.quick() ? 50 : 100;
  Plot& path = context.plot("sagging_path", "Sag of the middle, plates 2.5 cm apart", "time [s]", "sag [cm]");
  path.log_x = path.log_y = false;
  for (const double diameter : {0.175, 0.033})
    for (const double gamma : {0.0, ThesisOil::surface_tension})
      followPath(context, path, diameter, gamma, edges);

  Plot& map = context.plot("sagging_shapes", "Catenary or U", "D / a", "L / a");
  const double fraction = mapShapes(context, map, edges);
  context.row().set("test", "misclassified").check(fraction, 0.0, 0.1, "L D = 4.7 a^2, Le Merrer et al. 2008");
  context.metric("misclassified_fraction", fraction);
  context.note(
      "Paths: the reference is a string; the thick thread is held back by its bending and its clamps, and its rows are "
      "no checks.");
  context.note(
      "slowed_to: lowest speed of the middle over that without surface tension; it crosses 0.2 within a tenth of L D = "
      "4.7 a^2 and zero");
  context.note("near L D = 4 a^2, where the surface tension of two vertical ends carries the weight.");
}

const StudyRegistration kSaggingRegistration{
    "sagging", "viscous threads that sag between plates: paths in time, catenary or U", runSagging};

}   // namespace slender::study
