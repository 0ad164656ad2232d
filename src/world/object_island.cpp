#include "object_island.h"

#include <algorithm>
#include <limits>
#include <map>

#include "slender_sim/contact/solids.h"

namespace slender {

namespace {

/// Threads, and cloths that touch something, are stepped by implicit Euler alone.
TimeConfig timeOf(TimeConfig time, bool damped)
{
  if (damped)
    time.integrator = Integrator::implicit_euler;
  return time;
}

template <class Object>
bool holds(const WorldObjects& objects, const std::vector<int>& places)
{
  return std::any_of(places.begin(), places.end(),
                     [&](int place) { return dynamic_cast<const Object*>(objects.all[place]) != nullptr; });
}

}   // namespace

ObjectIsland::ObjectIsland(WorldObjects& objects, const std::vector<int>& places, const TimeConfig& time)
  : world_(objects.world),
    shared_(objects),
    places_(places),
    guard_(world_.contact.gap),
    swept_(places.size(), BoundingBox::empty()),
    island_(timeOf(time, holds<ThreadObject>(objects, places) || holds<ClothObject>(objects, places)),
            holds<ThreadObject>(objects, places))
{
  sortObjects();
  island_.equations().solver = world_.time.island_solver;
  IslandTolerances& tolerances = island_.equations().tolerances;
  tolerances.angles_may_keep_shift = !rods_.empty();
  tolerances.most_unbalanced =
      threads_.empty() ? std::numeric_limits<double>::infinity() : ThreadSystem::mostUnbalanced();
  setThreads(0);
  setParts();
  if (std::any_of(objects_.begin(), objects_.end(), [](const WorldObject* object) { return object->hasSurface(); }))
    island_.setContact(takeSolids(), world_.contact);
}

void ObjectIsland::sortObjects()
{
  bool merges = false;
  for (const int place : places_)
  {
    objects_.push_back(shared_.all[place]);
    if (objects_.back()->hasSurface())
      addSurface(*objects_.back());
    if (auto* body = dynamic_cast<BodyObject*>(objects_.back()))
      bodies_.push_back(body);
    if (auto* thread = dynamic_cast<ThreadObject*>(objects_.back()))
    {
      threads_.push_back(thread);
      merges = merges || thread->model.merging > 0.0;
    }
    if (auto* rod = dynamic_cast<RodObject*>(objects_.back()))
    {
      rods_.push_back(rod);
      nodes_ += rod->stepper->model->nodes();
    }
  }
  guard_.setIsland(&island_.equations());
  if (merges)
    island_.setAttraction(&merging_);
}

void ObjectIsland::addSurface(WorldObject& object)
{
  const int number = static_cast<int>(surfaces_.size()), index = object.index;
  surfaces_.push_back(&object);
  if (dynamic_cast<ThreadObject*>(&object))
    return;
  const bool is_body = dynamic_cast<BodyObject*>(&object), is_rod = dynamic_cast<RodObject*>(&object);
  partners_.push_back({is_body ? ObjectRef::body : is_rod ? ObjectRef::rod : ObjectRef::cloth, index});
  if (!is_body)   // A body is touched as a solid.
    numbers_.emplace_back(partners_.back(), number);
}

bool ObjectIsland::isLarge() const
{
  constexpr int kWorthThreads = 4000;   // nodes; less is done before threads are awake
  return rods_.size() > 1 && nodes_ >= kWorthThreads;
}

void ObjectIsland::setThreads(int threads) { island_.equations().setThreads(isLarge() ? threads : 1); }

/// The solids that move as prescribed, and those that its parts carry or lie on.
std::vector<ContactSolid> ObjectIsland::takeSolids()
{
  std::vector<ContactSolid> solids;
  for (const WorldSolid& solid : shared_.solids)
  {
    if (solid.kind == WorldSolid::Kind::floor &&
        std::none_of(threads_.begin(), threads_.end(),
                     [&](const ThreadObject* thread) { return thread->index == solid.index; }))
      continue;
    if (solid.body && std::none_of(bodies_.begin(), bodies_.end(),
                                   [&](const BodyObject* body) { return body->part.get() == solid.body; }))
      continue;
    if (solid.kind != WorldSolid::Kind::floor)
      numbers_.emplace_back(solid.partner(), static_cast<int>(solids_.size()));
    solids_.push_back(&solid);
    solids.push_back(solid.asTouched(objects_));
    island_.equations().solids.emplace_back();
    island_.equations().solids.back().body = solid.body;
    island_.equations().solids.back().X_BS = solid.X_BS;
  }
  std::sort(numbers_.begin(), numbers_.end());
  setCarriers();
  return solids;
}

/// Tells bodies which solid of this island is their own.
void ObjectIsland::setCarriers()
{
  for (const BodyObject* body : bodies_)
    for (std::size_t k = 0; k < solids_.size(); ++k)
      if (solids_[k]->body == body->part.get())
        body->part->setCarrier(static_cast<int>(k));
}

// ---- a step

void ObjectIsland::setSolids(const WorldState& state, const WorldInputs& inputs)
{
  for (std::size_t k = 0; k < solids_.size(); ++k)
  {
    IslandSolid& solid = island_.equations().solids[k];
    const int index = solids_[k]->index;
    if (solids_[k]->kind == WorldSolid::Kind::obstacle)
    {
      solid.start = state.obstacles[index];
      solid.start_velocity = state.obstacle_velocities[index];
      solid.target = inputs.obstacles[index];
    }
    else if (solids_[k]->kind == WorldSolid::Kind::floor)
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

void ObjectIsland::setParts()
{
  parts_.clear();
  parts_end_.clear();
  for (WorldObject* object : objects_)
  {
    object->addParts(parts_);
    parts_end_.push_back(parts_.size());
  }
  island_.setParts(parts_);
}

/// Calls f(object, number of the part) for all parts of the objects.
template <class F>
void ObjectIsland::forParts(F&& f) const
{
  for (std::size_t k = 0, part = 0; k < objects_.size(); ++k)
    for (; part < parts_end_[k]; ++part)
      f(*objects_[k], part);
}

void ObjectIsland::begin(WorldState& state, const WorldInputs& inputs)
{
  stepped_ = false;
  setCarriers();
  setSolids(state, inputs);
  if (!threads_.empty())
    setParts();
  if (!contact())
    return;
  forParts(
      [&](const WorldObject& object, std::size_t part) { island_.setBarrier(part, object.contact(state).barrier); });
  takeRanges(state);
  takeSprings(state);
  if (!threads_.empty())
    setStrands();
}

/// Returns the number of a rod, a cloth or a solid in the contact of the island; -1: the island does not have it.
int ObjectIsland::numberOf(const ObjectRef& partner) const
{
  const auto at = std::lower_bound(numbers_.begin(), numbers_.end(), std::make_pair(partner, 0));
  return at == numbers_.end() || !(at->first == partner) ? -1 : at->second;
}

/// Tells contact which solids the bodies repel within a share of the gap only.
void ObjectIsland::takeRanges(WorldState& state)
{
  ranges_.resize(solids_.size());
  for (auto& list : ranges_)
    list.clear();
  for (std::size_t n = 0; n < surfaces_.size(); ++n)
    for (const ContactRange& range : surfaces_[n]->contact(state).ranges)
      if (const int solid = numberOf(range.partner); solid >= 0)
        ranges_[static_cast<std::size_t>(solid)].emplace_back(static_cast<int>(n), range.share);
  for (std::size_t k = 0; k < solids_.size(); ++k)
    island_.equations().contact()->setRanges(k, ranges_[k]);
}

/// Takes the springs of friction between its objects, and between them and solids, with the numbers of the island. Of
/// pairs that it does not have, nothing touches.
void ObjectIsland::takeSprings(WorldState& state)
{
  island_.springs.clear();
  for (std::size_t k = 0; k < surfaces_.size(); ++k)
    for (const ContactSpring& spring : surfaces_[k]->contact(state).springs)
    {
      const int number = numberOf(spring.partner);
      const bool is_solid = spring.partner.kind >= ObjectRef::body;
      if (number >= 0)
        island_.springs.push_back({static_cast<int>(k), is_solid ? -1 : number, is_solid ? number : -1, spring.piece,
                                   spring.point, spring.tension});
    }
  std::sort(island_.springs.begin(), island_.springs.end());
}

/// Writes the springs into the state.
void ObjectIsland::giveSprings(WorldState& state) const
{
  for (const WorldObject* object : surfaces_)
    object->contact(state).springs.clear();
  for (const FrictionSpring& spring : island_.springs)
    surfaces_[spring.object]->contact(state).springs.push_back(
        {spring.solid >= 0 ? solids_[spring.solid]->partner() : partners_[spring.other], spring.piece, spring.point,
         spring.tension});
}

/// Whether neither contact nor joints connect its parts.
bool ObjectIsland::isDivisible() const { return !contact() && rods_.empty() && bodies_.empty(); }

/// Those of the present step.
void ObjectIsland::setStrands()
{
  strands_.clear();
  guarded_.clear();
  for (ThreadObject* thread : threads_)
    for (std::size_t s = 0; s < thread->strands(); ++s)
    {
      const ThreadObject::Strand& strand = thread->strand(s);
      strand.part->setGuard(&guard_);
      strands_.push_back(strand.part.get());
      guarded_.push_back({&strand.stepper->work, *thread->model.contact, thread->model.merging});
    }
  guard_.setStrands(guarded_);
  merging_.setParts(strands_);
}

StepReport ObjectIsland::step(double duration)
{
  if (std::optional<StepReport> own = objects_.size() == 1 ? objects_.front()->stepAlone() : std::nullopt)
  {
    stepped_ = own->ok;
    return *own;
  }
  double first = 0.0;
  for (const RodObject* rod : rods_)
    if (const double own = rod->stepper->work.next_step; own > 0.0)
      first = first > 0.0 ? std::min(first, own) : own;
  StepReport report;
  const bool divisible = isDivisible();
  for (std::size_t k = 0; divisible && k < parts_.size() && report.ok; ++k)
  {
    single_ = {parts_[k]};
    island_.setParts(single_);
    double whole_step = 0.0;
    report.merge(island_.step(duration, whole_step));
  }
  if (!divisible && !parts_.empty())   // a thread may have left its region
    report = island_.step(duration, first);
  stepped_ = report.ok;
  if (!report.ok)
  {
    blameSolids(report);
    return report;
  }
  for (const RodObject* rod : rods_)
    rod->stepper->work.next_step = first;
  trace();
  return report;
}

/// Names the two solids that move as prescribed and press most on an object from opposite sides where the failed step
/// got stuck, if they come nearer to each other there.
void ObjectIsland::blameSolids(StepReport& report)
{
  if (!contact() || (report.failure != StepFailure::squeezed && report.failure != StepFailure::newton_diverged))
    return;
  struct Press
  {
    Eigen::Vector3d force = Eigen::Vector3d::Zero(), at = force;
    double most = 0.0;
  };
  std::map<std::pair<int, int>, Press> presses;   // by the place of an object, and the solid
  const std::vector<IslandSolid>& solids = island_.equations().solids;
  const std::vector<Pose>& now = island_.equations().startSolids();
  ContactPotential& potential = *island_.equations().contact();
  potential.setSprings({});   // Then nothing has friction where the step begins.
  potential.begin(island_.equations().startPoints(), now, world_.time.step);
  potential.evaluate(island_.equations().startPoints(), now, false);
  for (const ContactTerm& term : potential.terms())
    if (term.solid >= 0 && !solids[term.solid].body && solids_[term.solid]->kind != WorldSolid::Kind::floor)
      forParts([&](const WorldObject& object, std::size_t part) {
        if (const int point = term.point[0] - parts_[part]->first_point; point < 0 || point >= parts_[part]->points())
          return;
        Press& press = presses[{object.place, term.solid}];
        press.force += term.force;
        if (term.force.norm() > press.most)
        {
          press.most = term.force.norm();
          press.at = term.position;
        }
      });
  double most = 0.0;
  auto first = presses.end(), second = first;
  for (auto a = presses.begin(); a != presses.end(); ++a)
    for (auto b = std::next(a); b != presses.end() && b->first.first == a->first.first; ++b)
    {
      const double one = a->second.force.norm(), other = b->second.force.norm();
      if (std::min(one, other) <= most || a->second.force.dot(b->second.force) > -0.5 * one * other)
        continue;
      most = std::min(one, other);
      first = a;
      second = b;
    }
  if (!(most > 0.0))
    return;
  const int k = first->first.second, l = second->first.second;
  const auto room = [&](const Pose& X_WK, const Pose& X_WL) {
    const Eigen::Vector3d at = X_WK * (now[k].inverse() * first->second.at);
    return distanceToShape(solids_[l]->obstacle.shape, X_WL, at, at);
  };
  const auto end = [&](int solid) { return solids[solid].target.X_WG * solids[solid].X_BS; };
  const double needed = room(now[k], now[l]), left = room(end(k), end(l));
  if (!(left < needed))
    return;
  report.failure = StepFailure::squeezed;
  report.message = solids_[k]->name() + " and " + solids_[l]->name() + " leave " +
                   shared_.all[first->first.first]->name() + " too little room: it needs more than " +
                   shortNumber(1e3 * needed, 4) + " mm between them, and they are to be " +
                   shortNumber(1e3 * std::max(0.0, left), 4) +
                   " mm apart at the end of the step. Keep them farther apart. In detail: " + report.message;
}

/// The boxes of its objects from those of their parts.
void ObjectIsland::trace()
{
  if (isDivisible())   // nothing of them can meet anything
    return;
  for (std::size_t k = 0, member = 0; k < objects_.size(); ++k)
  {
    swept_[k] = BoundingBox::empty();
    for (; member < parts_end_[k]; ++member)
      swept_[k].include(island_.sweptBox(member));
  }
}

void ObjectIsland::addContacts(ContactLoads& out) const
{
  if (!contact())
    return;
  for (const ContactTerm& term : contact()->terms())
  {
    out.contacts.push_back({term.position, term.force});
    if (term.solid < 0)
      continue;
    const WorldSolid& solid = *solids_[term.solid];
    if (solid.kind == WorldSolid::Kind::obstacle)
      out.obstacles[solid.index].add(-term.force, term.position);
    if (solid.kind == WorldSolid::Kind::body)
      out.bodies[solid.index].add(-term.force, term.position);
    for (const BodyObject* body : bodies_)   // The points may belong to one of them.
    {
      const Part& part = *body->part;
      if (const int point = term.point[0] - part.first_point; point >= 0 && point < part.points())
        out.bodies[body->index].add(term.force, term.position);
    }
  }
}

void ObjectIsland::end(WorldState& state) const
{
  if (!contact())
    return;
  for (const WorldObject* object : objects_)
    object->contact(state).barrier = {};
  forParts([&](const WorldObject& object, std::size_t part) {   // Several strands keep the stiffest of their barriers.
    BarrierLaw& barrier = object.contact(state).barrier;
    const BarrierLaw& own = island_.barrier(part);
    const auto size = [](const BarrierLaw& law) { return std::make_pair(law.count(), law.layers[0].stiffness); };
    if (barrier.layers[0].stiffness == 0.0 || size(barrier) < size(own))
      barrier = own;
  });
  giveSprings(state);
}

}   // namespace slender
