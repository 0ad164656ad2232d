// A surface whose guide rapidly expands and contracts (thesis figure 6.4): averages let it follow, points tug at it.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "guided_cloth.h"

namespace slender::study {

namespace {

constexpr double kRapid = 6.0;      // [Hz]
constexpr double kDamping = 1e-3;   // [s]

GuidedCloth breathing(int levels, double frequency, double damping)
{
  GuidedCloth c;
  c.name = "breathing surface";
  c.guide = guideSheet(0.5, 4, 0.5);
  for (Eigen::Index i = 0; i < c.guide.vertices.cols(); ++i)
  {
    const Eigen::Vector3d p = c.guide.vertices.col(i);
    c.guide.vertices(2, i) += 0.03 * std::cos(4 * M_PI * p.x()) * std::cos(4 * M_PI * p.y());
  }
  c.fine = subdivide(c.guide, levels);
  c.functions = subdivisionBasis(c.fine);
  c.model = buildCloth("surface", c.fine.mesh, 0.2, isotropicMembrane(3e4, 0.3, 1e-3));
  c.model.bending = BendingModel::hinge;
  c.model.bending_modulus = 3e4 * 1e-9 / (12 * (1 - 0.3 * 0.3));
  c.model.stiffness_damping = damping;
  c.step = 0.03 / frequency;
  c.at = [rest = c.guide.vertices, frequency](double t) {
    const double s = std::clamp(t * frequency, 0.0, 1.0), ease = s * s * s * (10 - 15 * s + 6 * s * s);
    Eigen::Matrix3Xd x = rest;
    x.topRows<2>() *= 1.0 + 0.12 * ease * (1.0 - std::cos(2 * M_PI * frequency * t));
    return x;
  };
  return c;
}

}   // namespace

void runBreathingSurface(StudyContext& context)
{
  useOneBlasThread();
  SurfacePicture& picture = context.picture(
      "breathing_surface", "A surface that breathes at 6 Hz and 12 Hz (thesis figure 6.4), at its largest");
  picture.view = {0.5, 1.0, -0.8};
  Plot& plot =
      context.plot("breathing_surface_energy", "Breathing surface, 6 Hz: kinetic energy below the guide's scale",
                   "time [s]", "energy [mJ]");
  plot.log_x = plot.log_y = plot.markers = false;
  Plot& ratios = context.plot("breathing_surface_tugging", "Breathing surface: how points tug", "frequency [Hz]",
                              "fine kinetic energy, points over averages");

  struct Case
  {
    double frequency, damping;
  };
  std::vector<Case> cases{{1.5, kDamping}, {3.0, kDamping}, {kRapid, kDamping}, {12.0, kDamping}};
  if (!context.quick())
    cases.insert(cases.end(), {{24.0, kDamping}, {kRapid, 0.0}, {kRapid, 4 * kDamping}});
  const int breaths = context.quick() ? 4 : 12;
  int done = 0;
  for (const auto& [frequency, damping] : cases)
  {
    context.progress(done++, static_cast<int>(cases.size()), "breathing");
    const GuidedCloth c = breathing(3, frequency, damping);
    const FineScale fine(c);
    double energies[2] = {0, 0};
    for (const Follow how : {Follow::averages, Follow::points})
    {
      const std::string label = how == Follow::averages ? "averages" : "points";
      GuidedStepper run(c, how);
      double kinetic = 0, bending = 0, worst = 0;
      const double period = 1.0 / frequency;
      const int steps = static_cast<int>(std::lround(breaths * period / c.step)),
                shown = static_cast<int>(std::lround((breaths - 0.5) * period / c.step));
      int counted = 0;
      for (int k = 1; k <= steps; ++k)
      {
        const StepReport report = run.step();
        if (!report.ok)
          throw std::runtime_error(label + ": " + report.message);
        worst = std::max(worst, run.error());
        const double energy = fine.kineticEnergy(run.cloth().state.v);
        if (frequency == kRapid && damping == kDamping)
        {
          plot.at(label).x.push_back(run.time());
          plot.at(label).y.push_back(1e3 * energy);
        }
        if (k == shown && damping == kDamping && (frequency == kRapid || frequency == 12.0))
          picture.panels.push_back({label + " prescribed, " + (frequency == kRapid ? "6 Hz" : "12 Hz"),
                                    {{{run.cloth().state.x, c.fine.mesh.triangles}}}});
        if (run.time() < period)
          continue;   // until it breathes steadily
        ++counted;
        kinetic += energy;
        bending += run.stepper().energies(run.cloth().state, c.gravity).bending;
      }
      energies[how == Follow::points] = kinetic / counted;
      context.row()
          .set("frequency_Hz", frequency)
          .set("damping_s", damping)
          .set("constraints", label)
          .set("vertices", static_cast<double>(c.fine.mesh.vertices.cols()))
          .set("count", run.constraints().count())
          .set("fine_kinetic_mJ", 1e3 * kinetic / counted)
          .set("bending_mJ", 1e3 * bending / counted)
          .set("average_error_m", worst)
          .set("ms_per_step", 1e3 * run.seconds() / steps);
    }
    const double ratio = energies[1] / energies[0];
    if (damping == kDamping)
    {
      ratios.at("averages and points").x.push_back(frequency);
      ratios.at("averages and points").y.push_back(ratio);
    }
    if (frequency == kRapid && damping == kDamping)
      context.metric("tugging_ratio", ratio);
    if (frequency == 1.5)
      context.metric("tugging_ratio_slow", ratio);
  }
  context.note(
      "fine_kinetic: of velocities less their L2 projection onto the guide's hat functions, mean from the second "
      "breath on; tugging_ratio: points over "
      "averages, at 6 Hz, tugging_ratio_slow: at 1.5 Hz. average_error of points: distance of the averages from the "
      "guide's.");
}

const StudyRegistration kBreathingSurfaceRegistration{
    "breathing_surface",
    "a guide that rapidly expands and contracts (thesis figure 6.4): averaged against pointwise constraints",
    runBreathingSurface};

}   // namespace slender::study
