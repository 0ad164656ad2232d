#pragma once

#include <vector>

#include <Eigen/Core>

#include "slender_sim/rod/rod_model.h"
#include "slender_sim/scene/config.h"

/// From a rod's configuration to the numbers buildRod() takes. All throw std::invalid_argument with name, value and
/// range.
namespace slender {

/// Nodes of the rest shape [m]. `gravity` tells a catenary where down is. A closed rod whose curve ends where it began
/// (a full circle) keeps one of the two coinciding nodes.
Eigen::Matrix3Xd restNodes(const RodConfig& rod, const Eigen::Vector3d& gravity);

/// Nodes of the initial shape: `rest` itself unless the rod has `initial`, whose curve then gets as many nodes, spaced
/// as in `rest`.
Eigen::Matrix3Xd initialNodes(const RodConfig& rod, const Eigen::Matrix3Xd& rest, const Eigen::Vector3d& gravity);

/// Nodes of an open curve as it stands [m].
Eigen::Matrix3Xd curveNodes(const Curve& curve, const Eigen::Vector3d& gravity);

/// One value per edge from one value, two (linear from the first to the last edge) or one per edge.
std::vector<double> perEdge(const std::vector<double>& values, int edges, const char* name);

/// Cross-sections and moduli of all edges. Derived moduli: density A, E A, E A/4 diag(a^2, b^2), and G J with
/// J = A (a^2 + b^2)/4 (polar) or pi a^3 b^3 / (a^2 + b^2) (Saint-Venant: the ellipse's exact torsion), A = pi a b,
/// G = E / (2 (1 + nu)). Moduli given directly take their place.
std::vector<RodSection> rodSections(const RodConfig& rod, int edges);

}   // namespace slender
