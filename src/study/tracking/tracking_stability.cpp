// Tracking under whatever may be asked of it: done, or refused with a reason and the state untouched, never NaN.
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <stdexcept>

#include "slender_sim/scene/reader.h"
#include "slender_sim/scene/simulation.h"
#include "guided_cloth.h"
#include "study/framework/stability.h"
#include "slender_sim/scene/state_bytes.h"

namespace slender::study {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

namespace {

const char* const kScene = R"(
name: sheet
time: {step: 0.01, duration: 1}
tracked:
  - name: sheet
    guide:
      grid: {corner: [0, 0, 0], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: [3, 3], pattern: alternating}
      motion: fixed
    mesh: {subdivide: 2}
    material: {area_density: 0.2, thickness: 0.001, youngs_modulus: 1.0e5}
    bending: {model: hinge}
    damping: {stiffness: 0.001}
)";

/// Where the guide's vertices are after step k of `steps`, from where they rest.
using GuideMotion = std::function<Matrix3Xd(const Matrix3Xd& rest, int k, int steps)>;

struct GuideCase
{
  std::string name;
  bool to_be_refused = false;   ///< at steps 5 to 9, and the run goes on
  bool comes_to_rest = true;    ///< where it began, by half of the steps
  GuideMotion motion;
};

double fraction(int k, int steps) { return std::min(1.0, 2.0 * k / steps); }   // 1 from half of the steps on

/// Vertices other than `good` in steps 5 to 9.
GuideCase refused(const std::string& name, const std::function<Matrix3Xd(const Matrix3Xd&)>& bad)
{
  return {name, true, true, [bad](const Matrix3Xd& rest, int k, int) { return k >= 5 && k < 10 ? bad(rest) : rest; }};
}

std::vector<GuideCase> guideCases()
{
  const auto about_middle = [](const Matrix3Xd& rest, const Eigen::Matrix3d& map) {
    const Vector3d middle = rest.rowwise().mean();
    return Matrix3Xd((map * (rest.colwise() - middle)).colwise() + middle);
  };
  const auto there_and_back = [](int k, int steps) { return std::abs(1.0 - 2.0 * fraction(k, steps)); };   // 1, 0, 1
  return {
      {"collapses to a point and back", false, true,
       [=](const Matrix3Xd& rest, int k, int steps) {
         return about_middle(rest, there_and_back(k, steps) * Eigen::Matrix3d::Identity());
       }},
      {"collapses to a line and back", false, true,
       [=](const Matrix3Xd& rest, int k, int steps) {
         return about_middle(rest, Vector3d(1, there_and_back(k, steps), 1).asDiagonal());
       }},
      {"collapses at once and stays", false, false,
       [=](const Matrix3Xd& rest, int, int) { return about_middle(rest, Eigen::Matrix3d::Zero()); }},
      {"explodes a thousandfold and comes back", false, true,
       [=](const Matrix3Xd& rest, int k, int steps) {
         return about_middle(rest, std::pow(1000.0, 1.0 - there_and_back(k, steps)) * Eigen::Matrix3d::Identity());
       }},
      {"explodes by half in every step", false, false,
       [=](const Matrix3Xd& rest, int k, int) {
         return about_middle(rest, std::pow(1.5, std::min(k, 60)) * Eigen::Matrix3d::Identity());
       }},
      {"moves at 10 m/s and stops dead", false, true,
       [](const Matrix3Xd& rest, int k, int steps) {
         return Matrix3Xd(rest.colwise() + Vector3d(0.1 * (std::min(k, steps / 2) - steps / 2), 0, 0));
       }},
      {"jumps by 10 m", false, true,
       [](const Matrix3Xd& rest, int k, int) {
         return Matrix3Xd(rest.colwise() + Vector3d(0, 0, k >= 5 && k < 10 ? 10.0 : 0.0));
       }},
      {"jumps to and fro by 1 m", false, true,
       [](const Matrix3Xd& rest, int k, int steps) {
         return Matrix3Xd(rest.colwise() + Vector3d(0, k % 2 && k < steps / 2 ? 1.0 : 0.0, 0));
       }},
      {"jumps to a million metres", false, false,
       [](const Matrix3Xd& rest, int, int) { return Matrix3Xd(rest.colwise() + Vector3d(1e6, 0, 0)); }},
      {"turns inside out at once", false, false,
       [=](const Matrix3Xd& rest, int, int) { return about_middle(rest, Vector3d(-1, 1, 1).asDiagonal()); }},
      {"spins at 30 turns per second", false, false,
       [=](const Matrix3Xd& rest, int k, int) {
         return about_middle(rest,
                             Eigen::AngleAxisd(0.6 * M_PI * k, Vector3d(1, 1, 1).normalized()).toRotationMatrix());
       }},
      {"scatters at random", false, true,
       [](const Matrix3Xd& rest, int k, int steps) {
         Matrix3Xd x = rest;
         std::mt19937 random(static_cast<unsigned>(k));
         for (Eigen::Index i = 0; i < x.size() && k < steps / 2; ++i)
           x.data()[i] += 0.4 * (random() * 0x1p-32 - 0.5);
         return x;
       }},
      refused("has a vertex that is not a number",
              [](Matrix3Xd x) {
                x(1, 3) = std::nan("");
                return x;
              }),
      refused("has an infinite vertex",
              [](Matrix3Xd x) {
                x(2, 0) = std::numeric_limits<double>::infinity();
                return x;
              }),
      refused("has lost a vertex", [](const Matrix3Xd& x) { return Matrix3Xd(x.leftCols(x.cols() - 1)); }),
      refused("has a vertex more",
              [](const Matrix3Xd& x) {
                Matrix3Xd more(3, x.cols() + 1);
                more << x, Vector3d::Zero();
                return more;
              }),
      refused("is empty", [](const Matrix3Xd&) { return Matrix3Xd(3, 0); }),
  };
}

/// A cell, and what else is asked of tracking. Refusals of guides that are no good do not end it.
struct Verdict
{
  StabilityCell cell;
  int refused = 0;                 ///< steps
  bool finished = true;            ///< within the time for a cell
  double worst = 0, fastest = 0;   ///< of |c| over the shell's size; largest velocity at the end [m/s]
};

/// A refusal must say why and leave the state as it was; the run goes on with the next guide. After ten refusals, or
/// `budget` of CPU time [s], it ends.
Verdict runGuided(Simulation& simulation, const GuideCase& guide, int steps, double budget)
{
  Verdict v;
  const Matrix3Xd rest = simulation.config().cloths[0].tracking->guide.mesh.vertices;
  v.cell.linear_steps = simulation.config().cloths[0].one_newton_step;
  double still = 0, scale = 0;
  const double begin = threadSeconds();
  for (int k = 0; k < steps && v.refused < 10; ++k)
  {
    if (threadSeconds() - begin > budget)
    {
      v.finished = false;
      break;
    }
    SceneInputs inputs = simulation.defaultInputs();
    inputs.guides[0] = guide.motion(rest, k + 1, steps);
    const SceneState before = simulation.state();
    StepReport report;
    try
    {
      report = simulation.step(inputs);
    }
    catch (const std::invalid_argument& error)
    {
      report.ok = false;
      report.message = error.what();
    }
    const ClothState& now = simulation.state().cloths[0];
    if (v.cell.took(report, allFinite(simulation.state()), stateBytes(before) == stateBytes(simulation.state())))
    {
      const Matrix3Xd& x = now.x;
      const double reach = x.cwiseAbs().maxCoeff(), size = (x.rowwise().maxCoeff() - x.rowwise().minCoeff()).norm();
      v.worst = std::max(v.worst, simulation.trackingError({ObjectRef::cloth, 0}).met / (size + 1e-3 * reach + 0.4));
      // Once the guide is still, nothing puts energy in; what is strained then is what there is to give.
      if (guide.comes_to_rest && !guide.to_be_refused && k == steps * 3 / 4)
      {
        const ClothEnergies e = simulation.clothEnergies(0);
        still = e.total();
        scale = e.membrane + e.bending + e.kinetic +
                simulation.clothModel(0).totalMass() * simulation.config().gravity.norm() * size;
      }
      if (scale > 0 && !v.cell.energyIs((simulation.clothEnergies(0).total() - still) / scale, 1.0))
        break;
      continue;
    }
    if (!v.cell.complaint.empty())
      break;
    ++v.refused;
  }
  v.fastest = simulation.state().cloths[0].v.cwiseAbs().maxCoeff();
  v.cell.cpu_seconds = threadSeconds() - begin;
  return v;
}

/// Onto a cylinder ever narrower, 2 rad/s between the sides x = 0 and x = 0.4 m, without changing lengths.
Matrix3Xd rolled(const Matrix3Xd& rest, double time)
{
  const double curvature = 2.0 * time / 0.4;
  Matrix3Xd x = rest;
  for (Eigen::Index i = 0; i < x.cols(); ++i)
  {
    x(0, i) = std::sin(curvature * rest(0, i)) / curvature;
    x(2, i) = (1.0 - std::cos(curvature * rest(0, i))) / curvature;
  }
  return x;
}

/// A sheet with test functions of its own making.
GuidedCloth sheetWith(const TestFunctions& functions, const Subdivision& fine, const TriangleMesh& guide)
{
  GuidedCloth c;
  c.guide = guide;
  c.fine = fine;
  c.functions = functions;
  c.model = buildCloth("sheet", fine.mesh, 0.2, isotropicMembrane(1e5, 0.3, 1e-3));
  c.model.bending = BendingModel::hinge;
  c.model.bending_modulus = 1e-5;
  c.model.stiffness_damping = 1e-3;
  c.gravity = Vector3d(0, 0, -9.81);
  c.at = [rest = guide.vertices](double t) {
    Matrix3Xd x = rest;
    x.row(2).array() += 0.1 * std::sin(6 * t);
    return x;
  };
  return c;
}

}   // namespace

