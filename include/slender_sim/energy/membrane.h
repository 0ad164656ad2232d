#pragma once

namespace slender {

/// Stiffness of a membrane per width in material axes, warp first: S11 = c11 G11 + c12 G22, S22 = c12 G11 + c22 G22,
/// S12 = 2 c33 G12 [N/m].
struct MembraneModuli
{
  double c11 = 0, c12 = 0, c22 = 0, c33 = 0;
};

/// Plane stress of a sheet of the given thickness [m]; modulus E [Pa]. Throws std::invalid_argument naming the bad
/// value: modulus or thickness not positive, Poisson's ratio outside (-1, 0.5].
MembraneModuli isotropicMembrane(double youngs_modulus, double poissons_ratio, double thickness);

/// Along warp and weft the moduli [N/m] (per width), Poisson's ratio of the weft's contraction under tension along the
/// warp, and the shear modulus [N/m]. Throws std::invalid_argument naming the bad value; the energy must be positive:
/// ratio^2 < warp / weft.
MembraneModuli orthotropicMembrane(double warp, double weft, double poissons_ratio, double shear);

}   // namespace slender
