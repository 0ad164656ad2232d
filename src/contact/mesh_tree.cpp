#include "mesh_tree.h"

#include <algorithm>
#include <stdexcept>

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/AABB.h>

namespace slender {

struct MeshTree::Model
{
  fcl::BVHModel<fcl::AABB<double>> bvh;

  void collect(int node, const fcl::AABB<double>& box, std::vector<int>& triangles) const
  {
    const auto& n = bvh.getBV(node);
    if (!n.bv.overlap(box))
      return;
    if (n.isLeaf())
    {
      triangles.push_back(n.primitiveId());
      return;
    }
    collect(n.leftChild(), box, triangles);
    collect(n.rightChild(), box, triangles);
  }
};

MeshTree::MeshTree(const TriangleMesh& mesh) : model_(std::make_unique<Model>())
{
  std::vector<fcl::Vector3<double>> vertices;
  std::vector<fcl::Triangle> triangles;
  for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i)
    vertices.emplace_back(mesh.vertices.col(i));
  for (Eigen::Index i = 0; i < mesh.triangles.cols(); ++i)
    triangles.emplace_back(mesh.triangles(0, i), mesh.triangles(1, i), mesh.triangles(2, i));
  model_->bvh.beginModel(static_cast<int>(triangles.size()), static_cast<int>(vertices.size()));
  model_->bvh.addSubModel(vertices, triangles);
  if (model_->bvh.endModel() != fcl::BVH_OK)
    throw std::runtime_error("mesh: FCL could not build its bounding volumes");
}

MeshTree::~MeshTree() = default;
MeshTree::MeshTree(MeshTree&&) noexcept = default;

void MeshTree::query(const BoundingBox& box, std::vector<int>& triangles) const
{
  const auto from = triangles.size();
  model_->collect(0, fcl::AABB<double>(box.low, box.high), triangles);
  std::sort(triangles.begin() + from, triangles.end());
}

}   // namespace slender
