#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "slender_sim/contact/intersection.h"
#include "contact/impulses/surface_collider.h"

namespace slender::test {

/// Sheets that fly and keep their edges' lengths about: the least that gives collisions something to do.
struct Sheets
{
  CollisionSurface surface;
  Eigen::Matrix3Xd x, v;
  Eigen::VectorXd inverse_mass;
  std::vector<Pose> solids, solids_before;
  Eigen::Vector3d gravity{0, 0, 0};

  /// A grid of (nu + 1)(nv + 1) points on corner + [0, 1] u + [0, 1] v; returns its first point.
  int add(int nu, int nv, const Eigen::Vector3d& corner, const Eigen::Vector3d& u, const Eigen::Vector3d& w,
          double thickness = 4e-3, double friction = 0.3)
  {
    const int first = static_cast<int>(x.cols()), count = (nu + 1) * (nv + 1);
    x.conservativeResize(3, first + count);
    v.conservativeResize(3, first + count);
    inverse_mass.conservativeResize(first + count);
    const auto at = [&](int i, int j) { return first + i * (nv + 1) + j; };
    for (int i = 0; i <= nu; ++i)
      for (int j = 0; j <= nv; ++j)
      {
        x.col(at(i, j)) = corner + u * i / nu + w * j / nv;
        v.col(at(i, j)).setZero();
        inverse_mass[at(i, j)] = nu * nv / (0.2 * u.norm() * w.norm());
      }
    CollisionSheet sheet;
    sheet.thickness = thickness;
    sheet.friction = friction;
    sheet.triangles.resize(3, 2 * nu * nv);
    for (int i = 0; i < nu; ++i)
      for (int j = 0; j < nv; ++j)
      {
        const bool turned = (i + j) % 2;
        sheet.triangles.col(2 * (i * nv + j)) << at(i, j), at(i + 1, j), turned ? at(i, j + 1) : at(i + 1, j + 1);
        sheet.triangles.col(2 * (i * nv + j) + 1) << (turned ? at(i + 1, j) : at(i, j)), at(i + 1, j + 1), at(i, j + 1);
      }
    surface.sheets.push_back(sheet);
    surface.rest = x;
    return first;
  }

  void addSolid(const Shape& shape, const Pose& pose = {}, double friction = -1.0)
  {
    surface.solids.push_back({shape, friction, {}});
    solids.push_back(pose);
    solids_before = solids;
  }

  /// The end of a step of ballistic motion and a few projections of edges to their lengths at rest.
  Eigen::Matrix3Xd candidate(double h) const
  {
    Eigen::Matrix3Xd y = x;
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      y.col(i) += h * v.col(i) + (inverse_mass[i] > 0.0 ? h * h : 0.0) * gravity;
    for (int k = 0; k < 10; ++k)
      for (const CollisionSheet& s : surface.sheets)
        for (Eigen::Index t = 0; t < s.triangles.cols(); ++t)
          for (int c = 0; c < 3; ++c)
          {
            const int a = s.triangles(c, t), b = s.triangles((c + 1) % 3, t);
            const Eigen::Vector3d e = y.col(b) - y.col(a);
            const double length = e.norm(), w = inverse_mass[a] + inverse_mass[b];
            if (!(w > 0.0) || !(length > 0.0))
              continue;
            const Eigen::Vector3d move =
                0.5 * (1.0 - (surface.rest.col(b) - surface.rest.col(a)).norm() / length) / w * e;
            y.col(a) += inverse_mass[a] * move;
            y.col(b) -= inverse_mass[b] * move;
          }
    return y;
  }

  CollisionReport step(SurfaceCollider& collider, double h)
  {
    Eigen::Matrix3Xd y = candidate(h), w = (y - x) / h;
    const CollisionReport report = collider.resolve({x, inverse_mass, solids_before, solids, h}, y, w);
    if (report.ok)
    {
      x = y;
      v = w;
      solids_before = solids;
    }
    return report;
  }

  std::size_t intersectionCount() const { return intersections(surface, x, solids_before).size(); }
  Eigen::Vector3d momentum() const
  {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      p += v.col(i) / inverse_mass[i];
    return p;
  }
  Eigen::Vector3d angularMomentum() const
  {
    Eigen::Vector3d l = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      l += Eigen::Vector3d(x.col(i)).cross(Eigen::Vector3d(v.col(i))) / inverse_mass[i];
    return l;
  }
  double energy() const
  {
    double e = 0.0;
    for (Eigen::Index i = 0; i < x.cols(); ++i)
      e += 0.5 * v.col(i).squaredNorm() / inverse_mass[i];
    return e;
  }
};

}   // namespace slender::test
