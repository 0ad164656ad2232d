#pragma once

/// A request to end the step that is being solved, for example from a signal handler. It is the process's, as signals
/// are. Newton's method, iterations of linear solvers and rounds of collision handling poll it. The step is then
/// refused like one that fails: the state is that at its start, and later steps are refused as well until allowSteps().
namespace slender {

void interruptSteps() noexcept;   ///< may be called from signal handlers
void allowSteps() noexcept;
bool stepsInterrupted() noexcept;

/// Of reports of interrupted steps.
extern const char* const kStepInterrupted;

}   // namespace slender
