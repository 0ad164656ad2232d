// A thread that falls from a nozzle onto a fast belt (thesis 5.5; catenary_gamma0.csv, catenary_gamma10.csv).
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "study/rod/rod_cases.h"
#include "thread_cases.h"

namespace slender::study {
namespace {

constexpr double kNozzleHeight = 3.0, kBelt = 0.7, kNozzleSpeed = 0.06, kCatenaryBound = 0.02;

struct Point
{
  double x, z, speed;
};

/// Rows `thread` of the reference (bending, vertical clamped nozzle, no inertia), every tenth of the length.
struct ReferenceRow
{
  Point without, with;   ///< surface tension: 0, 10
};
constexpr ReferenceRow kCatenaries[] = {{{0, 3, 0.06}, {0, 3, 0.06}},
                                        {{0.01438076, 2.595828, 0.1127951}, {0.03031502, 2.553635, 0.1108463}},
                                        {{0.07825042, 2.19656, 0.177465}, {0.1491785, 2.122216, 0.1730725}},
                                        {{0.1799894, 1.805055, 0.2497164}, {0.3176674, 1.707189, 0.2421377}},
                                        {{0.3084207, 1.421477, 0.3251751}, {0.5209551, 1.30813, 0.3139036}},
                                        {{0.470274, 1.050872, 0.3997248}, {0.769758, 0.9359228, 0.3847472}},
                                        {{0.6774262, 0.7037547, 0.4699576}, {1.070091, 0.6040781, 0.452133}},
                                        {{0.9410097, 0.3976945, 0.5337534}, {1.422842, 0.3289028, 0.5151485}},
                                        {{1.267775, 0.1611389, 0.5910452}, {1.823333, 0.1299488, 0.5749393}},
                                        {{1.648193, 0.02804899, 0.6446511}, {2.257466, 0.02287093, 0.6348531}},
                                        {{2.051164, 0, 0.7}, {2.704545, 0, 0.7}}};

std::vector<Point> referenceOf(double gamma)
{
  std::vector<Point> points;
  for (const ReferenceRow& row : kCatenaries)
    points.push_back(gamma > 0 ? row.with : row.without);
  return points;
}

ThreadSetup draggedThread(double gamma, double feed)
{
  ThreadModel m;
  m.name = "catenary";
  m.density = 0.996;
  m.viscosity = 273.6;
  m.surface_tension = gamma;
  m.surface_shape = SurfaceShape::cylinder;
  m.nozzle_diameter = 0.8;
  m.feed_length = feed;
  m.limits.max_edge_length = 4 * feed;
  m.floor = {true, 0.0, false};
  m.limits.scene.max().x() = 8.0;
  ThreadSetup t = nozzleThread(m, {0, 0, kNozzleHeight}, kNozzleSpeed);
  t.inputs.gravity = {0, 0, -100};
  t.inputs.belt_velocity = {kBelt, 0, 0};
  return t;
}

/// Distance of a point from the thread, and the speed there.
double distance(const ThreadState& s, const Point& p, double* speed)
{
  double best = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d at(p.x, 0, p.z);
  for (int j = 0; j < s.edges(); ++j)
  {
    const Eigen::Vector3d e = s.edge(j);
    const double f = std::clamp((at - s.x[j]).dot(e) / e.squaredNorm(), 0.0, 1.0), d = (at - s.x[j] - f * e).norm();
    if (d < best)
    {
      best = d;
      *speed = ((1 - f) * s.v[j] + f * s.v[j + 1]).norm();
    }
  }
  return best;
}

struct Dragged
{
  double error = 0, speed_error = 0, change = 0;
  ThreadState state;
};

Dragged drag(double gamma, double feed, double h, const std::vector<Point>& reference)
{
  ThreadSetup t = draggedThread(gamma, feed);
  ThreadStepper stepper = makeStepper(t);
  while (t.time <
         300.0)   // the draw ratio of 11.7 is not far below that of draw resonance, 20.2: disturbances die out slowly
    advance(stepper, t, h, "dragged_catenary");
  Dragged o;
  // nodes land one by one: the mean of what the passage of some edges shows
  const int samples = static_cast<int>(std::lround(4.0 / h));
  std::vector<double> d(reference.size(), 0.0), u(reference.size(), 0.0);
  for (int k = 0; k < samples; ++k)
  {
    advance(stepper, t, h, "dragged_catenary");
    for (std::size_t i = 0; i < reference.size(); ++i)
    {
      double speed = 0;
      const double away = distance(t.state, reference[i], &speed);
      d[i] = std::max(d[i], away);
      u[i] += speed / samples;
    }
  }
  for (std::size_t i = 0; i < reference.size(); ++i)
  {
    o.error = std::max(o.error, d[i]);
    o.speed_error = std::max(o.speed_error, std::abs(u[i] / reference[i].speed - 1));
  }
  o.state = t.state;
  return o;
}

}   // namespace

void runDraggedCatenary(StudyContext& context)
{
  const double feed = context.quick() ? 0.02 : 0.01, h = 0.02;
  Plot& plot = context.plot("dragged_catenary", "Thread dragged by a belt", "x [cm]", "z [cm]");
  plot.log_x = plot.log_y = false;
  plot.markers = false;
  plot.equal_axes = true;
  for (const double gamma : {0.0, 10.0})
  {
    const std::vector<Point> reference = referenceOf(gamma);
    const std::string test = "gamma " + std::to_string(static_cast<int>(gamma));
    context.progress(gamma > 0, 2, test);
    const Dragged seen = drag(gamma, feed, h, reference);
    Row& row = context.row();
    row.set("test", test).set("quantity", "largest distance from the reference, over the drop height");
    row.check(seen.error / kNozzleHeight, 0.0, kCatenaryBound, "boundary-value problem with bending, clamped nozzle")
        .set("largest_relative_error_of_speed", seen.speed_error);
    row.set("nodes", seen.state.nodes());
    for (const Eigen::Vector3d& x : seen.state.x)
      if (x.x() < 3)
      {
        plot.at(test).x.push_back(x.x());
        plot.at(test).y.push_back(x.z());
      }
    Series& series = plot.at(test + ", reference");
    series.points = true;
    for (const Point& p : reference)
    {
      series.x.push_back(p.x);
      series.y.push_back(p.z);
    }
  }
}

const StudyRegistration kDraggedCatenaryRegistration{
    "dragged_catenary", "a viscous thread that falls onto a fast belt, with and without surface tension",
    runDraggedCatenary};

}   // namespace slender::study
