// What happens to threads that touch in a substep.
#include <algorithm>
#include <cmath>

#include "slender_sim/contact/ccd.h"
#include "slender_sim/contact/distance.h"
#include "slender_sim/contact/solids.h"
#include "thread_contact.h"

namespace slender {

namespace {

ContactSurface solidsOf(const TouchingModel& model)
{
  ContactSurface surface;
  for (const TouchingModel::Obstacle& o : model.obstacles)
    surface.solids.push_back({o.shape, o.friction, {}});
  for (std::size_t k = 0; k < model.threads.size(); ++k)
    if (const ThreadFloor& floor = model.threads[k]->floor; floor.slips())
    {
      surface.solids.push_back({Plane{}, floor.friction, {}});
      surface.solids.back().only = static_cast<int>(k);
    }
  return surface;
}

}   // namespace

ThreadContact::ThreadContact(const TouchingModel& model) : model_(model)
{
  ContactSurface surface = solidsOf(model);
  island_.solids.resize(surface.solids.size());
  island_.setContact(std::move(surface), model.options);
  island_.tolerances.most_unbalanced = ThreadSystem::mostUnbalanced();
  first_stiffness_ = island_.contact()->stiffness();
  for (const ThreadTouch& touch : model.touches)
    merges_ = merges_ || touch.merging > 0.0;
  island_.setAttraction(merges_ ? &merging_ : nullptr);
}

void ThreadContact::addCurve(const ThreadState& state, int kind)
{
  const ThreadTouch& touch = model_.touches[kind];
  const ThreadModel& model = *model_.threads[kind];
  ContactSegment s;
  s.object = static_cast<int>(objects_.size());
  s.core = touch.merging > 0.0 ? touch.merging : 1.0;
  const int base = static_cast<int>(held_.size());
  const auto isHeld = [&](int i) {
    return state.deposited[i] || (i == 0 && state.ends[0].held) || (i + 1 == state.nodes() && state.ends[1].held);
  };
  for (int i = 0; i < state.nodes(); ++i)
    held_.push_back(isHeld(i));
  for (int j = 0; j < state.edges(); ++j)
  {
    s.a = base + j;
    s.b = base + j + 1;
    s.radius = state.radius(j);
    s.length = state.edge(j).norm();
    s.driven = held_[s.a] && held_[s.b];
    segments_.push_back(s);
    s.start += s.length;
  }
  objects_.push_back({s.start, false, touch.self, touch.others, touch.solids, touch.friction, kind});
  fluids_.push_back({touch.merging > 0.0, model.surface_tension, model.viscosity});
}

void ThreadContact::beginStep(const std::vector<Thread>& threads, const std::vector<Pose>& from,
                              const std::vector<Pose>& to, const std::vector<Eigen::Vector3d>& belts, double duration,
                              double stiffness)
{
  threads_ = threads;
  island_parts_.clear();
  used_.clear();
  for (const Thread& thread : threads)
  {
    const auto known =
        std::find_if(parts_.begin(), parts_.end(), [&](const auto& part) { return &part->thread() == thread.thread; });
    if (known != parts_.end())
    {
      used_.push_back(known->get());
    }
    else
    {
      parts_.push_back(std::make_unique<ThreadPart>(*thread.thread));
      used_.push_back(parts_.back().get());
    }
    island_parts_.push_back(used_.back());
  }
  island_.setParts(island_parts_);
  island_.beginStep(duration);
  duration_ = duration;
  const auto set = [](IslandSolid& solid, const Pose& start, const Pose& end) {
    solid.start = start;
    solid.target.X_WG = end;
  };
  for (std::size_t k = 0; k < from.size(); ++k)
    set(island_.solids[k], from[k], to[k]);
  std::size_t solid = from.size();
  for (std::size_t k = 0; k < model_.threads.size(); ++k)
    if (const ThreadFloor& floor = model_.threads[k]->floor; floor.slips())
    {
      const Eigen::Vector3d start(0, 0, floor.height);
      set(island_.solids[solid++], {start, Eigen::Quaterniond::Identity()},
          {start + duration * belts[k], Eigen::Quaterniond::Identity()});
    }
  stiffness_now_ = stiffness > 0.0 ? stiffness : first_stiffness_;
}

/// Takes the curves as they are. Returns false if centrelines meet.
bool ThreadContact::load(double from, double to, double h)
{
  segments_.clear();
  objects_.clear();
  fluids_.clear();
  held_.clear();
  island_.tolerances.least_edge = std::numeric_limits<double>::infinity();
  for (std::size_t p = 0; p < threads_.size(); ++p)
  {
    addCurve(stateOf(p), threads_[p].kind);
    used_[p]->begin(from, to, h);
    island_.tolerances.least_edge =
        std::min(island_.tolerances.least_edge, threads_[p].thread->system.leastRestLength());
  }
  ContactPotential& contact = *island_.contact();
  contact.setCurves(static_cast<int>(held_.size()), segments_, objects_);
  island_.beginSubstep(from);
  if (!contact.thinToFit(island_.startPoints(), island_.startSolids()))
    return false;
  if (merges_)
    merging_.begin(island_.startPoints(), segments_, fluids_, contact.nearPairs(), held_, model_.options.gap, h);
  setStiffness(h);
  island_.beginStage(true);
  return true;
}

/// The barrier is no softer than weights, what stops a node within the gap, and merging ask for. It does not become
/// stiffer than a force that would double the length of a thread in a step: where parts are jammed, gaps do not open
/// however stiff the barrier is.
void ThreadContact::setStiffness(double h)
{
  double least = std::max(stiffness_now_, model_.options.least_stiffness);   // not what an attempt that failed left
  double most = least;
  for (std::size_t p = 0; p < threads_.size(); ++p)
  {
    const ThreadStepper::Impl& thread = *threads_[p].thread;
    const double gravity = thread.inputs().gravity.norm();
    const RodArrays& a = thread.system.arrays();
    for (int i = 0; i < a.nodes; ++i)
      least = std::max(least, a.weight[i] * h * h * std::max(gravity, model_.options.gap / (duration_ * duration_)));
    most = std::max(most,
                    3.0 * thread.model->viscosity * thread.work.totalVolume() / (objects_[p].curve_length * duration_));
  }
  if (merges_)
    least = std::max(least, merging_.largestAttraction());
  // of loads that overflow: what they do to the threads says why
  constexpr double kLargest = std::numeric_limits<double>::max();
  island_.contact()->setMostStiffness(std::min(std::max(most, least), kLargest));
  island_.contact()->setStiffness(std::min(least, kLargest));
}

StepFailure ThreadContact::solve(double from, double to, double h, StepReport& report)
{
  if (!load(from, to, h))
    return StepFailure::squeezed;
  for (;;)
  {
    const NewtonResult result = island_.solve(from, to, threads_[0].thread->newton);
    report.iterations += result.iterations;
    report.factorizations += result.factorizations;
    if (!result.ok())
      return result.failure;
    report.residual = result.residual;
    report.max_strain = std::max(report.max_strain, result.max_strain);
    const bool lands =
        std::any_of(threads_.begin(), threads_.end(), [](const Thread& t) { return t.thread->firstLanding() <= 1.0; });
    if (!lands)
      break;
    island_.accept();   // the next solution begins here
    for (std::size_t p = 0; p < threads_.size(); ++p)
      if (const double earliest = threads_[p].thread->firstLanding(); earliest <= 1.0)
      {
        threads_[p].thread->stopLanding(h, earliest);
        used_[p]->holdLanded();
      }
    island_.numberUnknowns();
    from = to;
  }
  island_.contact()->adaptStiffness();
  stiffness_now_ = island_.contact()->stiffness();
  return StepFailure::none;
}

double ThreadContact::clearance(const std::vector<const ThreadState*>& states, const std::vector<int>& kinds,
                                const std::vector<Pose>& solids)
{
  segments_.clear();
  objects_.clear();
  fluids_.clear();
  held_.clear();
  for (std::size_t k = 0; k < states.size(); ++k)
    addCurve(*states[k], kinds[k]);
  Eigen::Matrix3Xd x(3, held_.size());
  int point = 0;
  for (const ThreadState* state : states)
    for (const Eigen::Vector3d& node : state->x)
      x.col(point++) = node;
  island_.contact()->setCurves(point, segments_, objects_);
  std::vector<Pose> poses = solids;
  for (const auto& thread : model_.threads)
    if (thread->floor.slips())
      poses.push_back({Eigen::Vector3d(0, 0, thread->floor.height), Eigen::Quaterniond::Identity()});
  return island_.contact()->clearance(x, poses);
}

std::string ThreadContact::nearest(const std::vector<const ThreadState*>& states,
                                   const std::vector<Pose>& obstacles) const
{
  std::vector<Eigen::Vector3d> x;
  for (const ThreadState* state : states)
    x.insert(x.end(), state->x.begin(), state->x.end());
  const auto nameOf = [&](const ContactSegment& s) {
    return "thread '" + model_.threads[objects_[s.object].owner]->name + "'";
  };
  double least = std::numeric_limits<double>::infinity();
  std::string names;
  for (std::size_t p = 0; p < segments_.size(); ++p)
  {
    const ContactSegment& a = segments_[p];
    const ContactObject& object = objects_[a.object];
    for (std::size_t q = p + 1; q < segments_.size(); ++q)
    {
      const ContactSegment& b = segments_[q];
      const bool same = a.object == b.object;
      if ((a.driven && b.driven) || (same ? !object.self || contactNeighbours(a, b, object, model_.options.gap)
                                          : !object.others || !objects_[b.object].others))
        continue;
      const double room = segmentDistance(x[a.a], x[a.b], x[b.a], x[b.b]) - a.coreRadius() - b.coreRadius();
      if (room < least)
      {
        least = room;
        names = nameOf(a) + " and " + (same ? "itself" : nameOf(b));
      }
    }
    for (std::size_t k = 0; object.solids && !a.driven && k < model_.obstacles.size(); ++k)
      if (const double room = distanceToShape(model_.obstacles[k].shape, obstacles[k], x[a.a], x[a.b]) - a.radius;
          room < least)
      {
        least = room;
        names = nameOf(a) + " and obstacle '" + model_.obstacles[k].name + "'";
      }
    if (const ThreadFloor& floor = model_.threads[object.owner]->floor; floor.slips())
      if (const double room = std::min(x[a.a].z(), x[a.b].z()) - floor.height - a.radius; room < least)
      {
        least = room;
        names = nameOf(a) + " and its floor";
      }
  }
  return names;
}

bool ThreadContact::allows(const ThreadState& state, int first, int last, const Eigen::Vector3d& from,
                           const Eigen::Vector3d& to) const
{
  const MovingPoint node{from, to}, a{state.x[first], state.x[first]}, b{state.x[last + 1], state.x[last + 1]};
  const double reach_a = std::max((from - a.from).norm(), (to - a.from).norm()),
               reach_b = std::max((from - b.from).norm(), (to - b.from).norm());
  const double radius = std::max(state.radius(first), state.radius(last)), gap = model_.options.gap;
  const auto isFree = [&](const ThreadState& other, int j, double core) {
    const Eigen::Vector3d &p = other.x[j], &q = other.x[j + 1];
    const double thickness = core * radius + core * other.radius(j);
    if ((p - from).norm() > thickness + gap + 2.0 * std::max(reach_a, reach_b) + (q - p).norm())
      return true;
    const MovingPoint s{p, p}, t{q, q};
    const auto side = [&](const MovingPoint& end) {
      ApproachLimit limit;
      limit.thickness = std::min(thickness, 0.99 * segmentDistance(end.from, node.from, p, q));
      limit.reach = gap;
      return segmentsLimit(end, node, s, t, limit) >= 1.0;
    };
    return side(a) && side(b);
  };
  return forOthers(state, first, last, isFree);
}

bool ThreadContact::mayJoin(const ThreadState& state, int i) const
{
  const Eigen::Vector3d &a = state.x[i - 1], &b = state.x[i], &c = state.x[i + 1];
  const double radius = std::sqrt((state.volume[i - 1] + state.volume[i]) / (M_PI * (c - a).norm()));
  return forOthers(state, i - 1, i, [&](const ThreadState& other, int j, double core) {
    const Eigen::Vector3d &p = other.x[j], &q = other.x[j + 1];
    const double r = other.radius(j);
    const auto apart = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to, double own) {
      return segmentDistance(from, to, p, q) / (core * (own + r));
    };
    return apart(a, c, radius) >= std::min({1.0, apart(a, b, state.radius(i - 1)), apart(b, c, state.radius(i))});
  });
}

