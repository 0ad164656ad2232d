// Rods, threads and bodies as one island: what it consists of.
#include "joined_parts.h"

#include <algorithm>
#include <stdexcept>

namespace slender {

namespace {

void check(const WorldModel& world, const IslandContent& content)
{
  const auto need = [](bool good, const std::string& what) {
    if (!good)
      throw std::invalid_argument(what);
  };
  for (const int b : content.bodies)
    checkBody(world.bodies[b].body);
  for (const int k : content.threads)
  {
    const ThreadModel& model = *world.threads[k].model;
    const ThreadTouch& touch = *world.threads[k].contact;
    checkThreadModel(model);
    const auto check_value = [&](bool good, const char* what, double value, const char* range) {
      need(good, "thread '" + model.name + "': " + what + " is " + std::to_string(value) + ", allowed: " + range);
    };
    check_value(touch.friction >= 0.0 && std::isfinite(touch.friction), "friction", touch.friction, "zero or more");
    check_value(touch.merging >= 0.0 && touch.merging < 1.0, "merging", touch.merging, "zero to 1 (exclusive)");
  }
  const bool simulates = !content.rods.empty() || std::any_of(content.bodies.begin(), content.bodies.end(),
                                                              [&](int b) { return world.bodies[b].body.simulated; });
  need(content.threads.empty() || !simulates || world.time.integrator == Integrator::implicit_euler,
       "threads that touch rods or bodies are stepped together with them, by implicit Euler: set time.integrator: "
       "implicit_euler");
}

/// Threads are stepped by implicit Euler alone.
TimeConfig timeOf(const WorldModel& world, const IslandContent& content)
{
  TimeConfig time = world.time;
  if (!content.threads.empty())
    time.integrator = Integrator::implicit_euler;
  return time;
}

}   // namespace

JoinedParts::JoinedParts(const WorldModel& world, IslandContent content, WorldState& state)
  : world_(world),
    content_(std::move(content)),
    guard_(world.contact.gap),
    stepper_(timeOf(world, content_), !content_.threads.empty())
{
  check(world, content_);
  for (const int b : content_.bodies)
    if (world.bodies[b].body.simulated)
      bodies_.push_back({b, std::make_unique<BodyPart>(world.bodies[b].body)});
  addRods(state);
  addThreads();
  setMembers();
  addContact();
  checkClearance(state);
}

BodyPart* JoinedParts::simulated(int body) const
{
  for (const Body& b : bodies_)
    if (b.index == body)
      return b.part.get();
  return nullptr;
}

void JoinedParts::addRods(WorldState& state)
{
  int nodes = 0;
  IslandTolerances& tolerances = stepper_.island().tolerances;
  for (const int r : content_.rods)
  {
    const WorldModel::Rod& rod = world_.rods[r];
    Rod added{r, std::make_unique<RodStepper::Impl>(rod.model, world_.time), nullptr, {}};
    added.part = std::make_unique<RodPart>(*added.stepper, rod.contact.has_value());
    if (rod.contact)
      added.part->setContact(*rod.contact);
    rods_.push_back(std::move(added));
    nodes += rod.model->nodes();
  }
  tolerances.angles_may_keep_shift = !rods_.empty();
  tolerances.most_unbalanced =
      content_.threads.empty() ? std::numeric_limits<double>::infinity() : ThreadSystem::mostUnbalanced();
  constexpr int kWorthThreads = 4000;   // nodes; less is done before threads are awake
  stepper_.island().setThreads(0, rods_.size() > 1 && nodes >= kWorthThreads);
  for (const WorldModel::RodWeld& weld : world_.welds)
  {
    const auto at = std::find_if(rods_.begin(), rods_.end(), [&](const Rod& rod) { return rod.index == weld.rod; });
    if (at == rods_.end())
      continue;
    RodState& rod = state.rods[weld.rod];
    GraspState grasp = makeGrasp(*world_.rods[weld.rod].model, rod, weld.first_node, weld.last_node, true);
    BodyPart* body = simulated(weld.body);
    grasp.body = body ? weld.body : -1;
    const Pose X_BG = state.bodies[weld.body].X_WB.inverse() * grasp.X_WG;
    const int number = static_cast<int>(rod.grasps.size());
    welds_.push_back({static_cast<int>(at - rods_.begin()), number, weld.body, X_BG});
    if (body)
      at->part->addWeld({number, body, X_BG});
    rod.grasps.push_back(grasp);
  }
}

void JoinedParts::addThreads()
{
  for (const int k : content_.threads)
  {
    threads_.emplace_back();
    threads_.back().index = k;
    merges_ = merges_ || world_.threads[k].contact->merging > 0.0;
  }
  if (merges_)
    stepper_.setAttraction(&merging_);
}

/// Numbers of the objects of the contact that are welded to a body. They start inside it.
std::vector<int> JoinedParts::objectsWeldedTo(int body) const
{
  std::vector<int> objects;
  int object = 0;
  for (std::size_t r = 0; r < rods_.size(); ++r)
  {
    if (!world_.rods[rods_[r].index].contact)
      continue;
    if (std::any_of(welds_.begin(), welds_.end(),
                    [&](const Weld& weld) { return weld.body == body && weld.rod == static_cast<int>(r); }))
      objects.push_back(object);
    ++object;
  }
  return objects;
}

void JoinedParts::addContact()
{
  const bool touches = !threads_.empty() || std::any_of(rods_.begin(), rods_.end(), [&](const Rod& rod) {
    return world_.rods[rod.index].contact.has_value();
  });
  if (!touches)
    return;
  std::vector<ContactSolid> solids;
  std::vector<IslandSolid>& moving = stepper_.island().solids;
  for (std::size_t k = 0; k < world_.obstacles.size(); ++k)
  {
    solids_.push_back({Solid::Kind::obstacle, static_cast<int>(k)});
    solids.push_back({world_.obstacles[k].shape, world_.obstacles[k].friction, {}});
    moving.emplace_back();
  }
  for (const int b : content_.bodies)
  {
    const WorldModel::Body& body = world_.bodies[b];
    if (!body.shape)
      continue;
    solids_.push_back({Solid::Kind::body, b});
    solids.push_back({*body.shape, body.friction, objectsWeldedTo(b)});
    moving.emplace_back();
    moving.back().body = simulated(b);
    moving.back().X_BS = body.X_BS;
  }
  for (const Thread& thread : threads_)
    if (const ThreadFloor& floor = world_.threads[thread.index].model->floor; floor.slips())
    {
      solids_.push_back({Solid::Kind::floor, thread.index});
      solids.push_back({Plane{}, floor.friction, {}});
      solids.back().only = thread.index;
      moving.emplace_back();
    }
  stepper_.setContact(solids, world_.contact);
}

const std::vector<ContactTerm>* JoinedParts::contacts() const
{
  const ContactPotential* contact = stepper_.island().contact();
  return contact ? &contact->terms() : nullptr;
}

void JoinedParts::setThreads(int threads)
{
  int nodes = 0;
  for (const Rod& rod : rods_)
    nodes += rod.stepper->model->nodes();
  constexpr int kWorthThreads = 4000;
  stepper_.island().setThreads(threads, rods_.size() > 1 && nodes >= kWorthThreads);
}

/// The parts of the present step, bodies first.
void JoinedParts::setMembers()
{
  members_.clear();
  for (const Body& body : bodies_)
    members_.push_back({body.part.get(), body.part.get()});
  for (const Rod& rod : rods_)
    members_.push_back({rod.part.get(), rod.part.get()});
  for (ThreadPart* strand : strands_)
    members_.push_back({strand, strand});
  stepper_.setMembers(members_);
}

/// Threads with their own contact have a stiffness of their own; it depends on their scale.
double& JoinedParts::stiffnessOf(WorldState& state) const
{
  return rods_.empty() && bodies_.empty() ? state.thread_contact_stiffness : state.contact_stiffness;
}

StepReport JoinedParts::solveEquilibrium(WorldState& state, const WorldInputs& inputs)
{
  if (rods_.empty() && bodies_.empty())
    return {};
  RodGroupModel model;
  for (const Rod& rod : rods_)
  {
    model.rods.push_back(world_.rods[rod.index].model);
    if (const auto& contact = world_.rods[rod.index].contact)
    {
      model.contact.rods.push_back(*contact);
      model.contact.rods.back().rod = static_cast<int>(model.rods.size()) - 1;
    }
  }
  RodGroupInputs group_inputs;
  RodGroupState group_state;
  const auto placeOf = [&](int body) {
    return static_cast<int>(std::find(content_.bodies.begin(), content_.bodies.end(), body) - content_.bodies.begin());
  };
  for (const int b : content_.bodies)
  {
    const WorldModel::Body& body = world_.bodies[b];
    model.bodies.push_back(body.body);
    if (body.shape && !model.contact.rods.empty())
      model.contact.bodies.push_back({placeOf(b), *body.shape, body.X_BS, body.friction});
    group_inputs.bodies.push_back(inputs.bodies[b]);
    group_state.bodies.push_back(state.bodies[b]);
  }
  for (const WorldModel::Obstacle& obstacle : world_.obstacles)
    model.contact.obstacles.push_back({obstacle.shape, obstacle.friction});
  model.contact.options = world_.contact;
  for (const Weld& weld : welds_)
    model.welds.push_back({weld.rod, weld.grasp, placeOf(weld.body), weld.X_BG});
  for (const Rod& rod : rods_)
  {
    group_state.rods.push_back(state.rods[rod.index]);
    group_inputs.rods.push_back(inputs.rods[rod.index]);
  }
  group_state.obstacles = state.obstacles;
  group_state.obstacle_velocities = state.obstacle_velocities;
  group_state.contact_stiffness = state.contact_stiffness;
  group_inputs.obstacles = inputs.obstacles;
  group_inputs.gravity = inputs.gravity;
  RodGroup group(std::move(model), world_.time);
  const StepReport report = group.solveEquilibrium(group_state, group_inputs);
  if (!report.ok)
    return report;
  for (std::size_t r = 0; r < rods_.size(); ++r)
  {
    state.rods[rods_[r].index] = group_state.rods[r];
    rods_[r].stepper->wrenches = group.wrenches(static_cast<int>(r));
  }
  for (const int b : content_.bodies)
    state.bodies[b] = group_state.bodies[placeOf(b)];
  state.obstacles = group_state.obstacles;
  state.obstacle_velocities = group_state.obstacle_velocities;
  state.contact_stiffness = group_state.contact_stiffness;
  return report;
}

}   // namespace slender
