#include "picture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "object_colors.h"
#include "slender_sim/geometry/mesh_offsets.h"

namespace slender {

using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

constexpr int kSuper = 2;   // samples per pixel and direction
constexpr int kShadowCells = 1536;
constexpr double kTanHalfHeight = 0.3;
constexpr double kFilled = 0.9;     // share of the picture, in the direction in which objects fill more of it
constexpr double kNearest = 0.25;   // least distance of the eye, as a share of the depth of what is seen
constexpr float kNeverLit = -std::numeric_limits<float>::infinity();

/// Grey: videos keep hues coarsely, and show stripes in a faint gradient of them.
Vector3d skyColor(double height) { return Vector3d::Constant(0.95 - 0.20 * std::clamp(height, 0.0, 1.0)); }

bool isTube(ObjectKind kind) { return kind == ObjectKind::rod || kind == ObjectKind::thread; }

std::uint8_t toByte(float share) { return static_cast<std::uint8_t>(255.0f * std::clamp(share, 0.0f, 1.0f) + 0.5f); }

}   // namespace

EyeFinder::EyeFinder(const Vector3d& from, int width, int height)
  : forward_(-from.normalized()),
    tan_width_(kFilled * kTanHalfHeight * width / height),
    tan_height_(kFilled * kTanHalfHeight),
    reach_(decltype(reach_)::Constant(-std::numeric_limits<double>::infinity()))
{
  right_ =
      std::abs(forward_.z()) > 0.999 ? Vector3d(1, 0, 0) : Vector3d(forward_.cross(Vector3d::UnitZ()).normalized());
  up_ = right_.cross(forward_);
  planes_.row(0) = right_ - tan_width_ * forward_;
  planes_.row(1) = -right_ - tan_width_ * forward_;
  planes_.row(2) = up_ - tan_height_ * forward_;
  planes_.row(3) = -up_ - tan_height_ * forward_;
  planes_.row(4) = forward_;
  planes_.row(5) = -forward_;
}

void EyeFinder::add(const Eigen::Matrix3Xd& points, double radius)
{
  const Eigen::Matrix<double, 6, 1> farthest = (planes_ * points).rowwise().maxCoeff();
  reach_ = reach_.cwiseMax(farthest + radius * planes_.rowwise().norm());
}

/// A point p is left of the right border of the picture if n p <= n e, where e is the eye and n the border's normal
/// `right - tan forward`; likewise for the other borders. Opposite borders say where the eye is across, and how far it
/// is forward at most. A point that is far in front of the others must not touch the eye.
Vector3d EyeFinder::eye() const
{
  const double across = 0.5 * (reach_[0] - reach_[1]), along = 0.5 * (reach_[2] - reach_[3]);
  const double free = kNearest * (reach_[4] + reach_[5]) + 1e-6;   // [m]; the micrometre is for a single point
  const double forward = std::min(
      {-0.5 * (reach_[0] + reach_[1]) / tan_width_, -0.5 * (reach_[2] + reach_[3]) / tan_height_, -reach_[5] - free});
  return across * right_ + along * up_ + forward * forward_;
}

PicturePainter::PicturePainter(const PictureView& view)
  : view_(view),
    width_(kSuper * view.width),
    height_(kSuper * view.height),
    samples_(width_, height_, 0.0f),
    shadow_(kShadowCells, kShadowCells, kNeverLit),
    triangles_(static_cast<std::size_t>(width_) * height_)
{
  placeCamera();
  sun_ = (0.55 * right_ - 0.75 * forward_ + 1.3 * Vector3d::UnitZ()).normalized();
  const Vector3d across =
      sun_.cross(std::abs(sun_.z()) > 0.9 ? Vector3d(Vector3d::UnitX()) : Vector3d(Vector3d::UnitZ())).normalized();
  sun_axes_.row(0) = across;
  sun_axes_.row(1) = sun_.cross(across);
  sun_axes_.row(2) = sun_;
  const double reach = 1.05 * view.box.diagonal().norm() + 1e-9;
  sun_scale_ = kShadowCells / reach;
  sun_corner_ = sun_axes_ * view.box.center() - Vector3d(0.5 * reach, 0.5 * reach, 0);
  paintBackground();
}

