#include "state_transfer.h"

#include <algorithm>
#include <stdexcept>

#include "scene/record/state_file.h"
#include "cloth_grasps.h"
#include "slender_sim/scene/reader.h"

namespace slender {

namespace {

/// Returns the index of the first entry that `fits`, or -1.
template <class Entry, class Fits>
int indexWhere(const std::vector<Entry>& entries, const Fits& fits)
{
  const auto found = std::find_if(entries.begin(), entries.end(), fits);
  return found == entries.end() ? -1 : static_cast<int>(found - entries.begin());
}

/// Returns, for each entry of `to`, the index of the entry of `from` with the same name, or -1.
template <class Named>
std::vector<int> sameNames(const std::vector<Named>& from, const std::vector<Named>& to)
{
  std::vector<int> same;
  for (const Named& one : to)
    same.push_back(indexWhere(from, [&](const Named& other) { return other.name == one.name; }));
  return same;
}

/// Copies the entries of objects that stay.
template <class Value>
void takeEntries(const std::vector<int>& same, const std::vector<Value>& from, std::vector<Value>& to)
{
  if (from.empty() || to.empty())   // some lists are empty in scenes without certain objects
    return;
  for (std::size_t k = 0; k < same.size(); ++k)
    if (same[k] >= 0)
      to[k] = from[static_cast<std::size_t>(same[k])];
}

bool isNew(int same) { return same < 0; }

}   // namespace

std::vector<BodyWeld> weldsOf(const SceneConfig& config)
{
  std::vector<BodyWeld> welds;
  std::vector<std::size_t> next;   // per rod
  for (const RodConfig& rod : config.rods)
    next.push_back(rod.grasps.size());
  for (int b = 0; b < static_cast<int>(config.bodies.size()); ++b)
    for (int k = 0; k < static_cast<int>(config.bodies[b].welds.size()); ++k)
    {
      const int rod = config.bodies[b].welds[k].rod;
      welds.push_back({b, k, rod, next[rod]++});
    }
  return welds;
}

StateTransfer::StateTransfer(const SceneConfig& from, const SceneGrasps& before, const SceneConfig& to,
                             const std::vector<GraspRef>& now)
  : to_(to),
    gap_ratio_(from.contact.gap > 0 && to.contact.gap > 0 ? from.contact.gap / to.contact.gap : 1.0),
    before_(before.begin(), before.end()),
    now_(now),
    welds_before_(weldsOf(from)),
    welds_now_(weldsOf(to))
{
  objects_[ObjectRef::rod] = sameNames(from.rods, to.rods);
  threads_ = sameNames(from.threads, to.threads);
  objects_[ObjectRef::cloth] = sameNames(from.cloths, to.cloths);
  objects_[ObjectRef::body] = sameNames(from.bodies, to.bodies);
  objects_[ObjectRef::obstacle] = sameNames(from.obstacles, to.obstacles);
  for (const GraspRef& grasp : now_)
  {
    grasps_.push_back(indexWhere(before_, [&](const GraspRef& other) {
      const ObjectRef holder{grasp.object.kind, indexBefore(grasp.object)};
      return other.object == holder && other.config->name == grasp.config->name;
    }));
  }
  for (const BodyWeld& weld : welds_now_)
    welds_.push_back(indexWhere(welds_before_, [&](const BodyWeld& other) {
      return other.body == bodies_[weld.body] && other.index == weld.index;
    }));
}

int StateTransfer::indexBefore(const ObjectRef& object) const
{
  return objects_[object.kind][static_cast<std::size_t>(object.index)];
}

void StateTransfer::checkTables(double time) const
{
  const auto check = [time](const auto& motion, const std::string& what) {
    const auto* table = std::get_if<TableMotion>(&motion);
    if (!table)
      return;
    const Pose first = table->poses.evaluate(table->poses.firstTime()), now = table->poses.evaluate(time);
    constexpr double kSame = 1e-9;   // tolerance [m], also for unit quaternions
    if ((first.position - now.position).norm() <= kSame &&
        1.0 - std::abs(first.orientation.dot(now.orientation)) <= kSame)
      return;
    throw SceneError(what + ": times of tables are those of the scene, which is at t = " + shortNumber(time, 6) +
                     " s: there the table has left its first pose already; let it begin later");
  };
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    if (isNew(bodies_[b]) && to_.bodies[b].motion)
      check(*to_.bodies[b].motion, "body " + to_.bodies[b].name);
  for (std::size_t k = 0; k < obstacles_.size(); ++k)
    if (isNew(obstacles_[k]))
      check(to_.obstacles[k].motion, "obstacle " + to_.obstacles[k].name);
  for (std::size_t k = 0; k < threads_.size(); ++k)
    if (isNew(threads_[k]) && to_.threads[k].nozzle)
      check(to_.threads[k].nozzle->motion, "the nozzle of thread " + to_.threads[k].name);
  for (const GraspRef& grasp : now_)
    if (isNew(indexBefore(grasp.object)))
      check(grasp.config->motion, "grasp " + grasp.config->name);
}

std::string StateTransfer::newWelds() const
{
  for (std::size_t w = 0; w < welds_now_.size(); ++w)
  {
    const BodyConfig& body = to_.bodies[welds_now_[w].body];
    const int rod = welds_now_[w].rod;
    if (isNew(welds_[w]) && !isNew(rods_[rod]))
      return "body " + body.name + " was welded to rod " + to_.rods[rod].name +
             " while it moved, so that the two do not fit together where the scene starts; ~remove " + body.name +
             " before ~reset";
  }
  return "";
}

void StateTransfer::takeWelds(const std::vector<Pose>& before, WorldModel& model) const
{
  for (std::size_t w = 0; w < welds_.size(); ++w)
    if (!isNew(welds_[w]))
      model.welds[w].X_BG = before[static_cast<std::size_t>(welds_[w])];
}

/// Copies the grasps of objects that stay. The lists of grasps in `state` must be as the scene gives them.
void StateTransfer::takeGrasps(const SceneState& before, SceneState& state) const
{
  for (std::size_t g = 0; g < now_.size(); ++g)
  {
    const auto& [object, index, config] = now_[g];
    if (isNew(indexBefore(object)))
      continue;
    const auto take = [&, grasp = index](auto& to, const auto& from) {
      if (isNew(grasps_[g]))
        to[grasp].active = false;
      else
        to[grasp] = from[before_[static_cast<std::size_t>(grasps_[g])].index];
    };
    if (object.isCloth())
      take(state.cloth_grasps[object.index], before.cloth_grasps[indexBefore(object)]);
    else
      take(state.rods[object.index].grasps, before.rods[indexBefore(object)].grasps);
  }
  takeEntries(grasps_, before.grasp_offsets, state.grasp_offsets);
  takeEntries(grasps_, before.wrenches, state.wrenches);
}

/// Returns true if the same grasps and welds, in the same order, hold a rod before and after the edit.
bool StateTransfer::isHeldAsBefore(int rod) const
{
  std::vector<int> grasps_before, grasps_now, welds_before, welds_now;
  for (int g = 0; g < static_cast<int>(before_.size()); ++g)
    if (before_[g].object == ObjectRef{ObjectRef::rod, rods_[rod]})
      grasps_before.push_back(g);
  for (std::size_t g = 0; g < now_.size(); ++g)
    if (now_[g].object == ObjectRef{ObjectRef::rod, rod})
      grasps_now.push_back(grasps_[g]);
  for (int w = 0; w < static_cast<int>(welds_before_.size()); ++w)
    if (welds_before_[w].rod == rods_[rod])
      welds_before.push_back(w);
  for (std::size_t w = 0; w < welds_now_.size(); ++w)
    if (welds_now_[w].rod == rod)
      welds_now.push_back(welds_[w]);
  return grasps_before == grasps_now && welds_before == welds_now;
}

void StateTransfer::take(const SceneState& before, const WorldModel& world, SceneState& state) const
{
  const SceneState given = state;
  state.time = before.time;
  state.steps = before.steps;
  takeEntries(rods_, before.rods, state.rods);
  for (std::size_t r = 0; r < rods_.size(); ++r)
  {
    if (isNew(rods_[r]))
      continue;
    state.rods[r].grasps = given.rods[r].grasps;
    if (!isHeldAsBefore(static_cast<int>(r)))
      state.rods[r].forgetHistory();   // the integrator's history belongs to other constraints
  }
  takeEntries(rods_, before.rod_guides, state.rod_guides);
  takeEntries(threads_, before.threads, state.threads);
  takeEntries(threads_, before.end_loads, state.end_loads);
  takeEntries(cloths_, before.cloths, state.cloths);
  takeEntries(cloths_, before.cloth_guides, state.cloth_guides);
  takeEntries(bodies_, before.bodies, state.bodies);
  takeEntries(obstacles_, before.obstacles, state.obstacles);
  takeEntries(obstacles_, before.obstacle_velocities, state.obstacle_velocities);
  takeGrasps(before, state);
  for (std::size_t k = 0; k < cloths_.size(); ++k)
    gatherPins(state.cloth_grasps[k], state.cloths[k]);
  const std::string problem = misfit(state, given, world);
  if (!problem.empty())
    throw SceneError(problem + "; this cannot change while the scene runs: start the edited scene anew");
}

/// Copies what contact keeps of the objects that stay. Shares of the gap become those of the new gap. Ranges to solids
/// that stay are the old ones, and those to new solids the ones that the edited world has found.
void StateTransfer::takeContacts(const std::vector<int>& same, const std::vector<ContactMemory>& from,
                                 std::vector<ContactMemory>& to) const
{
  if (from.empty() || to.empty())
    return;
  // Gives a partner its number in the edited world. Returns false if it is gone.
  const auto renumber = [&](ObjectRef& partner) {
    const std::vector<int>& map = objects_[partner.kind];
    const auto at = std::find(map.begin(), map.end(), partner.index);
    partner.index = static_cast<int>(at - map.begin());
    return at != map.end();
  };
  for (std::size_t k = 0; k < same.size(); ++k)
  {
    if (isNew(same[k]))
      continue;
    const std::vector<ContactRange> found = to[k].ranges;
    to[k] = from[static_cast<std::size_t>(same[k])];
    const auto keep = [&](auto& list) {
      const auto gone = [&](auto& entry) { return !renumber(entry.partner); };
      list.erase(std::remove_if(list.begin(), list.end(), gone), list.end());
    };
    keep(to[k].springs);
    keep(to[k].ranges);
    for (ContactRange& range : to[k].ranges)
      range.share = std::min(1.0, gap_ratio_ * range.share);
    for (BarrierLayer& layer : to[k].barrier.layers)
      layer.share = std::min(1.0, gap_ratio_ * layer.share);
    for (const ContactRange& range : found)
      if (isNew(indexBefore(range.partner)))
        to[k].ranges.push_back(range);
  }
}

void StateTransfer::takeAdded(const SceneState& before, SceneState& state) const
{
  takeContacts(rods_, before.contact.rods, state.contact.rods);
  takeContacts(threads_, before.contact.threads, state.contact.threads);
  takeContacts(bodies_, before.contact.bodies, state.contact.bodies);
  takeContacts(cloths_, before.contact.cloths, state.contact.cloths);

  for (std::size_t w = 0; w < welds_.size(); ++w)
  {
    if (isNew(welds_[w]))
      continue;
    const BodyWeld& old = welds_before_[static_cast<std::size_t>(welds_[w])];
    GraspState& grasp = state.rods[welds_now_[w].rod].grasps[welds_now_[w].grasp];
    const int body = grasp.body;
    grasp = before.rods[old.rod].grasps[old.grasp];
    grasp.body = body;
  }
}

void StateTransfer::attachNew(SceneGrasps& grasps, double time) const
{
  const auto hasNew = [](const auto& solids, const std::vector<int>& same, const std::string& name) {
    for (std::size_t k = 0; k < same.size(); ++k)
      if (isNew(same[k]) && solids[k].name == name)
        return true;
    return false;
  };
  for (int g = 0; g < static_cast<int>(now_.size()); ++g)
  {
    const GraspConfig& config = *now_[g].config;
    const auto* body = std::get_if<BodyMotion>(&config.motion);
    if (!isNew(grasps_[g]))
    {
      if (body && (hasNew(to_.bodies, bodies_, body->body) ||
                   hasNew(to_.obstacles, obstacles_, body->body)))   // before, no body of the scene had this name
        grasps.takeOffset(g, time);
    }
    else if (isNew(indexBefore(now_[g].object)))
    {
      if (config.attach == Attach::initial)
        grasps.takeOffset(g, time);
    }
    else
    {
      try
      {
        if (now_[g].object.isCloth())
          grasps.attachVertices(g, config.vertices);
        else
          grasps.attach(g, config.first_node, config.last_node, config.hold);
      }
      catch (const std::invalid_argument& error)
      {
        throw SceneError(error.what());
      }
    }
  }
}

}   // namespace slender
