#include "joined_island.h"

#include <algorithm>
#include <limits>

namespace slender {

namespace {

/// Threads and cloths are stepped by implicit Euler alone.
TimeConfig timeOf(TimeConfig time, bool damped)
{
  if (damped)
    time.integrator = Integrator::implicit_euler;
  return time;
}

bool hasThreads(const JoinedObjects& objects, const std::vector<int>& parts)
{
  return std::any_of(parts.begin(), parts.end(),
                     [&](int part) { return part >= objects.partOfThread(0) && part < objects.partOfCloth(0); });
}

bool hasCloths(const JoinedObjects& objects, const std::vector<int>& parts)
{
  return std::any_of(parts.begin(), parts.end(),
                     [&](int part) { return part >= objects.partOfCloth(0) && part < objects.partOfBody(0); });
}

}   // namespace

JoinedIsland::JoinedIsland(JoinedObjects& objects, const std::vector<int>& parts, const TimeConfig& time)
  : world_(objects.world),
    objects_(objects),
    parts_(parts),
    guard_(world_.contact.gap),
    swept_(parts.size()),
    stepper_(timeOf(time, hasThreads(objects, parts) || hasCloths(objects, parts)), hasThreads(objects, parts))
{
  std::vector<ThreadGuard::Tube> tubes;
  bool merges = false;
  for (const int part : parts_)
  {
    if (part < objects_.partOfThread(0))
    {
      JoinedRod& rod = objects_.rods[part];
      rods_.push_back(&rod);
      const RodModel& model = *rod.stepper->model;
      nodes_ += model.nodes();
      if (const auto& contact = world_.rods[rod.index].contact; contact && contact->others)
        tubes.push_back({&rod.stepper->system, model.radius_a.cwiseMax(model.radius_b)});
    }
    else if (part < objects_.partOfCloth(0))
    {
      threads_.push_back(&objects_.threads[part - objects_.partOfThread(0)]);
      merges = merges || world_.threads[threads_.back()->index].merging > 0.0;
    }
    else if (part < objects_.partOfBody(0))
    {
      cloths_.push_back(&objects_.cloths[part - objects_.partOfCloth(0)]);
    }
    else
    {
      bodies_.push_back(&objects_.bodies[part - objects_.partOfBody(0)]);
    }
  }
  stepper_.island().solver = world_.time.island_solver;
  IslandTolerances& tolerances = stepper_.island().tolerances;
  tolerances.angles_may_keep_shift = !rods_.empty();
  tolerances.most_unbalanced =
      threads_.empty() ? std::numeric_limits<double>::infinity() : ThreadSystem::mostUnbalanced();
  guard_.setTubes(std::move(tubes));
  if (merges)
    stepper_.setAttraction(&merging_);
  setThreads(0);
  setMembers();
  const bool touches =
      !threads_.empty() || !cloths_.empty() ||
      std::any_of(bodies_.begin(), bodies_.end(), [](const JoinedBody* body) { return body->part->hasSurface(); }) ||
      std::any_of(rods_.begin(), rods_.end(),
                  [&](const JoinedRod* rod) { return world_.rods[rod->index].contact.has_value(); });
  if (touches)
    stepper_.setContact(takeSolids(), world_.contact);
}

void JoinedIsland::setThreads(int threads)
{
  constexpr int kWorthThreads = 4000;   // nodes; less is done before threads are awake
  stepper_.island().setThreads(threads, rods_.size() > 1 && nodes_ >= kWorthThreads);
}

/// The solids that move as prescribed, and those that its parts carry or lie on.
std::vector<ContactSolid> JoinedIsland::takeSolids()
{
  std::vector<ContactSolid> solids;
  for (const JoinedSolid& solid : objects_.solids)
  {
    const bool floor = solid.kind == JoinedSolid::Kind::floor;
    if (floor && std::none_of(threads_.begin(), threads_.end(),
                              [&](const JoinedThread* thread) { return thread->index == solid.index; }))
      continue;
    if (solid.body && std::none_of(bodies_.begin(), bodies_.end(),
                                   [&](const JoinedBody* body) { return body->part.get() == solid.body; }))
      continue;
    solids_.push_back(&solid);
    solids.push_back({solid.obstacle});
    solids.back().body = solid.body != nullptr;
    if (solid.kind == JoinedSolid::Kind::obstacle)
      solids.back().number = solid.index;
    if (floor)
      solids.back().only = solid.index;
    int object = 0;   // of the contact: bodies that touch solids come first, then rods that touch something
    for (const JoinedBody* body : bodies_)
      if (body->part->hasSurface())
      {
        if (body->part.get() == solid.body)
          solids.back().ignores.push_back(object);
        ++object;
      }
    for (const JoinedRod* rod : rods_)
    {
      if (!world_.rods[rod->index].contact)
        continue;
      const auto place = static_cast<int>(rod - objects_.rods.data());
      if (std::count(solid.welded_rods.begin(), solid.welded_rods.end(), place) > 0)
        solids.back().ignores.push_back(object);
      ++object;
    }
    stepper_.island().solids.emplace_back();
    stepper_.island().solids.back().body = solid.body;
    stepper_.island().solids.back().X_BS = solid.X_BS;
  }
  setCarriers();
  return solids;
}

/// Tells bodies which solid of this island is their own.
void JoinedIsland::setCarriers()
{
  for (const JoinedBody* body : bodies_)
    for (std::size_t k = 0; k < solids_.size(); ++k)
      if (solids_[k]->body == body->part.get())
        body->part->setCarrier(static_cast<int>(k));
}

// ---- a step

void JoinedIsland::setSolids(const WorldState& state, const WorldInputs& inputs)
{
  for (std::size_t k = 0; k < solids_.size(); ++k)
  {
    IslandSolid& solid = stepper_.island().solids[k];
    const int index = solids_[k]->index;
    if (solids_[k]->kind == JoinedSolid::Kind::obstacle)
    {
      solid.start = state.obstacles[index];
      solid.start_velocity = state.obstacle_velocities[index];
      solid.target = inputs.obstacles[index];
    }
    else if (solids_[k]->kind == JoinedSolid::Kind::floor)
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

/// Bodies come first.
void JoinedIsland::setMembers()
{
  members_.clear();
  for (const JoinedBody* body : bodies_)
    members_.push_back({body->part.get(), body->part.get()});
  for (const JoinedRod* rod : rods_)
    members_.push_back({rod->part.get(), rod->part.get()});
  for (const JoinedCloth* cloth : cloths_)
    members_.push_back({cloth->part.get(), cloth->part.get()});
  for (ThreadPart* strand : strands_)
    members_.push_back({strand, strand});
  stepper_.setMembers(members_);
}

void JoinedIsland::begin(const WorldState& state, const WorldInputs& inputs)
{
  stepped_ = false;
  setCarriers();
  setSolids(state, inputs);
  double stiffness = 0.0;
  for (const JoinedRod* rod : rods_)
    stiffness = std::max(stiffness, state.contact_stiffness.rods[rod->index]);
  for (const JoinedBody* body : bodies_)
    stiffness = std::max(stiffness, state.contact_stiffness.bodies[body->index]);
  for (const JoinedThread* thread : threads_)
    stiffness = std::max(stiffness, state.contact_stiffness.threads[thread->index]);
  for (const JoinedCloth* cloth : cloths_)
    stiffness = std::max(stiffness, state.contact_stiffness.cloths[cloth->index]);
  stepper_.setStiffness(stiffness);
  if (threads_.empty())
    return;
  strands_.clear();
  guarded_.clear();
  for (JoinedThread* thread : threads_)
    for (std::size_t s = 0; s < thread->work.threads.size(); ++s)
    {
      const JoinedThread::Strand& strand = thread->strands[s];
      strand.part->setGuard(&guard_);
      strands_.push_back(strand.part.get());
      const WorldModel::Thread& of = world_.threads[thread->index];
      guarded_.push_back({&strand.stepper->work, *of.contact, of.merging});
    }
  setMembers();
  guard_.setStrands(guarded_);
  merging_.setParts(strands_);
}

StepReport JoinedIsland::step(double duration)
{
  double first = 0.0;
  for (const JoinedRod* rod : rods_)
    if (const double own = rod->stepper->work.next_step; own > 0.0)
      first = first > 0.0 ? std::min(first, own) : own;
  StepReport report = stepper_.step(duration, first);
  stepped_ = report.ok;
  if (!report.ok)
    return report;
  for (JoinedRod* rod : rods_)
    rod->stepper->work.next_step = first;
  trace();
  return report;
}

/// The boxes of its parts from those of the members.
void JoinedIsland::trace()
{
  std::size_t member = 0, place = 0;
  const std::size_t cloths_at = rods_.size() + threads_.size(), bodies_at = cloths_at + cloths_.size();
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    swept_[bodies_at + b] = stepper_.sweptBox(member++);
  for (; place < rods_.size(); ++place)
    swept_[place] = stepper_.sweptBox(member++);
  for (std::size_t c = 0; c < cloths_.size(); ++c)
    swept_[cloths_at + c] = stepper_.sweptBox(member++);
  for (const JoinedThread* thread : threads_)
  {
    swept_[place] = BoundingBox::empty();
    for (std::size_t s = 0; s < thread->work.threads.size(); ++s)
      swept_[place].include(stepper_.sweptBox(member++));
    ++place;
  }
}

void JoinedIsland::end(WorldState& state) const
{
  if (!contact())
    return;
  for (const JoinedRod* rod : rods_)
    state.contact_stiffness.rods[rod->index] = stepper_.stiffness();
  for (const JoinedBody* body : bodies_)
    state.contact_stiffness.bodies[body->index] = stepper_.stiffness();
  for (const JoinedThread* thread : threads_)
    state.contact_stiffness.threads[thread->index] = stepper_.stiffness();
  for (const JoinedCloth* cloth : cloths_)
    state.contact_stiffness.cloths[cloth->index] = stepper_.stiffness();
}

}   // namespace slender
