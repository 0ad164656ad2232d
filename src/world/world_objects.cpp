#include "world_objects.h"

#include <algorithm>

#include "meeting.h"
#include "slender_sim/contact/solids.h"
#include "slender_sim/world/world.h"

namespace slender {

namespace {

bool isSound(const GraspTarget& t)
{
  return t.X_WG.position.allFinite() && std::abs(t.X_WG.orientation.norm() - 1.0) < 1e-3 &&
         (!t.velocity || (t.velocity->linear.allFinite() && t.velocity->angular.allFinite()));
}

bool refuseInput(const std::string& what, StepReport& report)
{
  report = StepReport();
  report.ok = false;
  report.failure = StepFailure::input_not_finite;
  report.message = what + " is not finite or not valid; correct this input";
  return false;
}

/// Whether a body touches solids, and there are any besides its own.
bool meetsSolids(const WorldModel& world, int body)
{
  const std::optional<Shape>& shape = world.bodies[body].shape;
  if (!shape || !hasBodySurface(*shape) || !(world.contact.gap > 0.0))
    return false;
  bool others = !world.obstacles.empty();
  for (int b = 0; b < static_cast<int>(world.bodies.size()); ++b)
    others = others || (b != body && world.bodies[b].shape);
  return others;
}

bool touches(const WorldModel::Rod& rod) { return rod.contact.has_value(); }

/// Null: the rod tracks nothing.
std::shared_ptr<const WeakConstraints> constraintsOf(const WorldModel::Rod& rod)
{
  if (!rod.tracked.sets)
    return nullptr;
  const auto& constraints = rod.tracked.sets->front().constraints;
  if (!constraints || constraints->count() == 0 || constraints->matrix().cols() != rod.model->nodes())
    throw std::invalid_argument("rod '" + rod.model->name + "': averages of its " + std::to_string(rod.model->nodes()) +
                                " nodes expected, at least one");
  return constraints;
}

/// Throws std::invalid_argument if a rod cannot track its guide in these steps.
void checkTracking(const TimeConfig& time, const std::string& rod)
{
  const std::string who = "rod '" + rod + "': ";
  if (time.integrator != Integrator::implicit_euler || time.error_tolerance > 0)
    throw std::invalid_argument(who + "prescribed averages need time.integrator: implicit_euler, with fixed steps");
}

/// The bodies, and the rods that may meet something.
WorldContent rodsAndBodies(const WorldModel& world, WorldContent content)
{
  const auto alone = [&](int rod) { return !meetsOthers(world, rod); };
  content.rods.erase(std::remove_if(content.rods.begin(), content.rods.end(), alone), content.rods.end());
  content.threads.clear();
  content.cloths.clear();
  return content;
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

bool meetsOthers(const WorldModel& world, int rod)
{
  return world.rods[rod].contact || std::any_of(world.welds.begin(), world.welds.end(),
                                                [rod](const WorldModel::RodWeld& weld) { return weld.rod == rod; });
}

// ---- what there is

WorldObjects::WorldObjects(const WorldModel& model, WorldContent parts, WorldState& state)
  : world(model),
    content(std::move(parts))
{
  addObjects(world.time);
  addWelds(state);
  if (!touch())
    return;
  state.contact_stiffness.rods.resize(world.rods.size());
  state.contact_stiffness.threads.resize(world.threads.size());
  state.contact_stiffness.bodies.resize(world.bodies.size());
  state.contact_stiffness.cloths.resize(world.cloths.size());
  addSolids();
}

WorldObjects::WorldObjects(const WorldObjects& other, const TimeConfig& time)
  : world(other.world),
    content(rodsAndBodies(other.world, other.content)),
    welds(other.welds)
{
  addObjects(time);
  for (const Weld& weld : welds)
    follow(weld);
  if (touch())
    addSolids();
}

// ---- rods

RodObject::RodObject(const WorldModel& world, int number, const TimeConfig& time)
  : WorldObject(number),
    whole(std::make_unique<RodStepper>(world.rods[number].model, time)),
    stepper(&whole->impl()),
    constraints(constraintsOf(world.rods[number])),
    part(std::make_unique<RodPart>(*stepper, touches(world.rods[number]),
                                   constraints ? &constraints->matrix() : nullptr)),
    meets(meetsOthers(world, number)),
    contact_(world.rods[number].contact),
    guide_size_(world.rods[number].tracked.size),
    duration_(world.time.step)
{
  if (constraints)
    checkTracking(world.time, stepper->model->name);
  if (contact_)
    part->setContact(*contact_, world.rods[number].ignored);
}

bool RodObject::load(const WorldState& state, const WorldInputs& with, StepReport& report)
{
  stepper->begin(state.rods[index]);
  part->begin(inputs, duration_);
  if (!constraints)
    return true;
  constraints->averages(with.rod_guides[index], targets_);
  if (!targets_.allFinite())
    return refuseInput(name() + ": its guide", report);
  part->averages()->begin(state.rods[index].x, targets_);
  return true;
}

void RodObject::finishGuide(const WorldInputs& with, WorldState& state, StepReport& report) const
{
  if (!constraints)
    return;
  state.rod_guides[index].points = with.rod_guides[index];
  state.rod_guides[index].forces = part->averages()->forces;
  report.tracking_error =
      std::max(report.tracking_error, constraints->error(targets_, state.rods[index].x) / guide_size_);
}

IslandFinder::Reach RodObject::reach() const
{
  const bool touches = contact_.has_value();
  return {touches, touches && contact_->others, touches && contact_->solids, false, BoundingBox::empty()};
}

void RodObject::addTo(Meeting& meeting, const WorldState& state)
{
  if (!contact_)
    return;
  part->addSurface(meeting.surface);
  meeting.add(name(), state.rods[index].x);
}

// ---- bodies

BodyObject::BodyObject(const WorldModel& world, int number)
  : WorldObject(number),
    part(std::make_unique<BodyPart>(world.bodies[number].body)),
    model_(world.bodies[number])
{
  if (!model_.shape)
    return;
  part->setReach(model_.X_BS.position.norm() + boundingRadius(*model_.shape));
  if (meetsSolids(world, number))
    part->setSurface(makeBodySurface(*model_.shape, model_.X_BS),
                     model_.friction < 0.0 ? ContactProperties().friction : model_.friction);
}

bool BodyObject::load(const WorldState& state, const WorldInputs& inputs, StepReport&)
{
  part->begin(state.bodies[index], inputs.gravity);
  return true;
}

IslandFinder::Reach BodyObject::reach() const
{
  return {part->hasSurface(), false, part->hasSurface(), model_.shape.has_value(), BoundingBox::empty()};
}

void BodyObject::addTo(Meeting& meeting, const WorldState& state)
{
  if (!part->hasSurface())
    return;
  static_cast<const Part&>(*part).addSurface(meeting.surface);
  meeting.add(name(), part->surfaceAt(state.bodies[index].X_WB));
}

// ---- cloths

ClothObject::ClothObject(const WorldModel& world, int number, const TimeConfig& time)
  : WorldObject(number),
    part(std::make_unique<ClothPart>(world.cloths[number].model, world.cloths[number].options)),
    contact_(*world.cloths[number].contact),
    duration_(world.time.step)
{
  part->setContact(contact_, time.step, world.cloths[number].ignored);
}

bool ClothObject::load(const WorldState& state, const WorldInputs& inputs, StepReport& report)
{
  const ClothState& from = state.cloths[index];
  const ClothInputs& with = inputs.cloths[index];
  if (!part->accepts(from, with, duration_, report))
    return false;
  part->begin(from, with, duration_);
  return true;
}

IslandFinder::Reach ClothObject::reach() const
{
  return {true, contact_.others, contact_.solids, false, BoundingBox::empty()};
}

void ClothObject::addTo(Meeting& meeting, const WorldState& state)
{
  part->setPins(state.cloths[index].pins);
  part->addSurface(meeting.surface);
  meeting.add(name(), state.cloths[index].x);
}

// ---- threads

bool ThreadObject::load(const WorldState& state, const WorldInputs& inputs, StepReport& report)
{
  inputs_ = still_ = inputs.threads[index];
  still_.flow_rate = 0.0;
  work_ = state.threads[index];
  makeStrands(work_.threads.size());
  const std::uint64_t next_id = nextId(work_.threads);
  for (std::size_t s = 0; s < work_.threads.size(); ++s)
  {
    ThreadState& strand = work_.threads[s];
    strand.next_id = next_id;
    if (!strands_[s].stepper->begin(strand, strand.ends[1].held ? inputs_ : still_, time_.step, report))
      return false;
    strands_[s].part->setDuration(time_.step);
  }
  return true;
}

void ThreadObject::makeStrands(std::size_t count)
{
  while (strands_.size() < count)
  {
    Strand added;
    added.stepper = std::make_unique<ThreadStepper::Impl>(model.model, time_.newton, false);
    added.part = std::make_unique<ThreadPart>(*added.stepper);
    if (model.contact)
      added.part->setContact(*model.contact, model.merging, index);
    strands_.push_back(std::move(added));
  }
}

void ThreadObject::addParts(std::vector<Part*>& parts)
{
  for (std::size_t s = 0; s < strands(); ++s)
    parts.push_back(strands_[s].part.get());
}

IslandFinder::Reach ThreadObject::reach() const
{
  const auto& contact = model.contact;
  return {contact.has_value(), contact && contact->others, contact && contact->solids, false, BoundingBox::empty()};
}

void ThreadObject::finish(WorldState& state)
{
  loads = {};
  const std::uint64_t before = nextId(work_.threads);
  for (std::size_t s = 0; s < work_.threads.size(); ++s)
  {
    ThreadState& strand = work_.threads[s];
    std::swap(strand, strands_[s].stepper->work);
    for (int end = 0; end < 2; ++end)
      if (strand.ends[end].held)
        loads[end] = strands_[s].stepper->loads[end];
  }
  renumber(work_.threads, before);
  breakThreads(work_, model.model->limits);
  dropThreads(work_, model.model->limits);
  std::swap(state.threads[index], work_);
}

void ThreadObject::addTo(Meeting& meeting, const WorldState& state)
{
  if (!model.contact)
    return;
  const std::vector<ThreadState>& threads = state.threads[index].threads;
  makeStrands(threads.size());
  for (std::size_t s = 0; s < threads.size(); ++s)
  {
    strands_[s].stepper->work = threads[s];
    strands_[s].part->addSurface(meeting.surface);
    meeting.add(name(), Eigen::Map<const Eigen::Matrix3Xd>(threads[s].x.front().data(), 3, threads[s].nodes()));
  }
}

// ---- solids

/// Objects with a surface are numbered in their order.
ContactSolid WorldSolid::asTouched(const std::vector<WorldObject*>& by) const
{
  ContactSolid touched{obstacle};
  touched.body = body != nullptr;
  if (kind == Kind::obstacle)
    touched.number = index;
  if (kind == Kind::floor)
    touched.only = index;
  int number = 0;
  for (const WorldObject* object : by)
    if (object->hasSurface())
    {
      if (std::find(ignores.begin(), ignores.end(), object) != ignores.end())
        touched.ignores.push_back(number);
      ++number;
    }
  return touched;
}

// ---- all of them

void WorldObjects::addObjects(const TimeConfig& time)
{
  for (const int b : content.bodies)
    if (world.bodies[b].body.simulated)
      add(bodies.emplace_back(world, b));
  for (const int r : content.rods)
  {
    try
    {
      add(rods.emplace_back(world, r, time));
    }
    catch (const std::invalid_argument& error)
    {
      throw WorldError(FailurePlace::Kind::rod, r, error.what());
    }
  }
  for (const int c : content.cloths)
    add(cloths.emplace_back(world, c, time));
  for (const int k : content.threads)
    add(threads.emplace_back(world, k));
}

void WorldObjects::add(WorldObject& object)
{
  object.place = static_cast<int>(all.size());
  all.push_back(&object);
}

/// Whether any of them may touch something.
bool WorldObjects::touch() const
{
  return std::any_of(all.begin(), all.end(), [](const WorldObject* object) { return object->hasSurface(); });
}

const BodyObject* WorldObjects::simulated(int body) const
{
  for (const BodyObject& b : bodies)
    if (b.index == body)
      return &b;
  return nullptr;
}

void WorldObjects::addWelds(WorldState& state)
{
  for (const WorldModel::RodWeld& weld : world.welds)
  {
    const auto at = std::find_if(rods.begin(), rods.end(), [&](const RodObject& rod) { return rod.index == weld.rod; });
    if (at == rods.end())
      continue;
    RodState& rod = state.rods[weld.rod];
    GraspState grasp = makeGrasp(*world.rods[weld.rod].model, rod, weld.first_node, weld.last_node, true);
    grasp.body = simulated(weld.body) ? weld.body : -1;
    const Pose X_BG = weld.X_BG.value_or(state.bodies[weld.body].X_WB.inverse() * grasp.X_WG);
    welds.push_back({static_cast<int>(at - rods.begin()), static_cast<int>(rod.grasps.size()), weld.body, X_BG});
    follow(welds.back());
    rod.grasps.push_back(grasp);
  }
}

void WorldObjects::follow(const Weld& weld)
{
  const BodyObject* body = simulated(weld.body);
  if (!body)
    return;
  rods[weld.rod].part->addWeld({weld.grasp, body->part.get(), weld.X_BG});
  joined.emplace_back(rods[weld.rod].place, body->place);
}

void WorldObjects::addSolids()
{
  for (std::size_t k = 0; k < world.obstacles.size(); ++k)
    solids.push_back({WorldSolid::Kind::obstacle, static_cast<int>(k), world.obstacles[k]});
  for (const int b : content.bodies)
  {
    const WorldModel::Body& body = world.bodies[b];
    if (!body.shape)
      continue;
    const BodyObject* carrier = simulated(b);
    solids.push_back({WorldSolid::Kind::body, b, body.solid(), carrier ? carrier->part.get() : nullptr, body.X_BS});
    if (carrier)
      solids.back().ignores.push_back(carrier);
    for (const Weld& weld : welds)
      if (weld.body == b)
        solids.back().ignores.push_back(&rods[weld.rod]);
  }
  for (const ThreadObject& thread : threads)
    if (const ThreadFloor& floor = thread.model.model->floor; floor.slips())
      solids.push_back({WorldSolid::Kind::floor, thread.index, {Plane{}, floor.friction}});
}

// ---- inputs

/// What is wrong with the inputs that all parts share; empty: nothing is.
std::string WorldObjects::badInput(const WorldState& state, const WorldInputs& inputs) const
{
  if (inputs.rods.size() != state.rods.size() || state.rods.size() != world.rods.size())
    return "number of rods";
  if (inputs.threads.size() != state.threads.size() || state.threads.size() != world.threads.size())
    return "number of threads";
  if (inputs.cloths.size() != state.cloths.size() || state.cloths.size() != world.cloths.size())
    return "number of cloths";
  if (inputs.bodies.size() != state.bodies.size() || state.bodies.size() != world.bodies.size())
    return "number of bodies";
  if (inputs.obstacles.size() != state.obstacles.size() || state.obstacles.size() != world.obstacles.size() ||
      state.obstacle_velocities.size() != state.obstacles.size())
    return "number of obstacles";
  for (const int b : content.bodies)
    if (!world.bodies[b].body.simulated && !isSound(inputs.bodies[b]))
      return "pose of body " + world.bodies[b].body.name;
  for (std::size_t k = 0; k < inputs.obstacles.size(); ++k)
    if (!isSound(inputs.obstacles[k]))
      return "pose of obstacle " + world.obstacles[k].name;
  for (const int k : content.threads)
    if (!inputs.threads[k].belt_velocity.allFinite())
      return "belt velocity of thread " + world.threads[k].model->name;
  return inputs.gravity.allFinite() ? "" : "gravity";
}

/// Grasps that driven bodies carry get their targets from these.
void WorldObjects::carryGrasps(const WorldInputs& inputs)
{
  for (const Weld& weld : welds)
  {
    std::vector<GraspTarget>& grasps = rods[weld.rod].inputs.grasps;
    if (!world.bodies[weld.body].body.simulated && weld.grasp < static_cast<int>(grasps.size()))
    {
      const GraspTarget& body = inputs.bodies[weld.body];
      GraspTarget& grasp = grasps[weld.grasp];
      grasp.X_WG = body.X_WG * weld.X_BG;
      grasp.velocity = body.velocity;
      if (grasp.velocity)
        grasp.velocity->linear += grasp.velocity->angular.cross(body.X_WG.orientation * weld.X_BG.position);
    }
  }
}

bool WorldObjects::takeInputs(const WorldState& state, const WorldInputs& inputs, StepReport& report)
{
  if (const std::string bad = badInput(state, inputs); !bad.empty())
    return refuseInput(bad, report);
  for (RodObject& rod : rods)
    rod.inputs = inputs.rods[rod.index];
  carryGrasps(inputs);
  std::string what;
  for (const RodObject& rod : rods)
    if (!rod.stepper->inputsFinite(state.rods[rod.index], rod.inputs, what))
      return refuseInput("rod '" + rod.stepper->model->name + "': " + what, report);
  return true;
}

}   // namespace slender
