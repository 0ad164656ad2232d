#include "statics_report.h"

#include <cstdio>

namespace slender {
namespace {

bool hasPath(const SceneConfig& scene) { return scene.statics && scene.statics->path; }

void printRow(const StaticsRow& row)
{
  const StepReport& r = row.report;
  std::printf("load factor       %.9g\n", row.factor);
  std::printf("  residual        %.3g of the largest force\n", r.residual);
  std::printf("  energy          %.9g J\n", r.energy);
  std::printf("  lowest eigenvalue %.6g 1/s^2%s\n", r.lowest_eigenvalue,
              r.lowest_eigenvalue == 0 ? " (a motion that costs nothing)" : "");
  std::printf("  stable          %s, %d unstable equilibria left on the way\n", r.stable ? "yes" : "no", r.escapes);
  std::printf("  largest move    %.6g m\n", row.displacement);
}

/// Lines of a path are short: there may be thousands.
void printPath(const std::vector<StaticsRow>& rows)
{
  std::printf("%14s %12s %16s %18s %8s %14s\n", "load factor", "residual", "energy [J]", "eigenvalue [1/s^2]", "stable",
              "move [m]");
  for (const StaticsRow& row : rows)
  {
    std::printf("%14.8g %12.3g %16.9g %18.6g %8s %14.6g\n", row.factor, row.report.residual, row.report.energy,
                row.report.lowest_eigenvalue, row.report.stable ? "yes" : "no", row.displacement);
  }
}

}   // namespace

void printEquilibria(const SceneConfig& scene, const StaticsRun& found)
{
  if (found.critical)
  {
    std::printf("critical factor   %.9g (%s)\n", found.critical->factor,
                found.critical->fold ? "a limit load: no equilibrium is near beyond it"
                                     : "paths branch: beyond it the equilibrium is unstable");
  }
  if (hasPath(scene))
  {
    printPath(found.rows);
    return;
  }
  for (const StaticsRow& row : found.rows)
    printRow(row);
}

bool reportStatics(const SceneConfig& scene, const StaticsRun& found)
{
  if (!found.end.ok)
  {
    std::fprintf(stderr, "simulate: statics failed: %s\n", found.end.message.c_str());
    return false;
  }
  if (hasPath(scene))
    return true;   // the user asks for a path whether it is stable or not
  const bool accept = scene.start.accept_unstable;
  for (const StaticsRow& row : found.rows)
  {
    if (row.report.stable)
      continue;
    std::fprintf(stderr,
                 "simulate: %sload factor %.9g: the equilibrium is unstable (lowest eigenvalue %.3g 1/s^2), and no "
                 "stable one was "
                 "reached from it%s\n",
                 accept ? "warning: " : "", row.factor, row.report.lowest_eigenvalue,
                 accept
                     ? ""
                     : ": start from a shape that is nearer to the stable equilibrium (initial), hold what drifts by a "
                       "grasp, or accept it (start: {equilibrium: true, accept_unstable: true})");
    if (!accept)
      return false;
  }
  return true;
}

}   // namespace slender
