#pragma once

#include <functional>
#include <string>
#include <vector>

#include "slender_sim/dynamics/step_report.h"
#include "slender_sim/scene/simulation.h"
#include "slender_sim/study/study.h"

/// One definition of stable for all solvers. A run is sound when after every step
///  - the state is finite,
///  - the energy has not grown beyond its bound (energyGrowth(); of cloth's single Newton steps 1e-2; not asked
///    of threads, nor while something is still being moved),
///  - a step reported as done has met its equations: the residual is below its bound (not asked of explicit
///    steps and of cloth's single Newton step, which solve linear equations),
///  - a refusal says why, and the state is as before the step, bit for bit.
/// A cell that is done must also not be silently wrong: after each of its steps a run with a quarter of the step is
/// nearer to it than half as far as that run ever moves (a hundredth of the object's size allowed besides). One that
/// stands still where it should move fails that.
namespace slender::study {

enum class Outcome
{
  done,      ///< every step at once
  cut,       ///< some steps were done in shorter ones
  refused,   ///< a step said why it cannot be done, and left the state alone
  unsound    ///< none of these: must not be
};

const char* toString(Outcome outcome);

/// Unbalanced force over the largest that a step reported as done may leave. Newton stops by its increment, 1e-6 of the
/// shortest edge: that is up to a few per cent of the largest force where viscosity or stiffness over the step's length
/// is great and all else at rest.
constexpr double kResidualMet = 0.1;

/// Energy that may appear, over what there is to give. Implicit Euler loses some in every step, but for what Newton's
/// tolerance leaves; other methods that damp stiff motions (bdf2, tr_bdf2) keep it within their error; those that damp
/// little or nothing only on average.
inline double energyGrowth(Integrator integrator)
{
  return integrator == Integrator::implicit_euler                              ? 1e-3
         : integrator == Integrator::bdf2 || integrator == Integrator::tr_bdf2 ? 1e-2
                                                                               : 10.0;
}

/// Where an object has been after each step.
struct Path
{
  std::vector<Eigen::Matrix3Xd> x;   ///< nodes, the start first [m]
  double size = 0;                   ///< of the object [m]

  explicit Path(const Eigen::Matrix3Xd& start);
  /// The farthest that a node has been from its start.
  double moved() const;
};

/// What became of one cell of a map.
struct StabilityCell
{
  bool linear_steps = false;   ///< whose residual says nothing
  int steps = 0, cuts = 0, substeps = 0, iterations = 0;
  double residual = 0, energy_growth = 0, cpu_seconds = 0;
  double max_strain = 0, end_strain = 0;
  /// largest from the run with a quarter of the step, over how far that moves; negative: not compared
  double fine_distance = -1;
  bool finite = true, refused = false;
  std::string reason;      ///< of the refusal
  std::string complaint;   ///< why the cell is unsound
  /// false: not finite, refused without a reason, or changed by a refusal; a complaint otherwise: silently wrong
  bool explained = true;

  /// After a step. `finite`: all of the state is; `unchanged`: it is as before the step. True: the run goes on.
  bool took(const StepReport& report, bool state_finite, bool unchanged);
  /// `growth`: energy beyond that at the start, over what there was to give. True: the run goes on.
  bool energyIs(double growth, double allowed);
  /// Compares with the run of a quarter of the step, which is sound; steps after which the number of nodes differs
  /// apart.
  void compare(const Path& path, const Path& fine);
  /// What could not even be set up.
  void refuseAtOnce(const std::string& why);
  Outcome outcome() const;
};

/// Counts cells, and writes them into rows and metrics in the same way everywhere.
class StabilityTally
{
public:
  explicit StabilityTally(StudyContext& context);
  /// Sets outcome, steps, cuts, residual, energy_growth, fine_distance, cpu_seconds, reason of the row; nan_count,
  /// unexplained_failures, silently_wrong, not_compared, done, cut, refused.
  void record(Row& row, const StabilityCell& cell);

private:
  StudyContext& context_;
  int count_[4] = {0, 0, 0, 0}, not_finite_ = 0, unexplained_ = 0, not_compared_ = 0;
};

/// A scene for a map: one object, implicit Euler.
struct MapScene
{
  std::string yaml;
  /// Of a tracked cloth: where the guide's vertices are at a time [s], from where they rest.
  std::function<Eigen::Matrix3Xd(const Eigen::Matrix3Xd& rest, double time)> guide;
};

/// Runs a scene of `step` [s] and judges it, the run with a quarter of the step included.
StabilityCell runScene(const MapScene& scene, double step, int steps);

/// Every value with every step: rows and a plot. `scene` makes the scene of one value; its time.step is set here.
void stabilityMap(StudyContext& context, StabilityTally& tally, const std::string& name, const std::string& quantity,
                  const std::vector<double>& values, const std::vector<double>& step_lengths, int steps,
                  const std::function<MapScene(double)>& scene);

/// The two maps of a sheet whose scene follows from its Young's modulus [Pa] and thickness [m]: over the modulus, and
/// over thickness by `side` [m]. Their names begin with that of the study.
void sheetMaps(StudyContext& context, StabilityTally& tally, const std::string& study, double side,
               const std::function<MapScene(double youngs_modulus, double thickness)>& scene);

}   // namespace slender::study
