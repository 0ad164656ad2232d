// A cloth in the search for equilibria, see Statics.
#include <algorithm>
#include <cmath>

#include "cloth_part.h"

namespace slender {

bool ClothPart::beginStatics()
{
  const ClothModel& m = *work_.model;
  size_ = (m.rest.vertices.rowwise().maxCoeff() - m.rest.vertices.rowwise().minCoeff()).norm();
  still_ = base_;
  toPoints(work_.present().x, still_);
  system().hold(work_.present());
  Eigen::Vector3d total(0, 0, 0);
  double loads = 0.0;
  for (int i = 0; i < points(); ++i)
  {
    total += load(i);
    loads += load(i).norm();
  }
  // The stiffness of the whole cloth against bending, or against its loads where that is larger, over its mass. A cloth
  // without either is held by its membrane.
  const double stiffness = std::max(m.bending_modulus / (size_ * size_), loads / size_);
  statics_rate_ = 100.0 * (stiffness > 0 ? stiffness : 1e-6 * (m.membrane.c11 + m.membrane.c22)) / m.totalMass();
  // Nothing but pins can balance a resultant load. Below 1e-9 of the loads it is round-off of their sum.
  return !work_.present().pins.empty() || total.norm() <= 1e-9 * loads;
}

Eigen::Vector3d ClothPart::load(int i) const
{
  const ClothInputs& inputs = work_.inputs();
  Eigen::Vector3d force = work_.model->mass[i] * inputs.gravity;
  if (inputs.forces.cols() > 0)
    force += inputs.forces.col(i);
  return force;
}

void ClothPart::loadPresent()
{
  work_.x = base_ = still_;
  moved_ = false;
}

std::function<void()> ClothPart::wayBack()
{
  return [this, still = still_] { still_ = still; };
}

double ClothPart::shift() const
{
  double square = 0.0;
  for (int i = 0; i < points(); ++i)
    square = std::max(square, (vertex(still_, i) - vertex(work_.x, i)).squaredNorm());
  return std::sqrt(square) / size_;
}

/// Each move of a pin is at most a fifth of an edge.
double ClothPart::moves() const
{
  double largest = 0.0;
  for (std::size_t k = 0; k < work_.present().pins.size(); ++k)
    largest = std::max(largest, (work_.pinAt(k, 1.0) - work_.pinAt(k, 0.0)).norm());
  return largest / (0.2 * work_.shortestEdge());
}

/// A weight of 1 is statics_rate_. Potentials count from the present configuration.
void ClothPart::setProximal(double weight)
{
  constexpr double kNoInertia = 1e150;   // the square of this is still a finite number
  pencil_rate_ = 0.0;
  system().beginStage({weight > 0 ? 1.0 / std::sqrt(weight * statics_rate_) : kNoInertia, &still_, &still_, &still_,
                       &still_, &work_.present().v},
                      work_.inputs());
}

void ClothPart::setPencil(double rate)
{
  setProximal(0.0);
  system().countFromOrigin();
  pencil_rate_ = rate;
}

StaticScales ClothPart::scales() const
{
  const ClothModel& m = *work_.model;
  StaticScales result;
  result.mass = m.totalMass();
  result.least_mass = m.mass.minCoeff();
  result.bending = m.bending_modulus / (size_ * size_);
  result.largest = 8.0 * (m.membrane.c11 + m.membrane.c22) / result.least_mass;   // of one vertex on its edges
  result.points = m.vertices();
  return result;
}

void ClothPart::weighDirection()
{
  for (int i = 0; i < points(); ++i)
    vertex(system().gradient(), i) = (isFree(i) ? -work_.model->mass[i] : 0.0) * vertex(direction_, i);
}

/// Largest turn or stretch of an edge by the direction, over its length at rest.
double ClothPart::turnOfEdges() const
{
  const auto& edges = work_.model->topology.edges;
  double turn = 0.0;
  for (std::size_t e = 0; e < inverse_length_.size(); ++e)
  {
    const auto edge = edges.col(static_cast<Eigen::Index>(e));
    turn = std::max(turn, (vertex(direction_, edge[1]) - vertex(direction_, edge[0])).norm() * inverse_length_[e]);
  }
  return turn;
}

double ClothPart::largestTurn() const
{
  double most = 0.0;
  for (const double value : direction_)
    most = std::max(most, std::abs(value));
  return std::max(turnOfEdges(), most / size_);
}

/// Largest load or reaction. A cloth at rest has neither to compare with, only their round-off.
double ClothPart::staticForceScale() const
{
  const ClothModel& m = *work_.model;
  double largest = 1e-9 * (m.membrane.c11 + m.membrane.c22) * work_.shortestEdge();
  for (int i = 0; i < points(); ++i)
    largest = std::max({largest, load(i).norm(), isFree(i) ? 0.0 : vertex(system().gradient(), i).norm()});
  return largest;
}

}   // namespace slender
