#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "slender_sim/scene/snapshot_meshes.h"

/// Shaded pictures of surfaces, drawn in memory: no display, no graphics card.
namespace slender {

struct PictureView
{
  int width = 1280, height = 720;             ///< [pixels]
  Eigen::Vector3d from{0.55, -1.0, 0.45};     ///< direction from what is seen to the eye
  Eigen::AlignedBox3d box;                    ///< what is to be seen; not empty
  std::optional<double> ground;               ///< height of a floor [m]
  int tube_sides = 16;                        ///< of rods, which get stripes along their material frames
};

/// One picture after the other from the same place. Perspective, one sun with shadows, light from the sky; each pixel is the mean of four.
class PicturePainter
{
public:
  explicit PicturePainter(const PictureView& view);

  /// Rows from the top, red, green, blue per pixel.
  std::vector<std::uint8_t> paint(const std::vector<ObjectMesh>& objects);

private:
  /// The nearest surface at a point of the picture.
  struct Sample
  {
    float depth;   ///< 1 / distance along the view; 0: nothing
    std::int32_t object, triangle;
    float b, c;    ///< shares of the second and third corner
  };

  void draw(const std::vector<ObjectMesh>& objects);
  void drawShadows(const std::vector<ObjectMesh>& objects);
  double lit(const Eigen::Vector3d& x, double bias) const;
  Eigen::Vector3d shade(const ObjectMesh& object, const Eigen::Matrix3Xd& normals, const Sample& sample) const;
  Eigen::Vector3d background(int row, int column) const;

  PictureView view_;
  int width_, height_;   ///< of the samples
  double scale_;         ///< of samples per slope
  Eigen::Vector3d right_, up_, forward_, eye_, sun_;
  Eigen::Matrix3d sun_axes_;   ///< rows: across, up, towards the sun
  double sun_scale_ = 1.0;     ///< shadow cells per metre
  Eigen::Vector3d sun_corner_;
  std::vector<Sample> samples_;
  std::vector<float> shadow_;   ///< height towards the sun of what is lit
};

}  // namespace slender
