#include "picture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "object_colors.h"
#include "slender_sim/geometry/mesh_offsets.h"

namespace slender {

using Eigen::Vector3d;

namespace {

constexpr int kSuper = 2;            // samples per pixel and direction
constexpr int kShadowCells = 1536;
constexpr double kTanHalfHeight = 0.3;

/// Calls put(column, row, b, c) for the cells whose middles lie in a triangle of the plane.
template <class Put>
void fill(const Eigen::Vector2d& p0, const Eigen::Vector2d& p1, const Eigen::Vector2d& p2, int width, int height, const Put& put)
{
  const double area = (p1 - p0).x() * (p2 - p0).y() - (p1 - p0).y() * (p2 - p0).x();
  if (!(std::abs(area) > 1e-12))
    return;
  const auto bound = [](double v, int high) { return static_cast<int>(std::clamp(v, 0.0, static_cast<double>(high))); };
  const int left = bound(std::floor(std::min({p0.x(), p1.x(), p2.x()})), width), right = bound(std::ceil(std::max({p0.x(), p1.x(), p2.x()})), width);
  const int top = bound(std::floor(std::min({p0.y(), p1.y(), p2.y()})), height), bottom = bound(std::ceil(std::max({p0.y(), p1.y(), p2.y()})), height);
  for (int row = top; row < bottom; ++row)
    for (int column = left; column < right; ++column)
    {
      const Eigen::Vector2d d(column + 0.5 - p0.x(), row + 0.5 - p0.y());
      const double b = (d.x() * (p2 - p0).y() - d.y() * (p2 - p0).x()) / area, c = ((p1 - p0).x() * d.y() - (p1 - p0).y() * d.x()) / area;
      if (b >= 0 && c >= 0 && b + c <= 1)
        put(column, row, b, c);
    }
}

/// Grey: videos keep hues coarsely, and show stripes in a faint gradient of them.
Vector3d skyColor(double height) { return Vector3d::Constant(0.95 - 0.20 * std::clamp(height, 0.0, 1.0)); }

}  // namespace

PicturePainter::PicturePainter(const PictureView& view) : view_(view), width_(kSuper * view.width), height_(kSuper * view.height)
{
  forward_ = -view.from.normalized();
  right_ = std::abs(forward_.z()) > 0.999 ? Vector3d(1, 0, 0) : Vector3d(forward_.cross(Vector3d::UnitZ()).normalized());
  up_ = right_.cross(forward_);
  scale_ = 0.5 * height_ / kTanHalfHeight;
  const double tan_width = kTanHalfHeight * width_ / height_, margin = 0.9;
  const Vector3d middle = view.box.center();
  double distance = 0.0;
  for (int k = 0; k < 8; ++k)
  {
    const Vector3d corner = view.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(k)) - middle;
    distance = std::max({distance, std::abs(right_.dot(corner)) / (margin * tan_width) - forward_.dot(corner),
                         std::abs(up_.dot(corner)) / (margin * kTanHalfHeight) - forward_.dot(corner)});
  }
  eye_ = middle - std::max(distance, 1e-6) * forward_;
  sun_ = (0.55 * right_ - 0.75 * forward_ + 1.3 * Vector3d::UnitZ()).normalized();
  const Vector3d across = sun_.cross(std::abs(sun_.z()) > 0.9 ? Vector3d(Vector3d::UnitX()) : Vector3d(Vector3d::UnitZ())).normalized();
  sun_axes_.row(0) = across;
  sun_axes_.row(1) = sun_.cross(across);
  sun_axes_.row(2) = sun_;
  samples_.resize(static_cast<std::size_t>(width_) * height_);
  shadow_.resize(static_cast<std::size_t>(kShadowCells) * kShadowCells);
  const double reach = 1.05 * view.box.diagonal().norm() + 1e-9;
  sun_scale_ = kShadowCells / reach;
  sun_corner_ = sun_axes_ * middle - Vector3d(0.5 * reach, 0.5 * reach, 0);
}

