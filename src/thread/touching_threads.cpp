#include "slender_sim/thread/touching_threads.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "slender_sim/contact/solids.h"
#include "thread_contact.h"

namespace slender {

class TouchingThreads::Impl
{
public:
  Impl(TouchingModel m, const NewtonConfig& n) : model(std::move(m)), newton(n), contact(model)
  {
    loads.resize(model.threads.size());
    pool.resize(model.threads.size());
  }

  TouchingModel model;
  NewtonConfig newton;
  ThreadContact contact;
  std::vector<std::vector<std::unique_ptr<ThreadStepper::Impl>>> pool;   ///< per thread of the model and part of it
  std::vector<ThreadContact::Thread> threads;
  std::vector<SteppedThread> parts;
  std::vector<ThreadInputs> still;   ///< inputs without flow
  std::vector<Eigen::Vector3d> belts;
  std::vector<std::array<EndLoad, 2>> loads;
  TouchingState work;

  double clearance(const TouchingState& state)
  {
    std::vector<const ThreadState*> states;
    std::vector<int> kinds;
    for (std::size_t k = 0; k < state.threads.size(); ++k)
      for (const ThreadState& thread : state.threads[k].threads)
      {
        states.push_back(&thread);
        kinds.push_back(static_cast<int>(k));
      }
    const double room = contact.clearance(states, kinds, state.obstacles);
    if (!(room > 0))
      meeting = contact.nearest(states, state.obstacles);
    return room;
  }
  std::string meeting;   ///< what touches, by the last clearance()

