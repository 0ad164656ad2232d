// Tables of the equilibria that statics found.
#include "slender_sim/scene/statics_run.h"
#include "text_file.h"

namespace slender {

namespace {

constexpr const char* kBeginning = "step,";
constexpr const char* kRows = "statics.csv";
constexpr const char* kModes = "statics_modes.csv";

void writeRow(TextFile& file, long step, const StaticsRow& row)
{
  const StepReport& report = row.report;
  file.row(step, row.factor, report.residual, report.energy, report.lowest_eigenvalue, report.stable ? 1 : 0,
           report.escapes, row.displacement);
}

void writeModes(TextFile& file, long step, const StaticsRow& row, const std::vector<std::string>& rods)
{
  for (std::size_t r = 0; r < row.nodes.size(); ++r)
    for (Eigen::Index i = 0; i < row.nodes[r].cols(); ++i)
      if (row.modes[r].cols() > i)
        file.row(step, rods[r], i, row.nodes[r].col(i), row.modes[r].col(i).head<3>(), row.modes[r](3, i));
      else
        file.row(step, rods[r], i, row.nodes[r].col(i), "", "", "", "");
}

}   // namespace

void clearStatics(const std::string& folder)
{
  clearEarlierRun(
      folder, [](const std::string& name) { return name == kRows || name == kModes; }, kBeginning);
}

void writeStatics(const std::string& folder, const StaticsRun& run, const std::vector<std::string>& rods)
{
  clearStatics(folder);
  TextFile rows(folder + "/" + kRows), modes(folder + "/" + kModes);
  rows.row("step,factor,residual,energy [J],lowest eigenvalue [1/s^2],stable,escapes,displacement [m]");
  modes.row("step,rod,node,x [m],y [m],z [m],mode x,mode y,mode z,mode turn [rad]");
  long step = 0;
  for (const StaticsRow& row : run.rows)
  {
    writeRow(rows, step, row);
    writeModes(modes, step++, row, rods);
  }
  if (run.critical)
  {
    writeRow(rows, -1, run.critical->at);
    writeModes(modes, -1, run.critical->at, rods);
  }
  rows.close();
  modes.close();
}

}   // namespace slender
