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

ThreadContact::ThreadContact(const TouchingModel& model)
  : model_(model),
    contact_(solidsOf(model), model.options),
    first_stiffness_(contact_.stiffness())
{
  for (const ThreadTouch& touch : model.touches)
    merges_ = merges_ || touch.merging > 0.0;
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
  if (part_count_ != threads.size())
    coupled_.invalidatePattern();
  part_count_ = threads.size();
  if (parts_.size() < part_count_)
    parts_.resize(part_count_);
  coupled_.chains.clear();
  for (std::size_t p = 0; p < part_count_; ++p)
  {
    parts_[p].thread = threads[p].thread;
    parts_[p].kind = threads[p].kind;
    parts_[p].system = &threads[p].thread->system;
    coupled_.chains.push_back(&parts_[p]);
  }
  duration_ = duration;
  solids_from_ = from;
  solids_to_ = to;
  for (std::size_t k = 0; k < model_.threads.size(); ++k)
    if (const ThreadFloor& floor = model_.threads[k]->floor; floor.slips())
    {
      const Eigen::Vector3d start(0, 0, floor.height);
      solids_from_.push_back({start, Eigen::Quaterniond::Identity()});
      solids_to_.push_back({start + duration * belts[k], Eigen::Quaterniond::Identity()});
    }
  stiffness_now_ = stiffness > 0.0 ? stiffness : first_stiffness_;
}

void ThreadContact::placeSolids(double fraction, std::vector<Pose>& solids) const
{
  solids.resize(solids_from_.size());
  for (std::size_t k = 0; k < solids.size(); ++k)
    solids[k] = RigidMotion(solids_from_[k], solids_to_[k]).at(fraction);
}

void ThreadContact::gather(Eigen::Matrix3Xd& x) const
{
  for (std::size_t p = 0; p < part_count_; ++p)
  {
    const Part& part = parts_[p];
    for (int i = 0; i < part.thread->work.nodes(); ++i)
      if (const int k = part.thread->inSystem(i); k >= 0)
        x.col(part.point + i) = part.thread->system.position(k);
  }
}

/// Curves as they are, and where the substep wants to go. No: centrelines meet.
bool ThreadContact::load(double from, double h)
{
  segments_.clear();
  objects_.clear();
  fluids_.clear();
  held_.clear();
  least_edge_ = std::numeric_limits<double>::infinity();
  for (std::size_t p = 0; p < part_count_; ++p)
  {
    Part& part = parts_[p];
    part.point = static_cast<int>(held_.size());
    addCurve(part.thread->work, part.kind);
    least_edge_ = std::min(least_edge_, systemOf(part).leastRestLength());
  }
  const int count = static_cast<int>(held_.size());
  for (auto* x : {&points_, &points_base_, &points_end_, &points_target_})
    x->resize(3, count);
  for (std::size_t p = 0; p < part_count_; ++p)
  {
    const Part& part = parts_[p];
    const ThreadState& work = part.thread->work;
    for (int i = 0; i < work.nodes(); ++i)
    {
      points_base_.col(part.point + i) = work.x[i];
      points_target_.col(part.point + i) = work.x[i] + h * part.thread->inputs().belt_velocity;   // others: gather()
    }
  }
  placeSolids(from, solids_base_);
  solids_ = solids_base_;
  contact_.setCurves(count, segments_, objects_);
  if (!contact_.thinToFit(points_base_, solids_base_))
    return false;
  // not what an attempt that failed left; no less than weights, what stops a node within the gap, and merging ask for
  double least = std::max(stiffness_now_, model_.options.least_stiffness);
  // what would double the length of the thread in a step is force enough: where parts are jammed, gaps do not open
  // however stiff the barrier is
  double most = least;
  for (std::size_t p = 0; p < part_count_; ++p)
  {
    const double gravity = parts_[p].thread->inputs().gravity.norm();
    const RodArrays& a = systemOf(parts_[p]).arrays();
    for (int i = 0; i < a.nodes; ++i)
      least = std::max(least, a.weight[i] * h * h * std::max(gravity, model_.options.gap / (duration_ * duration_)));
    const ThreadStepper::Impl& thread = *parts_[p].thread;
    most = std::max(most,
                    3.0 * thread.model->viscosity * thread.work.totalVolume() / (objects_[p].curve_length * duration_));
  }
  if (merges_)
  {
    merging_.begin(points_base_, segments_, fluids_, contact_.nearPairs(), held_, model_.options.gap, h);
    least = std::max(least, merging_.largestAttraction());
  }
  // of loads that overflow: what they do to the threads says why
  constexpr double kLargest = std::numeric_limits<double>::max();
  contact_.setMostStiffness(std::min(std::max(most, least), kLargest));
  contact_.setStiffness(std::min(least, kLargest));
  coupled_.matrix.beginStage();
  // friction sticks below a speed over the whole step, cut or not
  contact_.begin(points_base_, solids_base_, duration_);

  coupled_.points.resize(count);
  coupled_.solid_moves.assign(solids_.size(), 0);
  mapUnknowns();
  if (merges_)
    merging_.evaluate(points_base_, false);
  coupled_.takeFirst(contact_.terms(), attractions(), contact_.rows());
  return true;
}

