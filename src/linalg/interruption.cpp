#include "slender_sim/linalg/interruption.h"

#include <atomic>

namespace slender {

namespace {
std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "signal handlers may only touch what takes no lock");
}   // namespace

void interruptSteps() noexcept { interrupted.store(true, std::memory_order_relaxed); }
void allowSteps() noexcept { interrupted.store(false, std::memory_order_relaxed); }
bool stepsInterrupted() noexcept { return interrupted.load(std::memory_order_relaxed); }

const char* const kStepInterrupted = "the step was interrupted on request; the state is that at its start";

}   // namespace slender
