#pragma once

#include <memory>
#include <vector>

#include "slender_sim/contact/broad_phase.h"
#include "slender_sim/contact/shape.h"

namespace slender {

/// FCL's bounding volume hierarchy over a mesh's triangles, in the mesh's frame.
class MeshTree
{
public:
  explicit MeshTree(const TriangleMesh& mesh);
  ~MeshTree();
  MeshTree(MeshTree&&) noexcept;

  /// Appends the triangles whose boxes overlap `box`, in rising order.
  void query(const BoundingBox& box, std::vector<int>& triangles) const;

private:
  struct Model;
  std::unique_ptr<Model> model_;
};

}   // namespace slender