void PicturePainter::placeCamera()
{
  EyeFinder finder(view_.from, width_, height_);
  forward_ = finder.forward();
  right_ = finder.right();
  up_ = finder.up();
  scale_ = 0.5 * height_ / kTanHalfHeight;
  Eigen::Matrix3Xd corners(3, 8);
  for (int k = 0; k < 8; ++k)
    corners.col(k) = view_.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(k));
  finder.add(corners);
  eye_ = view_.eye.value_or(finder.eye());
}

/// From the eye through a sample to the plane at distance 1 along the view.
Vector3d PicturePainter::ray(int column, int row) const
{
  return forward_ + (column + 0.5 - 0.5 * width_) / scale_ * right_ + (0.5 * height_ - row - 0.5) / scale_ * up_;
}

/// The sky, and the floor in the sun.
void PicturePainter::paintBackground()
{
  const bool floor = view_.ground && eye_.z() > *view_.ground;
  const double size = view_.box.diagonal().norm(), cell = std::pow(10.0, std::floor(std::log10(size))) * 0.5;
  for (int y = 0; y < view_.height; ++y)
    for (int x = 0; x < view_.width; ++x)
    {
      Vector3d sum = Vector3d::Zero(), drop = Vector3d::Zero(), where = Vector3d::Zero();
      int on_floor = 0;
      for (int row = kSuper * y; row < kSuper * (y + 1); ++row)
        for (int column = kSuper * x; column < kSuper * (x + 1); ++column)
        {
          const Vector3d along = ray(column, row);
          const Vector3d sky = skyColor(1.0 - static_cast<double>(row) / height_);
          if (!floor || along.z() >= -1e-6)
          {
            sum += sky;
            continue;
          }
          const Vector3d at = eye_ + (*view_.ground - eye_.z()) / along.z() * along;
          const double fade = std::clamp(1.6 - 0.5 * (at - view_.box.center()).norm() / size, 0.0, 1.0);
          const bool odd =
              (static_cast<long>(std::floor(at.x() / cell)) + static_cast<long>(std::floor(at.y() / cell))) & 1;
          const Vector3d paint = Vector3d(0.80, 0.80, 0.79) * (odd ? 0.96 : 1.0);
          sum += fade * paint + (1 - fade) * sky;
          drop += 0.38 * fade * paint;
          where += at;
          ++on_floor;
        }
      const std::uint32_t pixel = static_cast<std::uint32_t>(background_.size() / 3);
      for (int c = 0; c < 3; ++c)
        background_.push_back(toByte(static_cast<float>(sum[c]) / (kSuper * kSuper)));
      if (on_floor == 0)
        continue;
      const Vector3d at = sun_axes_ * (where / on_floor) - sun_corner_;
      const double column = std::floor(at.x() * sun_scale_), row = std::floor(at.y() * sun_scale_);
      if (column < -1 || row < -1 || column > kShadowCells || row > kShadowCells)
        continue;   // no shadow reaches there
      const Vector3f share = drop.cast<float>() * 255.0f / (kSuper * kSuper);
      ground_.push_back({pixel,
                         static_cast<std::int16_t>(column),
                         static_cast<std::int16_t>(row),
                         static_cast<float>(at.z() + 2.0 / sun_scale_),
                         {share[0], share[1], share[2]}});
    }
}

