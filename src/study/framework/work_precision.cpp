#include "work_precision.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace slender::study {

WorkPrecision::WorkPrecision(StudyContext& context, const std::string& name, const std::string& problem,
                             const std::string& error_label, double scale)
  : context_(context),
    plot_(context.plot(name, problem + ": error against run time", "CPU seconds per simulated second", error_label)),
    problem_(problem),
    scale_(scale)
{
  plot_.lines = false;
}

void WorkPrecision::add(Row& row, const std::string& method, const std::string& setting, double error,
                        double cpu_per_second, bool counts)
{
  row.set("relative_error", error / scale_).set("cpu_per_second", cpu_per_second);
  if (!std::isfinite(error))
    return;
  Series& series = plot_.at(method);
  series.x.push_back(cpu_per_second);
  series.y.push_back(error);
  if (counts)
    runs_.push_back({&row, method, setting, error, cpu_per_second});
}

void WorkPrecision::conclude()
{
  std::sort(runs_.begin(), runs_.end(), [](const Run& a, const Run& b) { return a.cpu_per_second < b.cpu_per_second; });
  std::vector<const Run*> front;
  for (const Run& run : runs_)
    if (front.empty() || run.error < front.back()->error)
      front.push_back(&run);
  Series& line = plot_.at("front");
  line.line = true;
  for (const Run* run : front)
  {
    run->row->set("on_front", "yes");
    line.x.push_back(run->cpu_per_second);
    line.y.push_back(run->error);
  }
  const Run* before = nullptr;
  for (const double level : {0.1, 0.01, 1e-3, 1e-4, 1e-5})
  {
    const auto best =
        std::find_if(front.begin(), front.end(), [&](const Run* run) { return run->error <= level * scale_; });
    if (best == front.end() || *best == before)
      continue;
    before = *best;
    char text[64];
    std::snprintf(text, sizeof text, "for %g %% error take ", 100 * level);
    std::string note = problem_ + ": " + text + before->method + ", " + before->setting;
    std::snprintf(text, sizeof text, ": %.2g s per simulated second, %.2g %%", before->cpu_per_second,
                  100 * before->error / scale_);
    context_.note(note + text);
  }
}

}   // namespace slender::study
