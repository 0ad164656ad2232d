#pragma once

#include "slender_sim/linalg/isa.h"

/// Structure-of-arrays view of the hinges of a mesh for the hot loops: E = sum 1/2 k (theta - rest)^2, theta the angle
/// between the normals of two faces. Points have 4 doubles. Arrays are padded to whole packs of 8 with copies of the
/// last hinge that have k = 0.
namespace slender {

constexpr int kPack = 8;   ///< entries of a pack, to whole ones of which the arrays of hinges and membranes are padded

struct HingeArrays
{
  int count = 0;                        ///< hinges with the padding
  const int* points[4] = {};            ///< tail and head of the edge, third point of the left and of the right face
  const double* stiffness = nullptr;    ///< k [N m]
  const double* rest_angle = nullptr;   ///< [rad]
};

struct HingeKernels
{
  void (*angles)(const HingeArrays& hinges, const double* x, double* angles);
  double (*energy)(const HingeArrays& hinges, const double* x);
  /// Adds dE/dx; returns E.
  double (*gradient)(const HingeArrays& hinges, const double* x, double* gradient);
  /// Adds dE/dx and the second derivatives to the blocks of a matrix (10 slots per hinge, see BlockMatrix::slots);
  /// returns E.
  double (*hessian)(const HingeArrays& hinges, const double* x, const int* slots, double* gradient, double* values);
  /// The same with a positive semidefinite matrix not below the exact one (see HingeTerm).
  double (*semidefiniteHessian)(const HingeArrays& hinges, const double* x, const int* slots, double* gradient,
                                double* values);
};

SLENDER_DECLARE_KERNELS(HingeKernels, kHingeKernels)

/// The table for this machine.
const HingeKernels& hingeKernels();

}   // namespace slender
