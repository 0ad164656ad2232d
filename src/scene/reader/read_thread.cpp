#include <algorithm>
#include <map>
#include <stdexcept>

#include "generators.h"
#include "read_parts.h"
#include "slender_sim/scene/shapes.h"

/// Viscous threads, their nozzles and floors.
namespace slender {

namespace {

const Range length = Range::above(0, kMaxCoordinate, "m");

/// A number, {table: [[t, value], ...]} or {topic: true, initial: value}.
TimedNumber readTimed(const YamlCursor& at, const Range& range)
{
  TimedNumber timed;
  const auto constant = [](double value) { return NumberTable({{0.0, value}}); };
  if (!at.isMap())
  {
    timed.table = constant(at.number(range).value_or(0.0));
    return timed;
  }
  YamlMap map(at);
  const YamlCursor topic = map.get("topic"), initial = map.get("initial"), table = map.get("table");
  map.finish();
  if (topic.present() == table.present())
  {
    at.problem("must be a number, {table: [[t, value], ...]} or {topic: true, initial: value}");
  }
  else if (table.present() && initial.present())
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
    for (const YamlCursor& row : table.items(1))
    {
      const auto pair = row.items(2, 2);
      const auto time = pair.empty() ? std::nullopt : pair[0].number(Range::closed(-1e9, 1e9, "s"));
      const auto value = pair.empty() ? std::nullopt : pair[1].number(range);
      if (time && value)
        entries.push_back({*time, *value});
    }
    try
    {
      timed.table = NumberTable(std::move(entries));
    }
    catch (const std::invalid_argument& error)
    {
      table.problem(error.what());
    }
  }
  return timed;
}

NozzleConfig readNozzle(const YamlCursor& at, const ReadContext& context, double& swirl)
{
  NozzleConfig nozzle;
  YamlMap map(at);
  assign(nozzle.diameter, map.require("diameter").number(Range::above(0, 10, "m")));
  const YamlCursor position = map.get("position"), direction = map.get("direction");
  assign(nozzle.pose.position, position.vector3(Range::closed(-kMaxCoordinate, kMaxCoordinate, "m")));
  const Eigen::Vector3d along = readDirection(direction, -Eigen::Vector3d::UnitZ());
  nozzle.pose.orientation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), along);
  const YamlCursor flow = map.get("flow");
  if (flow.present())
    nozzle.flow = readTimed(flow, Range::closed(0, 1e3, "m^3/s"));
  assign(nozzle.motion, readSolidMotion(map.get("motion"), context, false));
  const YamlCursor at_swirl = map.get("swirl");
  assign(swirl, at_swirl.number(Range::closed(0, 1, "of the coil's radius")));
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
  map.finish();
  return nozzle;
}

FloorConfig readFloor(const YamlCursor& at)
{
  FloorConfig floor;
  const Range speed = Range::closed(-kMaxBeltSpeed, kMaxBeltSpeed, "m/s");
  YamlMap map(at);
  assign(floor.height, map.get("height").number(Range::closed(-kMaxCoordinate, kMaxCoordinate, "m")));
  const YamlCursor belt = map.get("belt");
  if (belt.isMap())
  {
    YamlMap velocity(belt);
    const YamlCursor x = velocity.get("x"), y = velocity.get("y"), topic = velocity.get("topic");
    velocity.finish();
    if (topic.present())
      floor.belt_x.topic = floor.belt_y.topic = topic.boolean().value_or(true);
    if (x.present())
    {
      const bool on_topic = floor.belt_x.topic;
      floor.belt_x = readTimed(x, speed);
      floor.belt_x.topic = floor.belt_x.topic || on_topic;
    }
    if (y.present())
    {
      const bool on_topic = floor.belt_y.topic;
      floor.belt_y = readTimed(y, speed);
      floor.belt_y.topic = floor.belt_y.topic || on_topic;
    }
  }
  else if (belt.present())
  {
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
  const YamlCursor on_surface = map.get("centreline_on_surface"), friction = map.get("friction");
  assign(floor.on_surface, on_surface.boolean());
  floor.friction = friction.number(Range::closed(0, 100, "[-]"));
  if (floor.friction && floor.on_surface)
    on_surface.problem("is for floors that the thread sticks to, without floor.friction");
  map.finish();
  return floor;
}

void readEdges(const YamlCursor& at, ThreadConfig& thread)
{
  YamlMap map(at);
  const YamlCursor feed = map.get("feed"), longest = map.get("longest"), shortest = map.get("shortest");
  assign(thread.feed_length, feed.number(length));
  assign(thread.longest_edge, longest.number(length));
  assign(thread.shortest_edge, shortest.number(length));
  assign(thread.most_deposited, map.get("deposited").integer(4, 10'000'000, "nodes"));
  if (feed.present() && !thread.nozzle)
    feed.problem("is for threads with a nozzle");
  if (shortest.present() && thread.longest_edge > 0 && thread.shortest_edge > 0.4 * thread.longest_edge)
  {
    shortest.problem("must be at most 0.4 of edges.longest (" + shortNumber(0.4 * thread.longest_edge) +
                     " m), or edges would be joined and divided in turn");
  }
  map.finish();
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
    assign(thread.merging, map.get("until").number(Range::closed(0.05, 0.95, "of the sum of the radii")));
    map.finish();
  }
  else if (at.boolean().value_or(false))
  {
    thread.merging = half_discs;
  }
  if (thread.merging > 0 && !thread.contact)
    at.problem("is for parts that touch; give the thread a contact, for example contact: {self: true}");
}

