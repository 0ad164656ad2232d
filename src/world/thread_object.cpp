#include "thread_object.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "meeting.h"

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

ThreadObject::ThreadObject(const WorldModel& world, int number)
  : WorldObject(number),
    model(world.threads[number]),
    time_(world.time)
{
  if (!model.contact)
  {
    checkLoneThread(*model.model);
    return;
  }
  checkThreadModel(*model.model);
  const auto check = [this](bool good, const char* what, double value, const char* range) {
    if (!good)
      throw std::invalid_argument(name() + ": " + what + " is " + std::to_string(value) + ", allowed: " + range);
  };
  const double friction = model.contact->friction;
  check(friction >= 0.0 && std::isfinite(friction), "friction", friction, "zero or more");
  check(model.merging >= 0.0 && model.merging < 1.0, "merging", model.merging, "zero to 1 (exclusive)");
}

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
    const ThreadInputs& own_inputs = strand.ends[1].held ? inputs_ : still_;
    if (!strands_[s].stepper->accepts(strand, own_inputs, time_.step, report))
      return false;
    strands_[s].stepper->begin(strand, own_inputs, time_.step);
  }
  return true;
}

void ThreadObject::makeStrands(std::size_t count)
{
  while (strands_.size() < count)
  {
    Strand added;
    added.stepper = std::make_unique<ThreadWork>(model.model, time_.newton, false);
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

void ThreadObject::finish(WorldState& state)
{
  std::array<Wrench, 2>& loads = state.end_loads[index];
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

}   // namespace slender
