#pragma once

#include <array>

namespace slender::study {

/// Tip of a heavy elastic rod clamped horizontally, in units of its length.
struct CantileverTip
{
  double drop;     ///< H / L, positive downwards
  double extent;   ///< W / L, horizontal
};

/// theta'' = -gamma (1-s) cos(theta) (1 + stretch (1-s) sin(theta)), theta(0) = 0, theta'(1) = 0, where theta is the
/// angle below the horizontal, gamma = (weight) L^2 / (E I) and stretch = (weight) / (E A) the strain under its own
/// weight (0: inextensible). Numerov's scheme with Newton; relative error below 1e-7 for gamma <= 1e5.
CantileverTip heavyCantilever(double gamma, double stretch = 0.0);

/// Post-buckled planar elastica of length 1 whose ends have approached by `compression` (0, 0.9).
struct ElasticaShape
{
  double load;         ///< P L^2 / (E I)
  double deflection;   ///< at the middle, over L
};

/// K, E complete elliptic integrals of modulus k: compression = 2 - 2 E/K, deflection = k/K, P = (2K)^2 (pinned) or
/// (4K)^2 (clamped).
ElasticaShape bucklingElastica(double compression, bool clamped);

/// Cantilever under a dead load P L^2/(E I) = `load` at its tip, across the undeformed axis [Bisshopp & Drucker 1945].
CantileverTip endLoadedCantilever(double load);

/// beta_k L of a clamped-free beam, cos(x) cosh(x) = -1, for mode k = 1, 2, ...; omega_k = (beta_k L)^2 sqrt(E I / (rho
/// A L^4)).
double cantileverRoot(int mode);

/// Slope d(w)/d(s/L) of the k-th clamped-free mode at s/L, scaled to w = 2 at the tip (up to sign).
double cantileverModeSlope(int mode, double s);

/// The mode w itself.
double cantileverMode(int mode, double s);

}   // namespace slender::study