  /// An end that is held cannot give way. Returns false, and fills the report, when an obstacle comes nearer to one
  /// than the thread is thick: no shorter step helps then.
  bool endsHaveRoom(const TouchingState& state, const TouchingInputs& inputs, StepReport& report) const
  {
    for (std::size_t k = 0; k < state.threads.size(); ++k)
      for (const ThreadState& thread : state.threads[k].threads)
        for (int end = 0; end < 2 && model.touches[k].solids; ++end)
        {
          const Eigen::Vector3d from = end ? thread.x.back() : thread.x.front(),
                                to = inputs.threads[k].ends[end].position;
          const double radius = thread.radius(end ? thread.edges() - 1 : 0);
          for (std::size_t o = 0; thread.ends[end].held && o < state.obstacles.size(); ++o)
          {
            const TouchingModel::Obstacle& obstacle = model.obstacles[o];
            if ((to - inputs.obstacles[o].position).norm() > boundingRadius(obstacle.shape) + radius)
              continue;
            const double room = distanceToShape(obstacle.shape, inputs.obstacles[o], to, to);
            if (room >= std::min(radius, distanceToShape(obstacle.shape, state.obstacles[o], from, from)))
              continue;
            report.ok = false;
            report.failure = StepFailure::squeezed;
            report.message = "obstacle '" + obstacle.name + "' comes within " + std::to_string(1e3 * room) +
                             " mm of the " + (end && model.threads[k]->nozzle_diameter > 0 ? "nozzle" : "held end") +
                             " of thread '" + model.threads[k]->name + "', which is " + std::to_string(1e3 * radius) +
                             " mm in radius there: keep them further apart";
            return false;
          }
        }
    return true;
  }
};

namespace {

TouchingModel checked(TouchingModel model)
{
  if (model.threads.empty() || model.threads.size() != model.touches.size())
    throw std::invalid_argument("touching threads: " + std::to_string(model.threads.size()) +
                                " threads with contact properties of " + std::to_string(model.touches.size()) +
                                "; there must be one each");
  for (std::size_t k = 0; k < model.threads.size(); ++k)
  {
    checkThreadModel(*model.threads[k]);
    const ThreadTouch& touch = model.touches[k];
    const auto check = [&](bool good, const char* what, double value, const char* range) {
      if (!good)
        throw std::invalid_argument("thread '" + model.threads[k]->name + "': " + what + " is " +
                                    std::to_string(value) + ", allowed: " + range);
    };
    check(touch.friction >= 0.0 && std::isfinite(touch.friction), "friction", touch.friction, "zero or more");
    check(touch.merging >= 0.0 && touch.merging < 1.0, "merging", touch.merging, "zero to 1 (exclusive)");
  }
  return model;
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

}   // namespace

TouchingThreads::TouchingThreads(TouchingModel model, const NewtonConfig& newton)
  : impl_(std::make_unique<Impl>(checked(std::move(model)), newton))
{
}
TouchingThreads::~TouchingThreads() = default;
TouchingThreads::TouchingThreads(TouchingThreads&&) noexcept = default;

StepReport TouchingThreads::step(TouchingState& state, const TouchingInputs& inputs, double duration)
{
  Impl& m = *impl_;
  StepReport report;
  const std::size_t count = m.model.threads.size(), obstacles = m.model.obstacles.size();
  const auto sound = [](const Pose& X) {
    return X.position.allFinite() && std::abs(X.orientation.norm() - 1.0) < 1e-3;
  };
  const bool fits = state.threads.size() == count && inputs.threads.size() == count &&
                    state.obstacles.size() == obstacles && inputs.obstacles.size() == obstacles &&
                    std::none_of(state.threads.begin(), state.threads.end(),
                                 [](const ThreadGroupState& g) { return g.threads.empty(); });
  if (!fits || !std::all_of(inputs.obstacles.begin(), inputs.obstacles.end(), sound) ||
      !std::all_of(inputs.threads.begin(), inputs.threads.end(),
                   [](const ThreadInputs& in) { return in.belt_velocity.allFinite(); }))
  {
    report.ok = false;
    report.failure = StepFailure::input_not_finite;
    report.message = fits
                         ? "the pose of an obstacle or a belt's velocity is not finite or not valid; correct this input"
                         : "the number of threads or obstacles is not that of the model; correct this input";
    return report;
  }
  if (!m.endsHaveRoom(state, inputs, report))
    return report;
  m.work = state;
  m.threads.clear();
  m.parts.clear();
  m.still = inputs.threads;
  m.belts.clear();
  std::vector<std::uint64_t> next_ids;
  for (std::size_t k = 0; k < count; ++k)
  {
    m.belts.push_back(inputs.threads[k].belt_velocity);
    m.still[k].flow_rate = 0.0;
    std::vector<ThreadState>& threads = m.work.threads[k].threads;
    std::uint64_t next_id = 0;
    for (const ThreadState& thread : threads)
      next_id = std::max(next_id, thread.next_id);
    next_ids.push_back(next_id);
    for (std::size_t part = 0; part < threads.size(); ++part)
    {
      threads[part].next_id = next_id;
      if (m.pool[k].size() <= part)
        m.pool[k].push_back(std::make_unique<ThreadStepper::Impl>(m.model.threads[k], m.newton, false));
      ThreadStepper::Impl* thread = m.pool[k][part].get();
      m.threads.push_back({thread, static_cast<int>(k)});
      m.parts.push_back({thread, &threads[part], threads[part].ends[1].held ? &inputs.threads[k] : &m.still[k]});
    }
  }
  m.contact.beginStep(m.threads, state.obstacles, inputs.obstacles, m.belts, duration, state.contact_stiffness);
  report = advanceThreads(m.parts.data(), static_cast<int>(m.parts.size()), duration, &m.contact);
  if (!report.ok)
    return report;
  for (std::size_t k = 0; k < count; ++k)
    m.loads[k] = {};
  for (std::size_t p = 0; p < m.parts.size(); ++p)
    for (int end = 0; end < 2; ++end)
      if (m.parts[p].state->ends[end].held)
        m.loads[m.threads[p].kind][end] = m.threads[p].thread->loads[end];
  for (std::size_t k = 0; k < count; ++k)
  {
    renumber(m.work.threads[k].threads, next_ids[k]);
    breakThreads(m.work.threads[k], m.model.threads[k]->limits);
    dropThreads(m.work.threads[k], m.model.threads[k]->limits);
  }
  m.work.obstacles = inputs.obstacles;
  m.work.contact_stiffness = m.contact.stiffness();
  std::swap(state, m.work);
  return report;
}

double TouchingThreads::clearance(const TouchingState& state) { return impl_->clearance(state); }

void TouchingThreads::checkClearance(const TouchingState& state)
{
  const double room = clearance(state);
  if (!(room > 0))
    throw std::invalid_argument(impl_->meeting + " touch or cross by " + std::to_string(-1e3 * room) +
                                " mm as the scene starts: move them apart, or take thinner threads");
}

const std::array<EndLoad, 2>& TouchingThreads::endLoads(int thread) const { return impl_->loads.at(thread); }
const std::vector<ContactTerm>& TouchingThreads::contacts() const { return impl_->contact.terms(); }
const TouchingModel& TouchingThreads::model() const { return impl_->model; }

}   // namespace slender
