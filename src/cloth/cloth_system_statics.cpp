// What statics and the account of work need of the system of a cloth.
#include "cloth_system.h"

namespace slender {

double ClothSystem::loadWork(const PointVector& from, const PointVector& to) const
{
  double work = 0.0;
  for (int i = 0; i < points(); ++i)
    if (!held_[i])
      work += point(force_, i).dot(point(to, i) - point(from, i));
  for (const auto& load : loads_)
    work += load->work(from, to, held_);
  return work;
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
