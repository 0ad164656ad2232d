// Overlap of solids, by FCL: independent of the contact that it checks.
#include "solid_overlap.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/math/bv/OBBRSS.h>
#include <fcl/narrowphase/collision.h>

namespace slender::study {

namespace {

using Eigen::Vector3d;
using Mesh = std::shared_ptr<const TriangleMesh>;

constexpr double kDeepest = 1e-6;   // [m] FCL's own tolerance
// Cylinders touch solids as prisms of 64 sides (docs/contact.md), whose sides are nearer to the axis by this factor.
const double kPrism = std::cos(M_PI / 64);

/// Lowest coordinate along a normal.
double lowest(const Shape& shape, const Pose& pose, const Vector3d& normal)
{
  const Vector3d n = pose.orientation.conjugate() * normal;
  double below = 0.0;
  if (const auto* sphere = std::get_if<Sphere>(&shape))
    below = sphere->radius;
  if (const auto* box = std::get_if<Box>(&shape))
    below = 0.5 * box->size.dot(n.cwiseAbs());
  if (const auto* capsule = std::get_if<Capsule>(&shape))
    below = capsule->radius + 0.5 * capsule->length * std::abs(n.z());
  if (const auto* cylinder = std::get_if<Cylinder>(&shape))
    below = kPrism * cylinder->radius * n.head<2>().norm() + 0.5 * cylinder->length * std::abs(n.z());
  if (const auto* mesh = std::get_if<Mesh>(&shape))
    below = -(n.transpose() * (*mesh)->vertices).minCoeff();
  return pose.position.dot(normal) - below;
}

/// The solid a little smaller: FCL's tests of shapes that nearly touch may go either way.
std::shared_ptr<fcl::CollisionGeometryd> geometryOf(const Shape& shape)
{
  constexpr double kLess = 2.0 * kDeepest;
  if (const auto* sphere = std::get_if<Sphere>(&shape))
    return std::make_shared<fcl::Sphered>(sphere->radius - kDeepest);
  if (const auto* box = std::get_if<Box>(&shape))
    return std::make_shared<fcl::Boxd>(box->size.x() - kLess, box->size.y() - kLess, box->size.z() - kLess);
  if (const auto* capsule = std::get_if<Capsule>(&shape))
    return std::make_shared<fcl::Capsuled>(capsule->radius - kDeepest, capsule->length);
  if (const auto* cylinder = std::get_if<Cylinder>(&shape))
    return std::make_shared<fcl::Cylinderd>(kPrism * cylinder->radius - kDeepest, cylinder->length - kLess);
  const TriangleMesh& mesh = *std::get<Mesh>(shape);
  const auto model = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  model->beginModel();
  for (Eigen::Index i = 0; i < mesh.triangles.cols(); ++i)
    model->addTriangle(mesh.vertices.col(mesh.triangles(0, i)), mesh.vertices.col(mesh.triangles(1, i)),
                       mesh.vertices.col(mesh.triangles(2, i)));
  model->endModel();
  return model;
}

fcl::Transform3d transformOf(const Pose& pose)
{
  fcl::Transform3d transform = fcl::Transform3d::Identity();
  transform.linear() = pose.orientation.toRotationMatrix();
  transform.translation() = pose.position;
  return transform;
}

bool isInside(const Shape& mesh, const Pose& pose, const Vector3d& p)
{
  const auto* m = std::get_if<Mesh>(&mesh);
  return m && isInsideMesh(**m, pose.inverse() * p);
}

}   // namespace

bool overlap(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b)
{
  if (std::holds_alternative<Plane>(a))
  {
    const Vector3d normal = pose_a.orientation * Vector3d::UnitZ();
    return !std::holds_alternative<Plane>(b) && lowest(b, pose_b, normal) < pose_a.position.dot(normal) - kDeepest;
  }
  if (std::holds_alternative<Plane>(b))
    return overlap(b, pose_b, a, pose_a);
  if (isInside(a, pose_a, pose_b.position) || isInside(b, pose_b, pose_a.position))
    return true;
  fcl::CollisionObjectd first(geometryOf(a), transformOf(pose_a)), second(geometryOf(b), transformOf(pose_b));
  fcl::CollisionResultd result;
  return fcl::collide(&first, &second, fcl::CollisionRequestd(), result) > 0;
}

double solidAngle(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xi& triangles, const Vector3d& p)
{
  double sum = 0.0;
  for (Eigen::Index t = 0; t < triangles.cols(); ++t)
  {
    const Vector3d a = x.col(triangles(0, t)) - p, b = x.col(triangles(1, t)) - p, c = x.col(triangles(2, t)) - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += 2.0 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum;
}

bool isInsideMesh(const TriangleMesh& mesh, const Vector3d& p)
{
  return std::abs(solidAngle(mesh.vertices, mesh.triangles, p)) > 2.0 * M_PI;
}

}   // namespace slender::study
