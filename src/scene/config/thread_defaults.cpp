// Edges and break-up of threads whose scene does not say them, from what the flow will form; and what to say when that
// is not resolved.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "scene/reader/read_parts.h"
#include "slender_sim/contact/solids.h"
#include "slender_sim/thread/thread_flow.h"

namespace slender {

namespace {

constexpr double kUnknown = std::numeric_limits<double>::infinity();
constexpr double kFewPerTurn = 10.0;   // edges: with fewer, frequencies of coils err by more than about 5 %
constexpr double kWideStep = 0.3;      // [rad] of a coil in a step: implicit Euler then errs by about 5 % in frequency

/// From the nozzle straight down to the first obstacle, infinite when there is none below.
double fallOnto(const std::vector<ObstacleConfig>& obstacles, const Eigen::Vector3d& from, const Eigen::Vector3d& down)
{
  constexpr double kFar = 1e3;   // [m]
  double fallen = 0.0;
  for (int k = 0; k < 200 && fallen < kFar; ++k)
  {
    double nearest = kUnknown;
    const Eigen::Vector3d at = from + fallen * down;
    for (const ObstacleConfig& obstacle : obstacles)
      nearest = std::min(nearest, distanceToShape(obstacle.shape, obstacle.pose, at, at));
    if (nearest < 1e-6 + 1e-4 * fallen)
      return fallen;
    fallen += nearest;
  }
  return kUnknown;
}

/// What a thread may go through: heights of its nozzle above what it lands on, and flows.
struct Falls
{
  std::vector<double> heights, flows;
  double least = kUnknown;   ///< of the heights
  bool flow_known = true;
};

Falls fallsOf(const SceneConfig& scene, const ThreadConfig& thread)
{
  const NozzleConfig& nozzle = *thread.nozzle;
  Falls falls;
  std::vector<Eigen::Vector3d> places{nozzle.pose.position};
  if (const auto* table = std::get_if<TableMotion>(&nozzle.motion))
  {
    constexpr int kLooks = 100;
    const double first = table->poses.firstTime(), end = std::max(first, scene.time.duration);
    for (int k = 0; k <= kLooks; ++k)
      places.push_back(table->poses.evaluate(first + (end - first) * k / kLooks).position);
  }
  const bool meets = thread.contact && thread.contact->solids && scene.gravity.norm() > 0;
  for (const Eigen::Vector3d& place : places)
  {
    double height = thread.floor ? place.z() - thread.floor->height : kUnknown;
    if (meets)
      height = std::min(height, fallOnto(scene.obstacles, place, scene.gravity.normalized()));
    falls.least = std::min(falls.least, height);
    if (height > 0 && std::isfinite(height))
      falls.heights.push_back(height);
  }
  if (!falls.heights.empty())
  {
    // Several coils may exist at heights between the lowest and the highest only. The limits of their range differ by a
    // factor of 1.3 (thin fluids) to 2.5, so heights that differ by less find it.
    constexpr int kIntervals = 16;
    const auto [lowest, highest] = std::minmax_element(falls.heights.begin(), falls.heights.end());
    const double low = *lowest, ratio = *highest / low;
    falls.heights.assign(1, low);
    for (int k = 1; k <= kIntervals && ratio > 1.0; ++k)
      falls.heights.push_back(low * std::pow(ratio, static_cast<double>(k) / kIntervals));
  }
  double least = kUnknown;
  for (const auto& [time, flow] : nozzle.flow.table.entries())
    if (flow > 0)
      least = std::min(least, flow);
  if (std::isfinite(least))
    falls.flows = {least, nozzle.flow.table.greatest()};
  else
  {
    // no flow is known: one diameter per second
    falls.flows = {0.25 * M_PI * nozzle.diameter * nozzle.diameter * nozzle.diameter};
    falls.flow_known = false;
  }
  return falls;
}

/// The finest of what the flows and heights ask for; and the tightest coil.
struct Needs
{
  EdgeChoice edges;
  Landing tightest;
  double thinnest = kUnknown, fastest = 0.0;
};

Needs needsOf(const Falls& falls, const ThreadConfig& thread, double gravity)
{
  Needs needs;
  needs.edges = {kUnknown, kUnknown, kUnknown, kUnknown, kUnknown};
  needs.tightest.coil_radius = kUnknown;
  for (const double height : falls.heights)
    for (const double flow : falls.flows)
    {
      const ThreadFall fall{thread.density, thread.viscosity, gravity, thread.nozzle->diameter, flow, height};
      const Landing landing = estimateLanding(fall);
      const EdgeChoice edges = chooseEdges(fall, landing);
      needs.edges.feed = std::min(needs.edges.feed, edges.feed);
      needs.edges.longest = std::min(needs.edges.longest, edges.longest);
      needs.edges.highest = std::min(needs.edges.highest, edges.highest);
      needs.edges.shortest = std::min(needs.edges.shortest, edges.shortest);
      needs.edges.longest_step = std::min(needs.edges.longest_step, edges.longest_step);
      if (landing.coil_radius < needs.tightest.coil_radius)
        needs.tightest = landing;
      needs.thinnest = std::min(needs.thinnest, landing.radius);
    }
  return needs;
}

/// With three digits: an estimate.
std::string about(double value) { return shortNumber(value, 3); }

/// "2.5 mm".
std::string millimetres(double length) { return about(1e3 * length) + " mm"; }

void checkHeight(const Falls& falls, const ThreadConfig& thread, const YamlCursor& at)
{
  const NozzleConfig& nozzle = *thread.nozzle;
  YamlMap map(at.find("nozzle"));
  const YamlCursor place =
      std::holds_alternative<TableMotion>(nozzle.motion) ? map.find("motion") : map.find("position");
  const double radius = 0.5 * nozzle.diameter;
  const std::string what =
      thread.floor && !(thread.contact && thread.contact->solids) ? "its floor" : "what it flows onto";
  if (!(falls.least > radius))
  {
    place.problem("brings the nozzle to " + millimetres(falls.least) + " above " + what +
                  "; must be more than its radius " + millimetres(radius) + ", or no thread forms between them");
  }
  else if (falls.least < 2 * nozzle.diameter)
  {
    place.warning("brings the nozzle to " + millimetres(falls.least) + " above " + what +
                  ", less than two of its diameters: what forms there is hardly " +
                  "a thread. Raise the nozzle, or take results as rough.");
  }
}

/// Thin fluid that comes out slowly does not form a thread: it hangs as a drop until its weight tears it off.
void checkDripping(const ThreadConfig& thread, const YamlCursor& at, double gravity)
{
  const NozzleConfig& nozzle = *thread.nozzle;
  const double flow = nozzle.flow.table.greatest(), area = 0.25 * M_PI * nozzle.diameter * nozzle.diameter;
  if (!(thread.surface_tension > 0) || !(flow > 0))
    return;
  const ThreadFall fall{thread.density, thread.viscosity, gravity, nozzle.diameter, flow, 0.0};
  const double least = leastJettingSpeed(fall, thread.surface_tension);
  if (flow < least * area)
  {
    at.find("nozzle").find("flow").problem(
        "is " + about(flow / area) +
        " m/s in the nozzle, at which so thin a fluid drips: surface tension draws it up, and no thread "
        "forms. Must be at least " +
        about(least * area) +
        " m^3/s, or the fluid more viscous, or fluid.surface_tension: 0 for the falling part alone");
  }
}

/// What was given, against what forms.
void checkGiven(const Needs& needs, const Falls& falls, const ThreadConfig& thread, const YamlCursor& at, double step)
{
  YamlMap edges(at.find("edges"));
  if (thread.feed_length > 0 && thread.feed_length > 0.5 * falls.least)
  {
    edges.find("feed").problem("is more than half of the fall of " + millimetres(falls.least) + "; must be at most " +
                               about(0.1 * falls.least) + " m for ten edges, or leave it out");
    return;
  }
  const Landing& landing = needs.tightest;
  if (!landing.slender())
  {
    at.find("nozzle").warning("a coil would be no wider than the thread (" + millimetres(landing.coil_radius) +
                              " beside a radius of " + millimetres(landing.radius) +
                              "): it falls as a jet and ends in a puddle, which is no thread. Only the falling " +
                              "part is to be trusted.");
    return;
  }
  const double longest = thread.longest_edge > 0 ? thread.longest_edge : thread.feed_length;
  if (longest > 0 && edgesPerTurn(landing, longest) < kFewPerTurn)
  {
    (thread.longest_edge > 0 ? edges.find("longest") : edges.find("feed"))
        .warning("coils of a radius of about " + millimetres(landing.coil_radius) +
                 " form at the floor, and such edges make only " + about(edgesPerTurn(landing, longest)) +
                 " per turn, too few to resolve them. Use edges.longest: " + about(needs.edges.longest) +
                 ", or leave feed, longest and shortest out.");
  }
  if (longest > 0 && landing.frequency * step > kWideStep)
  {
    edges.at().warning("the thread coils with about " + about(landing.frequency) + " rad/s, of which a step of " +
                       about(step) + " s makes " + about(landing.frequency * step) +
                       " rad, too much to resolve. Use time.step: " + about(needs.edges.longest_step) +
                       ", or leave feed, longest and shortest out, then steps are divided.");
  }
}

/// Lengths that the scene does not give.
void takeLengths(const Needs& needs, ThreadConfig& thread)
{
  const bool none = !(thread.feed_length > 0) && !(thread.longest_edge > 0) && !(thread.shortest_edge > 0);
  if (!(thread.longest_edge > 0))
  {
    thread.longest_edge =
        thread.feed_length > 0 ? std::min(thread.feed_length, needs.edges.longest) : needs.edges.longest;
    thread.highest_edge =
        std::max(thread.longest_edge,
                 thread.feed_length > 0 ? std::min(thread.feed_length, needs.edges.highest) : needs.edges.highest);
  }
  if (!(thread.feed_length > 0))
  {
    thread.feed_length =
        thread.highest_edge > 0 ? thread.highest_edge : std::min(thread.longest_edge, needs.edges.highest);
  }
  if (none)
  {
    thread.shortest_edge = needs.edges.shortest;
    thread.longest_step = std::isfinite(needs.edges.longest_step) ? needs.edges.longest_step : 0.0;
  }
}

/// The nozzle starts on a circle, turning as the coil will, until the fluid has landed and turned four times. Coils
/// form at once then, of which otherwise some turns are folds.
GivenMotion swirlOf(const Landing& landing, const NozzleConfig& nozzle, double share, double height)
{
  constexpr int kPerTurn = 12, kTurnsAfter = 4, kMostTurns = 500;
  const double speed = nozzle.flow.table.greatest() / (0.25 * M_PI * nozzle.diameter * nozzle.diameter);
  const double fall = 2.0 * height / (speed + landing.speed), turn = 2.0 * M_PI / landing.frequency;
  const int turns = std::min(kMostTurns, static_cast<int>(std::ceil(fall / turn)) + kTurnsAfter);
  const Eigen::Matrix3d section = nozzle.pose.orientation.toRotationMatrix();
  TableMotion motion;
  for (int k = 0; k <= kPerTurn * turns; ++k)
  {
    const double at = static_cast<double>(k) / kPerTurn, angle = 2.0 * M_PI * at;   // `at`: in turns
    const double radius = share * landing.coil_radius * std::min({1.0, at, turns - at});
    Pose pose = nozzle.pose;
    pose.position += radius * (std::cos(angle) * section.col(1) + std::sin(angle) * section.col(2));
    motion.poses.append(at * turn, pose);
  }
  return motion;
}

/// Sets the motion of a nozzle that swirls, or warns that it stands.
void swirl(const Falls& falls, const Needs& needs, ThreadConfig& thread, const YamlCursor& at)
{
  if (!(thread.swirl > 0))
    return;
  const YamlCursor key = at.find("nozzle").find("swirl");
  if (falls.heights.empty())
    key.warning(
        "has no effect: there is nothing below the nozzle on which a coil could form; give a floor, or leave it out");
  else if (!falls.flow_known)
    key.warning(
        "has no effect: no flow is known beforehand, and the radius of the coil follows from it; give nozzle.flow, or "
        "leave it out");
  else if (!needs.tightest.slender())
    key.warning("has no effect: a coil would be no wider than the thread; leave it out");
  else
    thread.nozzle->motion = swirlOf(needs.tightest, *thread.nozzle, thread.swirl, falls.heights.front());
}

void complete(const SceneConfig& scene, ThreadConfig& thread, const YamlCursor& at)
{
  const Falls falls = fallsOf(scene, thread);
  YamlMap map(at);
  const bool parts_given = map.has("breakup_radius");
  if (falls.flow_known)
    checkDripping(thread, at, scene.gravity.norm());
  if (!std::isfinite(falls.least))   // it falls for ever
  {
    if (!(thread.feed_length > 0))
      thread.feed_length =
          thread.longest_edge > 0 ? std::min(thread.longest_edge, thread.nozzle->diameter) : thread.nozzle->diameter;
    if (!parts_given)
      thread.breakup_radius = 0.01 * thread.nozzle->diameter;
    swirl(falls, Needs(), thread, at);
    return;
  }
  checkHeight(falls, thread, at);
  if (falls.heights.empty())
    return swirl(falls, Needs(), thread, at);
  const Needs needs = needsOf(falls, thread, scene.gravity.norm());
  if (!parts_given)
    thread.breakup_radius = 0.05 * std::min(0.5 * thread.nozzle->diameter, needs.thinnest);
  if (!falls.flow_known && thread.nozzle->flow.topic && !(thread.longest_edge > 0) && !(thread.feed_length > 0))
  {
    map.find("edges").warning("the flow comes by messages, so edges are chosen for a flow of " +
                              about(falls.flows.front()) +
                              " m^3/s. Give nozzle.flow.initial a typical flow, or edges.longest.");
  }
  if (falls.flow_known)
    checkGiven(needs, falls, thread, at, scene.time.step);
  takeLengths(needs, thread);
  swirl(falls, needs, thread, at);
}

}   // namespace

void completeThreads(SceneConfig& scene, const std::vector<YamlCursor>& at)
{
  for (std::size_t k = 0; k < scene.threads.size() && k < at.size(); ++k)
  {
    ThreadConfig& thread = scene.threads[k];
    YamlMap map(at[k]);
    if (!map.has("fluid"))
      map.find("fluid").warning(
          "is absent: water-thin or thick, the fluid decides what forms. Taken are density: 1000, viscosity: 1, "
          "surface_tension: 0.");
    if (!thread.nozzle)
      continue;
    YamlMap nozzle(map.find("nozzle"));
    if (!nozzle.has("flow"))
      nozzle.find("flow").warning(
          "is absent, so nothing flows out of the nozzle. Give it in m^3/s, or flow: {topic: true}.");
    complete(scene, thread, at[k]);
    const double most = greatestFlow(thread, scene.time.step);
    if (thread.nozzle->flow.table.greatest() > most)
    {
      nozzle.find("flow").problem(
          "is too much: over a thousand edges would leave the nozzle in one step; must be at most " +
          shortNumber(most) + " m^3/s, or with longer edges.feed or a shorter time.step more");
    }
    if (thread.breakup_radius >= 0.5 * thread.nozzle->diameter)
    {
      map.find("breakup_radius")
          .problem("must be less than the nozzle's radius " + shortNumber(0.5 * thread.nozzle->diameter) +
                   " m, or the thread would break wherever it is");
    }
    YamlMap edges(map.find("edges"));
    if (!edges.has("longest") && thread.longest_edge > 0 && thread.shortest_edge > 0.4 * thread.longest_edge)
    {
      edges.find("shortest")
          .problem("must be at most 0.4 of edges.longest (" + shortNumber(0.4 * thread.longest_edge) +
                   " m), or edges would be joined and divided in turn");
    }
  }
}

}   // namespace slender
