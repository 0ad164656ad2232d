#pragma once

#include "slender_sim/energy/surface_tension.h"

namespace slender {

/// Area [m^2] of the half of an end edge at a free end of a thread: endArea() and the flat cap that closes the end,
/// pi r^2 = V / L. The cap is the cone of SurfaceShape::cone that narrows from r to zero over no length. Without it an
/// edge on its own would collapse to a disc of no area. With caps on both ends such an edge is at rest at L = 2 r.
/// SurfaceShape::cylinder leaves out all slopes of the surface, and with them the cap.
inline LengthFunction freeEndArea(SurfaceShape shape, double L, double V)
{
  LengthFunction f = endArea(L, V);
  if (shape == SurfaceShape::cylinder)
    return f;
  const double cap = V / L;
  f.value += cap;
  f.d1 -= cap / L;
  f.d11 += 2.0 * cap / (L * L);
  return f;
}

}   // namespace slender
