#pragma once

#include "thread_stepper_impl.h"

namespace slender {

class ThreadContact;

/// A thread in a step, its state and its inputs.
struct SteppedThread
{
  ThreadStepper::Impl* thread;
  ThreadState* state;
  const ThreadInputs* inputs;
};

/// Advances threads together by `duration` [s], in substeps common to all. `contact` (null: a single thread that
/// touches nothing) solves their equations. On failure the states are untouched and the report says why.
StepReport advanceThreads(const SteppedThread* parts, int count, double duration, ThreadContact* contact);

}   // namespace slender
