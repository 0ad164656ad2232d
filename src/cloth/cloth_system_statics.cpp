// What statics and the account of work need of the system of a cloth.
#include "cloth_system.h"

namespace slender {

double ClothSystem::loadWork(int i, const PointVector& from, const PointVector& to) const
{
  double work = point(force_, i).dot(point(to, i) - point(from, i));
  Eigen::Vector3d unused(0, 0, 0);
  if (wind_.active())
    work += wind_.addGradient(i, point(from, i), unused) - wind_.addGradient(i, point(to, i), unused);
  return work;
}

Eigen::Vector3d ClothSystem::internalGradient(int i, const PointVector& x) const
{
  Eigen::Vector3d loads = weight_[i] * (point(x, i) - point(target_, i)) - point(force_, i);
  if (wind_.active())
    wind_.addGradient(i, point(x, i), loads);
  return point(gradient_, i) - loads;
}

void ClothSystem::shiftMatrix(double factor)
{
  for (int i = 0; i < points(); ++i)
    for (int k = 0; k < 3; ++k)
      matrix_.values()[9 * matrix_.starts()[i] + 4 * k] += factor * weight_[i];
}

void ClothSystem::addInertia(double rate)
{
  for (int i = 0; i < points(); ++i)
    for (int k = 0; k < 3; ++k)
      matrix_.values()[9 * matrix_.starts()[i] + 4 * k] += rate * model_.mass[i];
}

}   // namespace slender
