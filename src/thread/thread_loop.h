#pragma once

#include "thread_stepper_impl.h"

namespace slender {

/// Advances a thread that touches nothing by `duration` [s], in substeps. On failure the state is untouched and the
/// report says why.
StepReport advanceThread(ThreadStepper::Impl& thread, ThreadState& state, const ThreadInputs& inputs, double duration);

}   // namespace slender
