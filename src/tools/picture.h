#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "depth_tiles.h"
#include "slender_sim/scene/snapshot_meshes.h"

/// Shaded pictures of surfaces, drawn in memory: no display, no graphics card.
namespace slender {

/// Finds the place of an eye that looks along a given direction and sees all of some points, as near as possible. The
/// eye has the best distance for exactly these points: it needs only how far they reach along the normals of six
/// planes, four of which go through the borders of the picture.
class EyeFinder
{
public:
  /// `from`: direction from what is seen to the eye, not zero.
  EyeFinder(const Eigen::Vector3d& from, int width, int height);
  /// Balls of this radius around the points are to be seen.
  void add(const Eigen::Matrix3Xd& points, double radius = 0.0);
  /// Whatever another finder for the same direction and picture sees is to be seen.
  void add(const EyeFinder& other) { reach_ = reach_.cwiseMax(other.reach_); }
  /// Returns the place of the eye. At least one point must have been added.
  Eigen::Vector3d eye() const;

  const Eigen::Vector3d& right() const { return right_; }
  const Eigen::Vector3d& up() const { return up_; }
  const Eigen::Vector3d& forward() const { return forward_; }

private:
  Eigen::Vector3d right_, up_, forward_;
  double tan_width_, tan_height_;        ///< of the angles from the middle to the borders, less a margin
  Eigen::Matrix<double, 6, 3> planes_;   ///< normals: borders right, left, upper, lower; forward, backward
  Eigen::Matrix<double, 6, 1> reach_;    ///< largest product of a plane's normal and a point
};

struct PictureView
{
  int width = 1280, height = 720;           ///< [pixels]
  Eigen::Vector3d from{0.55, -1.0, 0.45};   ///< direction from what is seen to the eye
  std::optional<Eigen::Vector3d> eye;       ///< where it is; by default so that all of `box` is seen
  Eigen::AlignedBox3d box;                  ///< where objects and their shadows are; not empty
  std::optional<double> ground;             ///< height of a floor [m]
  int tube_sides = 16;                      ///< of rods, which get stripes along their material frames
};

/// One picture after the other from the same place. Perspective, one sun with shadows, light from the sky; each pixel
/// is the mean of four samples. The background is computed once. Of each picture only the parts are computed that
/// objects, or their shadows on the floor, cover.
class PicturePainter
{
public:
  explicit PicturePainter(const PictureView& view);

  /// Rows from the top, red, green, blue per pixel. Valid until the next call.
  const std::vector<std::uint8_t>& paint(const std::vector<ObjectMesh>& objects);

private:
  /// A pixel of the floor: where its shadow is looked up, and by how much its colour falls in full shadow [0..255].
  struct GroundPixel
  {
    std::uint32_t pixel;
    std::int16_t column, row;
    float height;
    std::array<float, 3> drop;
  };
  /// What is interpolated over a triangle: the place in the shadow map, and light.
  struct Corner
  {
    Eigen::Vector3f sun;   ///< column, row, height in the shadow map
    float ambient, direct, gloss;
  };
  /// A triangle that is seen, with what shading needs of it.
  struct Face
  {
    Eigen::Vector2f p0, u, v;   ///< first corner and edges in the picture [samples]
    float inverse_area;
    Eigen::Vector3f inverse_depth;   ///< of the corners
    std::array<Corner, 3> corners;
    float bias;   ///< [m] by which shadows are let in, so that a surface does not shade itself
    Eigen::Vector3f paint;
  };
  /// Where in all_ an object's triangles begin.
  struct Part
  {
    std::uint32_t first;
    /// per vertex: column, row, 1 / distance along the view (negative: behind the eye)
    Eigen::Matrix3Xd seen;
    Eigen::Matrix3Xd normals;
  };

  void placeCamera();
  Eigen::Vector3d ray(int column, int row) const;
  void paintBackground();
  void draw(const std::vector<ObjectMesh>& objects);
  void drawShadows(const std::vector<ObjectMesh>& objects);
  void paintShadowsOnGround();
  void paintTile(int tile, const std::vector<ObjectMesh>& objects);
  Eigen::Vector3f shade(std::uint32_t triangle, float column, float row, const std::vector<ObjectMesh>& objects);
  Face faceOf(std::uint32_t triangle, const std::vector<ObjectMesh>& objects) const;
  float lit(int column, int row, float height) const;

  PictureView view_;
  int width_, height_;   ///< of the samples
  double scale_;         ///< of samples per slope
  Eigen::Vector3d right_, up_, forward_, eye_, sun_;
  Eigen::Matrix3d sun_axes_;   ///< rows: across, up, towards the sun
  double sun_scale_ = 1.0;     ///< shadow cells per metre
  Eigen::Vector3d sun_corner_;
  DepthTiles samples_;                     ///< 1 / distance along the view; 0: nothing
  DepthTiles shadow_;                      ///< height towards the sun of what is lit
  std::vector<std::uint32_t> triangles_;   ///< of the samples: the nearest one, counted over all objects
  std::vector<Part> parts_;
  std::vector<std::int32_t> face_of_;   ///< of the triangles: index into faces_, -1: not made yet
  std::vector<Face> faces_;
  std::vector<std::uint8_t> background_, out_;
  std::vector<GroundPixel> ground_;
};

}   // namespace slender
