#pragma once

#include <functional>

#include <Eigen/SparseCore>

#include "cloth_cases.h"

namespace slender::study {

/// Bending energy of a configuration (3 x n) of a mesh with modulus D = 1, calibrated along and across x.
double plateEnergy(const TriangleMesh& rest, const MeshTopology& t, BendingModel model, const Eigen::Matrix3Xd& x);

/// Stiffness against small deflections of a flat mesh in the plane z = 0, D = 1: n x n.
Eigen::SparseMatrix<double> plateStiffness(const TriangleMesh& mesh, BendingModel model);

/// Makes such a matrix of a mesh.
using PlateModel = std::function<Eigen::SparseMatrix<double>(const TriangleMesh& mesh)>;

/// Centre deflection of a unit square under a unit load per area, D = 1, `cells` along a side. Clamped: a row of cells
/// outside is held too.
double squarePlateDeflection(GridPattern pattern, const PlateModel& model, int cells, bool clamped);
double squarePlateDeflection(GridPattern pattern, BendingModel model, int cells, bool clamped);

/// Smallest load rho g L^3 / D at which a plate 1 x width, held along x = 0, with gravity along -y leaves its plane:
/// linear in-plane state of a membrane with Poisson's ratio 0.3, then an eigenvalue problem of its geometric stiffness.
double lateralBucklingLoad(GridPattern pattern, const PlateModel& model, double width, int cells);
double lateralBucklingLoad(GridPattern pattern, BendingModel model, double width, int cells);

}   // namespace slender::study
