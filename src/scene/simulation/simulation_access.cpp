// Read access to the grasps and cloths of a scene.
#include "slender_sim/scene/simulation.h"

namespace slender {

bool Simulation::isActive(int grasp) const
{
  checkGrasp(grasp);
  const GraspRef& ref = grasps_[grasp];
  return ref.cloth >= 0 ? state_.cloths[ref.cloth].grasps[ref.index].active : graspState(grasp).active;
}

const Pose& Simulation::graspPose(int grasp) const
{
  checkGrasp(grasp);
  const GraspRef& ref = grasps_[grasp];
  return ref.cloth >= 0 ? state_.cloths[ref.cloth].grasps[ref.index].X_WG : graspState(grasp).X_WG;
}

const std::string& Simulation::heldObject(int grasp) const
{
  checkGrasp(grasp);
  const GraspRef& ref = grasps_[grasp];
  return ref.cloth >= 0 ? config_.cloths[ref.cloth].name : config_.rods[ref.rod].name;
}

const Eigen::Matrix3Xd& Simulation::pinForces(int cloth) const
{
  const auto& stepper = cloth_steppers_.at(static_cast<std::size_t>(cloth));
  return stepper ? stepper->pinForces()
                 : touching_cloths_[cloth_places_[cloth].group].group.pinForces(cloth_places_[cloth].index);
}

Eigen::Matrix3Xd Simulation::contactForces(int cloth) const
{
  if (cloth_steppers_.at(static_cast<std::size_t>(cloth)))
    return Eigen::Matrix3Xd(3, 0);
  return touching_cloths_[cloth_places_[cloth].group].group.contactForces(cloth_places_[cloth].index);
}

const ClothStepper& Simulation::clothStepper(int cloth) const
{
  const auto& own = cloth_steppers_.at(static_cast<std::size_t>(cloth));
  return own ? *own : touching_cloths_[cloth_places_[cloth].group].group.stepper(cloth_places_[cloth].index);
}

ClothEnergies Simulation::clothEnergies(int cloth) const
{
  return clothStepper(cloth).energies(state_.cloths[static_cast<std::size_t>(cloth)].cloth, config_.gravity);
}

}   // namespace slender
