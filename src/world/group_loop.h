#pragma once

#include <exception>
#include <vector>

#include "linalg/parallel_for.h"
#include "slender_sim/dynamics/step_report.h"

namespace slender {

/// Steps islands or groups that do not depend on each other, in parallel where that is worth it. Memory is reused.
class GroupLoop
{
public:
  int threads = 0;   ///< that are used; 0: see parallelFor()

  /// Calls step(k), which returns a StepReport, for 0 <= k < count, and merges the reports in this order into `total`.
  /// `nodes`: of all islands. Throws what a call throws, after all calls.
  template <class Step>
  void run(int count, int nodes, const Step& step, StepReport& total)
  {
    constexpr int kWorthThreads = 500;   // nodes; a smaller step is faster on one thread than starting threads is
    reports_.resize(static_cast<std::size_t>(count));
    errors_.assign(static_cast<std::size_t>(count), nullptr);
    const auto stepOne = [&](int k) {
      try
      {
        reports_[k] = step(k);
      }
      catch (...)
      {
        errors_[k] = std::current_exception();   // is thrown after all calls
      }
    };
    parallelFor(nodes < kWorthThreads ? 1 : threads, count, 1, stepOne);
    for (const std::exception_ptr& error : errors_)
      if (error)
        std::rethrow_exception(error);
    for (const StepReport& report : reports_)
      total.merge(report);
  }

private:
  std::vector<StepReport> reports_;
  std::vector<std::exception_ptr> errors_;
};

}   // namespace slender
