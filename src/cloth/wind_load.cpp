#include "wind_load.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

namespace slender {

namespace {

Eigen::Vector3d areaVector(const PointVector& x, const Eigen::Vector3i& t)
{
  const Eigen::Vector3d origin = point(x, t[0]);
  return 0.5 * (point(x, t[1]) - origin).cross(point(x, t[2]) - origin);
}

/// Drag and lift per area of a plate with unit normal n in the relative velocity u of the air [Pa], divided into along
/// * u + normal * n.
struct PlateForce
{
  double speed = 0, across = 0, along = 0, normal = 0;

  PlateForce(double drag, double lift, const Eigen::Vector3d& u, const Eigen::Vector3d& n)
    : speed(u.norm()),
      across(n.dot(u))
  {
    if (!(speed > 0))
      return;
    along = drag * std::abs(across) - lift * across * across / speed;
    normal = lift * speed * across;
  }
};

}   // namespace

bool WindLoad::actsOn(const ClothModel& model)
{
  const Aerodynamics& air = model.aerodynamics;
  const double drag = air.air_density * air.drag, lift = air.air_density * air.lift;
  for (const double factor : {drag, lift})
    if (!(factor >= 0) || !std::isfinite(factor))
      throw std::invalid_argument("cloth '" + model.name +
                                  "': air density, drag and lift coefficients must be zero or more");
  return model.wind_coefficient > 0 || drag > 0 || lift > 0;
}

WindLoad::WindLoad(const ClothModel& model)
  : model_(model),
    drag_factor_(0.5 * model.aerodynamics.air_density * model.aerodynamics.drag),
    lift_factor_(0.5 * model.aerodynamics.air_density * model.aerodynamics.lift)
{
  actsOn(model);
  drag_.assign(model.vertices(), Eigen::Matrix3d::Zero());
  target_.assign(4 * model.vertices(), 0.0);
}

void WindLoad::begin(const PointVector& shape, const PointVector& origin, const Eigen::Matrix3Xd& v,
                     const Eigen::Vector3d& wind, double h, PointVector& force)
{
  const bool plates = drag_factor_ > 0 || lift_factor_ > 0;
  std::fill(drag_.begin(), drag_.end(), Eigen::Matrix3d::Zero());
  for (Eigen::Index f = 0; f < model_.rest.triangles.cols(); ++f)
  {
    const Eigen::Vector3i t = model_.rest.triangles.col(f);
    const Eigen::Vector3d area = areaVector(shape, t);
    const double size = area.norm();
    if (!(size > 0))
      continue;
    const Eigen::Matrix3d drag = model_.wind_coefficient / (3.0 * h * size) * area * area.transpose();
    for (int k = 0; k < 3; ++k)
      drag_[t[k]] += drag;
    if (!plates)
      continue;
    const Eigen::Vector3d n = area / size;
    const Eigen::Matrix3d nn = n * n.transpose();
    for (int k = 0; k < 3; ++k)
    {
      const Eigen::Vector3d u = wind - v.col(t[k]);
      const PlateForce plate(drag_factor_, lift_factor_, u, n);
      const Eigen::Matrix3d slope = size / 3.0 *
                                    (std::max(plate.along, 0.0) * Eigen::Matrix3d::Identity() +
                                     (drag_factor_ * std::abs(plate.across) + lift_factor_ * plate.speed) * nn);
      drag_[t[k]] += slope / h;
      point(force, t[k]) += size / 3.0 * (plate.along * u + plate.normal * n) - slope * u;
    }
  }
  for (int i = 0; i < model_.vertices(); ++i)
    point(target_, i) = point(origin, i) + h * wind;
}

void WindLoad::setPattern(const BlockMatrix& matrix)
{
  diagonal_.assign(matrix.starts().begin(), matrix.starts().end() - 1);
}

double WindLoad::potential(std::size_t vertex, const double* x) const
{
  const Eigen::Vector3d past = Eigen::Map<const Eigen::Vector3d>(x) - point(target_, static_cast<Eigen::Index>(vertex));
  return 0.5 * past.dot(drag_[vertex] * past);
}

double WindLoad::value(const double* x) const
{
  double sum = 0.0;
  for (std::size_t i = 0; i < drag_.size(); ++i)
    sum += potential(i, x + 4 * i);
  return sum;
}

double WindLoad::addGradient(const double* x, double* gradient) const
{
  double sum = 0.0;
  for (std::size_t i = 0; i < drag_.size(); ++i)
  {
    const Eigen::Vector3d past =
        Eigen::Map<const Eigen::Vector3d>(x + 4 * i) - point(target_, static_cast<Eigen::Index>(i));
    const Eigen::Vector3d drag = drag_[i] * past;
    Eigen::Map<Eigen::Vector3d>(gradient + 4 * i) += drag;
    sum += 0.5 * past.dot(drag);
  }
  return sum;
}

void WindLoad::addHessian(double* values) const
{
  for (std::size_t i = 0; i < drag_.size(); ++i)
    Eigen::Map<Eigen::Matrix3d>(values + 9 * static_cast<std::size_t>(diagonal_[i])) += drag_[i];
}

double WindLoad::work(const PointVector& from, const PointVector& to, const std::vector<char>& held) const
{
  double sum = 0.0;
  for (std::size_t i = 0; i < drag_.size(); ++i)
    if (!held[i])
      sum += potential(i, from.data() + 4 * i) - potential(i, to.data() + 4 * i);
  return sum;
}

void WindLoad::addForces(const PointVector& x, const PointVector& v, const Eigen::Vector3d& wind,
                         PointVector& force) const
{
  for (Eigen::Index f = 0; f < model_.rest.triangles.cols(); ++f)
  {
    const Eigen::Vector3i t = model_.rest.triangles.col(f);
    const Eigen::Vector3d area = areaVector(x, t);
    const double size = area.norm();
    for (int k = 0; k < 3 && size > 0; ++k)
    {
      const Eigen::Vector3d u = wind - point(v, t[k]), n = area / size;
      const PlateForce plate(drag_factor_, lift_factor_, u, n);
      point(force, t[k]) += size / 3.0 * (plate.along * u + (model_.wind_coefficient * n.dot(u) + plate.normal) * n);
    }
  }
}

}   // namespace slender