template <class F>
bool ThreadContact::forOthers(const ThreadState& state, int first, int last, F&& f) const
{
  const double radius = std::max(state.radius(first), state.radius(last)), gap = model_.options.gap;
  for (std::size_t p = 0; p < threads_.size(); ++p)
    if (&stateOf(p) == &state)
    {
      const ThreadTouch& own = model_.touches[threads_[p].kind];
      const double core = own.merging > 0.0 ? own.merging : 1.0;
      for (std::size_t q = 0; q < threads_.size(); ++q)
      {
        const ThreadState& other = stateOf(q);
        if (q != p && own.others && model_.touches[threads_[q].kind].others)
          for (int j = 0; j < other.edges(); ++j)
            if (!f(other, j, core))
              return false;
      }
      if (!own.self)
        return true;
      const auto neighbours = [&](double apart, int j) {
        return apart < 0.5 * M_PI * (radius + state.radius(j)) + gap;
      };
      double apart = 0.0;
      for (int j = first - 1; j >= 0; apart += state.edge(j--).norm())
        if (!neighbours(apart, j) && !f(state, j, core))
          return false;
      apart = 0.0;
      for (int j = last + 1; j < state.edges(); apart += state.edge(j++).norm())
        if (!neighbours(apart, j) && !f(state, j, core))
          return false;
    }
  return true;
}

}   // namespace slender