void PicturePainter::draw(const std::vector<ObjectMesh>& objects)
{
  samples_.clear();
  parts_.clear();
  faces_.clear();
  const double nearest = 1e-3 * view_.box.diagonal().norm();
  // a floor hides what is below it, but for what sinks in a little
  const bool floor = view_.ground && eye_.z() > *view_.ground;
  const double below =
      floor ? *view_.ground - 0.004 * view_.box.diagonal().norm() : -std::numeric_limits<double>::infinity();
  std::uint32_t count = 0;
  for (const ObjectMesh& object : objects)
  {
    const TriangleMesh& mesh = object.mesh;
    Eigen::Matrix3Xd seen(3, mesh.vertices.cols());
    for (Eigen::Index i = 0; i < seen.cols(); ++i)
    {
      const Vector3d d = mesh.vertices.col(i) - eye_;
      const double depth = forward_.dot(d);
      seen.col(i) << 0.5 * width_ + scale_ * right_.dot(d) / depth, 0.5 * height_ - scale_ * up_.dot(d) / depth,
          depth > nearest ? 1.0 / depth : -1.0;
    }
    for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f)
    {
      const Eigen::Vector3i t = mesh.triangles.col(f);
      const Vector3d a = seen.col(t[0]), b = seen.col(t[1]), c = seen.col(t[2]);
      if (!(a.z() > 0 && b.z() > 0 && c.z() > 0))
        continue;
      if (isTube(object.kind) && (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x() > 0)
        continue;   // the far side of a tube
      const std::uint32_t triangle = count + static_cast<std::uint32_t>(f);
      const bool sinks = std::min({mesh.vertices(2, t[0]), mesh.vertices(2, t[1]), mesh.vertices(2, t[2])}) < below;
      samples_.fill(a, b, c, [&](int row, int first, int end, float inverse, float slope) {
        float* const depths = &samples_.at(0, row);
        std::uint32_t* const triangles = &triangles_[static_cast<std::size_t>(row) * width_];
        for (int column = first; column < end; ++column, inverse += slope)
          if (inverse > depths[column] && !(sinks && eye_.z() + ray(column, row).z() / inverse < below))
          {
            depths[column] = inverse;
            triangles[column] = triangle;
          }
      });
    }
    parts_.push_back({count, std::move(seen), vertexNormals(mesh)});
    count += static_cast<std::uint32_t>(mesh.triangles.cols());
  }
  face_of_.assign(count, -1);
}

