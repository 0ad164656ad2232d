// Inputs that are refused, and what is said about a step that failed.
#include <algorithm>
#include <cmath>
#include <functional>

#include "cloth_work.h"

namespace slender {

bool ClothWork::inputsFine(const ClothState& s, const ClothInputs& inputs, double duration, std::string& what) const
{
  const int n = model->vertices();
  const auto check = [&](bool good, const char* name) {
    if (!good && what.empty())
      what = name;
    return good;
  };
  check(duration > 0 && std::isfinite(duration), "step length (must be positive)");
  check(inputs.gravity.allFinite(), "gravity");
  check(inputs.wind.allFinite(), "wind");
  check(inputs.forces.cols() == 0 || inputs.forces.cols() == n, "number of forces (one per vertex, or none)");
  check(inputs.forces.allFinite(), "forces");
  check(inputs.pins.cols() == static_cast<Eigen::Index>(s.pins.size()),
        "number of pin positions (one per pin of the state)");
  check(inputs.pins.allFinite(), "pin positions");
  const PrescribedAverages* prescribed = model->averagesOf(s);
  check(prescribed || (model->averages.empty() && s.average_set == 0),
        "set of averages of the state (one of the model's)");
  check(inputs.averages.cols() == (prescribed ? prescribed->count() : 0),
        "number of averages (one per average of the set)");
  check(inputs.averages.allFinite(), "averages");
  check(s.x.cols() == n && s.v.cols() == n, "number of vertices of the state");
  check(s.x.allFinite() && s.v.allFinite() && s.next_step >= 0, "the state");
  check(model->bending != BendingModel::hinge ||
            (s.rest_angles.size() == model->topology.hingeCount() && s.rest_angles.allFinite()),
        "rest angles of the state (one per hinge)");
  check(!plastic_.active() || (s.stiffening.size() == model->topology.hingeCount() && s.stiffening.allFinite() &&
                               (s.stiffening.array() > 0).all()),
        "stiffening of the state (positive, one per hinge)");
  bool sound = true;
  for (std::size_t k = 0; k < s.pins.size(); ++k)
    sound = sound && s.pins[k] >= 0 && s.pins[k] < n && (k == 0 || s.pins[k] > s.pins[k - 1]);
  check(std::all_of(s.at_bound.begin(), s.at_bound.end(),
                    [&](int i) { return i >= 0 && prescribed && i < prescribed->bounds.size(); }) &&
            std::adjacent_find(s.at_bound.begin(), s.at_bound.end(), std::greater_equal<int>()) == s.at_bound.end(),
        "averages of the state that are at their bounds (ascending)");
  check(sound, "pins of the state (vertices, ascending)");
  return what.empty();
}

bool ClothWork::accepts(const ClothState& state, const ClothInputs& inputs, double duration, StepReport& report) const
{
  std::string what;
  if (inputsFine(state, inputs, duration, what))
    return true;
  refuse(report, StepFailure::input_not_finite, what + " is not finite or not valid; correct this input");
  return false;
}

StepReport ClothWork::refuse(StepReport& report, StepFailure failure, const std::string& message) const
{
  report.work = ownWork();
  return report.refuse(failure, "cloth '" + model->name + "': " + message);
}

std::string ClothWork::explain(StepFailure failure, double length) const
{
  const std::string at = " at a step of " + milliseconds(length);
  if (isExplicit())
    return "the explicit step blew up" + at + ": use a shorter step (stable below " + milliseconds(stableStep()) +
           " at rest) or implicit_euler";
  if (failure == StepFailure::singular_matrix && averages && !averages->independent())
    return kDependentAverages;
  if (failure == StepFailure::singular_matrix)
    return "the matrix is not positive definite" + at +
           ": sizes or moduli differ by too many orders of magnitude, or a grasp or force is too fast or too large by "
           "as many";
  if (failure == StepFailure::work_exceeded)
    return "the step needs more work than it is given" + at + ": use a shorter step, move what " +
           (model->averages.empty() ? "holds it by less at once"
                                    : "guides it by less at once and without crumpling it") +
           ", or take softer cloth (thickness, moduli)";
  if (failure == StepFailure::linear_unconverged)
    return "the linear equations did not converge" + at + ": use a shorter step, a larger solver.tolerance" +
           (averages && averages->bounded() ? ", a larger max_traction" : "") + ", or softer cloth (thickness, moduli)";
  if (failure == StepFailure::energy_grew)
    return "one Newton step brings energy out of nothing" + at +
           ": use a shorter step, more time.newton.max_cuts, or one_newton_step: false";
  if (failure == StepFailure::state_not_finite)
    return "the configuration overflowed" + at + ": use a shorter step or check the inputs for jumps";
  return "Newton's method did not converge" + at +
         ": use a shorter step, more time.newton.max_iterations or max_cuts, move " +
         (work_.pins.empty() ? "what touches it" : "the pins") + " slowly, or start from a shape whose faces have area";
}

StepReport ClothWork::refuseUnsolved(StepReport& report, StepFailure failure, double length, const char* why)
{
  // explicit steps end in a state that says nothing, and a spent budget may have left none; then the state at the start
  // of the step is looked at
  const bool trial = !isExplicit() && failure != StepFailure::work_exceeded;
  const auto place = [&](int i) { return trial ? Eigen::Vector3d(point(x, i)) : Eigen::Vector3d(work_.x.col(i)); };
  Largest strain, node;
  const auto& edges = model->topology.edges;
  for (int e = 0; e < static_cast<int>(edges.cols()); ++e)
  {
    const double rest = (model->rest.vertices.col(edges(0, e)) - model->rest.vertices.col(edges(1, e))).norm();
    strain.add(e, std::abs((place(edges(0, e)) - place(edges(1, e))).norm() / rest - 1.0));
  }
  for (int i = 0; i < model->vertices(); ++i)
    if (trial && !averages && !system->held()[i])   // averages bear forces that the gradient does not know
      node.add(i, point(system->gradient(), i).norm());
    else if (!trial)
      node.add(i, work_.v.col(i).norm());
  const int a = edges(0, strain.index()), b = edges(1, strain.index());
  const int at = node.any() ? node.index() : a;
  report.place = {FailurePlace::Kind::cloth, model->name, at, work_.x.col(at)};
  std::string text = ". The largest stretch strain is " + strain.text("") + ", between vertices " + std::to_string(a) +
                     " and " + std::to_string(b);
  if (node.any())
    text +=
        trial ? "; the largest unbalanced force is " + node.text("N") + ", on vertex " + std::to_string(at) + ", which"
              : "; vertex " + std::to_string(at) + " is the fastest, with " + node.text("m/s") + "; it";
  else
    text += ", of which the first";
  return refuse(report, failure,
                (*why ? why : explain(failure, length)) + text + " was at " + metres(report.place.position) +
                    " as the step began");
}

}   // namespace slender
