// Rods, threads, cloths and bodies as one island: their steps.
#include <algorithm>
#include <stdexcept>

#include "joined_parts.h"
#include "meeting.h"
#include "slender_sim/contact/solids.h"

namespace slender {

namespace {

/// Nodes made in one step have numbers that differ, as if the threads had been stepped one after the other.
void renumber(std::vector<ThreadState>& threads, std::uint64_t before)
{
  std::uint64_t shift = 0;
  for (ThreadState& thread : threads)
  {
    const std::uint64_t made = thread.next_id - before;
    for (std::uint64_t& id : thread.id)
      if (id >= before)
        id += shift;
    shift += made;
    thread.next_id = before + shift;
  }
}

std::uint64_t nextId(const std::vector<ThreadState>& threads)
{
  std::uint64_t next = 0;
  for (const ThreadState& thread : threads)
    next = std::max(next, thread.next_id);
  return next;
}

}   // namespace

/// An end that is held cannot give way. Returns false, and fills the report, when a solid that moves as prescribed
/// comes nearer to one than the thread is thick: no shorter step helps then.
bool JoinedParts::endsHaveRoom(const WorldState& state, const WorldInputs& inputs, StepReport& report) const
{
  for (const JoinedThread& thread : objects_.threads)
    for (const ThreadState& strand : state.threads[thread.index].threads)
      for (int end = 0; end < 2 && world_.threads[thread.index].contact->solids; ++end)
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
          const ThreadModel& model = *world_.threads[thread.index].model;
          report.ok = false;
          report.failure = StepFailure::squeezed;
          report.message = "obstacle '" + obstacle.name + "' comes within " + std::to_string(1e3 * room) +
                           " mm of the " + (end && model.nozzle_diameter > 0 ? "nozzle" : "held end") + " of thread '" +
                           model.name + "', which is " + std::to_string(1e3 * radius) +
                           " mm in radius there: keep them further apart";
          return false;
        }
      }
  return true;
}

// ---- parts are loaded

bool JoinedParts::begin(const WorldState& state, const WorldInputs& inputs, StepReport& report)
{
  if (!objects_.takeInputs(state, inputs, report))
    return false;
  if (!endsHaveRoom(state, inputs, report))
    return false;
  for (int part = 0; part < objects_.parts(); ++part)
    if (!load(part, state, inputs, report))
      return false;
  return true;
}

/// Loads the state of a part where the step begins.
bool JoinedParts::load(int part, const WorldState& state, const WorldInputs& inputs, StepReport& report)
{
  if (part < objects_.partOfThread(0))
  {
    JoinedRod& rod = objects_.rods[part];
    rod.stepper->begin(state.rods[rod.index]);
    rod.part->begin(rod.inputs, world_.time.step);
    return true;
  }
  if (part < objects_.partOfCloth(0))
    return loadThread(objects_.threads[part - objects_.partOfThread(0)], state, inputs, report);
  if (part < objects_.partOfBody(0))
    return loadCloth(objects_.cloths[part - objects_.partOfCloth(0)], state, inputs, report);
  const JoinedBody& body = objects_.bodies[part - objects_.partOfBody(0)];
  body.part->begin(state.bodies[body.index], inputs.gravity);
  return true;
}

bool JoinedParts::loadThread(JoinedThread& thread, const WorldState& state, const WorldInputs& inputs,
                             StepReport& report)
{
  thread.inputs = thread.still = inputs.threads[thread.index];
  thread.still.flow_rate = 0.0;
  thread.work = state.threads[thread.index];
  const std::uint64_t next_id = nextId(thread.work.threads);
  for (std::size_t s = 0; s < thread.work.threads.size(); ++s)
  {
    ThreadState& strand = thread.work.threads[s];
    strand.next_id = next_id;
    if (thread.strands.size() <= s)
      addStrand(thread);
    ThreadStepper::Impl& stepper = *thread.strands[s].stepper;
    if (!stepper.begin(strand, strand.ends[1].held ? thread.inputs : thread.still, world_.time.step, report))
      return false;
    thread.strands[s].part->setDuration(world_.time.step);
  }
  return true;
}