void runTrackingStability(StudyContext& context)
{
  useOneBlasThread();
  StabilityTally tally(context);
  int cells = 0, not_recovered = 0, unfinished = 0;
  double worst = 0, worst_in_contact = 0;

  // Guides
  struct Setting
  {
    std::string name;
    std::vector<std::string> set;
  };
  std::vector<Setting> settings;
  const std::string s = "tracked.0.";
  for (const char* bending : {"hinge", "isometric"})
    for (const bool newton : {false, true})
      for (const char* step : {"0.01", "0.1"})
        settings.push_back(
            {std::string(bending) + (newton ? ", Newton, " : ", one step, ") + step + " s",
             {s + "bending={model: " + bending + "}",
              s + "solver={one_newton_step: " + (newton ? "false" : "true") + "}", std::string("time.step=") + step}});
  if (context.quick())
    settings = {settings[0], settings[3], settings[5]};
  settings.push_back({"hinge, one step, 0.01 s, self-contact",
                      {s + "solver={one_newton_step: true}", s + "contact={thickness: 0.002}"}});
  const std::vector<GuideCase> guides = guideCases();
  const int steps = context.quick() ? 40 : 100, total = static_cast<int>(settings.size() * guides.size());
  for (const Setting& setting : settings)
    for (const GuideCase& guide : guides)
    {
      const bool crushes = !guide.to_be_refused && guide.name.find("jumps") == std::string::npos;
      if (context.quick() && &setting == &settings.back() && crushes)
        continue;   // in contact: single steps of many seconds
      context.progress(cells, total, guide.name);
      Simulation simulation(parseScene(kScene, "sheet.yaml", setting.set));
      Verdict v = runGuided(simulation, guide, steps, context.quick() ? 1.5 : 20.0);
      // refusals of good guides end the cell; those of bad ones are what is wanted, and the steps after them
      if (guide.to_be_refused && v.cell.complaint.empty() &&
          !(v.refused == 5 && (v.cell.steps == steps - 5 || !v.finished)))
      {
        v.cell.explained = false;
        v.cell.complaint = "guides that are no good were refused " + std::to_string(v.refused) +
                           " times instead of 5, or the run did not go on";
      }
      Row& row = context.row();
      row.set("case", "guide " + guide.name).set("setting", setting.name);
      tally.record(row, v.cell);
      row.set("steps_refused", v.refused)
          .set("finished", v.finished ? "yes" : "slow")
          .set("average_error_over_size", v.worst)
          .set("end_strain", v.cell.end_strain)
          .set("fastest_at_end", v.fastest);
      ++cells;
      unfinished += !v.finished;
      not_recovered += guide.comes_to_rest && v.refused == 0 && v.finished && !(v.cell.end_strain < 0.5);
      double& most = simulation.config().cloths[0].contact ? worst_in_contact : worst;
      most = std::max(most, v.worst);
    }

  // Constraints: the same region twice, but for less and less at one vertex; all vertices prescribed; held vertices
  // whose average is prescribed
  const TriangleMesh guide = guideSheet(0.4, 3, 0.0);
  const Subdivision fine = subdivide(guide, 2);
  const auto constrained = [&](const std::string& what, const TestFunctions& functions, const std::vector<int>& held,
                               const TriangleMesh& of, const Subdivision& on) {
    Verdict v;
    const GuidedCloth c = sheetWith(functions, on, of);
    v.cell.linear_steps = true;
    double force = 0;
    try
    {
      std::vector<char> is_held(held.empty() ? 0 : static_cast<std::size_t>(on.mesh.vertices.cols()), 0);
      for (const int vertex : held)
        is_held[vertex] = 1;
      c.constraints().requireIndependent(is_held);
      GuidedStepper stepper(c, Follow::averages);
      if (!held.empty())
        stepper.cloth().pin(held);
      for (int k = 0; k < steps; ++k)
      {
        const ClothState before = stepper.cloth().state;
        const StepReport report = stepper.step();
        const ClothState& now = stepper.cloth().state;
        if (report.ok)
          force = stepper.stepper().averageForces().cwiseAbs().maxCoeff();
        if (!v.cell.took(report, now.x.allFinite() && now.v.allFinite() && std::isfinite(force),
                         now.x == before.x && now.v == before.v))
          break;
        v.worst = std::max(v.worst, stepper.error() / 0.56);
      }
    }
    catch (const std::invalid_argument& error)   // as a scene that has them is
    {
      v.cell.refuseAtOnce(error.what());
    }
    Row& row = context.row();
    row.set("case", what).set("setting", "hinge, one step, 0.01 s");
    tally.record(row, v.cell);
    row.set("average_error_over_size", v.worst).set("end_strain", v.cell.end_strain).set("largest_force_N", force);
    ++cells;
    worst = std::max(worst, v.worst);
  };
  const TestFunctions hats = subdivisionBasis(fine);
  constrained("all hats", hats, {}, guide, fine);
  for (const double apart : {1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 0.0})
  {
    TestFunctions twice = subdivisionBasis(fine, {5, 5});
    twice.tracked.coeffRef(1, 5) += apart;   // the guide's averages are the same: the shell's must be, too
    twice.tracked.makeCompressed();
    char what[80];
    std::snprintf(what, sizeof what, "a function twice, but for %g at one vertex", apart);
    constrained(what, twice, {}, guide, fine);
  }
  {
    TestFunctions conflict = subdivisionBasis(fine, {5, 10});   // the same region of the shell, two of the guide
    const TestFunctions one = subdivisionBasis(fine, {5});
    std::vector<Eigen::Triplet<double>> entries;
    for (int row = 0; row < 2; ++row)
      for (TestFunctions::Values::InnerIterator entry(one.tracked, 0); entry; ++entry)
        entries.emplace_back(row, static_cast<int>(entry.col()), entry.value());
    conflict.tracked.setFromTriplets(entries.begin(), entries.end());
    constrained("one region to be in two places", conflict, {}, guide, fine);
    conflict.tracked.coeffRef(1, 5) += 0.1;
    conflict.tracked.makeCompressed();
    constrained("nearly one region to be in two places", conflict, {}, guide, fine);
  }
  {
    const Subdivision same = subdivide(fine.mesh, 0);
    constrained("as many functions as vertices", subdivisionBasis(same), {}, fine.mesh, same);
    TestFunctions empty = hats;
    for (TestFunctions::Values::InnerIterator entry(empty.tracked, 3); entry; ++entry)
      entry.valueRef() = 0.0;
    constrained("an empty function", empty, {}, guide, fine);
  }
  std::vector<int> all, part;
  const WeakConstraints::Matrix weights = sheetWith(hats, fine, guide).constraints().matrix();
  for (WeakConstraints::Matrix::InnerIterator entry(weights, 0); entry; ++entry)
  {
    all.push_back(static_cast<int>(entry.col()));
    if (all.size() % 2 == 0)
      part.push_back(all.back());
  }
  constrained("half of a region's vertices held", hats, part, guide, fine);
  constrained("all of a region's vertices held", hats, all, guide, fine);

  // A sheet that is rolled up by its regions: soft and stiff, thin and thick.
  const auto rolled_up = [](double youngs_modulus, double thickness) {
    char text[900];
    std::snprintf(text, sizeof text, R"(
tracked:
  - guide: {grid: {corner: [0, 0, 0], sides: [[0.4, 0, 0], [0, 0.4, 0]], cells: [2, 2], pattern: alternating}, motion: fixed}
    mesh: {subdivide: 2}
    material: {density: 1000, thickness: %g, youngs_modulus: %g, poissons_ratio: 0.3}
    bending: {model: hinge}
)",
                  thickness, youngs_modulus);
    return MapScene{text, rolled};
  };
  sheetMaps(context, tally, "tracking_stability", 0.4, rolled_up);
  context.metric("not_recovered", not_recovered);
  context.metric("unfinished", unfinished);
  context.metric("cells", static_cast<double>(context.rows().size()));
  context.metric("worst_average_error_over_size", worst);
  context.metric("worst_average_error_over_size_in_contact", worst_in_contact);
  context.note(
      "Guides that are no good must be refused for as long as they are, and the run "
      "goes on. unfinished: cells stopped after 20 s of CPU time (quick: 1.5 s), for the most part of contact in "
      "guides that crush the "
      "shell. not_recovered: strained by half or more at the end though the guide came back; in contact, collisions "
      "have the last word "
      "where both cannot be had; errors are over the shell's size, with a thousandth of its distance from the origin "
      "added for rounding.");
}

const StudyRegistration kTrackingStabilityRegistration{
    "tracking_stability",
    "guides that collapse, explode, jump or are not numbers, constraints that conflict: done or refused with reason",
    runTrackingStability};

}   // namespace slender::study