void PicturePainter::drawShadows(const std::vector<ObjectMesh>& objects)
{
  shadow_.clear();
  for (const ObjectMesh& object : objects)
  {
    Eigen::Matrix3Xd seen = (sun_axes_ * object.mesh.vertices).colwise() - sun_corner_;
    seen.topRows<2>() *= sun_scale_;
    for (Eigen::Index f = 0; f < object.mesh.triangles.cols(); ++f)
    {
      const Vector3d a = seen.col(object.mesh.triangles(0, f)), b = seen.col(object.mesh.triangles(1, f)),
                     c = seen.col(object.mesh.triangles(2, f));
      if (isTube(object.kind) && (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x() < 0)
        continue;   // the dark side of a tube
      shadow_.fill(a, b, c, [&](int row, int first, int end, float height, float slope) {
        float* const heights = &shadow_.at(0, row);
        for (int column = first; column < end; ++column)
          heights[column] = std::max(heights[column], height + slope * static_cast<float>(column - first));
      });
    }
  }
}

/// Share of the sun that reaches a height above the cells around (column, row).
float PicturePainter::lit(int column, int row, float height) const
{
  if (!shadow_.isDrawn(column - 1, row - 1) && !shadow_.isDrawn(column + 1, row - 1) &&
      !shadow_.isDrawn(column - 1, row + 1) && !shadow_.isDrawn(column + 1, row + 1))
    return 1.0f;
  int free = 0;
  if (column > 0 && row > 0 && column + 1 < kShadowCells && row + 1 < kShadowCells)
    for (int r = row - 1; r <= row + 1; ++r)
      for (int c = column - 1; c <= column + 1; ++c)
        free += shadow_.at(c, r) <= height;
  else
    for (int r = row - 1; r <= row + 1; ++r)
      for (int c = column - 1; c <= column + 1; ++c)
        free += r < 0 || c < 0 || r >= kShadowCells || c >= kShadowCells || shadow_.at(c, r) <= height;
  return static_cast<float>(free) / 9.0f;
}

void PicturePainter::paintShadowsOnGround()
{
  for (const GroundPixel& ground : ground_)
  {
    const float dark = 1.0f - lit(ground.column, ground.row, ground.height);
    if (dark > 0)
      for (std::size_t c = 0; c < 3; ++c)
      {
        std::uint8_t& byte = out_[3 * ground.pixel + c];
        byte = static_cast<std::uint8_t>(std::max(0.0f, static_cast<float>(byte) - dark * ground.drop[c] + 0.5f));
      }
  }
}

PicturePainter::Face PicturePainter::faceOf(std::uint32_t triangle, const std::vector<ObjectMesh>& objects) const
{
  const auto after = std::upper_bound(parts_.begin(), parts_.end(), triangle,
                                      [](std::uint32_t t, const Part& part) { return t < part.first; });
  const Part& part = *(after - 1);
  const ObjectMesh& object = objects[static_cast<std::size_t>(&part - parts_.data())];
  const Eigen::Index index = triangle - part.first;
  const Eigen::Vector3i t = object.mesh.triangles.col(index);
  std::array<Vector3d, 3> x, seen;
  for (std::size_t k = 0; k < 3; ++k)
  {
    x[k] = object.mesh.vertices.col(t[static_cast<int>(k)]);
    seen[k] = part.seen.col(t[static_cast<int>(k)]);
  }
  Face face;
  face.p0 = seen[0].head<2>().cast<float>();
  face.u = (seen[1] - seen[0]).head<2>().cast<float>();
  face.v = (seen[2] - seen[0]).head<2>().cast<float>();
  face.inverse_area = 1.0f / (face.u.x() * face.v.y() - face.u.y() * face.v.x());
  const Vector3d flat = (x[1] - x[0]).cross(x[2] - x[0]).normalized();
  const double towards_sun = flat.dot(sun_);
  // how much higher the next cell is
  const double slope = std::sqrt(1 / std::max(0.01, towards_sun * towards_sun) - 1);
  face.bias = static_cast<float>((1 + 2.2 * slope) / sun_scale_);
  const bool cloth = object.kind == ObjectKind::cloth, back = flat.dot(eye_ - x[0]) < 0;
  for (std::size_t k = 0; k < 3; ++k)
  {
    Vector3d normal = part.normals.col(t[static_cast<int>(k)]);
    if (!cloth && normal.dot(flat) <= 0.75)   // edges of solids and ends of tubes stay sharp
      normal = flat;
    const Vector3d to_eye = (eye_ - x[k]).normalized();
    if (back)   // of a cloth
      normal = -normal;
    const double direct = std::max(0.0, normal.dot(sun_)),
                 mirrored = cloth ? 0.0 : std::max(0.0, normal.dot((sun_ + to_eye).normalized()));
    Vector3d at = sun_axes_ * x[k] - sun_corner_;
    at.head<2>() *= sun_scale_;
    face.inverse_depth[static_cast<int>(k)] = static_cast<float>(seen[k].z());
    face.corners[k] = {at.cast<float>(), static_cast<float>(0.465 + 0.085 * normal.z()),
                       static_cast<float>(0.55 * direct),
                       static_cast<float>(direct > 0 ? 0.3 * std::pow(mirrored, 40.0) : 0.0)};
  }
  Vector3d paint = objectColor(object.kind, object.index);
  const Eigen::Index walls = object.mesh.triangles.cols() - 2 * view_.tube_sides;
  if (object.kind == ObjectKind::rod && (index < walls || object.mesh.vertices.cols() % view_.tube_sides == 0) &&
      (index / 2) % view_.tube_sides % (view_.tube_sides / 2) <= 1)
    paint = {0.20, 0.24, 0.30};
  face.paint = paint.cast<float>();
  return face;
}

/// Colour of a triangle at a sample, which lies in it.
Vector3f PicturePainter::shade(std::uint32_t triangle, float column, float row, const std::vector<ObjectMesh>& objects)
{
  std::int32_t& index = face_of_[triangle];
  if (index < 0)
  {
    index = static_cast<std::int32_t>(faces_.size());
    faces_.push_back(faceOf(triangle, objects));
  }
  const Face& face = faces_[static_cast<std::size_t>(index)];
  const float x = column - face.p0.x(), y = row - face.p0.y();
  float b = (x * face.v.y() - y * face.v.x()) * face.inverse_area * face.inverse_depth[1];
  float c = (face.u.x() * y - face.u.y() * x) * face.inverse_area * face.inverse_depth[2];
  float a = (1.0f - (x * (face.v.y() - face.u.y()) + y * (face.u.x() - face.v.x())) * face.inverse_area) *
            face.inverse_depth[0];
  const float sum = 1.0f / (a + b + c);   // shares as on the surface, not on the picture
  a *= sum;
  b *= sum;
  c *= sum;
  const auto& [A, B, C] = face.corners;
  const Vector3f sun = a * A.sun + b * B.sun + c * C.sun;
  const float direct = a * A.direct + b * B.direct + c * C.direct;
  const float light = direct > 0 ? lit(static_cast<int>(std::floor(sun.x())), static_cast<int>(std::floor(sun.y())),
                                       sun.z() + face.bias)
                                 : 0.0f;
  const float gloss = light * (a * A.gloss + b * B.gloss + c * C.gloss);
  return (face.paint * (a * A.ambient + b * B.ambient + c * C.ambient + light * direct) + Vector3f::Constant(gloss))
      .cwiseMin(1.0f);
}

void PicturePainter::paintTile(int tile, const std::vector<ObjectMesh>& objects)
{
  const auto [left, top] = samples_.corner(tile);
  const int right = std::min(left + DepthTiles::kTile, width_), bottom = std::min(top + DepthTiles::kTile, height_);
  for (int row = top; row < bottom; row += kSuper)
    for (int column = left; column < right; column += kSuper)
    {
      std::array<std::uint32_t, kSuper * kSuper> seen;
      std::array<Vector3f, kSuper * kSuper> colors;
      std::size_t count = 0;
      Vector3f sum = Vector3f::Zero();
      for (int r = row; r < row + kSuper; ++r)
        for (int c = column; c < column + kSuper; ++c)
        {
          if (!(samples_.at(c, r) > 0))
            continue;
          const std::uint32_t triangle = triangles_[static_cast<std::size_t>(r) * width_ + c];
          std::size_t same = 0;   // samples of one triangle in a pixel have one colour
          while (same < count && seen[same] != triangle)
            ++same;
          seen[count] = triangle;
          colors[count] = same < count ? colors[same] : shade(triangle, c + 0.5f, r + 0.5f, objects);
          sum += colors[count++];
        }
      if (count == 0)
        continue;
      std::uint8_t* pixel = &out_[3 * (static_cast<std::size_t>(row / kSuper) * view_.width + column / kSuper)];
      const float share = 1.0f / (kSuper * kSuper);
      for (int k = 0; k < 3; ++k)
        pixel[k] = static_cast<std::uint8_t>(255.0f * share * sum[k] +
                                             share * static_cast<float>(kSuper * kSuper - count) * pixel[k] + 0.5f);
    }
}

const std::vector<std::uint8_t>& PicturePainter::paint(const std::vector<ObjectMesh>& objects)
{
  draw(objects);
  drawShadows(objects);
  out_ = background_;
  paintShadowsOnGround();
  for (const int tile : samples_.drawn())
    paintTile(tile, objects);
  return out_;
}

}   // namespace slender