bool JoinedParts::loadCloth(JoinedCloth& cloth, const WorldState& state, const WorldInputs& inputs, StepReport& report)
{
  const ClothState& from = state.cloths[cloth.index];
  const ClothInputs& with = inputs.cloths[cloth.index];
  if (!cloth.part->accepts(from, with, world_.time.step, report))
    return false;
  cloth.part->begin(from, with, world_.time.step);
  return true;
}

// ---- islands

/// Where parts would be at the end of the step if they kept their velocities.
void JoinedParts::predict()
{
  const auto reach = [&](const PartSteps& part, BoundingBox& box) {
    box.include(part.surfaceBox(0.0));
    box.include(part.surfaceBox(world_.time.step));
  };
  for (std::size_t k = 0; k < objects_.rods.size(); ++k)
  {
    const auto& contact = world_.rods[objects_.rods[k].index].contact;
    const bool touches = contact.has_value();
    reach_[k] = {touches, touches && contact->others, touches && contact->solids, false, BoundingBox::empty()};
    reach(*objects_.rods[k].part, reach_[k].box);
  }
  for (std::size_t k = 0; k < objects_.threads.size(); ++k)
  {
    const JoinedThread& thread = objects_.threads[k];
    const ContactProperties& contact = *world_.threads[thread.index].contact;
    IslandFinder::Reach& of_thread = reach_[objects_.partOfThread(k)];
    of_thread = {true, contact.others, contact.solids, false, BoundingBox::empty()};
    for (std::size_t s = 0; s < thread.work.threads.size(); ++s)
      reach(*thread.strands[s].part, of_thread.box);
  }
  for (std::size_t k = 0; k < objects_.cloths.size(); ++k)
  {
    const ContactProperties& contact = *world_.cloths[objects_.cloths[k].index].contact;
    IslandFinder::Reach& of_cloth = reach_[objects_.partOfCloth(k)];
    of_cloth = {true, contact.others, contact.solids, false, BoundingBox::empty()};
    reach(*objects_.cloths[k].part, of_cloth.box);
  }
  for (std::size_t k = 0; k < objects_.bodies.size(); ++k)
  {
    IslandFinder::Reach& of_body = reach_[objects_.partOfBody(k)];
    const bool touches = objects_.bodies[k].part->hasSurface();
    of_body = {touches, false, touches, world_.bodies[objects_.bodies[k].index].shape.has_value(),
               BoundingBox::empty()};
    reach(*objects_.bodies[k].part, of_body.box);
  }
  finder_.begin(objects_.parts());
  for (const Weld& weld : objects_.welds)
    for (std::size_t k = 0; k < objects_.bodies.size(); ++k)
      if (objects_.bodies[k].index == weld.body)
        finder_.join(weld.rod, objects_.partOfBody(k));
  finder_.joinNear(reach_, world_.contact.gap);
}

/// Takes the islands that the finder has found. Those that the step does not know yet begin theirs.
void JoinedParts::arrange(const WorldState& state, const WorldInputs& inputs)
{
  const int count = finder_.find();
  islands_.clear();
  for (int k = 0; k < count; ++k)
  {
    finder_.partsOf(k, numbers_);
    auto at = known_.find(numbers_);
    const bool is_new = at == known_.end();
    if (is_new)
      at = known_.try_emplace(numbers_, objects_, numbers_, world_.time).first;
    islands_.push_back(&at->second);
    if (is_new || !at->second.stepped())
      at->second.begin(state, inputs);
  }
}

StepReport JoinedParts::stepIslands()
{
  StepReport total;
  const int count = static_cast<int>(islands_.size());
  for (JoinedIsland* island : islands_)
    island->setThreads(count > 1 ? 1 : loop_.threads);
  loop_.run(
      count, nodes_, [&](int k) { return islands_[k]->stepped() ? StepReport() : islands_[k]->step(world_.time.step); },
      total);
  return total;
}