void PicturePainter::draw(const std::vector<ObjectMesh>& objects)
{
  std::fill(samples_.begin(), samples_.end(), Sample{0, -1, -1, 0, 0});
  const double nearest = 1e-3 * view_.box.diagonal().norm();
  for (std::size_t k = 0; k < objects.size(); ++k)
  {
    const TriangleMesh& mesh = objects[k].mesh;
    Eigen::Matrix3Xd seen(3, mesh.vertices.cols());   // column, row, 1 / distance (negative: behind the eye)
    for (Eigen::Index i = 0; i < seen.cols(); ++i)
    {
      const Vector3d d = mesh.vertices.col(i) - eye_;
      const double depth = forward_.dot(d);
      seen.col(i) << 0.5 * width_ + scale_ * right_.dot(d) / depth, 0.5 * height_ - scale_ * up_.dot(d) / depth, depth > nearest ? 1.0 / depth : -1.0;
    }
    for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
    {
      const Vector3d a = seen.col(mesh.triangles(0, f)), b = seen.col(mesh.triangles(1, f)), c = seen.col(mesh.triangles(2, f));
      if (!(a.z() > 0 && b.z() > 0 && c.z() > 0))
        continue;
      fill(a.head<2>(), b.head<2>(), c.head<2>(), width_, height_, [&](int column, int row, double share_b, double share_c) {
        const double inverse = (1 - share_b - share_c) * a.z() + share_b * b.z() + share_c * c.z();
        Sample& sample = samples_[static_cast<std::size_t>(row) * width_ + column];
        if (inverse > sample.depth)   // shares as on the surface, not on the picture
          sample = {static_cast<float>(inverse), static_cast<std::int32_t>(k), static_cast<std::int32_t>(f),
                    static_cast<float>(share_b * b.z() / inverse), static_cast<float>(share_c * c.z() / inverse)};
      });
    }
  }
}

void PicturePainter::drawShadows(const std::vector<ObjectMesh>& objects)
{
  std::fill(shadow_.begin(), shadow_.end(), -std::numeric_limits<float>::infinity());
  for (const ObjectMesh& object : objects)
  {
    Eigen::Matrix3Xd seen = (sun_axes_ * object.mesh.vertices).colwise() - sun_corner_;
    seen.topRows<2>() *= sun_scale_;
    for (Eigen::Index f = 0; f < object.mesh.triangles.cols(); ++f)
    {
      const Vector3d a = seen.col(object.mesh.triangles(0, f)), b = seen.col(object.mesh.triangles(1, f)), c = seen.col(object.mesh.triangles(2, f));
      fill(a.head<2>(), b.head<2>(), c.head<2>(), kShadowCells, kShadowCells, [&](int column, int row, double share_b, double share_c) {
        float& height = shadow_[static_cast<std::size_t>(row) * kShadowCells + column];
        height = std::max(height, static_cast<float>((1 - share_b - share_c) * a.z() + share_b * b.z() + share_c * c.z()));
      });
    }
  }
}

/// Share of the sun that reaches a point.
double PicturePainter::lit(const Vector3d& x, double bias) const
{
  const Vector3d at = sun_axes_ * x - sun_corner_;
  const int column = static_cast<int>(std::floor(at.x() * sun_scale_)), row = static_cast<int>(std::floor(at.y() * sun_scale_));
  int free = 0, all = 0;
  for (int r = row - 1; r <= row + 1; ++r)
    for (int c = column - 1; c <= column + 1; ++c, ++all)
      free += r < 0 || c < 0 || r >= kShadowCells || c >= kShadowCells ||
              shadow_[static_cast<std::size_t>(r) * kShadowCells + c] <= at.z() + bias;
  return static_cast<double>(free) / all;
}

