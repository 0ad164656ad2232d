#include "wind_load.h"

#include <algorithm>

#include <Eigen/Geometry>

namespace slender {

namespace {

Eigen::Vector3d areaVector(const PointVector& x, const Eigen::Vector3i& t)
{
  const Eigen::Vector3d origin = point(x, t[0]);
  return 0.5 * (point(x, t[1]) - origin).cross(point(x, t[2]) - origin);
}

}  // namespace

WindLoad::WindLoad(const ClothModel& model) : model_(model)
{
  if (model.wind_coefficient > 0)
  {
    drag_.assign(model.vertices(), Eigen::Matrix3d::Zero());
    target_.assign(4 * model.vertices(), 0.0);
  }
}

void WindLoad::begin(const PointVector& start, const PointVector& origin, const Eigen::Vector3d& wind, double h)
{
  std::fill(drag_.begin(), drag_.end(), Eigen::Matrix3d::Zero());
  for (Eigen::Index f = 0; f < model_.rest.triangles.cols(); ++f)
  {
    const Eigen::Vector3i t = model_.rest.triangles.col(f);
    const Eigen::Vector3d area = areaVector(start, t);
    const double size = area.norm();
    if (!(size > 0))
      continue;
    const Eigen::Matrix3d drag = model_.wind_coefficient / (3.0 * h * size) * area * area.transpose();
    for (int k = 0; k < 3; ++k)
      drag_[t[k]] += drag;
  }
  for (int i = 0; i < model_.vertices(); ++i)
    point(target_, i) = point(origin, i) + h * wind;
}

double WindLoad::addGradient(int vertex, const Eigen::Vector3d& x, Eigen::Vector3d& slope) const
{
  const Eigen::Vector3d past = x - point(target_, vertex), drag = drag_[vertex] * past;
  slope += drag;
  return 0.5 * past.dot(drag);
}

void WindLoad::addHessian(BlockMatrix& matrix) const
{
  for (std::size_t i = 0; i < drag_.size(); ++i)
    Eigen::Map<Eigen::Matrix3d>(matrix.values() + 9 * matrix.starts()[i]) += drag_[i];
}

void WindLoad::addForces(const PointVector& x, const PointVector& v, const Eigen::Vector3d& wind, PointVector& force) const
{
  for (Eigen::Index f = 0; f < model_.rest.triangles.cols(); ++f)
  {
    const Eigen::Vector3i t = model_.rest.triangles.col(f);
    const Eigen::Vector3d area = areaVector(x, t);
    const double size = area.norm();
    for (int k = 0; k < 3 && size > 0; ++k)
      point(force, t[k]) += model_.wind_coefficient / (3.0 * size) * area.dot(wind - point(v, t[k])) * area;
  }
}

}  // namespace slender