/// Joins islands of which parts came near each other on their ways. Returns whether there were any.
bool JoinedParts::joinThoseThatMet()
{
  if (islands_.size() < 2)
    return false;
  for (const JoinedIsland* island : islands_)
    for (std::size_t place = 0; place < island->parts().size(); ++place)
      reach_[island->parts()[place]].box = island->sweptBox(place);
  return finder_.joinNear(reach_, 0.5 * world_.contact.gap);
}

StepReport JoinedParts::stepAndJoin(const WorldState& state, const WorldInputs& inputs)
{
  // Islands that no step needs any more are dropped now and then.
  if (known_.size() > 2 * static_cast<std::size_t>(objects_.parts()) + 16)
    known_.clear();
  for (auto& [parts, island] : known_)
    island.forgetStep();
  predict();
  arrange(state, inputs);
  StepReport report = stepIslands();
  while (report.ok && joinThoseThatMet())
  {
    arrange(state, inputs);
    for (const JoinedIsland* island : islands_)
      if (!island->stepped())
        for (const int part : island->parts())
          if (!load(part, state, inputs, report))
            return report;
    report.merge(stepIslands());
  }
  return report;
}

StepReport JoinedParts::step(WorldState& state, const WorldInputs& inputs)
{
  StepReport report;
  if (!begin(state, inputs, report))
    return report;
  report = stepAndJoin(state, inputs);
  if (report.ok)
    end(state);
  return report;
}

void JoinedParts::endThread(JoinedThread& thread)
{
  thread.loads = {};
  const std::uint64_t before = nextId(thread.work.threads);
  for (std::size_t s = 0; s < thread.work.threads.size(); ++s)
  {
    ThreadState& strand = thread.work.threads[s];
    std::swap(strand, thread.strands[s].stepper->work);
    for (int end = 0; end < 2; ++end)
      if (strand.ends[end].held)
        thread.loads[end] = thread.strands[s].stepper->loads[end];
  }
  const ThreadLimits& limits = world_.threads[thread.index].model->limits;
  renumber(thread.work.threads, before);
  breakThreads(thread.work, limits);
  dropThreads(thread.work, limits);
}

void JoinedParts::end(WorldState& state)
{
  for (const JoinedRod& rod : objects_.rods)
    state.rods[rod.index] = rod.stepper->work;
  for (const JoinedBody& body : objects_.bodies)
    state.bodies[body.index] = body.part->state();
  for (JoinedThread& thread : objects_.threads)
  {
    endThread(thread);
    std::swap(state.threads[thread.index], thread.work);
  }
  for (const JoinedCloth& cloth : objects_.cloths)
    cloth.part->end(state.cloths[cloth.index]);
  for (const JoinedIsland* island : islands_)
    island->end(state);
}

void JoinedParts::finish(WorldState& state, const WorldInputs&, StepReport&)
{
  for (const JoinedThread& thread : objects_.threads)
    state.end_loads[thread.index] = thread.loads;
}

void JoinedParts::addStrand(JoinedThread& thread) const
{
  JoinedThread::Strand added;
  added.stepper = std::make_unique<ThreadStepper::Impl>(world_.threads[thread.index].model, world_.time.newton, false);
  added.part = std::make_unique<ThreadPart>(*added.stepper);
  const WorldModel::Thread& of = world_.threads[thread.index];
  added.part->setContact(*of.contact, of.merging, thread.index);
  thread.strands.push_back(std::move(added));
}

/// Numbers of the objects of a contact that a solid never touches: its own body, and rods that are welded into it.
/// Bodies that touch solids come first among the objects, then rods that touch something.
std::vector<int> JoinedParts::objectsIgnoredBy(const JoinedSolid& solid) const
{
  std::vector<int> objects;
  int object = 0;
  for (const JoinedBody& body : objects_.bodies)
    if (body.part->hasSurface())
    {
      if (body.part.get() == solid.body)
        objects.push_back(object);
      ++object;
    }
  for (std::size_t r = 0; r < objects_.rods.size(); ++r)
    if (world_.rods[objects_.rods[r].index].contact)
    {
      if (std::count(solid.welded_rods.begin(), solid.welded_rods.end(), static_cast<int>(r)) > 0)
        objects.push_back(object);
      ++object;
    }
  return objects;
}

