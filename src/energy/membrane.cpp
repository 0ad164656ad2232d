#include "slender_sim/energy/membrane.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace slender {

namespace {

void require(bool good, const char* name, double value, const char* range)
{
  if (!good)
    throw std::invalid_argument(std::string("membrane: ") + name + " must be " + range + ", got " +
                                std::to_string(value));
}

bool positive(double v) { return v > 0 && std::isfinite(v); }

}   // namespace

MembraneModuli isotropicMembrane(double youngs_modulus, double poissons_ratio, double thickness)
{
  require(positive(youngs_modulus), "Young's modulus [Pa]", youngs_modulus, "positive");
  require(positive(thickness), "thickness [m]", thickness, "positive");
  require(poissons_ratio > -1 && poissons_ratio <= 0.5, "Poisson's ratio", poissons_ratio, "in (-1, 0.5]");
  const double c = youngs_modulus * thickness / (1.0 - poissons_ratio * poissons_ratio);
  return {c, c * poissons_ratio, c, 0.5 * c * (1.0 - poissons_ratio)};
}

MembraneModuli orthotropicMembrane(double warp, double weft, double poissons_ratio, double shear)
{
  require(positive(warp), "modulus along the warp [N/m]", warp, "positive");
  require(positive(weft), "modulus along the weft [N/m]", weft, "positive");
  require(positive(shear), "shear modulus [N/m]", shear, "positive");
  const double other = poissons_ratio * weft / warp, rest = 1.0 - poissons_ratio * other;
  require(rest > 0, "Poisson's ratio", poissons_ratio, "less than the root of warp over weft modulus in magnitude");
  return {warp / rest, poissons_ratio * weft / rest, weft / rest, shear};
}

}   // namespace slender
