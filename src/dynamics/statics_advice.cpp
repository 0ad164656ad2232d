#include "statics_advice.h"

namespace slender {

std::string explainStatics(StepFailure failure, const std::string& objects, const std::string& start)
{
  const std::string what = "no equilibrium was found: ";
  switch (failure)
  {
    case StepFailure::folded_back:
      return what +
             "two consecutive edges point (nearly) opposite ways: use more edges, or start from a shape that is nearer "
             "to the equilibrium (" +
             start + ")";
    case StepFailure::singular_matrix:
      return what +
             "the stiffness matrix could not be made definite: moduli or masses differ by too many orders of "
             "magnitude, or something is "
             "free to drift: hold it by a grasp";
    case StepFailure::state_not_finite:
      return what + "the configuration overflowed: the loads are too large for the " + objects +
             ", or something is free to drift: hold it by a grasp";
    case StepFailure::squeezed:
      return what + "contact leaves the " + objects +
             " no room on the way to it: start from a shape that is nearer to the equilibrium (" + start +
             "), or move grasps, bodies and obstacles apart";
    case StepFailure::interrupted: return what + "the search was interrupted on request";
    default:
      return what +
             "Newton's method did not converge: hold what is free to drift by a grasp, start from a shape that is "
             "nearer to the equilibrium (" +
             start + "), or let the scene settle by time stepping with damping (start: as_given)";
  }
}

}   // namespace slender