void JoinedParts::addBodies(const WorldState& state, Meeting& meeting, std::vector<Eigen::Vector3d>& points) const
{
  for (const JoinedBody& body : objects_.bodies)
  {
    if (!body.part->hasSurface())
      continue;
    static_cast<const PartSteps&>(*body.part).addSurface(meeting.surface);
    meeting.objects.push_back("body '" + world_.bodies[body.index].body.name + "'");
    const Eigen::Matrix3Xd x = body.part->surfaceAt(state.bodies[body.index].X_WB);
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      points.emplace_back(x.col(i));
  }
}

void JoinedParts::checkClearance(const WorldState& state)
{
  Meeting meeting;
  std::vector<Eigen::Vector3d> points;
  addBodies(state, meeting, points);
  for (const JoinedRod& rod : objects_.rods)
    if (world_.rods[rod.index].contact)
    {
      rod.part->addSurface(meeting.surface);
      meeting.objects.push_back("rod '" + rod.stepper->model->name + "'");
      const Eigen::Matrix3Xd& x = state.rods[rod.index].x;
      for (Eigen::Index i = 0; i < x.cols(); ++i)
        points.emplace_back(x.col(i));
    }
  for (JoinedThread& thread : objects_.threads)
    for (std::size_t s = 0; s < state.threads[thread.index].threads.size(); ++s)
    {
      const ThreadState& strand = state.threads[thread.index].threads[s];
      if (thread.strands.size() <= s)
        addStrand(thread);
      thread.strands[s].stepper->work = strand;
      thread.strands[s].part->addSurface(meeting.surface);
      meeting.objects.push_back("thread '" + world_.threads[thread.index].model->name + "'");
      points.insert(points.end(), strand.x.begin(), strand.x.end());
    }
  for (const JoinedCloth& cloth : objects_.cloths)
  {
    const ClothState& from = state.cloths[cloth.index];
    cloth.part->setPins(from.pins);
    cloth.part->addSurface(meeting.surface);
    meeting.objects.push_back("cloth '" + world_.cloths[cloth.index].model->name + "'");
    for (Eigen::Index i = 0; i < from.x.cols(); ++i)
      points.emplace_back(from.x.col(i));
  }
  meeting.x = Eigen::Map<const Eigen::Matrix3Xd>(points.empty() ? nullptr : points[0].data(), 3,
                                                 static_cast<Eigen::Index>(points.size()));
  if (meeting.surface.segments.empty() && meeting.surface.triangles.empty())
    return;
  for (const JoinedSolid& solid : objects_.solids)
  {
    ContactSolid touched{solid.obstacle};
    touched.body = solid.body != nullptr;
    const int index = solid.index;
    if (solid.kind == JoinedSolid::Kind::obstacle)
    {
      touched.number = index;
      meeting.addSolid("obstacle '" + world_.obstacles[index].name + "'", touched, state.obstacles[index]);
    }
    else if (solid.kind == JoinedSolid::Kind::body)
    {
      touched.ignores = objectsIgnoredBy(solid);
      meeting.addSolid("body '" + world_.bodies[index].body.name + "'", touched,
                       state.bodies[index].X_WB * world_.bodies[index].X_BS);
    }
    else
    {
      touched.only = index;
      meeting.addSolid(
          "its floor", touched,
          {Eigen::Vector3d(0, 0, world_.threads[index].model->floor.height), Eigen::Quaterniond::Identity()});
    }
  }
  const double room = ContactPotential(meeting.surface, world_.contact).clearance(meeting.x, meeting.poses);
  if (!(room > 0))
    throw std::invalid_argument(meeting.nearest(world_.contact) + " touch or cross by " + std::to_string(-1e3 * room) +
                                " mm as the scene starts: move them apart, or make them thinner");
}

}   // namespace slender
