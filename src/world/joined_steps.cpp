// Rods, threads and bodies as one island: their steps.
#include <algorithm>
#include <stdexcept>

#include "joined_parts.h"
#include "meeting.h"
#include "slender_sim/contact/solids.h"

namespace slender {

namespace {

bool isSound(const GraspTarget& t)
{
  return t.X_WG.position.allFinite() && std::abs(t.X_WG.orientation.norm() - 1.0) < 1e-3 &&
         (!t.velocity || (t.velocity->linear.allFinite() && t.velocity->angular.allFinite()));
}

StepReport refusedInput(const std::string& what)
{
  StepReport report;
  report.ok = false;
  report.failure = StepFailure::input_not_finite;
  report.message = what + " is not finite or not valid; correct this input";
  return report;
}

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

/// What is wrong with the inputs that all parts share; empty: nothing is.
std::string JoinedParts::badInput(const WorldState& state, const WorldInputs& inputs) const
{
  if (inputs.rods.size() != state.rods.size() || state.rods.size() != world_.rods.size())
    return "number of rods";
  if (inputs.threads.size() != state.threads.size() || state.threads.size() != world_.threads.size())
    return "number of threads";
  if (inputs.bodies.size() != state.bodies.size() || state.bodies.size() != world_.bodies.size())
    return "number of bodies";
  if (inputs.obstacles.size() != state.obstacles.size() || state.obstacles.size() != world_.obstacles.size() ||
      state.obstacle_velocities.size() != state.obstacles.size())
    return "number of obstacles";
  for (const int b : content_.bodies)
    if (!world_.bodies[b].body.simulated && !isSound(inputs.bodies[b]))
      return "pose of body " + world_.bodies[b].body.name;
  for (std::size_t k = 0; k < inputs.obstacles.size(); ++k)
    if (!isSound(inputs.obstacles[k]))
      return "pose of obstacle " + world_.obstacles[k].name;
  for (const int k : content_.threads)
    if (!inputs.threads[k].belt_velocity.allFinite())
      return "belt velocity of thread " + world_.threads[k].model->name;
  return inputs.gravity.allFinite() ? "" : "gravity";
}

/// An end that is held cannot give way. Returns false, and fills the report, when a solid that moves as prescribed
/// comes nearer to one than the thread is thick: no shorter step helps then.
bool JoinedParts::endsHaveRoom(const WorldState& state, const WorldInputs& inputs, StepReport& report) const
{
  for (const Thread& thread : threads_)
    for (const ThreadState& strand : state.threads[thread.index].threads)
      for (int end = 0; end < 2 && world_.threads[thread.index].contact->solids; ++end)
      {
        const Eigen::Vector3d from = end ? strand.x.back() : strand.x.front(),
                              to = inputs.threads[thread.index].ends[end].position;
        const double radius = strand.radius(end ? strand.edges() - 1 : 0);
        for (std::size_t o = 0; strand.ends[end].held && o < world_.obstacles.size(); ++o)
        {
          const WorldModel::Obstacle& obstacle = world_.obstacles[o];
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

/// Grasps that driven bodies carry get their targets from these.
void JoinedParts::carryGrasps(const WorldInputs& inputs)
{
  for (const Weld& weld : welds_)
    if (!world_.bodies[weld.body].body.simulated)
    {
      const GraspTarget& body = inputs.bodies[weld.body];
      GraspTarget& grasp = rods_[weld.rod].inputs.grasps[weld.grasp];
      grasp.X_WG = body.X_WG * weld.X_BG;
      grasp.velocity = body.velocity;
      if (grasp.velocity)
        grasp.velocity->linear += grasp.velocity->angular.cross(body.X_WG.orientation * weld.X_BG.position);
    }
}

void JoinedParts::setSolids(const WorldState& state, const WorldInputs& inputs)
{
  for (std::size_t k = 0; k < solids_.size(); ++k)
  {
    IslandSolid& solid = stepper_.island().solids[k];
    const int index = solids_[k].index;
    if (solids_[k].kind == Solid::Kind::obstacle)
    {
      solid.start = state.obstacles[index];
      solid.start_velocity = state.obstacle_velocities[index];
      solid.target = inputs.obstacles[index];
    }
    else if (solids_[k].kind == Solid::Kind::floor)
    {
      solid.start = {Eigen::Vector3d(0, 0, world_.threads[index].model->floor.height), Eigen::Quaterniond::Identity()};
      solid.target.X_WG = solid.start;
      solid.target.X_WG.position += world_.time.step * inputs.threads[index].belt_velocity;
    }
    else if (!solid.body)
    {
      solid.start = state.bodies[index].X_WB;
      solid.start_velocity = state.bodies[index].velocity;
      solid.target = inputs.bodies[index];
    }
  }
}

bool JoinedParts::begin(const WorldState& state, const WorldInputs& inputs, StepReport& report)
{
  for (Rod& rod : rods_)
    rod.inputs = inputs.rods[rod.index];
  carryGrasps(inputs);
  std::string what;
  for (Rod& rod : rods_)
  {
    if (!rod.stepper->inputsFinite(state.rods[rod.index], rod.inputs, what))
    {
      report = refusedInput("rod '" + rod.stepper->model->name + "': " + what);
      return false;
    }
    rod.stepper->begin(state.rods[rod.index]);
    rod.part->begin(rod.inputs, world_.time.step);
  }
  for (const Body& body : bodies_)
    body.part->begin(state.bodies[body.index], inputs.gravity);
  setSolids(state, inputs);
  return threads_.empty() || beginThreads(state, inputs, report);
}

bool JoinedParts::beginThreads(const WorldState& state, const WorldInputs& inputs, StepReport& report)
{
  if (!endsHaveRoom(state, inputs, report))
    return false;
  strands_.clear();
  guarded_.clear();
  for (Thread& thread : threads_)
  {
    thread.inputs = thread.still = inputs.threads[thread.index];
    thread.still.flow_rate = 0.0;
    thread.work = state.threads[thread.index];
    const ThreadTouch& contact = *world_.threads[thread.index].contact;
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
      strands_.push_back(thread.strands[s].part.get());
      guarded_.push_back({&stepper.work, contact});
    }
  }
  setMembers();
  guard_.setStrands(guarded_);
  merging_.setParts(strands_);
  return true;
}

StepReport JoinedParts::step(WorldState& state, const WorldInputs& inputs)
{
  StepReport report;
  if (const std::string bad = badInput(state, inputs); !bad.empty())
    return refusedInput(bad);
  if (!begin(state, inputs, report))
    return report;
  stepper_.setStiffness(stiffnessOf(state));
  double first = rods_.empty() ? 0.0 : state.rods[rods_.front().index].next_step;
  report = stepper_.step(world_.time.step, first);
  if (!report.ok)
    return report;
  for (const Rod& rod : rods_)
    rod.stepper->work.next_step = first;
  end(state);
  return report;
}

void JoinedParts::endThread(Thread& thread)
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
  for (const Rod& rod : rods_)
    state.rods[rod.index] = rod.stepper->work;
  for (const Body& body : bodies_)
    state.bodies[body.index] = body.part->state();
  for (Thread& thread : threads_)
  {
    endThread(thread);
    std::swap(state.threads[thread.index], thread.work);
  }
  stiffnessOf(state) = stepper_.stiffness();
}

void JoinedParts::finish(WorldState& state, const WorldInputs&, StepReport&)
{
  for (const Thread& thread : threads_)
    state.end_loads[thread.index] = thread.loads;
}

void JoinedParts::addStrand(Thread& thread) const
{
  Strand added;
  added.stepper = std::make_unique<ThreadStepper::Impl>(world_.threads[thread.index].model, world_.time.newton, false);
  added.part = std::make_unique<ThreadPart>(*added.stepper);
  added.part->setContact(*world_.threads[thread.index].contact, thread.index);
  added.part->setGuard(&guard_);
  thread.strands.push_back(std::move(added));
}

void JoinedParts::checkClearance(const WorldState& state)
{
  ContactPotential* contact = stepper_.island().contact();
  if (!contact)
    return;
  Meeting meeting;
  std::vector<Eigen::Vector3d> points;
  for (const Rod& rod : rods_)
    if (world_.rods[rod.index].contact)
    {
      rod.part->addSurface(meeting.surface);
      meeting.objects.push_back("rod '" + rod.stepper->model->name + "'");
      const Eigen::Matrix3Xd& x = state.rods[rod.index].x;
      for (Eigen::Index i = 0; i < x.cols(); ++i)
        points.emplace_back(x.col(i));
    }
  for (Thread& thread : threads_)
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
  meeting.x = Eigen::Map<const Eigen::Matrix3Xd>(points.empty() ? nullptr : points[0].data(), 3,
                                                 static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < solids_.size(); ++k)
  {
    const int index = solids_[k].index;
    if (solids_[k].kind == Solid::Kind::obstacle)
      meeting.addSolid("obstacle '" + world_.obstacles[index].name + "'", contact->solid(k), state.obstacles[index]);
    else if (solids_[k].kind == Solid::Kind::body)
      meeting.addSolid("body '" + world_.bodies[index].body.name + "'", contact->solid(k),
                       state.bodies[index].X_WB * world_.bodies[index].X_BS);
    else
      meeting.addSolid(
          "its floor", contact->solid(k),
          {Eigen::Vector3d(0, 0, world_.threads[index].model->floor.height), Eigen::Quaterniond::Identity()});
  }
  contact->setCurves(meeting.surface.points, meeting.surface.segments, meeting.surface.objects);
  const double room = contact->clearance(meeting.x, meeting.poses);
  if (!(room > 0))
    throw std::invalid_argument(meeting.nearest(world_.contact.gap) + " touch or cross by " +
                                std::to_string(-1e3 * room) +
                                " mm as the scene starts: move them apart, or make them thinner");
}

}   // namespace slender
