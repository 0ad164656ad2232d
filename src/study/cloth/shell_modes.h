#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/cloth/cloth_model.h"
#include "slender_sim/linalg/block_matrix.h"

/// Small free vibrations of curved shells: of a mesh, and of the shell that the mesh stands for.
namespace slender::study {

/// A thin isotropic shell. Its membrane and its bending may have different Poisson's ratios.
struct ShellMaterial
{
  double area_density = 0.0;     ///< [kg/m^2]
  double stretching = 0.0;       ///< C = E h / (1 - nu^2) [N/m]
  double membrane_ratio = 0.0;   ///< nu of the membrane
  double bending = 0.0;          ///< D [N m]
  double bending_ratio = 0.0;    ///< nu of bending
};

/// Hessian of the elastic energy of a cloth that bends by hinges or by isometric bending without a ratio of its own,
/// put together from the energies alone.
BlockMatrix elasticHessian(const ClothModel& model, const ClothState& state);

/// The `count` lowest angular frequencies [rad/s], ascending, of a cloth with hinge bending about its shape at rest.
/// The vertices `held` do not move. Inverse iteration of a subspace, with the Hessian that time steps take. Throws
/// std::runtime_error where the Hessian is not positive definite.
Eigen::VectorXd meshFrequencies(const ClothModel& model, const std::vector<int>& held, int count);

/// The same of a cylindrical panel by the method of Ritz: radius [m], opening angle [rad] and width along the axis [m].
/// It is clamped along its two straight sides and free along the two arcs. Strains are those of Koiter and Sanders.
/// Displacements are polynomials of `degree` + 1 terms along the arc and half as many across, so that the frequencies
/// fall to the exact ones as `degree` grows.
Eigen::VectorXd archFrequencies(const ShellMaterial& material, double radius, double angle, double width, int degree,
                                int count);

/// The same of a spherical cap clamped along its rim, which lies at the colatitude `angle` [rad]. One polynomial of
/// `degree` + 1 terms per displacement and harmonic around the axis. Modes that come in pairs are listed twice.
Eigen::VectorXd capFrequencies(const ShellMaterial& material, double radius, double angle, int degree, int count);

}   // namespace slender::study