StepFailure ThreadContact::solve(double from, double to, double h, StepReport& report)
{
  if (!load(from, h))
    return StepFailure::squeezed;
  for (;;)
  {
    const NewtonResult result =
        minimizeConfined(*this, from, to, parts_[0].thread->newton, model_.options.gap / least_edge_);
    report.iterations += result.iterations;
    report.factorizations += result.factorizations;
    if (!result.ok())
      return result.failure;
    report.residual = result.residual;
    report.max_strain = std::max(report.max_strain, result.max_strain);
    bool lands = false;
    for (std::size_t p = 0; p < part_count_; ++p)
      lands = lands || parts_[p].thread->firstLanding() <= 1.0;
    if (!lands)
      break;
    accept();   // the next solution begins here
    for (std::size_t p = 0; p < part_count_; ++p)
      if (const double earliest = parts_[p].thread->firstLanding(); earliest <= 1.0)
        parts_[p].thread->stopLanding(h, earliest);
    mapUnknowns();
    points_target_ = points_;
    from = to;
  }
  contact_.adaptStiffness();
  stiffness_now_ = contact_.stiffness();
  return StepFailure::none;
}

/// Moves from the base towards the targets of what is held and the present guess of all else, as far as nothing
/// touches; solids go from where they stand at the fraction `from` of the step to `to`.
Approach ThreadContact::approach(double from, double to, double& reached)
{
  gather(points_target_);
  placeSolids(to, solids_end_);
  double alpha = contact_.stepLimit(points_base_, points_target_, solids_base_, solids_end_);
  reached = to;
  for (int attempt = 0; attempt < 20; ++attempt, alpha *= 0.5)
  {
    solids_ = solids_end_;
    points_ = points_target_;
    if (alpha < 1.0)
    {
      points_ = points_base_ + alpha * (points_target_ - points_base_);
      placeSolids(from + alpha * (to - from), solids_);
    }
    bool driven = alpha < 1.0 && from < to && !solids_.empty();
    for (std::size_t p = 0; p < part_count_; ++p)
      for (int i = 0; i < parts_[p].thread->work.nodes(); ++i)
      {
        const int point = parts_[p].point + i, k = parts_[p].thread->inSystem(i);
        if (k >= 0)
          parts_[p].thread->placeNode(i, points_.col(point));
        if ((k < 0 || !systemOf(parts_[p]).isFree(k)) && points_.col(point) != points_target_.col(point))
          driven = true;
      }
    const RodEvaluation trial = evaluate(false);
    if (std::isfinite(trial.energy()) && trial.min_chi > kFoldedChi)
    {
      reached = driven ? from + alpha * (to - from) : to;
      accept();
      return driven ? Approach::partly : Approach::arrived;
    }
    if (alpha == 1.0 && trial.min_chi <= kFoldedChi && std::isfinite(trial.potential))
      return Approach::arrived;   // not a matter of contact: minimize() will say so
  }
  return Approach::squeezed;
}

void ThreadContact::placeHeld(double /*to*/)
{
  for (std::size_t p = 0; p < part_count_; ++p)
    for (int i = 0; i < parts_[p].thread->work.nodes(); ++i)
      if (const int n = parts_[p].thread->inSystem(i); n >= 0 && !systemOf(parts_[p]).isFree(n))
        parts_[p].thread->placeNode(i, points_target_.col(parts_[p].point + i));
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
  contact_.setCurves(point, segments_, objects_);
  solids_ = solids;
  for (const auto& thread : model_.threads)
    if (thread->floor.slips())
      solids_.push_back({Eigen::Vector3d(0, 0, thread->floor.height), Eigen::Quaterniond::Identity()});
  return contact_.clearance(x, solids_);
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
  for (std::size_t p = 0; p < part_count_; ++p)
    if (&parts_[p].thread->work == &state)
    {
      const ThreadTouch& own = model_.touches[parts_[p].kind];
      const double core = own.merging > 0.0 ? own.merging : 1.0;
      for (std::size_t q = 0; q < part_count_; ++q)
      {
        const ThreadState& other = parts_[q].thread->work;
        if (q != p && own.others && model_.touches[parts_[q].kind].others)
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
