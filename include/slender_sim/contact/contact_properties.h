#pragma once

namespace slender {

/// How surfaces are kept apart.
enum class ContactMethod
{
  barrier,   ///< by a potential that is part of the step [Li et al., Codimensional IPC, 2021]
  impulses   ///< of cloth alone: by a correction of the end of the step (thesis 2.5.1); cloth then meets cloth of the
             ///< same kind and solids that move as prescribed, and nothing else
};

/// What an object touches, and how. Rods, threads and cloths are described alike; an object without ContactProperties
/// touches nothing (a thread: nothing but its floor).
struct ContactProperties
{
  bool self = true;          ///< itself
  bool others = true;        ///< other objects that have this set, too; of a thread also parts that broke off it
  bool solids = true;        ///< obstacles and bodies
  double friction = 0.3;     ///< coefficient of Coulomb friction [-] >= 0; of two objects the geometric mean counts
  double thickness = 1e-3;   ///< of cloth: distance of two layers in contact [m] > 0, half of it from a solid. Rods and
                             ///< threads have their radii instead and do not read it.
  ContactMethod method = ContactMethod::barrier;
};

}   // namespace slender
