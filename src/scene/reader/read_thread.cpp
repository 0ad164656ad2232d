#include "generators.h"
#include "read_parts.h"
#include "slender_sim/geometry/rotation.h"
#include "slender_sim/scene/shapes.h"

/// Viscous threads, their nozzles and floors.
namespace slender {

namespace {

/// A number, {table: [[t, value], ...]} or {topic: true, initial: value}.
TimedNumber readTimed(const YamlCursor& at, const Range& range)
{
  TimedNumber timed;
  at.sharesKeysOf("threads.N.nozzle.flow");
  const auto constant = [](double value) { return NumberTable({{0.0, value}}); };
  if (!at.isMap())
  {
    timed.table = constant(at.number(range).value_or(0.0));
    return timed;
  }
  YamlMap map(at);
  const YamlCursor topic = map.get("topic", "Must be true: the value comes by messages.");
  const YamlCursor initial = map.get("initial", "Value until the first message. Without the key: 0.");
  const YamlCursor table =
      map.get("table", "Values over time: rows [t, value] with t in s. Values between rows are interpolated.");
  initial.takes("a number in the range of the key above");
  map.finish();
  if (!map.hasOne({topic, table}, "must be a number, {table: [[t, value], ...]} or {topic: true, initial: value}"))
    return timed;
  if (table.present() && initial.present())
  {
    initial.problem("is for values by messages; a table begins with its own first value");
  }
  else if (topic.present())
  {
    timed.topic = topic.boolean().value_or(true);
    if (!timed.topic)
      topic.problem("must be true; without a topic it is written as a number");
    timed.table = constant(initial.number(range).value_or(0.0));
  }
  else
  {
    std::vector<NumberTable::Entry> entries;
    table.takes("rows [t, value]");
    for (const YamlCursor& row : table.items(1))
    {
      const auto pair = row.items(2, 2);
      const auto time = pair.empty() ? std::nullopt : pair[0].number(Range::closed(-1e9, 1e9, "s"));
      const auto value = pair.empty() ? std::nullopt : pair[1].number(range);
      if (time && value)
        entries.push_back({*time, *value});
    }
    table.attempt([&] { timed.table = NumberTable(std::move(entries)); });
  }
  return timed;
}

NozzleConfig readNozzle(const YamlCursor& at, const ReadContext& context, double& swirl)
{
  NozzleConfig nozzle;
  YamlMap map(at);
  map.require("diameter", nozzle.diameter, Range::above(0, 10, "m"), "Inner diameter of the nozzle.");
  const YamlCursor position =
      map.get("position", nozzle.pose.position, kCoordinate, "Centre of the outlet. Without the key: [0, 0, 0].");
  const YamlCursor direction =
      map.get("direction", "Direction of the flow out of the nozzle. Without the key: [0, 0, -1].");
  const Eigen::Vector3d along = readDirection(direction, -Eigen::Vector3d::UnitZ());
  nozzle.pose.orientation = rotationBetween(Eigen::Vector3d::UnitX(), along);
  const YamlCursor flow = map.get("flow",
                                  "Volume that leaves the nozzle per second: a number, a table over time, or values by "
                                  "messages on `nozzle/flow`. Without the key: 0, with a warning.");
  if (flow.present())
    nozzle.flow = readTimed(flow, Range::closed(0, 1e3, "m^3/s"));
  assign(nozzle.motion, readSolidMotion(map.get("motion",
                                                "How the nozzle moves: the pose has its origin at the outlet and x "
                                                "along the flow. Without the key: it stands."),
                                        context, false));
  const YamlCursor at_swirl =
      map.get("swirl", swirl, Range::closed(0, 1, "of the coil's radius"),
              "Radius of the circle in which the nozzle starts, so that the thread coils at once; it stands after the "
              "first turns of the coil. Without the key: 0, the nozzle stands.");
  if (swirl > 0 && !std::holds_alternative<FixedMotion>(nozzle.motion))
    at_swirl.problem("is for nozzles that stand; this one has a motion of its own");
  if (const auto* table = std::get_if<TableMotion>(&nozzle.motion))
  {
    if (position.present() || direction.present())
    {
      (position.present() ? position : direction)
          .problem("there is a table of poses as well; the nozzle starts at its first");
    }
    nozzle.pose = table->poses.evaluate(0.0);
  }
  return nozzle;
}

FloorConfig readFloor(const YamlCursor& at)
{
  FloorConfig floor;
  const Range speed = Range::closed(-kMaxBeltSpeed, kMaxBeltSpeed, "m/s");
  YamlMap map(at);
  map.get("height", floor.height, kCoordinate, "Height (z) of the floor. Without the key: 0.");
  const YamlCursor belt =
      map.get("belt", "Velocity of the floor: [vx, vy], or a map. Without the key: the floor stands.");
  if (belt.isMap())
  {
    YamlMap velocity(belt);
    const YamlCursor x = velocity.get("x",
                                      "Velocity along x: a number, a table over time, or values by messages on "
                                      "`belt/velocity`, each of which sets both velocities. Without the key: 0.");
    const YamlCursor y = velocity.get("y",
                                      "Velocity along y: a number, a table over time, or values by messages on "
                                      "`belt/velocity`, each of which sets both velocities. Without the key: 0.");
    const YamlCursor topic = velocity.get("topic",
                                          "Whether messages on `belt/velocity` set both velocities; `x` and `y` hold "
                                          "until the first one. Without the key: false.");
    if (x.present())
      floor.belt_x = readTimed(x, speed);
    if (y.present())
      floor.belt_y = readTimed(y, speed);
    const bool of_both = topic.present() && topic.boolean().value_or(true);
    if (!of_both && x.present() && y.present() && floor.belt_x.topic != floor.belt_y.topic)
      belt.problem(
          "one of x and y comes by messages and the other one does not, but each message on belt/velocity sets both; "
          "write topic: true beside x and y, whose numbers and tables then hold until the first message");
    if (of_both)
      floor.belt_x.topic = floor.belt_y.topic = true;
  }
  else if (belt.present())
  {
    belt.takes("[vx, vy] of numbers in [-1000, 1000] m/s");
    const auto velocity = belt.numbers(speed);
    if (velocity && velocity->size() != 2)
    {
      belt.problem("has " + std::to_string(velocity->size()) +
                   " numbers; must be [vx, vy] in m/s, or {x: ..., y: ..., topic: true}");
    }
    else if (velocity)
    {
      floor.belt_x.table = NumberTable({{0.0, (*velocity)[0]}});
      floor.belt_y.table = NumberTable({{0.0, (*velocity)[1]}});
    }
  }
  const YamlCursor on_surface =
      map.get("centreline_on_surface", floor.on_surface,
              "Whether the centreline comes to lie on the floor, instead of one radius above. Without the key: false.");
  map.get("friction", floor.friction, Range::closed(0, 100, "[-]"),
          "Coefficient of friction with which the thread slips on the floor; the thread "
          "needs `contact`. Without the key the thread sticks to the floor.");
  if (floor.friction && floor.on_surface)
    on_surface.problem("is for floors that the thread sticks to, without floor.friction");
  return floor;
}

void readEdges(const YamlCursor& at, ThreadConfig& thread)
{
  YamlMap map(at);
  const YamlCursor feed = map.get("feed", thread.feed_length, kLength,
                                  "Length of the edges that leave the nozzle. Without the key: from the flow, or one "
                                  "nozzle diameter where nothing is below.");
  map.get("longest", thread.longest_edge, kLength,
          "Length from which an edge is divided. Without the key: from the flow, about twenty edges per turn of a "
          "coil; without a nozzle or anything below it, edges are not divided.");
  const YamlCursor shortest =
      map.get("shortest", thread.shortest_edge, kLength,
              "Length below which an edge is joined to its neighbour; at most 0.4 of `longest`. Without the key: from "
              "the flow if `feed` and `longest` are not given either, otherwise edges are not joined.");
  map.get("deposited", thread.most_deposited, Range::closed(4, 10'000'000, "nodes"),
          "Number of nodes that are kept on the floor; older ones are dropped. Without the key all are kept.");
  if (feed.present() && !thread.nozzle)
    feed.problem("is for threads with a nozzle");
  if (shortest.present() && thread.longest_edge > 0 && thread.shortest_edge > 0.4 * thread.longest_edge)
  {
    shortest.problem("must be at most 0.4 of edges.longest (" + shortNumber(0.4 * thread.longest_edge) +
                     " m), or edges would be joined and divided in turn");
  }
}

/// true, false or {until: SHARE}.
void readMerging(const YamlCursor& at, ThreadConfig& thread)
{
  // distance of the centroids of the halves of a round section, over twice the radius before
  constexpr double half_discs = 0.6;
  if (!at.present())
    return;
  if (at.isMap())
  {
    YamlMap map(at);
    thread.merging = half_discs;
    map.get("until", thread.merging, Range::closed(0.05, 0.95, "of the sum of the radii"),
            "Distance of the centrelines at which merging ends. Without the key: 0.6.");
  }
  else if (at.boolean().value_or(false))
  {
    thread.merging = half_discs;
  }
  if (thread.merging > 0 && !thread.contact)
    at.problem("is for parts that touch; give the thread a contact, for example contact: {self: true}");
}

/// A thread that is there from the start: its curve, its radii and its ends.
void readThreadCurve(const YamlCursor& centerline, const YamlCursor& radius, const YamlCursor& ends,
                     const ReadContext& context, ThreadConfig& thread)
{
  thread.centerline = readCurve(centerline, context);
  thread.radius = radius.numbers(Range::above(0, 10, "m")).value_or(std::vector<double>{});
  if (!radius.present())
    radius.problem("is missing");
  if (thread.centerline && !thread.radius.empty())
  {
    radius.attempt([&] {
      perEdge(thread.radius, static_cast<int>(curveNodes(*thread.centerline, context.gravity).cols()) - 1, "radius");
    });
  }
  YamlMap held(ends);
  held.get("oldest", thread.held[0], {{"free", false}, {"held", true}},
           "Whether the oldest end is clamped where it is. Without the key: free.");
  held.get("newest", thread.held[1], {{"free", false}, {"held", true}},
           "Whether the newest end is clamped where it is. Without the key: free.");
}

void readRegion(const YamlCursor& region, ThreadConfig& thread)
{
  if (!region.present())
    return;
  YamlMap box(region);
  const YamlCursor low = box.require("from", "Lower corner of the box.");
  const YamlCursor high = box.require("to", "Upper corner of the box.");
  const Range anywhere = Range::closed(-1e9, 1e9, "m");
  const auto a = low.vector3(anywhere), b = high.vector3(anywhere);
  if (a && b && !(b->array() > a->array()).all())
    high.problem("must be greater than region.from in every component");
  else if (a && b)
    thread.region = {*a, *b};
}

}   // namespace

ThreadConfig readThread(const YamlCursor& at, const ReadContext& context, const std::string& default_name)
{
  ThreadConfig thread;
  thread.name = default_name;
  YamlMap map(at);
  map.getName(thread.name,
              "Name of the thread, which topics and tables use. Without the key: thread if there is one thread, "
              "otherwise thread0, thread1, ...");
  YamlMap fluid(map.get("fluid", "The fluid. Without the key: the defaults of the keys in it, with a warning."));
  fluid.get("density", thread.density, Range::above(0, 1e6, "kg/m^3"),
            "Mass per volume. Without the key: 1000 kg/m^3.");
  fluid.get("viscosity", thread.viscosity, Range::above(0, 1e12, "Pa s"),
            "Dynamic viscosity. Without the key: 1 Pa s.");
  fluid.get("surface_tension", thread.surface_tension, Range::closed(0, 1e3, "N/m"),
            "Surface tension. Without the key: 0.");
  fluid.finish();

  const YamlCursor nozzle =
      map.get("nozzle", "Nozzle out of which the thread flows. Give either `nozzle` or `centerline`.");
  const YamlCursor centerline = map.get("centerline",
                                        "Shape of a thread that is there at the start, from its oldest end to its "
                                        "newest. Give either `nozzle` or `centerline`.");
  const YamlCursor radius = map.get("radius",
                                    "Radius of a thread with a `centerline`: one number, two for a taper from the "
                                    "oldest end to the newest, or one per edge. It must be given there.");
  const YamlCursor ends = map.get("ends", "Ends of a thread with a `centerline`. Without the key both are free.");
  const bool one =
      map.hasOne({nozzle, centerline}, "must have either a nozzle that it flows out of, or a centerline (with radius)");
  if (one && nozzle.present())
  {
    thread.nozzle = readNozzle(nozzle, context, thread.swirl);
    for (const YamlCursor& other : {radius, ends})
      if (other.present())
        other.problem("is for threads with a centerline; the nozzle says it here");
  }
  else if (one)
  {
    readThreadCurve(centerline, radius, ends, context, thread);
  }
  const YamlCursor floor =
      map.get("floor", "Horizontal floor or belt on which the thread lands. Without the key: none.");
  if (floor.present())
    thread.floor = readFloor(floor);
  thread.contact = readContactProperties(map.get("contact",
                                                 "What the thread touches beside its floor. Without the key: nothing; "
                                                 "`contact: {}` lets it touch everything."),
                                         "threads");
  readMerging(map.get("merging",
                      "Whether parts of threads that touch flow together: true, false, or a map with `until`. It needs "
                      "`contact`. Without the key: false."),
              thread);
  if (thread.floor && thread.floor->friction && !(thread.contact && thread.contact->solids))
  {
    floor.find("friction")
        .problem(
            "makes the floor an obstacle, which this thread does not touch; give it contact: {obstacles: true}, or "
            "leave friction out, then it sticks");
  }
  readEdges(map.get("edges", "Lengths of the edges. Without the key they are chosen from the flow."), thread);
  map.get("breakup_radius", thread.breakup_radius, Range::closed(0, kMaxCoordinate, "m"),
          "Radius below which the thread parts; 0: it never parts. Without the key: 0.05 of the smallest radius that "
          "is expected from the flow (of the nozzle's radius if that is smaller); 0.01 of the nozzle's diameter if "
          "nothing is below it; 0 without a nozzle.");
  const YamlCursor region = map.get("region",
                                    "Box in which fluid is kept: what lies outside is dropped, the oldest first. "
                                    "Without the key everything is kept.");
  readRegion(region, thread);
  return thread;
}

}   // namespace slender
