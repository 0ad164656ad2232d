#include "slender_sim/scene/crossing_watch.h"

#include <algorithm>

#include "slender_sim/contact/distance.h"
#include "slender_sim/contact/solids.h"
#include "slender_sim/dynamics/failure_place.h"

namespace slender {

namespace {

constexpr std::uint64_t kBetweenCurves = 4;   // steps; bodies may be fast, and are looked at in each step

std::string timeOf(const Simulation& simulation) { return " (t = " + shortNumber(simulation.state().time, 6) + " s)"; }

}   // namespace

CrossingWatch::CrossingWatch(const Simulation& simulation) : simulation_(simulation)
{
  const SceneConfig& scene = simulation.config();
  std::vector<int> without, with;
  const auto add = [&](Kind kind, const char* word, const auto& list) {
    for (std::size_t k = 0; k < list.size(); ++k)
    {
      (list[k].contact ? with : without).push_back(static_cast<int>(objects_.size()));
      objects_.push_back({kind, static_cast<int>(k), std::string(word) + " '" + list[k].name + "'"});
    }
  };
  add(Kind::rod, "rod", scene.rods);
  add(Kind::thread, "thread", scene.threads);
  add(Kind::cloth, "cloth", scene.cloths);
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    if (const BodyConfig& body = scene.bodies[b]; body.isSimulatedSolid())
    {
      with.push_back(static_cast<int>(objects_.size()));
      objects_.push_back({Kind::body, static_cast<int>(b), "body '" + body.name + "'"});
    }
  for (const int a : without)
    for (const int b : with)
    {
      const Object &first = objects_[a], &second = objects_[b];
      const bool cloths = first.kind == Kind::cloth && second.kind == Kind::cloth;
      if (!cloths &&
          !(first.kind == Kind::rod && second.kind == Kind::body && scene.bodies[second.index].isWeldedTo(first.index)))
        pairs_.push_back({a, b});
    }
  const WorldModel& model = simulation.world().model();
  for (std::size_t r = 0; r < model.rods.size(); ++r)
    if (const WorldModel::Rod& rod = model.rods[r]; rod.contact)
      pairHeld(Kind::rod, static_cast<int>(r), std::max(rod.model->radius_a.maxCoeff(), rod.model->radius_b.maxCoeff()),
               rod.ignored);
  for (std::size_t c = 0; c < model.cloths.size(); ++c)
    if (const WorldModel::Cloth& cloth = model.cloths[c]; cloth.contact)
      pairHeld(Kind::cloth, static_cast<int>(c), 0.5 * cloth.contact->thickness, cloth.ignored);
}

void CrossingWatch::pairHeld(Kind kind, int index, double reach, const std::vector<IgnoredSolid>& ignored)
{
  const SceneConfig& scene = simulation_.config();
  const auto object = std::find_if(objects_.begin(), objects_.end(),
                                   [&](const Object& o) { return o.kind == kind && o.index == index; });
  const auto add = [&](int obstacle, int body, const Shape& shape) {
    held_.push_back(
        {static_cast<int>(object - objects_.begin()), obstacle, body, reach, boundingRadius(shape), &ignored});
  };
  for (int k = 0; k < static_cast<int>(scene.obstacles.size()); ++k)
    add(k, -1, scene.obstacles[k].shape);
  for (int b = 0; b < static_cast<int>(scene.bodies.size()); ++b)
    if (const BodyConfig& body = scene.bodies[b];
        body.motion && body.isSolid() && !(kind == Kind::rod && body.isWeldedTo(index)))
      add(-1, b, *body.shape);
}

CrossingWatch::Pieces CrossingWatch::piecesOf(const Object& object) const
{
  Pieces out;
  const WorldState& state = simulation_.state();
  if (object.kind == Kind::rod)
  {
    const RodModel& model = simulation_.rodModel(object.index);
    const Eigen::Matrix3Xd& x = state.rods[object.index].x;
    for (int j = 0; j < model.edges(); ++j)
      out.segments.emplace_back(x.col(j), x.col((j + 1) % model.nodes()));
    out.radius = std::min(model.radius_a.minCoeff(), model.radius_b.minCoeff());
  }
  if (object.kind == Kind::thread)
    for (const ThreadState& thread : state.threads[object.index].threads)
      for (int j = 0; j < thread.edges(); ++j)
      {
        const double radius = thread.radius(j);
        out.radius = out.segments.empty() ? radius : std::min(out.radius, radius);
        out.segments.emplace_back(thread.x[j], thread.x[j + 1]);
      }
  if (object.kind == Kind::cloth)
  {
    const Eigen::Matrix3Xd& x = state.cloths[object.index].x;
    const auto& edges = simulation_.clothModel(object.index).topology.edges;
    for (Eigen::Index e = 0; e < edges.cols(); ++e)
      out.segments.emplace_back(x.col(edges(0, e)), x.col(edges(1, e)));
    out.radius = 0.5 * ContactProperties().thickness;
  }
  return out;
}

bool CrossingWatch::meets(const Pieces& pieces, const Object& other) const
{
  if (other.kind == Kind::body)
  {
    const Shape& shape = *simulation_.config().bodies[other.index].shape;
    const WorldModel::Body& body = simulation_.world().model().bodies[other.index];
    const Pose pose = simulation_.state().bodies[other.index].X_WB * body.X_BS;
    const double reach = boundingRadius(shape) + pieces.radius;
    return std::any_of(pieces.segments.begin(), pieces.segments.end(), [&](const auto& s) {
      return pointSegmentDistance(pose.position, s.first, s.second) < reach &&
             distanceToShape(shape, pose, s.first, s.second) < pieces.radius;
    });
  }
  const Pieces others = piecesOf(other);
  const double radii = pieces.radius + others.radius;
  for (const auto& [a, b] : pieces.segments)
    for (const auto& [c, d] : others.segments)
      if ((a + b - c - d).norm() < (a - b).norm() + (c - d).norm() + 2.0 * radii && segmentDistance(a, b, c, d) < radii)
        return true;
  return false;
}

std::vector<std::string> CrossingWatch::check()
{
  std::vector<std::string> found;
  const bool curves = simulation_.state().steps % kBetweenCurves == 0;
  Pieces pieces;
  int of = -1;   // the object of these pieces
  for (auto pair = pairs_.begin(); pair != pairs_.end();)
  {
    const Object &without = objects_[pair->without], &other = objects_[pair->other];
    const bool due = curves || other.kind == Kind::body;
    if (due && of != pair->without)
    {
      pieces = piecesOf(without);
      of = pair->without;
    }
    if (!due || !meets(pieces, other))
    {
      ++pair;
      continue;
    }
    found.push_back(without.name + " has no contact and passes through " + other.name + timeOf(simulation_) +
                    "; give it the key contact if they shall touch");
    pair = pairs_.erase(pair);
  }
  checkHeld(found);
  return found;
}

/// Points that grasps hold at prescribed places, by number.
std::vector<int> CrossingWatch::heldPoints(const Object& object) const
{
  if (object.kind == Kind::cloth)
    return simulation_.state().cloths[object.index].pins;
  std::vector<int> points;
  for (const GraspState& grasp : simulation_.state().rods[object.index].grasps)
    for (int i = grasp.first_node; grasp.active && grasp.body < 0 && i <= grasp.last_node; ++i)
      points.push_back(i);
  return points;
}

void CrossingWatch::checkHeld(std::vector<std::string>& found)
{
  held_inside_.clear();
  const WorldState& state = simulation_.state();
  std::vector<int> points;
  const Object* of = nullptr;   // of these points
  for (HeldPair& pair : held_)
  {
    const Object& object = objects_[pair.object];
    const auto& bodies = simulation_.world().model().bodies;
    const Shape& shape = pair.body < 0 ? simulation_.config().obstacles[pair.obstacle].shape : *bodies[pair.body].shape;
    const Pose pose =
        pair.body < 0 ? state.obstacles[pair.obstacle] : state.bodies[pair.body].X_WB * bodies[pair.body].X_BS;
    const Eigen::Matrix3Xd& x = object.kind == Kind::cloth ? state.cloths[object.index].x : state.rods[object.index].x;
    if (&object != of)
      points = heldPoints(object);
    of = &object;
    for (const int i : points)
    {
      const bool ignored = std::any_of(pair.ignored->begin(), pair.ignored->end(), [&](const IgnoredSolid& solid) {
        return solid.number == pair.obstacle &&
               (solid.points.empty() || solid.points[static_cast<std::size_t>(i)] != 0);
      });
      if (ignored || (x.col(i) - pose.position).norm() > pair.radius + pair.reach ||
          distanceToShape(shape, pose, x.col(i), x.col(i)) >= pair.reach)
        continue;
      held_inside_.push_back(object.name + " is held inside " +
                             (pair.body < 0 ? "obstacle '" + simulation_.config().obstacles[pair.obstacle].name
                                            : "body '" + simulation_.config().bodies[pair.body].name) +
                             "', " + (object.kind == Kind::cloth ? "vertex " : "node ") + std::to_string(i) + " at " +
                             metres(x.col(i)));
      if (!pair.told)
        found.push_back(held_inside_.back() + timeOf(simulation_) + "; held points pass through it, free ones do not");
      pair.told = true;
      break;
    }
  }
}

}   // namespace slender