Vector3d PicturePainter::shade(const ObjectMesh& object, const Eigen::Matrix3Xd& normals, const Sample& sample) const
{
  const Eigen::Vector3i t = object.mesh.triangles.col(sample.triangle);
  const Vector3d a = object.mesh.vertices.col(t[0]), b = object.mesh.vertices.col(t[1]), c = object.mesh.vertices.col(t[2]);
  const Vector3d face = (b - a).cross(c - a).normalized(), x = a + sample.b * (b - a) + sample.c * (c - a);
  const auto normalAt = [&](int vertex) -> Vector3d {   // edges of solids and ends of tubes stay sharp
    const Vector3d normal = normals.col(vertex);
    return object.kind == ObjectKind::cloth || normal.dot(face) > 0.75 ? normal : face;
  };
  Vector3d normal = ((1 - sample.b - sample.c) * normalAt(t[0]) + sample.b * normalAt(t[1]) + sample.c * normalAt(t[2])).normalized();
  const Vector3d to_eye = (eye_ - x).normalized();
  if (normal.dot(to_eye) < 0 && face.dot(to_eye) < 0)   // the back of a cloth
    normal = -normal;
  Vector3d paint = objectColor(object.kind, object.index);
  const Eigen::Index walls = object.mesh.triangles.cols() - 2 * view_.tube_sides;
  if (object.kind == ObjectKind::rod && (sample.triangle < walls || object.mesh.vertices.cols() % view_.tube_sides == 0) &&
      (sample.triangle / 2) % view_.tube_sides % (view_.tube_sides / 2) <= 1)
    paint = {0.20, 0.24, 0.30};
  const double slope = std::sqrt(1 / std::max(0.01, face.dot(sun_) * face.dot(sun_)) - 1);   // how much higher the next cell is
  const double bias = (1 + 2.2 * slope) / sun_scale_;
  const double direct = std::max(0.0, normal.dot(sun_)) * lit(x, bias), sky = 0.5 + 0.5 * normal.z();
  const Vector3d half = (sun_ + to_eye).normalized();
  const double gloss = object.kind == ObjectKind::cloth ? 0.0 : 0.3 * std::pow(std::max(0.0, normal.dot(half)), 40.0) * (direct > 0);
  return paint * (0.38 + 0.17 * sky + 0.55 * direct) + Vector3d::Constant(gloss);
}

Vector3d PicturePainter::background(int row, int column) const
{
  const Vector3d ray = forward_ + (column + 0.5 - 0.5 * width_) / scale_ * right_ + (0.5 * height_ - row - 0.5) / scale_ * up_;
  const Vector3d sky = skyColor(1.0 - static_cast<double>(row) / height_);
  if (!view_.ground || ray.z() >= -1e-6 || eye_.z() <= *view_.ground)
    return sky;
  const double along = (*view_.ground - eye_.z()) / ray.z(), size = view_.box.diagonal().norm();
  const Vector3d x = eye_ + along * ray;
  const double fade = std::clamp(1.6 - 0.5 * (x - view_.box.center()).norm() / size, 0.0, 1.0);
  const double cell = std::pow(10.0, std::floor(std::log10(size))) * 0.5;
  const bool odd = (static_cast<long>(std::floor(x.x() / cell)) + static_cast<long>(std::floor(x.y() / cell))) & 1;
  const Vector3d floor = Vector3d(0.80, 0.80, 0.79) * (odd ? 0.96 : 1.0) * (0.62 + 0.38 * lit(x, 2.0 / sun_scale_));
  return fade * floor + (1 - fade) * sky;
}

std::vector<std::uint8_t> PicturePainter::paint(const std::vector<ObjectMesh>& objects)
{
  draw(objects);
  drawShadows(objects);
  std::vector<Eigen::Matrix3Xd> normals;
  for (const ObjectMesh& object : objects)
    normals.push_back(vertexNormals(object.mesh));
  // a floor hides what is below it, but for what sinks in a little
  const bool floor = view_.ground && eye_.z() > *view_.ground;
  const double below = floor ? *view_.ground - 0.004 * view_.box.diagonal().norm() : -std::numeric_limits<double>::infinity();
  std::vector<std::uint8_t> out;
  out.reserve(3u * view_.width * view_.height);
  for (int y = 0; y < view_.height; ++y)
    for (int x = 0; x < view_.width; ++x)
    {
      Vector3d sum = Vector3d::Zero();
      for (int row = kSuper * y; row < kSuper * (y + 1); ++row)
        for (int column = kSuper * x; column < kSuper * (x + 1); ++column)
        {
          const Sample& sample = samples_[static_cast<std::size_t>(row) * width_ + column];
          bool hidden = sample.object < 0;
          if (!hidden)
          {
            const TriangleMesh& mesh = objects[sample.object].mesh;
            const auto height = [&](int corner) { return mesh.vertices(2, mesh.triangles(corner, sample.triangle)); };
            hidden = (1 - sample.b - sample.c) * height(0) + sample.b * height(1) + sample.c * height(2) < below;
          }
          sum += (hidden ? background(row, column) : shade(objects[sample.object], normals[sample.object], sample)).cwiseMin(1.0);
        }
      for (int c = 0; c < 3; ++c)
        out.push_back(static_cast<std::uint8_t>(255.0 * sum[c] / (kSuper * kSuper) + 0.5));
    }
  return out;
}

}  // namespace slender
