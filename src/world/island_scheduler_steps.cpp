// The steps of objects in islands.
#include <algorithm>
#include <stdexcept>

#include "contact/contact_potential.h"
#include "island_scheduler.h"
#include "linalg/parallel_for.h"
#include "meeting.h"
#include "slender_sim/contact/solids.h"

namespace slender {

/// An end that is held cannot give way. Returns false, and fills the report, when a solid that moves as prescribed
/// comes nearer to one than the thread is thick: no shorter step helps then.
bool IslandScheduler::endsHaveRoom(const WorldState& state, const WorldInputs& inputs, StepReport& report) const
{
  for (const ThreadObject& thread : objects_.threads)
    for (const ThreadState& strand : state.threads[thread.index].threads)
      for (int end = 0; end < 2 && thread.reach().solids; ++end)
      {
        const Eigen::Vector3d from = end ? strand.x.back() : strand.x.front(),
                              to = inputs.threads[thread.index].ends[end].position;
        const double radius = strand.radius(end ? strand.edges() - 1 : 0);
        for (std::size_t o = 0; strand.ends[end].held && o < world_.obstacles.size(); ++o)
        {
          const Obstacle& obstacle = world_.obstacles[o];
          const Pose target = normalized(inputs.obstacles[o].X_WG);
          if ((to - target.position).norm() > boundingRadius(obstacle.shape) + radius)
            continue;
          const double room = distanceToShape(obstacle.shape, target, to, to);
          if (room >= std::min(radius, distanceToShape(obstacle.shape, state.obstacles[o], from, from)))
            continue;
          const ThreadModel& model = *thread.model.model;
          report.refuse(StepFailure::squeezed,
                        "obstacle '" + obstacle.name + "' comes within " + std::to_string(1e3 * room) + " mm of the " +
                            (end && model.nozzle_diameter > 0 ? "nozzle" : "held end") + " of thread '" + model.name +
                            "', which is " + std::to_string(1e3 * radius) +
                            " mm in radius there: keep them further apart");
          return false;
        }
      }
  return true;
}

bool IslandScheduler::begin(const WorldState& state, const WorldInputs& inputs, StepReport& report)
{
  return objects_.takeInputs(state, inputs, report) && endsHaveRoom(state, inputs, report) &&
         std::all_of(objects_.all.begin(), objects_.all.end(),
                     [&](WorldObject* object) { return object->load(state, inputs, report); });
}

// ---- islands

/// Where objects would be at the end of the step if they kept their velocities.
void IslandScheduler::predict()
{
  for (std::size_t k = 0; k < objects_.all.size(); ++k)
  {
    BoundingBox& box = reach_[k].box = BoundingBox::empty();
    parts_.clear();
    objects_.all[k]->addParts(parts_);
    for (const Part* part : parts_)
    {
      box.include(part->surfaceBox(0.0));
      box.include(part->surfaceBox(world_.time.step));
    }
  }
  finder_.begin(static_cast<int>(objects_.all.size()));
  for (const auto& [rod, body] : objects_.joined)
    finder_.join(rod, body);
  finder_.joinNear(reach_, world_.contact.gap);
}

/// Takes the islands that the finder has found. Those that the step does not know yet begin theirs.
void IslandScheduler::arrange(WorldState& state, const WorldInputs& inputs)
{
  const int count = finder_.find();
  islands_.clear();
  statics_.reset();
  for (int k = 0; k < count; ++k)
  {
    finder_.partsOf(k, places_);
    auto at = known_.find(places_);
    const bool is_new = at == known_.end();
    if (is_new)
      at = known_.try_emplace(places_, objects_, places_, world_.time).first;
    islands_.push_back(&at->second);
    if (is_new || !at->second.stepped())
      at->second.begin(state, inputs);
  }
}

/// Steps large islands one after the other, each on all threads, and then the others in parallel. If one of the others
/// throws, all of them end their steps before this function throws the same.
StepReport IslandScheduler::stepIslands()
{
  StepReport total;
  const auto step = [this](ObjectIsland& island) {
    return island.stepped() ? StepReport() : island.step(world_.time.step);
  };
  for (ObjectIsland* island : islands_)
  {
    island->setThreads(island->isLarge() ? threads_ : 1);
    if (island->isLarge() && total.ok)
      total.merge(step(*island));
  }
  if (!total.ok)
    return total;
  constexpr int kWorthThreads = 500;   // nodes; a smaller step is faster on one thread than starting threads is
  reports_.resize(islands_.size());
  errors_.assign(islands_.size(), nullptr);
  parallelFor(nodes_ < kWorthThreads ? 1 : threads_, static_cast<int>(islands_.size()), 1, [&](int k) {
    try
    {
      reports_[k] = step(*islands_[k]);
    }
    catch (...)
    {
      errors_[k] = std::current_exception();
    }
  });
  for (const std::exception_ptr& error : errors_)
    if (error)
      std::rethrow_exception(error);
  for (const StepReport& report : reports_)
    total.merge(report);
  return total;
}

/// Joins islands of which objects came near each other on their ways. Returns whether there were any.
bool IslandScheduler::joinThoseThatMet()
{
  if (islands_.size() < 2)
    return false;
  for (const ObjectIsland* island : islands_)
    for (std::size_t k = 0; k < island->places().size(); ++k)
      reach_[island->places()[k]].box = island->sweptBox(k);
  return finder_.joinNear(reach_, 0.5 * world_.contact.gap);
}

StepReport IslandScheduler::stepAndJoin(WorldState& state, const WorldInputs& inputs)
{
  const bool many = known_.size() > 2 * objects_.all.size() + 16;   // then those go that the last step did not need
  for (auto at = known_.begin(); at != known_.end();)
  {
    if (many && !at->second.stepped())
    {
      at = known_.erase(at);
      continue;
    }
    at->second.forgetStep();
    ++at;
  }
  predict();
  arrange(state, inputs);
  StepReport report = stepIslands();
  while (report.ok && joinThoseThatMet())
  {
    arrange(state, inputs);
    for (const ObjectIsland* island : islands_)
      if (!island->stepped())
        for (const int place : island->places())
          if (!objects_.all[place]->load(state, inputs, report))
            return report;
    report.merge(stepIslands());
  }
  return report;
}

StepReport IslandScheduler::step(WorldState& state, const WorldInputs& inputs)
{
  StepReport report;
  if (!begin(state, inputs, report))
    return report;
  report = stepAndJoin(state, inputs);
  if (!report.ok)
    return report;
  for (WorldObject* object : objects_.all)
    object->finish(state);
  for (const ObjectIsland* island : islands_)
    island->end(state);
  return report;
}

void IslandScheduler::finish(WorldState& state, const WorldInputs& inputs, StepReport& report)
{
  for (const WorldObject* object : objects_.all)
    object->finishGuide(inputs, state, report);
}

void IslandScheduler::checkCloths(const WorldState& state)
{
  if (objects_.impulses)
    objects_.impulses->check(state);
}

void IslandScheduler::checkClearance(WorldState& state)
{
  Meeting meeting;
  for (WorldObject* object : objects_.all)
    object->addTo(meeting, state);
  if (meeting.surface.segments.empty() && meeting.surface.triangles.empty())
    return;
  for (const WorldSolid& solid : objects_.solids)
  {
    const int index = solid.index;
    Pose pose;
    if (solid.kind == WorldSolid::Kind::obstacle)
      pose = state.obstacles[index];
    else if (solid.kind == WorldSolid::Kind::body)
      pose = state.bodies[index].X_WB * world_.bodies[index].X_BS;
    else
      pose.position.z() = world_.threads[index].model->floor.height;
    meeting.addSolid(solid.name(), solid.asTouched(objects_.all), pose);
  }
  // Less than what rounding errors of positions leave, or barriers resolve, is no room.
  const double rounding = 1e-11 * meeting.x.cwiseAbs().maxCoeff(), gap = world_.contact.gap,
               least = std::max(1e-9 * gap, rounding);
  if (gap <= rounding)
    throw std::invalid_argument("contact.gap is " + shortNumber(gap, 3) +
                                " m; must be larger than rounding errors of positions: at least " +
                                shortNumber(100.0 * rounding, 3) + " m");
  const double room =
      ContactPotential(meeting.surface, world_.contact).clearance(meeting.x, meeting.poses, state.steps == 0);
  if (!(room > least))
    throw std::invalid_argument(meeting.nearest(world_.contact) +
                                (room < -least ? " cross by " + shortNumber(-1e3 * room, 4) + " mm" : " touch") +
                                " as the scene starts: move them apart, or make them thinner");
  fitRanges(meeting, state);
}

/// A body that starts in a narrow place is pressed by nothing there: it repels solids that are nearer than the gap
/// within their distance only.
void IslandScheduler::fitRanges(const Meeting& meeting, WorldState& state)
{
  std::vector<ContactMemory*> bodies;   // their surfaces come first
  for (const BodyObject& body : objects_.bodies)
    if (body.hasSurface())
    {
      bodies.push_back(&body.contact(state));
      bodies.back()->ranges.clear();
    }
  for (const Meeting::Near& near : meeting.near(static_cast<int>(bodies.size()), world_.contact))
    if (const WorldSolid& solid = objects_.solids[near.solid]; solid.kind != WorldSolid::Kind::floor)
      bodies[near.object]->ranges.push_back({solid.partner(), near.room / world_.contact.gap});
}

}   // namespace slender