ThreadConfig readThread(const YamlCursor& at, const ReadContext& context, const std::string& default_name)
{
  ThreadConfig thread;
  thread.name = default_name;
  YamlMap map(at);
  assign(thread.name, map.get("name").name());
  YamlMap fluid(map.get("fluid"));
  assign(thread.density, fluid.get("density").number(Range::above(0, 1e6, "kg/m^3")));
  assign(thread.viscosity, fluid.get("viscosity").number(Range::above(0, 1e12, "Pa s")));
  assign(thread.surface_tension, fluid.get("surface_tension").number(Range::closed(0, 1e3, "N/m")));
  fluid.finish();

  const YamlCursor nozzle = map.get("nozzle"), centerline = map.get("centerline"), radius = map.get("radius"),
                   ends = map.get("ends");
  if (nozzle.present() == centerline.present())
  {
    at.problem("must have either a nozzle that it flows out of, or a centerline (with radius)");
  }
  else if (nozzle.present())
  {
    thread.nozzle = readNozzle(nozzle, context, thread.swirl);
    for (const YamlCursor& other : {radius, ends})
      if (other.present())
        other.problem("is for threads with a centerline; the nozzle says it here");
  }
  else
  {
    thread.centerline = readCurve(centerline, context);
    thread.radius = radius.numbers(Range::above(0, 10, "m")).value_or(std::vector<double>{});
    if (!radius.present())
      map.require("radius");
    if (thread.centerline && !thread.radius.empty())
    {
      try
      {
        perEdge(thread.radius, static_cast<int>(curveNodes(*thread.centerline, context.gravity).cols()) - 1, "radius");
      }
      catch (const std::invalid_argument& error)
      {
        radius.problem(error.what());
      }
    }
    YamlMap held(ends);
    const char* names[2] = {"oldest", "newest"};
    for (int end = 0; end < 2; ++end)
      assign(thread.held[end], held.get(names[end]).choice<bool>({{"free", false}, {"held", true}}));
    held.finish();
  }
  const YamlCursor floor = map.get("floor");
  if (floor.present())
    thread.floor = readFloor(floor);
  thread.contact = readContactProperties(map.get("contact"), "threads");
  readMerging(map.get("merging"), thread);
  if (thread.floor && thread.floor->friction && !(thread.contact && thread.contact->solids))
  {
    YamlMap(floor)
        .get("friction")
        .problem(
            "makes the floor an obstacle, which this thread does not touch; give it contact: {obstacles: true}, or "
            "leave "
            "friction out, then it sticks");
  }
  readEdges(map.get("edges"), thread);
  assign(thread.breakup_radius, map.get("breakup_radius").number(Range::closed(0, kMaxCoordinate, "m")));
  const YamlCursor region = map.get("region");
  if (region.present())
  {
    YamlMap box(region);
    const YamlCursor low = box.require("from"), high = box.require("to");
    box.finish();
    const Range anywhere = Range::closed(-1e9, 1e9, "m");
    const auto a = low.vector3(anywhere), b = high.vector3(anywhere);
    if (a && b && !(b->array() > a->array()).all())
      high.problem("must be greater than region.from in every component");
    else if (a && b)
      thread.region = {*a, *b};
  }
  map.finish();
  return thread;
}

}   // namespace

std::vector<ThreadConfig> readThreads(const YamlCursor& at, const ReadContext& context)
{
  std::vector<ThreadConfig> threads;
  if (!at.present())
    return threads;
  std::map<std::string, std::string> names;   // to the path that used it first
  const auto entries = at.items(1, 10'000);
  for (std::size_t k = 0; k < entries.size(); ++k)
  {
    threads.push_back(readThread(entries[k], context, entries.size() == 1 ? "thread" : "thread" + std::to_string(k)));
    const auto [other, is_new] = names.emplace(threads.back().name, entries[k].path());
    if (!is_new)
      YamlMap(entries[k]).get("name").problem("is also the name of " + other->second + "; names must differ");
  }
  return threads;
}

}   // namespace slender
