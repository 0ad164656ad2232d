#pragma once

#include <memory>

#include "study/rod/rod_cases.h"

namespace slender::study {

/// Section of unit density with these stiffnesses; bending about d2 (curvature along d1) and about d1.
RodSection sectionOf(double stretch, double bend1, double bend2, double twist);

/// A rod of one section at rest in its natural shape; d1 of the first edge as given, the others twist-free. No grasps,
/// no gravity.
RodSetup naturalRod(const RodSection& section, const Eigen::Matrix3Xd& rest, const Eigen::Vector3d& director,
                    const JointOptions& joints = {});

/// Lays the rod along other nodes, twist-free from `director` on, at rest; grasps stay as they are.
void lay(RodSetup& rod, const Eigen::Matrix3Xd& nodes, const Eigen::Vector3d& director);

/// The rod with bending along d1 (`keep` 2) or d2 (`keep` 1) and twisting `factor` times as stiff: it stays in its
/// plane where the rod itself would not, and has the same planar equilibria.
std::shared_ptr<const RodModel> keptPlanar(const RodModel& model, int keep, double factor = 1e3);

/// Number of negative eigenvalues of the energy's Hessian (zero ones count), grasps held, at an equilibrium.
int unstableModes(const RodModel& model, const RodState& state, const Eigen::Vector3d& gravity);

/// Pushes a rod clamped at its first node off along `direction`: by `amplitude` [m] at the tip, falling as a parabola
/// to the clamp.
void pushOff(RodSetup& rod, const Eigen::Vector3d& direction, double amplitude);

}   // namespace slender::study
