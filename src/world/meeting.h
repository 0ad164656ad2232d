#pragma once

#include <string>
#include <vector>

#include "slender_sim/contact/contact_surface.h"

namespace slender {

/// Surfaces at one instant, with their names, for messages about what touches.
struct Meeting
{
  ContactSurface surface;
  Eigen::Matrix3Xd x;                 ///< points of the surface [m]
  std::vector<std::string> objects;   ///< name of each object of the surface: "rod 'rope'"
  std::vector<std::string> solids;    ///< name of each solid
  std::vector<Pose> poses;            ///< of the solids

  /// Names the object whose surface was appended last, and appends its points [m].
  void add(const std::string& name, const Eigen::Matrix3Xd& points);
  void addSolid(const std::string& name, const ContactSolid& solid, const Pose& pose);
  /// The two that are nearest to each other, of those that may touch: "thread 'honey' and obstacle 'plate'".
  std::string nearest(const ContactOptions& options) const;
  /// An object and a solid, and the distance between their surfaces [m].
  struct Near
  {
    int object, solid;
    double room;
  };
  /// Those of the first `count` objects, and solids, that may touch and are nearer to each other than the gap.
  std::vector<Near> near(int count, const ContactOptions& options) const;

private:
  double room(int object, int solid, const ContactOptions& options) const;
  /// Of the objects, thickness included [m].
  std::vector<BoundingBox> boxes() const;
};

}   // namespace slender
